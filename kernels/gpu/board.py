"""The board, on which all threads of a block see the state of their chain: written, read, loaded and stored."""

import warp as wp

from warpchain.kernels.gpu.stage import Run, read_link
from warpchain.kernels.layout import BOARD_VALUES, COSINE, LEFT_X, THETA, X
from warpchain.kernels.physics.elementary import ZERO, cos_sin
from warpchain.kernels.physics.geometry import Link, end_positions, put, two
from warpchain.kernels.types import Chain, Rows, Worlds


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
def load_link(run: Run, worlds: Worlds):
    """Writes a thread's link on the board; threads without a link get one at the origin that no joint acts on.

    Its direction is that of the launch before, or of its angle if that is void.
    """
    direction = two(run.kept, COSINE, run.column)
    for row in range(COSINE):
        run.K[row, run.lane] = ZERO
    if run.lane < run.links:
        for k in range(6):
            run.K[X + k, run.lane] = worlds.links[run.world, X + k, run.lane]
    if run.lane >= run.links or worlds.is_fresh[run.world] != 0 or worlds.has_first_stage[run.world] == 0:
        cosine, sine = cos_sin(run.K[THETA, run.lane])
        direction = wp.vec2d(cosine, sine)
    put(run.K, COSINE, run.lane, direction)


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
