"""The hybrid method: rigid joints against dense algebra and SciPy, the ways to springs and back, and bouncing runs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import warpchain
from tests.oracle_model import motion_equations
from tests.support.rigid_chains import PAPER, exact_rigid_flight, falling, loop, projected, rigid_motion, visit
from warpchain import Status, preset
from warpchain.kernels.methods.w_tableaus import ROS34PW2

SOFT = preset("soft")
LENGTHS = (4, 6, 8, 10, 12, 14, 16, 22, 60)
"""Every way in which a loop is cut into eight segments: less than a link each, full ones, short ones, one of each."""


def shaken(links, size, parameters=PAPER, seed=1):
    """The same loop with its links displaced by some size [m] and pushed by that times 1000/s."""
    position, velocity = loop(links, parameters)
    noise = np.random.default_rng(seed).normal(size=(2, links, 3)) * size * [1, 1, 2 / parameters.link_length]
    return position + noise[0], velocity + 1e3 * noise[1]


def energy(position, velocity, parameters=PAPER):
    """Total energy [J]."""
    return motion_equations.total_energy(position, velocity, parameters)


# --- coefficients ---


def test_coefficients_fulfil_the_order_conditions():
    """All conditions of order 3 for any matrix hold for b, those of order 2 for b̂, to 1e-14; b is stiffly accurate.

    J. Rang, L. Angermann (2005): α and Γ in every combination.
    """
    table = ROS34PW2
    a, g = np.zeros((4, 4)), table.gamma * np.eye(4)
    for i in range(4):
        a[i, :i], g[i, :i] = table.nodes[i], table.couplings[i]
    one, b, embedded = np.ones(4), np.array(table.weights), np.array(table.embedded)
    for weights, terms, value in (
        (b, one, 1),
        (b, a @ one, 1 / 2),
        (b, g @ one, 0),
        (b, (a @ one) ** 2, 1 / 3),
        (b, a @ a @ one, 1 / 6),
        (b, a @ g @ one, 0),
        (b, g @ a @ one, 0),
        (b, g @ g @ one, 0),
        (embedded, one, 1),
        (embedded, a @ one, 1 / 2),
        (embedded, g @ one, 0),
    ):
        assert abs(weights @ terms - value) < 1e-14 * max(1, np.abs(weights * terms).max())
    assert_allclose((a + g)[-1], b, atol=1e-15)


# --- rigid joints ---


@pytest.mark.parametrize("links", LENGTHS)
def test_accelerations_are_those_of_the_dense_system(links):
    """Of a loop whose joints are closed nothing moves in closing them, and its accelerations solve M v̇ + Gᵀ F = Q."""
    position, velocity = loop(links)
    outcome = visit(position, velocity, PAPER)
    assert outcome.closed
    assert_allclose(outcome.position, position, rtol=0, atol=1e-13)
    assert_allclose(outcome.velocity, velocity, rtol=0, atol=1e-10)
    expected, _ = rigid_motion(position, velocity, PAPER)
    assert_allclose(outcome.acceleration, expected, rtol=0, atol=1e-7 * np.abs(expected).max())
    assert abs(outcome.closing) < 1e-13


@pytest.mark.parametrize("links", LENGTHS)
def test_closing_is_the_projection_in_the_metric_of_the_masses(links):
    """Closing goes to the nearest closed state, keeps momentum and centre to rounding, books just what it takes."""
    position, velocity = shaken(links, 1e-8)
    outcome = visit(position, velocity, PAPER)
    assert outcome.closed
    expected = projected(position, velocity, PAPER)
    assert_allclose(outcome.position, expected[0], rtol=0, atol=2e-12)
    assert_allclose(outcome.velocity, expected[1], rtol=0, atol=1e-10)
    assert np.abs(outcome.position - position).max() > 1e-9
    assert np.abs(motion_equations.joint_opening(outcome.position, PAPER)).max() < 1e-11
    rates = motion_equations.joint_opening_rate(outcome.position, outcome.velocity, PAPER)
    assert np.abs(rates).max() < 1e-12
    mass = motion_equations.link_masses(links, PAPER)
    for before, after in ((position, outcome.position), (velocity, outcome.velocity)):
        assert np.abs(mass @ (after - before)[:, :2]).max() < 1e-15 * mass.sum()
    lost = energy(position, velocity) - energy(outcome.position, outcome.velocity)
    assert abs(outcome.closing - lost) < 1e-13
    assert lost > 1e-9


@pytest.mark.parametrize(("size", "parameters"), [(1e-6, PAPER), (1e-7, PAPER.with_values({"joint_stiffness": 1e4}))])
def test_springs_that_ring_or_stretch_stay_springs(size, parameters):
    """A chain that swings on its springs, or whose springs are too soft, is left as it is to the bit."""
    position, velocity = shaken(12, size, parameters)
    outcome = visit(position, velocity, parameters)
    assert not outcome.closed
    assert_array_equal(outcome.position, position)
    assert_array_equal(outcome.velocity, velocity)


@pytest.mark.parametrize("links", LENGTHS)
def test_opening_gives_springs_the_forces_of_rigid_joints(links):
    """Opened joints pull with k C = F, nothing else moves, and what that takes from nowhere is booked as −½ Σ F²/k."""
    position, velocity = loop(links)
    _, force = rigid_motion(position, velocity, PAPER)
    outcome = visit(position, velocity, PAPER, opens=True)
    pull = PAPER.joint_stiffness * motion_equations.joint_opening(outcome.position, PAPER)
    assert_allclose(pull, force, rtol=0, atol=1e-5 * np.abs(force).max())
    assert_allclose(outcome.velocity, velocity, rtol=0, atol=1e-10)
    held = np.sum(force**2) / (2 * PAPER.joint_stiffness)
    assert held > 1e-9
    assert outcome.opening == pytest.approx(-held, rel=1e-4)
    mass = motion_equations.link_masses(links, PAPER)
    assert np.abs(mass @ (outcome.position - position)[:, :2]).max() < 1e-15 * mass.sum()


def test_way_to_springs_and_back_costs_nothing():
    """Opening and closing again leads to the same state, and the two bookings cancel."""
    position, velocity = loop(20)
    there = visit(position, velocity, PAPER, opens=True)
    back = visit(there.position, there.velocity, PAPER)
    assert back.closed
    assert_allclose(back.position, position, rtol=0, atol=1e-12)
    assert_allclose(back.velocity, velocity, rtol=0, atol=1e-7)
    assert abs(there.opening + back.closing) < 1e-4 * abs(there.opening)


# --- flight ---


@pytest.mark.parametrize("links", [8, 12])
def test_error_of_a_flight_falls_with_order_three(links):
    """Errors of places, speeds and of the friction booked fall as h³ against DOP853, friction smooth."""
    chain = PAPER.with_values({"friction_smoothing": 20.0})
    position, velocity = loop(links, chain)
    duration = 4e-3
    place, speed = exact_rigid_flight(position, velocity, chain, duration)
    lost = energy(position, velocity) - energy(place, speed)
    counts = [8, 16, 32]
    errors = []
    for count in counts:
        end = visit(position, velocity, chain, h=duration / count, steps=count)
        deviations = end.position - place, end.velocity - speed, np.array(end.friction - lost)
        errors.append([np.sqrt(np.mean(d**2)) for d in deviations])
    slopes = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert np.abs(slopes - 3).max() < 0.3, slopes
    assert errors[-1][0] < 1e-6


def test_flight_keeps_momentum_energy_and_joints():
    """Without friction and gravity: momentum to rounding, angular momentum and energy to h³, joints closed."""
    chain = PAPER.with_values({"viscous_friction": 0.0, "coulomb_friction": 0.0, "gravity": 0.0})
    position, velocity = loop(20, chain)
    end = visit(position, velocity, chain, h=1e-4, steps=100)
    moving = motion_equations.link_masses(20, chain) @ np.linalg.norm(velocity[:, :2], axis=1)
    drift = motion_equations.linear_momentum(end.velocity, chain) - motion_equations.linear_momentum(velocity, chain)
    assert np.abs(drift).max() < 1e-14 * moving
    before = motion_equations.angular_momentum(position, velocity, chain)
    assert abs(motion_equations.angular_momentum(end.position, end.velocity, chain) / before - 1) < 1e-4
    assert abs(energy(end.position, end.velocity, chain) / energy(position, velocity, chain) - 1) < 1e-4
    assert np.abs(motion_equations.joint_opening(end.position, chain)).max() < 1e-11
    assert end.friction == 0.0


@pytest.mark.parametrize(("name", "duration", "within"), [("paper", 3e-4, 2e-6), ("soft", 2e-3, 5e-5)])
def test_flight_agrees_with_springs(name, duration, within):
    """A flight at a tight tolerance differs from that of springs, by DOP853, by their stretch: 1e-6 and 1e-5."""
    parameters = preset(name)
    start = loop(12, parameters)
    position, velocity, _ = motion_equations.solve_flight(*start, [0.0, duration], parameters)
    flight = warpchain.simulate(name, *start, duration, times=[duration], method="hybrid", flight_tolerance=1e-6)
    assert flight.losses["joint_damping"] == 0.0
    assert np.abs(flight.position[-1] - position[-1])[:, :2].max() < within * 0.1
    assert np.abs(flight.velocity[-1] - velocity[-1])[:, :2].max() < 100 * within


# --- bouncing ---


@pytest.mark.parametrize(("parameters", "duration"), [(PAPER, 3e-3), (SOFT, 3e-3)], ids=["paper", "soft"])
def test_impacts_push_as_with_springs(parameters, duration):
    """The floor's impulse in the first milliseconds, the mean of 8 starts, is rkf78's to 2 %; the ledger closes."""
    pushes = {"hybrid": [], "rkf78": []}
    for phase in (np.arange(8) + 0.5) / 8:
        start = falling(20, parameters, phase)
        for method, push in pushes.items():
            run = warpchain.simulate(parameters, *start, duration, times=[duration], method=method, tolerance=1e-6)
            assert run.status == Status.FINISHED
            assert run.impulses["floor"] > 0
            change = motion_equations.linear_momentum(run.velocity[-1] - start[1], parameters)
            push.append(change[1] + duration * parameters.gravity * motion_equations.link_masses(20, parameters).sum())
            at_start, at_end = energy(*start, parameters), energy(run.position[-1], run.velocity[-1], parameters)
            assert abs(at_start - at_end - sum(run.losses.values())) < 1e-4 * at_start
            assert abs(run.losses["joint_switch"]) < 1e-3 * at_start
            assert (run.losses["joint_switch"] != 0) == (method == "hybrid")
    assert np.mean(pushes["hybrid"]) == pytest.approx(np.mean(pushes["rkf78"]), rel=0.02)
