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
from warpchain.run.sweep_run import checked_part, on_device, prepare
from warpchain.sweeps.plan import PlannedWalk, Sweep, load_sweep
from warpchain.walks.rows import row_type
from warpchain.walks.scheduler import run_setups
from warpchain.walks.walk_result import MOTION

PILOTS: Final = 16
"""Walks that are tried on CPUs, two for each processor if there are more."""
GPU_PILOTS: Final = 1024
"""On a GPU, where few walks take as long as many."""


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
    seed: int | None = None,
    samples: int | None = None,
) -> Estimate:
    """Try walks that are evenly spread over a sweep; arguments and errors as of :func:`warpchain.sweep`."""
    replaced = {name: value for name, value in (("seed", seed), ("samples", samples)) if value is not None}
    planned = load_sweep(source, **replaced)
    planned = planned if device is None else on_device(planned, device)
    indices = planned.indices
    walks = -(-len(indices) // checked_part(part)[1])
    uses_gpu = any(on_gpu(walk.setup.options.device) for walk in planned.undrawn(indices[:1].tolist()))
    at_once = 1 if uses_gpu else workers or processors()
    count = min(len(indices), GPU_PILOTS if uses_gpu else max(PILOTS, 2 * at_once))
    pilots = [planned.planned(int(indices[place])) for place in np.linspace(0, len(indices) - 1, count).astype(int)]
    prepare(planned)
    with concurrent.futures.ThreadPoolExecutor(at_once) as threads:
        shares = [pilots[number::at_once] for number in range(at_once)]
        found = list(threads.map(lambda share: _tried(planned, share), shares))
    seconds, series, frames = np.sum(found, axis=0) / count
    kept = {name: _chosen(planned, name) for name in ("series", "frames")}
    row = row_type([name for block in planned.blocks for name in block.drawn]).itemsize
    size = row * len(indices) + series * kept["series"] + frames * kept["frames"]
    return Estimate(walks, count, at_once, seconds * walks / at_once, size * walks / len(indices))


def _tried(planned: Sweep, pilots: Sequence[PlannedWalk]) -> tuple[float, float, float]:
    """Time [s] of some walks, and bytes of their series and of their frames, as if all of them were kept."""
    choices = planned.recording.choices.values()
    first = next((choice.samples[0] for choice in choices if choice.samples != "all"), 0)
    keeps = [planned.keep(replace(walk, sample=first)) for walk in pilots]
    sizes = {"t": 0, "f": 0}
    setups = [walk.setup for walk in pilots]
    began = time.perf_counter()
    with gpu_turn(setup.options.device for setup in setups):
        for number, run in run_setups(setups, keeps=keeps):
            motion = run.recorder.motion() if keeps[number].series_every is not None else {}
            for name, stored in MOTION.items() if motion else ():
                sizes[stored.shape[0]] += motion[name].size * (4 if "n" in stored.shape else 8)
    return time.perf_counter() - began, sizes["t"], sizes["f"]


def _chosen(planned: Sweep, name: str) -> int:
    """Number of walks of which something is kept."""
    choice = planned.recording.choices.get(name)
    if choice is None:
        return 0
    return sum(
        block.walk_count // block.samples * sum(map(choice.includes, range(block.samples))) for block in planned.blocks
    )
