"""Flights that break careless integrators: whatever the method, each ends sound or with a clear status.

Never with a silent NaN, a hang or a wrong number.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import warpchain
from tests.hard_cases.starts import (
    ELASTIC,
    PAPER,
    PRECISION,
    SOFT,
    State,
    dropped,
    dropped_circle,
    energy_error,
    energy_scale,
    every_method,
    every_precision,
    folded,
    overlapping,
    pulled_apart,
    reversing_loop,
    set_down,
    turning_joints,
)
from tests.oracle_model import contact_equations, motion_equations
from warpchain import Parameters, Status, Trajectory


@dataclass(frozen=True)
class Flight:
    """A chain from a given state, with the floor, for some time [s]."""

    parameters: Parameters
    start: Callable[[], State]
    duration: float
    settings: dict[str, Any] = field(default_factory=dict)

    def simulate(self, method: str, precision: str | None = None) -> Trajectory:
        """Its end; one that takes 20 million attempts counts as hanging."""
        limits = {"step_limit": 20_000_000, "flight_tolerance": 1e-4, "precision": precision or PRECISION[method]}
        return simulate(self.parameters, self.start(), self.duration, method=method, **limits | self.settings)


def simulate(parameters: Parameters, state: State, duration: float, **settings: Any) -> Trajectory:
    """`warpchain.simulate` at 1e-6, recording just the end."""
    usual = {"tolerance": 1e-6, "precision": PRECISION[settings["method"]]}
    return warpchain.simulate(parameters, *state, duration, times=[duration], **usual | settings)


def assert_sound(flight: Trajectory, parameters: Parameters, state: State, within: float = 1e-5) -> None:
    """Finished, finite, and the ledger closes to a fraction of the energy of motion and springs at the start."""
    assert flight.status == Status.FINISHED, flight.status.sentence
    position, velocity = flight.position[-1], flight.velocity[-1]
    assert np.all(np.isfinite(position)) and np.all(np.isfinite(velocity))
    # a flight on rigid joints is looser than springs
    closes_within = max(within, 1e-4) if flight.losses["joint_switch"] else within
    assert energy_error(flight, parameters, state) < closes_within
    assert abs(flight.losses["joint_switch"]) < 1e-3 * energy_scale(parameters, state)
    losses = [loss for name, loss in flight.losses.items() if name != "joint_switch"]
    assert all(loss > -within * energy_scale(parameters, state) for loss in losses)


def impact(parameters: Parameters, duration: float, **values: float) -> Flight:
    """An impact of a chain with other values."""
    return Flight(parameters.with_values(values), partial(dropped, gap=5e-5), duration)


PULLED_APART = Flight(PAPER, pulled_apart, 2e-3)
IN_THE_FLOOR = Flight(SOFT, partial(dropped, gap=-3e-3), 5e-3)
BOUNCING = partial(dropped, links=6, fall=0.0, gap=0.02)
"""Start of a chain that bounces for as long as nothing dissipates."""

Check = Callable[[Flight, State, Trajectory], None]


def hits_the_floor(flight: Flight, start: State, end: Trajectory) -> None:
    """An impact has impulses."""
    assert end.impulses["floor"] > 0


def opens_little(flight: Flight, start: State, end: Trajectory) -> None:
    """Joints open as 1/√k at most: none can hold more than the whole energy of the fall and the spin."""
    hits_the_floor(flight, start, end)
    energy = motion_equations.total_energy(*start, flight.parameters)
    assert end.greatest_opening < np.sqrt(2 * energy / flight.parameters.joint_stiffness)


def is_damped(flight: Flight, start: State, end: Trajectory) -> None:
    """Dampers take energy if there are any."""
    hits_the_floor(flight, start, end)
    assert (end.losses["joint_damping"] > 0) == (flight.parameters.joint_damping > 0)


def pulls_itself_together(flight: Flight, start: State, end: Trajectory) -> None:
    """Joints opened by 0.1 mm, 40 J at k = 1e9, close; the ledger tells where the energy went."""
    opening = np.linalg.norm(motion_equations.joint_opening(start[0], flight.parameters), axis=1)
    assert 1e-4 < opening.max() < 1.5e-4
    closed = np.linalg.norm(motion_equations.joint_opening(end.position[-1], flight.parameters), axis=1)
    assert closed.max() < 1e-5
    stored = motion_equations.spring_energy(start[0], flight.parameters)
    assert 0.5 * stored < end.losses["joint_damping"] < 1.01 * stored + 0.1
    assert end.greatest_opening < 2 * opening.max()


def is_stopped_in_the_floor(flight: Flight, start: State, end: Trajectory) -> None:
    """A chain that starts in the floor gains no energy and is not lifted out."""
    hits_the_floor(flight, start, end)
    first, last = (
        np.concatenate(motion_equations.link_ends(position, SOFT))[:, 1].min() - SOFT.circle_radius
        for position in (start[0], end.position[-1])
    )
    assert -first <= end.greatest_penetration["floor"] < 1e-4 - first
    assert last < first / 2
    assert motion_equations.total_energy(end.position[-1], end.velocity[-1], SOFT) < motion_equations.total_energy(
        *start, SOFT
    )


def falls_flat(flight: Flight, start: State, end: Trajectory) -> None:
    """A chain folded by 180° at both ends stays whole; strands exactly on each other have no direction to part in."""
    hits_the_floor(flight, start, end)
    assert len(contact_equations.touching_pairs(start[0], flight.parameters)) == len(start[0]) // 2 - 1
    assert end.greatest_opening < 1e-5
    assert_allclose(end.position[-1][:, 1], start[0][:, 1], atol=3e-5)
    assert_allclose(end.position[-1][:, 0], start[0][:, 0], atol=1e-5)


def collides_at_once(flight: Flight, start: State, end: Trajectory) -> None:
    """Links that start inside each other and move together collide and gain no energy."""
    assert len(contact_equations.touching_pairs(start[0], SOFT)) >= 10
    assert end.impulses["self"] > 10
    assert end.losses["self_contact"] > 0
    assert end.greatest_penetration["self"] > SOFT.circle_radius
    motion = motion_equations.total_energy(end.position[-1], end.velocity[-1], SOFT)
    assert motion <= motion_equations.total_energy(*start, SOFT) * (1 + 1e-9)


def joints_reverse(flight: Flight, start: State, end: Trajectory) -> None:
    """Joints of a turning loop come to turn the other way within microseconds, without a contact."""
    assert end.impulses == {"floor": 0, "self": 0}
    spins = [velocity[:, 2] - np.roll(velocity[:, 2], 1) for velocity in (start[1], end.velocity[-1])]
    assert np.sum(spins[0] * spins[1] < 0) > 20


def set_down_with(values: dict[str, float]) -> Flight:
    """An impact with values at or far beyond the ends of Table 1."""
    parameters = SOFT.with_values(values)
    position, velocity = dropped()
    return Flight(parameters, lambda: (set_down(position, parameters=parameters), velocity), 5e-3)


FLIGHTS: list[tuple[Check, Flight, float]] = [
    (opens_little, impact(PAPER, 1e-2, joint_stiffness=1e5), 1e-5),
    (opens_little, impact(PAPER, 1e-2, joint_stiffness=1e7), 1e-5),
    (opens_little, impact(PAPER, 2e-3, joint_stiffness=1e9), 1e-5),
    (opens_little, impact(PAPER, 1e-3, joint_stiffness=1e10), 1e-5),
    (opens_little, impact(PAPER, 1e-3, joint_stiffness=1e11), 1e-5),
    (is_damped, impact(SOFT, 1e-2, joint_damping=0.0), 3e-4),
    (is_damped, impact(SOFT, 1e-2, joint_damping=10.0), 3e-4),
    (is_damped, impact(SOFT, 5e-3, joint_damping=1e4), 1e-5),
    (is_damped, impact(SOFT, 1e-4, joint_damping=1e6), 1e-5),
    (pulls_itself_together, PULLED_APART, 1e-5),
    (pulls_itself_together, replace(PULLED_APART, parameters=SOFT), 1e-5),
    (is_stopped_in_the_floor, IN_THE_FLOOR, 1e-5),
    *(
        (falls_flat, Flight(parameters, partial(folded, n, parameters.circle_radius + 2e-5), 5e-3), 1e-6)
        for n in (4, 8, 20)
        for parameters in (PAPER, SOFT)
    ),
    (collides_at_once, Flight(SOFT, overlapping, 5e-3), 1e-4),
    (joints_reverse, Flight(PAPER, reversing_loop, 1e-4), 1e-4),
    (hits_the_floor, set_down_with({"viscous_friction": 0.0, "coulomb_friction": 0.0}), 1e-4),
    (hits_the_floor, set_down_with({"viscous_friction": 1e-2}), 1e-4),
    (hits_the_floor, set_down_with({"coulomb_friction": 1e-2}), 1e-4),
    (hits_the_floor, set_down_with({"gravity": 0.0}), 1e-4),
    (hits_the_floor, set_down_with({"gravity": 1e3}), 1e-4),
    (hits_the_floor, set_down_with({"tangential_restitution": 1.0}), 1e-4),
    (hits_the_floor, set_down_with({"tangential_restitution": -1.0}), 1e-4),
    (hits_the_floor, set_down_with({"floor_restitution": 0.0, "chain_restitution": 0.0}), 1e-4),
    (hits_the_floor, set_down_with({"inner_mass": 1.0, "inner_inertia": 1e-4}), 1e-4),
    (hits_the_floor, set_down_with({"circle_radius": 6.3e-3}), 1e-4),
    (hits_the_floor, set_down_with({"circle_radius": 1e-6}), 1e-4),
]
"""What must hold, the flight, and how well its energy ledger closes."""


@every_precision
@pytest.mark.parametrize(("check", "flight", "within"), FLIGHTS, ids=[check.__name__ for check, _, _ in FLIGHTS])
def test_flights(check: Check, flight: Flight, within: float, method: str, precision: str) -> None:
    """Every flight ends sound, and as its check says."""
    start, end = flight.start(), flight.simulate(method, precision)
    assert_sound(end, flight.parameters, start, within)
    check(flight, start, end)


@every_method
def test_hopeless_damping_is_a_status(method):
    """Damping that asks explicit methods for steps of 1e-12 s ends in a limit that says so, where it stood then.

    hybrid, which needs springs only after the first impulse, comes as far as the impact.
    """
    hopeless = Flight(SOFT.with_values({"joint_damping": 1e9}), dropped, 1e-2, {"step_limit": 20_000})
    start, flight = hopeless.start(), hopeless.simulate(method)
    assert flight.status in (Status.STEP_LIMIT, Status.STEP_TOO_SMALL)
    assert 0 <= flight.time[-1] < 1e-2
    assert flight.steps_accepted + flight.steps_rejected <= 20_000
    assert energy_error(flight, hopeless.parameters, start) < 1e-6
    if method != "hybrid":
        assert_allclose(flight.position[-1], start[0] + start[1] * flight.time[-1], rtol=0, atol=1e-6)


@every_method
@pytest.mark.parametrize("smoothing", [1e-3, 1e-4, 1e-6], ids=lambda x: f"{x:g}")
def test_any_smoothing_of_friction(method, smoothing):
    """However sharp friction's change of sign, joints that stop turning stay so, to some tens of tolerances of ω."""
    chain = PAPER.with_values({"friction_smoothing": smoothing, "gravity": 0.0})
    position, velocity = turning_joints()  # friction stops their relative 0.02 rad/s within 10 µs
    instants = np.linspace(0.0, 1e-4, 11)
    flight = warpchain.simulate(chain, position, velocity, 1e-4, times=instants, method=method, step_limit=100_000)
    assert_sound(flight, chain, (position, velocity))
    turning = np.ptp(flight.velocity[:, :, 2], axis=1)
    assert turning[0] == pytest.approx(0.02)
    assert turning[1:].max() < 50 * 1e-6 * np.abs(velocity[:, 2]).max()
    # the loop as a whole goes on turning
    assert_allclose(flight.velocity[-1][:, 2].mean(), velocity[:, 2].mean(), rtol=1e-4)


@pytest.mark.parametrize(
    ("method", "tolerance", "bound", "precision"),
    [
        ("rkf78", 1e-8, 1e-5, "double"),
        ("dp5", 1e-8, 5e-5, "double"),
        ("bs32", 1e-7, 3e-3, "double"),
        ("os32", 1e-7, 3e-3, "double"),
        pytest.param("hybrid", 1e-7, 3e-3, "double", marks=pytest.mark.thorough),
        ("os32", 1e-6, 3e-2, "mixed"),
        ("hybrid", 1e-6, 3e-2, "mixed"),
    ],
)
def test_elastic_bouncing_keeps_the_energy_for_a_second(method, tolerance, bound, precision):
    """Without any dissipation a bouncing chain keeps its energy and its momentum along the floor over 1 s.

    A step may err by the tolerance, and in a spring that rings 10 000 rad/s for a second without damping nothing
    forgets an error: the bounds are a few times what this makes of the tolerance.
    """
    state = BOUNCING()
    flight = warpchain.simulate(
        ELASTIC, *state, 1.0, times=np.linspace(0, 1, 21), method=method, tolerance=tolerance, precision=precision
    )
    assert flight.status == Status.FINISHED
    energy = [
        motion_equations.total_energy(x, v, ELASTIC) for x, v in zip(flight.position, flight.velocity, strict=True)
    ]
    assert np.abs(np.array(energy) / energy[0] - 1).max() < bound
    assert flight.impulses["floor"] > 10
    assert flight.impulses["self"] > 10
    assert max(map(abs, flight.losses.values())) < 1e-12 * energy[0]
    momentum = np.array([motion_equations.linear_momentum(v, ELASTIC)[0] for v in flight.velocity])
    speeds = motion_equations.link_masses(6, ELASTIC) @ np.abs(state[1][:, 0])
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * speeds
    assert flight.position[:, :, 1].min() > 0


@pytest.mark.parametrize("method", ["os32", pytest.param("hybrid", marks=pytest.mark.thorough)])
def test_long_chains(method):
    """590 links hit the floor like any other number; other explicit methods differ in coefficients alone."""
    fall = Flight(SOFT, partial(dropped_circle, 590), 5e-3)
    flight = fall.simulate(method)
    assert_sound(flight, SOFT, fall.start())
    assert flight.impulses["floor"] > 100


@every_precision
def test_whole_turns_of_a_link_mean_nothing(method, precision):
    """Angles that are up to 10 000 turns on give the same motion, to the relative tolerance of such angles."""
    tolerance = 1e-6 if precision == "mixed" else 1e-8
    position, velocity = dropped()
    plain = simulate(SOFT, (position, velocity), 5e-4, method=method, precision=precision, tolerance=tolerance)
    for turns in (-1, 10_000):
        turned = position + np.array([0.0, 0.0, 2 * np.pi * turns])
        flight = simulate(SOFT, (turned, velocity), 5e-4, method=method, precision=precision, tolerance=tolerance)
        assert flight.status == Status.FINISHED
        assert np.abs(flight.position[-1] - plain.position[-1])[:, :2].max() < (1e-5 if precision == "mixed" else 1e-6)


@every_precision
@pytest.mark.parametrize("factor", [1e10, 1e100, 1e200, 1e305])
def test_absurd_speeds_are_a_status(method, precision, factor):
    """Speeds beyond what numbers can hold end at the start with a status; no NaN and no infinity comes back."""
    position, velocity = dropped()
    flight = simulate(SOFT, (position, velocity * factor), 1e-2, method=method, precision=precision)
    assert flight.status in (Status.STEP_TOO_SMALL, Status.NOT_FINITE)
    assert flight.status == Status.NOT_FINITE or factor < 1e305
    assert flight.time[-1] == 0.0
    assert_array_equal(flight.position[-1], position)
    assert_array_equal(flight.velocity[-1], velocity * factor)
    assert np.all(np.isfinite(list(flight.losses.values())))


@every_method
def test_trajectory_ends_where_the_chain_broke_off(method):
    """A run that fails midway returns the instants before, then the state in which it stopped, and its status."""
    state = dropped()
    instants = np.linspace(0.0, 1e-2, 11)
    flight = warpchain.simulate(SOFT, *state, 1e-2, times=instants, method=method, step_limit=300)
    assert flight.status == Status.STEP_LIMIT
    assert flight.steps_accepted + flight.steps_rejected == 300
    kept = len(flight.time)
    assert 1 < kept < 11
    assert_array_equal(flight.time[:-1], instants[: kept - 1])
    assert instants[kept - 2] < flight.time[-1] <= instants[kept - 1]
    assert len(flight.position) == len(flight.velocity) == kept
    assert np.all(np.isfinite(flight.position))


@every_method
def test_more_pairs_than_the_list_holds_is_a_status(method):
    """More close pairs than the neighbour list holds end in list_overflow, not in contacts that are overlooked."""
    flight = simulate(SOFT, folded(60), 1e-3, method=method, skin=1.0)
    assert flight.status == Status.LIST_OVERFLOW
    assert flight.time[-1] == 0.0
