"""Joints that become rigid in flight, as long as no impulse comes, as hooks of the CPU loop."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.cpu.contacts.time_to_contact import FLIGHT_SKIN, LEAST_SLACK
from warpchain.kernels.cpu.explicit import place_ends
from warpchain.kernels.cpu.implicit.joint_switch import QUIET_TIME, joint_switch
from warpchain.kernels.cpu.implicit.rigid_flight import flight_method
from warpchain.kernels.cpu.joints import Joints, springs
from warpchain.kernels.events.tallies import book_loss
from warpchain.kernels.methods.controller import classical_controller
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.methods.w_tableaus import ERROR_ORDER
from warpchain.kernels.physics.elementary import ONE, ZERO
from warpchain.kernels.physics.load import weight
from warpchain.kernels.types import Chain, Control, Rows, State


@wp.func
def swap_models(K: Rows, chain: Chain, state: State, world: int, is_rigid: int, lost: wp.float64):
    """Goes on with the other model of the joints, and with the last step that was proposed for it."""
    state.is_rigid[world] = is_rigid
    step = state.step[world]
    state.step[world] = state.other_step[world]
    state.other_step[world] = step
    state.last_error[world] = ONE
    place_ends(K, chain)
    book_loss(state, world, layout.LOSS_JOINT_SWITCH, lost)


@functools.cache
def rigid_in_flight(name: str, columns: int) -> Joints:
    """A method's steps on springs and, from one impulse to the next, on rigid joints."""
    first_row = layout.scratch_rows(find_method(name).tableau.stages)
    attempt_flight, commit_flight = flight_method(columns, first_row)
    close_joints, open_joints = joint_switch(columns, first_row)
    growth, shrink = classical_controller(ERROR_ORDER)
    on_springs = springs(name, weight)

    @wp.func
    def settle(K: Rows, chain: Chain, state: State, world: int):
        # soft joints are not made rigid: their springs still ring when the next impulse comes
        time = state.time[world]
        if state.is_rigid[world] == 0 and time >= state.closing_time[world] and state.softness[world] == ZERO:
            closed, lost = close_joints(K, chain)
            state.closing_time[world] = time + QUIET_TIME
            if closed:
                state.slack[world] = wp.float64(-1.0)  # flights have a greater skin: the list is built anew
                swap_models(K, chain, state, world, 1, lost)

    @wp.func
    def first_stage(K: Rows, chain: Chain, state: State, world: int):
        if state.is_rigid[world] == 0:
            on_springs.first_stage(K, chain, state, world)

    @wp.func
    def attempt(
        K: Rows, chain: Chain, state: State, control: Control, world: int, h: wp.float64, tolerance: wp.float64
    ):
        bits = wp.int64(0)
        if state.is_rigid[world] == 0:
            bits = on_springs.attempt(K, chain, state, control, world, h, tolerance)
        else:
            bits = attempt_flight(K, chain, h, control.flight_tolerance)
        return bits

    @wp.func
    def shrinkage(state: State, world: int, error: wp.float64):
        if state.is_rigid[world] == 0:
            return on_springs.shrinkage(state, world, error)
        return shrink(error)

    @wp.func
    def accept(K: Rows, chain: Chain, state: State, control: Control, world: int, h: wp.float64, error: wp.float64):
        may_stay = bool(True)
        factor = ONE
        if state.is_rigid[world] == 0:
            factor, may_stay = on_springs.accept(K, chain, state, control, world, h, error)
        else:
            may_stay = commit_flight(K, chain, h)
            factor = growth(error, state.last_error[world], control.proportional)
        return factor, may_stay

    @wp.func
    def margins(state: State, control: Control, world: int):
        skin = control.skin
        least_slack = ZERO
        if state.is_rigid[world] != 0:
            skin = FLIGHT_SKIN * control.skin
            least_slack = LEAST_SLACK * skin
        return skin, least_slack

    @wp.func
    def react(K: Rows, chain: Chain, state: State, world: int):
        state.closing_time[world] = state.time[world] + QUIET_TIME
        if state.is_rigid[world] != 0:
            swap_models(K, chain, state, world, 0, open_joints(K, chain))

    return Joints(settle, first_stage, attempt, shrinkage, accept, margins, react)
