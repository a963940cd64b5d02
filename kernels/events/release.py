"""The release rule: a loop is held on its sprocket until it is stationary, and released a drawn time later.

A hold has two parts. First the loop is watched *under load* (see :mod:`physics.scaled_loads`), for one crossing time of
slow waves under that load (:func:`crossing_time`). Then its loads fall to its own within ``LOADING_TIME``, by equal
factors in equal times, and it is watched *free*, for ``steady_time``. By default that is one loop period, or the
crossing time, 5 to 10 s, if the loop was never loaded or slips on its sprocket by more than 0.6 %.

The watched quantities are the loop's height, its width, the place of its centre of mass and its speed. Each is averaged
over windows of time: max(0.05 s, half a crossing) under load; half a loop period, within 0.05 to 0.25 s, when free. The
loop is stationary when, over all windows of a watch,

- the averages of its shape and place agree to within ``steady_tolerance`` of its height (vertical quantities) or width
  (horizontal ones). For shape and place the free watch counts the last loaded window as its first;
- the averages of its speed agree to within ``steady_tolerance`` of the sprocket's speed, or 0.02 m/s if that is more,
  and each differs from the sprocket's speed by at most 25 %, or 0.02 m/s. Once free, its speed is watched afresh.

A window that breaks these rules begins a new watch. The loop is released ``extra_hold`` + phase × loop period after
it is found stationary.

A loop that changes its shape when it becomes free, or is not stationary after eight crossings under load, is held again
under the square root of the load factor; below 3 the factor becomes 1.

Loads that fall at once let the joints contract at once, which throws the loop off its sprocket: with λ = 80 by 25 mm
(180 links, 30 Hz). If they take 0.05 s to fall, nothing of that is seen; in 0.25 s the loop also follows the small
difference between its curves with and without load. Loads that fall to a smaller factor, for the loop to be held again,
do so at once: it has time to come back.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import FINISHED
from warpchain.kernels.physics.elementary import HALF, ONE, ZERO
from warpchain.kernels.physics.scaled_loads import DRAG_PER_CROSSING, DRAG_PER_TURN, crossing_time
from warpchain.kernels.types import LOADING_TIME, Chain, Row, Worlds

LITTLE_SLIP = wp.constant(wp.float64(0.006))
"""Slip above which a free loop is watched for as long as slow waves need.

Loops of Table 1 slip on their sprocket by 0.1 to 0.6 % up to 45 Hz. The slip of one that slips more may vary.
"""
MOST_SLIP = wp.constant(wp.float64(0.25))
"""Slip above which a loop never counts as stationary."""
LEAST_LOAD = wp.constant(wp.float64(3.0))
"""Least factor under which a loop is held again; below it the factor becomes 1."""
MOST_CROSSINGS = wp.constant(wp.float64(8.0))
"""Crossings of slow waves after which a loop that is not stationary under load is held under less. Most take three."""
SLOWEST_STEADY = wp.constant(wp.float64(0.02))
"""Changes of the speed [m/s] that are always even enough: for sprockets that stand still."""
SHORTEST_WINDOW = wp.constant(wp.float64(0.05))
"""Shortest window [s]: passing links make height and width ripple."""
WATCHED = len(layout.WATCHED_COLUMNS)
Watched = wp.types.vector(length=WATCHED, dtype=wp.float64)


@wp.func
def is_watched(worlds: Worlds, world: int, time: wp.float64):
    """Whether the loop is held and its release is not set yet; ``stop_status == FINISHED`` marks that it is."""
    return worlds.stop_status[world] != FINISHED and time >= worlds.drive.hold_start[world]


@wp.func
def begin_window(watch: Row, time: wp.float64):
    """Resets the sums of a window."""
    watch[layout.WINDOW_START] = time
    watch[layout.WINDOW_COUNT] = ZERO
    for k in range(wp.static(WATCHED)):
        watch[layout.WINDOW_SUMS + k] = ZERO


@wp.func
def widen(watch: Row, k: int, mean: wp.float64, is_first: bool):
    """Includes a window's mean in a range of a watch, or begins the range with it; returns the width of the range."""
    least = layout.RANGES + 2 * k
    greatest = least + 1
    if is_first:
        watch[least] = mean
        watch[greatest] = mean
    watch[least] = wp.min(watch[least], mean)
    watch[greatest] = wp.max(watch[greatest], mean)
    return watch[greatest] - watch[least]


@wp.func
def load_at(worlds: Worlds, world: int, time: wp.float64):
    """Factor of the loads at this moment of the drive."""
    if worlds.watch[world, layout.HOLD_LOAD] < ONE:
        worlds.watch[world, layout.HOLD_LOAD] = wp.max(worlds.drive.load_factor[world], ONE)
    if time < worlds.drive.hold_start[world]:
        return ONE
    load = worlds.watch[world, layout.HOLD_LOAD]
    since = worlds.watch[world, layout.UNLOADED_SINCE]
    if since < ZERO:
        return load
    return wp.pow(load, wp.clamp(ONE - (time - since) / LOADING_TIME, ZERO, ONE))


@wp.func
def drag_rate(chain: Chain, worlds: Worlds, world: int, height: wp.float64):
    """Rate γ [1/s] of the drag on the shape of a chain under its present loads."""
    full = worlds.watch[world, layout.HOLD_LOAD]
    present = worlds.load_factor[world]
    gravity = chain.gravity * full / present
    crossing = crossing_time(worlds.drive.loop_speed[world], gravity, chain.sprocket_radius, height)
    turns = worlds.drive.loop_speed[world] / height
    return (DRAG_PER_CROSSING / crossing + DRAG_PER_TURN * turns) * (present - ONE) / full


@wp.func
def watch_steadiness(chain: Chain, worlds: Worlds, world: int, sample: Row):
    """Adds a sample to its window. At the end of a window loads may begin to fall, or the moment of release is set."""
    time = sample[layout.TIME]
    if not is_watched(worlds, world, time):
        return
    watch = worlds.watch[world]
    is_free = worlds.load_factor[world] == ONE
    is_loaded = not is_free and watch[layout.UNLOADED_SINCE] < ZERO
    if not (is_free or is_loaded):
        watch[layout.WINDOW_START] = -ONE  # nothing is watched while loads fall
        return
    if watch[layout.WINDOW_START] < ZERO:
        begin_window(watch, time)
    if watch[layout.LOADED_SINCE] < ZERO:
        watch[layout.LOADED_SINCE] = time
    watch[layout.WINDOW_COUNT] = watch[layout.WINDOW_COUNT] + ONE
    for k in range(wp.static(WATCHED)):
        watch[layout.WINDOW_SUMS + k] = watch[layout.WINDOW_SUMS + k] + sample[wp.static(layout.WATCHED_COLUMNS[k])]

    target = worlds.drive.loop_speed[world]
    crossing = crossing_time(target, chain.gravity, chain.sprocket_radius, sample[layout.HEIGHT])
    window = worlds.drive.steady_window[world]
    wanted = worlds.drive.steady_time[world]
    if is_loaded:
        window = wp.max(SHORTEST_WINDOW, HALF * crossing)
        wanted = crossing
    elif wanted < ZERO:
        slips = target - sample[layout.LOOP_SPEED] > LITTLE_SLIP * target
        was_loaded = watch[layout.HOLD_LOAD] > ONE
        wanted = wp.where(was_loaded and not slips, worlds.drive.loop_period[world], crossing)
    if time - watch[layout.WINDOW_START] < window:
        return

    is_first = watch[layout.STEADY_SINCE] < ZERO
    mean = Watched()
    width = Watched()  # of the range of all means
    for k in range(wp.static(WATCHED)):
        mean[k] = watch[layout.WINDOW_SUMS + k] / watch[layout.WINDOW_COUNT]
        width[k] = widen(watch, k, mean[k], is_first)
    begin_window(watch, time)
    vertical = wp.max(width[layout.LOOP_HEIGHT], width[layout.LOOP_Y]) / mean[layout.LOOP_HEIGHT]
    horizontal = wp.max(width[layout.LOOP_WIDTH], width[layout.LOOP_X]) / mean[layout.LOOP_WIDTH]
    drift = wp.max(vertical, horizontal)
    watch[layout.DRIFT] = drift
    speed = mean[layout.LOOP_ALONG]
    tolerance = worlds.drive.steady_tolerance[world]
    is_fast_enough = wp.abs(speed - target) <= wp.max(MOST_SLIP * target, SLOWEST_STEADY)
    keeps_speed = is_fast_enough and width[layout.LOOP_ALONG] <= wp.max(tolerance * target, SLOWEST_STEADY)
    keeps_shape = drift <= tolerance
    is_over = keeps_shape and keeps_speed and not is_first and time - watch[layout.STEADY_SINCE] >= wanted
    if is_first or not (keeps_shape and keeps_speed) or (is_over and is_loaded):
        # the next watch counts this window as its first
        watch[layout.STEADY_SINCE] = time
        for k in range(wp.static(WATCHED)):
            widen(watch, k, mean[k], True)
    if is_over and is_loaded:
        begins = wp.static(layout.RANGES + 2 * layout.LOOP_ALONG)
        watch[begins] = wp.float64(wp.inf)  # speed starts afresh: under load the loop slipped more
        watch[begins + 1] = -wp.float64(wp.inf)
        watch[layout.UNLOADED_SINCE] = time
        watch[layout.STEADY_SINCE] = time + LOADING_TIME
    elif is_over:
        wait = worlds.drive.extra_hold[world] + worlds.drive.release_phase[world] * worlds.drive.loop_period[world]
        worlds.stop_time[world] = time + wait
        worlds.stop_status[world] = FINISHED
    leaves_shape = is_free and watch[layout.HOLD_LOAD] > ONE and not (is_first or keeps_shape)
    loses_time = is_loaded and not is_over and time - watch[layout.LOADED_SINCE] > MOST_CROSSINGS * crossing
    if leaves_shape or loses_time:
        root = wp.sqrt(watch[layout.HOLD_LOAD])
        watch[layout.HOLD_LOAD] = wp.where(root < LEAST_LOAD, ONE, root)
        watch[layout.UNLOADED_SINCE] = -ONE
        watch[layout.LOADED_SINCE] = time
        watch[layout.STEADY_SINCE] = -ONE
