"""Any walk of a sweep, run again."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.command_line import Command
from warpchain import InputError, SweepResult, WalkResult
from warpchain.inputs.validation import InputWarning
from warpchain.results.sweep_result import merge
from warpchain.walks.rows import STORED_COLUMNS, fill_outcomes, missing_rows, row_type

SWEEP: dict[str, Any] = {
    "links": 12,
    "frequency": [3.0, 4.0],
    "start": "ellipse",
    "preset": "soft",
    "method": "dp5",
    "clearance": 1e-3,
    "stop_time": 0.05,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of two cells with two samples each, which begins small and grows."""
    path = tmp_path_factory.mktemp("repeated") / "sweep"
    warpchain.sweep(**SWEEP, samples=1, out=path, progress=False)
    warpchain.sweep(**SWEEP, samples=2, out=path, progress=False)
    return path


def assert_same_numbers(walk: WalkResult, result: SweepResult, place: tuple[int, ...]) -> None:
    """A walk has all numbers of a row, to the bit."""
    row = missing_rows(row_type(()), np.zeros(1, row_type(())))
    fill_outcomes(row, [0], vars(walk))
    for name in ("status", *STORED_COLUMNS):
        assert row[name].tobytes() == result.columns[name][place].astype(row[name].dtype).tobytes(), name


def test_every_walk_is_repeated_to_the_bit(folder: Path, tmp_path: Path) -> None:
    """By its number or its place, from folder or merged file, with series and frames; growth changes no number."""
    merge(folder, tmp_path / "merged.h5")
    small = warpchain.sweep(**SWEEP, samples=1, out=tmp_path / "small", progress=False)
    for result in (warpchain.load(folder), warpchain.load(tmp_path / "merged.h5")):
        for place, index in np.ndenumerate(result.index):
            walk = result.walk(int(index), frame_interval=5e-3)
            assert_same_numbers(walk, result, place)
            assert walk.seed == result.seed and len(walk.time) == 51 and len(walk.frame_time) >= 10
        placed = result.walk(frequency=4.0, sample=1, frame_interval=None)
        assert_same_numbers(placed, result, (1, 1))
        drawn = {name: result.columns[f"{name}_drawn"][1, 1] for name in result.drawn}
        assert len(drawn) > 5
        for name, value in drawn.items():
            given = {**vars(placed.setup.parameters), **vars(placed.setup.scene)}
            assert given[name] == value
    for index in small.index.ravel():
        assert_same_numbers(small.walk(int(index)), result, tuple(np.argwhere(result.index == index)[0]))


def test_a_walk_of_a_sweep_from_the_command_line(command: Command, folder: Path) -> None:
    """`walk --like DIR --index 3` prints the walk with this number."""
    result = warpchain.load(folder)
    answer = command("walk", "--like", str(folder), "--index", "3", "--json")
    assert answer.status == 0
    place = tuple(np.argwhere(result.index == 3)[0])
    shown = json.loads(answer.out)
    assert shown["steps_accepted"] == result.steps_accepted[place] and shown["seed"] == result.seed
    assert shown["energy"]["kinetic_at_end"] == result.energy_kinetic_at_end[place]


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("walk --like DIR", "--like: DIR has many walks; add --index"),
        ("walk --like DIR --index 9", "index: expected a number in the column index"),
        ("walk --like DIR --index one", "index: expected an integer, got 'one'"),
        ("walk --index 3", "--index: --like is missing"),
        ("animate DIR", "expected a saved walk, got the folder of a sweep; use a saved walk"),
    ],
)
def test_a_walk_that_is_not_named_is_refused(command: Command, folder: Path, line: str, problem: str) -> None:
    """A sweep without a number, a number without a sweep, or one that is not there; a film of a whole sweep."""
    answer = command(*(word.replace("DIR", str(folder)) for word in line.split()))
    assert answer.status == 2 and problem.replace("DIR", str(folder)) in answer.err


def test_numbers_that_say_no_walk_are_refused(folder: Path) -> None:
    """A number beside values of axes or a sample, or a truth value."""
    result = warpchain.load(folder)
    with pytest.raises(InputError, match="frequency: not possible with index"):
        result.walk(0, frequency=3.0)
    with pytest.raises(InputError, match="sample: not possible with index"):
        result.walk(0, sample=1)
    with pytest.raises(InputError, match="index: expected an integer, got True"):
        result.walk(True)
    for several in ([3.0, 4.0], np.array([3.0, 4.0]), [3.0]):
        with pytest.raises(InputError, match=r"^frequency: .* is not on the axis; use one of "):
            result.walk(frequency=several)


def test_a_walk_that_is_not_the_same_brings_a_warning(folder: Path) -> None:
    """Where the sweep has another Δx, as of another version, a warning says so."""
    result = warpchain.load(folder)
    result.columns["status"][0, 0] = warpchain.Status.AT_REST
    result.columns["dx"][0, 0] = 1.25
    with pytest.warns(InputWarning, match=r"walk 0: Δx is nan m, and 1.25 m in the sweep"):
        assert math.isnan(result.walk(0).dx)
