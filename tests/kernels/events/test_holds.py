"""Loops that are held and released: which loop it is, how long that takes, hard cases and refusals."""

import math
from itertools import chain
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.presets import SOFT
from tests.support.setups import setup_walk
from warpchain import InputError, Status
from warpchain.chain.link_values import alternating
from warpchain.engine.batch import ATTEMPTS
from warpchain.inputs.options import LONGEST_DRIVE_INTERVAL
from warpchain.walks import scheduler

CELL = {"links": 60, "frequency": 15.0}

UNDAMPED = {"load_factor": 1.0, "steady_time": 0.0, "steady_tolerance": 1.0}
"""A hold under its own loads, for a time that `extra_hold` says."""


def released(preset: str = "soft", **settings: Any) -> warpchain.WalkResult:
    """A walk that is stopped as soon as its loop has been released, with the last time round before that."""
    stopped = {"method": "explicit", "walk_limit": 1e-3, "record_before": 0.15}
    walk = warpchain.walk(preset=preset, **stopped, **settings)
    assert walk.status == Status.TIME_LIMIT
    return walk


def shape_of(walk: warpchain.WalkResult) -> np.ndarray:
    """Height, width, and x, y of the middle of a loop before its release, mean of the frames [m]."""
    joints = walk.before_release.frame_joints - walk.sprocket_center
    height, width = np.ptp(joints[..., 1], axis=1), np.ptp(joints[..., 0], axis=1)
    return np.mean([height, width, *joints.mean(axis=1).T], axis=1)


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    """The loop of 60 links at 15 Hz after ten seconds under its own loads."""
    walk = released(start="spinning", extra_hold=10.0, **CELL, **UNDAMPED)
    assert 10 < walk.hold_time < 11
    return shape_of(walk)


@pytest.mark.slow
@pytest.mark.parametrize("start", ["rest", "spinning"])
@pytest.mark.parametrize("chain", ["soft", "paper"])
def test_the_loop_that_is_released_is_the_stationary_one(chain: str, start: str, truth: np.ndarray) -> None:
    """From rest or turning, on soft or stiff joints, it is the undamped hold's to 0.5 %, after a second or two."""
    found = released(chain, start=start, **CELL)
    height, width = truth[:2]
    change = np.abs(shape_of(found) - truth) / [height, width, width, height]
    assert np.all(change < 0.005), change
    assert 0.3 < found.hold_time < 2.5
    assert 0 < found.drift <= 0.01


def test_a_drive_depends_neither_on_its_launches_nor_on_its_neighbours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops driven under several loads are released in the same state to the bit, however cut, in whatever batch."""
    cases = [
        {"links": 30, "frequency": 15.0},
        {"links": 44, "frequency": 10.0, "start": "rest", "settle_time": 0.1, "spin_up_time": 0.2},
        {"links": 36, "frequency": 20.0, "load_factor": 5.0, "extra_hold": 0.05},
        {"links": 30, "frequency": 12.0, "load_factor": 1.0, "steady_time": 0.2, "steady_tolerance": 0.05},
    ]
    setups = [
        setup_walk("soft", {"method": "explicit", "start": "spinning", "walk_limit": 1e-3} | case) for case in cases
    ]

    def outcomes(attempts: int, slots: int) -> dict[int, tuple[Any, ...]]:
        monkeypatch.setitem(ATTEMPTS, "cpu", attempts)
        found = {}
        for place, run in chain.from_iterable(scheduler.run_setups(setups, slots=slots)):
            assert run.status == Status.TIME_LIMIT
            outcome = run.outcome()
            found[place] = outcome.hold_time, str(vars(outcome))
        return found

    whole = outcomes(20_000, 1)
    assert all(hold_time > 0.2 for hold_time, *_ in whole.values())
    assert outcomes(501, 1) == whole
    assert outcomes(777, 3) == whole


@pytest.mark.parametrize(("links", "frequency"), [(60, 15.0), (180, 10.0)])
def test_loops_do_not_sink_into_their_sprocket(links: int, frequency: float) -> None:
    """Under fifty times the loads circles sink in by less than 0.1 mm; without a push it would be a millimetre."""
    walk = released(links=links, frequency=frequency, start="spinning")
    assert walk.greatest_penetration["sprocket"] < 1e-4


# --- hard cases ---


FEWEST = setup_walk("soft", {}).fewest_links
TENTH, TENFOLD = (
    {name: part * getattr(SOFT, name) for name in ("inner_inertia", "outer_inertia")} for part in (0.1, 10.0)
)
HARD = {
    "standing": {"links": 60, "frequency": 0.0},
    "fast": {"links": 180, "frequency": 60.0, "hold_limit": 3.0},
    "fewest": {"links": FEWEST, "frequency": 15.0, "hold_limit": 3.0},
    "long": {"links": 192, "frequency": 20.0, "hold_limit": 4.0},
    "longer": {"links": 300, "frequency": 20.0, "hold_limit": 4.0},  # with kernels of their own
    "point-like": {**CELL, **TENTH, "hold_limit": 3.0},
    "heavy turning": {**CELL, **TENFOLD, "hold_limit": 3.0},
    "weightless": {**CELL, "gravity": 0.0, "hold_limit": 1.0},
    "no friction in joints": {**CELL, "viscous_friction": 0.0, "coulomb_friction": 0.0, "hold_limit": 3.0},
    "heavily loaded": {**CELL, "load_factor": 1000.0, "hold_limit": 3.0},
}

SURE = {
    **dict.fromkeys(("standing", "fewest", "long", "longer", "heavily loaded"), Status.TIME_LIMIT),
    "weightless": Status.NOT_STEADY,
}
"""Those whose end is known: released, the walk then stopped at once; or nothing that slow waves could cross."""


@pytest.mark.slow
@pytest.mark.parametrize("start", ["rest", "spinning"])
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.thorough if name == "longer" else ()) for name in HARD]
)
def test_hard_holds_end_in_a_release_or_as_not_steady(name: str, start: str) -> None:
    """Whatever is held, it ends released or, at its limit, as not steady, and no number is lost."""
    settings = {"method": "explicit", "start": start, "walk_limit": 1e-3, "frame_interval": 1e-3, **HARD[name]}
    expected = SURE.get(name)
    walk = warpchain.walk(preset="soft", **settings)
    assert walk.status in ((Status.TIME_LIMIT, Status.NOT_STEADY) if expected is None else (expected,))
    limit = settings.get("hold_limit", 30.0)
    if walk.status == Status.NOT_STEADY:
        assert walk.hold_time == pytest.approx(limit, abs=1e-9)
    else:
        assert 0 < walk.hold_time < limit
        assert 0 <= walk.drift <= 0.01
        assert np.all(np.isfinite(walk.frame_joints))
        assert np.all(np.isfinite(walk.center)) and np.all(np.isfinite(walk.kinetic_energy))
    assert math.isfinite(walk.greatest_opening)


def test_factors_that_links_cannot_bear_are_refused() -> None:
    """Point-like links may be given as much as leaves them half of their inertia; an ellipse is never loaded."""
    most = alternating(SOFT.with_values(TENTH), 4).greatest_load(SOFT.link_length)
    setup_walk("soft", TENTH | {"load_factor": 0.999 * most})
    with pytest.raises(
        InputError, match=r"^scene\.load_factor: 15 is too much for links .*; use at most 1\.\d+, or null$"
    ):
        setup_walk("soft", TENTH | {"load_factor": 15.0})
    setup_walk("soft", TENTH | {"load_factor": 15.0, "start": "ellipse"})


def test_samples_too_far_apart_for_loads_to_fall_are_refused() -> None:
    """Loads change at samples, which may be 2 ms apart at most unless no load changes."""
    coarse = {"record_interval": 1.1 * LONGEST_DRIVE_INTERVAL, "soften_drive": False}
    with pytest.raises(
        InputError, match=r"^options\.record_interval: loads on the sprocket .*or scene\.load_factor: 1$"
    ):
        setup_walk("soft", coarse)
    setup_walk("soft", coarse | {"load_factor": 1.0})
    setup_walk("soft", coarse | {"start": "ellipse"})
    setup_walk("soft", coarse | {"record_interval": LONGEST_DRIVE_INTERVAL})
