"""The hybrid method: rigid joints against dense algebra and SciPy, the ways to springs and back, and bouncing runs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import warpchain
from tests.oracle_model import motion_equations
from tests.support.arrays import Array
from tests.support.presets import SOFT
from tests.support.rigid_chains import PAPER, exact_rigid_flight, loop, projected, rigid_motion
from warpchain import Parameters, Status, preset
from warpchain.chain.start_shapes import ellipse, lay_chain

SMOOTH = PAPER.with_values({"friction_smoothing": 20.0})
LENGTHS = (4, 6, 8, 10, 12, 14, 16, 22, 60)
"""Every way in which a loop is cut into eight segments: less than a link each, full ones, short ones, one of each."""
MOMENT = 1e-9
"""Duration [s] of a run in which nothing moves."""


def shaken(links: int, size: float, parameters: Parameters = PAPER) -> tuple[Array, Array]:
    """The same loop with its links displaced by some size [m] and pushed by that times 1000/s."""
    position, velocity = loop(links, parameters)
    noise = np.random.default_rng(1).normal(size=(2, links, 3)) * size * [1, 1, 2 / parameters.link_length]
    return position + noise[0], velocity + 1e3 * noise[1]


def fly(parameters: Parameters, position: Array, velocity: Array, duration: float, **settings: object):
    """A flight by `hybrid`: the trajectory, of the end only unless `times` are given."""
    flight = warpchain.simulate(
        parameters, position, velocity, duration, method="hybrid", **{"times": [duration], **settings}
    )
    assert flight.status == Status.FINISHED
    return flight


# --- rigid joints ---


@pytest.mark.parametrize("links", LENGTHS)
def test_rigid_flight_solves_the_dense_equations(links: int) -> None:
    """Whatever the number of links, a flight is that of M v̇ + Gᵀ F = Q with closed joints, which stay closed."""
    start = loop(links, SMOOTH)
    flight = fly(SMOOTH, *start, 1e-3, flight_tolerance=1e-9)
    position, velocity = exact_rigid_flight(*start, SMOOTH, 1e-3)
    assert np.abs(flight.position[-1] - position).max() < 1e-8
    assert np.abs(flight.velocity[-1] - velocity).max() < 1e-6
    assert np.abs(motion_equations.joint_opening(flight.position[-1], SMOOTH)).max() < 1e-11
    assert abs(flight.losses["joint_switch"]) < 1e-13


@pytest.mark.parametrize("links", LENGTHS)
def test_closing_is_the_projection_in_the_metric_of_the_masses(links: int) -> None:
    """Closing goes to the nearest closed state, and books just what it takes."""
    start = shaken(links, 1e-8)
    end = fly(PAPER, *start, MOMENT)
    position, velocity = projected(*start, PAPER)
    assert_allclose(end.position[-1], position + MOMENT * velocity, rtol=0, atol=3e-12)
    assert_allclose(end.velocity[-1], velocity, rtol=0, atol=1e-4)
    assert np.abs(position - start[0]).max() > 1e-9
    lost = motion_equations.total_energy(*start, PAPER) - motion_equations.total_energy(position, velocity, PAPER)
    assert lost > 1e-9
    assert abs(end.losses["joint_switch"] - lost) < 1e-13


@pytest.mark.parametrize(("size", "parameters"), [(1e-6, PAPER), (1e-7, PAPER.with_values({"joint_stiffness": 1e4}))])
def test_springs_that_ring_or_stretch_stay_springs(size: float, parameters: Parameters) -> None:
    """A chain that swings on its springs, or whose springs are too soft, is left as it is."""
    start = shaken(12, size, parameters)
    end = fly(parameters, *start, MOMENT)
    assert end.losses["joint_switch"] == 0.0
    assert_allclose(end.position[-1][:, :2], (start[0] + MOMENT * start[1])[:, :2], rtol=0, atol=1e-11)


@pytest.mark.parametrize("links", LENGTHS)
def test_opening_gives_springs_the_forces_of_rigid_joints(links: int) -> None:
    """Joints that a touch opens pull with k C = F, and what that takes from nowhere is booked as −½ Σ F²/k."""
    smooth_floor = PAPER.with_values({"floor_friction": 0.0})
    position, velocity = loop(links, smooth_floor)
    ends = np.stack(motion_equations.link_ends(position, PAPER))
    side, lowest = np.unravel_index(np.argmin(ends[..., 1]), ends.shape[:2])
    position[:, 1] -= ends[side, lowest, 1] - PAPER.circle_radius + 1e-9
    lever = ends[side, lowest, 0] - position[lowest, 0]
    velocity[:, 1] -= velocity[lowest, 1] + velocity[lowest, 2] * lever + 1e-5
    _, force = rigid_motion(position, velocity, smooth_floor)
    end = fly(smooth_floor, position, velocity, MOMENT)
    assert end.impulses["floor"] > 0
    pull = PAPER.joint_stiffness * motion_equations.joint_opening(end.position[-1], PAPER)
    assert_allclose(pull, force, rtol=0, atol=1e-4 * np.abs(force).max())
    assert end.losses["joint_switch"] == pytest.approx(-np.sum(force**2) / (2 * PAPER.joint_stiffness), rel=1e-4)


# --- flight ---


@pytest.mark.parametrize("links", [8, 12])
def test_error_of_a_flight_falls_with_order_three(links: int) -> None:
    """Errors of places, speeds and of the friction booked fall as h³ against DOP853, friction smooth."""
    start, duration = loop(links, SMOOTH), 4e-3
    place, speed = exact_rigid_flight(*start, SMOOTH, duration)
    lost = motion_equations.total_energy(*start, SMOOTH) - motion_equations.total_energy(place, speed, SMOOTH)
    counts, errors = [8, 16, 32], []
    for count in counts:
        marks = duration / count * np.arange(1, count + 1)
        end = fly(SMOOTH, *start, duration, times=marks, flight_tolerance=0.1)
        assert end.steps_accepted < count + 9 and end.steps_rejected == 0
        friction = np.array(end.losses["joint_friction"])
        deviations = end.position[-1] - place, end.velocity[-1] - speed, friction - lost
        errors.append([np.sqrt(np.mean(d**2)) for d in deviations])
    slopes = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert np.abs(slopes - 3).max() < 0.3, slopes
    assert errors[-1][0] < 1e-6


@pytest.mark.parametrize(("name", "duration", "within"), [("paper", 1e-4, 2e-6), ("soft", 2e-3, 5e-5)])
def test_flight_agrees_with_springs(name: str, duration: float, within: float) -> None:
    """A flight at a tight tolerance differs from that of springs, by DOP853, by their stretch: 1e-6 and 1e-5."""
    parameters = preset(name)
    start = loop(12, parameters)
    position, velocity = motion_equations.solve_flight(*start, duration, parameters)
    flight = fly(parameters, *start, duration, flight_tolerance=1e-6)
    assert flight.losses["joint_damping"] == 0.0
    assert np.abs(flight.position[-1] - position)[:, :2].max() < within * 0.1
    assert np.abs(flight.velocity[-1] - velocity)[:, :2].max() < 100 * within


# --- bouncing ---


def falling(links: int, parameters: Parameters, phase: float) -> tuple[Array, Array]:
    """A circulating ellipse 0.1 mm above the floor, falling at 2 m/s; phase: place of its first joint."""
    position, velocity = lay_chain(ellipse(1.3), links, parameters.link_length, 2.0, phase)
    ends = np.concatenate(motion_equations.link_ends(position, parameters))
    position[:, 1] += parameters.circle_radius + 1e-4 - ends[:, 1].min()
    return position, velocity - [0.0, 2.0, 0.0]


@pytest.mark.parametrize("parameters", [PAPER, SOFT], ids=["paper", "soft"])
def test_impacts_push_as_with_springs(parameters: Parameters) -> None:
    """The floor's impulse in the first milliseconds, the mean of 8 starts, is rkf78's to 2 %; the ledger closes.

    Bursts are in mixed precision, as in a walk by default, for which other tests compile the kernel.
    """
    duration, mass = 3e-3, motion_equations.link_masses(20, parameters).sum()
    pushes: dict[str, list[float]] = {"hybrid": [], "rkf78": []}
    for phase in (np.arange(8) + 0.5) / 8:
        start = falling(20, parameters, phase)
        for method, push in pushes.items():
            options = {"method": method, "tolerance": 1e-6, "precision": "mixed" if method == "hybrid" else "double"}
            run = warpchain.simulate(parameters, *start, duration, times=[duration], **options)
            assert run.status == Status.FINISHED
            assert run.impulses["floor"] > 0
            change = motion_equations.linear_momentum(run.velocity[-1] - start[1], parameters)
            push.append(change[1] + duration * parameters.gravity * mass)
            at_start = motion_equations.total_energy(*start, parameters)
            at_end = motion_equations.total_energy(run.position[-1], run.velocity[-1], parameters)
            assert abs(at_start - at_end - sum(run.losses.values())) < 1e-4 * at_start
            assert abs(run.losses["joint_switch"]) < 1e-3 * at_start
            assert (run.losses["joint_switch"] != 0) == (method == "hybrid")
    assert np.mean(pushes["hybrid"]) == pytest.approx(np.mean(pushes["rkf78"]), rel=0.02)
