"""Embedded explicit Runge–Kutta methods: one loop over stages for every tableau.

One CPU thread carries a chain. K is the chain's scratch: an array with a row for each quantity and a column for each
link or joint, see :mod:`layout`. Loops over links have the form that clang vectorises: ``while`` loops with an integer
of their own, one array of static shape, no branch and no library call inside.
"""

import functools
from typing import Any

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import STAGE_ROWS, STAGES, U, X, Y
from warpchain.kernels.methods.controller import error_bits
from warpchain.kernels.methods.explicit_tableaus import Tableau
from warpchain.kernels.physics.elementary import LARGEST_TURN, TWO, cos_sin, order_bits
from warpchain.kernels.physics.geometry import Link, end_positions, end_velocities, put, three, turned, two, whole_lanes
from warpchain.kernels.physics.joint import friction_torque, joint_force, link_acceleration
from warpchain.kernels.types import Chain, Rows


@wp.func
def write_ends(K: Rows, i: int, x: wp.float64, y: wp.float64, arm_x: wp.float64, arm_y: wp.float64):
    """End positions of link i."""
    left_x, left_y, right_x, right_y = end_positions(x, y, arm_x, arm_y)
    put(K, layout.LEFT_X, i, wp.vec4d(left_x, left_y, right_x, right_y))


@wp.func
def write_motion(K: Rows, i: int, motion: wp.vec3d, arm_x: wp.float64, arm_y: wp.float64):
    """Arm, spin and end velocities of link i in a stage."""
    put(K, layout.STAGE_ARM_X, i, wp.vec3d(arm_x, arm_y, motion[2]))
    left_u, left_v, right_u, right_v = end_velocities(motion[0], motion[1], motion[2], arm_x, arm_y)
    put(K, layout.LEFT_U, i, wp.vec4d(left_u, left_v, right_u, right_v))


@wp.func
def place_ends(K: Rows, chain: Chain):
    """Directions and end positions of the links, exactly, from the state rows."""
    n = chain.link_count
    lanes = whole_lanes(n)
    a = chain.half_length
    i = int(0)
    while i < lanes:
        c, s = cos_sin(K[layout.THETA, i])
        put(K, layout.COSINE, i, wp.vec2d(c, s))
        write_ends(K, i, K[X, i], K[Y, i], a * c, a * s)
        i += 1
    put(K, layout.LEFT_X, n, two(K, layout.LEFT_X, 0))


@wp.func
def begin_stages(K: Rows, chain: Chain):
    """Rows of the first stage from the state: arms, spins, end velocities; :func:`place_ends` has placed the ends."""
    n = chain.link_count
    lanes = whole_lanes(n)
    a = chain.half_length
    i = int(0)
    while i < lanes:
        write_motion(K, i, three(K, U, i), a * K[layout.COSINE, i], a * K[layout.SINE, i])
        i += 1
    put(K, layout.LEFT_U, n, two(K, layout.LEFT_U, 0))
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
    """Warp function ``sums(K, i)``: Σ w_j (ẍ, ÿ, θ̈)_j of link i over the stages, for both rows of weights w.

    One function of three sums for each row instead made clang fuse other products with sums: walks rounded otherwise.
    """

    @wp.func
    def sums(K: Rows, i: int):
        change = wp.vec3d()
        shift = wp.vec3d()
        for j in range(wp.static(len(velocity))):
            if wp.static(velocity[j] != 0.0):
                change += wp.static(wp.float64(velocity[j])) * three(K, wp.static(STAGES + STAGE_ROWS * j), i)
            if wp.static(position[j] != 0.0):
                shift += wp.static(wp.float64(position[j])) * three(K, wp.static(STAGES + STAGE_ROWS * j), i)
        return change, shift

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
            opening = two(K, layout.LEFT_X, i + 1) - two(K, layout.RIGHT_X, i)
            rate = two(K, layout.LEFT_U, i + 1) - two(K, layout.RIGHT_U, i)
            spin = K[layout.STAGE_SPIN, i] - K[layout.STAGE_SPIN, i + 1]
            torque = friction_torque(K[layout.VISCOUS, i], K[layout.COULOMB, i], spin, chain.inverse_smoothing)
            force_x = joint_force(chain, opening[0], rate[0])
            force_y = joint_force(chain, opening[1], rate[1])
            put(K, layout.FORCE_X, i + 1, wp.vec3d(force_x, force_y, torque))
            if needs_power:
                damping = chain.joint_damping * (rate[0] * rate[0] + rate[1] * rate[1])
                put(K, row + 3, i, wp.vec2d(torque * spin, damping))
            i += 1
        put(K, layout.FORCE_X, 0, three(K, layout.FORCE_X, n))
        i = int(0)
        while i < lanes:
            inverse_mass = K[layout.INVERSE_MASS, i]
            inverse_inertia = K[layout.INVERSE_INERTIA, i]
            arm = two(K, layout.STAGE_ARM_X, i)
            left = three(K, layout.FORCE_X, i)
            right = three(K, layout.FORCE_X, i + 1)
            ax, ay, spin_rate = link_acceleration(inverse_mass, inverse_inertia, arm, left, right)
            load_x, load_y, load_turn = acceleration(chain, i, link_in_stage(K, i), inverse_mass, inverse_inertia)
            put(K, row, i, wp.vec3d(ax + load_x, ay + load_y, spin_rate + load_turn))
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
                change, shift = wp.static(stage_sums[s])(K, i)
                moved = ch * three(K, U, i) + hh * shift
                arm_x, arm_y = turned(a * K[layout.COSINE, i], a * K[layout.SINE, i], moved[2])
                write_ends(K, i, K[X, i] + moved[0], K[Y, i] + moved[1], arm_x, arm_y)
                write_motion(K, i, three(K, U, i) + h * change, arm_x, arm_y)
                i += 1
            put(K, layout.LEFT_X, n, two(K, layout.LEFT_X, 0))
            put(K, layout.LEFT_U, n, two(K, layout.LEFT_U, 0))
            K[layout.STAGE_SPIN, n] = K[layout.STAGE_SPIN, 0]
            derivatives(K, chain, wp.static(STAGES + STAGE_ROWS * s), wp.static(power_needed[s]))
        # new state and error ratio
        i = int(0)
        while i < lanes:
            change, shift = new_state(K, i)
            velocity_error, place_error = errors(K, i)
            # Take the maximum over components, not the sum. Compare the floats' bits as integers, where NaN is
            # greatest.
            worst = wp.int64(0)
            for k in range(3):
                place = K[X + k, i]
                rate = K[U + k, i]
                K[layout.NEW_X + k, i] = place + (h * rate + hh * shift[k])
                K[layout.NEW_U + k, i] = rate + h * change[k]
                worst = wp.max(worst, error_bits(hh * place_error[k], place, rate, h))
                worst = wp.max(worst, error_bits(h * velocity_error[k], rate, K[STAGES + k, i], h))
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
        lanes = whole_lanes(chain.link_count)
        i = int(0)
        while i < lanes:
            power = wp.vec2d()
            for j in range(wp.static(stages)):
                if wp.static(velocity_weights[j] != 0.0):
                    weight = wp.static(wp.float64(velocity_weights[j]))
                    power += weight * two(K, wp.static(STAGES + STAGE_ROWS * j + 3), i)
            put(K, layout.LOST_FRICTION, i, two(K, layout.LOST_FRICTION, i) + h * power)
            for row in range(6):
                K[wp.static(X + row), i] = K[wp.static(layout.NEW_X + row), i]
            if wp.static(reuses_last):
                for row in range(wp.static(STAGE_ROWS)):
                    K[wp.static(STAGES + row), i] = K[wp.static(last_row + row), i]
            i += 1

    return first_stage, attempt, commit
