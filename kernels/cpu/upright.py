"""A chain whose plane stays upright, as hooks of the CPU loop; see :mod:`cpu.tilting` for one whose plane tilts."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.cpu.contacts.proximity import fixed_contacts
from warpchain.kernels.cpu.joints import Joints
from warpchain.kernels.hooks import Hooks, hook
from warpchain.kernels.types import Chain, Ground, Row, Rows, Worlds


@dataclass(frozen=True)
class PlaneHooks(Hooks):
    """Warp functions of a chain's plane and of the floor or sprocket that it meets. P: a row of ``Worlds.plane``."""

    # when the host has set the links
    begin_run: Any = hook(K=Rows, P=Row, chain=Chain)
    # → the chain on the plane where the step begins
    at_start: Any = hook(P=Row, chain=Chain)
    # moves the plane to the middle of a step, evaluates the first stage there → the chain on that plane
    begin_step: Any = hook(K=Rows, P=Row, chain=Chain, worlds=Worlds, world=int, h=wp.float64)
    # carries the plane to the end of an accepted step, whose ends are placed
    end_step: Any = hook(K=Rows, P=Row, chain=Chain, h=wp.float64)
    # → least gap [m] of the chain on its plane
    gap: Any = hook(K=Rows, chain=Chain, ground=Ground, face=Face)
    # applies the impulses of the floor or sprocket → their number
    meet: Any = hook(K=Rows, P=Row, chain=Chain, ground=Ground, face=Face)


@functools.cache
def upright_plane(fixed_body: str, joints: Joints) -> PlaneHooks:
    """A plane that stays upright, for a key of :data:`contacts.fixed_body.BODIES`."""
    gap, resolve = fixed_contacts(fixed_body)

    @wp.func
    def begin_run(_K: Rows, _P: Row, _chain: Chain):
        return

    @wp.func
    def at_start(_P: Row, chain: Chain) -> Chain:
        return chain

    @wp.func
    def begin_step(K: Rows, _P: Row, chain: Chain, worlds: Worlds, world: int, _h: wp.float64) -> Chain:
        joints.first_stage(K, chain, worlds, world)
        return chain

    @wp.func
    def end_step(_K: Rows, _P: Row, _chain: Chain, _h: wp.float64):
        return

    return PlaneHooks(begin_run, at_start, begin_step, end_step, gap, resolve)
