"""What a sweep would take, before any of its walks is run: walks, files, disk, memory, and, by a pilot, time."""

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from warpchain.engine.processors import processors
from warpchain.inputs.options import on_gpu
from warpchain.inputs.validation import InputError
from warpchain.run.sweep_run import BYTES_OF_WALK, checked_part, on_device, shard_size
from warpchain.store.folder import continued, read_rows, seen
from warpchain.store.shards import Manifest
from warpchain.sweeps.block import Block
from warpchain.sweeps.plan import Source, Sweep, load_sweep
from warpchain.sweeps.rounds import Asked
from warpchain.walks.scheduler import compile_kernels, run_setups

Corner = tuple[str, dict[str, Any], float]
"""Block, values of the axes, and time [s] of a walk there."""


@dataclass(frozen=True, kw_only=True)
class SweepPlan:
    """What a sweep would take, or what is left of it.

    Attributes:
        cells: number of cells, of the part if it is one.
        done: number of walks that are there.
        walks: number of walks that are left: those asked for so far, and, with `until`, the most that there can be.
        expected: number of walks that are left with `until` if cells go on to scatter as they do; None before any is.
        shards: number of files of the walks that are asked for.
        motions: number of these walks whose motion is kept.
        memory: bytes that the results take in the end, at most.
        at_once: walks that run at a time; with `gpus` processes.
        pilot: a walk of each corner of the grid; empty without a pilot.
        seconds: wall time of each of `walks`; empty without a pilot.
    """

    cells: int
    done: int
    walks: tuple[int, int]
    expected: int | None
    shards: int
    motions: int
    memory: int
    at_once: int
    pilot: list[Corner]
    seconds: tuple[float, ...]


def plan_sweep(
    source: Source,
    folder: Path | None = None,
    *,
    device: str | None = None,
    workers: int | None = None,
    gpus: int | None = None,
    part: str | None = None,
    pilot: bool = False,
    **replaced: object,
) -> tuple[Sweep, SweepPlan]:
    """A checked sweep and what it would take; arguments as of `sweep`, errors likewise. Nothing is written.

    A folder in which the sweep has begun is read: the plan is of what is left. A `pilot` runs a walk of each corner of
    the grid, whose mean time stands for that of all walks of its block; none if no walk is left.
    """
    planned = on_device(load_sweep(source, **replaced), device)
    blocks, cells = planned.blocks, list[Asked]()
    manifest = Manifest(planned, shard_size(planned), checked_part(part))
    if folder is not None and (folder / "sweep.h5").exists():
        manifest = continued(folder, planned, manifest)
        rows, _ = read_rows(folder, manifest)
        found, asked, cells = seen(planned, rows)
    else:
        found, asked = np.zeros(planned.walk_count, bool), manifest.turns == 0
    left = manifest.mine & ~found
    least, expected = left & asked, None
    if planned.has_rounds and cells:
        most = [np.arange(own.walks.shape[1]) < own.forecast[:, np.newaxis] for own in cells]
        expected = int((left & np.concatenate([walks.ravel() for walks in most])).sum())
        left &= asked | np.concatenate([np.repeat(~own.over, own.walks.shape[1]) for own in cells])
    chosen = planned.recording.choices.values()
    motions = sum(
        any(choice.includes(sample) for choice in chosen) for sample in manifest.keys["sample"][least].tolist()
    )
    at_once = gpus or workers or processors()
    pilot = pilot and bool(left.any())
    corners = [list(_corners(block)) for block in blocks] if pilot else []
    each = np.array([np.mean([seconds for *_, seconds in own]) for own in corners]) / min(at_once, processors())
    return planned, SweepPlan(
        cells=len(np.unique(manifest.keys[["block", "cell"]][manifest.mine])),
        done=int((manifest.mine & found).sum()),
        walks=(int(least.sum()), int(left.sum())),
        expected=expected,
        shards=len(manifest.left(found, asked)),
        motions=motions,
        memory=BYTES_OF_WALK * planned.walk_count,
        at_once=at_once,
        pilot=list(itertools.chain.from_iterable(corners)),
        seconds=tuple(float(each[manifest.keys["block"][walks]].sum()) for walks in (least, left)) if pilot else (),
    )


def _corners(block: Block) -> Iterator[Corner]:
    """Time a walk of each corner of a block; an `InputError` if it is one for a GPU."""
    cells = list(itertools.product(*(sorted({0, size - 1}) for size in block.shape[:-1])))
    setups = list(block.fixed_in(cells))
    if any(on_gpu(setup.options.device) for setup in setups):
        remedy = "run a few samples, whose progress line shows the time left"
        raise InputError(f"--pilot: a GPU runs thousands of walks at once, of which one says nothing; {remedy}")
    compile_kernels(setups)
    for cell, setup in zip(cells, setups, strict=True):
        values = {name: axis[place] for (name, axis), place in zip(block.axes.items(), cell, strict=True)}
        began = time.perf_counter()
        list(run_setups([setup]))
        yield block.name, values, time.perf_counter() - began
