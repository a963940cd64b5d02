"""What is looked at every sample interval: sums over a chain, the watches that end a phase, time series, frames."""

import functools

import warp as wp

from .elementary import HALF, ZERO, from_order_key, order_key
from .joint import friction_torque, joint_force
from .layout import (
    CENTER_U,
    CENTER_V,
    CENTER_X,
    CENTER_Y,
    COSINE,
    GRAVITATIONAL,
    GREATEST_HEIGHT,
    GREATEST_WIDTH,
    HEIGHT,
    INERTIA,
    KINETIC,
    LEAST_HEIGHT,
    LEAST_WIDTH,
    LEFT_X,
    LEFT_Y,
    LOOP_SPEED,
    LOWEST,
    MASS,
    OMEGA,
    REST_SINCE,
    RIGHT_X,
    RIGHT_Y,
    RMS_SPEED,
    SINE,
    SPRING,
    STEADY_SINCE,
    SUM_HEIGHT,
    SUM_SPEED,
    SUM_WIDTH,
    TIME,
    WIDTH,
    WINDOW_COUNT,
    WINDOW_START,
    U,
    V,
    X,
    Y,
)
from .softening import FINISHED, watch_collapse, watch_spin_up, watch_stiffening
from .types import Chain, Control, Program, Record, State

wp.set_module_options({"enable_backward": False})


ONE_PERCENT = wp.constant(wp.float64(0.01))
SLOWEST_STEADY = wp.constant(wp.float64(0.02))

# Codes shared with warpchain.status.
RUNNING = wp.constant(0)
AT_REST = wp.constant(1)


@wp.struct
class Summary:
    """Sums over one chain at one moment; see ``Record.samples`` in :mod:`types`."""

    center_x: wp.float64
    center_y: wp.float64
    center_u: wp.float64
    center_v: wp.float64
    kinetic: wp.float64
    gravitational: wp.float64
    spring: wp.float64
    lowest: wp.float64
    rms_speed: wp.float64
    height: wp.float64
    width: wp.float64
    loop_speed: wp.float64


@wp.func
def summarise(K: wp.array2d(dtype=wp.float64), chain: Chain) -> Summary:
    """Sums over the placed links. Loop speed: mean of v·u over links, positive from link i towards link i + 1."""
    n = chain.link_count
    mass = ZERO
    mx = ZERO
    my = ZERO
    mu = ZERO
    mv = ZERO
    kinetic = ZERO
    spring = ZERO
    along = ZERO
    square = ZERO
    left = order_key(K[RIGHT_X, 0])
    right = left
    bottom = order_key(K[RIGHT_Y, 0])
    top = bottom
    i = int(0)
    while i < n:
        m = K[MASS, i]
        speed = K[U, i] * K[U, i] + K[V, i] * K[V, i]
        mass += m
        mx += m * K[X, i]
        my += m * K[Y, i]
        mu += m * K[U, i]
        mv += m * K[V, i]
        kinetic += HALF * (m * speed + K[INERTIA, i] * K[OMEGA, i] * K[OMEGA, i])
        square += speed
        along += K[U, i] * K[COSINE, i] + K[V, i] * K[SINE, i]
        cx = K[LEFT_X, i + 1] - K[RIGHT_X, i]
        cy = K[LEFT_Y, i + 1] - K[RIGHT_Y, i]
        spring += HALF * chain.joint_stiffness * (cx * cx + cy * cy)
        left = wp.min(left, order_key(K[RIGHT_X, i]))
        right = wp.max(right, order_key(K[RIGHT_X, i]))
        bottom = wp.min(bottom, wp.min(order_key(K[LEFT_Y, i]), order_key(K[RIGHT_Y, i])))
        top = wp.max(top, order_key(K[RIGHT_Y, i]))
        i += 1
    summary = Summary()
    summary.center_x = mx / mass
    summary.center_y = my / mass
    summary.center_u = mu / mass
    summary.center_v = mv / mass
    summary.kinetic = kinetic
    summary.gravitational = chain.gravity * my
    summary.spring = spring
    summary.lowest = from_order_key(bottom) - chain.circle_radius
    summary.rms_speed = wp.sqrt(square / wp.float64(n))
    summary.height = from_order_key(top) - from_order_key(bottom)
    summary.width = from_order_key(right) - from_order_key(left)
    summary.loop_speed = along / wp.float64(n)
    return summary


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
def watch_steadiness(state: State, program: Program, world: int, time: wp.float64, summary: Summary):
    """Sets the moment of release once the loop runs steadily on its sprocket.

    Steady means: for ``steady_time`` the means over windows of one loop period have stayed together, height and width
    of the loop to within ``steady_tolerance`` of themselves, and the speed along the loop to within 1 % (or 0.02 m/s)
    of the sprocket's. Release follows after the drawn fraction of a loop period. Nothing is done once that moment is
    set.
    """
    if state.stop_status[world] == FINISHED or time < program.hold_start[world]:
        return
    if state.watch[world, WINDOW_START] < ZERO:
        state.watch[world, WINDOW_START] = time
    state.watch[world, WINDOW_COUNT] = state.watch[world, WINDOW_COUNT] + wp.float64(1.0)
    state.watch[world, SUM_HEIGHT] = state.watch[world, SUM_HEIGHT] + summary.height
    state.watch[world, SUM_WIDTH] = state.watch[world, SUM_WIDTH] + summary.width
    state.watch[world, SUM_SPEED] = state.watch[world, SUM_SPEED] + summary.loop_speed
    if time - state.watch[world, WINDOW_START] < program.loop_period[world]:
        return
    count = state.watch[world, WINDOW_COUNT]
    height = state.watch[world, SUM_HEIGHT] / count
    width = state.watch[world, SUM_WIDTH] / count
    speed = state.watch[world, SUM_SPEED] / count
    target = program.loop_speed[world]
    fast_enough = wp.abs(speed - target) <= wp.max(ONE_PERCENT * target, SLOWEST_STEADY)
    least_height = wp.min(state.watch[world, LEAST_HEIGHT], height)
    greatest_height = wp.max(state.watch[world, GREATEST_HEIGHT], height)
    least_width = wp.min(state.watch[world, LEAST_WIDTH], width)
    greatest_width = wp.max(state.watch[world, GREATEST_WIDTH], width)
    tolerance = program.steady_tolerance[world]
    height_kept = greatest_height - least_height <= tolerance * height
    width_kept = greatest_width - least_width <= tolerance * width
    is_first = state.watch[world, STEADY_SINCE] < ZERO
    if is_first or not (fast_enough and height_kept and width_kept):
        state.watch[world, STEADY_SINCE] = time
        least_height = height
        greatest_height = height
        least_width = width
        greatest_width = width
    elif time - state.watch[world, STEADY_SINCE] >= program.steady_time[world]:
        state.stop_time[world] = time + program.release_phase[world] * program.loop_period[world]
        state.stop_status[world] = FINISHED
    state.watch[world, LEAST_HEIGHT] = least_height
    state.watch[world, GREATEST_HEIGHT] = greatest_height
    state.watch[world, LEAST_WIDTH] = least_width
    state.watch[world, GREATEST_WIDTH] = greatest_width
    state.watch[world, WINDOW_START] = time
    state.watch[world, WINDOW_COUNT] = ZERO
    state.watch[world, SUM_HEIGHT] = ZERO
    state.watch[world, SUM_WIDTH] = ZERO
    state.watch[world, SUM_SPEED] = ZERO


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
    if state.last_look[world, TIME] < ZERO:
        write_row(state.first_look, world, time, summary)
    write_row(state.last_look, world, time, summary)
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
        softens: Whether the look may change the softness of the joints, see :mod:`softening`.
    """
    watches_rest = watch == "rest"
    watches_steadiness = watch == "steady"

    @wp.func
    def look(
        K: wp.array2d(dtype=wp.float64),
        chain: Chain,
        program: Program,
        state: State,
        record: Record,
        control: Control,
        world: int,
        time: wp.float64,
    ):
        mark = state.next_sample[world]
        is_first = state.last_look[world, TIME] < ZERO
        summary = summarise(K, chain)
        write_sample(state, record, world, time, summary)
        if mark % control.frame_every == wp.int64(0):
            write_frame(record, K, chain, world, time)
        passed = wp.int64(wp.floor(time / control.sample_interval))
        state.next_sample[world] = wp.max(mark, passed) + wp.int64(1)
        if wp.static(softens and watches_rest):
            watch_stiffening(state, program, control, world, time)
            watch_collapse(K, chain, state, control, world, time, is_first)
        if wp.static(softens and watches_steadiness):
            watch_spin_up(state, program, control, world, time)
        if wp.static(watches_rest):
            return watch_rest(state, control, world, time, summary)
        if wp.static(watches_steadiness):
            watch_steadiness(state, program, world, time, summary)
        return RUNNING

    return look
