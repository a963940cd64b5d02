"""The end of a walk: a chain that has been slow for a while is at rest."""

import warp as wp

from warpchain.kernels.codes import AT_REST, RUNNING
from warpchain.kernels.events.summary import Summary
from warpchain.kernels.layout import REST_SINCE
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.types import Control, State

wp.set_module_options({"enable_backward": False})


@wp.func
def watch_rest(state: State, control: Control, world: int, time: wp.float64, summary: Summary):
    """Status AT_REST once the centre's speed and the rms speed have both been low for the rest time, else RUNNING."""
    speed = wp.sqrt(summary.center_u * summary.center_u + summary.center_v * summary.center_v)
    if wp.max(speed, summary.rms_speed) < control.rest_speed:
        if state.watch[world, REST_SINCE] < ZERO:
            state.watch[world, REST_SINCE] = time
        if time - state.watch[world, REST_SINCE] >= control.rest_time:
            return AT_REST
    else:
        state.watch[world, REST_SINCE] = wp.float64(-1.0)
    return RUNNING
