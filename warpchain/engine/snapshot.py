"""A world of a batch between two launches: all that its next launch depends on, taken out and put back to the bit."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.inputs.arrays import Array
from warpchain.kernels import layout

Snapshot = Mapping[str, NDArray[Any]]
"""Name → one world's part of an array."""

KEPT: Final = ("state/", "drive/")
"""How the names of arrays begin that are kept."""
CACHES: Final = ("scratch", "lists")
"""What follows from the state but for rounding, and fits a chain of the same constants and options only."""


def take_snapshot(batch: Batch, world: int) -> dict[str, NDArray[Any]]:
    """The snapshot of a world."""
    kept = {name: np.array(values[world]) for name, values in batch.host.items() if name.startswith(KEPT)}
    return kept | {name: np.array(getattr(batch, name)[world].numpy()) for name in CACHES}


def restore(batch: Batch, world: int, snapshot: Snapshot) -> None:
    """Put a snapshot of a chain of equal length, options and parameters back; its caches may be absent."""
    for name, values in snapshot.items():
        if name.startswith(KEPT):
            batch.host[name][world] = values
    for name in CACHES:
        if name in snapshot:
            own = getattr(batch, name)[world]
            wp.copy(own, wp.array(snapshot[name], dtype=own.dtype, device=own.device))


def change(batch: Batch, world: int, position: Array, velocity: Array) -> None:
    """Give a world that was restored another state, of which nothing is known; its losses and samples start anew.

    Its clock, the softness of its joints, its counters and its watches go on.
    """
    batch.place(world, position, velocity)
    batch.set_state(world, **dict.fromkeys(("has_first_stage", "gap", "time_to_contact", "slack", "losses"), 0))
    if batch.host["state/is_rigid"][world]:  # joints become rigid again as soon as they are quiet
        step, other = (float(batch.host[f"state/{name}"][world]) for name in ("step", "other_step"))
        batch.set_state(world, step=other, other_step=step, is_rigid=0, last_error=1.0)
    batch.host["state/last_sample"][world, layout.TIME] = -1.0
