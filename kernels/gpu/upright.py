"""A chain whose plane stays upright, as hooks of the GPU loop; see :mod:`gpu.tilting` for one whose plane tilts."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.gpu.contacts.proximity import block_contact
from warpchain.kernels.gpu.stage import Place
from warpchain.kernels.types import Drive, Ground, Row, Rows, State

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class BlockPlane:
    """Warp functions of a chain's plane and of the floor or sprocket that it meets, for all threads of a block.

    P: the plane, in memory that all threads share, which the first one changes. M: the same for sums, which nobody else
    uses meanwhile. Between a function that uses M and any other use of that memory there must be a barrier.

    Attributes:
        load: ``(K, P, state, world)`` loads the plane; for one thread.
        store: ``(P, state, world)`` stores it; for one thread.
        begin_run: ``(K, P, M, place)`` when the host has set the links.
        after_first_stage: ``()`` after a first stage has been evaluated.
        begin_step: ``(K, P, place, h)`` moves the plane to the middle of a step, and the first stage with it.
        end_step: ``(K, P, M, place, h)`` carries the plane to the end of an accepted step.
        meet: ``(K, P, M, place, ground, drive, world, time)`` applies the impulses of the floor or sprocket →
            number of those of this thread.
    """

    load: Any
    store: Any
    begin_run: Any
    after_first_stage: Any
    begin_step: Any
    end_step: Any
    meet: Any


@functools.cache
def block_upright(fixed_body: str) -> BlockPlane:
    """A plane that stays upright, for a key of :data:`contacts.fixed_body.BODIES`."""
    meet_body = block_contact(fixed_body)

    @wp.func
    def load(_K: Rows, _P: Row, _state: State, _world: int):
        return

    @wp.func
    def store(_P: Row, _state: State, _world: int):
        return

    @wp.func
    def begin_run(_K: Rows, _P: Row, _M: Row, _place: Place):
        return

    @wp.func
    def after_first_stage():
        return

    @wp.func
    def begin_step(_K: Rows, _P: Row, _place: Place, _h: wp.float64):
        return

    @wp.func
    def end_step(_K: Rows, _P: Row, _M: Row, _place: Place, _h: wp.float64):
        return

    @wp.func
    def meet(K: Rows, _P: Row, _M: Row, place: Place, ground: Ground, drive: Drive, world: int, time: wp.float64):
        hits = int(0)
        if place.lane < place.links:
            hits = meet_body(K, place, ground, drive, world, time)
        return hits

    return BlockPlane(load, store, begin_run, after_first_stage, begin_step, end_step, meet)
