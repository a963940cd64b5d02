"""Embedded explicit Runge–Kutta methods in the block form: one thread per link, stages in registers.

The same stages as in :mod:`explicit`, for the same tableaus. A thread holds its link's stage accelerations and works
out the joint at its link's right end. In each stage it hands its left end to the link before and its joint's force to
the link after; two barriers a stage cost less than working out every joint twice.

In every stage the threads wait for the friction of their joints. Meanwhile they work out where they are in the next
one: in the Nyström form that does not depend on the stage in hand.

Registers are dear: what does not fit goes to local memory, for which shared memory leaves hardly any cache. So the
constants of the chain lie on the board and are read where they are needed; with many stages in registers, so is the
state of the link.
"""

import functools

import warp as wp

from .controller import error_scale
from .elementary import LARGEST_TURN, ZERO, cos_sin, order_bits_single
from .geometry import end_positions, end_velocities, turned_direction
from .joint import friction_torque, joint_force, link_acceleration
from .layout import (
    BOARD_FIRST,
    BOARD_NOTES,
    COSINE,
    INVERSE_INERTIA,
    INVERSE_MASS,
    NOTE_COULOMB,
    NOTE_DAMPING,
    NOTE_GRAVITY,
    NOTE_HALF_LENGTH,
    NOTE_INVERSE_SMOOTHING,
    NOTE_STIFFNESS,
    NOTE_VISCOUS,
    OMEGA,
    SINE,
    THETA,
    U,
    V,
    X,
    Y,
)
from .tableaus import TABLEAUS
from .types import Chain

wp.set_module_options({"enable_backward": False})

vec3d = wp.types.vector(length=3, dtype=wp.float64)
vec5d = wp.types.vector(length=5, dtype=wp.float64)


@wp.struct
class Link:
    """State of a link but for its angle, which no stage needs."""

    x: wp.float64  # [m]
    y: wp.float64  # [m]
    u: wp.float64  # ẋ [m/s]
    v: wp.float64  # ẏ [m/s]
    omega: wp.float64  # θ̇ [rad/s]
    cosine: wp.float64
    sine: wp.float64


@wp.struct
class Place:
    """Where a thread stands in its block."""

    lane: wp.int32  # its link
    column: wp.int32  # the same, of the last link for threads beyond
    before: wp.int32  # the link to the left
    after: wp.int32  # the link to the right
    links: wp.int32  # how many the chain has


@wp.struct
class Rates:
    """A stage: accelerations of the link, and the power [W] lost in its right joint."""

    x: wp.float64
    y: wp.float64
    theta: wp.float64
    friction: wp.float64
    damping: wp.float64


@wp.struct
class Trial:
    """A finished try: the link's new state, its last stage, and powers averaged over the step."""

    x: wp.float64
    y: wp.float64
    theta: wp.float64
    u: wp.float64
    v: wp.float64
    omega: wp.float64
    last: Rates
    next_end: vec5d  # left end of the next link in the last stage
    cosine: wp.float64  # direction of the new state
    sine: wp.float64
    friction: wp.float64
    damping: wp.float64
    error: wp.float32  # greatest error times tolerance, a quotient not yet divided, and …
    scale: wp.float32  # … its divisor
    turns_far: bool  # further than the method allows in one step


@wp.func
def link_on(K: wp.array2d(dtype=wp.float64), column: int) -> Link:
    """A link as it stands on the board."""
    link = Link()
    link.x = K[X, column]
    link.y = K[Y, column]
    link.u = K[U, column]
    link.v = K[V, column]
    link.omega = K[OMEGA, column]
    link.cosine = K[COSINE, column]
    link.sine = K[SINE, column]
    return link


@wp.func
def note_first(K: wp.array2d(dtype=wp.float64), column: int, first: Rates, with_powers: bool):
    """Puts a link's first stage of the next step on the board."""
    K[BOARD_FIRST, column] = first.x
    K[BOARD_FIRST + 1, column] = first.y
    K[BOARD_FIRST + 2, column] = first.theta
    if with_powers:
        K[BOARD_FIRST + 3, column] = first.friction
        K[BOARD_FIRST + 4, column] = first.damping


@wp.func
def first_on(K: wp.array2d(dtype=wp.float64), column: int) -> Rates:
    """A link's first stage as it stands on the board, with powers if they were noted."""
    first = Rates()
    first.x = K[BOARD_FIRST, column]
    first.y = K[BOARD_FIRST + 1, column]
    first.theta = K[BOARD_FIRST + 2, column]
    first.friction = K[BOARD_FIRST + 3, column]
    first.damping = K[BOARD_FIRST + 4, column]
    return first


@wp.func
def joint_constants(K: wp.array2d(dtype=wp.float64)) -> Chain:
    """What joints need of a chain, but for gravity, from the board."""
    chain = Chain()
    chain.half_length = K[BOARD_NOTES, NOTE_HALF_LENGTH]
    chain.joint_stiffness = K[BOARD_NOTES, NOTE_STIFFNESS]
    chain.joint_damping = K[BOARD_NOTES, NOTE_DAMPING]
    chain.viscous_friction = K[BOARD_NOTES, NOTE_VISCOUS]
    chain.coulomb_friction = K[BOARD_NOTES, NOTE_COULOMB]
    chain.inverse_smoothing = K[BOARD_NOTES, NOTE_INVERSE_SMOOTHING]
    return chain


@wp.func
def greater(error_a: wp.float32, scale_a: wp.float32, error_b: wp.float32, scale_b: wp.float32):
    """The greater of two quotients |error| / scale with positive scales, a NaN before any number."""
    keeps_a = wp.abs(error_a) * scale_b >= wp.abs(error_b) * scale_a or error_a != error_a
    return wp.where(keeps_a, error_a, error_b), wp.where(keeps_a, scale_a, scale_b)


@wp.func
def error_of(trial: Trial, tolerance: wp.float64):
    """Error ratio of a link as ordered bits, a NaN above all numbers; turning too far counts as an error of 2."""
    ratio = wp.abs(trial.error) / (trial.scale * wp.float32(tolerance))
    if trial.turns_far and ratio < wp.float32(2.0):
        ratio = wp.float32(2.0)
    return order_bits_single(ratio)


@wp.func
def greatest_of_three(
    error_a: wp.float32,
    scale_a: wp.float32,
    error_b: wp.float32,
    scale_b: wp.float32,
    error_c: wp.float32,
    scale_c: wp.float32,
):
    """The greatest of three such quotients."""
    error, scale = greater(error_a, scale_a, error_b, scale_b)
    return greater(error, scale, error_c, scale_c)


@wp.func
def greatest_position_error(
    link: Link, theta: wp.float64, h: wp.float64, ex: wp.float64, ey: wp.float64, et: wp.float64
):
    """The greatest error of x, y and θ over its scale, as a quotient not yet divided.

    Found by cross-multiplication, so that only one needs a division.
    """
    return greatest_of_three(
        wp.float32(ex),
        error_scale(link.x, link.u, h),
        wp.float32(ey),
        error_scale(link.y, link.v, h),
        wp.float32(et),
        error_scale(theta, link.omega, h),
    )


@wp.func
def greatest_velocity_error(link: Link, first: Rates, h: wp.float64, eu: wp.float64, ev: wp.float64, ew: wp.float64):
    """The same of u, v and ω."""
    return greatest_of_three(
        wp.float32(eu),
        error_scale(link.u, first.x, h),
        wp.float32(ev),
        error_scale(link.v, first.y, h),
        wp.float32(ew),
        error_scale(link.omega, first.theta, h),
    )


@wp.func
def greatest_error(
    link: Link,
    theta: wp.float64,
    first: Rates,
    h: wp.float64,
    ex: wp.float64,
    ey: wp.float64,
    et: wp.float64,
    eu: wp.float64,
    ev: wp.float64,
    ew: wp.float64,
):
    """The greatest of all six."""
    error_p, scale_p = greatest_position_error(link, theta, h, ex, ey, et)
    error_v, scale_v = greatest_velocity_error(link, first, h, eu, ev, ew)
    return greater(error_p, scale_p, error_v, scale_v)


@functools.cache
def block_stage(block_dim: int):
    """Warp functions for blocks of this size: (hand over ends, evaluate a stage).

    Args:
        block_dim: Threads in a block.

    Returns:
        ``hand_over(ends, K, place, link)`` → left end of the next link;
        ``stage(forces, K, place, next_end, link, 1/m, 1/I)`` → Rates.
    """

    @wp.func
    def hand_over(
        ends: wp.tile[vec5d, block_dim],
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        link: Link,
    ):
        chain = Chain()
        chain.half_length = K[BOARD_NOTES, NOTE_HALF_LENGTH]
        left_x, left_y, _right_x, _right_y = end_positions(chain, link.x, link.y, link.cosine, link.sine)
        left_u, left_v, _right_u, _right_v = end_velocities(chain, link.u, link.v, link.omega, link.cosine, link.sine)
        ends[place.lane] = vec5d(left_x, left_y, left_u, left_v, link.omega)
        return ends[place.after]

    @wp.func
    def stage(
        forces: wp.tile[vec3d, block_dim],
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        next_end: vec5d,
        link: Link,
        inverse_mass: wp.float64,
        inverse_inertia: wp.float64,
    ):
        # constants are read from the board where they are needed: registers are dearer than such reads
        chain = joint_constants(K)
        _left_x, _left_y, right_x, right_y = end_positions(chain, link.x, link.y, link.cosine, link.sine)
        _left_u, _left_v, right_u, right_v = end_velocities(chain, link.u, link.v, link.omega, link.cosine, link.sine)
        cu = next_end[2] - right_u
        cv = next_end[3] - right_v
        spin = link.omega - next_end[4]
        force_x = joint_force(chain, next_end[0] - right_x, cu)
        force_y = joint_force(chain, next_end[1] - right_y, cv)
        torque = friction_torque(chain, spin)
        friction = torque * spin
        damping = chain.joint_damping * (cu * cu + cv * cv)
        forces[place.lane] = vec3d(force_x, force_y, torque)
        left = forces[place.before]
        chain.gravity = K[BOARD_NOTES, NOTE_GRAVITY]
        rates = Rates()
        ax, ay, at = link_acceleration(
            chain,
            inverse_mass,
            inverse_inertia,
            link.cosine,
            link.sine,
            left[0],
            left[1],
            force_x,
            force_y,
            left[2],
            torque,
        )
        rates.x = ax
        rates.y = ay
        rates.theta = at
        rates.friction = friction
        rates.damping = damping
        return rates

    return hand_over, stage


@wp.struct
class Ahead:
    """What is known of a stage, or of the new state, before the stage that precedes it."""

    x: wp.float64  # [m]
    y: wp.float64  # [m]
    turn: wp.float64  # since the step began [rad]
    u: wp.float64  # sums Σ a_ij k_j so far; …
    v: wp.float64
    omega: wp.float64  # … they lack the term of the preceding stage


FEW_STAGES = 7
"""Most stages with which the state of a link stays in registers and the next stage is begun ahead.

It saves 5 to 9 % of a try with dp5 and 60 links. With the 13 stages of rkf78 and 150 links, which have fewer registers,
it would cost 10 to 14 % (H100, 1 to 4000 chains).
"""


@functools.cache
def explicit_attempt(name: str, block_dim: int):
    """Warp function that tries a step with a tableau in blocks of this size.

    Args:
        name: Key of :data:`TABLEAUS`.
        block_dim: Threads in a block.

    Returns:
        ``attempt(ends, forces, S, K, place, h, tolerance)`` → Trial, from the state and first stage on the board;
        it needs neither the memory S nor the tolerance.
    """
    tableau = TABLEAUS[name]
    stages, last = tableau.stages, tableau.stages - 1
    reuses_last, has_room = tableau.first_same_as_last, tableau.stages <= FEW_STAGES
    velocity_weights = tableau.velocity_weights
    velocity_errors, position_errors = tableau.velocity_errors, tableau.position_errors
    # the new state is one more row of the tableau
    velocity = (*tableau.velocity, velocity_weights)
    position = (*tableau.position, tableau.position_weights)
    nodes = (*tableau.nodes, 1.0)
    hand_over, stage = block_stage(block_dim)
    Stages = wp.types.vector(length=stages, dtype=wp.float64)

    def look_ahead(s: int):
        """Warp function ``ahead(link, h, ax, ay, at)`` → Ahead of row s, from the accelerations before row s − 1."""

        @wp.func
        def ahead(link: Link, h: wp.float64, ax: Stages, ay: Stages, at: Stages):
            row = Ahead()
            dx = ZERO
            dy = ZERO
            turn = ZERO
            for j in range(wp.static(s - 1)):
                if wp.static(velocity[s][j] != 0.0):
                    row.u += wp.static(wp.float64(velocity[s][j])) * ax[j]
                    row.v += wp.static(wp.float64(velocity[s][j])) * ay[j]
                    row.omega += wp.static(wp.float64(velocity[s][j])) * at[j]
                if wp.static(position[s][j] != 0.0):
                    dx += wp.static(wp.float64(position[s][j])) * ax[j]
                    dy += wp.static(wp.float64(position[s][j])) * ay[j]
                    turn += wp.static(wp.float64(position[s][j])) * at[j]
            ch = wp.static(wp.float64(nodes[s])) * h
            row.x = link.x + (ch * link.u + h * h * dx)
            row.y = link.y + (ch * link.v + h * h * dy)
            row.turn = ch * link.omega + h * h * turn
            return row

        return ahead

    rows = [None, *map(look_ahead, range(1, stages + 1))]

    @wp.func
    def attempt(
        ends: wp.tile[vec5d, block_dim],
        forces: wp.tile[vec3d, block_dim],
        S: wp.uint64,
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        h: wp.float64,
        tolerance: wp.float64,
    ):
        lane = place.lane
        ax = Stages()
        ay = Stages()
        at = Stages()
        link = link_on(K, lane)
        inverse_mass = K[INVERSE_MASS, place.column]
        inverse_inertia = K[INVERSE_INERTIA, place.column]
        first = first_on(K, lane)
        ax[0] = first.x
        ay[0] = first.y
        at[0] = first.theta
        trial = Trial()
        if wp.static(velocity_weights[0] != 0.0):
            trial.friction = wp.static(wp.float64(velocity_weights[0])) * first.friction
            trial.damping = wp.static(wp.float64(velocity_weights[0])) * first.damping
        row = wp.static(rows[1])(link, h, ax, ay, at)
        error = wp.float32(0.0)
        scale = wp.float32(1.0)
        eu = ZERO
        ev = ZERO
        ew = ZERO
        for s in range(1, wp.static(stages)):
            if wp.static(s > 1 and not has_room):
                link = link_on(K, lane)
                row = wp.static(rows[s])(link, h, ax, ay, at)
            there = Link()
            there.x = row.x
            there.y = row.y
            cosine, sine = turned_direction(link.cosine, link.sine, row.turn)
            there.cosine = cosine
            there.sine = sine
            if wp.static(velocity[s][s - 1] != 0.0):
                row.u += wp.static(wp.float64(velocity[s][s - 1])) * ax[s - 1]
                row.v += wp.static(wp.float64(velocity[s][s - 1])) * ay[s - 1]
                row.omega += wp.static(wp.float64(velocity[s][s - 1])) * at[s - 1]
            there.u = link.u + h * row.u
            there.v = link.v + h * row.v
            there.omega = link.omega + h * row.omega
            next_end = hand_over(ends, K, place, there)
            # what does not depend on this stage, while its friction is worked out
            if wp.static((s < last and has_room) or (s == last and not reuses_last)):
                row = wp.static(rows[s + 1])(link, h, ax, ay, at)
            if wp.static(s == last):
                ex = ZERO
                ey = ZERO
                et = ZERO
                for j in range(wp.static(last)):
                    if wp.static(velocity_errors[j] != 0.0):
                        eu += wp.static(wp.float64(velocity_errors[j])) * ax[j]
                        ev += wp.static(wp.float64(velocity_errors[j])) * ay[j]
                        ew += wp.static(wp.float64(velocity_errors[j])) * at[j]
                    if wp.static(position_errors[j] != 0.0):
                        ex += wp.static(wp.float64(position_errors[j])) * ax[j]
                        ey += wp.static(wp.float64(position_errors[j])) * ay[j]
                        et += wp.static(wp.float64(position_errors[j])) * at[j]
                theta = K[THETA, lane]
                error, scale = greatest_position_error(link, theta, h, h * h * ex, h * h * ey, h * h * et)
                trial.x = row.x
                trial.y = row.y
                trial.theta = theta + row.turn
                trial.turns_far = wp.abs(row.turn) > LARGEST_TURN
                new_cosine, new_sine = cos_sin(trial.theta)
                trial.cosine = new_cosine
                trial.sine = new_sine
                trial.next_end = next_end
            if wp.static(not has_room):
                inverse_mass = K[INVERSE_MASS, place.column]
                inverse_inertia = K[INVERSE_INERTIA, place.column]
            rates = stage(forces, K, place, next_end, there, inverse_mass, inverse_inertia)
            ax[s] = rates.x
            ay[s] = rates.y
            at[s] = rates.theta
            if wp.static(velocity_weights[s] != 0.0):
                trial.friction += wp.static(wp.float64(velocity_weights[s])) * rates.friction
                trial.damping += wp.static(wp.float64(velocity_weights[s])) * rates.damping
            if wp.static(s == last):
                trial.last = rates
        link = link_on(K, lane)
        if wp.static(not reuses_last and velocity_weights[last] != 0.0):
            row.u += wp.static(wp.float64(velocity_weights[last])) * trial.last.x
            row.v += wp.static(wp.float64(velocity_weights[last])) * trial.last.y
            row.omega += wp.static(wp.float64(velocity_weights[last])) * trial.last.theta
        trial.u = link.u + h * row.u
        trial.v = link.v + h * row.v
        trial.omega = link.omega + h * row.omega
        if wp.static(velocity_errors[last] != 0.0):
            eu += wp.static(wp.float64(velocity_errors[last])) * trial.last.x
            ev += wp.static(wp.float64(velocity_errors[last])) * trial.last.y
            ew += wp.static(wp.float64(velocity_errors[last])) * trial.last.theta
        error_v, scale_v = greatest_velocity_error(link, first_on(K, lane), h, h * eu, h * ev, h * ew)
        error, scale = greater(error, scale, error_v, scale_v)
        trial.error = error
        trial.scale = scale
        return trial

    return attempt
