"""A world of a batch between two launches: all that its next launch depends on, taken out and put back to the bit."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.kernels import layout
from warpchain.kernels.types import Drive, State

Array = NDArray[np.float64]
Snapshot = Mapping[str, NDArray[Any]]
"""Name → one world's part of an array."""

CACHES: Final = ("scratch", "lists")
"""What follows from the state but for rounding, and fits a chain of the same constants and options only."""


def _arrays(batch: Batch) -> Iterator[tuple[str, wp.array]]:
    """Arrays that the host reads and edits, by name."""
    structs: dict[str, Any] = {"state": State, "drive": Drive}
    for group, struct in structs.items():
        yield from ((f"{group}/{name}", getattr(getattr(batch, group), name)) for name in struct.vars)


def take_snapshot(batch: Batch, world: int) -> dict[str, NDArray[Any]]:
    """The snapshot of a world."""
    found = {name: np.array(batch._view(array)[world]) for name, array in _arrays(batch)}
    return found | {name: np.array(getattr(batch, name)[world].numpy()) for name in CACHES}


def restore(batch: Batch, world: int, snapshot: Snapshot) -> None:
    """Put a snapshot of a chain of equal length, options and parameters back; its caches may be absent."""
    for name, array in _arrays(batch):
        batch._edit(array)[world] = snapshot[name]
    for name in CACHES:
        if name in snapshot:
            own = getattr(batch, name)[world]
            wp.copy(own, wp.array(snapshot[name], dtype=own.dtype, device=own.device))


def change(batch: Batch, world: int, position: Array, velocity: Array) -> None:
    """Give a world that was restored another state, of which nothing is known; its losses and samples start anew.

    Its clock, the softness of its joints, its counters and its watches go on.
    """
    state, links = batch.state, batch.links[world]
    batch._edit(state.links)[world, :, :links] = np.concatenate([position, velocity], axis=1).T
    batch._edit(state.is_fresh)[world] = 1
    for array in (state.has_first_stage, state.gap, state.time_to_contact, state.slack, state.losses):
        batch._edit(array)[world] = 0
    if batch._view(state.is_rigid)[world]:  # joints become rigid again as soon as they are quiet
        steps = batch._edit(state.step), batch._edit(state.other_step)
        steps[0][world], steps[1][world] = steps[1][world], steps[0][world]
        batch._edit(state.is_rigid)[world] = 0
        batch._edit(state.last_error)[world] = 1.0
    batch._edit(state.last_sample)[world, layout.TIME] = -1.0


def set_frame_marks(batch: Batch, world: int, interval: float) -> None:
    """Let a world that goes on take frames at multiples of an interval [s]; 0: with its samples."""
    mark = np.floor(batch.time(world) / interval) if interval > 0 else -1
    batch._edit(batch.state.next_frame)[world] = mark


def set_first_area(batch: Batch, world: int, area: float) -> None:
    """Set the area [m²] that a loop which collapses is compared with."""
    batch._edit(batch.state.first_area)[world] = area
