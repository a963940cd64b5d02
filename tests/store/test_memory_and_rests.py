"""What is too large for memory, what killed writers leave, and readers beside a run that begins anew."""

import errno
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tests.support.command_line import Command
from tests.support.synthetic_sweep import SWEEP, run
from warpchain.results import sweep_result
from warpchain.results.sweep_result import load, merge


def test_a_sweep_that_memory_cannot_hold_makes_no_folder(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its size is compared with the free memory first; one line has both."""
    monkeypatch.setattr("warpchain.run.sweep_run.free_memory", lambda: 1e5)
    answer = command("sweep", "figure6", "-o", "sweep")
    assert answer.status == 2 and not Path("sweep").exists() and answer.err.count("\n") == 1
    assert answer.err.startswith("error: samples: ") and "GB of memory, and 0.0001 GB are free; use fewer" in answer.err


def test_memory_that_runs_out_is_one_line(command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A `MemoryError` of any library ends a command with status 1 and no traceback."""
    run(tmp_path / "sweep")

    def fail(*given: object) -> None:
        raise MemoryError("Unable to allocate 11 TiB")

    monkeypatch.setattr(sweep_result, "read_rows", fail)
    answer = command("info", "sweep")
    assert answer.status == 1
    assert answer.err == "error: out of memory (Unable to allocate 11 TiB); compute less at once, or free memory\n"


def test_an_error_of_the_system_gets_path_and_remedy(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that no part of the package has named."""

    def fail(path: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    monkeypatch.setattr(sweep_result, "_load_folder", fail)
    answer = command("info", "sweep")
    assert answer.status == 2
    assert answer.err == "error: sweep: cannot be read or written (Permission denied); make the folder writable\n"


def test_a_killed_merge_leaves_no_part_for_good(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The next merge to that name clears what killed ones had written, but nothing that is being written."""
    run(tmp_path / "sweep")
    program = (
        "import os, sys\n"
        "from warpchain.files import replacing\n"
        "with replacing(sys.argv[1]) as part:\n"
        "    part.write_bytes(b'half')\n"
        "    print(part, flush=True)\n"
        "    sys.stdin.read() or os._exit(1)\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "all.h5")]
    dead = Path(subprocess.run(command, input="", capture_output=True, encoding="utf-8").stdout.strip())
    others = [tmp_path / name for name in (".all.0123abcd.part.txt", ".other.0123abcd.part.h5", ".all.mine.part.h5")]
    for path in others:
        path.write_bytes(b"mine")
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8") as writer:
        assert writer.stdout is not None and writer.stdin is not None
        alive = Path(writer.stdout.readline().strip())
        for path in (dead, alive):
            os.utime(path, (time.time() - 60,) * 2)
        assert dead.exists()
        merge(tmp_path / "sweep", tmp_path / "all.h5")
        assert alive.exists() and not dead.exists() and all(path.exists() for path in others)
        writer.kill()
    assert load(tmp_path / "all.h5").missing_count == 0


def test_a_reader_beside_a_run_that_begins_anew(tmp_path: Path) -> None:
    """Reading never fails while shards are deleted and written again."""
    run(tmp_path)
    stop, counts = threading.Event(), list[int]()

    def again() -> None:
        while not stop.is_set():
            run(tmp_path, fresh=True)

    writer = threading.Thread(target=again)
    writer.start()
    try:
        last = time.monotonic() + 5
        while time.monotonic() < last or len(counts) < 20:
            counts.append(load(tmp_path).missing_count)
    finally:
        stop.set()
        writer.join()
    assert min(counts) >= 0 and max(counts) <= SWEEP.walk_count
