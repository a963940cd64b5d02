"""A sweep whose walks cost nothing, and processes that write it: for tests of the files of sweeps.

As a script, ``python synthetic_sweep.py PART DIR``: plays one of the parts below in a process of its own.
"""

import itertools
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py  # noqa: F401 - before the forks below, or each would read it anew
import numpy as np

from warpchain.results.sweep_result import load
from warpchain.status import Status
from warpchain.store.folder import SweepFolder
from warpchain.store.shards import CRATE, Shard, stamp, write_shard
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.walks.rows import STORED_COLUMNS, Rows, missing_rows, quantity_of

SHARD_SIZE = 20
UNIT = {"uniform": [0.0, 1.0]}


def synthetic_sweep(*blocks: Mapping[str, Any], **changes: Any) -> Sweep:
    """A sweep of these blocks, which draw the phase unless they say otherwise."""
    drawn = {"all": "fixed", "phase": UNIT}
    given = [{"distributions": drawn, **block} for block in blocks]
    return load_sweep(
        {"version": 1, "name": "synthetic", "seed": 2**100 + 1, "preset": "paper", "blocks": given, **changes}
    )


SWEEP = synthetic_sweep(
    {
        "name": "rest",
        "grid": {"links": [60, 90, 120], "frequency": [5.0, 12.5]},
        "samples": 20,
        "distributions": {"all": "fixed", "phase": UNIT, "floor_friction": UNIT, "clearance": UNIT},
    },
    {
        "name": "ellipse",
        "scene": {"start": "ellipse"},
        "grid": {"gravity": [1.6, 3.7, 9.8, 12.0, 24.8]},
        "samples": 8,
        "distributions": {"all": "fixed", "phase": UNIT, "link_length": {"uniform": [0.0125, 0.0129]}},
    },
)
"""Two blocks of 3 × 2 × 20 and 5 × 8 walks."""
LONG_SWEEP = synthetic_sweep({"name": "main", "grid": {"links": [60, 90]}, "samples": 350})


def synthetic_rows(sweep: Sweep, shard: Shard) -> Rows:
    """Rows that each depend on the number of their walk only; about one walk in ten fails."""
    rows = missing_rows(shard.kind, shard.keys)
    for row, index in zip(rows, shard.walks.tolist(), strict=True):
        drawn = sweep.blocks[int(row["block"])].drawn
        rng = np.random.default_rng([sweep.seed, index])
        failed = rng.random() < 0.1
        row["status"] = Status.TIME_LIMIT if failed else Status.AT_REST
        for name in rows.dtype.names or ():
            if name in STORED_COLUMNS and rows.dtype[name].kind == "i":
                row[name] = rng.integers(0, 100)
            elif quantity_of(name) in drawn or name in ("walk_time", "energy_kinetic_at_release"):
                row[name] = rng.random()
        row["dx"] = np.nan if failed else rng.normal(1.0, 0.1)
    return rows


def write(store: SweepFolder, shard: Shard, rows: Rows) -> None:
    """Write a shard as a worker does."""
    write_shard(store.directory, stamp(store.directory), shard, rows, {})


def run(directory: Path | str, sweep: Sweep = SWEEP, *, shard_size: int = SHARD_SIZE, **settings: Any) -> None:
    """Begin or go on with a sweep, to its end."""
    with SweepFolder.open(directory, sweep, shard_size=shard_size, **settings) as store:
        while missing := store.missing():  # one round, or those of a sweep with `until`
            for shard in missing:
                write(store, shard, synthetic_rows(sweep, shard))


def content(directory: Path) -> dict[str, bytes]:
    """All files in a folder of a sweep but those that say when and who."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file() and path.name not in ("lock", "log.txt", CRATE)
    }


def play_killed(directory: Path) -> None:
    """Run a sweep that is killed 20 times, each time at another random moment; then run it to its end.

    A kill comes some shards after the start, 0 to 4, and some milliseconds: so the sweep does not end before the last
    kill however fast the machine is, and gets on however slow.
    """
    rng, kills, states = random.Random(20180601), 0, set()
    shards = directory / "shards"
    for _ in range(20):
        before = len(list(shards.glob("*.h5")))
        more = rng.randint(0, 4)
        child = os.fork()
        if not child:
            run(directory, LONG_SWEEP, shard_size=4)
            os._exit(0)
        while len(list(shards.glob("*.h5"))) < before + more and os.waitpid(child, os.WNOHANG) == (0, 0):
            time.sleep(0.001)
        time.sleep(rng.uniform(0.0, 0.01))
        os.kill(child, signal.SIGKILL)
        kills += os.WIFSIGNALED(os.waitpid(child, 0)[1])
        if (directory / "sweep.h5").exists():  # at any moment the folder can be read
            states.add(load(directory).missing_count)
    run(directory, LONG_SWEEP, shard_size=4)
    print(json.dumps({"kills": kills, "states": len(states)}))


def play_holder(directory: Path) -> None:
    """Hold a folder, with a forked worker that outlives this process when it is killed."""
    SweepFolder.open(directory, SWEEP, shard_size=SHARD_SIZE)
    if not os.fork():
        print(os.getpid(), flush=True)  # by itself: it has begun to live, and given up the lock
    time.sleep(60)


def play_race(directory: Path) -> None:
    """Write the same shards from four processes at the same time, again and again."""
    with SweepFolder.open(directory, SWEEP, shard_size=SHARD_SIZE) as store:
        children = []
        for _ in range(4):
            children.append(os.fork())
            if not children[-1]:
                for _, shard in itertools.product(range(10), store.manifest.wanted[:2]):
                    write(store, shard, synthetic_rows(SWEEP, shard))
                os._exit(0)
        print(json.dumps([os.waitpid(child, 0)[1] for child in children]))


def play_full_disk(directory: Path) -> None:
    """In a mount namespace: run out of space half-way, make room, go on."""
    directory.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", directory], check=True)
    messages = []
    with SweepFolder.open(directory, SWEEP, shard_size=40) as store:
        first, second, *_ = store.missing()
        write(store, first, synthetic_rows(SWEEP, first))
        before = content(directory)
        filler = directory / "filler"
        try:
            filler.write_bytes(b"0" * 600_000)
        except OSError:
            pass
        try:
            write(store, second, synthetic_rows(SWEEP, second))
        except OSError as error:
            messages.append(str(error))
        assert {name: old for name, old in content(directory).items() if name != "filler"} == before
    try:
        run(directory, shard_size=40)
    except OSError as error:
        messages.append(str(error))
    filler.unlink()
    run(directory, shard_size=40)
    print(json.dumps({"messages": messages, "missing": load(directory).missing_count}))


if __name__ == "__main__":
    globals()[f"play_{sys.argv[1]}"](Path(sys.argv[2]))
