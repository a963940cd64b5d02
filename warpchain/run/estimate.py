"""How long a sweep would take on this machine, and how large its folder would be, from a few of its walks."""

import concurrent.futures
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from warpchain.engine.devices import gpu_turn
from warpchain.engine.processors import processors
from warpchain.inputs.options import on_gpu
from warpchain.run.sweep_run import checked_part, kinds_of, on_device
from warpchain.sweeps.plan import PlannedWalk, Sweep, load_sweep
from warpchain.walks.rows import row_type
from warpchain.walks.scheduler import compile_kernels, run_setups
from warpchain.walks.walk_result import MOTION

PILOTS: Final = 16
"""Walks that are tried on CPUs, two for each processor if there are more."""
GPU_PILOTS: Final = 1024
"""On a GPU, where few walks take as long as many."""
AXES: Final = {"series": "t", "frames": "f"}
"""What may be kept of a motion → first axis of its arrays."""


@dataclass(frozen=True)
class Estimate:
    """What a sweep would take.

    Attributes:
        walks: number of its walks.
        pilots: number of walks that were tried.
        workers: number of tasks at a time.
        seconds: time [s], without compilation.
        bytes: size of the rows and of the kept motions.
    """

    walks: int
    pilots: int
    workers: int
    seconds: float
    bytes: float


def estimate_sweep(
    source: str | os.PathLike[str] | Mapping[str, Any] | Sweep,
    *,
    device: str | None = None,
    workers: int | None = None,
    part: str | None = None,
    **replaced: int | None,
) -> Estimate:
    """Try walks that are evenly spread over a sweep; arguments and errors as of :func:`warpchain.sweep`."""
    planned = load_sweep(source, **{name: value for name, value in replaced.items() if value is not None})
    planned = planned if device is None else on_device(planned, device)
    indices, kinds = planned.indices, kinds_of(planned)
    uses_gpu = all(on_gpu(setup.options.device) for setup in kinds)
    at_once = 1 if uses_gpu else workers or processors()
    count = min(len(indices), GPU_PILOTS if uses_gpu else max(PILOTS, 2 * at_once))
    pilots = [planned.planned(int(indices[place])) for place in np.linspace(0, len(indices) - 1, count).astype(int)]
    compile_kernels(kinds, count)
    with concurrent.futures.ThreadPoolExecutor(at_once) as threads:
        found = list(threads.map(_tried, [planned] * at_once, [pilots[number::at_once] for number in range(at_once)]))
    seconds, *motions = np.sum(found, axis=0) / count
    size = len(indices) * row_type([name for block in planned.blocks for name in block.drawn]).itemsize
    for name, taken in zip(AXES, motions, strict=True):
        if (choice := planned.recording.choices.get(name)) is not None:
            chosen = (
                block.walk_count // block.samples * sum(map(choice.includes, range(block.samples)))
                for block in planned.blocks
            )
            size += taken * sum(chosen)
    walks = -(-len(indices) // checked_part(part)[1])
    return Estimate(walks, count, at_once, seconds * walks / at_once, size * walks / len(indices))


def _tried(planned: Sweep, pilots: Sequence[PlannedWalk]) -> tuple[float, ...]:
    """Time [s] of some walks, and bytes of their series and of their frames, as if all of them were kept."""
    choices = planned.recording.choices.values()
    first = next((choice.samples[0] for choice in choices if choice.samples != "all"), 0)
    setups, keeps = [walk.setup for walk in pilots], [planned.keep(replace(walk, sample=first)) for walk in pilots]
    sizes, began = dict.fromkeys(AXES.values(), 0.0), time.perf_counter()
    with gpu_turn(setup.options.device for setup in setups):
        for _, run in run_setups(setups, keeps=keeps):
            motion = run.recorder.motion() if choices else {}
            for name, stored in MOTION.items() if motion else ():
                sizes[stored.shape[0]] += motion[name].size * (4 if "n" in stored.shape else 8)
    return time.perf_counter() - began, *sizes.values()
