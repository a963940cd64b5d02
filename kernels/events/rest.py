"""The end of a walk: a chain that has been slow for a while, on the floor, is at rest. On a slope it may never be.

What lies on the floor touches it all the time. A chain that is slow in mid-air, at the top of a bounce or under little
gravity, is not at rest: an impulse on the floor must be at most as long ago as the rest time.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import AT_REST, DISTANCE_LIMIT, FINISHED, RUNNING
from warpchain.kernels.layout import REST_SINCE
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.types import Row, Worlds


@wp.func
def watch_rest(worlds: Worlds, world: int, sample: Row):
    """Status AT_REST once both speeds, the centre's and the rms, have been low for the rest time, else RUNNING.

    DISTANCE_LIMIT once the centre is as far as a walk may go. Runs that finish at a given time are not ended earlier.
    """
    if worlds.stop_status[world] == FINISHED:
        return RUNNING
    if worlds.drive.farthest[world] > ZERO and wp.abs(sample[layout.CENTER_X]) >= worlds.drive.farthest[world]:
        return DISTANCE_LIMIT
    time = sample[layout.TIME]
    u = sample[layout.CENTER_U]
    v = sample[layout.CENTER_V]
    if wp.max(wp.sqrt(u * u + v * v), sample[layout.RMS_SPEED]) < worlds.control.rest_speed:
        if worlds.watch[world, REST_SINCE] < ZERO:
            worlds.watch[world, REST_SINCE] = time
        is_held = time - worlds.watch[world, layout.LAST_FLOOR_IMPULSE] <= worlds.control.rest_time
        if is_held and time - worlds.watch[world, REST_SINCE] >= worlds.control.rest_time:
            return AT_REST
    else:
        worlds.watch[world, REST_SINCE] = wp.float64(-1.0)
    return RUNNING
