"""The release rule: a loop is held on its sprocket until it is stationary, and released a drawn time later.

A hold has two parts. *Under load* (see :mod:`physics.scaled_loads`) the loop is watched for as long as slow waves need
to cross it there. Then its loads fall to its own within ``LOADING_TIME``, by equal factors in equal times, and *free*
it is watched again, for ``steady_time``. Watched are means over windows of time of its height, its width and the place
of its centre of mass. Stationary means that all windows of a watch agree to within ``steady_tolerance`` of the loop's
height (vertical quantities) or width (horizontal ones), those of the free watch also with the last one under load, and
that the loop runs as evenly. A loop that leaves its shape when it becomes free, or does not become stationary under
load, is held under the square root of the factor, finally under its own loads: then, and whenever it slips on its
sprocket by more than 0.6 %, it is watched free for as long as slow waves need, 5 to 10 s.

Loads that fall at once let the joints contract at once, which throws the loop off its sprocket: with λ = 80 by 25 mm
(180 links, 30 Hz). Nothing of that is seen if they take 0.05 s; in 0.25 s the loop also follows the little that its
curve under load differs by. Loads that fall to a smaller multiple do so at once: the loop has time to come back.
"""

import warp as wp

from warpchain.kernels.codes import FINISHED
from warpchain.kernels.events.summary import Summary
from warpchain.kernels.layout import (
    DRIFT,
    GREATEST_HEIGHT,
    GREATEST_SPEED,
    GREATEST_WIDTH,
    GREATEST_X,
    GREATEST_Y,
    HOLD_LOAD,
    LEAST_HEIGHT,
    LEAST_SPEED,
    LEAST_WIDTH,
    LEAST_X,
    LEAST_Y,
    LOADED_SINCE,
    STEADY_SINCE,
    SUM_HEIGHT,
    SUM_SPEED,
    SUM_WIDTH,
    SUM_X,
    SUM_Y,
    UNLOADED_SINCE,
    WINDOW_COUNT,
    WINDOW_START,
)
from warpchain.kernels.physics.elementary import HALF, ONE, ZERO
from warpchain.kernels.physics.scaled_loads import DRAG_PER_CROSSING, DRAG_PER_TURN, crossing_time
from warpchain.kernels.types import Chain, Drive, State

wp.set_module_options({"enable_backward": False})

"""Status of a drive whose end has been set, a code shared with warpchain.status."""
LITTLE_SLIP = wp.constant(wp.float64(0.006))
"""Loops of Table 1 slip on their sprocket by 0.1 to 0.6 % up to 45 Hz. One that slips more may do so now more, now
less, so that it is watched for as long as slow waves need …"""
MOST_SLIP = wp.constant(wp.float64(0.25))
"""… and is never found stationary beyond this."""
LOADING_TIME = wp.constant(wp.float64(0.25))
"""Time [s] in which loads fall to the loop's own."""
LEAST_LOAD = wp.constant(wp.float64(3.0))
"""Least factor under which a loop is held again."""
MOST_CROSSINGS = wp.constant(wp.float64(8.0))
"""Crossings of slow waves after which a loop that is not stationary under load is held under less; most take three."""
SLOWEST_STEADY = wp.constant(wp.float64(0.02))
"""Unevenness [m/s] of the speed that always counts as even: of a sprocket that stands still."""
SHORTEST_WINDOW = wp.constant(wp.float64(0.05))
"""Least time [s] over which means are taken: links that pass make height and width ripple."""


@wp.func
def is_watched(state: State, drive: Drive, world: int, time: wp.float64):
    """Whether the loop is being held and its release has not been set."""
    return state.stop_status[world] != FINISHED and time >= drive.hold_start[world]


@wp.func
def begin_window(state: State, world: int, time: wp.float64):
    """Forgets the sums of the window before."""
    state.watch[world, WINDOW_START] = time
    state.watch[world, WINDOW_COUNT] = ZERO
    state.watch[world, SUM_HEIGHT] = ZERO
    state.watch[world, SUM_WIDTH] = ZERO
    state.watch[world, SUM_X] = ZERO
    state.watch[world, SUM_Y] = ZERO
    state.watch[world, SUM_SPEED] = ZERO


@wp.func
def widen(state: State, world: int, least: int, greatest: int, mean: wp.float64, is_first: bool):
    """Least and greatest mean of a watch with one more window, or one first; returns their difference."""
    if is_first:
        state.watch[world, least] = mean
        state.watch[world, greatest] = mean
    state.watch[world, least] = wp.min(state.watch[world, least], mean)
    state.watch[world, greatest] = wp.max(state.watch[world, greatest], mean)
    return state.watch[world, greatest] - state.watch[world, least]


@wp.func
def load_at(state: State, drive: Drive, world: int, time: wp.float64):
    """Factor of the loads at this moment of the drive."""
    if state.watch[world, HOLD_LOAD] < ONE:
        state.watch[world, HOLD_LOAD] = wp.max(drive.load_factor[world], ONE)
    if time < drive.hold_start[world]:
        return ONE
    load = state.watch[world, HOLD_LOAD]
    since = state.watch[world, UNLOADED_SINCE]
    if since < ZERO:
        return load
    return wp.pow(load, wp.clamp(ONE - (time - since) / LOADING_TIME, ZERO, ONE))


@wp.func
def drag_rate(chain: Chain, state: State, drive: Drive, world: int, height: wp.float64):
    """Rate γ [1/s] of the drag on the shape of a chain under its present loads."""
    full = state.watch[world, HOLD_LOAD]
    present = state.load_factor[world]
    gravity = chain.gravity * full / present
    crossing = crossing_time(drive.loop_speed[world], gravity, chain.sprocket_radius, height)
    turns = drive.loop_speed[world] / height
    return (DRAG_PER_CROSSING / crossing + DRAG_PER_TURN * turns) * (present - ONE) / full


@wp.func
def watch_steadiness(chain: Chain, state: State, drive: Drive, world: int, time: wp.float64, summary: Summary):
    """Ends a window if it is time to, and says what follows: loads fall, or the moment of the release is set."""
    if not is_watched(state, drive, world, time):
        return
    is_free = state.load_factor[world] == ONE
    is_loaded = not is_free and state.watch[world, UNLOADED_SINCE] < ZERO
    if not (is_free or is_loaded):
        state.watch[world, WINDOW_START] = -ONE  # nothing is watched while loads fall
        return
    if state.watch[world, WINDOW_START] < ZERO:
        begin_window(state, world, time)
    if state.watch[world, LOADED_SINCE] < ZERO:
        state.watch[world, LOADED_SINCE] = time
    state.watch[world, WINDOW_COUNT] = state.watch[world, WINDOW_COUNT] + ONE
    state.watch[world, SUM_HEIGHT] = state.watch[world, SUM_HEIGHT] + summary.height
    state.watch[world, SUM_WIDTH] = state.watch[world, SUM_WIDTH] + summary.width
    state.watch[world, SUM_X] = state.watch[world, SUM_X] + summary.center_x
    state.watch[world, SUM_Y] = state.watch[world, SUM_Y] + summary.center_y
    state.watch[world, SUM_SPEED] = state.watch[world, SUM_SPEED] + summary.loop_speed

    crossing = crossing_time(drive.loop_speed[world], chain.gravity, chain.sprocket_radius, summary.height)
    window = drive.steady_window[world]
    wanted = drive.steady_time[world]
    if is_loaded:
        window = wp.max(SHORTEST_WINDOW, HALF * crossing)
        wanted = crossing
    elif wanted < ZERO:
        slips = drive.loop_speed[world] - summary.loop_speed > LITTLE_SLIP * drive.loop_speed[world]
        was_loaded = state.watch[world, HOLD_LOAD] > ONE
        wanted = wp.where(was_loaded and not slips, drive.loop_period[world], crossing)
    if time - state.watch[world, WINDOW_START] < window:
        return

    count = state.watch[world, WINDOW_COUNT]
    height = state.watch[world, SUM_HEIGHT] / count
    width = state.watch[world, SUM_WIDTH] / count
    x = state.watch[world, SUM_X] / count
    y = state.watch[world, SUM_Y] / count
    speed = state.watch[world, SUM_SPEED] / count
    begin_window(state, world, time)
    is_first = state.watch[world, STEADY_SINCE] < ZERO
    tall = widen(state, world, LEAST_HEIGHT, GREATEST_HEIGHT, height, is_first)
    wide = widen(state, world, LEAST_WIDTH, GREATEST_WIDTH, width, is_first)
    aside = widen(state, world, LEAST_X, GREATEST_X, x, is_first)
    up = widen(state, world, LEAST_Y, GREATEST_Y, y, is_first)
    drift = wp.max(wp.max(tall, up) / height, wp.max(wide, aside) / width)
    state.watch[world, DRIFT] = drift
    target = drive.loop_speed[world]
    uneven = widen(state, world, LEAST_SPEED, GREATEST_SPEED, speed, is_first)
    tolerance = drive.steady_tolerance[world]
    is_fast_enough = wp.abs(speed - target) <= wp.max(MOST_SLIP * target, SLOWEST_STEADY)
    keeps_speed = is_fast_enough and uneven <= wp.max(tolerance * target, SLOWEST_STEADY)
    keeps_shape = drift <= tolerance
    is_over = keeps_shape and keeps_speed and not is_first and time - state.watch[world, STEADY_SINCE] >= wanted
    if is_first or not (keeps_shape and keeps_speed) or (is_over and is_loaded):
        # the next watch begins with this window
        state.watch[world, STEADY_SINCE] = time
        widen(state, world, LEAST_HEIGHT, GREATEST_HEIGHT, height, True)
        widen(state, world, LEAST_WIDTH, GREATEST_WIDTH, width, True)
        widen(state, world, LEAST_X, GREATEST_X, x, True)
        widen(state, world, LEAST_Y, GREATEST_Y, y, True)
        widen(state, world, LEAST_SPEED, GREATEST_SPEED, speed, True)
    if is_over and is_loaded:
        state.watch[world, LEAST_SPEED] = wp.float64(wp.inf)  # a loaded loop slips more: its speed counts no longer
        state.watch[world, GREATEST_SPEED] = -wp.float64(wp.inf)
        state.watch[world, UNLOADED_SINCE] = time
        state.watch[world, STEADY_SINCE] = time + LOADING_TIME
    elif is_over:
        wait = drive.further_hold[world] + drive.release_phase[world] * drive.loop_period[world]
        state.stop_time[world] = time + wait
        state.stop_status[world] = FINISHED
    leaves_shape = is_free and state.watch[world, HOLD_LOAD] > ONE and not (is_first or keeps_shape)
    loses_time = is_loaded and not is_over and time - state.watch[world, LOADED_SINCE] > MOST_CROSSINGS * crossing
    if leaves_shape or loses_time:
        root = wp.sqrt(state.watch[world, HOLD_LOAD])
        state.watch[world, HOLD_LOAD] = wp.where(root < LEAST_LOAD, ONE, root)
        state.watch[world, UNLOADED_SINCE] = -ONE
        state.watch[world, LOADED_SINCE] = time
        state.watch[world, STEADY_SINCE] = -ONE
