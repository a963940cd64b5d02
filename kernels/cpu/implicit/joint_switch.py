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

from warpchain.kernels.cpu.implicit.rigid import GREATEST_RINGING, GREATEST_STRETCHING, rigid_joints
from warpchain.kernels.cpu.implicit.rigid_flight import flight_memory
from warpchain.kernels.cpu.implicit.rigid_layout import BASE, FORCE, force_layout
from warpchain.kernels.cpu.implicit.solver import link_at, place_column, segment_places
from warpchain.kernels.layout import X
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO
from warpchain.kernels.types import Chain, Rows

wp.set_module_options({"enable_backward": False})

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
    rigid = rigid_joints(columns)
    load, store, solve_joints, displace = rigid.load, rigid.store, rigid.solve_joints, rigid.displace
    openings, stretching = rigid.openings, rigid.stretching
    close, begin = rigid.close, rigid.begin
    kinetic_energy, are_stiff = rigid.kinetic_energy, rigid.are_stiff
    flight_rows, force_rows, _ = flight_memory(columns, first_row)
    right = force_layout(columns).right

    @wp.func
    def close_joints(K: Rows, chain: Chain):
        S = flight_rows(K)
        R = force_rows(K)
        places, full, _ = segment_places(chain.link_count)
        end = place_column(places + 1)
        load(S, K, chain)
        openings(S, chain, places, full)
        held = stretching(S, chain, places)
        kinetic = kinetic_energy(S, end)
        closed = bool(False)
        ringing = ZERO
        if held <= GREATEST_STRETCHING * kinetic:
            closed = close(S, R, chain, places, full)
            ringing = kinetic - kinetic_energy(S, end)
            closed = closed and wp.abs(ringing) <= GREATEST_RINGING * kinetic
        if closed:
            begin(S, R, chain, places, full)
            closed = are_stiff(S, chain, end)
        if closed:
            store(S, K, chain)
        return closed, held + ringing

    @wp.func
    def open_joints(K: Rows, chain: Chain):
        S = flight_rows(K)
        R = force_rows(K)
        n = chain.link_count
        places, full, _ = segment_places(n)
        end = place_column(places + 1)
        # where all links lie on one line S is singular, and neither F nor the openings are bounded: there the joints
        # stay closed, and the springs find their forces by themselves
        if not are_stiff(S, chain, end):
            return ZERO
        openings(S, chain, places, full)
        before = stretching(S, chain, places)
        give = ONE / chain.joint_stiffness
        c = int(8)
        while c < end:
            repeats = c < 16 and c >= 8 + full
            cx = S[wp.static(right), c] - give * S[FORCE, c]
            cy = S[wp.static(right + 1), c] - give * S[wp.static(FORCE + 1), c]
            S[wp.static(right), c] = wp.where(repeats, ZERO, cx)
            S[wp.static(right + 1), c] = wp.where(repeats, ZERO, cy)
            c += 1
        solve_joints(S, R, places, full)
        displace(S, chain, places)
        openings(S, chain, places, full)
        after = stretching(S, chain, places)
        if after > TWO * GREATEST_STRETCHING * kinetic_energy(S, end):
            return ZERO
        p = int(0)
        while p < places:
            s = int(0)
            while s < 8:
                i = link_at(p, s, places, full, n)
                c = 8 * p + 8 + s
                for k in range(3):
                    K[wp.static(X + k), i] = S[wp.static(BASE + k), c]
                s += 1
            p += 1
        return before - after

    return close_joints, open_joints
