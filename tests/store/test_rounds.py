"""Folders of sweeps that run until errors are reached: the same bytes whatever happens, in parts, and as they grow."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.store.test_growth import columns
from tests.support.stopped_calls import is_stopped
from tests.support.synthetic_sweep import content, run, synthetic_rows, synthetic_sweep, write
from warpchain.inputs.validation import InputError
from warpchain.results.sweep_result import load, merge
from warpchain.store.folder import SweepFolder
from warpchain.sweeps.plan import Sweep

GRID = {"links": [60, 90, 120]}


def sweep_of(until: Any = "2 %", at_most: int | None = 64, **more: Any) -> Sweep:
    """Cells whose distances have a standard deviation of 10 %: about 25 walks have an error of 2 %."""
    rounds = {"until": until} | ({} if at_most is None else {"at_most": at_most})
    return synthetic_sweep({"name": "main", "grid": GRID, "samples": 4, **(rounds if until else {}), **more})


def walks(folder: Path) -> np.ndarray:
    """Number of walks of each cell that are there."""
    return load(folder).is_there.sum(axis=-1).ravel()


def test_cells_stop_when_they_may(tmp_path: Path) -> None:
    """Each cell has as many doublings as its error takes: the one before the last was not enough, the last is."""
    run(tmp_path, sweep_of())
    result = load(tmp_path)
    cells = result.statistics()
    assert result.missing_count == 0 and cells.reached is not None and cells.reached.all()
    assert set(walks(tmp_path)) <= {16, 32, 64} and result.walk_count == walks(tmp_path).sum()
    assert (cells.standard_error <= 0.02 * cells.mean).all()
    for dx, count in zip(result.dx, walks(tmp_path), strict=True):
        half = dx[: count // 2][np.isfinite(dx[: count // 2])]
        assert len(half) < 8 or half.std(ddof=1) / len(half) ** 0.5 > 0.02 * half.mean()
    assert len(result.to_pandas()) == result.walk_count


def test_every_change_of_the_disk_may_be_the_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped before any of its changes, and run again, a sweep leaves the same files to the byte."""
    sweep = sweep_of("3 %", 32, grid={"links": [60, 90]})
    run(tmp_path / "whole", sweep)
    expected = content(tmp_path / "whole")
    for stops in itertools.count(0, 9):
        folder = tmp_path / str(stops)
        if not is_stopped(lambda: run(folder, sweep), stops, monkeypatch):  # noqa: B023
            break
        run(folder, sweep)
        assert content(folder) == expected, stops
    assert stops > 40


@pytest.mark.parametrize("seed", range(2))
def test_the_order_of_shards_does_not_matter(tmp_path: Path, seed: int) -> None:
    """A run that leaves off after any shard of any order goes on to the same bytes."""
    sweep, rng = sweep_of(grid={"links": [60, 90]}), np.random.default_rng(seed)
    run(tmp_path / "whole", sweep)
    while True:
        with SweepFolder.open(tmp_path / "any", sweep, shard_size=20) as store:
            missing = store.missing()
            for place in rng.permutation(len(missing))[: rng.integers(1, 20)]:
                write(store, missing[place], synthetic_rows(sweep, missing[place]))
        if not missing:
            break
        load(tmp_path / "any").statistics()
    assert content(tmp_path / "any") == content(tmp_path / "whole")


def test_parts_have_whole_cells_and_make_the_whole(tmp_path: Path) -> None:
    """Each part decides for its cells alone; merged, they are the sweep that was run in one go, to the byte."""
    sweep = sweep_of()
    run(tmp_path / "whole", sweep)
    parts = [tmp_path / f"part-{number}" for number in (1, 2, 3)]
    for number, folder in enumerate(parts, 1):
        run(folder, sweep, part=(number, 3))
        assert np.count_nonzero(walks(folder)) == 1
    merge(parts, tmp_path / "parts.h5")
    merge(tmp_path / "whole", tmp_path / "whole.h5")
    assert (tmp_path / "parts.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()
    assert columns(load(tmp_path / "parts.h5")) == columns(load(tmp_path / "whole"))


@pytest.mark.parametrize("sampler", ["random", "sobol", "saltelli"])
def test_a_sweep_grows_into_one_with_less_error(tmp_path: Path, sampler: str) -> None:
    """From a number of samples to an error, to less of it, to more rounds: the walks are those of the last alone."""
    steps = [sweep_of(None, samples=8, sampler=sampler), sweep_of("3 %", sampler=sampler)]
    steps += [sweep_of({"dx": "1.5 %", "walk_time": "50 ms"}, 128, sampler=sampler)]
    before: dict[str, bytes] = {}
    for sweep in steps:
        run(tmp_path / "grown", sweep)
        after = content(tmp_path / "grown/shards")
        assert before.items() <= after.items()
        before = after
    assert len(after) > 8 * 3
    run(tmp_path / "fresh", steps[-1])
    assert columns(load(tmp_path / "grown")) == columns(load(tmp_path / "fresh"))
    cells = load(tmp_path / "fresh").statistics("walk_time")
    assert (cells.standard_error[cells.reached] <= 0.05).all()


def test_rounds_may_be_of_some_blocks_only(tmp_path: Path) -> None:
    """A block without an error has all of its samples at once, beside one that has rounds."""
    own = [{"name": "fixed", "samples": 12, "grid": {"links": [60]}}, {"name": "rounds", "until": "2 %", "samples": 8}]
    run(tmp_path, synthetic_sweep(*own))
    result = load(tmp_path)
    assert result.missing_count == 0 and result.blocks["fixed"].statistics().reached is None
    assert result.blocks["fixed"].shape == (1, 12) and result.blocks["rounds"].is_there.sum() in (16, 32, 64)


def test_what_does_not_fit_the_folder_is_refused(tmp_path: Path) -> None:
    """Fewer samples than the folder may have, or a part that would have other walks, end in one line."""
    run(tmp_path / "rounds", sweep_of())
    with pytest.raises(
        InputError, match="holds up to 64 samples of each cell of block main, but 32 are requested; use samples: 64 or"
    ):
        run(tmp_path / "rounds", sweep_of(None, samples=32))
    run(tmp_path / "part", sweep_of(None), part=(1, 2))
    with pytest.raises(InputError, match="parts with and without until have different walks; use another folder"):
        run(tmp_path / "part", sweep_of(), part=(1, 2))
