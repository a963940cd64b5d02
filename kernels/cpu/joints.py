"""What the joints of a chain do in a step of the CPU loop: springs, or springs that become rigid in flight."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.cpu.explicit import explicit_method
from warpchain.kernels.methods.controller import step_controller
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.types import Chain, Control, Rows, State


@dataclass(frozen=True)
class Joints:
    """Warp functions of the joints, in the order in which a step calls them."""

    settle: Any  # ``(K, chain, state, world)`` before a step
    first_stage: Any  # ``(K, chain, state, world)`` evaluates the first stage of a step on springs, if it is not known
    attempt: Any  # ``(K, chain, state, control, world, h, tolerance)`` → error ratio as ordered bits
    shrinkage: Any  # ``(state, world, error)`` → factor of the step after rejection, see :mod:`methods.controller`
    # ``(K, chain, state, control, world, h, error)`` accepts the state that the last attempt found → factor of the
    # step, whether the joints may stay as they are
    accept: Any
    margins: Any  # ``(state, control, world)`` → skin of the neighbour list [m], least slack with which it is kept [m]
    react: Any  # ``(K, chain, state, world)`` after a step with impulses, or in which the joints may not stay


@functools.cache
def springs(name: str, acceleration: Any) -> Joints:
    """A method's steps on springs, under a load, see :attr:`features.Features.acceleration`."""
    tableau = find_method(name).tableau
    evaluate, attempt_step, commit = explicit_method(tableau, acceleration)
    growth, shrink = step_controller(tableau.order, tableau.error_order)
    reuses_last = tableau.first_same_as_last

    @wp.func
    def nothing(_K: Rows, _chain: Chain, _state: State, _world: int):
        return

    @wp.func
    def first_stage(K: Rows, chain: Chain, state: State, world: int):
        if state.has_first_stage[world] == 0:
            evaluate(K, chain)
            state.has_first_stage[world] = 1

    @wp.func
    def attempt(
        K: Rows, chain: Chain, _state: State, _control: Control, _world: int, h: wp.float64, tolerance: wp.float64
    ):
        return attempt_step(K, chain, h, tolerance)

    @wp.func
    def shrinkage(_state: State, _world: int, error: wp.float64):
        return shrink(error)

    @wp.func
    def accept(K: Rows, chain: Chain, state: State, control: Control, world: int, h: wp.float64, error: wp.float64):
        commit(K, chain, h)
        state.has_first_stage[world] = wp.static(int(reuses_last))
        return growth(error, state.last_error[world], control.proportional), bool(True)

    @wp.func
    def margins(_state: State, control: Control, _world: int):
        return control.skin, ZERO

    return Joints(nothing, first_stage, attempt, shrinkage, accept, margins, nothing)
