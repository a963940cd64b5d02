"""Embedded explicit Runge–Kutta methods: one loop over stages for every tableau.

One CPU thread carries a chain. K is the chain's scratch: an array with a row for each quantity and a column for each
link or joint, see :mod:`layout`. Loops over links have the form that clang vectorises: ``while`` loops with an integer
of their own, one array of static shape, no branch and no library call inside.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import STAGE_ROWS, STAGES, U, V, X, Y
from warpchain.kernels.methods.controller import error_bits
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.kernels.physics.elementary import LARGEST_TURN, TWO, ZERO, cos_sin, order_bits
from warpchain.kernels.physics.geometry import end_positions, end_velocities, turned, whole_lanes
from warpchain.kernels.physics.joint import friction_torque, joint_force, link_acceleration
from warpchain.kernels.physics.plane import plane_load
from warpchain.kernels.types import Chain, Rows

wp.set_module_options({"enable_backward": False})


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
        left_x, left_y, right_x, right_y = end_positions(K[X, i], K[Y, i], a * c, a * s)
        K[layout.LEFT_X, i] = left_x
        K[layout.LEFT_Y, i] = left_y
        K[layout.RIGHT_X, i] = right_x
        K[layout.RIGHT_Y, i] = right_y
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
        arm_x = a * K[layout.COSINE, i]
        arm_y = a * K[layout.SINE, i]
        w = K[layout.OMEGA, i]
        K[layout.STAGE_ARM_X, i] = arm_x
        K[layout.STAGE_ARM_Y, i] = arm_y
        K[layout.STAGE_SPIN, i] = w
        left_u, left_v, right_u, right_v = end_velocities(K[U, i], K[V, i], w, arm_x, arm_y)
        K[layout.LEFT_U, i] = left_u
        K[layout.LEFT_V, i] = left_v
        K[layout.RIGHT_U, i] = right_u
        K[layout.RIGHT_V, i] = right_v
        i += 1
    K[layout.LEFT_U, n] = K[layout.LEFT_U, 0]
    K[layout.LEFT_V, n] = K[layout.LEFT_V, 0]
    K[layout.STAGE_SPIN, n] = K[layout.STAGE_SPIN, 0]


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
def explicit_method(name: str, tilts: bool = False):
    """Warp functions of one tableau: (evaluate the first stage, attempt a step, commit it).

    Args:
        name: Key of :data:`TABLEAUS`.
        tilts: Whether the plane of the chain may move; ``chain`` is then on the plane of the middle of the step.

    Returns:
        ``first_stage(K, chain)``, ``attempt(K, chain, h, tolerance)`` → bits of the greatest error ratio (see
        :func:`order_bits`), ``commit(K, chain, h)``.
    """
    tableau = TABLEAUS[name]
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
        weightless = chain
        if wp.static(tilts):
            weightless.gravity = ZERO
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
                weightless,
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
            if wp.static(tilts):
                load_x, load_y, load_turn = plane_load(
                    chain,
                    K[layout.RIGHT_X, i] - K[layout.STAGE_ARM_X, i],
                    K[layout.RIGHT_Y, i] - K[layout.STAGE_ARM_Y, i],
                    K[layout.STAGE_ARM_X, i],
                    K[layout.STAGE_ARM_Y, i],
                )
                ax += load_x
                ay += load_y
                spin_rate += load_turn
            K[row, i] = ax
            K[row + 1, i] = ay
            K[row + 2, i] = spin_rate
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
                K[layout.STAGE_ARM_X, i] = arm_x
                K[layout.STAGE_ARM_Y, i] = arm_y
                K[layout.STAGE_SPIN, i] = w
                left_x, left_y, right_x, right_y = end_positions(x, y, arm_x, arm_y)
                left_u, left_v, right_u, right_v = end_velocities(u, v, w, arm_x, arm_y)
                K[layout.LEFT_X, i] = left_x
                K[layout.LEFT_Y, i] = left_y
                K[layout.LEFT_U, i] = left_u
                K[layout.LEFT_V, i] = left_v
                K[layout.RIGHT_X, i] = right_x
                K[layout.RIGHT_Y, i] = right_y
                K[layout.RIGHT_U, i] = right_u
                K[layout.RIGHT_V, i] = right_v
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
            du, dv, dw, dx, dy, turn = new_state(K, i)
            eu, ev, ew, ex, ey, et = errors(K, i)
            u = K[U, i]
            v = K[V, i]
            w = K[layout.OMEGA, i]
            K[layout.NEW_X, i] = K[X, i] + (h * u + hh * dx)
            K[layout.NEW_Y, i] = K[Y, i] + (h * v + hh * dy)
            K[layout.NEW_THETA, i] = K[layout.THETA, i] + (h * w + hh * turn)
            K[layout.NEW_U, i] = u + h * du
            K[layout.NEW_V, i] = v + h * dv
            K[layout.NEW_OMEGA, i] = w + h * dw
            # Take the maximum over components, not the sum. Compare the floats' bits as integers, where NaN is
            # greatest.
            worst = wp.max(
                wp.max(
                    error_bits(hh * ex, K[X, i], u, h),
                    error_bits(hh * ey, K[Y, i], v, h),
                ),
                error_bits(hh * et, K[layout.THETA, i], w, h),
            )
            worst = wp.max(
                worst,
                wp.max(
                    wp.max(
                        error_bits(h * eu, u, K[wp.static(STAGES), i], h),
                        error_bits(h * ev, v, K[wp.static(STAGES + 1), i], h),
                    ),
                    error_bits(h * ew, w, K[wp.static(STAGES + 2), i], h),
                ),
            )
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
            K[X, i] = K[layout.NEW_X, i]
            K[Y, i] = K[layout.NEW_Y, i]
            K[layout.THETA, i] = K[layout.NEW_THETA, i]
            K[U, i] = K[layout.NEW_U, i]
            K[V, i] = K[layout.NEW_V, i]
            K[layout.OMEGA, i] = K[layout.NEW_OMEGA, i]
            if wp.static(reuses_last):
                for row in range(wp.static(STAGE_ROWS)):
                    K[wp.static(STAGES + row), i] = K[wp.static(last_row + row), i]
            i += 1

    return first_stage, attempt, commit
