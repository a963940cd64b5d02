"""The lock of a folder where there is no `flock`: on Windows and on some network file systems."""

import errno
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.synthetic_sweep import SHARD_SIZE, SWEEP, run
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.results.sweep_result import load
from warpchain.store.folder import SweepFolder

WITHOUT = """
import sys
for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
import os
for name in ("O_NONBLOCK", "fork", "register_at_fork", "pread", "pwrite", "sched_getaffinity"):
    if hasattr(os, name):
        delattr(os, name)
"""
"""A Python without what only POSIX has, as far as this package and its libraries can be tried without it."""
WALK = """
import warpchain
walk = warpchain.walk(links=30, frequency=5.0, preset="soft", start="ellipse", walk_limit=0.01)
walk.save("walk.h5")
print(warpchain.load_walk("walk.h5").dx == walk.dx or walk.status.label)
usual = {"preset": "soft", "start": "ellipse", "walk_limit": 0.01}
result = warpchain.sweep(links=[30], frequency=[5.0], samples=1, out="sweep", **usual)
print(result.missing_count)
"""


def no_flock(descriptor: int, how: int) -> None:
    """Refuse as a file system without locks does."""
    raise OSError(errno.ENOLCK, "No locks available")


def test_a_walk_and_a_sweep_run_without_what_only_posix_has(tmp_path: Path) -> None:
    """The package is imported, a walk saved and read, and a sweep run; a warning says how its folder is locked."""
    done = subprocess.run([sys.executable, "-c", WITHOUT + WALK], cwd=tmp_path, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-1] == "0" and "lock.held locks it" in done.stderr
    assert load(tmp_path / "sweep").missing_count == 0 and not (tmp_path / "sweep/lock.held").exists()


def test_a_file_locks_where_there_are_no_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second run is refused with the file to delete; the first one removes the file when it ends."""
    monkeypatch.setattr("fcntl.flock", no_flock)
    held = tmp_path / "lock.held"
    with pytest.warns(InputWarning, match=f"^{tmp_path}: has no flock, so the file lock.held locks it"):
        with SweepFolder.open(tmp_path, SWEEP, shard_size=SHARD_SIZE):
            who = f"in use by process {os.getpid()} on {socket.gethostname()}"
            with pytest.raises(InputError, match=f"{who}; wait .*, or delete lock.held there if it has ended$"):
                SweepFolder.open(tmp_path, SWEEP, shard_size=SHARD_SIZE)
            assert held.exists()
        assert not held.exists()
        run(tmp_path)
    assert load(tmp_path).missing_count == 0


def test_a_killed_process_does_not_hold_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file of a process of this machine that has ended without a word is no lock."""
    program = (
        "import errno, fcntl, os, sys, tests.store.test_folder_lock as here\n"
        "fcntl.flock = here.no_flock\n"
        "here.SweepFolder.open(sys.argv[1], here.SWEEP, shard_size=here.SHARD_SIZE)\n"
        "os._exit(0)\n"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=True, cwd=Path(__file__).parents[2])
    assert (tmp_path / "lock.held").exists()
    monkeypatch.setattr("fcntl.flock", no_flock)
    with pytest.warns(InputWarning, match="lock.held locks it"):
        run(tmp_path)
    assert load(tmp_path).missing_count == 0


def test_nothing_is_left_of_a_refusal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder that holds something else is refused, without a lock file left there."""
    monkeypatch.setattr("fcntl.flock", no_flock)
    (tmp_path / "sweep.yaml").write_text("mine: true")
    with pytest.warns(InputWarning), pytest.raises(InputError, match="in the way of a sweep"):
        SweepFolder.open(tmp_path, SWEEP, shard_size=SHARD_SIZE)
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.yaml"]
