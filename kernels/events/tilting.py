"""A sample of a chain whose plane may tilt: sums in the room, not in the plane, and when it fell."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.events.record import write_frame
from warpchain.kernels.layout import AHEAD, FELL_AT, GREATEST_LEAN, LEFT_X, LEFT_Y, ORIGIN, PLANE_VALUES, UP, X, Y
from warpchain.kernels.physics.elementary import ONE, ZERO, from_order_key, order_key
from warpchain.kernels.physics.plane import plane_energy
from warpchain.kernels.types import Chain, Row, Rows, Worlds

FALLEN = wp.constant(wp.float64(0.7071067811865476))
"""Sine of the tilt beyond which a chain has fallen over: 45°."""


@wp.func
def component(P: Row, axis: int, x: wp.float64, y: wp.float64, z: wp.float64):
    """Component along a room axis of a vector with these components along e1, e2, e3."""
    return x * P[axis] + y * P[axis + 1] + z * P[axis + 2]


@wp.func
def sideways(P: Row, x: wp.float64, y: wp.float64, z: wp.float64):
    """Component along the room's Z axis, Z = X × Y, of a vector with these components along e1, e2, e3."""
    z1 = P[AHEAD + 1] * P[UP + 2] - P[AHEAD + 2] * P[UP + 1]
    z2 = P[AHEAD + 2] * P[UP] - P[AHEAD] * P[UP + 2]
    z3 = P[AHEAD] * P[UP + 1] - P[AHEAD + 1] * P[UP]
    return x * z1 + y * z2 + z * z3


@wp.func
def across_speed(P: Row, x: wp.float64, y: wp.float64):
    """Speed w [m/s] across the plane of the point at (x, y)."""
    return P[layout.PLANE_SPEED] + P[layout.PLANE_TURN_X] * y - P[layout.PLANE_TURN_Y] * x


@wp.func
def move_into_room(K: Rows, P: Row, chain: Chain, sample: Row):
    """Makes sums in the plane those in the room, but for height, width and speed of the loop; adds further columns."""
    n = chain.link_count
    square = sample[layout.RMS_SPEED] * sample[layout.RMS_SPEED] * wp.float64(n)
    bottom = order_key(wp.float64(wp.inf))
    i = int(0)
    while i < n:
        w = across_speed(P, K[X, i], K[Y, i])
        square += w * w
        left = order_key(component(P, UP, K[LEFT_X, i], K[LEFT_Y, i], ZERO))
        right = order_key(component(P, UP, K[layout.RIGHT_X, i], K[layout.RIGHT_Y, i], ZERO))
        low = wp.min(left, right)
        if K[layout.RADIUS, i] < chain.circle_radius:
            smaller = chain.circle_radius - K[layout.RADIUS, i]
            low = order_key(from_order_key(low) + smaller * wp.sqrt(ONE - P[UP + 2] * P[UP + 2]))
        bottom = wp.min(bottom, low)
        i += 1
    slope = wp.sqrt(P[UP] * P[UP] + P[UP + 1] * P[UP + 1])
    extent = chain.circle_radius * slope + chain.half_width * wp.abs(P[UP + 2])
    x = sample[layout.CENTER_X]
    y = sample[layout.CENTER_Y]
    u = sample[layout.CENTER_U]
    v = sample[layout.CENTER_V]
    w = across_speed(P, x, y)
    sample[layout.CENTER_X] = P[ORIGIN] + component(P, AHEAD, x, y, ZERO)
    sample[layout.CENTER_Y] = P[ORIGIN + 1] + component(P, UP, x, y, ZERO)
    sample[layout.CENTER_Z] = P[ORIGIN + 2] + sideways(P, x, y, ZERO)
    sample[layout.CENTER_U] = component(P, AHEAD, u, v, w)
    sample[layout.CENTER_V] = component(P, UP, u, v, w)
    sample[layout.CENTER_W] = sideways(P, u, v, w)
    sample[layout.KINETIC] = sample[layout.KINETIC] + plane_energy(P)
    sample[layout.GRAVITATIONAL] = chain.gravity * P[layout.SUM_MASS] * sample[layout.CENTER_Y]
    sample[layout.LOWEST] = P[ORIGIN + 1] + from_order_key(bottom) - extent
    sample[layout.RMS_SPEED] = wp.sqrt(square / wp.float64(n))
    for k in range(PLANE_VALUES):
        sample[layout.PLANE_COLUMN + k] = P[k]


@wp.func
def write_frame_in_room(K: Rows, chain: Chain, worlds: Worlds, world: int, time: wp.float64):
    """Appends joint positions and behind them the plane, if frames are kept."""
    row = worlds.record.frame_count[world]
    write_frame(K, chain, worlds, world, time)
    if worlds.record.frames.shape[1] == 0:
        return
    first = worlds.record.frames.shape[2] - PLANE_VALUES
    for k in range(PLANE_VALUES):
        worlds.record.frames[world, row, first + k] = worlds.plane[world, k]


@wp.func
def watch_fall(worlds: Worlds, world: int, time: wp.float64):
    """Notes when the plane first tilts by 45°, and how far it tilts."""
    lean = wp.abs(worlds.plane[world, UP + 2])
    worlds.watch[world, GREATEST_LEAN] = wp.max(worlds.watch[world, GREATEST_LEAN], lean)
    if worlds.watch[world, FELL_AT] < ZERO and lean > FALLEN:
        worlds.watch[world, FELL_AT] = time
