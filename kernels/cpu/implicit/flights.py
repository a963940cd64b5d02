"""Joints that become rigid in flight, as long as no impulse comes, as hooks of the CPU loop.

*Closing*: once no impulse has come for ``QUIET_TIME`` and the springs are at rest, the chain is projected on C = 0 and
Ċ = 0 (C: opening of a joint) and continues with rigid joints. The ledger books the energy that the springs held and
that the projection takes. *Opening*: joints are opened by C = F/k, so that the springs start with the forces F of the
rigid joints, and only impulses make them ring. A closing and an opening at the same state cancel in the ledger.

Both displace links in opposite directions on the two sides of a joint, as forces between neighbours would. So momentum,
centre of mass and gravitational energy do not change, and angular momentum changes only by the order of C.
"""

import functools
from dataclasses import replace

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.cpu.contacts.time_to_contact import FLIGHT_SKIN, LEAST_SLACK
from warpchain.kernels.cpu.implicit import rigid
from warpchain.kernels.cpu.implicit.rigid import GREATEST_RINGING, GREATEST_STRETCHING, RIGHT
from warpchain.kernels.cpu.implicit.rigid_flight import flight_method
from warpchain.kernels.cpu.implicit.rigid_layout import BASE, BASE_RATE, FORCE, segment_rows
from warpchain.kernels.cpu.implicit.solver import end_column, link_at
from warpchain.kernels.cpu.joints import Joints
from warpchain.kernels.cpu.placing import place_ends
from warpchain.kernels.events.tallies import book_loss
from warpchain.kernels.methods.controller import classical_controller
from warpchain.kernels.methods.w_tableaus import ERROR_ORDER
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO
from warpchain.kernels.physics.geometry import put, two
from warpchain.kernels.types import Chain, Rows, Worlds

QUIET_TIME = wp.constant(wp.float64(5e-5))
"""A chain may close its joints after no impulse for this long [s].

That is 30 decay times of oscillations between neighbours on the paper's springs. Long waves round the loop decay more
slowly; the projection takes their remaining energy, which is booked.
"""


@functools.cache
def joint_switch(columns: int, first_row: int):
    """Warp functions (close joints, open joints) for flights in the rows from ``first_row`` on.

    ``close_joints(K, chain)`` → whether they are closed now, and the energy lost [J]; if not, nothing has changed.
    ``open_joints(K, chain)``, right after a step of the flight and its impulses → the energy lost [J], negative.
    """
    rows = segment_rows(columns, first_row)
    close = rigid.closing(columns, first_row)

    @wp.func
    def close_joints(K: Rows, chain: Chain):
        S = rows(K)
        rigid.load(S, K, chain)
        rigid.openings(S, chain)
        held = rigid.stretching(S, chain)
        kinetic = rigid.kinetic_energy(S, chain)
        closed = bool(False)
        ringing = ZERO
        if held <= GREATEST_STRETCHING * kinetic:
            closed = close(K, chain)
            ringing = kinetic - rigid.kinetic_energy(S, chain)
            closed = closed and wp.abs(ringing) <= GREATEST_RINGING * kinetic
        if closed:
            rigid.begin(S, chain)
            closed = rigid.are_stiff(S, chain)
        if closed:
            rigid.store(S, K, chain)
        return closed, held + ringing

    @wp.func
    def open_joints(K: Rows, chain: Chain):
        S = rows(K)
        # where all links lie on one line S is singular, and neither F nor the openings are bounded: there the joints
        # stay closed, and the springs find their forces by themselves
        if not rigid.are_stiff(S, chain):
            return ZERO
        rigid.openings(S, chain)
        before = rigid.stretching(S, chain)
        give = ONE / chain.joint_stiffness
        c = int(8)
        while c < end_column(chain):
            put(S, RIGHT, c, two(S, RIGHT, c) - give * two(S, FORCE, c))
            c += 1
        rigid.solve_joints(S, chain)
        rigid.push(S, BASE, chain)
        rigid.openings(S, chain)
        after = rigid.stretching(S, chain)
        if after > TWO * GREATEST_STRETCHING * rigid.kinetic_energy(S, chain):
            return ZERO
        c = int(8)
        while c < end_column(chain):
            i, _is_copy = link_at(c, chain.link_count)
            for k in range(3):
                K[layout.X + k, i] = S[BASE + k, c]
            c += 1
        return before - after

    return close_joints, open_joints


@wp.func
def swap_models(K: Rows, chain: Chain, worlds: Worlds, world: int, is_rigid: int, lost: wp.float64):
    """Goes on with the other model of the joints, and with the last step that was proposed for it."""
    worlds.is_rigid[world] = is_rigid
    step = worlds.step[world]
    worlds.step[world] = worlds.other_step[world]
    worlds.other_step[world] = step
    worlds.slack[world] = wp.float64(-1.0)  # flights have a greater skin: the list is built anew
    worlds.last_error[world] = ONE
    place_ends(K, chain)
    book_loss(worlds, world, layout.LOSS_JOINT_SWITCH, lost)


@functools.cache
def rigid_in_flight(on_springs: Joints, columns: int) -> Joints:
    """Steps on springs and, from one impulse to the next, on rigid joints."""
    first_row = layout.SCRATCH_ROWS
    rows = segment_rows(columns, first_row)
    attempt_flight, commit_flight = flight_method(columns, first_row)
    close_joints, open_joints = joint_switch(columns, first_row)
    growth, shrink = classical_controller(ERROR_ORDER)

    @wp.func
    def settle(K: Rows, chain: Chain, worlds: Worlds, world: int):
        # soft joints are not made rigid: their springs still ring when the next impulse comes
        time = worlds.time[world]
        if worlds.is_rigid[world] == 0 and time >= worlds.closing_time[world] and worlds.softness[world] == ZERO:
            closed, lost = close_joints(K, chain)
            worlds.closing_time[world] = time + QUIET_TIME
            if closed:
                swap_models(K, chain, worlds, world, 1, lost)

    @wp.func
    def first_stage(K: Rows, chain: Chain, worlds: Worlds, world: int):
        if worlds.is_rigid[world] == 0:
            on_springs.first_stage(K, chain, worlds, world)

    @wp.func
    def attempt(K: Rows, chain: Chain, worlds: Worlds, world: int, h: wp.float64, tolerance: wp.float64):
        if worlds.is_rigid[world] == 0:
            return on_springs.attempt(K, chain, worlds, world, h, tolerance)
        return attempt_flight(K, chain, h, worlds.control.flight_tolerance)

    @wp.func
    def shrinkage(worlds: Worlds, world: int, error: wp.float64):
        if worlds.is_rigid[world] == 0:
            return on_springs.shrinkage(worlds, world, error)
        return shrink(error)

    @wp.func
    def accept(K: Rows, chain: Chain, worlds: Worlds, world: int, h: wp.float64, error: wp.float64):
        if worlds.is_rigid[world] == 0:
            return on_springs.accept(K, chain, worlds, world, h, error)
        may_stay = commit_flight(K, chain, h)
        place_ends(K, chain)
        return growth(error, worlds.last_error[world], worlds.control.proportional), may_stay

    @wp.func
    def margins(worlds: Worlds, world: int):
        if worlds.is_rigid[world] == 0:
            return on_springs.margins(worlds, world)
        skin = FLIGHT_SKIN * worlds.control.skin
        return skin, LEAST_SLACK * skin

    @wp.func
    def react(K: Rows, chain: Chain, worlds: Worlds, world: int):
        worlds.closing_time[world] = worlds.time[world] + QUIET_TIME
        if worlds.is_rigid[world] != 0:
            swap_models(K, chain, worlds, world, 0, open_joints(K, chain))

    @wp.func
    def start_is_finite(K: Rows, chain: Chain, worlds: Worlds, world: int):
        if worlds.is_rigid[world] == 0:
            return on_springs.start_is_finite(K, chain, worlds, world)
        S = rows(K)
        finite = bool(True)
        for c in range(8, end_column(chain)):
            for k in range(3):
                finite = finite and wp.isfinite(S[BASE_RATE + k, c])
        return finite

    return replace(
        on_springs,
        settle=settle,
        first_stage=first_stage,
        attempt=attempt,
        shrinkage=shrinkage,
        accept=accept,
        margins=margins,
        react=react,
        start_is_finite=start_is_finite,
    )
