"""A sample of a chain whose plane may tilt: sums in the room, not in the plane, and when it fell."""

import warp as wp

from warpchain.kernels.events.record import write_frame, write_sample
from warpchain.kernels.events.summary import Summary, summarise
from warpchain.kernels.layout import (
    AHEAD,
    CENTER_W,
    CENTER_Z,
    FELL_AT,
    GREATEST_LEAN,
    LEFT_X,
    LEFT_Y,
    ORIGIN,
    PLANE_COLUMN,
    PLANE_SPEED,
    PLANE_TURN_X,
    PLANE_TURN_Y,
    PLANE_VALUES,
    RIGHT_X,
    RIGHT_Y,
    SUM_MASS,
    TIME,
    UP,
    X,
    Y,
)
from warpchain.kernels.physics.elementary import ZERO, from_order_key, order_key
from warpchain.kernels.physics.plane import plane_energy
from warpchain.kernels.types import Chain, Record, Row, Rows, State

wp.set_module_options({"enable_backward": False})

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
    return P[PLANE_SPEED] + P[PLANE_TURN_X] * y - P[PLANE_TURN_Y] * x


@wp.func
def in_room(K: Rows, P: Row, chain: Chain, flat: Summary) -> Summary:
    """Sums in the room, from those in the plane; height, width and speed of the loop stay those in the plane."""
    n = chain.link_count
    square = flat.rms_speed * flat.rms_speed * wp.float64(n)
    bottom = order_key(wp.float64(wp.inf))
    i = int(0)
    while i < n:
        w = across_speed(P, K[X, i], K[Y, i])
        square += w * w
        left = order_key(component(P, UP, K[LEFT_X, i], K[LEFT_Y, i], ZERO))
        right = order_key(component(P, UP, K[RIGHT_X, i], K[RIGHT_Y, i], ZERO))
        bottom = wp.min(bottom, wp.min(left, right))
        i += 1
    slope = wp.sqrt(P[UP] * P[UP] + P[UP + 1] * P[UP + 1])
    extent = chain.circle_radius * slope + chain.half_width * wp.abs(P[UP + 2])
    w = across_speed(P, flat.center_x, flat.center_y)
    summary = flat
    summary.center_x = P[ORIGIN] + component(P, AHEAD, flat.center_x, flat.center_y, ZERO)
    summary.center_y = P[ORIGIN + 1] + component(P, UP, flat.center_x, flat.center_y, ZERO)
    summary.center_u = component(P, AHEAD, flat.center_u, flat.center_v, w)
    summary.center_v = component(P, UP, flat.center_u, flat.center_v, w)
    summary.kinetic = flat.kinetic + plane_energy(P)
    summary.gravitational = chain.gravity * P[SUM_MASS] * summary.center_y
    summary.lowest = P[ORIGIN + 1] + from_order_key(bottom) - extent
    summary.rms_speed = wp.sqrt(square / wp.float64(n))
    return summary


@wp.func
def write_plane_columns(row: Row, P: Row, flat: Summary):
    """Writes the further columns of a sample."""
    k = int(0)
    while k < PLANE_VALUES:
        row[PLANE_COLUMN + k] = P[k]
        k += 1
    w = across_speed(P, flat.center_x, flat.center_y)
    row[CENTER_Z] = P[ORIGIN + 2] + sideways(P, flat.center_x, flat.center_y, ZERO)
    row[CENTER_W] = sideways(P, flat.center_u, flat.center_v, w)


@wp.func
def observe_in_room(K: Rows, chain: Chain, state: State, record: Record, world: int, time: wp.float64) -> Summary:
    """Writes a sample of a chain whose ends are placed: its sums in the room, and the plane."""
    P = state.plane[world]
    flat = summarise(K, chain)
    seen = in_room(K, P, chain, flat)
    if state.last_sample[world, TIME] < ZERO:
        write_plane_columns(state.first_sample[world], P, flat)
    write_plane_columns(state.last_sample[world], P, flat)
    if record.samples.shape[1] > 0:
        samples = record.samples[world]
        write_plane_columns(samples[record.sample_count[world]], P, flat)
    write_sample(state, record, world, time, seen)
    return seen


@wp.func
def write_frame_in_room(K: Rows, chain: Chain, state: State, record: Record, world: int, time: wp.float64):
    """Appends joint positions and behind them the plane, if frames are kept."""
    row = record.frame_count[world]
    write_frame(K, chain, state, record, world, time)
    if record.frames.shape[1] == 0:
        return
    first = record.frames.shape[2] - PLANE_VALUES
    k = int(0)
    while k < PLANE_VALUES:
        record.frames[world, row, first + k] = state.plane[world, k]
        k += 1


@wp.func
def watch_fall(state: State, world: int, time: wp.float64):
    """Notes when the plane first tilts by 45°, and how far it tilts."""
    lean = wp.abs(state.plane[world, UP + 2])
    state.watch[world, GREATEST_LEAN] = wp.max(state.watch[world, GREATEST_LEAN], lean)
    if state.watch[world, FELL_AT] < ZERO and lean > FALLEN:
        state.watch[world, FELL_AT] = time


@wp.func
def no_fall(_state: State, _world: int, _time: wp.float64):
    """The watch of a plane that stays upright."""
    return
