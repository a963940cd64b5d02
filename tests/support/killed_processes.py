"""Parents and workers of sweeps that are killed at random moments.

As a script: ``python -m tests.support.killed_processes --kills 50``.
"""

import argparse
import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PATIENCE = 5.0
"""Time [s] after which nothing of a killed parent may run any more."""
LATEST = 6.0
"""Latest moment of a kill [s] after the start of the parent, which takes about three to have its workers."""

SWEEP: dict[str, Any] = {
    "version": 1,
    "name": "killed",
    "seed": 7,
    "preset": "soft",
    "samples": 150,
    "scene": {"start": "ellipse", "walk_limit": 0.01},
    "options": {"method": "dp5"},
    "grid": {"links": [30, 44], "frequency": [5, 15]},
}

PARENT = """
import sys
from tests.support.killed_processes import SWEEP
from warpchain.run.gpu_workers import gpu_workers
from warpchain.run.sweep_run import sweep

if __name__ == "__main__":
    with gpu_workers(2) as executor:
        sweep(SWEEP, sys.argv[1], executor=executor, workers=2)
"""


def listed(columns: str) -> list[list[str]]:
    """Three columns of all processes, as wide as they are."""
    listing = subprocess.run(["ps", "-eww", "-o", columns], capture_output=True, check=True, text=True)
    return [line.split(maxsplit=2) for line in listing.stdout.splitlines()]


def processes_of(session: int) -> list[int]:
    """Numbers of the processes of a session that run: all that its first one has started."""
    rows = listed("pid=,sess=,stat=")
    return [int(pid) for pid, owner, state in rows if int(owner) == session and not state.startswith("Z")]


def workers_of(parent: int) -> list[int]:
    """The worker processes of a parent that run."""
    rows = listed("pid=,ppid=,args=")
    return [int(pid) for pid, owner, command in rows if int(owner) == parent and "spawn_main" in command]


def kill_once(program: Path, folder: Path, victim: str, how: signal.Signals, moment: float, rng: random.Random) -> str:
    """Run a sweep in a process with workers and kill one of them; what came of it.

    Args:
        program: file with `PARENT`.
        folder: folder of the sweep.
        victim: ``parent`` or ``worker``.
        how: SIGKILL or SIGTERM.
        moment: of the kill [s] after the start; that of a worker comes later if there is none yet.
        rng: chooses the worker.

    Returns:
        ``no orphan``, ``orphan``, or ``over before`` if the sweep had ended.
    """
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(program), str(folder)]
    output = subprocess.DEVNULL
    parent = subprocess.Popen(command, env=environment, stdout=output, stderr=output, start_new_session=True)
    try:
        time.sleep(moment)
        chosen: list[int] = [parent.pid]
        while victim == "worker" and parent.poll() is None and not (chosen := workers_of(parent.pid)):
            time.sleep(0.05)
        if parent.poll() is not None:
            return "over before"
        try:
            os.kill(rng.choice(chosen), how)
        except ProcessLookupError:
            return "over before"
        killed = time.monotonic()
        if victim == "worker":  # the parent sees it, and ends by itself
            parent.wait(PATIENCE)
        while parent.poll() is None or processes_of(parent.pid):
            if time.monotonic() - killed > PATIENCE:
                return "orphan"
            time.sleep(0.05)
        return "no orphan"
    except subprocess.TimeoutExpired:
        return "orphan"
    finally:
        for pid in processes_of(parent.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        parent.wait()


def shards_of(folder: Path) -> dict[str, bytes]:
    """Name → bytes of the shards of a sweep."""
    return {path.name: path.read_bytes() for path in sorted((folder / "shards").glob("[0-9]*.h5"))}


def kill_often(kills: int, folder: Path, seed: int = 18) -> Counter[str]:
    """Kill parents and workers of sweeps in turn, and go on with each sweep until it is complete.

    Returns:
        Number of kills by victim, signal and outcome; and of completed sweeps, with equal bytes or others.
    """
    from warpchain.run.sweep_run import sweep

    rng, counts, done, number = random.Random(seed), Counter[str](), 0, 0
    program = folder / "parent.py"
    program.write_text(PARENT)
    sweep(SWEEP, folder / "whole", workers=1, progress=False)
    whole = shards_of(folder / "whole")
    while done < kills:
        victim = ("parent", "worker")[done % 2]
        how = (signal.SIGKILL, signal.SIGTERM)[done // 2 % 2]
        outcome = kill_once(program, folder / f"{number}", victim, how, rng.uniform(0, LATEST), rng)
        if outcome != "over before":
            done += 1
            counts[f"{victim} {how.name}: {outcome}"] += 1
        if outcome == "over before" or len(shards_of(folder / f"{number}")) == len(whole) or done == kills:
            sweep(SWEEP, folder / f"{number}", workers=1, progress=False)
            equal = shards_of(folder / f"{number}") == whole
            counts["sweep resumed: equal bytes" if equal else "sweep resumed: OTHER BYTES"] += 1
            number += 1
    return counts


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    with tempfile.TemporaryDirectory() as scratch:
        for text, count in sorted(kill_often(parser.parse_args().kills, Path(scratch)).items()):
            print(count, text)
