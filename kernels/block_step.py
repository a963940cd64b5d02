"""Embedded explicit Runge–Kutta methods in the block form: one thread per link, everything in registers.

The same stages as in :mod:`explicit`, for the same tableaus. A thread holds its link's state and stage accelerations
and works out the joint at its link's right end. In each stage it hands its left end to the link before and its joint's
force to the link after; two barriers a stage cost less than working out every joint twice.
"""

import functools

import warp as wp

from .controller import error_bits_single
from .elementary import LARGEST_TURN, ZERO
from .geometry import end_positions, end_velocities, turned_direction
from .joint import friction_torque, joint_force, link_acceleration
from .tableaus import TABLEAUS
from .types import Chain

wp.set_module_options({"enable_backward": False})

vec3d = wp.types.vector(length=3, dtype=wp.float64)
vec5d = wp.types.vector(length=5, dtype=wp.float64)


@wp.struct
class Link:
    """What a thread knows of its link; threads beyond the last link hold one that nothing acts upon."""

    x: wp.float64  # [m]
    y: wp.float64  # [m]
    theta: wp.float64  # [rad]
    u: wp.float64  # ẋ [m/s]
    v: wp.float64  # ẏ [m/s]
    omega: wp.float64  # θ̇ [rad/s]
    cosine: wp.float64
    sine: wp.float64


@wp.struct
class Place:
    """Where a thread stands in its block, and the constants of its link."""

    lane: wp.int32  # its link
    before: wp.int32  # the link to the left
    after: wp.int32  # the link to the right
    inverse_mass: wp.float64
    inverse_inertia: wp.float64


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
    friction: wp.float64
    damping: wp.float64
    worst: wp.int32  # error ratio times tolerance, as ordered bits of a single-precision number


@functools.cache
def block_method(name: str, block_dim: int):
    """Warp functions of one tableau for blocks of this size: (hand over ends, evaluate a stage, try a step).

    Args:
        name: Key of :data:`TABLEAUS`.
        block_dim: Threads in a block.

    Returns:
        ``hand_over(ends, place, chain, x, y, u, v, omega, cosine, sine)`` → left end of the next link;
        ``stage(forces, place, chain, next_end, x, y, u, v, omega, cosine, sine)`` → Rates;
        ``attempt(ends, forces, place, chain, link, first, h)`` → Trial.
    """
    tableau = TABLEAUS[name]
    stages = tableau.stages
    velocity, position, nodes = tableau.velocity, tableau.position, tableau.nodes
    velocity_weights, position_weights = tableau.velocity_weights, tableau.position_weights
    velocity_errors, position_errors = tableau.velocity_errors, tableau.position_errors
    Stages = wp.types.vector(length=stages, dtype=wp.float64)

    @wp.func
    def hand_over(
        ends: wp.tile[vec5d, block_dim],
        place: Place,
        chain: Chain,
        x: wp.float64,
        y: wp.float64,
        u: wp.float64,
        v: wp.float64,
        omega: wp.float64,
        cosine: wp.float64,
        sine: wp.float64,
    ):
        left_x, left_y, _right_x, _right_y = end_positions(chain, x, y, cosine, sine)
        left_u, left_v, _right_u, _right_v = end_velocities(chain, u, v, omega, cosine, sine)
        ends[place.lane] = vec5d(left_x, left_y, left_u, left_v, omega)
        return ends[place.after]

    @wp.func
    def stage(
        forces: wp.tile[vec3d, block_dim],
        place: Place,
        chain: Chain,
        next_end: vec5d,
        x: wp.float64,
        y: wp.float64,
        u: wp.float64,
        v: wp.float64,
        omega: wp.float64,
        cosine: wp.float64,
        sine: wp.float64,
    ):
        _left_x, _left_y, right_x, right_y = end_positions(chain, x, y, cosine, sine)
        _left_u, _left_v, right_u, right_v = end_velocities(chain, u, v, omega, cosine, sine)
        cu = next_end[2] - right_u
        cv = next_end[3] - right_v
        spin = omega - next_end[4]
        force_x = joint_force(chain, next_end[0] - right_x, cu)
        force_y = joint_force(chain, next_end[1] - right_y, cv)
        torque = friction_torque(chain, spin)
        forces[place.lane] = vec3d(force_x, force_y, torque)
        left = forces[place.before]
        rates = Rates()
        ax, ay, at = link_acceleration(
            chain,
            place.inverse_mass,
            place.inverse_inertia,
            cosine,
            sine,
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
        rates.friction = torque * spin
        rates.damping = chain.joint_damping * (cu * cu + cv * cv)
        return rates

    @wp.func
    def attempt(
        ends: wp.tile[vec5d, block_dim],
        forces: wp.tile[vec3d, block_dim],
        place: Place,
        chain: Chain,
        link: Link,
        first: Rates,
        h: wp.float64,
    ):
        hh = h * h
        ax = Stages()
        ay = Stages()
        at = Stages()
        ax[0] = first.x
        ay[0] = first.y
        at[0] = first.theta
        trial = Trial()
        rates = first
        friction = ZERO
        damping = ZERO
        if wp.static(velocity_weights[0] != 0.0):
            friction = wp.static(wp.float64(velocity_weights[0])) * first.friction
            damping = wp.static(wp.float64(velocity_weights[0])) * first.damping
        for s in range(1, wp.static(stages)):
            du = ZERO
            dv = ZERO
            dw = ZERO
            dx = ZERO
            dy = ZERO
            turn = ZERO
            for j in range(wp.static(s)):
                if wp.static(velocity[s][j] != 0.0):
                    du += wp.static(wp.float64(velocity[s][j])) * ax[j]
                    dv += wp.static(wp.float64(velocity[s][j])) * ay[j]
                    dw += wp.static(wp.float64(velocity[s][j])) * at[j]
                if wp.static(position[s][j] != 0.0):
                    dx += wp.static(wp.float64(position[s][j])) * ax[j]
                    dy += wp.static(wp.float64(position[s][j])) * ay[j]
                    turn += wp.static(wp.float64(position[s][j])) * at[j]
            ch = wp.static(wp.float64(nodes[s])) * h
            cosine, sine = turned_direction(link.cosine, link.sine, ch * link.omega + hh * turn)
            x = link.x + (ch * link.u + hh * dx)
            y = link.y + (ch * link.v + hh * dy)
            u = link.u + h * du
            v = link.v + h * dv
            omega = link.omega + h * dw
            next_end = hand_over(ends, place, chain, x, y, u, v, omega, cosine, sine)
            rates = stage(forces, place, chain, next_end, x, y, u, v, omega, cosine, sine)
            ax[s] = rates.x
            ay[s] = rates.y
            at[s] = rates.theta
            if wp.static(velocity_weights[s] != 0.0):
                friction += wp.static(wp.float64(velocity_weights[s])) * rates.friction
                damping += wp.static(wp.float64(velocity_weights[s])) * rates.damping
        # new state and error ratio
        du = ZERO
        dv = ZERO
        dw = ZERO
        dx = ZERO
        dy = ZERO
        turn = ZERO
        eu = ZERO
        ev = ZERO
        ew = ZERO
        ex = ZERO
        ey = ZERO
        et = ZERO
        for j in range(wp.static(stages)):
            if wp.static(velocity_weights[j] != 0.0):
                du += wp.static(wp.float64(velocity_weights[j])) * ax[j]
                dv += wp.static(wp.float64(velocity_weights[j])) * ay[j]
                dw += wp.static(wp.float64(velocity_weights[j])) * at[j]
            if wp.static(position_weights[j] != 0.0):
                dx += wp.static(wp.float64(position_weights[j])) * ax[j]
                dy += wp.static(wp.float64(position_weights[j])) * ay[j]
                turn += wp.static(wp.float64(position_weights[j])) * at[j]
            if wp.static(velocity_errors[j] != 0.0):
                eu += wp.static(wp.float64(velocity_errors[j])) * ax[j]
                ev += wp.static(wp.float64(velocity_errors[j])) * ay[j]
                ew += wp.static(wp.float64(velocity_errors[j])) * at[j]
            if wp.static(position_errors[j] != 0.0):
                ex += wp.static(wp.float64(position_errors[j])) * ax[j]
                ey += wp.static(wp.float64(position_errors[j])) * ay[j]
                et += wp.static(wp.float64(position_errors[j])) * at[j]
        trial.x = link.x + (h * link.u + hh * dx)
        trial.y = link.y + (h * link.v + hh * dy)
        trial.theta = link.theta + (h * link.omega + hh * turn)
        trial.u = link.u + h * du
        trial.v = link.v + h * dv
        trial.omega = link.omega + h * dw
        trial.last = rates
        trial.friction = friction
        trial.damping = damping
        worst = error_bits_single(hh * ex, link.x, link.u, h)
        worst = wp.max(worst, error_bits_single(hh * ey, link.y, link.v, h))
        worst = wp.max(worst, error_bits_single(hh * et, link.theta, link.omega, h))
        worst = wp.max(worst, error_bits_single(h * eu, link.u, first.x, h))
        worst = wp.max(worst, error_bits_single(h * ev, link.v, first.y, h))
        worst = wp.max(worst, error_bits_single(h * ew, link.omega, first.theta, h))
        trial.worst = worst
        return trial

    return hand_over, stage, attempt


@wp.func
def error_of(trial: Trial, link: Link, tolerance: wp.float64):
    """Error ratio of a link as ordered bits; a turn beyond the polynomials' range counts as an error of 2."""
    error = wp.cast(wp.cast(trial.worst, wp.float32) / wp.float32(tolerance), wp.int32)
    if wp.abs(trial.theta - link.theta) > LARGEST_TURN:
        error = wp.max(error, wp.cast(wp.float32(2.0), wp.int32))
    return error
