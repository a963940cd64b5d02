"""A chain whose plane stays upright, as hooks of the CPU loop; see :mod:`cpu.tilting` for one whose plane tilts."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.cpu.contacts.proximity import fixed_contacts
from warpchain.kernels.cpu.joints import Joints
from warpchain.kernels.types import Chain, Row, Rows, State


@dataclass(frozen=True)
class Plane:
    """Warp functions of a chain's plane and of the floor or sprocket that it meets. P: a row of ``State.plane``."""

    begin_run: Any  # ``(K, P, chain)`` when the host has set the links
    at_start: Any  # ``(P, chain)`` → the chain on the plane where the step begins
    # ``(K, P, chain, state, world, h)`` evaluates the first stage → the chain on the plane that its links feel in this
    # step
    begin_step: Any
    end_step: Any  # ``(K, P, chain, h)`` carries the plane to the end of an accepted step, whose ends are placed
    gap: Any  # ``(K, chain, ground, face)`` → least gap [m] of the chain on its plane
    meet: Any  # ``(K, P, chain, ground, face)`` applies the impulses of the floor or sprocket → their number


@functools.cache
def upright_plane(fixed_body: str, joints: Joints) -> Plane:
    """A plane that stays upright, for a key of :data:`contacts.fixed_body.BODIES`."""
    gap, resolve = fixed_contacts(fixed_body)

    @wp.func
    def begin_run(_K: Rows, _P: Row, _chain: Chain):
        return

    @wp.func
    def at_start(_P: Row, chain: Chain) -> Chain:
        return chain

    @wp.func
    def begin_step(K: Rows, _P: Row, chain: Chain, state: State, world: int, _h: wp.float64) -> Chain:
        joints.first_stage(K, chain, state, world)
        return chain

    @wp.func
    def end_step(_K: Rows, _P: Row, _chain: Chain, _h: wp.float64):
        return

    return Plane(begin_run, at_start, begin_step, end_step, gap, resolve)
