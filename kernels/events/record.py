"""What is looked at every sample interval: sums over a chain, the watches that end a phase, time series, frames."""

import functools

import warp as wp

from warpchain.kernels.events.softening import watch_collapse, watch_drive, watch_stiffening
from warpchain.kernels.events.steadiness import drag_rate, load_at, watch_steadiness
from warpchain.kernels.events.summary import Summary, summarise
from warpchain.kernels.layout import (
    CENTER_U,
    CENTER_V,
    CENTER_X,
    CENTER_Y,
    COSINE,
    GRAVITATIONAL,
    HEIGHT,
    KINETIC,
    LEFT_X,
    LEFT_Y,
    LOOP_SPEED,
    LOWEST,
    OMEGA,
    REST_SINCE,
    RIGHT_X,
    RIGHT_Y,
    RMS_SPEED,
    SINE,
    SPRING,
    TIME,
    WIDTH,
    U,
    V,
)
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.physics.joint import friction_torque, joint_force
from warpchain.kernels.physics.scaled_loads import drag_shape
from warpchain.kernels.types import Chain, Control, Drive, Record, State

wp.set_module_options({"enable_backward": False})


# Codes shared with warpchain.status.
RUNNING = wp.constant(0)
AT_REST = wp.constant(1)


@wp.func
def watch_rest(state: State, control: Control, world: int, time: wp.float64, summary: Summary):
    """Status: at rest once the centre's speed and the rms speed have both been low for the rest time."""
    speed = wp.sqrt(summary.center_u * summary.center_u + summary.center_v * summary.center_v)
    if wp.max(speed, summary.rms_speed) < control.rest_speed:
        if state.watch[world, REST_SINCE] < ZERO:
            state.watch[world, REST_SINCE] = time
        if time - state.watch[world, REST_SINCE] >= control.rest_time:
            return AT_REST
    else:
        state.watch[world, REST_SINCE] = wp.float64(-1.0)
    return RUNNING


@wp.func
def write_row(rows: wp.array2d(dtype=wp.float64), row: int, time: wp.float64, summary: Summary):
    """Writes a summary as one row of SAMPLE_COLUMNS numbers."""
    rows[row, TIME] = time
    rows[row, CENTER_X] = summary.center_x
    rows[row, CENTER_Y] = summary.center_y
    rows[row, CENTER_U] = summary.center_u
    rows[row, CENTER_V] = summary.center_v
    rows[row, KINETIC] = summary.kinetic
    rows[row, GRAVITATIONAL] = summary.gravitational
    rows[row, SPRING] = summary.spring
    rows[row, LOWEST] = summary.lowest
    rows[row, RMS_SPEED] = summary.rms_speed
    rows[row, HEIGHT] = summary.height
    rows[row, WIDTH] = summary.width
    rows[row, LOOP_SPEED] = summary.loop_speed


@wp.func
def write_sample(state: State, record: Record, world: int, time: wp.float64, summary: Summary):
    """Notes the first and the last look at a chain, and appends to the time series if it is kept."""
    if state.last_sample[world, TIME] < ZERO:
        write_row(state.first_sample, world, time, summary)
    write_row(state.last_sample, world, time, summary)
    if record.samples.shape[1] > 0:
        row = record.sample_count[world]
        write_row(record.samples[world], row, time, summary)
        record.sample_count[world] = row + 1


@wp.func
def write_load(loads: wp.array2d(dtype=wp.float64), row: int, K: wp.array2d(dtype=wp.float64), chain: Chain, i: int):
    """Writes force F = k C + b Ċ [N] and friction moment [N m] of joint i, both as they act on the link before it."""
    n = chain.link_count
    j = i + 1
    if j == n:
        j = int(0)
    a = chain.half_length
    rate_x = (K[U, j] + a * K[OMEGA, j] * K[SINE, j]) - (K[U, i] - a * K[OMEGA, i] * K[SINE, i])
    rate_y = (K[V, j] - a * K[OMEGA, j] * K[COSINE, j]) - (K[V, i] + a * K[OMEGA, i] * K[COSINE, i])
    loads[row, i] = joint_force(chain, K[LEFT_X, i + 1] - K[RIGHT_X, i], rate_x)
    loads[row, n + i] = joint_force(chain, K[LEFT_Y, i + 1] - K[RIGHT_Y, i], rate_y)
    loads[row, 2 * n + i] = friction_torque(chain, K[OMEGA, j] - K[OMEGA, i])


@wp.func
def write_frame(record: Record, K: wp.array2d(dtype=wp.float64), chain: Chain, world: int, time: wp.float64):
    """Appends all joint positions, if frames are kept, and the loads of the joints, if they are."""
    if record.frames.shape[1] == 0:
        return
    n = chain.link_count
    row = record.frame_count[world]
    i = int(0)
    while i < n:
        record.frames[world, row, i] = K[RIGHT_X, i]
        record.frames[world, row, n + i] = K[RIGHT_Y, i]
        if record.frame_loads.shape[1] > 0:
            write_load(record.frame_loads[world], row, K, chain, i)
        i += 1
    record.frame_times[world, row] = time
    record.frame_count[world] = row + 1


@wp.func
def record_is_full(record: Record, world: int):
    """True when the host must drain the record before this world goes on."""
    samples_full = record.samples.shape[1] > 0 and record.sample_count[world] >= record.samples.shape[1]
    frames_full = record.frames.shape[1] > 0 and record.frame_count[world] >= record.frames.shape[1]
    return samples_full or frames_full


@functools.cache
def sampling(watch: str, softens: bool = False):
    """Warp function ``look``, one sample of a placed chain: time series, frame and watch; returns the status.

    Args:
        watch: ``"rest"``, ``"steady"`` or ``"none"``.
        softens: Whether the look may change the softness of the joints, see :mod:`events.softening`.

    A look at a chain on its sprocket (``"steady"``) may also change its loads and the velocities of its links.
    """
    watches_rest = watch == "rest"
    watches_steadiness = watch == "steady"

    @wp.func
    def look(
        K: wp.array2d(dtype=wp.float64),
        chain: Chain,
        drive: Drive,
        state: State,
        record: Record,
        control: Control,
        world: int,
        time: wp.float64,
    ):
        mark = state.next_sample[world]
        last_time = state.last_sample[world, TIME]
        is_first = last_time < ZERO
        summary = summarise(K, chain)
        write_sample(state, record, world, time, summary)
        if mark % control.frame_every == wp.int64(0):
            write_frame(record, K, chain, world, time)
        passed = wp.int64(wp.floor(time / control.sample_interval))
        state.next_sample[world] = wp.max(mark, passed) + wp.int64(1)
        if wp.static(softens and watches_rest):
            watch_stiffening(state, drive, control, world, time)
            watch_collapse(K, chain, state, control, world, time, is_first)
        if wp.static(watches_rest):
            return watch_rest(state, control, world, time, summary)
        if wp.static(watches_steadiness):
            if state.load_factor[world] > wp.float64(1.0):
                rate = drag_rate(chain, state, drive, world, summary.height)
                drag_shape(K, chain, wp.exp(-rate * (time - last_time)))
            watch_steadiness(chain, state, drive, world, time, summary)
            state.load_factor[world] = load_at(state, drive, world, time)
        if wp.static(softens and watches_steadiness):
            watch_drive(state, drive, control, world, time)
        return RUNNING

    return look
