"""Sweeps as they are run: on slots, threads, processes and a Dask cluster, killed and resumed."""

import concurrent.futures
import multiprocessing
import os
import signal
from pathlib import Path

import numpy as np
import pytest

from tests.support.setups import setup_walk
from warpchain.chain.setup import Setup
from warpchain.run.sweep_run import run_shards, sweep
from warpchain.run.workers import LostWorkersError
from warpchain.status import Status
from warpchain.walks.scheduler import run_setups

BRIEF = {"start": "ellipse", "walk_limit": 0.01}
"""Walks of a few milliseconds of one core: they end at their time limit."""

TINY = {
    "version": 1,
    "name": "tiny",
    "seed": 7,
    "preset": "soft",
    "samples": 20,
    "scene": BRIEF,
    "options": {"method": "dp5"},
    "grid": {"links": [30, 44], "frequency": [5, 15]},
}


def brief_setup(seed: int, **settings: object) -> Setup:
    """One brief walk, drawn by its seed."""
    return setup_walk("soft", {"links": 30, "frequency": 12.0, "method": "dp5"} | BRIEF | settings, seed)


def outcome(run) -> tuple:
    """Everything of a walk that a row keeps."""
    return run.status, run.outcome().walk_time, str(vars(run.outcome()))


def outcomes(setups, **how) -> list:
    """What each of the walks gave, in their order."""
    found = {place: outcome(run) for over in run_setups(setups, **how) for place, run in over}
    return [found[place] for place in range(len(setups))]


def data_of(folder: Path) -> dict[str, bytes]:
    """Name → bytes of all shards."""
    return {path.name: path.read_bytes() for path in sorted((folder / "shards").glob("[0-9]*.h5"))}


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory) -> dict[str, bytes]:
    """The shards of the tiny sweep, run in one go on one thread."""
    folder = tmp_path_factory.mktemp("uninterrupted") / "sweep"
    result = sweep(TINY, folder, workers=1)
    assert result.summary() == {"time_limit": 80, "at_rest": 0, "missing": 0}
    return data_of(folder)


def test_one_broken_walk_among_a_thousand_changes_no_other():
    """A chain whose mass is forced to NaN ends as not_finite; the other 999 are what they are without it."""
    setups = [brief_setup(seed, walk_limit=5e-4) for seed in range(1000)]
    whole = outcomes(setups, slots=16)
    values = setups[500].parameters.model_dump() | {"inner_mass": float("nan")}
    forced = type(setups[500].parameters).model_construct(**values)
    setups[500] = Setup(setups[500].preset, forced, setups[500].scene, setups[500].options)
    with_broken = outcomes(setups, slots=16)
    assert with_broken[500][0] == Status.NOT_FINITE
    assert [Status.TIME_LIMIT] * 1000 == [row[0] for row in whole]
    assert with_broken[:500] == whole[:500]
    assert with_broken[501:] == whole[501:]


def test_threads_and_processes_write_the_same_bytes(tmp_path, uninterrupted):
    """However many workers share a sweep, and whether they are threads or processes, its shards are the same."""
    sweep(TINY, tmp_path / "threads", workers=3, device="cpu")
    assert data_of(tmp_path / "threads") == uninterrupted
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as processes:
        sweep(TINY, tmp_path / "processes", executor=processes, workers=2)
    assert data_of(tmp_path / "processes") == uninterrupted


def test_a_finished_sweep_is_not_run_again(tmp_path, uninterrupted):
    """A second run of a complete sweep computes nothing and gives the same result."""
    folder = tmp_path / "sweep"
    sweep(TINY, folder)
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "shards").iterdir()}
    seen = []
    sweep(TINY, folder, on_progress=seen.append)
    assert seen == []
    assert {path: path.stat().st_mtime_ns for path in (folder / "shards").iterdir()} == stamps
    assert data_of(folder) == uninterrupted


def test_a_failing_walk_stops_the_sweep_and_keeps_what_is_done(tmp_path, monkeypatch, uninterrupted):
    """An exception in a worker reaches the caller; finished shards stay, and a later run completes the sweep."""
    calls = 0

    def sometimes(*arguments):
        nonlocal calls
        calls += 1
        if calls == 6:
            raise RuntimeError("the machine caught fire")
        return run_shards(*arguments)

    monkeypatch.setattr("warpchain.run.sweep_run.run_shards", sometimes)
    with pytest.raises(RuntimeError, match="caught fire"):
        sweep(TINY, tmp_path / "sweep", workers=1)
    monkeypatch.undo()
    kept = data_of(tmp_path / "sweep")
    assert 0 < len(kept) < len(uninterrupted)
    assert kept.items() <= uninterrupted.items()
    sweep(TINY, tmp_path / "sweep")
    assert data_of(tmp_path / "sweep") == uninterrupted


def test_what_an_executor_loses_after_shards_are_written_is_done(tmp_path, uninterrupted):
    """Dask fails a future whose result it lost with a killed worker."""

    class Forgetful(concurrent.futures.ThreadPoolExecutor):
        def submit(self, call, *arguments):
            def lost():
                call(*arguments)
                raise TypeError("cannot unpack non-iterable NoneType object")

            return super().submit(lost)

    with Forgetful(1) as executor:
        sweep(TINY, tmp_path / "sweep", executor=executor, workers=1)
    assert data_of(tmp_path / "sweep") == uninterrupted


@pytest.mark.slow
def test_a_dask_worker_may_be_killed(tmp_path, uninterrupted):
    """With a worker of a Dask cluster killed in the middle, nothing is lost and the bytes are the same."""
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = list(client.run(os.getpid).values())
        killed = []

        def kill_once(progress):
            if not killed and progress.done >= 10:
                os.kill(pids[0], signal.SIGKILL)
                killed.append(progress.done)

        result = sweep(TINY, tmp_path / "sweep", executor=client, on_progress=kill_once)
        after = set(client.run(os.getpid).values())
    assert killed and killed[0] < 80
    assert pids[0] not in after
    assert result.missing_count == 0
    assert data_of(tmp_path / "sweep") == uninterrupted
    np.testing.assert_array_equal(np.sort(result.index.ravel()), np.arange(80))


@pytest.mark.slow
def test_a_dask_cluster_may_be_closed_midway(tmp_path):
    """The sweep ends in one line, and the shards that were written are kept."""
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None)

    def close(progress):
        if progress.done >= 10:
            cluster.close()

    with distributed.Client(cluster) as client, pytest.raises(LostWorkersError, match="the workers ended") as lost:
        sweep(TINY | {"samples": 400}, tmp_path / "sweep", executor=client, on_progress=close)
    assert "\n" not in str(lost.value) and data_of(tmp_path / "sweep")


def test_the_first_walks_are_of_all_cells(tmp_path):
    """So the rate, and the time left, are soon those of the whole sweep."""
    cells = []

    class InOrder(concurrent.futures.ThreadPoolExecutor):
        def submit(self, call, planned, directory, stamp, shards, pulse):
            cells.append([int(cell) for shard in shards for cell in shard.keys["cell"]])
            return super().submit(call, planned, directory, stamp, shards, pulse)

    with InOrder(1) as executor:
        sweep(TINY, tmp_path / "sweep", executor=executor, workers=1)
    assert sorted(cell for task in cells for cell in task) == sorted(list(range(4)) * 20)
    assert {cell for task in cells[: len(cells) // 6] for cell in task} == {0, 1, 2, 3}
