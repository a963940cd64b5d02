"""What `simulate`, `walk` and `Chains` refuse: one line that begins with the field's name, before anything runs."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.oracle_model.circular_loop import circular_loop
from tests.support.presets import SOFT
from tests.support.setups import setup_walk
from warpchain import Chains, InputError, simulate, walk
from warpchain.engine.batch import Batch
from warpchain.results import one_walk

SETUP = setup_walk("soft", {})
POSITION, VELOCITY = circular_loop(8, SOFT, 1.0)
POSITION[:, 1] += 0.1
PAIR = {"parameters": [SOFT, SOFT], "position": np.array([POSITION] * 2), "velocity": np.array([VELOCITY] * 2)}


class ComputedError(Exception):
    """A kernel was about to run."""


@pytest.fixture(autouse=True)
def nothing_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling or launching a kernel ends the test."""

    def refuse(*_: object, **__: object) -> None:
        raise ComputedError

    monkeypatch.setattr(Batch, "start", refuse)
    monkeypatch.setattr(one_walk, "compile_kernels", refuse)


def changed(value: complex) -> Any:
    """Positions with another number among them."""
    array = POSITION.astype(type(value))
    array[3, 1] = value
    return array


def test_good_input_is_computed() -> None:
    """Arrays, lists and numbers of NumPy, and walks of each start: the tests below fail for no other reason."""
    for position in (POSITION, POSITION.tolist(), POSITION.astype(np.float32)):
        for duration in (0, 0.0, 1.5, np.float32(1), np.int64(1)):
            with pytest.raises(ComputedError):
                simulate("soft", position, np.zeros((8, 3)), duration, times=(0.0,))
    numbers = {"seed": np.int32(3), "frame_interval": np.float64(0.02), "record_joint_forces": np.bool_(True)}
    for settings in ({}, {"start": "spinning"}, {"start": "ellipse", **numbers}, {"setup": SETUP}):
        with pytest.raises(ComputedError):
            walk(**settings)
    with pytest.raises(ComputedError):
        Chains(**PAIR)


GOOD: dict[Callable[..., object], dict[str, Any]] = {
    simulate: {"parameters": "soft", "position": POSITION, "velocity": VELOCITY, "duration": 1.0},
    walk: {},
    Chains: PAIR,
}
REFUSED: dict[Callable[..., object], list[tuple[dict[str, Any], str]]] = {
    simulate: [
        ({"toleranze": 1e-3}, r"options\.toleranze: unknown name; did you mean options\.tolerance\?"),
        ({"links": 8}, r"options\.links: not possible here; move it to scene"),
        ({"skin": -1.0, "tolerance": 1.0}, r"options\.\w+: .* \(and 1 more\)"),
        ({"soften_pile": True}, r"options\.soften_pile: only a walk softens its joints; remove it"),
        ({"soften_drive": True}, r"options\.soften_drive: only a walk .*"),
        ({"parameters": {"link_length": 1.0}}, r"preset: unknown preset .*; use one of paper, soft"),
        ({"position": "abc"}, r"position: expected an array of numbers; use one of shape \(n, 3\)"),
        ({"position": changed(np.nan)}, "position: expected finite numbers, got NaN or infinity; .*"),
        ({"position": np.zeros((3, 3)), "velocity": np.zeros((3, 3))}, "position.links: expected .*"),
        (
            {"position": np.zeros((5, 3)), "velocity": np.zeros((5, 3))},
            "position: expected an even number, got 5; use .*",
        ),
        ({"velocity": [[0.0, 1.0, 2.0], [0.0, 1.0]]}, r"velocity: expected an array of numbers; .*"),
        ({"velocity": VELOCITY[:6]}, r"velocity: expected shape \(8, 3\), got \(6, 3\).*"),
        ({"duration": "1"}, "duration: expected a number in s, got '1'"),
        ({"duration": -1}, "duration: expected at least 0 s, got -1"),
        ({"duration": np.inf}, "duration: expected a finite number in s, got inf"),
        ({"duration": 10**400}, "duration: .*, got a whole number of 1329 bits"),
        ({"times": 0.5}, r"times: expected shape \(t,\), got \(\).*"),
        ({"times": []}, "times: expected increasing times between 0 and the duration of 1.0 s.*"),
        ({"times": [0.0, 1.5]}, "times: expected increasing times .*"),
        ({"times": [0.5, 0.5]}, "times: expected increasing times .*"),
        ({"floor": "no"}, r"floor: expected flat or points, got 'no'; .*"),
        ({"gravity": 0.0}, "gravity: expected true or false, got 0.0"),
    ],
    walk: [
        ({"links": 28}, r"scene\.links: 28 links do not reach around .*; use at least 30"),
        ({"clearance_of": "hanging", "start": "spinning"}, r"scene\.clearance_of: 'hanging' needs .*; use .*"),
        (
            {"sprocket_radius": 3e-3, "sprocket_radius_is": "pitch", "unusual_values": True},
            r"parameters\.sprocket_radius: 0.003 is too small for .*; use more",
        ),
        ({"seed": True}, r"seed: expected an integer, got True"),
        ({"setup": SETUP, "links": 60}, r"links: not possible with setup, which is complete; remove one"),
        ({"setup": {"links": 60}}, r"setup: expected the setup of a walk, got \{'links': 60\}; .*"),
        ({"record_before": -0.1}, r"record_before: expected .*, got -0\.1"),
        ({"record_before": True}, r"record_before: expected .*, got True"),
        ({"record_before": np.inf}, r"record_before: expected .*, got inf"),
        ({"record_before": 0.1, "frame_interval": None}, ".*frame_interval is None; set frame_interval.*"),
        ({"frame_interval": 1e300}, r"frame_interval: .*"),  # its number of samples must fit into 64 bits
        ({"frame_interval": 9e-7}, r"frame_interval: .*"),
        ({"record_interval": 1e-300}, r"(options\.record_interval|frame_interval): .*"),
        ({"record_joint_forces": 1}, r"record_joint_forces: expected true or false, got 1"),
    ],
    Chains: [
        ({"velocity": np.zeros((2, 8, 2))}, r"velocity: expected shape \(2, 8, 3\), got \(2, 8, 2\).*"),
        ({"position": np.full((2, 8, 3), np.nan)}, "position: expected finite numbers, got NaN or infinity; .*"),
        ({"parameters": [SOFT]}, "parameters: expected Parameters of each of 2 chains, got .*"),
        ({"parameters": SOFT}, "parameters: expected Parameters of each of 2 chains, got .*"),
        ({"position": PAIR["position"] - [0.0, 0.2, 0.0]}, "position: link . starts .* m inside the floor; raise .*"),
        ({"position": PAIR["position"] * [2.0, 2.0, 1.0]}, "position: the loop is not closed: .*; let links meet"),
        ({"floor": [[-1, 0], [1, 0]]}, "floor: expected true or false, got .*"),
        ({"soften_drive": True}, r"options\.soften_drive: .*"),
    ],
}


@pytest.mark.parametrize(
    ("call", "given", "line"),
    [(call, given, line) for call, rows in REFUSED.items() for given, line in rows],
    ids=lambda value: getattr(value, "__name__", repr(value)[:40]),
)
def test_what_cannot_be_used_is_refused(call: Callable[..., object], given: dict[str, Any], line: str) -> None:
    """By its name, with a remedy."""
    with pytest.raises(InputError) as caught:
        call(**GOOD[call] | given)
    assert re.fullmatch(line, str(caught.value))


def test_seed_that_draws_an_impossible_chain_is_refused() -> None:
    """A sample whose sprocket is too large for the chain is refused like any other set of values."""
    told = set()
    for seed in range(60):
        with pytest.raises((ComputedError, InputError)) as caught:
            walk(links=30, seed=seed)
        told.add(re.sub(r".*round.*", "refused", str(caught.value)))
    assert told == {"", "refused"}
