"""Folders of sweeps: killed at any moment, gone on with, locked, refused, and full disks."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support import synthetic_sweep
from tests.support.stopped_calls import is_stopped
from tests.support.synthetic_sweep import LONG_SWEEP, SHARD_SIZE, SWEEP, content, run, synthetic_rows, write
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.results.sweep_result import load
from warpchain.run.sweep_run import run_shards
from warpchain.store import shards
from warpchain.store.folder import SweepFolder
from warpchain.store.shards import Manifest, read_manifest, stamp, write_shard
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.version import NUMERICS_VERSION

FIRST, SECOND = "000000.h5", "000001.h5"
SHARDS = Manifest(SWEEP, SHARD_SIZE).wanted
CHANGED = replace(SWEEP, seed=7, name="changed")


def open_folder(directory: Path, sweep: Any = SWEEP, **settings: Any) -> SweepFolder:
    """A store of the synthetic sweep."""
    return SweepFolder.open(directory, sweep, **({"shard_size": SHARD_SIZE} | settings))


def play(part: str, directory: Path, *within: str) -> Any:
    """What a part of `synthetic_sweep` prints, played in a process of its own, which a command may surround."""
    command = [*within, sys.executable, synthetic_sweep.__file__, part, str(directory)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=100)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@contextmanager
def refused(error: type[Exception] | tuple[type[Exception], ...], directory: Path, *words: str) -> Iterator[None]:
    """The block fails with one line that has the words, and the folder keeps all that it had."""
    before = content(directory) if directory.exists() else {}
    with pytest.raises(error) as caught:
        yield
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in words), text
    assert (content(directory) if directory.exists() else {}) == before


# Begin, go on, end


def test_a_sweep_survives_kills(tmp_path: Path) -> None:
    """Killed 20 times at random moments, always readable and gone on with: the same bytes as one never killed."""
    done = play("killed", tmp_path / "killed")
    assert done["kills"] == 20 and done["states"] >= 8
    run(tmp_path / "whole", LONG_SWEEP, shard_size=4)
    assert content(tmp_path / "killed") == content(tmp_path / "whole")
    assert not [name for name in os.listdir(tmp_path / "killed") if name.startswith(".")]


@pytest.mark.parametrize("fresh", [False, True])
def test_every_step_of_opening_may_be_the_last(tmp_path: Path, fresh: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped before any change to the folder, opening it again succeeds and leaves the same as one never stopped."""
    sweep = CHANGED if fresh else SWEEP
    run(tmp_path / "whole", sweep)
    expected, stops = content(tmp_path / "whole"), 0
    while True:
        folder = tmp_path / str(stops)
        if fresh:
            run(folder)
        if not is_stopped(lambda: open_folder(folder, sweep, fresh=fresh).close(), stops, monkeypatch):  # noqa: B023
            break
        run(folder, sweep, fresh=fresh and b"changed" not in (folder / "sweep.h5").read_bytes())
        assert content(folder) == expected, stops
        stops += 1
    assert stops >= 4


def test_unfinished_files_go(tmp_path: Path) -> None:
    """What a killed process had half written is cleared away; hidden files of others are not."""
    run(tmp_path)
    parts = [".sweep.0123abcd.part.h5", "shards/.000000.0123abcd.part.h5"]
    for name in (*parts, ".nfs0123", "shards/.keep"):
        (tmp_path / name).write_bytes(b"half")
    open_folder(tmp_path).close()
    assert [name for name in parts if (tmp_path / name).exists()] == []
    assert (tmp_path / ".nfs0123").exists() and (tmp_path / "shards/.keep").exists()


# One process at a time


def test_a_second_process_is_refused(tmp_path: Path) -> None:
    """A held folder says who holds it; it is free at once when the holder is killed, even if its worker lives on."""
    command = [sys.executable, synthetic_sweep.__file__, "holder", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8") as holder:
        assert holder.stdout is not None
        worker = int(holder.stdout.readline())
        try:
            with refused(InputError, tmp_path, str(tmp_path), f"in use by process {holder.pid} on ", "wait"):
                open_folder(tmp_path)
            holder.kill()
            holder.wait()
            os.kill(worker, 0)  # is alive
            open_folder(tmp_path).close()
        finally:
            holder.kill()
            os.kill(worker, signal.SIGKILL)


def test_workers_may_write_the_same_shard(tmp_path: Path) -> None:
    """Processes, and threads, that write one shard at the same time leave it whole, with the same bytes."""
    assert play("race", tmp_path / "race") == [0, 0, 0, 0]
    with open_folder(tmp_path / "threads") as opened, ThreadPoolExecutor(4) as threads:
        shards = opened.missing()[:2] * 20
        list(threads.map(lambda shard: write(opened, shard, synthetic_rows(SWEEP, shard)), shards))
    assert content(tmp_path / "race") == content(tmp_path / "threads")
    assert load(tmp_path / "race").missing_count == 120


# Refusals


def test_a_changed_sweep_is_refused(tmp_path: Path) -> None:
    """Another sweep is refused in a folder unless it may start anew; another name of the same sweep is not."""
    run(tmp_path)
    with refused(
        InputError,
        tmp_path,
        f"{tmp_path.name}: holds another sweep (synthetic)",
        "or fresh, which deletes what is there",
    ):
        open_folder(tmp_path, CHANGED)
    open_folder(tmp_path, replace(SWEEP, name="renamed")).close()
    with open_folder(tmp_path, CHANGED, fresh=True) as opened:
        assert len(opened.missing()) == 8
        opened.log("anew")
    run(tmp_path, CHANGED)
    run(tmp_path / "whole", CHANGED)
    assert content(tmp_path / "whole").items() <= content(tmp_path).items()


def test_other_numerics_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Walks of another version of the numerics are not gone on with, but still read."""
    run(tmp_path)
    (tmp_path / "lock").unlink()  # as of a copied folder
    monkeypatch.setattr(shards, "NUMERICS_VERSION", 99)
    with refused(InputError, tmp_path, f"numerics {NUMERICS_VERSION}, but this warpchain has 99", "or fresh"):
        open_folder(tmp_path)
    assert load(tmp_path).missing_count == 0 and not (tmp_path / "lock").exists()


def test_shards_of_other_numerics_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Such shards, copied into a folder, are named with both versions, by readers and by runs; nothing is deleted."""
    run(tmp_path / "now")
    with monkeypatch.context() as patched:
        patched.setattr(shards, "NUMERICS_VERSION", 16)
        run(tmp_path / "old")
    path = tmp_path / "now/shards" / FIRST
    shutil.copy(tmp_path / "old/shards" / FIRST, path)
    for act in (load, open_folder):
        with refused(InputError, tmp_path, f"{path}: ", f"of numerics 16, those of this folder of {NUMERICS_VERSION}"):
            act(tmp_path / "now")


def test_a_worker_of_other_numerics_computes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It compares its version with that of the folder before it begins."""
    with open_folder(tmp_path) as opened:
        seal, missing = stamp(tmp_path), opened.missing()
    monkeypatch.setattr(shards, "NUMERICS_VERSION", 99)
    monkeypatch.setattr("warpchain.run.sweep_run.run_setups", lambda *given, **more: pytest.fail("walks were run"))
    words = f"{tmp_path}: its walks are of numerics {NUMERICS_VERSION}", "this warpchain has 99", "all workers"
    with refused(InputError, tmp_path, *words):
        run_shards(SWEEP, str(tmp_path), seal, missing[:1])


@pytest.mark.parametrize("name", [".keep", "999999.h5", "000100.h5", "notes", "notes.txt", "000001.h5"])
def test_only_what_a_sweep_has_written_is_deleted(tmp_path: Path, name: str) -> None:
    """Files, folders and other programs' HDF5 files among the shards are named by --fresh, and all stays."""
    run(tmp_path)
    path = tmp_path / "shards" / name
    if name in ("999999.h5", "notes"):
        path.mkdir()
        (path / "mine").write_text("mine")
    else:
        path.unlink(missing_ok=True)
        path.write_bytes(b"\x89HDF\r\n\x1a\nmine" * 50)
    with refused(InputError, tmp_path, f"{path}: no sweep has written this; move it out of this folder"):
        open_folder(tmp_path, CHANGED, fresh=True)
    if name[:6].isdigit():
        with refused((InputError, OSError), tmp_path, f"{path}: "):
            open_folder(tmp_path)


@pytest.mark.parametrize("fresh", [False, True])
@pytest.mark.parametrize("name", ["sweep.yaml", "shards", "log.txt", "sweep.h5", "lock", "walk.h5"])
def test_files_of_others_are_not_touched(tmp_path: Path, name: str, fresh: bool) -> None:
    """A folder that has such a name for something else is refused, even to start anew."""
    (tmp_path / name).write_text("mine: true")
    with refused(InputError, tmp_path, str(tmp_path / name), "use"):
        open_folder(tmp_path, fresh=fresh)
    assert (tmp_path / name).read_text() == "mine: true" and os.listdir(tmp_path) == [name]


def test_a_sweep_may_have_more_values_than_a_file(tmp_path: Path) -> None:
    """What its blocks share stands once in a file and in each block of a folder, which is read all the same."""
    values = {"links": 400, "start": "ellipse", "link_masses": [3e-3] * 400, "link_inertias": [1.5e-7] * 400}
    blocks = [{"name": f"b{k}", "scene": {"frequency": k + 1.0}} for k in range(130)]
    shared = {"version": 1, "name": "many", "seed": 1, "preset": "paper", "samples": 1, "scene": values}
    planned = load_sweep(shared | {"blocks": blocks})
    (tmp_path / "sweep.h5").write_bytes(Manifest(planned, SHARD_SIZE).image())
    assert read_manifest(tmp_path).sweep.digest() == planned.digest()


def test_a_shard_of_another_sweep_is_refused(tmp_path: Path) -> None:
    """A shard with the right name but of another sweep, or of other walks, is named; nothing is deleted meanwhile."""
    run(tmp_path / "one")
    run(tmp_path / "two", CHANGED)
    first, second = (tmp_path / "one/shards" / name for name in (FIRST, SECOND))
    kept = first.read_bytes()
    for stranger in (tmp_path / "two/shards" / FIRST, second):
        shutil.copy(stranger, first)
        with refused(InputError, tmp_path, f"{first}: a shard of another sweep", "move it"):
            open_folder(tmp_path / "one")
    second.write_bytes(second.read_bytes()[:-1])
    with refused(InputError, tmp_path, f"{first}: a shard of another sweep", "move it"):
        open_folder(tmp_path / "one")
    first.write_bytes(kept)
    with pytest.warns(InputWarning):
        open_folder(tmp_path / "one").close()


def test_a_sweep_that_is_refused_now_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A method that was removed since: one line with the file and what to do."""
    run(tmp_path)
    path, content = tmp_path / "sweep.h5", SWEEP.canonical()
    content["blocks"][0]["options"]["method"] = "rodas5p"
    with monkeypatch.context() as patched:
        patched.setattr(Sweep, "canonical", lambda sweep: content)
        path.write_bytes(Manifest(SWEEP, SHARD_SIZE).image())
    with refused(InputError, tmp_path, f"{path}: sweep.blocks[0].options.method: unknown method 'rodas5p'", "version"):
        load(tmp_path)


def test_workers_need_the_folder(tmp_path: Path) -> None:
    """A worker that does not see the folder, or finds another sweep in it, writes nothing."""
    rows, first = synthetic_rows(SWEEP, SHARDS[0]), SHARDS[0]
    with open_folder(tmp_path) as opened:
        seal = stamp(opened.directory)
    with refused(InputError, tmp_path, f"{tmp_path / 'elsewhere'}: no sweep", "every worker"):
        write_shard(tmp_path / "elsewhere", seal, first, rows, {})
    open_folder(tmp_path, CHANGED, fresh=True).close()
    with refused(InputError, tmp_path, "belongs to another sweep now"):
        write_shard(tmp_path, seal, first, rows, {})


# What the system refuses


def test_a_full_disk(tmp_path: Path) -> None:
    """A disk that fills up in the middle: a clear line, nothing lost, and the sweep goes on once there is room."""
    namespace = ("unshare", "--mount", "--map-root-user")
    mount = [*namespace, "mount", "-t", "tmpfs", "tmpfs", "/mnt"]
    if shutil.which("unshare") is None or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("needs a mount namespace")
    done = play("full_disk", tmp_path / "full", *namespace)
    writing, opening = done["messages"]
    assert ".h5: cannot be written (No space left on device); free disk space" in writing
    assert "free disk space" in opening and done["missing"] == 0
