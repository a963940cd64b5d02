"""Cases that break careless integrators: each ends with a sound result or a clear status, never with a wrong number."""

import numpy as np
import pytest
import warp as wp
from numpy.testing import assert_allclose, assert_array_equal

import warpchain
from warpchain import InputError, Status, reference
from warpchain.hard_starts import (
    ELASTIC,
    PAPER,
    SOFT,
    UNDISSIPATIVE,
    dropped,
    dropped_circle,
    energy_error,
    energy_scale,
    folded,
    overlapping,
    pulled_apart,
    set_down,
    turning_joints,
)
from warpchain.options import METHODS_BY_NEED

METHODS = ("rkf78", "dp5", "bs32", "os32", "rodas4p", "rodas5p", "hybrid")
every_method = pytest.mark.parametrize("method", METHODS)
every_method_walks = pytest.mark.parametrize(
    "method", ["rkf78", "dp5", "rodas4p", "hybrid", pytest.param("bs32", marks=pytest.mark.slow)]
)
"""The same for walks, which need a kernel more: no other quick test uses that of bs32."""


def walk(method, **settings):
    """`warpchain.walk` at 1e-6 without frames, at the preset soft unless another is given.

    Flights of hybrid are at 1e-4 there: their own tolerance, not that of the springs, is what its ledger closes to, and
    at the default of 1e-3 that is 4e-4 (4 links) to 7e-4 (20 links without friction on the floor), hardly a test.
    """
    flights = {"flight_tolerance": 1e-4} if method == "hybrid" else {}
    return warpchain.walk(**{"preset": "soft", "method": method, "frame_interval": None, **flights, **settings})


def ledger_error(walk):
    """What the energy ledger of a walk leaves open, as a fraction of the energy at release."""
    return abs(walk.energy["residual"]) / (walk.energy["kinetic_at_release"] + walk.energy["potential_at_release"])


def simulate(parameters, state, duration, **settings):
    """`warpchain.simulate`, recording just the end."""
    return warpchain.simulate(parameters, *state, duration, times=[duration], **settings)


def assert_sound(flight, parameters, state, within=1e-5):
    """Finished, finite, and the ledger closes to a fraction of the energy of motion and springs at the start."""
    assert flight.status == Status.FINISHED, flight.status.sentence
    position, velocity = flight.position[-1], flight.velocity[-1]
    assert np.all(np.isfinite(position)) and np.all(np.isfinite(velocity))
    # a flight on rigid joints is looser than springs
    closes_within = max(within, 1e-4) if flight.losses["hand_over"] else within
    assert energy_error(flight, parameters, state) < closes_within
    assert abs(flight.losses["hand_over"]) < 1e-3 * energy_scale(parameters, state)
    losses = [loss for name, loss in flight.losses.items() if name != "hand_over"]
    assert all(loss > -within * energy_scale(parameters, state) for loss in losses)


# --- the whole pile ---


@pytest.mark.slow
@every_method
def test_longest_slow_walk_ends_in_a_pile_at_rest(method):
    """180 links released at 5 Hz fall into a pile beside the sprocket and rest there, the ledger closed to 5e-4.

    Methods that take minutes at 1e-6 do it at 1e-4; the table of hard cases has them at 1e-6.
    """
    tolerance = 1e-6 if method in ("rkf78", "dp5") else 1e-4
    done = walk(method, tolerance=tolerance, links=180, frequency=5.0, start="spinning")
    assert done.status == Status.AT_REST
    assert 0 < done.dx < 0.3
    assert done.center[-1, 1] < 0.06
    assert done.impulses["self"] > 1e5
    assert ledger_error(done) < (1e-4 if tolerance == 1e-6 else 5e-4)
    assert done.greatest_penetration["floor"] < SOFT.circle_radius / 2


@pytest.mark.slow
@every_method
@pytest.mark.parametrize("name", ["paper", "soft"])
@pytest.mark.parametrize("links", [60, 180])
def test_chain_dropped_without_spin_rests_below(name, links, method):
    """An upright ellipse at rest drops, collapses and rests within a few centimetres of where it hung.

    With the settings of standard: at 1e-6 and on stiff joints a pile takes minutes.
    """
    settings = {**METHODS_BY_NEED["explicit"], "method": method}
    done = walk(preset=name, links=links, frequency=0.0, start="ellipse", ellipse_aspect=2.0, **settings)
    assert done.status == Status.AT_REST
    assert abs(done.dx) < 0.03
    assert done.bounces >= 1
    assert done.impulses["self"] > 1000
    assert done.center[-1, 1] < done.center[0, 1] / 3
    assert ledger_error(done) < 1e-3


# --- stiffness, damping, friction ---


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
    energy = reference.total_energy(*state, chain)
    assert flight.greatest_opening < np.sqrt(2 * energy / stiffness)


@every_method
def test_stiff_joints_hit_alike(method):
    """Right after an impact the centre of mass moves alike for k = 1e9 and 1e11: the model has a rigid limit."""
    state = dropped()
    speeds = []
    for stiffness in (1e9, 1e11):
        chain = PAPER.with_values({"joint_stiffness": stiffness})
        flight = simulate(chain, state, 5e-4, method=method)
        speeds.append(reference.linear_momentum(flight.velocity[-1], chain))
    momentum = reference.linear_momentum(state[1], PAPER)
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
    if method not in ("rodas4p", "rodas5p", "hybrid"):
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


# --- elastic and frictionless ---


@pytest.mark.parametrize(
    ("method", "tolerance", "bound"),
    [
        ("rkf78", 1e-8, 1e-5),
        ("dp5", 1e-8, 5e-5),
        ("bs32", 1e-7, 3e-3),
        ("rodas4p", 1e-8, 1e-4),
        ("hybrid", 1e-8, 5e-5),
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
    energy = [reference.total_energy(x, v, ELASTIC) for x, v in zip(flight.position, flight.velocity, strict=True)]
    assert np.abs(np.array(energy) / energy[0] - 1).max() < bound
    assert flight.impulses["floor"] > 10
    assert flight.impulses["self"] > 10
    assert max(map(abs, flight.losses.values())) < 1e-12 * energy[0]
    momentum = np.array([reference.linear_momentum(v, ELASTIC)[0] for v in flight.velocity])
    speeds = reference.link_masses(6, ELASTIC) @ np.abs(state[1][:, 0])
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * speeds
    assert flight.position[:, :, 1].min() > 0


@pytest.mark.parametrize(
    ("method", "steps", "slope"),
    [
        ("rkf78", [1e-4, 8e-5, 6e-5, 5e-5, 4e-5], 9),
        ("dp5", [4e-5, 2e-5, 1e-5], 5),
        ("bs32", [1e-5, 5e-6, 2.5e-6], 3),
        ("rodas4p", [2e-5, 1e-5, 5e-6], 5),
        ("hybrid", [4e-5, 2e-5, 1e-5], 5),
    ],
)
def test_elastic_bouncing_shows_the_order(method, steps, slope):
    """The energy that bouncing undamped springs lose falls as h^p for odd order p, as h^(p+1) for even p.

    One step multiplies the energy of an oscillator by |R(iωh)|², which leaves 1 by an even power of h. Springs that
    nothing damps ring for ever, so that hybrid never takes its joints for rigid here: it is dp5.
    """
    state = dropped(links=6, fall=0.0, gap=0.02)
    energy = reference.total_energy(*state, ELASTIC)
    drifts = []
    for step in steps:
        # a skin beyond the height of the fall makes contact_step, not the loose tolerance, set the step
        flight = simulate(ELASTIC, state, 0.3, method=method, tolerance=0.1, contact_step=step, skin=3.0)
        assert flight.steps_accepted == pytest.approx(0.3 / step, rel=0.01)
        assert flight.impulses["floor"] > 3
        drifts.append(energy - reference.total_energy(flight.position[-1], flight.velocity[-1], ELASTIC))
    assert min(drifts) > 0
    assert np.polyfit(np.log(steps), np.log(drifts), 1)[0] == pytest.approx(slope, abs=1)


@every_method_walks
def test_endless_bouncing_meets_the_time_limit(method):
    """A chain that nothing brings to rest ends with time_limit at that time, and has no Δx."""
    done = walk(method, links=6, frequency=2.0, start="ellipse", walk_limit=0.3, **UNDISSIPATIVE)
    assert done.status == Status.TIME_LIMIT
    assert done.walk_time == 0.3
    assert np.isnan(done.dx)
    assert done.bounces >= 2
    assert done.time[-1] == 0.3
    assert ledger_error(done) < 5e-3


@every_method_walks
@pytest.mark.parametrize("friction", [0.0, 1.0])
@pytest.mark.parametrize("restitution", [0.0, 1.0])
def test_walks_at_the_ends_of_the_collision_law(method, friction, restitution):
    """With e and μ of 0 or 1 a chain still comes to rest; without friction of the floor it stays above its start."""
    done = walk(
        method,
        links=20,
        frequency=10.0,
        start="ellipse",
        floor_restitution=restitution,
        floor_friction=friction,
        chain_restitution=restitution,
        chain_friction=friction,
    )
    assert done.status == Status.AT_REST
    if friction == 0:
        assert abs(done.dx) < 1e-12
    else:
        assert 0.1 < done.dx < 1.0
    assert ledger_error(done) < 3e-4
    assert abs(done.energy["hand_over"]) < 1e-2 * done.energy["kinetic_at_release"]


# --- short, long, fast and slow ---


@every_method_walks
@pytest.mark.parametrize("links", [4, 6, 8])
def test_short_chains(method, links):
    """The shortest chains drop, bounce and come to rest, flat on the floor, where they do with the reference."""
    done = walk(method, links=links, frequency=4.0, start="ellipse")
    assert done.status == Status.AT_REST
    assert done.bounces >= 1
    if method != "rkf78":
        # after two or three bounces chaos has not come far
        assert done.dx == pytest.approx(walk("rkf78", links=links, frequency=4.0, start="ellipse").dx, rel=0.02)
    assert done.center[-1, 1] < SOFT.circle_radius + links * SOFT.link_length / 4
    assert ledger_error(done) < 2e-4


@pytest.mark.slow
@every_method
def test_thousand_links(method):
    """1000 links hit the floor like any other number."""
    state = dropped_circle(1000)
    flight = simulate(SOFT, state, 5e-3, method=method)
    assert_sound(flight, SOFT, state)
    assert flight.impulses["floor"] > 100


@pytest.mark.slow
@every_method
def test_sixty_turns_per_second(method):
    """At 60 Hz the chain walks for many metres and comes to rest, its ledger closed to 5e-4."""
    done = walk(method, links=60, frequency=60.0, start="spinning")
    assert done.status == Status.AT_REST
    assert 15 < done.dx < 25
    assert ledger_error(done) < 5e-4


@pytest.mark.parametrize(
    "method", ["dp5", *(pytest.param(name, marks=pytest.mark.slow) for name in METHODS if name != "dp5")]
)
@pytest.mark.parametrize("start", ["rest", "spinning"])
def test_standing_sprocket(start, method):
    """At 0 Hz the chain hangs on its sprocket until it is let go, falls, and rests within a few centimetres.

    A pile amplifies the last digits, so the symmetry of the hanging loop says no more than that: |Δx| well below the
    loop's half width.
    """
    done = walk(method, links=60, frequency=0.0, start=start)
    assert done.status == Status.AT_REST
    assert done.impulses["sprocket"] > 0
    assert done.greatest_penetration["sprocket"] < 1e-3
    assert done.sprocket_center is not None
    # it hangs: the centre is one loop's height above the floor
    assert done.sprocket_center[1] < 60 * SOFT.link_length / 2
    assert abs(done.dx) < 0.03
    assert ledger_error(done) < 1e-5


# --- bad starts ---


@every_method
@pytest.mark.parametrize("parameters", [PAPER, SOFT], ids=["paper", "soft"])
def test_joints_pulled_apart(method, parameters):
    """Joints opened by 0.1 mm, 40 J at k = 1e9, pull themselves together; the ledger tells where the energy went."""
    state = pulled_apart()
    position = state[0]
    opening = np.linalg.norm(reference.joint_opening(position, parameters), axis=1)
    assert 1e-4 < opening.max() < 1.5e-4
    flight = simulate(parameters, state, 2e-3, method=method)
    assert_sound(flight, parameters, state)
    closed = np.linalg.norm(reference.joint_opening(flight.position[-1], parameters), axis=1)
    assert closed.max() < 1e-5
    stored = reference.spring_energy(position, parameters)
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
    at_end = reference.total_energy(flight.position[-1], flight.velocity[-1], SOFT)
    assert at_end < reference.total_energy(*state, SOFT)
    ends = np.concatenate(reference.link_ends(flight.position[-1], SOFT))
    assert ends[:, 1].min() - SOFT.circle_radius < -depth / 2


@every_method
@pytest.mark.parametrize("links", [4, 8, 20])
@pytest.mark.parametrize("parameters", [PAPER, SOFT], ids=["paper", "soft"])
def test_folded_back_on_itself(method, links, parameters):
    """A chain folded by 180° at both ends, its joints on top of each other, falls flat and stays whole."""
    position, velocity = folded(links, height=parameters.circle_radius + 2e-5)
    state = position, velocity
    assert len(reference.touching_pairs(position, parameters)) == links // 2 - 1
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
    assert len(reference.touching_pairs(state[0], SOFT)) >= 10
    flight = simulate(SOFT, state, 5e-3, method=method)
    assert_sound(flight, SOFT, state, within=1e-4)
    assert flight.impulses["self"] > 10
    assert flight.losses["self_contact"] > 0
    assert flight.greatest_penetration["self"] > SOFT.circle_radius
    motion = reference.total_energy(flight.position[-1], flight.velocity[-1], SOFT)
    assert motion <= reference.total_energy(*state, SOFT) * (1 + 1e-9)


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


# --- statuses ---


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


# --- what cannot be ---


@pytest.fixture
def no_kernels(monkeypatch):
    """Any compilation or launch of a kernel fails the test."""

    def forbidden(*args, **kwargs):
        raise AssertionError("a kernel was used")

    for name in ("launch", "load_module", "force_load"):
        monkeypatch.setattr(wp, name, forbidden)


@pytest.mark.usefixtures("no_kernels")
@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"links": 61}, "scene.links"),
        ({"links": 2}, "scene.links"),
        ({"links": 0}, "scene.links"),
        ({"links": 60.0}, "scene.links"),
        ({"links": 20}, "scene.links"),  # too short for the sprocket
        ({"sprocket_radius": 0.5}, "scene.links"),
        ({"sprocket_radius": 4e-3, "sprocket_radius_is": "pitch"}, "parameters.sprocket_radius"),
        ({"circle_radius": 6.34e-3}, "parameters.circle_radius"),
        ({"link_length": 8.4e-3}, "parameters.circle_radius"),
        ({"inner_mass": -1e-3}, "parameters.inner_mass"),
        ({"outer_inertia": 0.0}, "parameters.outer_inertia"),
        ({"gravity": float("nan")}, "parameters.gravity"),
        ({"joint_stiffness": float("inf")}, "parameters.joint_stiffness"),
        ({"joint_stiffness": 0.0}, "parameters.joint_stiffness"),
        ({"friction_smoothing": 0.0}, "parameters.friction_smoothing"),
        ({"floor_restitution": 1.1}, "parameters.floor_restitution"),
        ({"floor_friction": -0.1}, "parameters.floor_friction"),
        ({"frequency": -5.0}, "scene.frequency"),
        ({"frequency": float("nan")}, "scene.frequency"),
        ({"clearance": -1e-3}, "scene.clearance"),
        ({"phase": 1.0}, "scene.phase"),
        ({"start": "flying"}, "scene.start"),
        ({"start": "spinning", "clearance_of": "hanging"}, "scene.clearance_of"),
        ({"method": "euler"}, "options.method"),
        ({"tolerance": 0.0}, "options.tolerance"),
        ({"device": "gpu"}, "options.device"),
        ({"smallest_step": 1e-4}, "options.smallest_step"),
        ({"seed": -1}, "seed"),
        ({"frame_interval": 0.0}, "frame_interval"),
        ({"preset": "hard"}, "preset"),
        ({"mass": 1.0}, "'mass'"),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_impossible_walks_are_refused(values, field):
    """What cannot be is refused before any kernel is used, in one line that names the field and says what to do."""
    with pytest.raises(InputError) as caught:
        warpchain.walk(**values)
    message = str(caught.value)
    assert message.startswith(f"{field}: ")
    assert ";" in message
    assert "\n" not in message


@pytest.mark.usefixtures("no_kernels")
@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"position": np.zeros((7, 3))}, "velocity"),
        ({"position": np.zeros((7, 3)), "velocity": np.zeros((7, 3))}, "position"),
        ({"position": np.zeros((2, 3)), "velocity": np.zeros((2, 3))}, "position"),
        ({"position": np.zeros((8, 2))}, "position"),
        ({"position": np.full((8, 3), np.nan)}, "position"),
        ({"velocity": np.full((8, 3), np.inf)}, "velocity"),
        ({"velocity": "fast"}, "velocity"),
        ({"duration": -1.0}, "duration"),
        ({"duration": float("nan")}, "duration"),
        ({"duration": "1 s"}, "duration"),
        ({"times": [0.0, 2.0]}, "times"),
        ({"times": [0.5, 0.5]}, "times"),
        ({"times": []}, "times"),
        ({"times": [float("nan")]}, "times"),
        ({"tolerance": 1.0}, "options.tolerance"),
        ({"method": "rk4"}, "options.method"),
        ({"stepsize": 1.0}, "options.stepsize"),
        ({"parameters": "hard"}, "preset"),
    ],
    ids=lambda value: str(value)[:40] if isinstance(value, dict) else "",
)
def test_impossible_simulations_are_refused(values, field):
    """States, times and options that cannot be are refused before any kernel is used, naming what is wrong."""
    given = {"parameters": "soft", "position": np.zeros((8, 3)), "velocity": np.zeros((8, 3)), "duration": 1.0}
    with pytest.raises(InputError) as caught:
        warpchain.simulate(**(given | values))
    message = str(caught.value)
    assert message.startswith(f"{field}: ")
    assert "\n" not in message
