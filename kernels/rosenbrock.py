"""Rosenbrock methods on the chain's equations with their exact Jacobian: O(n) a step, no bound on h from the springs.

With v = q̇ and M q̈ = Q(q, v), put g = hγ, K = −∂Q/∂q and D = −∂Q/∂v. A stage of :class:`RosenbrockTable`,
(1 − g J) U = r with r_q = g v + γ Σ C U_q, r_v = g M⁻¹ Q + γ Σ C U_v at the stage's place, is freed of its velocities:

    (M + g D + g² K) U_q = g M r_v + (M + g D) r_q,    U_v = (U_q − r_q) / g.

The matrix couples neighbouring links only: 3 × 3 blocks along the loop, the same for all stages of a step.

All is done in the order of :mod:`cyclic_solver`: eight segments of the loop side by side, so that the next link is the
next vector of memory. A joint lies at the column of the link on its left, rows of joints one place further.
"""

import functools

import warp as wp

from .controller import error_bits
from .cyclic_solver import cyclic_solver, place_column, row_at, segment_places
from .elementary import ONE, TWO, ZERO, cos_sin, order_bits
from .geometry import end_velocities
from .joint import friction_slope, friction_torque, joint_force
from .layout import LOST_DAMPING, LOST_FRICTION, OMEGA, STAGE_ROWS, STAGES, THETA, U, V, X, Y
from .rosenbrock_layout import (
    BASE,
    BASE_COSINE,
    BASE_FORCE_X,
    BASE_FORCE_Y,
    BASE_RATE,
    BASE_RATE_X,
    BASE_RATE_Y,
    BASE_SINE,
    BASE_SPIN,
    BASE_TORQUE,
    COUNTED,
    DRIVE,
    FIRST_STAGE_ROW,
    FORCE_X,
    INERTIA,
    LEFT,
    MASS,
    NEW,
    POWER_DAMPING,
    POWER_FRICTION,
    RIGHT,
    RIGHT_SIDE,
    SHIFT,
    SHIFT_LEFT,
    SHIFT_RIGHT,
    SLOPE,
    SPIN,
    pad_before,
    pad_behind,
    segments_of,
)
from .rosenbrock_system import assemble, first_right_hand_side, place_link, pull_joints, right_hand_side
from .rosenbrock_tables import ROSENBROCK_TABLES
from .types import Chain

wp.set_module_options({"enable_backward": False})

GREATEST_TURN = wp.constant(wp.float64(1.0))
"""Greatest turn of a link [rad] in one step: beyond it the error estimate, which sees six places, means nothing."""


def rosenbrock_rows(name: str, columns: int) -> int:
    """Rows of a chain's scratch block of this width."""
    segments = segments_of(columns)
    rows = FIRST_STAGE_ROW + 6 * ROSENBROCK_TABLES[name].stages
    doubles = rows * segments.columns + segments.separator_rows * 16
    return STAGES + STAGE_ROWS + -(-doubles // columns)


@functools.cache
def rosenbrock_method(name: str, columns: int):
    """Warp functions of one table: (evaluate the first stage, try a step, commit it), as those of an explicit method.

    Args:
        name: Key of :data:`ROSENBROCK_TABLES`.
        columns: Width of the scratch blocks.

    Returns:
        ``first_stage(K, chain)``, ``attempt(K, chain, h, tolerance)`` → bits of the greatest error ratio (see
        :func:`order_bits`), ``commit(K, chain, h)``.
    """
    table = ROSENBROCK_TABLES[name]
    stages, gamma = table.stages, table.gamma
    matrix, couplings, quadrature = table.matrix, table.couplings, table.quadrature
    segments = segments_of(columns)
    factor, solve = cyclic_solver(segments)
    width = segments.columns
    rows = FIRST_STAGE_ROW + 6 * stages
    separator_rows = segments.separator_rows
    first_row = STAGES + STAGE_ROWS
    offset = 8 * first_row * columns
    separator_offset = offset + 8 * rows * width

    @wp.func
    def segment_rows(K: wp.array2d(dtype=wp.float64)):
        return wp.array(
            ptr=K.ptr + wp.uint64(wp.static(offset)), shape=(wp.static(rows), wp.static(width)), dtype=wp.float64
        )

    @wp.func
    def separator_rows_of(K: wp.array2d(dtype=wp.float64)):
        return wp.array(
            ptr=K.ptr + wp.uint64(wp.static(separator_offset)), shape=(wp.static(separator_rows), 16), dtype=wp.float64
        )

    @wp.func
    def link_at(place: int, segment: int, places: int, full: int, link_count: int):
        row = row_at(place, segment, places, full)
        return wp.where(row >= link_count, row - link_count, row)

    first_rows = (LEFT, LEFT + 1, LEFT + 2, LEFT + 3, SPIN, BASE_COSINE, BASE_SINE, BASE + 5)
    behind_start = pad_behind(first_rows)
    behind_stage = pad_behind((*first_rows[:5], SHIFT_LEFT, SHIFT_LEFT + 1, SHIFT + 2))
    behind_end = pad_behind((LEFT + 2, LEFT + 3, SPIN))
    before_start = pad_before(first_rows[5:], 0)
    joints_start = pad_before(tuple(range(SLOPE, SLOPE + 7)), 1)
    joints_stage = pad_before(tuple(range(FORCE_X, FORCE_X + 6)), 1)

    @wp.func
    def first_stage(K: wp.array2d(dtype=wp.float64), chain: Chain):
        S = segment_rows(K)
        n = chain.link_count
        places, full, _ = segment_places(n)
        end = place_column(places + 1)
        p = int(0)
        while p < places:
            s = int(0)
            while s < 8:
                i = link_at(p, s, places, full, n)
                c = 8 * p + 8 + s
                S[BASE, c] = K[X, i]
                S[wp.static(BASE + 1), c] = K[Y, i]
                S[wp.static(BASE + 2), c] = K[THETA, i]
                S[wp.static(BASE + 3), c] = K[U, i]
                S[wp.static(BASE + 4), c] = K[V, i]
                S[wp.static(BASE + 5), c] = K[OMEGA, i]
                inner = i % 2 == 0
                S[MASS, c] = wp.where(inner, chain.inner_mass, chain.outer_mass)
                S[INERTIA, c] = wp.where(inner, chain.inner_inertia, chain.outer_inertia)
                repeats = (p == 0 and s >= full) or row_at(p, s, places, full) >= n
                S[COUNTED, c] = wp.where(repeats, ZERO, ONE)
                s += 1
            p += 1
        c = int(8)
        while c < end:
            cosine, sine = cos_sin(S[wp.static(BASE + 2), c])
            S[BASE_COSINE, c] = cosine
            S[BASE_SINE, c] = sine
            place_link(
                S,
                chain,
                c,
                S[BASE, c],
                S[wp.static(BASE + 1), c],
                S[wp.static(BASE + 3), c],
                S[wp.static(BASE + 4), c],
                S[wp.static(BASE + 5), c],
                cosine,
                sine,
            )
            c += 1
        behind_start(S, places, full)
        before_start(S, places)
        c = int(8)
        while c < end:
            cx = S[LEFT, c + 8] - S[RIGHT, c]
            cy = S[wp.static(LEFT + 1), c + 8] - S[wp.static(RIGHT + 1), c]
            cu = S[wp.static(LEFT + 2), c + 8] - S[wp.static(RIGHT + 2), c]
            cv = S[wp.static(LEFT + 3), c + 8] - S[wp.static(RIGHT + 3), c]
            spin = S[SPIN, c] - S[SPIN, c + 8]
            S[BASE_FORCE_X, c + 8] = joint_force(chain, cx, cu)
            S[BASE_FORCE_Y, c + 8] = joint_force(chain, cy, cv)
            S[BASE_TORQUE, c + 8] = friction_torque(chain, spin)
            S[SLOPE, c + 8] = friction_slope(chain, spin)
            S[BASE_SPIN, c + 8] = spin
            S[BASE_RATE_X, c + 8] = cu
            S[BASE_RATE_Y, c + 8] = cv
            c += 1
        joints_start(S, places)
        c = int(8)
        while c < end:
            fx = S[BASE_FORCE_X, c + 8] - S[BASE_FORCE_X, c]
            fy = S[BASE_FORCE_Y, c + 8] - S[BASE_FORCE_Y, c]
            sum_x = S[BASE_FORCE_X, c + 8] + S[BASE_FORCE_X, c]
            sum_y = S[BASE_FORCE_Y, c + 8] + S[BASE_FORCE_Y, c]
            lever = chain.half_length * (S[BASE_COSINE, c] * sum_y - S[BASE_SINE, c] * sum_x)
            S[BASE_RATE, c] = fx / S[MASS, c]
            S[wp.static(BASE_RATE + 1), c] = fy / S[MASS, c] - chain.gravity
            S[wp.static(BASE_RATE + 2), c] = (lever + S[BASE_TORQUE, c] - S[BASE_TORQUE, c + 8]) / S[INERTIA, c]
            c += 1
        # where the driver looks for rates that are not finite
        p = int(0)
        while p < places:
            s = int(0)
            while s < 8:
                i = link_at(p, s, places, full, n)
                for k in range(3):
                    K[wp.static(STAGES + k), i] = S[wp.static(BASE_RATE + k), 8 * p + 8 + s]
                s += 1
            p += 1

    @wp.func
    def place_stage(S: wp.array2d(dtype=wp.float64), chain: Chain, stage: int, g: wp.float64, end: int):
        """U of the stage before, this stage's place in the links' rows, r_q and γ Σ C U_v."""
        inverse = ONE / g
        for i in range(1, wp.static(stages)):
            if stage == i:
                c = int(8)
                while c < end:
                    for k in range(3):
                        change = S[wp.static(RIGHT_SIDE + k), c]
                        speed_change = (change - S[wp.static(SHIFT + k), c]) * inverse
                        S[wp.static(FIRST_STAGE_ROW + 6 * (i - 1) + k), c] = change
                        S[wp.static(FIRST_STAGE_ROW + 6 * (i - 1) + 3 + k), c] = speed_change
                    x = S[BASE, c]
                    y = S[wp.static(BASE + 1), c]
                    theta = S[wp.static(BASE + 2), c]
                    u = S[wp.static(BASE + 3), c]
                    v = S[wp.static(BASE + 4), c]
                    w = S[wp.static(BASE + 5), c]
                    rx = ZERO
                    ry = ZERO
                    rt = ZERO
                    ru = ZERO
                    rv = ZERO
                    rw = ZERO
                    for j in range(wp.static(i)):
                        ux = S[wp.static(FIRST_STAGE_ROW + 6 * j), c]
                        uy = S[wp.static(FIRST_STAGE_ROW + 6 * j + 1), c]
                        ut = S[wp.static(FIRST_STAGE_ROW + 6 * j + 2), c]
                        uu = S[wp.static(FIRST_STAGE_ROW + 6 * j + 3), c]
                        uv = S[wp.static(FIRST_STAGE_ROW + 6 * j + 4), c]
                        uw = S[wp.static(FIRST_STAGE_ROW + 6 * j + 5), c]
                        x += wp.static(wp.float64(matrix[i][j])) * ux
                        y += wp.static(wp.float64(matrix[i][j])) * uy
                        theta += wp.static(wp.float64(matrix[i][j])) * ut
                        u += wp.static(wp.float64(matrix[i][j])) * uu
                        v += wp.static(wp.float64(matrix[i][j])) * uv
                        w += wp.static(wp.float64(matrix[i][j])) * uw
                        rx += wp.static(wp.float64(gamma * couplings[i][j])) * ux
                        ry += wp.static(wp.float64(gamma * couplings[i][j])) * uy
                        rt += wp.static(wp.float64(gamma * couplings[i][j])) * ut
                        ru += wp.static(wp.float64(gamma * couplings[i][j])) * uu
                        rv += wp.static(wp.float64(gamma * couplings[i][j])) * uv
                        rw += wp.static(wp.float64(gamma * couplings[i][j])) * uw
                    S[SHIFT, c] = rx + g * u
                    S[wp.static(SHIFT + 1), c] = ry + g * v
                    S[wp.static(SHIFT + 2), c] = rt + g * w
                    S[DRIVE, c] = ru
                    S[wp.static(DRIVE + 1), c] = rv
                    S[wp.static(DRIVE + 2), c] = rw
                    S[NEW, c] = x
                    S[wp.static(NEW + 1), c] = y
                    S[wp.static(NEW + 2), c] = theta
                    S[wp.static(NEW + 3), c] = u
                    S[wp.static(NEW + 4), c] = v
                    S[wp.static(NEW + 5), c] = w
                    c += 1
        c = int(8)
        while c < end:
            cosine, sine = cos_sin(S[wp.static(NEW + 2), c])
            place_link(
                S,
                chain,
                c,
                S[NEW, c],
                S[wp.static(NEW + 1), c],
                S[wp.static(NEW + 3), c],
                S[wp.static(NEW + 4), c],
                S[wp.static(NEW + 5), c],
                cosine,
                sine,
            )
            left_x, left_y, right_x, right_y = end_velocities(
                chain,
                S[SHIFT, c],
                S[wp.static(SHIFT + 1), c],
                S[wp.static(SHIFT + 2), c],
                S[BASE_COSINE, c],
                S[BASE_SINE, c],
            )
            S[SHIFT_LEFT, c] = left_x
            S[wp.static(SHIFT_LEFT + 1), c] = left_y
            S[SHIFT_RIGHT, c] = right_x
            S[wp.static(SHIFT_RIGHT + 1), c] = right_y
            c += 1

    @wp.func
    def attempt(K: wp.array2d(dtype=wp.float64), chain: Chain, h: wp.float64, tolerance: wp.float64):
        S = segment_rows(K)
        R = separator_rows_of(K)
        places, full, total = segment_places(chain.link_count)
        lanes = wp.min(total, 8)
        end = place_column(places + 1)
        g = wp.static(wp.float64(gamma)) * h
        assemble(S, chain, g, end, full)
        factor(S, R, places, full, lanes)
        # stages are a loop at run time: unrolled, the code of a step would not fit into the cache for instructions
        stage = int(0)
        while stage < wp.static(stages):
            if stage == 0:
                first_right_hand_side(S, chain, g, wp.static(wp.float64(quadrature[0])), end, full)
            else:
                weight = ZERO
                for i in range(1, wp.static(stages)):
                    weight = wp.where(stage == i, wp.static(wp.float64(quadrature[i])), weight)
                place_stage(S, chain, stage, g, end)
                behind_stage(S, places, full)
                pull_joints(S, chain, weight, end)
                joints_stage(S, places)
                right_hand_side(S, chain, g, end, full)
            solve(S, R, places, lanes)
            stage += 1
        # new state and error ratio
        worst = wp.int64(0)
        turned = wp.int64(0)
        inverse = ONE / g
        c = int(8)
        while c < end:
            for k in range(3):
                place_error = S[wp.static(RIGHT_SIDE + k), c]
                speed_error = (place_error - S[wp.static(SHIFT + k), c]) * inverse
                S[wp.static(FIRST_STAGE_ROW + 6 * (stages - 1) + k), c] = place_error
                S[wp.static(FIRST_STAGE_ROW + 6 * (stages - 1) + 3 + k), c] = speed_error
                S[wp.static(NEW + k), c] = S[wp.static(NEW + k), c] + place_error
                S[wp.static(NEW + 3 + k), c] = S[wp.static(NEW + 3 + k), c] + speed_error
                speed = S[wp.static(BASE + 3 + k), c]
                # repeated places have no rate of their own
                counted = S[COUNTED, c]
                worst = wp.max(worst, error_bits(counted * place_error, S[wp.static(BASE + k), c], speed, h))
                worst = wp.max(worst, error_bits(counted * speed_error, speed, S[wp.static(BASE_RATE + k), c], h))
            turned = wp.max(turned, order_bits(S[wp.static(NEW + 2), c] - S[wp.static(BASE + 2), c]))
            c += 1
        greatest = order_bits(wp.cast(worst, wp.float64) / tolerance)
        # a greater turn is refused as an error of 2: the step shrinks
        if wp.cast(turned, wp.float64) > GREATEST_TURN:
            greatest = wp.max(greatest, order_bits(TWO))
        return greatest

    @wp.func
    def commit(K: wp.array2d(dtype=wp.float64), chain: Chain, h: wp.float64):
        S = segment_rows(K)
        n = chain.link_count
        places, full, _ = segment_places(n)
        end = place_column(places + 1)
        a = chain.half_length
        # Σ w U, and how the joints' spins and opening rates change by it
        c = int(8)
        while c < end:
            dt = ZERO
            du = ZERO
            dv = ZERO
            dw = ZERO
            for j in range(wp.static(stages)):
                dt += wp.static(wp.float64(quadrature[j])) * S[wp.static(FIRST_STAGE_ROW + 6 * j + 2), c]
                du += wp.static(wp.float64(quadrature[j])) * S[wp.static(FIRST_STAGE_ROW + 6 * j + 3), c]
                dv += wp.static(wp.float64(quadrature[j])) * S[wp.static(FIRST_STAGE_ROW + 6 * j + 4), c]
                dw += wp.static(wp.float64(quadrature[j])) * S[wp.static(FIRST_STAGE_ROW + 6 * j + 5), c]
            left_u, left_v, right_u, right_v = end_velocities(chain, du, dv, dw, S[BASE_COSINE, c], S[BASE_SINE, c])
            turn_x = a * S[wp.static(BASE + 5), c] * S[BASE_COSINE, c] * dt
            turn_y = a * S[wp.static(BASE + 5), c] * S[BASE_SINE, c] * dt
            S[wp.static(LEFT + 2), c] = left_u + turn_x
            S[wp.static(LEFT + 3), c] = left_v + turn_y
            S[wp.static(RIGHT + 2), c] = right_u - turn_x
            S[wp.static(RIGHT + 3), c] = right_v - turn_y
            S[SPIN, c] = dw
            c += 1
        behind_end(S, places, full)
        c = int(8)
        while c < end:
            cu = S[wp.static(LEFT + 2), c + 8] - S[wp.static(RIGHT + 2), c]
            cv = S[wp.static(LEFT + 3), c + 8] - S[wp.static(RIGHT + 3), c]
            spin = S[SPIN, c] - S[SPIN, c + 8]
            friction = (S[SLOPE, c + 8] * S[BASE_SPIN, c + 8] + S[BASE_TORQUE, c + 8]) * spin
            damping = TWO * chain.joint_damping * (S[BASE_RATE_X, c + 8] * cu + S[BASE_RATE_Y, c + 8] * cv)
            S[POWER_FRICTION, c + 8] = h * S[COUNTED, c] * (S[POWER_FRICTION, c + 8] + friction)
            S[POWER_DAMPING, c + 8] = h * S[COUNTED, c] * (S[POWER_DAMPING, c + 8] + damping)
            c += 1
        p = int(0)
        while p < places:
            s = int(0)
            while s < 8:
                i = link_at(p, s, places, full, n)
                c = 8 * p + 8 + s
                K[X, i] = S[NEW, c]
                K[Y, i] = S[wp.static(NEW + 1), c]
                K[THETA, i] = S[wp.static(NEW + 2), c]
                K[U, i] = S[wp.static(NEW + 3), c]
                K[V, i] = S[wp.static(NEW + 4), c]
                K[OMEGA, i] = S[wp.static(NEW + 5), c]
                K[LOST_FRICTION, i] = K[LOST_FRICTION, i] + S[POWER_FRICTION, c + 8]
                K[LOST_DAMPING, i] = K[LOST_DAMPING, i] + S[POWER_DAMPING, c + 8]
                s += 1
            p += 1

    return first_stage, attempt, commit
