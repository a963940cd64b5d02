"""What a chain's threads see of one another: the board of the block form, and what each thread holds itself."""

import warp as wp

from .block_step import Link, Place, Rates
from .elementary import ONE, cos_sin
from .geometry import end_positions
from .layout import (
    BOARD_NOTES,
    COSINE,
    LEFT_X,
    LEFT_Y,
    NOTE_CHAIN_FRICTION,
    NOTE_CHAIN_RESTITUTION,
    NOTE_CIRCLE_RADIUS,
    NOTE_COULOMB,
    NOTE_DAMPING,
    NOTE_FLOOR_FRICTION,
    NOTE_FLOOR_RESTITUTION,
    NOTE_GRAVITY,
    NOTE_INVERSE_SMOOTHING,
    NOTE_SPROCKET_FRICTION,
    NOTE_SPROCKET_RADIUS,
    NOTE_SPROCKET_RESTITUTION,
    NOTE_STIFFNESS,
    NOTE_TANGENTIAL,
    NOTE_VISCOUS,
    OMEGA,
    RIGHT_X,
    RIGHT_Y,
    SINE,
    THETA,
    U,
    V,
    X,
    Y,
)
from .types import Chain, State

wp.set_module_options({"enable_backward": False})


@wp.func
def take_place(chain: Chain, lane: int) -> Place:
    """Neighbours of a thread's link."""
    n = chain.link_count
    place = Place()
    place.lane = lane
    place.column = wp.min(lane, n - 1)
    place.before = lane
    place.after = lane
    if lane < n:
        place.before = wp.where(lane == 0, n - 1, lane - 1)
        place.after = wp.where(lane == n - 1, 0, lane + 1)
    place.half_length = chain.half_length
    return place


@wp.func
def note_constants(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """What stages and contacts need of a chain, onto the board."""
    K[BOARD_NOTES, NOTE_STIFFNESS] = chain.joint_stiffness
    K[BOARD_NOTES, NOTE_DAMPING] = chain.joint_damping
    K[BOARD_NOTES, NOTE_VISCOUS] = chain.viscous_friction
    K[BOARD_NOTES, NOTE_COULOMB] = chain.coulomb_friction
    K[BOARD_NOTES, NOTE_INVERSE_SMOOTHING] = chain.inverse_smoothing
    K[BOARD_NOTES, NOTE_GRAVITY] = chain.gravity
    K[BOARD_NOTES, NOTE_CIRCLE_RADIUS] = chain.circle_radius
    K[BOARD_NOTES, NOTE_SPROCKET_RADIUS] = chain.sprocket_radius
    K[BOARD_NOTES, NOTE_TANGENTIAL] = chain.tangential_restitution
    K[BOARD_NOTES, NOTE_FLOOR_RESTITUTION] = chain.floor_restitution
    K[BOARD_NOTES, NOTE_FLOOR_FRICTION] = chain.floor_friction
    K[BOARD_NOTES, NOTE_SPROCKET_RESTITUTION] = chain.sprocket_restitution
    K[BOARD_NOTES, NOTE_SPROCKET_FRICTION] = chain.sprocket_friction
    K[BOARD_NOTES, NOTE_CHAIN_RESTITUTION] = chain.chain_restitution
    K[BOARD_NOTES, NOTE_CHAIN_FRICTION] = chain.chain_friction


@wp.func
def contact_constants(K: wp.array2d(dtype=wp.float64), n: int) -> Chain:
    """What contacts need of a chain, back from the board."""
    chain = Chain()
    chain.link_count = n
    chain.circle_radius = K[BOARD_NOTES, NOTE_CIRCLE_RADIUS]
    chain.sprocket_radius = K[BOARD_NOTES, NOTE_SPROCKET_RADIUS]
    chain.tangential_restitution = K[BOARD_NOTES, NOTE_TANGENTIAL]
    chain.floor_restitution = K[BOARD_NOTES, NOTE_FLOOR_RESTITUTION]
    chain.floor_friction = K[BOARD_NOTES, NOTE_FLOOR_FRICTION]
    chain.sprocket_restitution = K[BOARD_NOTES, NOTE_SPROCKET_RESTITUTION]
    chain.sprocket_friction = K[BOARD_NOTES, NOTE_SPROCKET_FRICTION]
    chain.chain_restitution = K[BOARD_NOTES, NOTE_CHAIN_RESTITUTION]
    chain.chain_friction = K[BOARD_NOTES, NOTE_CHAIN_FRICTION]
    return chain


@wp.func
def load_link(K: wp.array2d(dtype=wp.float64), state: State, world: int, lane: int, n: int) -> Link:
    """State of a thread's link, its angle on the board; threads beyond the last hold one at the origin."""
    link = Link()
    link.cosine = ONE
    if lane < n:
        theta = state.links[world, THETA, lane]
        K[THETA, lane] = theta
        link.x = state.links[world, X, lane]
        link.y = state.links[world, Y, lane]
        link.u = state.links[world, U, lane]
        link.v = state.links[world, V, lane]
        link.omega = state.links[world, OMEGA, lane]
        cosine, sine = cos_sin(theta)
        link.cosine = cosine
        link.sine = sine
    return link


@wp.func
def ends_of(place: Place, link: Link):
    """Left and right end of a link [m]."""
    chain = Chain()
    chain.half_length = place.half_length
    return end_positions(chain, link.x, link.y, link.cosine, link.sine)


@wp.func
def publish(K: wp.array2d(dtype=wp.float64), n: int, place: Place, link: Link):
    """Fills the board's rows of state, directions and ends, with no barrier."""
    lane = place.lane
    if lane < n:
        K[X, lane] = link.x
        K[Y, lane] = link.y
        K[U, lane] = link.u
        K[V, lane] = link.v
        K[OMEGA, lane] = link.omega
        K[COSINE, lane] = link.cosine
        K[SINE, lane] = link.sine
        left_x, left_y, right_x, right_y = ends_of(place, link)
        K[LEFT_X, lane] = left_x
        K[LEFT_Y, lane] = left_y
        K[RIGHT_X, lane] = right_x
        K[RIGHT_Y, lane] = right_y
        if lane == 0:
            K[LEFT_X, n] = left_x
            K[LEFT_Y, n] = left_y


@wp.func
def link_is_finite(link: Link, theta: wp.float64, first: Rates):
    """False if the state or its first derivative holds an infinity or a NaN."""
    finite = wp.isfinite(link.x) and wp.isfinite(link.y) and wp.isfinite(theta)
    finite = finite and wp.isfinite(link.u) and wp.isfinite(link.v) and wp.isfinite(link.omega)
    return finite and wp.isfinite(first.x) and wp.isfinite(first.y) and wp.isfinite(first.theta)
