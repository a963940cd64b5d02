"""The board, on which all threads of a block see the state of their chain: written, read, loaded and stored."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.gpu.stage import Attempt, Link, Place, constants, read_link
from warpchain.kernels.layout import COSINE, LEFT_X, LEFT_Y, MASS, OMEGA, RIGHT_X, RIGHT_Y, SINE, THETA, U, V, X, Y
from warpchain.kernels.physics.elementary import ZERO, cos_sin
from warpchain.kernels.physics.geometry import end_positions
from warpchain.kernels.types import Chain, Rows, State

wp.set_module_options({"enable_backward": False})


@wp.func
def place_of(chain: Chain, lane: int) -> Place:
    """A thread's link and its neighbours."""
    n = chain.link_count
    place = Place()
    place.lane = lane
    place.links = n
    place.column = wp.min(lane, n - 1)
    place.before = lane
    place.after = lane
    if lane < n:
        place.before = wp.where(lane == 0, n - 1, lane - 1)
        place.after = wp.where(lane == n - 1, 0, lane + 1)
    return place


@wp.func
def load_link(K: Rows, state: State, world: int, lane: int, n: int):
    """Writes a thread's link on the board; threads without a link get one at the origin that nothing acts on."""
    row = int(0)
    while row < SINE:
        K[row, lane] = ZERO
        row += 1
    if lane < n:
        for k in range(6):
            K[X + k, lane] = state.links[world, X + k, lane]
    point(K, lane)


@wp.func
def store_link(K: Rows, state: State, world: int, lane: int):
    """Stores the state of a thread's link."""
    for k in range(6):
        state.links[world, X + k, lane] = K[X + k, lane]


@wp.func
def write_attempt(K: Rows, place: Place, result: Attempt, h: wp.float64):
    """Writes a link's new state and the losses of its joint on the board."""
    lane = place.lane
    if lane < place.links:
        K[layout.BOARD_LOST_FRICTION, lane] = K[layout.BOARD_LOST_FRICTION, lane] + h * result.friction
        dissipation = constants(K).joint_damping * result.damping
        K[layout.BOARD_LOST_DAMPING, lane] = K[layout.BOARD_LOST_DAMPING, lane] + h * dissipation
        K[X, lane] = result.x
        K[Y, lane] = result.y
        K[THETA, lane] = result.theta
        K[U, lane] = result.u
        K[V, lane] = result.v
        K[OMEGA, lane] = result.omega
        K[COSINE, lane] = result.cosine
        K[SINE, lane] = result.sine


@wp.func
def load_extremes(K: Rows, state: State, world: int, fixed_depth: int):
    """Writes what is greatest or latest so far on the board; for one thread."""
    K[layout.BOARD_VALUES, layout.VALUE_OPENING] = state.extremes[world, layout.OPENING]
    K[layout.BOARD_VALUES, layout.VALUE_FIXED_DEPTH] = state.extremes[world, fixed_depth]
    K[layout.BOARD_VALUES, layout.VALUE_LAST_IMPULSE] = state.watch[world, layout.LAST_FLOOR_IMPULSE]


@wp.func
def raise_value(K: Rows, value: int, x: wp.float32):
    """Raises one of the chain's values on the board to x; for one thread."""
    K[layout.BOARD_VALUES, value] = wp.max(K[layout.BOARD_VALUES, value], wp.float64(x))


@wp.func
def store_extremes(K: Rows, state: State, world: int, fixed_depth: int):
    """Stores what :func:`load_extremes` has written; for one thread."""
    state.extremes[world, layout.OPENING] = K[layout.BOARD_VALUES, layout.VALUE_OPENING]
    state.extremes[world, fixed_depth] = K[layout.BOARD_VALUES, layout.VALUE_FIXED_DEPTH]
    state.watch[world, layout.LAST_FLOOR_IMPULSE] = K[layout.BOARD_VALUES, layout.VALUE_LAST_IMPULSE]


@wp.func
def store_losses(K: Rows, state: State, world: int, n: int, fixed_loss: int):
    """Stores the losses since loading, summed over the links in their order; for one thread."""
    friction = ZERO
    damping = ZERO
    fixed = ZERO
    between = ZERO
    i = int(0)
    while i < n:
        friction += K[layout.BOARD_LOST_FRICTION, i]
        damping += K[layout.BOARD_LOST_DAMPING, i]
        fixed += K[layout.BOARD_LOST_FIXED, i]
        between += K[layout.BOARD_LOST_SELF, i]
        i += 1
    state.losses[world, layout.LOSS_FRICTION] = friction
    state.losses[world, layout.LOSS_DAMPING] = damping
    state.losses[world, fixed_loss] = fixed
    state.losses[world, layout.LOSS_SELF] = between


@wp.func
def point(K: Rows, lane: int):
    """Writes a link's direction, exactly, from its angle on the board."""
    cosine, sine = cos_sin(K[THETA, lane])
    K[COSINE, lane] = cosine
    K[SINE, lane] = sine


@wp.func
def ends_of(link: Link):
    """Left and right end of a link [m]."""
    return end_positions(link.x, link.y, link.arm_x, link.arm_y)


@wp.func
def publish(K: Rows, place: Place):
    """Writes a link's ends on the board, without a barrier."""
    lane = place.lane
    n = place.links
    if lane < n:
        left_x, left_y, right_x, right_y = ends_of(read_link(K, lane))
        K[LEFT_X, lane] = left_x
        K[LEFT_Y, lane] = left_y
        K[RIGHT_X, lane] = right_x
        K[RIGHT_Y, lane] = right_y
        if lane == 0:
            K[LEFT_X, n] = left_x
            K[LEFT_Y, n] = left_y


@wp.func
def link_is_finite(K: Rows, lane: int):
    """False if the state or its first derivative holds an infinity or a NaN."""
    finite = bool(True)
    row = int(0)
    while row < MASS:
        finite = finite and wp.isfinite(K[row, lane])
        row += 1
    row = int(layout.BOARD_FIRST)
    while row < layout.BOARD_FIRST + 3:
        finite = finite and wp.isfinite(K[row, lane])
        row += 1
    return finite
