"""Free flight against SciPy and closed forms, orders of the methods, invariants, and the same bits every time."""

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import warpchain
from tests.oracle_model import motion_equations
from tests.oracle_model.circular_loop import circular_loop, circular_loop_force
from tests.support.presets import PAPER, SOFT
from warpchain import Status, preset
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.kernels.methods.method import find_method, method_names

METHODS = [name for name in method_names() if not find_method(name).has_rigid_flight]
ORDER = {name: find_method(name).tableau.order for name in METHODS}
ACCURATE = [name for name in METHODS if ORDER[name] >= 3]
"""Methods that follow tight tolerances in a time that a test can take."""
FRICTIONLESS = {"joint_damping": 0.0, "viscous_friction": 0.0, "coulomb_friction": 0.0}
LINKS = 12
HIGH = np.array([0.0, 0.05, 0.0])
"""Where the loops fly: out of the floor's reach, yet so near to the origin that rounding stays small."""


def spinning_ellipse(parameters, links=LINKS):
    """An ellipse whose links circulate: a deforming loop high above the floor, its springs unstretched."""
    position, velocity = lay_chain(ellipse(1.5), links, parameters.link_length, 2.0, 0.1)
    return position + HIGH, velocity


def greatest(values, expected):
    """Greatest error over the greatest value, of places and angles (columns 0 and 1, and 2) apart."""
    columns = (slice(0, 2), slice(2, 3))
    return max(np.abs(values[..., c] - expected[..., c]).max() / np.abs(expected[..., c]).max() for c in columns)


# --- accuracy ---

FLIGHTS = {"paper": 5e-4, "soft": 5e-3}
"""Duration [s] of the flight of each preset: some 500 periods of the joints' springs."""


@functools.cache
def exact_flight(name):
    """The flight by SciPy's DOP853 at 1e-12: start and end."""
    start = spinning_ellipse(preset(name))
    return start, motion_equations.solve_flight(*start, FLIGHTS[name], preset(name))


@pytest.mark.parametrize("method", ACCURATE)
@pytest.mark.parametrize("name", FLIGHTS)
def test_flight_agrees_with_scipy(name, method):
    """At tolerance 1e-9 flights with friction, damping, gravity agree with DOP853 to 1e-8, rates of order 3 to 1e-7.

    Methods of order 3 take their longest accurate steps at the springs' period, so their rates err by some tens of
    tolerances; a tolerance of 1e-10 brings them below 1e-8 too.
    """
    start, (position, velocity) = exact_flight(name)
    rates_within = {1e-9: 1e-7, 1e-10: 1e-8} if ORDER[method] == 3 else {1e-9: 1e-8}
    for tolerance, bound in rates_within.items():
        flight = warpchain.simulate(
            name, *start, FLIGHTS[name], times=[FLIGHTS[name]], method=method, tolerance=tolerance
        )
        assert flight.status == Status.FINISHED
        assert flight.time[-1] == FLIGHTS[name]
        assert flight.impulses == {"floor": 0, "self": 0}
        assert greatest(flight.position[-1], position) < 1e-8
        assert greatest(flight.velocity[-1], velocity) < bound
        assert flight.losses["joint_friction"] > 1e-4
        assert flight.losses["joint_damping"] > 1e-9


def test_both_controllers_reach_the_same_flight():
    """The proportional-integral controller agrees with DOP853 as the standard one does, by other steps."""
    start, (position, velocity) = exact_flight("soft")
    flights = [
        warpchain.simulate("soft", *start, FLIGHTS["soft"], tolerance=1e-9, controller=controller)
        for controller in ("standard", "pi")
    ]
    for flight in flights:
        assert greatest(flight.position[-1], position) < 1e-8
        assert greatest(flight.velocity[-1], velocity) < 1e-8
    assert flights[0].steps_accepted != flights[1].steps_accepted


SMOOTH = PAPER.with_values({"joint_stiffness": 1e5, "joint_damping": 0.05, "friction_smoothing": 10.0})
"""Springs and friction so soft that steps of 10 µs are short against everything."""


@functools.cache
def exact_smooth_flight(duration):
    """The flight by SciPy's DOP853 at 1e-13: start and end."""
    start = spinning_ellipse(SMOOTH)
    return start, motion_equations.solve_flight(*start, duration, SMOOTH, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("method", METHODS)
def test_error_falls_with_the_order_of_the_method(method):
    """Errors of places and speeds against DOP853 fall as h^order, slope to 0.3, with joints that damp and rub."""
    duration, order = 4e-3, ORDER[method]
    halved = [(4e-5 if order > 3 else 2e-5) / 2**k for k in range(4)]
    steps = [8e-5, 6e-5, 5e-5, 4e-5] if order > 6 else halved  # beyond, rounding is all that is left
    start, (position, velocity) = exact_smooth_flight(duration)
    errors = []
    for step in steps:
        # a skin beyond the floor makes the whole flight "near a contact", and the loose tolerance leaves the bound
        near = {"tolerance": 0.1, "precision": "double", "contact_step": step, "skin": 5.0}
        flight = warpchain.simulate(SMOOTH, *start, duration, times=[duration], method=method, **near)
        assert flight.steps_rejected == 0
        # the first steps grow from 0.1 µs to h, each at most fivefold
        assert duration / step <= flight.steps_accepted <= duration / step + 6
        place, speed = flight.position[-1] - position, flight.velocity[-1] - velocity
        errors.append([np.sqrt(np.mean(d[:, :2] ** 2)) for d in (place, speed)])
    slopes = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert np.abs(slopes - order).max() < 0.3, slopes


# --- invariants of a flight ---


def flight_without_gravity(parameters, *, method="rkf78", tolerance=1e-12):
    """The spinning ellipse without gravity over some hundred spring periods: its end and its energies [J].

    Inner forces keep its momentum, friction and damping included, to 1e-14 of Σ m|v|.
    """
    duration = {1e9: 1e-3, 1e7: 5e-3}[parameters.joint_stiffness]
    start = spinning_ellipse(parameters)
    flight = warpchain.simulate(parameters, *start, duration, gravity=False, method=method, tolerance=tolerance)
    assert flight.status == Status.FINISHED
    momentum = np.array([motion_equations.linear_momentum(v, parameters) for v in flight.velocity])
    speeds = np.linalg.norm(flight.velocity[0][:, :2], axis=1)
    scale = motion_equations.link_masses(LINKS, parameters) @ speeds
    assert np.abs(momentum - momentum[0]).max() < 1e-14 * scale
    states = zip(flight.position, flight.velocity, strict=True)
    energy = np.array([motion_equations.total_energy(x, v, parameters, gravity=False) for x, v in states])
    return flight, energy


both_presets = pytest.mark.parametrize("parameters", [PAPER, SOFT], ids=["paper", "soft"])


@both_presets
@pytest.mark.parametrize("method", ACCURATE)
def test_energy_is_kept_without_dissipation(parameters, method):
    """With β = τ_c = b = 0 the energy stays: to 1e-13 at tolerance 1e-12; to 1e-9 at 1e-10 with order 3."""
    tolerance, bound = (1e-10, 1e-9) if ORDER[method] == 3 else (1e-12, 1e-13)
    flight, energy = flight_without_gravity(parameters.with_values(FRICTIONLESS), method=method, tolerance=tolerance)
    assert np.abs(energy / energy[0] - 1).max() < bound
    assert not any(flight.losses.values())


@both_presets
def test_friction_keeps_angular_momentum_and_takes_what_the_ledger_says(parameters):
    """As long as b = 0 the angular momentum stays to 1e-13; the energy falls by friction and damping as booked."""
    chain = parameters.with_values({"joint_damping": 0.0})
    flight, _ = flight_without_gravity(chain)
    states = zip(flight.position, flight.velocity, strict=True)
    momentum = np.array([motion_equations.angular_momentum(x, v, chain) for x, v in states])
    assert np.abs(momentum / momentum[0] - 1).max() < 1e-13
    assert flight.losses["joint_friction"] > 1e-4
    flight, energy = flight_without_gravity(parameters)
    assert np.diff(energy).max() < 0
    lost = flight.losses["joint_friction"] + flight.losses["joint_damping"]
    assert abs(energy[0] - energy[-1] - lost) < 1e-12 * energy[0]
    assert 0 < flight.losses["joint_damping"] < flight.losses["joint_friction"]
    assert flight.losses["floor"] == flight.losses["self_contact"] == 0


@pytest.mark.parametrize("speed", [2.0, -5.0])
def test_circular_loop_settles_at_its_tension(speed):
    """A closed loop stretches until every joint force is the formula's, for alternating masses; C is that over k."""
    position, velocity = circular_loop(LINKS, PAPER, speed)
    flight = warpchain.simulate(PAPER, position + HIGH, velocity, 1.5e-3, times=[1.5e-3], gravity=False, tolerance=1e-9)
    place = flight.position[-1][:, :2] - HIGH[:2]
    midway = place + np.roll(place, -1, axis=0)
    outwards = midway / np.linalg.norm(midway, axis=1)[:, None]
    tangent = np.column_stack([-outwards[:, 1], outwards[:, 0]])
    pull, across = circular_loop_force(LINKS, PAPER, speed)
    force = motion_equations.joint_force(flight.position[-1], flight.velocity[-1], PAPER)
    alternating = across * np.tile([1, -1], LINKS // 2)
    assert abs(across) > 0.02 * pull
    assert_allclose(np.sum(force * tangent, axis=1), pull, rtol=1e-5)
    assert_allclose(np.sum(force * outwards, axis=1), alternating, rtol=0, atol=1e-5 * pull)
    opening = np.linalg.norm(motion_equations.joint_opening(flight.position[-1], PAPER), axis=1)
    assert_allclose(PAPER.joint_stiffness * opening, np.hypot(pull, across), rtol=1e-4)
    # on the way there the springs overshoot, by less than undamped ones would
    assert np.hypot(pull, across) < PAPER.joint_stiffness * flight.greatest_opening < 2 * pull


# --- the same bits ---


def test_instants_only_cut_steps():
    """Steps land on the instants asked for, which changes no more than the tolerance; later ones change nothing."""
    start = spinning_ellipse(SOFT)
    alone = warpchain.simulate(SOFT, *start, 2e-3, times=[2e-3], tolerance=1e-9)
    instants = [0.0, 3e-4, 2e-3 / 3, 2e-3]
    several = warpchain.simulate(SOFT, *start, 2e-3, times=instants, tolerance=1e-9)
    assert_array_equal(several.time, instants)
    assert_array_equal(several.position[0], start[0])
    assert_array_equal(several.velocity[0], start[1])
    assert greatest(several.position[-1], alone.position[-1]) < 1e-9
    assert greatest(several.velocity[-1], alone.velocity[-1]) < 1e-8
    longer = warpchain.simulate(SOFT, *start, 3e-3, times=[2e-3], tolerance=1e-9)
    assert_array_equal(longer.position, alone.position)
    assert_array_equal(longer.velocity, alone.velocity)
    assert longer.steps_accepted > alone.steps_accepted


def dropped_batch(links, options, duration):
    """Batch of a spinning ellipse that falls, a hair above the floor."""
    batch = Batch(1, links, options)
    position, velocity = spinning_ellipse(SOFT, links)
    ends = position[:, 1] - SOFT.link_length / 2 * np.abs(np.sin(position[:, 2]))
    position[:, 1] -= ends.min() - SOFT.circle_radius - 1e-4
    batch.worlds[0].set_chain(SOFT, links)
    batch.worlds[0].load(position, velocity - [0.0, 2.0, 0.0], stop_time=duration, stop_status=Status.FINISHED)
    return batch


def outcome(batch):
    """Everything that a run leaves."""
    return {
        "status": batch.worlds[0].status,
        "time": batch.worlds[0].time,
        "position": batch.worlds[0].position,
        "velocity": batch.worlds[0].velocity,
        **{f"count {key}": value for key, value in batch.worlds[0].counts.items()},
        **{f"extreme {key}": value for key, value in batch.worlds[0].extremes.items()},
        **{f"loss {key}": value for key, value in batch.worlds[0].losses.items()},
    }


@pytest.mark.parametrize("method", [*METHODS, "hybrid"])
def test_launch_size_does_not_change_a_bit(method):
    """A chain that drops on the floor ends with the same bits in launches of 1, 7 or 1000 attempts, counters too."""
    outcomes = []
    for attempts in (1, 7, 1000):
        batch = dropped_batch(20, Options(method=method), 0.01)
        while batch.worlds[0].status == Status.RUNNING:
            batch.launch([0], batch.features(fixed_body="floor"), attempts)
        outcomes.append(outcome(batch))
    assert outcomes[0]["status"] == Status.FINISHED
    assert outcomes[0]["count floor"] > 100
    for name, value in outcomes[0].items():
        assert_array_equal(outcomes[1][name], value, err_msg=name)
        assert_array_equal(outcomes[2][name], value, err_msg=name)
