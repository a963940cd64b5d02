"""The switch between the two models of a joint: spring and damper, and rigid.

*Closing*: once no impulse has come for ``QUIET_TIME`` and the springs are at rest, the chain is projected on C = 0 and
Ċ = 0 (C: opening of a joint) and continues with rigid joints. The ledger books the energy that the springs held and
that the projection takes. *Opening*: joints are opened by C = F/k, so that the springs start with the forces F of the
rigid joints, and only impulses make them ring. A closing and an opening at the same state cancel in the ledger.

Both displace links in opposite directions on the two sides of a joint, as forces between neighbours would. So momentum,
centre of mass and gravitational energy do not change, and angular momentum changes only by the order of C.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit import rigid
from warpchain.kernels.cpu.implicit.rigid import GREATEST_RINGING, GREATEST_STRETCHING, RIGHT
from warpchain.kernels.cpu.implicit.rigid_layout import BASE, FORCE, segment_rows
from warpchain.kernels.cpu.implicit.solver import end_column, link_at
from warpchain.kernels.layout import X
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO
from warpchain.kernels.physics.geometry import put
from warpchain.kernels.types import Chain, Rows

QUIET_TIME = wp.constant(wp.float64(5e-5))
"""A chain may close its joints after no impulse for this long [s].

That is 30 decay times of oscillations between neighbours on the paper's springs. Long waves round the loop decay more
slowly; the projection takes their remaining energy, which is booked.
"""


@functools.cache
def joint_switch(columns: int, first_row: int):
    """Warp functions (close joints, open joints) for flights in the rows from ``first_row`` on.

    Returns:
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
            cx = S[RIGHT, c] - give * S[FORCE, c]
            cy = S[RIGHT + 1, c] - give * S[FORCE + 1, c]
            put(S, RIGHT, c, wp.vec2d(cx, cy))
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
                K[X + k, i] = S[BASE + k, c]
            c += 1
        return before - after

    return close_joints, open_joints
