"""What `simulate` and `walk` refuse: one line that begins with the field's name, before anything is computed."""

import re

import numpy as np
import pytest

import warpchain
from tests.oracle_model.circular_loop import circular_loop
from tests.support.setups import setup_walk
from warpchain import InputError
from warpchain.engine.batch import Batch
from warpchain.inputs.methods import METHODS, METHODS_BY_NEED
from warpchain.inputs.parameters import preset

SOFT = preset("soft")
SETUP = setup_walk("soft", {}, None)
POSITION, VELOCITY = circular_loop(8, SOFT, 1.0)
POSITION[:, 1] += 0.1


class ComputedError(Exception):
    """A kernel was about to run."""


@pytest.fixture(autouse=True)
def nothing_runs(monkeypatch):
    """Compiling or launching a kernel ends the test."""

    def refuse(*arguments, **keywords):
        raise ComputedError

    for name in ("compile", "launch", "run"):
        monkeypatch.setattr(Batch, name, refuse)


def refused(call, *arguments, **keywords):
    """The message with which a call refuses its arguments: one line, of a `ValueError`."""
    with pytest.raises(InputError) as caught:
        call(*arguments, **keywords)
    message = str(caught.value)
    assert isinstance(caught.value, ValueError)
    assert "\n" not in message
    return message


def brief(value):
    """A short name of a test's argument."""
    return repr(value)[:30]


def with_value(array, value):
    """A copy of a state with one value replaced."""
    changed = array.astype(np.result_type(array, type(value)))
    changed[3, 1] = value
    return changed


# --- simulate ---


def test_good_input_is_computed():
    """Arrays, lists and numbers of NumPy are accepted: the tests below fail for no other reason."""
    for position in (
        POSITION,
        POSITION.tolist(),
        POSITION.astype(np.float32),
        [[0, 0.1, angle] for angle in (0, 3, 0, 3)],
    ):
        velocity = np.zeros_like(position, dtype=float)
        for duration in (0, 0.0, 1, 1.5, np.float32(1), np.int64(1)):
            with pytest.raises(ComputedError):
                warpchain.simulate("soft", position, velocity, duration)
    for times in ([0.0], [1.0], (0.0, 1.0), np.linspace(0, 1, 5), None):
        with pytest.raises(ComputedError):
            warpchain.simulate(SOFT, POSITION, VELOCITY, 1.0, times=times)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"method": "rk4"},
            rf"options\.method: 'rk4' is unknown; give one of {', '.join((*METHODS_BY_NEED, *METHODS))}",
        ),
        ({"tolerance": 0.0}, r"options\.tolerance: .*"),
        ({"tolerance": 1.0}, r"options\.tolerance: .*"),
        ({"device": "gpu"}, r"options\.device: 'gpu' is no device; .*"),
        ({"self_contact": "yes"}, r"options\.self_contact: .*"),
        ({"controller": "pid"}, r"options\.controller: .*"),
        ({"smallest_step": 1e-3}, r"options\.smallest_step: 0.001 is not smaller than contact_step 2e-05 s; .*"),
        ({"toleranze": 1e-3}, r"options\.toleranze: .*"),
        ({"links": 8}, r"options\.links: .*"),
        ({"skin": -1.0, "tolerance": 1.0}, r"options\.\w+: .* \(and 1 more\)"),
    ],
    ids=brief,
)
def test_simulate_refuses_options(settings, message):
    """An option that is unknown or out of bounds is refused by its name."""
    assert re.fullmatch(message, refused(warpchain.simulate, "soft", POSITION, VELOCITY, 1.0, **settings))


@pytest.mark.parametrize("parameters", ["hard", None, 3, {"link_length": 1.0}, ["soft"]])
def test_simulate_refuses_unknown_parameters(parameters):
    """Parameters are a set of them or the name of a preset, and nothing else."""
    message = refused(warpchain.simulate, parameters, POSITION, VELOCITY, 1.0)
    assert re.fullmatch(r"preset: .* is unknown; presets are paper, soft", message)


@pytest.mark.parametrize("name", ["position", "velocity"])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("abc", "not an array of numbers; .*"),
        ([[0.0, 1.0, 2.0], [0.0, 1.0]], "not an array of numbers; .*"),
        (None, r"its shape is \(\); give \(n, 3\), one row x, y, θ per link"),
        (POSITION.ravel(), r"its shape is \(24,\); .*"),
        (with_value(POSITION, np.nan), "holds a number that is not finite; .*"),
        (with_value(POSITION, 1j), ".+; give .*"),
    ],
    ids=brief,
)
def test_simulate_refuses_states(name, given, message):
    """A state that is no finite real array of shape (n, 3) is refused by its name."""
    state = {"position": POSITION, "velocity": VELOCITY} | {name: given}
    told = refused(warpchain.simulate, "soft", state["position"], state["velocity"], 1.0)
    assert re.fullmatch(f"{name}: {message}", told)


@pytest.mark.parametrize("links", [0, 2, 3, 5, 7])
def test_simulate_refuses_chains_that_cannot_be(links):
    """A chain has at least 4 links, and an even number if they are of two kinds."""
    told = refused(warpchain.simulate, "soft", np.zeros((links, 3)), np.zeros((links, 3)), 1.0)
    problem = f"{links} links; a closed chain has at least 4" if links < 4 else f"{links} is odd; inner and outer"
    assert told.startswith(f"position: {problem}")


def test_simulate_refuses_states_of_different_length():
    """Position and velocity have one row per link each."""
    told = refused(warpchain.simulate, "soft", POSITION, VELOCITY[:6], 1.0)
    assert told == "velocity: 6 rows, but position has 8; give one row per link each"


@pytest.mark.parametrize(
    ("duration", "message"),
    [
        ("1", "'1' is not a number; give seconds"),
        (None, "None is not a number; give seconds"),
        (True, "True is not a number; give seconds"),
        (-1, "-1 is not a time; give a number of seconds, at least 0"),
        (float("nan"), "nan is not a time; .*"),
        (float("inf"), "inf is not a time; .*"),
        (1j, ".+; give .*"),
        (10**400, ".+; give .*"),
    ],
    ids=brief,
)
def test_simulate_refuses_durations(duration, message):
    """A duration that is no finite number of seconds from 0 on is refused."""
    told = refused(warpchain.simulate, "soft", POSITION, VELOCITY, duration)
    assert re.fullmatch(f"duration: {message}", told)


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ("abc", "not an array of numbers; give rising instants in s"),
        ([1j], "not an array of numbers; .*"),
        (0.5, r"its shape is \(\); give a row of at least one instant"),
        ([], r"its shape is \(0,\); .*"),
        ([0.0, 1.5], r"give rising instants between 0 and the duration of 1.0 s"),
        ([-0.1, 0.5], "give rising instants .*"),
        ([0.5, 0.5], "give rising instants .*"),
        ([float("nan")], "give rising instants .*"),
    ],
    ids=brief,
)
def test_simulate_refuses_times(times, message):
    """Instants that do not rise within the duration are refused."""
    told = refused(warpchain.simulate, "soft", POSITION, VELOCITY, 1.0, times=times)
    assert re.fullmatch(f"times: {message}", told)


@pytest.mark.parametrize("name", ["floor", "gravity"])
@pytest.mark.parametrize("value", ["no", 0.0, []])
def test_simulate_refuses_switches_that_are_no_truth_values(name, value):
    """Like `self_contact`, `floor` and `gravity` are true or false: `floor="no"` does not mean a floor."""
    assert refused(warpchain.simulate, "soft", POSITION, VELOCITY, 1.0, **{name: value}).startswith(f"{name}: ")


# --- walk ---


def test_good_walk_is_computed():
    """Walks of each start are computed: the tests below fail for no other reason."""
    for settings in (
        {},
        {"start": "spinning"},
        {"start": "ellipse"},
        {"seed": 3},
        {"frame_interval": None},
        {"setup": SETUP},
    ):
        with pytest.raises(ComputedError):
            warpchain.walk(**settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"links": 28}, r"scene\.links: 28 links of 0.01268 m do not reach round .*; give at least 30"),
        ({"frequency": 900}, r"scene\.frequency: 900 Hz is far above what a loop holds, .*, give 15"),
        ({"clearance_of": "hanging", "start": "spinning"}, r"scene\.clearance_of: 'hanging' needs .*; give .*"),
        (
            {"sprocket_radius": 3e-3, "sprocket_radius_is": "pitch"},
            r"parameters\.sprocket_radius: 0.003 is not greater than the circle radius 0.0042, .*; .*",
        ),
        # names and seeds
        ({"clearence": 0.1}, r"'clearence': unknown name; did you mean scene\.clearance\?"),
        ({"parameters": {}}, r"'parameters': unknown name; give one of .*"),
        ({"seed": -1}, r"seed: -1 is no whole number from 0 to 2\*\*128 - 1; .*"),
        ({"seed": True}, r"seed: True is no whole number .*; .*"),
        # setups of other walks
        ({"setup": SETUP, "links": 60}, r"links: given together with setup, which is complete; leave one out"),
        ({"setup": SETUP, "preset": "paper", "gravity": 9.0}, r"preset, gravity: given together with setup, .*; .*"),
        ({"setup": {"links": 60}}, r"setup: \{'links': 60\} is none of a walk; give setup of a WalkResult, .*"),
        ({"setup": SETUP, "seed": -1}, r"seed: -1 is no whole number from 0 .*; .*"),
        # frames
        ({"frame_interval": 0}, r"frame_interval: 0 is no positive time in s; give one"),
        ({"frame_interval": float("nan")}, r"frame_interval: nan is no positive time in s; .*"),
        ({"frame_interval": "2 ms"}, r"frame_interval: .*"),
        ({"frame_interval": True}, r"frame_interval: .*"),
        # the number of samples per frame must fit into 64 bits: 2⁶⁴ and its multiples would be 0
        ({"frame_interval": 1e300}, r"frame_interval: .*"),
        ({"record_interval": 1e-300}, r"(options\.record_interval|frame_interval): .*"),
        # the closest that samples can be
        ({"frame_interval": 9e-7}, r"frame_interval: 9e-07 is not between 1e-06 s and 1000.0 s; .*"),
    ],
    ids=brief,
)
def test_walk_refuses(settings, message):
    """What a walk can't use is refused by its name, with a remedy."""
    assert re.fullmatch(message, refused(warpchain.walk, **settings))


@pytest.mark.parametrize(("aspect", "links"), [(1e6, 6), (1e12, 60), (1e-12, 180), (1e300, 60)])
def test_walk_refuses_ellipses_that_no_chain_can_follow(aspect, links):
    """An ellipse that is too flat for its links is refused by its aspect."""
    told = refused(warpchain.walk, start="ellipse", ellipse_aspect=aspect, links=links)
    assert "ellipse_aspect" in told


def test_seed_that_draws_an_impossible_chain_is_refused():
    """A sample whose sprocket is too large for the chain is refused like any other set of values."""
    told = set()
    for seed in range(60):
        try:
            warpchain.walk(links=30, seed=seed)
        except ComputedError:
            told.add("computed")
        except InputError as error:
            told.add("refused")
            assert re.fullmatch(r"scene\.links: 30 links of .* do not reach round .*; give at least 32", str(error))
    assert told == {"computed", "refused"}
