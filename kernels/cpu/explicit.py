"""Embedded explicit Runge–Kutta methods: one loop over stages for every tableau.

One CPU thread carries a chain. K is the chain's scratch: an array with a row for each quantity and a column for each
link or joint, see :mod:`layout`. Loops over links have the form that clang vectorises: ``while`` loops with an integer
of their own, one array of static shape, no branch and no library call inside.
"""

import functools
from typing import Any

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import STAGE_ROWS, STAGES, U, V, X, Y
from warpchain.kernels.methods.controller import error_bits
from warpchain.kernels.methods.explicit_tableaus import Tableau
from warpchain.kernels.physics.elementary import LARGEST_TURN, TWO, ZERO, cos_sin, order_bits
from warpchain.kernels.physics.geometry import Link, end_positions, end_velocities, turned, whole_lanes
from warpchain.kernels.physics.joint import friction_torque, joint_force, link_acceleration
from warpchain.kernels.types import Chain, Rows


@wp.func
def write_ends(K: Rows, i: int, x: wp.float64, y: wp.float64, arm_x: wp.float64, arm_y: wp.float64):
    """End positions of link i."""
    left_x, left_y, right_x, right_y = end_positions(x, y, arm_x, arm_y)
    K[layout.LEFT_X, i] = left_x
    K[layout.LEFT_Y, i] = left_y
    K[layout.RIGHT_X, i] = right_x
    K[layout.RIGHT_Y, i] = right_y


@wp.func
def write_motion(K: Rows, i: int, u: wp.float64, v: wp.float64, w: wp.float64, arm_x: wp.float64, arm_y: wp.float64):
    """Arm, spin and end velocities of link i in a stage."""
    K[layout.STAGE_ARM_X, i] = arm_x
    K[layout.STAGE_ARM_Y, i] = arm_y
    K[layout.STAGE_SPIN, i] = w
    left_u, left_v, right_u, right_v = end_velocities(u, v, w, arm_x, arm_y)
    K[layout.LEFT_U, i] = left_u
    K[layout.LEFT_V, i] = left_v
    K[layout.RIGHT_U, i] = right_u
    K[layout.RIGHT_V, i] = right_v


@wp.func
def place_ends(K: Rows, chain: Chain):
    """Directions and end positions of the links, exactly, from the state rows."""
    n = chain.link_count
    lanes = whole_lanes(n)
    a = chain.half_length
    i = int(0)
    while i < lanes:
        c, s = cos_sin(K[layout.THETA, i])
        K[layout.COSINE, i] = c
        K[layout.SINE, i] = s
        write_ends(K, i, K[X, i], K[Y, i], a * c, a * s)
        i += 1
    K[layout.LEFT_X, n] = K[layout.LEFT_X, 0]
    K[layout.LEFT_Y, n] = K[layout.LEFT_Y, 0]


@wp.func
def begin_stages(K: Rows, chain: Chain):
    """Rows of the first stage from the state: arms, spins, end velocities; :func:`place_ends` has placed the ends."""
    n = chain.link_count
    lanes = whole_lanes(n)
    a = chain.half_length
    i = int(0)
    while i < lanes:
        write_motion(K, i, K[U, i], K[V, i], K[layout.OMEGA, i], a * K[layout.COSINE, i], a * K[layout.SINE, i])
        i += 1
    K[layout.LEFT_U, n] = K[layout.LEFT_U, 0]
    K[layout.LEFT_V, n] = K[layout.LEFT_V, 0]
    K[layout.STAGE_SPIN, n] = K[layout.STAGE_SPIN, 0]


@wp.func
def link_in_stage(K: Rows, i: int) -> Link:
    """A link in a stage, whose ends are placed."""
    link = Link()
    link.arm_x = K[layout.STAGE_ARM_X, i]
    link.arm_y = K[layout.STAGE_ARM_Y, i]
    link.omega = K[layout.STAGE_SPIN, i]
    link.x = K[layout.RIGHT_X, i] - link.arm_x
    link.y = K[layout.RIGHT_Y, i] - link.arm_y
    link.u = K[layout.RIGHT_U, i] + link.omega * link.arm_y
    link.v = K[layout.RIGHT_V, i] - link.omega * link.arm_x
    return link


def sums_over_stages(velocity: tuple[float, ...], position: tuple[float, ...]):
    """Warp function ``sums(K, i)``: Σ w_j (ẍ, ÿ, θ̈)_j of link i over the stages, for either row of weights w.

    One function of three sums for each row instead made clang fuse other products with sums: walks rounded otherwise.
    """

    @wp.func
    def sums(K: Rows, i: int):
        du = ZERO
        dv = ZERO
        dw = ZERO
        dx = ZERO
        dy = ZERO
        turn = ZERO
        for j in range(wp.static(len(velocity))):
            if wp.static(velocity[j] != 0.0):
                du += wp.static(wp.float64(velocity[j])) * K[wp.static(STAGES + STAGE_ROWS * j), i]
                dv += wp.static(wp.float64(velocity[j])) * K[wp.static(STAGES + STAGE_ROWS * j + 1), i]
                dw += wp.static(wp.float64(velocity[j])) * K[wp.static(STAGES + STAGE_ROWS * j + 2), i]
            if wp.static(position[j] != 0.0):
                dx += wp.static(wp.float64(position[j])) * K[wp.static(STAGES + STAGE_ROWS * j), i]
                dy += wp.static(wp.float64(position[j])) * K[wp.static(STAGES + STAGE_ROWS * j + 1), i]
                turn += wp.static(wp.float64(position[j])) * K[wp.static(STAGES + STAGE_ROWS * j + 2), i]
        return du, dv, dw, dx, dy, turn

    return sums


@functools.cache
def explicit_method(tableau: Tableau, acceleration: Any):
    """Warp functions of one tableau and a load: (evaluate the first stage, attempt a step, commit it).

    ``first_stage(K, chain)``, ``attempt(K, chain, h, tolerance)`` → bits of the greatest error ratio (see
    :func:`order_bits`), ``commit(K, chain, h)``. On a plane that may move ``chain`` is on that of mid-step.
    """
    stages = tableau.stages
    reuses_last = tableau.first_same_as_last
    nodes, velocity_weights = tableau.nodes, tableau.velocity_weights
    stage_sums = [sums_over_stages(*rows) for rows in zip(tableau.velocity, tableau.position, strict=True)]
    new_state = sums_over_stages(velocity_weights, tableau.position_weights)
    errors = sums_over_stages(tableau.velocity_errors, tableau.position_errors)
    last_row = STAGES + STAGE_ROWS * (stages - 1)
    power_needed = tuple(
        weight != 0.0 or (reuses_last and velocity_weights[0] != 0.0 and stage == stages - 1)
        for stage, weight in enumerate(velocity_weights)
    )

    @wp.func
    def derivatives(K: Rows, chain: Chain, row: int, needs_power: bool):
        n = chain.link_count
        lanes = whole_lanes(n)
        i = int(0)
        while i < lanes:
            cx = K[layout.LEFT_X, i + 1] - K[layout.RIGHT_X, i]
            cy = K[layout.LEFT_Y, i + 1] - K[layout.RIGHT_Y, i]
            cu = K[layout.LEFT_U, i + 1] - K[layout.RIGHT_U, i]
            cv = K[layout.LEFT_V, i + 1] - K[layout.RIGHT_V, i]
            spin = K[layout.STAGE_SPIN, i] - K[layout.STAGE_SPIN, i + 1]
            torque = friction_torque(K[layout.VISCOUS, i], K[layout.COULOMB, i], spin, chain.inverse_smoothing)
            K[layout.FORCE_X, i + 1] = joint_force(chain, cx, cu)
            K[layout.FORCE_Y, i + 1] = joint_force(chain, cy, cv)
            K[layout.TORQUE, i + 1] = torque
            if needs_power:
                K[row + 3, i] = torque * spin
                K[row + 4, i] = chain.joint_damping * (cu * cu + cv * cv)
            i += 1
        K[layout.FORCE_X, 0] = K[layout.FORCE_X, n]
        K[layout.FORCE_Y, 0] = K[layout.FORCE_Y, n]
        K[layout.TORQUE, 0] = K[layout.TORQUE, n]
        i = int(0)
        while i < lanes:
            ax, ay, spin_rate = link_acceleration(
                K[layout.INVERSE_MASS, i],
                K[layout.INVERSE_INERTIA, i],
                K[layout.STAGE_ARM_X, i],
                K[layout.STAGE_ARM_Y, i],
                K[layout.FORCE_X, i],
                K[layout.FORCE_Y, i],
                K[layout.FORCE_X, i + 1],
                K[layout.FORCE_Y, i + 1],
                K[layout.TORQUE, i],
                K[layout.TORQUE, i + 1],
            )
            load_x, load_y, load_turn = acceleration(
                chain, i, link_in_stage(K, i), K[layout.INVERSE_MASS, i], K[layout.INVERSE_INERTIA, i]
            )
            K[row, i] = ax + load_x
            K[row + 1, i] = ay + load_y
            K[row + 2, i] = spin_rate + load_turn
            i += 1

    @wp.func
    def first_stage(K: Rows, chain: Chain):
        begin_stages(K, chain)
        derivatives(K, chain, wp.static(STAGES), wp.static(power_needed[0]))

    @wp.func
    def attempt(K: Rows, chain: Chain, h: wp.float64, tolerance: wp.float64):
        n = chain.link_count
        lanes = whole_lanes(n)
        a = chain.half_length
        hh = h * h
        for s in range(1, wp.static(stages)):
            ch = wp.static(wp.float64(nodes[s])) * h
            i = int(0)
            while i < lanes:
                du, dv, dw, dx, dy, turn = wp.static(stage_sums[s])(K, i)
                turn = ch * K[layout.OMEGA, i] + hh * turn
                arm_x, arm_y = turned(a * K[layout.COSINE, i], a * K[layout.SINE, i], turn)
                x = K[X, i] + (ch * K[U, i] + hh * dx)
                y = K[Y, i] + (ch * K[V, i] + hh * dy)
                u = K[U, i] + h * du
                v = K[V, i] + h * dv
                w = K[layout.OMEGA, i] + h * dw
                write_ends(K, i, x, y, arm_x, arm_y)
                write_motion(K, i, u, v, w, arm_x, arm_y)
                i += 1
            K[layout.LEFT_X, n] = K[layout.LEFT_X, 0]
            K[layout.LEFT_Y, n] = K[layout.LEFT_Y, 0]
            K[layout.LEFT_U, n] = K[layout.LEFT_U, 0]
            K[layout.LEFT_V, n] = K[layout.LEFT_V, 0]
            K[layout.STAGE_SPIN, n] = K[layout.STAGE_SPIN, 0]
            derivatives(K, chain, wp.static(STAGES + STAGE_ROWS * s), wp.static(power_needed[s]))
        # new state and error ratio
        i = int(0)
        while i < lanes:
            change = new_state(K, i)
            error = errors(K, i)
            # Take the maximum over components, not the sum. Compare the floats' bits as integers, where NaN is
            # greatest.
            worst = wp.int64(0)
            for k in range(3):
                place = K[X + k, i]
                rate = K[U + k, i]
                K[layout.NEW_X + k, i] = place + (h * rate + hh * change[wp.static(3 + k)])
                K[layout.NEW_U + k, i] = rate + h * change[k]
                worst = wp.max(worst, error_bits(hh * error[wp.static(3 + k)], place, rate, h))
                worst = wp.max(worst, error_bits(h * error[k], rate, K[STAGES + k, i], h))
            worst = wp.where(i < n, worst, wp.int64(0))
            K[layout.ERROR, i] = wp.cast(worst, wp.float64) / tolerance  # wp.cast reads the bits back as a float
            i += 1
        # maxima over links: the longest turn and the greatest error ratio, as bits
        furthest = wp.int64(0)
        greatest = wp.int64(0)
        i = int(0)
        while i < lanes:
            greatest = wp.max(greatest, order_bits(K[layout.ERROR, i]))
            furthest = wp.max(furthest, order_bits(K[layout.NEW_THETA, i] - K[layout.THETA, i]))
            i += 1
        # a turn beyond the polynomials' range counts as an error of 2: the step shrinks
        if wp.cast(furthest, wp.float64) > LARGEST_TURN:
            greatest = wp.max(greatest, order_bits(TWO))
        return greatest

    @wp.func
    def commit(K: Rows, chain: Chain, h: wp.float64):
        n = chain.link_count
        lanes = whole_lanes(n)
        i = int(0)
        while i < lanes:
            friction = ZERO
            damping = ZERO
            for j in range(wp.static(stages)):
                if wp.static(velocity_weights[j] != 0.0):
                    friction += (
                        wp.static(wp.float64(velocity_weights[j])) * K[wp.static(STAGES + STAGE_ROWS * j + 3), i]
                    )
                    damping += wp.static(wp.float64(velocity_weights[j])) * K[wp.static(STAGES + STAGE_ROWS * j + 4), i]
            K[layout.LOST_FRICTION, i] = K[layout.LOST_FRICTION, i] + h * friction
            K[layout.LOST_DAMPING, i] = K[layout.LOST_DAMPING, i] + h * damping
            for row in range(6):
                K[wp.static(X + row), i] = K[wp.static(layout.NEW_X + row), i]
            if wp.static(reuses_last):
                for row in range(wp.static(STAGE_ROWS)):
                    K[wp.static(STAGES + row), i] = K[wp.static(last_row + row), i]
            i += 1

    return first_stage, attempt, commit
