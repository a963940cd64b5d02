"""What a sweep would take, before any of its walks is run: walks, files, disk, memory, and, by a pilot, time."""

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.processors import processors
from warpchain.inputs.arrays import Array
from warpchain.inputs.options import on_gpu
from warpchain.inputs.validation import InputError
from warpchain.run.sweep_run import BYTES_OF_WALK, checked_part, on_device, shard_size
from warpchain.store.folder import continued, read_rows, seen
from warpchain.store.shards import Manifest
from warpchain.sweeps.block import Block
from warpchain.sweeps.plan import Source, Sweep, load_sweep
from warpchain.sweeps.rounds import Asked
from warpchain.walks.scheduler import compile_kernels, run_setups

MOST_CORNERS: Final = 64
"""Most walks of a pilot."""


Corner = tuple[str, dict[str, Any], float]
Mask = NDArray[np.bool_]


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
        pilot: block, values of the axes and time [s] of a walk of each corner of the grid; empty without a pilot.
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
    the grid, and takes the times between them as linear along the axes.
    """
    planned = load_sweep(source, **replaced)
    planned = planned if device is None else on_device(planned, device)
    blocks, seen_cells = planned.blocks, list[Asked]()
    manifest = Manifest(planned, shard_size(planned), checked_part(part))
    if folder is not None and (folder / "sweep.h5").exists():
        manifest = continued(folder, planned, manifest)
        rows, _ = read_rows(folder, manifest)
        found, asked = seen(planned, rows)
        seen_cells = [Asked.of(*both) for both in zip(blocks, rows, strict=True)]
    else:
        found, asked = np.zeros(planned.walk_count, bool), manifest.turns == 0
    left = manifest.mine & ~found
    least, expected = left & asked, None
    if planned.has_rounds and seen_cells:
        both = list(zip(blocks, seen_cells, strict=True))
        wanted = [np.arange(block.samples) < each.forecast[:, np.newaxis] for block, each in both]
        expected = int((left & np.concatenate([each.ravel() for each in wanted])).sum())
        left &= ~np.concatenate([np.repeat(each.over, block.samples) for block, each in both]) | asked
    chosen = [choice for choice in planned.recording.choices.values()]
    motions = sum(
        any(choice.includes(sample) for choice in chosen) for sample in manifest.keys["sample"][least].tolist()
    )
    at_once = gpus or workers or processors()
    times = [_times(block) for block in blocks] if pilot else []
    return planned, SweepPlan(
        cells=len(np.unique(manifest.keys[["block", "cell"]][manifest.mine])),
        done=int((manifest.mine & found).sum()),
        walks=(int(least.sum()), int(left.sum())),
        expected=expected,
        shards=len(manifest.left(found, asked)),
        motions=motions,
        memory=BYTES_OF_WALK * planned.walk_count,
        at_once=at_once,
        pilot=list(itertools.chain.from_iterable(corners for corners, _ in times)),
        seconds=_wall_times([each for _, each in times], blocks, (least, left), min(at_once, processors())),
    )


def _wall_times(times: list[Array], blocks: Sequence[Block], walks: Sequence[Mask], at_once: int) -> tuple[float, ...]:
    """Wall time [s] of some walks of a sweep, given the time of a walk of each cell; empty without these."""
    if not times:
        return ()
    each = np.concatenate([np.repeat(own.ravel(), block.samples) for own, block in zip(times, blocks, strict=True)])
    return tuple(float(each[chosen].sum()) / at_once for chosen in walks)


def _times(block: Block) -> tuple[list[Corner], Array]:
    """A walk of each corner of a block, and the time [s] of a walk in every cell, linear between the corners."""
    sizes = block.shape[:-1]
    ends = [sorted({0, size - 1}) for size in sizes]
    if math.prod(map(len, ends)) > MOST_CORNERS:
        problem = f"the grid of block {block.name} has more than {MOST_CORNERS} corners"
        raise InputError(f"--pilot: {problem}; remove it, or plan a grid with fewer axes")
    cells = list(itertools.product(*ends))
    setups = list(block.fixed_in(cells))
    if any(on_gpu(setup.options.device) for setup in setups):
        remedy = "run a few samples, whose progress line shows the time left"
        raise InputError(f"--pilot: a GPU runs thousands of walks at once, of which one says nothing; {remedy}")
    compile_kernels(setups)
    corners = []
    for cell, setup in zip(cells, setups, strict=True):
        began = time.perf_counter()
        list(run_setups([setup]))
        values = {name: axis[place] for (name, axis), place in zip(block.axes.items(), cell, strict=True)}
        corners.append((block.name, values, time.perf_counter() - began))
    times = np.reshape([seconds for *_, seconds in corners], [len(own) for own in ends])
    for axis, size in enumerate(sizes):
        times = np.linspace(times.take(0, axis), times.take(-1, axis), size, axis=axis)
    return corners, times
