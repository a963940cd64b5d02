"""A chain whose plane may tilt, on a CPU: sums over its links, what its plane changes in a first stage, its floor."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.tilting_floor import (
    copy_inverse,
    link_touches,
    meet_tilting_floor,
    middle_height,
    push_plane_by,
    steepness,
)
from warpchain.kernels.layout import (
    COSINE,
    INERTIA,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LEFT_X,
    LEFT_Y,
    LOST_FIXED,
    MASS,
    OMEGA,
    RIGHT_X,
    RIGHT_Y,
    SINE,
    STAGE_ROWS,
    STAGES,
    SUM_COUNT,
    U,
    V,
    X,
    Y,
)
from warpchain.kernels.physics.elementary import TWO, ZERO, from_order_key, order_bits, order_key
from warpchain.kernels.physics.plane import invert_plane_mass, on_plane, plane_load, plane_terms
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})

LANES = 8
"""Links that are summed side by side. Sum k lies in row ``SUMS + k % 5`` from column ``8 (k // 5)`` on."""
SUMS = STAGES + STAGE_ROWS
"""The rows of the second stage, which are free between attempts."""


@wp.func
def clear_padding(K: wp.array2d(dtype=wp.float64), n: int):
    """Makes the columns behind the last link count as links without mass, up to a whole number of lanes."""
    i = n
    while i < (n + wp.static(LANES - 1)) // wp.static(LANES) * wp.static(LANES):
        row = int(0)
        while row < layout.INVERSE_INERTIA + 1:
            K[row, i] = ZERO
            row += 1
        i += 1


@wp.func
def write_plane_sums(K: wp.array2d(dtype=wp.float64), P: wp.array(dtype=wp.float64), chain: Chain):
    """Writes the sums over the placed links, and the inverse of the plane's mass matrix."""
    lane = int(0)
    while lane < wp.static(LANES):
        for k in range(wp.static(SUM_COUNT)):
            K[wp.static(SUMS + k % STAGE_ROWS), wp.static(LANES * (k // STAGE_ROWS)) + lane] = ZERO
        lane += 1
    first = int(0)
    while first < chain.link_count:
        lane = int(0)
        while lane < wp.static(LANES):
            i = first + lane
            terms = plane_terms(
                chain,
                K[MASS, i],
                K[INERTIA, i],
                K[X, i],
                K[Y, i],
                K[U, i],
                K[V, i],
                K[OMEGA, i],
                K[COSINE, i],
                K[SINE, i],
            )
            for k in range(wp.static(SUM_COUNT)):
                K[wp.static(SUMS + k % STAGE_ROWS), wp.static(LANES * (k // STAGE_ROWS)) + lane] = (
                    K[wp.static(SUMS + k % STAGE_ROWS), wp.static(LANES * (k // STAGE_ROWS)) + lane] + terms[k]
                )
            lane += 1
        first += wp.static(LANES)
    for k in range(wp.static(SUM_COUNT)):
        total = ZERO
        for j in range(wp.static(LANES)):
            total += K[wp.static(SUMS + k % STAGE_ROWS), wp.static(LANES * (k // STAGE_ROWS) + j)]
        P[wp.static(layout.PLANE_SUMS + k)] = total
    invert_plane_mass(P)


@wp.func
def shift_first_stage(K: wp.array2d(dtype=wp.float64), before: Chain, now: Chain):
    """Changes the stored first stage from one plane to another; links are the same."""
    a = now.half_length
    i = int(0)
    while i < now.link_count:
        arm_x = a * K[COSINE, i]
        arm_y = a * K[SINE, i]
        ax, ay, turn = plane_load(now, K[X, i], K[Y, i], arm_x, arm_y)
        old_ax, old_ay, old_turn = plane_load(before, K[X, i], K[Y, i], arm_x, arm_y)
        K[STAGES, i] = K[STAGES, i] + (ax - old_ax)
        K[STAGES + 1, i] = K[STAGES + 1, i] + (ay - old_ay)
        K[STAGES + 2, i] = K[STAGES + 2, i] + (turn - old_turn)
        i += 1


@wp.func
def tilting_gap(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Height [m] of the lowest rim of a roller above the floor; negative when it is below."""
    slope = steepness(chain)
    lowest = order_key(middle_height(chain, slope, K[LEFT_X, 0], K[LEFT_Y, 0]))
    i = int(0)
    while i < chain.link_count:
        left = order_key(middle_height(chain, slope, K[LEFT_X, i], K[LEFT_Y, i]))
        right = order_key(middle_height(chain, slope, K[RIGHT_X, i], K[RIGHT_Y, i]))
        lowest = wp.min(lowest, wp.min(left, right))
        i += 1
    return from_order_key(lowest) - chain.half_width * wp.abs(chain.up_z)


@wp.func
def greatest_tilting_speed(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """A bound on the speed [m/s] of every point of a roller, across the plane too."""
    greatest = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        turn = chain.half_length * K[OMEGA, i]
        across = chain.plane_speed + chain.turn_x * K[Y, i] - chain.turn_y * K[X, i]
        square = TWO * (K[U, i] * K[U, i] + K[V, i] * K[V, i] + turn * turn) + across * across
        greatest = wp.max(greatest, order_bits(square))
        i += 1
    reach = chain.half_length + chain.circle_radius + chain.half_width
    return wp.sqrt(wp.cast(greatest, wp.float64)) + reach * (wp.abs(chain.turn_x) + wp.abs(chain.turn_y))


@wp.func
def resolve_tilting_floor(K: wp.array2d(dtype=wp.float64), P: wp.array(dtype=wp.float64), own: Chain):
    """Applies the impulses between rollers and floor to links and plane; returns their number.

    The sums must be those of the present places.
    """
    chain = on_plane(own, P, 0)
    slope = steepness(chain)
    touching = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        touching += link_touches(
            chain,
            slope,
            K[LEFT_X, i],
            K[LEFT_Y, i],
            K[RIGHT_X, i],
            K[RIGHT_Y, i],
            K[X, i],
            K[Y, i],
            K[U, i],
            K[V, i],
            K[OMEGA, i],
        )
        i += 1
    if touching == wp.int64(0):
        return touching
    B = copy_inverse(P, wp.float64(touching))
    impulses = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        link = meet_tilting_floor(
            chain,
            slope,
            B,
            K[LEFT_X, i],
            K[LEFT_Y, i],
            K[RIGHT_X, i],
            K[RIGHT_Y, i],
            K[X, i],
            K[Y, i],
            K[INVERSE_MASS, i],
            K[INVERSE_INERTIA, i],
            K[U, i],
            K[V, i],
            K[OMEGA, i],
        )
        K[U, i] = link.u
        K[V, i] = link.v
        K[OMEGA, i] = link.omega
        K[LOST_FIXED, i] = K[LOST_FIXED, i] + link.lost
        K[wp.static(SUMS), i] = link.push
        K[wp.static(SUMS + 1), i] = link.moment_x
        K[wp.static(SUMS + 2), i] = link.moment_y
        K[wp.static(SUMS + 3), i] = (
            (link.plane_speed - chain.plane_speed) * link.push
            + (link.turn_x - chain.turn_x) * link.moment_x
            + (link.turn_y - chain.turn_y) * link.moment_y
        )
        impulses += link.hits
        i += 1
    push = ZERO
    moment_x = ZERO
    moment_y = ZERO
    work = ZERO
    i = int(0)
    while i < chain.link_count:
        push += K[wp.static(SUMS), i]
        moment_x += K[wp.static(SUMS + 1), i]
        moment_y += K[wp.static(SUMS + 2), i]
        work += K[wp.static(SUMS + 3), i]
        i += 1
    K[LOST_FIXED, 0] = K[LOST_FIXED, 0] + push_plane_by(P, push, moment_x, moment_y, work)
    return impulses
