"""Starts that break careless integrators: each ends sound or with a clear status, never with a wrong number."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import warpchain
from tests.support.hard_runs import assert_sound, every_method, simulate
from warpchain import Status
from warpchain.bench.problems.hard_starts import PAPER, SOFT, dropped, folded, overlapping, pulled_apart
from warpchain.oracle import contact_equations, motion_equations


@every_method
@pytest.mark.parametrize("parameters", [PAPER, SOFT], ids=["paper", "soft"])
def test_joints_pulled_apart(method, parameters):
    """Joints opened by 0.1 mm, 40 J at k = 1e9, pull themselves together; the ledger tells where the energy went."""
    state = pulled_apart()
    position = state[0]
    opening = np.linalg.norm(motion_equations.joint_opening(position, parameters), axis=1)
    assert 1e-4 < opening.max() < 1.5e-4
    flight = simulate(parameters, state, 2e-3, method=method)
    assert_sound(flight, parameters, state)
    closed = np.linalg.norm(motion_equations.joint_opening(flight.position[-1], parameters), axis=1)
    assert closed.max() < 1e-5
    stored = motion_equations.spring_energy(position, parameters)
    assert 0.5 * stored < flight.losses["joint_damping"] < 1.01 * stored + 0.1
    assert flight.greatest_opening < 2 * opening.max()


@every_method
@pytest.mark.parametrize("depth", [3e-3, 0.3])
def test_start_inside_the_floor(method, depth):
    """A chain that starts in the floor or far below it is stopped there: it gains no energy and is not lifted out."""
    state = dropped(gap=-depth)
    flight = simulate(SOFT, state, 5e-3, method=method)
    assert_sound(flight, SOFT, state)
    assert flight.impulses["floor"] > 0
    assert depth <= flight.greatest_penetration["floor"] < depth + 1e-4
    at_end = motion_equations.total_energy(flight.position[-1], flight.velocity[-1], SOFT)
    assert at_end < motion_equations.total_energy(*state, SOFT)
    ends = np.concatenate(motion_equations.link_ends(flight.position[-1], SOFT))
    assert ends[:, 1].min() - SOFT.circle_radius < -depth / 2


@every_method
@pytest.mark.parametrize("links", [4, 8, 20])
@pytest.mark.parametrize("parameters", [PAPER, SOFT], ids=["paper", "soft"])
def test_folded_back_on_itself(method, links, parameters):
    """A chain folded by 180° at both ends, its joints on top of each other, falls flat and stays whole."""
    position, velocity = folded(links, height=parameters.circle_radius + 2e-5)
    state = position, velocity
    assert len(contact_equations.touching_pairs(position, parameters)) == links // 2 - 1
    flight = simulate(parameters, state, 5e-3, method=method)
    assert_sound(flight, parameters, state, within=1e-6)
    assert flight.impulses["floor"] > 0
    assert flight.greatest_opening < 1e-5
    # strands exactly on each other have no direction to part in
    assert_allclose(flight.position[-1][:, 1], state[0][:, 1], atol=3e-5)
    assert_allclose(flight.position[-1][:, 0], state[0][:, 0], atol=1e-5)


@every_method
def test_overlapping_links(method):
    """Links that start inside each other and move together collide at once, gain no energy and stay finite."""
    state = overlapping()
    assert len(contact_equations.touching_pairs(state[0], SOFT)) >= 10
    flight = simulate(SOFT, state, 5e-3, method=method)
    assert_sound(flight, SOFT, state, within=1e-4)
    assert flight.impulses["self"] > 10
    assert flight.losses["self_contact"] > 0
    assert flight.greatest_penetration["self"] > SOFT.circle_radius
    motion = motion_equations.total_energy(flight.position[-1], flight.velocity[-1], SOFT)
    assert motion <= motion_equations.total_energy(*state, SOFT) * (1 + 1e-9)


@every_method
def test_whole_turns_of_a_link_mean_nothing(method):
    """Angles that are up to 10 000 turns on give the same motion, to the relative tolerance of such angles.

    Stability keeps explicit steps short whatever the tolerance; those of implicit methods grow with it.
    """
    position, velocity = dropped()
    plain = simulate(SOFT, (position, velocity), 5e-4, method=method, tolerance=1e-8)
    for turns in (-1, 10_000):
        turned = position + np.array([0.0, 0.0, 2 * np.pi * turns])
        flight = simulate(SOFT, (turned, velocity), 5e-4, method=method, tolerance=1e-8)
        assert flight.status == Status.FINISHED
        within = 1e-5 if method.startswith("rodas") else 1e-6
        assert np.abs(flight.position[-1] - plain.position[-1])[:, :2].max() < within


@every_method
@pytest.mark.parametrize("factor", [1e10, 1e100, 1e200, 1e305])
def test_absurd_speeds_are_a_status(method, factor):
    """Speeds beyond what numbers can hold end at the start with a status; no NaN and no infinity comes back."""
    position, velocity = dropped()
    flight = simulate(SOFT, (position, velocity * factor), 1e-2, method=method)
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
def test_crowd_beyond_the_list_is_a_status(method):
    """More close pairs than the neighbour list holds end in list_overflow, not in contacts that are overlooked."""
    flight = simulate(SOFT, folded(60), 1e-3, method=method, skin=1.0)
    assert flight.status == Status.LIST_OVERFLOW
    assert flight.time[-1] == 0.0
