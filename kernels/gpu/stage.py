"""A stage on springs, one thread per link, and the structs of a step: run, proximity, attempt.

A thread evaluates the joint at its link's right end. In each stage it passes its left end to the previous link and its
joint's force to the next one. Two barriers a stage cost less than evaluating every joint twice.

Registers are scarce: spills go to local memory, and large shared memory leaves little L1 cache for them. So the chain's
constants lie on the board and are read where they are needed.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.kernels.physics import geometry
from warpchain.kernels.physics.elementary import order_bits_single, quick_quotient
from warpchain.kernels.physics.geometry import Link, end_positions, end_velocities
from warpchain.kernels.physics.joint import friction_torque, joint_force, link_acceleration
from warpchain.kernels.physics.plane import on_plane
from warpchain.kernels.types import Chain, Ground, Integers, Row, Rows

LARGEST_SCALE = wp.constant(wp.float32(1e30))
"""Divisors are reduced to this, because :func:`quick_quotient` is 0 beyond 2¹²⁶; the ratio only grows."""

vec3d = wp.types.vector(length=3, dtype=wp.float64)
vec5d = wp.types.vector(length=5, dtype=wp.float64)


@wp.struct
class Run:
    """A thread's view of its block: which world it carries on, memory of all its threads, its own link."""

    ground: Ground
    world: wp.int32
    K: Rows  # the board
    kept: Rows  # rows of the scratch, of which some are kept between launches
    L: Integers  # the neighbour list
    T: Integers  # of the contacts, see TouchLayout
    P: Row  # the plane of the chain, if it tilts; the first thread changes it
    stored_plane: Row  # where that lies between launches
    # memory in which stages exchange ends and forces; between them contacts use it as E and F, sums over the links as M
    E: Rows
    F: Rows
    M: Row
    maxima: wp.uint64  # for :func:`gpu.threads.block_maxima`
    lane: wp.int32  # its link
    column: wp.int32  # its link, or the last one for threads without a link
    before: wp.int32  # the link to the left
    after: wp.int32  # the link to the right
    links: wp.int32  # number of links of the chain


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

    place: vec3d  # x, y [m], θ [rad]
    velocity: vec3d  # their rates
    last: vec5d
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
    return geometry.read_link(K, constants(K), column)


@wp.func
def read_first_stage(K: Rows, column: int) -> vec5d:
    """A link's first stage, from the board."""
    first = vec5d()
    for k in range(wp.static(layout.STAGE_ROWS)):
        first[k] = K[layout.BOARD_FIRST + k, column]
    return first


@wp.func
def felt_plane(run: Run) -> Chain:
    """The chain on the plane that its links feel in this step."""
    return on_plane(constants(run.K), run.P, layout.PLANE_MID)


@wp.func
def error_of(result: Attempt, tolerance: wp.float64):
    """Error ratio of a link as ordered bits, NaN above all numbers; turning too far counts as a ratio of 2."""
    scale = wp.float32(result.scale * tolerance)
    ratio = quick_quotient(wp.float32(wp.abs(result.error)), wp.where(scale > LARGEST_SCALE, LARGEST_SCALE, scale))
    if result.turns_far and ratio < wp.float32(2.0):
        ratio = wp.float32(2.0)
    return order_bits_single(ratio)


@functools.cache
def block_stage(features: Features, block_dim: int):
    """Warp functions for blocks of this size: (exchange ends, evaluate a stage).

    ``exchange_ends(ends, run, link)`` → left end of the next link. ``stage(forces, run, next_end, link, 1/m, 1/I)`` →
    rates: accelerations ẍ, ÿ [m/s²] and θ̈ [rad/s²] of the link, power [W] lost in its right joint by friction, and by
    damping, divided by the joint's b.
    """
    load = features.acceleration

    @wp.func
    def exchange_ends(ends: wp.tile[vec5d, block_dim], run: Run, link: Link):
        left_x, left_y, _right_x, _right_y = end_positions(link.x, link.y, link.arm_x, link.arm_y)
        left_u, left_v, _right_u, _right_v = end_velocities(link.u, link.v, link.omega, link.arm_x, link.arm_y)
        ends[run.lane] = vec5d(left_x, left_y, left_u, left_v, link.omega)
        return ends[run.after]

    @wp.func
    def stage(
        forces: wp.tile[vec3d, block_dim],
        run: Run,
        next_end: vec5d,
        link: Link,
        inverse_mass: wp.float64,
        inverse_inertia: wp.float64,
    ):
        # constants are read from the board where they are needed: that costs less than registers
        K = run.K
        chain = constants(K)
        _left_x, _left_y, right_x, right_y = end_positions(link.x, link.y, link.arm_x, link.arm_y)
        _left_u, _left_v, right_u, right_v = end_velocities(link.u, link.v, link.omega, link.arm_x, link.arm_y)
        cu = next_end[2] - right_u
        cv = next_end[3] - right_v
        spin = link.omega - next_end[4]
        force_x = joint_force(chain, next_end[0] - right_x, cu)
        force_y = joint_force(chain, next_end[1] - right_y, cv)
        column = run.column
        torque = friction_torque(K[layout.VISCOUS, column], K[layout.COULOMB, column], spin, chain.inverse_smoothing)
        friction = torque * spin
        damping = cu * cu + cv * cv
        right = vec3d(force_x, force_y, torque)
        forces[run.lane] = right
        arm = wp.vec2d(link.arm_x, link.arm_y)
        ax, ay, at = link_acceleration(inverse_mass, inverse_inertia, arm, forces[run.before], right)
        felt = constants(K)
        if wp.static(features.tilts):
            felt = felt_plane(run)
        load_x, load_y, load_turn = load(felt, run.lane, link, inverse_mass, inverse_inertia)
        return vec5d(ax + load_x, ay + load_y, at + load_turn, friction, damping)

    return exchange_ends, stage
