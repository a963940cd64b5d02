"""A stage on springs, one thread per link, and the structs of a step: link, rates, proximity, attempt.

A thread evaluates the joint at its link's right end. In each stage it passes its left end to the previous link and its
joint's force to the next one. Two barriers a stage cost less than evaluating every joint twice.

Registers are scarce: spills go to local memory, and large shared memory leaves little L1 cache for them. So the chain's
constants lie on the board and are read where they are needed.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import COSINE, OMEGA, SINE, U, V, X, Y
from warpchain.kernels.methods.controller import error_scale, quick_quotient
from warpchain.kernels.physics.elementary import ZERO, order_bits_single
from warpchain.kernels.physics.geometry import end_positions, end_velocities
from warpchain.kernels.physics.joint import friction_torque, joint_force, link_acceleration
from warpchain.kernels.physics.plane import plane_load
from warpchain.kernels.types import Chain, Rows

wp.set_module_options({"enable_backward": False})

LARGEST_SCALE = wp.constant(wp.float32(1e30))
"""Divisors are reduced to this, because :func:`quick_quotient` is 0 beyond 2¹²⁶; the ratio only grows."""

vec3d = wp.types.vector(length=3, dtype=wp.float64)
vec5d = wp.types.vector(length=5, dtype=wp.float64)


@wp.struct
class Link:
    """State of a link, with its arm (see :mod:`physics.geometry`) instead of its angle, which no stage needs."""

    x: wp.float64  # [m]
    y: wp.float64  # [m]
    u: wp.float64  # ẋ [m/s]
    v: wp.float64  # ẏ [m/s]
    omega: wp.float64  # θ̇ [rad/s]
    arm_x: wp.float64  # [m]
    arm_y: wp.float64


@wp.struct
class Place:
    """A thread's place in its block."""

    lane: wp.int32  # its link
    column: wp.int32  # its link, or the last one for threads without a link
    before: wp.int32  # the link to the left
    after: wp.int32  # the link to the right
    links: wp.int32  # number of links of the chain


@wp.struct
class Rates:
    """A stage: accelerations of the link, and power lost in its right joint."""

    x: wp.float64
    y: wp.float64
    theta: wp.float64
    friction: wp.float64  # [W]
    damping: wp.float64  # [W], divided by the joint's b


@wp.struct
class Proximity:
    """Maxima over a whole chain in one state, in single precision, which keeps signs."""

    opening: wp.float32  # greatest of a joint [m]
    gap: wp.float32  # least to floor or sprocket [m]
    displacement: wp.float32  # greatest of a joint since the neighbour list was built [m]
    speed: wp.float32  # bound on the speed of any point [m/s]


@wp.struct
class Attempt:
    """A finished attempt: the link's new state, its last stage, and mean powers lost in the step."""

    x: wp.float64
    y: wp.float64
    theta: wp.float64
    u: wp.float64
    v: wp.float64
    omega: wp.float64
    last: Rates
    proximity: Proximity  # of the new state, if the method reuses the last stage
    cosine: wp.float64  # direction of the new state
    sine: wp.float64
    friction: wp.float64
    damping: wp.float64
    error: wp.float64  # greatest error ratio times tolerance, as numerator …
    scale: wp.float64  # … and divisor
    turns_far: bool  # further than the method allows in one step


@wp.func_native("return reinterpret_cast<::wp::uint64>(K.data + offset);")
def address_on_board(K: Rows, offset: int) -> wp.uint64:
    """Where a number on the board lies; with ``K.ptr`` the compiler would not know that it is shared memory."""
    ...


@wp.func
def constants_address(K: Rows):
    """Where the chain's constants lie on the board."""
    return address_on_board(K, wp.static(layout.BOARD_VALUES) * K.shape[1] + wp.static(layout.VALUES))


@wp.func
def constants(K: Rows) -> Chain:
    """The chain's constants, from the board; the compiler loads the fields that are used."""
    chains = wp.array(ptr=constants_address(K), shape=(1,), dtype=Chain)
    return chains[0]


@wp.func
def write_constants(K: Rows, chain: Chain):
    """Writes the chain's constants on the board."""
    chains = wp.array(ptr=constants_address(K), shape=(1,), dtype=Chain)
    chains[0] = chain


@wp.func
def read_link(K: Rows, column: int) -> Link:
    """A link, from the board."""
    link = Link()
    link.x = K[X, column]
    link.y = K[Y, column]
    link.u = K[U, column]
    link.v = K[V, column]
    link.omega = K[OMEGA, column]
    half_length = constants(K).half_length
    link.arm_x = half_length * K[COSINE, column]
    link.arm_y = half_length * K[SINE, column]
    return link


@wp.func
def write_first_stage(K: Rows, column: int, first: Rates, with_powers: bool):
    """Writes a link's first stage of the next step on the board."""
    K[layout.BOARD_FIRST, column] = first.x
    K[layout.BOARD_FIRST + 1, column] = first.y
    K[layout.BOARD_FIRST + 2, column] = first.theta
    if with_powers:
        K[layout.BOARD_FIRST + 3, column] = first.friction
        K[layout.BOARD_FIRST + 4, column] = first.damping


@wp.func
def read_first_stage(K: Rows, column: int) -> Rates:
    """A link's first stage, from the board; its powers are those of the last :func:`write_first_stage` with powers."""
    first = Rates()
    first.x = K[layout.BOARD_FIRST, column]
    first.y = K[layout.BOARD_FIRST + 1, column]
    first.theta = K[layout.BOARD_FIRST + 2, column]
    first.friction = K[layout.BOARD_FIRST + 3, column]
    first.damping = K[layout.BOARD_FIRST + 4, column]
    return first


@wp.func
def felt_plane(K: Rows, own: Chain, first: int) -> Chain:
    """The chain on the plane whose values begin at this place of the board's values."""
    chain = own
    chain.plane_speed = K[layout.BOARD_VALUES, first]
    chain.turn_x = K[layout.BOARD_VALUES, first + 1]
    chain.turn_y = K[layout.BOARD_VALUES, first + 2]
    chain.up_x = K[layout.BOARD_VALUES, first + 3]
    chain.up_y = K[layout.BOARD_VALUES, first + 4]
    chain.up_z = K[layout.BOARD_VALUES, first + 5]
    chain.origin_height = K[layout.BOARD_VALUES, first + 6]
    return chain


@wp.func
def greater(error_a: wp.float64, scale_a: wp.float64, error_b: wp.float64, scale_b: wp.float64):
    """The greater of two quotients |error| / scale with positive scales; a NaN is the greatest."""
    keeps_a = wp.abs(error_a) * scale_b >= wp.abs(error_b) * scale_a or error_a != error_a
    return wp.where(keeps_a, error_a, error_b), wp.where(keeps_a, scale_a, scale_b)


@wp.func
def error_of(result: Attempt, tolerance: wp.float64):
    """Error ratio of a link as ordered bits, NaN above all numbers; turning too far counts as a ratio of 2."""
    scale = wp.float32(result.scale * tolerance)
    ratio = quick_quotient(wp.float32(wp.abs(result.error)), wp.where(scale > LARGEST_SCALE, LARGEST_SCALE, scale))
    if result.turns_far and ratio < wp.float32(2.0):
        ratio = wp.float32(2.0)
    return order_bits_single(ratio)


@wp.func
def greatest_of_three(
    error_a: wp.float64,
    scale_a: wp.float64,
    error_b: wp.float64,
    scale_b: wp.float64,
    error_c: wp.float64,
    scale_c: wp.float64,
):
    """The greatest of three quotients, see :func:`greater`."""
    error, scale = greater(error_a, scale_a, error_b, scale_b)
    return greater(error, scale, error_c, scale_c)


@wp.func
def greatest_position_error(
    link: Link, theta: wp.float64, h: wp.float64, ex: wp.float64, ey: wp.float64, et: wp.float64
):
    """Greatest error of x, y and θ over its scale, as numerator and divisor.

    Quotients are compared by cross-multiplication, so that a single division remains.
    """
    return greatest_of_three(
        ex,
        error_scale(link.x, link.u, h),
        ey,
        error_scale(link.y, link.v, h),
        et,
        error_scale(theta, link.omega, h),
    )


@wp.func
def greatest_velocity_error(link: Link, first: Rates, h: wp.float64, eu: wp.float64, ev: wp.float64, ew: wp.float64):
    """Greatest error of u, v and ω over its scale, as numerator and divisor."""
    return greatest_of_three(
        eu,
        error_scale(link.u, first.x, h),
        ev,
        error_scale(link.v, first.y, h),
        ew,
        error_scale(link.omega, first.theta, h),
    )


@functools.cache
def block_stage(block_dim: int, tilts: bool = False):
    """Warp functions for blocks of this size: (exchange ends, evaluate a stage).

    Args:
        block_dim: Threads in a block.
        tilts: Whether the plane of the chain may move; what links feel of it lies on the board.

    Returns:
        ``exchange_ends(ends, place, link)`` → left end of the next link;
        ``stage(forces, K, place, next_end, link, 1/m, 1/I)`` → Rates.
    """

    @wp.func
    def exchange_ends(ends: wp.tile[vec5d, block_dim], place: Place, link: Link):
        left_x, left_y, _right_x, _right_y = end_positions(link.x, link.y, link.arm_x, link.arm_y)
        left_u, left_v, _right_u, _right_v = end_velocities(link.u, link.v, link.omega, link.arm_x, link.arm_y)
        ends[place.lane] = vec5d(left_x, left_y, left_u, left_v, link.omega)
        return ends[place.after]

    @wp.func
    def stage(
        forces: wp.tile[vec3d, block_dim],
        K: Rows,
        place: Place,
        next_end: vec5d,
        link: Link,
        inverse_mass: wp.float64,
        inverse_inertia: wp.float64,
    ):
        # constants are read from the board where they are needed: that costs less than registers
        chain = constants(K)
        _left_x, _left_y, right_x, right_y = end_positions(link.x, link.y, link.arm_x, link.arm_y)
        _left_u, _left_v, right_u, right_v = end_velocities(link.u, link.v, link.omega, link.arm_x, link.arm_y)
        cu = next_end[2] - right_u
        cv = next_end[3] - right_v
        spin = link.omega - next_end[4]
        force_x = joint_force(chain, next_end[0] - right_x, cu)
        force_y = joint_force(chain, next_end[1] - right_y, cv)
        torque = friction_torque(
            K[layout.VISCOUS, place.column], K[layout.COULOMB, place.column], spin, chain.inverse_smoothing
        )
        friction = torque * spin
        damping = cu * cu + cv * cv
        forces[place.lane] = vec3d(force_x, force_y, torque)
        left = forces[place.before]
        chain.gravity = ZERO
        if wp.static(not tilts):
            chain.gravity = constants(K).gravity
        rates = Rates()
        ax, ay, at = link_acceleration(
            chain,
            inverse_mass,
            inverse_inertia,
            link.arm_x,
            link.arm_y,
            left[0],
            left[1],
            force_x,
            force_y,
            left[2],
            torque,
        )
        if wp.static(tilts):
            felt = felt_plane(K, constants(K), wp.static(layout.VALUE_PLANE))
            load_x, load_y, load_turn = plane_load(felt, link.x, link.y, link.arm_x, link.arm_y)
            ax += load_x
            ay += load_y
            at += load_turn
        rates.x = ax
        rates.y = ay
        rates.theta = at
        rates.friction = friction
        rates.damping = damping
        return rates

    return exchange_ends, stage
