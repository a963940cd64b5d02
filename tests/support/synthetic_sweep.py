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
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py  # noqa: F401 - before the forks below, or each would read it anew
import numpy as np

from warpchain.status import Status
from warpchain.store.folder import SweepFolder
from warpchain.store.manifest import BlockLayout
from warpchain.store.shards import empty_rows, write_shard
from warpchain.store.sweep_result import load
from warpchain.sweeps.plan import digest_of
from warpchain.walks.rows import Rows, quantity_of

SHARD_SIZE = 20


@dataclass(frozen=True)
class SyntheticSweep:
    """What a store reads of a sweep; two blocks of 3 × 2 × 20 and 5 × 8 walks."""

    name: str = "synthetic"
    seed: int = 2**100 + 1
    blocks: tuple[BlockLayout, ...] = field(
        default=(
            BlockLayout(
                "rest",
                {"links": (60, 90, 120), "frequency": (5.0, 12.5)},
                20,
                0,
                ("phase", "floor_friction", "clearance"),
            ),
            BlockLayout("ellipse", {"gravity": (1.6, 3.7, 9.8, 12.0, 24.8)}, 8, 120, ("phase", "link_length")),
        )
    )

    @property
    def walk_count(self) -> int:
        """Walks of all blocks."""
        return sum(int(np.prod(block.shape)) for block in self.blocks)

    def canonical(self) -> dict[str, Any]:
        """All that there is, in the form of a real sweep."""
        blocks = [
            {
                "name": block.name,
                "preset": "paper",
                "samples": block.samples,
                "sampler": "random",
                "distributions": {"all": "fixed"} | {name: {"uniform": [0, 1]} for name in block.drawn},
                "grid": {name: list(values) for name, values in block.axes.items()},
            }
            for block in self.blocks
        ]
        return {"name": self.name, "seed": self.seed, "blocks": blocks}

    def digest(self, samples: Sequence[int] | None = None) -> str:
        """As of a real sweep, with these samples of each block if they are given."""
        return digest_of(self.canonical(), samples)


SWEEP: Any = SyntheticSweep()
LONG_SWEEP: Any = SyntheticSweep(blocks=(BlockLayout("main", {"links": (60, 90)}, 350, 0, ("phase",)),))


def synthetic_rows(sweep: Any, walks: range) -> Rows:
    """Rows that each depend on the index of their walk only; about one walk in ten fails."""
    rows = empty_rows(sweep, walks)
    for row, index in zip(rows, walks, strict=True):
        block = next(block for block in reversed(sweep.blocks) if block.first <= index)
        rng = np.random.default_rng([sweep.seed, index])
        failed = rng.random() < 0.1
        row["status"] = Status.TIME_LIMIT if failed else Status.AT_REST
        names = [name for name in rows.dtype.names or () if name not in ("index", "status")]
        for name in names:
            if rows.dtype[name].kind == "i":
                row[name] = rng.integers(0, 100)
            elif quantity_of(name) in block.drawn or name in ("walk_time", "energy_at_release"):
                row[name] = rng.random()
        row["dx"] = np.nan if failed else rng.normal(1.0, 0.1)
    return rows


def write(store: SweepFolder, walks: range, rows: Rows) -> str:
    """Write a shard as a worker does; its key."""
    return write_shard(store.directory, store.manifest.digest, walks, rows)


def run(directory: Path | str, sweep: Any = SWEEP, *, shard_size: int = SHARD_SIZE, **settings: Any) -> None:
    """Begin or go on with a sweep, to its end."""
    with SweepFolder.open(directory, sweep, shard_size=shard_size, **settings) as store:
        for walks in store.missing():
            write(store, walks, synthetic_rows(sweep, walks))


def content(directory: Path) -> dict[str, bytes]:
    """All files in a folder of a sweep but those that say when and who."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file() and path.name not in ("lock", "log.txt")
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
        if (directory / "sweep.json").exists():  # at any moment the folder can be read
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
                for _, walks in itertools.product(range(10), store.manifest.shards[:2]):
                    write(store, walks, synthetic_rows(SWEEP, walks))
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


def play_read_only(directory: Path) -> None:
    """In a mount namespace: a folder that cannot be written, for root either."""
    subprocess.run(["mount", "--bind", directory, directory], check=True)
    subprocess.run(["mount", "-o", "remount,ro,bind", directory], check=True)
    try:
        SweepFolder.open(directory, SWEEP, shard_size=SHARD_SIZE)
    except OSError as error:
        print(json.dumps({"message": str(error), "missing": load(directory).missing_count}))


if __name__ == "__main__":
    globals()[f"play_{sys.argv[1]}"](Path(sys.argv[2]))
