"""Time series and frames: samples of a chain, joint positions and loads."""

import warp as wp

from warpchain.kernels.codes import NOT_FINITE, RUNNING
from warpchain.kernels.layout import COSINE, COULOMB, LEFT_X, LEFT_Y, OMEGA, RIGHT_X, RIGHT_Y, SINE, TIME, VISCOUS, U, V
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.physics.joint import friction_torque, joint_force
from warpchain.kernels.types import Chain, Rows, Worlds


@wp.func
def copy_sample(worlds: Worlds, world: int, target: Rows, row: int):
    """Writes the latest sample of a chain as a row, as far as it has columns."""
    for column in range(target.shape[1]):
        target[row, column] = worlds.last_sample[world, column]


@wp.func
def keep_sample(worlds: Worlds, world: int, time: wp.float64):
    """Completes the latest sample of a chain by its time, and keeps it as the first and in the time series."""
    is_first = worlds.last_sample[world, TIME] < ZERO
    worlds.last_sample[world, TIME] = time
    if is_first:
        copy_sample(worlds, world, worlds.first_sample, world)
    if worlds.record.samples.shape[1] > 0:
        row = worlds.record.sample_count[world]
        copy_sample(worlds, world, worlds.record.samples[world], row)
        worlds.record.sample_count[world] = row + 1


@wp.func
def write_load(loads: Rows, row: int, K: Rows, chain: Chain, i: int):
    """Writes force F = k C + b Ċ [N] and friction moment [N m] of joint i, both as they act on the link before it."""
    n = chain.link_count
    j = wp.where(i + 1 == n, 0, i + 1)
    a = chain.half_length
    rate_x = (K[U, j] + a * K[OMEGA, j] * K[SINE, j]) - (K[U, i] - a * K[OMEGA, i] * K[SINE, i])
    rate_y = (K[V, j] - a * K[OMEGA, j] * K[COSINE, j]) - (K[V, i] + a * K[OMEGA, i] * K[COSINE, i])
    loads[row, i] = joint_force(chain, K[LEFT_X, i + 1] - K[RIGHT_X, i], rate_x)
    loads[row, n + i] = joint_force(chain, K[LEFT_Y, i + 1] - K[RIGHT_Y, i], rate_y)
    spin = K[OMEGA, j] - K[OMEGA, i]
    loads[row, 2 * n + i] = friction_torque(K[VISCOUS, i], K[COULOMB, i], spin, chain.inverse_smoothing)


@wp.func
def write_frame(K: Rows, chain: Chain, worlds: Worlds, world: int, time: wp.float64):
    """Appends all joint positions if frames are kept, and the loads of the joints if these are kept."""
    if worlds.record.frames.shape[1] == 0:
        return
    n = chain.link_count
    row = worlds.record.frame_count[world]
    for i in range(n):
        worlds.record.frames[world, row, i] = K[RIGHT_X, i]
        worlds.record.frames[world, row, n + i] = K[RIGHT_Y, i]
        if worlds.record.frame_loads.shape[1] > 0:
            write_load(worlds.record.frame_loads[world], row, K, chain, i)
    worlds.record.frame_times[world, row] = time
    worlds.record.frame_count[world] = row + 1


@wp.func
def lacks_last_sample(worlds: Worlds, world: int, time: wp.float64, status: int):
    """Whether a run has ended between two samples: then the final state is the last sample of its series."""
    return status != RUNNING and status != NOT_FINITE and worlds.last_sample[world, TIME] != time


@wp.func
def record_is_full(worlds: Worlds, world: int):
    """True when the host must drain the record before this world goes on."""
    samples_full = (
        worlds.record.samples.shape[1] > 0 and worlds.record.sample_count[world] >= worlds.record.samples.shape[1]
    )
    frames_full = (
        worlds.record.frames.shape[1] > 0 and worlds.record.frame_count[world] >= worlds.record.frames.shape[1]
    )
    return samples_full or frames_full
