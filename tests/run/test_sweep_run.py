"""Sweeps as they are run: on slots, threads, processes and a Dask cluster, killed and resumed."""

import concurrent.futures
import contextlib
import gc
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.support.setups import setup_walk
from warpchain.cli.main import main
from warpchain.inputs.setup import Setup
from warpchain.run.sweep_run import run_shards, sweep
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
    return run.status, run.walk_time, tuple(run.counts.values()), tuple(run.energy().values())


def outcomes(setups, **how) -> list:
    """What each of the walks gave, in their order."""
    found = {place: outcome(run) for place, run in run_setups(setups, **how)}
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


def test_walks_do_not_depend_on_their_batch():
    """Number of slots, order and company change no bit of a walk, with different n, methods and starts in one batch."""
    setups = [brief_setup(seed) for seed in range(5)]
    setups += [brief_setup(seed, links=44, start="spinning", hold_limit=0.05) for seed in range(2)]
    setups += [brief_setup(9, method="rkf78"), brief_setup(9, links=240)]
    alone = [outcomes([setup])[0] for setup in setups]
    assert outcomes(setups, slots=1) == alone
    assert outcomes(setups, slots=4) == alone
    assert outcomes(setups[::-1], slots=3) == alone[::-1]
    assert len(set(alone)) == len(alone)


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


@pytest.mark.slow
def test_a_dask_worker_may_be_killed(tmp_path, uninterrupted):
    """With a worker of a Dask cluster killed in the middle, nothing is lost and the bytes are the same."""
    distributed = pytest.importorskip("distributed")
    content = TINY | {"samples": 20}
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

        result = sweep(content, tmp_path / "sweep", executor=client, on_progress=kill_once)
        after = set(client.run(os.getpid).values())
    assert killed and killed[0] < 80
    assert pids[0] not in after
    assert result.missing_count == 0
    assert data_of(tmp_path / "sweep") == uninterrupted
    indices = np.sort(result.index.ravel())
    np.testing.assert_array_equal(indices, np.arange(80))


@contextlib.contextmanager
def dask_cluster(folder: Path, workers: int) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Address of a scheduler that was started by itself, with so many workers, and its process."""
    from distributed import Client

    where, dask = folder / "scheduler.json", [sys.executable, "-m", "dask"]
    commands = [["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]]
    commands += [["worker", "--no-nanny", "--nthreads", "1", "--no-dashboard", "--local-directory", folder]] * workers
    processes: list[subprocess.Popen[bytes]] = []
    with (folder / "dask.log").open("wb") as log:
        try:
            for command in commands:
                command = [*dask, *command, "--scheduler-file", where]
                processes.append(subprocess.Popen(command, stdout=log, stderr=log))
            until = time.monotonic() + 60
            while not (where.exists() and where.read_text()):
                assert time.monotonic() < until, "no scheduler"
                time.sleep(0.1)
            with Client(scheduler_file=str(where)) as client:
                client.wait_for_workers(workers, timeout=60)
                address = str(client.scheduler.address)
            yield address, processes[0]
        finally:
            for process in reversed(processes):
                process.kill()
                process.wait()


@pytest.mark.slow
def test_a_dask_cluster_of_separate_processes(tmp_path, uninterrupted):
    """`--scheduler` on a scheduler and two workers that were started by themselves: the bytes are the same."""
    pytest.importorskip("distributed")
    source = tmp_path / "tiny.yaml"
    source.write_text(yaml.safe_dump(TINY, sort_keys=False))
    with dask_cluster(tmp_path, 2) as (address, _):
        command = [sys.executable, "-m", "warpchain", "sweep", source, "-o", tmp_path / "sweep", "--scheduler", address]
        done = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert "80 time_limit" in done.stdout, done.stderr
    assert data_of(tmp_path / "sweep") == uninterrupted


@pytest.mark.parametrize("address", ("tls://127.0.0.1:1", "ucx://127.0.0.1:1", "inproc://1", "http://a:1"))
def test_a_scheduler_that_cannot_be_reached_is_refused(tmp_path, capsys, address):
    """Whatever class of error Dask raises: one line, status 2, no folder, and no client that closes itself later."""
    distributed = pytest.importorskip("distributed")
    with pytest.raises(SystemExit) as caught:
        main(["sweep", "quickstart", "-o", str(tmp_path / "sweep"), "--scheduler", address])
    said = capsys.readouterr().err
    assert caught.value.code == 2 and said.startswith(f"error: --scheduler: '{address}': ") and said.count("\n") == 1
    assert not (tmp_path / "sweep").exists()
    clients = [each for each in gc.get_objects() if isinstance(each, distributed.Client)]
    assert clients and all(client.status == "closed" for client in clients)


@pytest.mark.slow
def test_a_scheduler_may_be_closed_midway(tmp_path):
    """The command ends in one line with status 1, and the shards that were written are kept."""
    pytest.importorskip("distributed")
    source, folder = tmp_path / "tiny.yaml", tmp_path / "sweep"
    source.write_text(yaml.safe_dump(TINY | {"samples": 400}, sort_keys=False))
    with dask_cluster(tmp_path, 1) as (address, scheduler):
        command = [sys.executable, "-m", "warpchain", "sweep", source, "-o", folder, "--scheduler", address]
        run = subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8")
        while run.poll() is None and len(list((folder / "shards").glob("[0-9]*.h5"))) < 5:
            time.sleep(0.05)
        scheduler.kill()
        _, said = run.communicate(timeout=60)
    assert run.returncode == 1 and said.startswith("error: the workers ended") and said.count("\n") == 1
    assert len(data_of(folder)) >= 5
