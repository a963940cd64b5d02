"""A world that goes on from a state of a walk."""

from warpchain.engine.batch import Batch
from warpchain.engine.snapshot import CACHES, change, restore, set_frame_marks
from warpchain.inputs.state import Setup, State
from warpchain.status import Status
from warpchain.walks.moving_plane import plane_of_state, state_of_plane


def go_on(batch: Batch, world: int, start: State, setup: Setup, end: float, frame_interval: float) -> bool:
    """Let a world whose chain is set go on from a state of a walk, until a time [s]; whether it is as in the walk.

    If it is not, it stops at once, and so makes the sample with which its new ledger begins.
    """
    is_kept = start.is_placed_as_in(setup)
    restore(batch, world, {name: part for name, part in start.memory.items() if is_kept or name not in CACHES})
    set_frame_marks(batch, world, frame_interval)
    if is_kept and _is_at(batch, world, start):
        batch.resume(world, end, Status.TIME_LIMIT)
        return True
    if start.axes is not None:
        batch.set_plane(world, plane_of_state(start))
    change(batch, world, start.position, start.velocity)
    batch.resume(world, batch.time(world), Status.FINISHED)
    return False


def _is_at(batch: Batch, world: int, start: State) -> bool:
    """Whether a world has the places and velocities of a state, to the bit."""
    pairs = [(batch.position(world), start.position), (batch.velocity(world), start.velocity)]
    if start.axes is not None:
        pairs += [(values, getattr(start, name)) for name, values in state_of_plane(batch.plane(world)).items()]
    return all(here.tobytes() == there.tobytes() for here, there in pairs)
