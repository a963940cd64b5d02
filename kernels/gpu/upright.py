"""A chain whose plane stays upright, as hooks of the GPU loop; see :mod:`gpu.tilting` for one whose plane tilts."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.features import Features
from warpchain.kernels.gpu.contacts.proximity import block_contact
from warpchain.kernels.gpu.stage import Run
from warpchain.kernels.hooks import Hooks, hook
from warpchain.kernels.types import Worlds


@wp.func
def nothing(_run: Run):
    """A hook of a plane that stays as it is."""
    return


@wp.func
def no_motion(_run: Run, _h: wp.float64):
    """A hook of a step in which the plane does not move."""
    return


@dataclass(frozen=True)
class PlaneHooks(Hooks):
    """Warp functions of a chain's plane and of the floor or sprocket that it meets, for all threads of a block.

    Between a function that uses ``run.M`` and any other use of that memory there must be a barrier.
    """

    # applies the impulses of the floor or sprocket, from which this thread's link has that gap [m] → number of those of
    # this thread
    meet: Any = hook(run=Run, worlds=Worlds, time=wp.float64, gap=wp.float32)
    # loads the plane, and stores it; for one thread
    load: Any = hook(run=Run, otherwise=nothing)
    store: Any = hook(run=Run, otherwise=nothing)
    # when the host has set the links; uses M
    begin_run: Any = hook(run=Run, otherwise=nothing)
    # moves the plane to the middle of a step
    begin_step: Any = hook(run=Run, h=wp.float64, otherwise=no_motion)
    # carries the plane to the end of an accepted step; uses M
    end_step: Any = hook(run=Run, h=wp.float64, otherwise=no_motion)


@functools.cache
def upright_plane(features: Features) -> PlaneHooks:
    """A plane that stays upright."""
    meet_body = block_contact(features.fixed_body)
    meet_sprocket = block_contact("sprocket")

    @wp.func
    def meet(run: Run, worlds: Worlds, time: wp.float64, gap: wp.float32):
        hits = int(0)
        if run.lane < run.links and gap < wp.float32(0.0):
            if wp.static(features.has_drive) and run.is_driven:
                hits = meet_sprocket(run, worlds, time)
            else:
                hits = meet_body(run, worlds, time)
        return hits

    return PlaneHooks(meet)
