"""Chains that break careless integrators: parameters at and beyond their ends, no loss at all, a thousand links."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import warpchain
from tests.support.hard_runs import assert_sound, every_method, simulate
from warpchain import Status
from warpchain.bench.problems.hard_starts import (
    ELASTIC,
    PAPER,
    SOFT,
    dropped,
    dropped_circle,
    energy_error,
    set_down,
    turning_joints,
)
from warpchain.oracle import motion_equations


@every_method
@pytest.mark.parametrize(("stiffness", "duration"), [(1e5, 1e-2), (1e7, 1e-2), (1e9, 2e-3), (1e10, 1e-3), (1e11, 1e-3)])
def test_any_stiffness(method, stiffness, duration):
    """From k = 1e5 to 1e11 N/m an impact ends sound, the joints opening as 1/√k at most."""
    chain = PAPER.with_values({"joint_stiffness": stiffness})
    state = dropped()
    flight = simulate(chain, state, duration, method=method)
    assert_sound(flight, chain, state)
    assert flight.impulses["floor"] > 0
    # no joint can hold more than the whole energy of the fall and the spin
    energy = motion_equations.total_energy(*state, chain)
    assert flight.greatest_opening < np.sqrt(2 * energy / stiffness)


@every_method
def test_stiff_joints_hit_alike(method):
    """Right after an impact the centre of mass moves alike for k = 1e9 and 1e11: the model has a rigid limit."""
    state = dropped()
    speeds = []
    for stiffness in (1e9, 1e11):
        chain = PAPER.with_values({"joint_stiffness": stiffness})
        flight = simulate(chain, state, 5e-4, method=method)
        speeds.append(motion_equations.linear_momentum(flight.velocity[-1], chain))
    momentum = motion_equations.linear_momentum(state[1], PAPER)
    assert np.linalg.norm(speeds[0] - momentum) > 0.2 * np.linalg.norm(momentum)
    assert np.linalg.norm(speeds[0] - speeds[1]) < 0.05 * np.linalg.norm(momentum)


@every_method
@pytest.mark.parametrize(
    ("damping", "duration"), [(0.0, 1e-2), (10.0, 1e-2), (1e4, 5e-3), (1e6, 1e-4)], ids=lambda x: f"{x:g}"
)
def test_any_damping(method, damping, duration):
    """Without damping, and with so much that it is the stiffest part by far, an impact ends sound."""
    chain = SOFT.with_values({"joint_damping": damping})
    state = dropped(gap=5e-5)
    flight = simulate(chain, state, duration, method=method)
    assert_sound(flight, chain, state, within=3e-4 if damping <= 10 else 1e-5)
    assert flight.impulses["floor"] > 0
    assert (flight.losses["joint_damping"] > 0) == (damping > 0)


@every_method
def test_hopeless_damping_is_a_status(method):
    """Damping that asks explicit methods for steps of 1e-12 s ends in a limit that says so, where it stood then.

    The implicit methods and hybrid, which needs springs only after the first impulse, come as far as the impact.
    """
    chain = SOFT.with_values({"joint_damping": 1e9})
    state = dropped()
    flight = simulate(chain, state, 1e-2, method=method, step_limit=20_000)
    assert flight.status in (Status.STEP_LIMIT, Status.STEP_TOO_SMALL)
    assert 0 <= flight.time[-1] < 1e-2
    assert flight.steps_accepted + flight.steps_rejected <= 20_000
    assert energy_error(flight, chain, state) < 1e-6
    if method not in ("rodas5p", "hybrid"):
        assert_allclose(flight.position[-1], state[0] + state[1] * flight.time[-1], rtol=0, atol=1e-6)


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


@every_method
@pytest.mark.parametrize(
    "values",
    [
        {"viscous_friction": 0.0, "coulomb_friction": 0.0},
        {"viscous_friction": 1e-2},
        {"coulomb_friction": 1e-2},
        {"gravity": 0.0},
        {"gravity": 1e3},
        {"tangential_restitution": 1.0},
        {"tangential_restitution": -1.0},
        {"floor_restitution": 0.0, "chain_restitution": 0.0},
        {"inner_mass": 1.0, "inner_inertia": 1e-4},
        {"circle_radius": 6.3e-3},
        {"circle_radius": 1e-6},
    ],
    ids=str,
)
def test_extreme_values(method, values):
    """Values at and far beyond the ends of Table 1 give a sound impact."""
    chain = SOFT.with_values(values)
    position, velocity = dropped()
    state = set_down(position, parameters=chain), velocity
    flight = simulate(chain, state, 5e-3, method=method)
    assert_sound(flight, chain, state, within=1e-4)
    assert flight.impulses["floor"] > 0


@pytest.mark.parametrize(
    ("method", "tolerance", "bound"),
    [
        ("rkf78", 1e-8, 1e-5),
        ("dp5", 1e-8, 5e-5),
        ("bs32", 1e-7, 3e-3),
        ("os32", 1e-7, 3e-3),
        (1e-8, 1e-4),
        ("hybrid", 1e-7, 3e-3),
    ],
)
def test_elastic_bouncing_keeps_the_energy_for_a_second(method, tolerance, bound):
    """Without any dissipation a bouncing chain keeps its energy and its momentum along the floor over 1 s.

    A step may err by the tolerance, and in a spring that rings 10 000 rad/s for a second without damping nothing
    forgets an error: the bounds are a few times what this makes of the tolerance, and fall with it (see below).
    """
    state = dropped(links=6, fall=0.0, gap=0.02)
    flight = warpchain.simulate(ELASTIC, *state, 1.0, times=np.linspace(0, 1, 21), method=method, tolerance=tolerance)
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


@pytest.mark.parametrize(
    ("method", "steps", "slope"),
    [
        ("rkf78", [1e-4, 8e-5, 6e-5, 5e-5, 4e-5], 9),
        ("dp5", [4e-5, 2e-5, 1e-5], 5),
        ("bs32", [1e-5, 5e-6, 2.5e-6], 3),
        ("os32", [1e-5, 5e-6, 2.5e-6], 3),
        ([2e-5, 1e-5, 5e-6], 5),
        ("hybrid", [1e-5, 5e-6, 2.5e-6], 3),
    ],
)
def test_elastic_bouncing_shows_the_order(method, steps, slope):
    """The energy that bouncing undamped springs lose falls as h^p for odd order p, as h^(p+1) for even p.

    One step multiplies the energy of an oscillator by |R(iωh)|², which leaves 1 by an even power of h. Springs that
    nothing damps ring for ever, so that hybrid never takes its joints for rigid here: it is os32.
    """
    state = dropped(links=6, fall=0.0, gap=0.02)
    energy = motion_equations.total_energy(*state, ELASTIC)
    drifts = []
    for step in steps:
        # a skin beyond the height of the fall makes contact_step, not the loose tolerance, set the step
        flight = simulate(ELASTIC, state, 0.3, method=method, tolerance=0.1, contact_step=step, skin=3.0)
        assert flight.steps_accepted == pytest.approx(0.3 / step, rel=0.01)
        assert flight.impulses["floor"] > 3
        drifts.append(energy - motion_equations.total_energy(flight.position[-1], flight.velocity[-1], ELASTIC))
    assert min(drifts) > 0
    assert np.polyfit(np.log(steps), np.log(drifts), 1)[0] == pytest.approx(slope, abs=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "links"),
    [
        *((method, 1000) for method in ("rkf78", "os32", "hybrid")),
        *((method, 198) for method in ("dp5", "bs32", "rodas5p")),
    ],
)
def test_long_chains(method, links):
    """1000 links hit the floor like any other number, with every kind of method: explicit, implicit and hybrid.

    The other methods differ from one of these in coefficients alone; they have the most links that fit into scratch
    blocks of the usual width, whose kernels other tests compile as well.
    """
    state = dropped_circle(links)
    flight = simulate(SOFT, state, 5e-3, method=method, flight_tolerance=1e-4)  # as in `bench accuracy`
    assert_sound(flight, SOFT, state)
    assert flight.impulses["floor"] > 100
