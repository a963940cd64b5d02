"""The board, on which all threads of a block see the state of their chain: written, read, loaded and stored."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.gpu.stage import Attempt, Run, constants, read_link
from warpchain.kernels.layout import BOARD_VALUES, COSINE, LEFT_X, SINE, THETA, U, X
from warpchain.kernels.physics.elementary import ZERO, cos_sin
from warpchain.kernels.physics.geometry import Link, end_positions, put
from warpchain.kernels.types import Chain, Rows, State


@wp.func
def find_link(empty: Run, chain: Chain, lane: int) -> Run:
    """A run with the place of a thread's link and of its neighbours."""
    n = chain.link_count
    run = empty
    run.lane = lane
    run.links = n
    run.column = wp.min(lane, n - 1)
    run.before = lane
    run.after = lane
    if lane < n:
        run.before = wp.where(lane == 0, n - 1, lane - 1)
        run.after = wp.where(lane == n - 1, 0, lane + 1)
    return run


@wp.func
def load_link(run: Run, state: State):
    """Writes a thread's link on the board; threads without a link get one at the origin that nothing acts on."""
    for row in range(SINE):
        run.K[row, run.lane] = ZERO
    if run.lane < run.links:
        for k in range(6):
            run.K[X + k, run.lane] = state.links[run.world, X + k, run.lane]
    cosine, sine = cos_sin(run.K[THETA, run.lane])
    put(run.K, COSINE, run.lane, wp.vec2d(cosine, sine))


@wp.func
def write_attempt(run: Run, result: Attempt, h: wp.float64):
    """Writes a link's new state and the losses of its joint on the board."""
    K = run.K
    lane = run.lane
    if lane < run.links:
        K[layout.BOARD_LOST_FRICTION, lane] = K[layout.BOARD_LOST_FRICTION, lane] + h * result.friction
        dissipation = constants(K).joint_damping * result.damping
        K[layout.BOARD_LOST_DAMPING, lane] = K[layout.BOARD_LOST_DAMPING, lane] + h * dissipation
        put(K, X, lane, result.place)
        put(K, U, lane, result.velocity)
        put(K, COSINE, lane, wp.vec2d(result.cosine, result.sine))


@wp.func
def raise_value(K: Rows, value: int, x: wp.float32):
    """Raises one of the chain's values on the board to x; for one thread."""
    K[BOARD_VALUES, value] = wp.max(K[BOARD_VALUES, value], wp.float64(x))


@wp.func
def ends_of(link: Link):
    """Left and right end of a link [m]."""
    return end_positions(link.x, link.y, link.arm_x, link.arm_y)


@wp.func
def publish(run: Run):
    """Writes a link's ends on the board, without a barrier."""
    K = run.K
    lane = run.lane
    n = run.links
    if lane < n:
        left_x, left_y, right_x, right_y = ends_of(read_link(K, lane))
        put(K, LEFT_X, lane, wp.vec4d(left_x, left_y, right_x, right_y))
        if lane == 0:
            put(K, LEFT_X, n, wp.vec2d(left_x, left_y))
