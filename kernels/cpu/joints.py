"""What the joints of a chain do in a step of the CPU loop: springs, or springs that become rigid in flight."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.cpu.implicit.rigid_layout import first_stage_row
from warpchain.kernels.cpu.increments import steps_in_increments
from warpchain.kernels.cpu.stage_rows import rows_of_stages
from warpchain.kernels.hooks import Hooks, hook
from warpchain.kernels.methods.controller import step_controller
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.types import Chain, Rows, Worlds

NOTHING_KNOWN, STAGE_KNOWN, ROUNDED = 0, 1, 2
"""Of the start of a step, in ``Worlds.has_first_stage``: the first stage is the last one of the step before; or it
is in place, and the state is rounded.
"""


@dataclass(frozen=True)
class Joints(Hooks):
    """Warp functions of the joints, in the order in which a step calls them."""

    # when the constants of links and joints have changed
    take_constants: Any = hook(K=Rows, chain=Chain)
    # before a step
    settle: Any = hook(K=Rows, chain=Chain, worlds=Worlds, world=int)
    # evaluates the first stage of a step on springs, if it is not known
    first_stage: Any = hook(K=Rows, chain=Chain, worlds=Worlds, world=int)
    # → error ratio as ordered bits
    attempt: Any = hook(K=Rows, chain=Chain, worlds=Worlds, world=int, h=wp.float64, tolerance=wp.float64)
    # → factor of the step after rejection, see methods.controller
    shrinkage: Any = hook(worlds=Worlds, world=int, error=wp.float64)
    # accepts the state that the last attempt found and places its ends → factor of the step, whether the joints may
    # stay as they are
    accept: Any = hook(K=Rows, chain=Chain, worlds=Worlds, world=int, h=wp.float64, error=wp.float64)
    # → skin of the neighbour list [m], least slack with which the list is kept [m]
    margins: Any = hook(worlds=Worlds, world=int)
    # after a step with impulses, or in which the joints may not stay
    react: Any = hook(K=Rows, chain=Chain, worlds=Worlds, world=int)
    # whether all accelerations at the start of the step are finite
    start_is_finite: Any = hook(K=Rows, chain=Chain, worlds=Worlds, world=int)


@functools.cache
def springs(name: str, columns: int, is_mixed: bool, load: Any) -> Joints:
    """A method's steps on springs under a load, see :func:`cpu.increments.steps_in_increments`."""
    tableau = find_method(name).tableau
    real = wp.float32 if is_mixed else wp.float64
    rows = rows_of_stages(tableau, columns, first_stage_row(name, columns), real)
    steps = steps_in_increments(tableau, real, load)
    growth, shrink = step_controller(tableau.order, tableau.error_order, real)
    reuses_last = tableau.first_same_as_last
    after_step = STAGE_KNOWN if reuses_last else NOTHING_KNOWN

    @wp.func
    def take_constants(K: Rows, chain: Chain):
        steps.take_constants(K, rows(K), chain)

    @wp.func
    def nothing(_K: Rows, _chain: Chain, _worlds: Worlds, _world: int):
        return

    @wp.func
    def first_stage(K: Rows, chain: Chain, worlds: Worlds, world: int):
        known = worlds.has_first_stage[world]
        if known != wp.static(ROUNDED):
            S = rows(K)
            steps.begin(K, S, chain)
            if known == wp.static(NOTHING_KNOWN):
                steps.first_stage(K, S, chain)
            elif wp.static(reuses_last):
                steps.take_last_stage(S, chain.link_count)
            worlds.has_first_stage[world] = wp.static(ROUNDED)

    @wp.func
    def attempt(K: Rows, chain: Chain, _worlds: Worlds, _world: int, h: wp.float64, tolerance: wp.float64):
        return steps.attempt(K, rows(K), chain, h, tolerance)

    @wp.func
    def shrinkage(_worlds: Worlds, _world: int, error: wp.float64):
        return wp.float64(shrink(real(error)))

    @wp.func
    def accept(K: Rows, chain: Chain, worlds: Worlds, world: int, h: wp.float64, error: wp.float64):
        steps.commit(K, rows(K), chain, h)
        worlds.has_first_stage[world] = wp.static(after_step)
        factor = growth(real(error), real(worlds.last_error[world]), worlds.control.proportional)
        return wp.float64(factor), bool(True)

    @wp.func
    def margins(worlds: Worlds, _world: int):
        return worlds.control.skin, ZERO

    @wp.func
    def start_is_finite(K: Rows, chain: Chain, _worlds: Worlds, _world: int):
        return steps.start_is_finite(rows(K), chain.link_count)

    return Joints(
        take_constants,
        nothing,
        first_stage,
        attempt,
        shrinkage,
        accept,
        margins,
        nothing,
        start_is_finite,
    )
