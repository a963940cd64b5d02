"""Rosenbrock methods with the exact Jacobian of the chain: O(n) a step, and springs set no bound on the step h.

With v = q̇ and M q̈ = Q(q, v), put g = hγ, K = −∂Q/∂q and D = −∂Q/∂v. A stage of :class:`RosenbrockTable` is
(1 − g J) U = r with the Jacobian J, r_q = g v + γ Σ C U_q and r_v = g M⁻¹ Q + γ Σ C U_v, with v and Q at the stage's
place and sums over the earlier stages. Eliminating U_v gives

    (M + g D + g² K) Z = M (r_q / g + r_v) + g D r_q / g,    Z = U_q / g,    U_v = Z − r_q / g.

The matrix couples neighbouring links only, with 3 × 3 submatrices, and is the same for all stages of a step. Everything
else in a stage is a sum over the Z of earlier stages, see :class:`SecondOrderTable`.

Memory is in the order of :mod:`cpu.implicit.solver`, see :mod:`cpu.implicit.rosenbrock_layout`: eight segments of the
loop side by side, so that the next link is the next vector of memory.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit.rosenbrock_layout import (
    BASE,
    BASE_COSINE,
    BASE_FORCE_X,
    BASE_FORCE_Y,
    BASE_OPENING_X,
    BASE_OPENING_Y,
    BASE_RATE,
    BASE_RATE_X,
    BASE_RATE_Y,
    BASE_SINE,
    BASE_SPIN,
    BASE_TORQUE,
    CHANGE,
    COSINE,
    COUNTED,
    DRIVE,
    FIRST_STAGE_ROW,
    FORCE_X,
    INERTIA,
    MASS,
    NEW,
    POWER_DAMPING,
    POWER_FRICTION,
    RIGHT_SIDE,
    SHIFT,
    SINE,
    SLOPE,
    SPIN_RATE,
    TANGENT,
    pad_before,
    pad_behind,
    segments_of,
)
from warpchain.kernels.cpu.implicit.rosenbrock_system import (
    assemble,
    first_right_hand_side,
    friction_secant,
    opening,
    opening_rate,
    pull_joints,
    right_hand_side,
)
from warpchain.kernels.cpu.implicit.solver import (
    LANES,
    cyclic_solver,
    link_at,
    place_column,
    row_at,
    segment_places,
    view,
)
from warpchain.kernels.layout import INERTIA as LINK_INERTIA
from warpchain.kernels.layout import LOST_DAMPING, LOST_FRICTION, STAGE_ROWS, STAGES, X
from warpchain.kernels.layout import MASS as LINK_MASS
from warpchain.kernels.methods.controller import error_bits
from warpchain.kernels.methods.rosenbrock_tableaus import ROSENBROCK_TABLES
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, cos_sin, order_bits, versine_sine
from warpchain.kernels.physics.joint import friction_slope, friction_torque, joint_force
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})

GREATEST_TURN = wp.constant(wp.float64(1.0))
"""Greatest turn of a link [rad] in one step: beyond it the error estimate, made from six places, is no estimate."""


@functools.cache
def rosenbrock_method(name: str, columns: int):
    """Warp functions of one table: (evaluate the first stage, attempt a step, commit it), see :class:`CpuMethod`.

    Args:
        name: Key of :data:`ROSENBROCK_TABLES`.
        columns: Width of the scratch.

    Returns:
        ``first_stage(K, chain)``, ``attempt(K, chain, h, tolerance)`` → bits of the greatest error ratio (see
        :func:`order_bits`), ``commit(K, chain, h)``.
    """
    table = ROSENBROCK_TABLES[name]
    stages, gamma = table.stages, table.gamma
    matrix, quadrature = table.matrix, table.quadrature
    second = table.second_order
    free, place = second.free, second.place
    velocity, shift, drive = second.velocity, second.shift, second.drive
    segments = segments_of(columns)
    factor, solve = cyclic_solver(segments)
    width = segments.columns
    rows = FIRST_STAGE_ROW + 3 * stages
    first_row = STAGES + STAGE_ROWS
    offset = 8 * first_row * columns
    segment_rows = view(offset, rows, width)
    separator_rows_of = view(offset + 8 * rows * width, segments.separator_rows, LANES)
    behind_start = pad_behind((*range(BASE, BASE + 6), BASE_COSINE, BASE_SINE))
    behind_stage = pad_behind((NEW, NEW + 1, NEW + 3, NEW + 4, NEW + 5, COSINE, SINE, SHIFT, SHIFT + 1, SHIFT + 2))
    behind_rate = pad_behind((BASE_RATE + 2,))
    behind_end = pad_behind(tuple(range(CHANGE, CHANGE + 4)))
    before_start = pad_before((BASE + 5, BASE_COSINE, BASE_SINE), 0)
    joints_start = pad_before(tuple(range(BASE_TORQUE, BASE_TORQUE + 6)), 1)
    joints_slope = pad_before((SLOPE,), 1)
    joints_stage = pad_before(tuple(range(FORCE_X, FORCE_X + 6)), 1)

    @wp.func
    def first_stage(K: wp.array2d(dtype=wp.float64), chain: Chain):
        S = segment_rows(K)
        n = chain.link_count
        places, full, _ = segment_places(n)
        end = place_column(places + 1)
        # segment by segment, in each of which links follow one another
        s = int(0)
        while s < 8:
            i = int(link_at(0, s, places, full, n))
            c = 8 + s
            while c < end:
                for k in range(6):
                    S[wp.static(BASE + k), c] = K[wp.static(X + k), i]
                S[MASS, c] = K[LINK_MASS, i]
                S[INERTIA, c] = K[LINK_INERTIA, i]
                S[COUNTED, c] = wp.where((c < 16 and s >= full) or row_at(c // 8 - 1, s, places, full) >= n, ZERO, ONE)
                i = wp.where(i == n - 1, 0, i + 1)
                c += 8
            s += 1
        c = int(8)
        while c < end:
            cosine, sine = cos_sin(S[wp.static(BASE + 2), c])
            S[BASE_COSINE, c] = cosine
            S[BASE_SINE, c] = sine
            c += 1
        behind_start(S, places, full)
        before_start(S, places)
        c = int(8)
        while c < end:
            cx, cy = opening(S, chain, c, BASE, BASE_COSINE)
            cu, cv, spin = opening_rate(S, chain, c, wp.static(BASE + 3), BASE_COSINE)
            S[BASE_OPENING_X, c + 8] = cx
            S[BASE_OPENING_Y, c + 8] = cy
            S[BASE_FORCE_X, c + 8] = joint_force(chain, cx, cu)
            S[BASE_FORCE_Y, c + 8] = joint_force(chain, cy, cv)
            S[BASE_TORQUE, c + 8] = friction_torque(chain, spin)
            S[TANGENT, c + 8] = friction_slope(chain, spin)
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
        behind_rate(S, places, full)
        c = int(8)
        while c < end:
            S[SPIN_RATE, c + 8] = S[wp.static(BASE_RATE + 2), c] - S[wp.static(BASE_RATE + 2), c + 8]
            c += 1
        # the joint after a repeated separator is the last of the segment before, whose rate it takes
        s = full
        while s < 8:
            S[SPIN_RATE, 16 + s] = S[SPIN_RATE, 8 * places + 7 + s]
            s += 1
        # the step loop checks these rows for numbers that are not finite
        greatest = wp.int64(0)
        c = int(8)
        while c < end:
            for k in range(3):
                greatest = wp.max(greatest, order_bits(S[wp.static(BASE_RATE + k), c]))
            c += 1
        i = int(0)
        while i < n:
            for k in range(3):
                K[wp.static(STAGES + k), i] = wp.cast(greatest, wp.float64)
            i += 1

    @wp.func
    def place_stage(S: wp.array2d(dtype=wp.float64), stage: int, g: wp.float64, end: int):
        """W of the previous stage; of this one: change of place since the start, velocities, r_q / g and γ Σ C U_v."""
        for i in range(1, wp.static(stages)):
            if stage == i:
                c = int(8)
                while c < end:
                    for k in range(3):
                        at_start = S[wp.static(BASE + 3 + k), c]
                        change = S[wp.static(RIGHT_SIDE + k), c] - wp.static(wp.float64(free[i - 1])) * at_start
                        S[wp.static(FIRST_STAGE_ROW + 3 * (i - 1) + k), c] = change
                        moved = wp.static(wp.float64(place[i])) * at_start
                        speed = at_start + ZERO
                        shifted = wp.static(wp.float64(free[i])) * at_start
                        driven = ZERO
                        for j in range(wp.static(i)):
                            change = S[wp.static(FIRST_STAGE_ROW + 3 * j + k), c]
                            moved += wp.static(wp.float64(matrix[i][j])) * change
                            speed += wp.static(wp.float64(velocity[i][j])) * change
                            shifted += wp.static(wp.float64(shift[i][j])) * change
                            driven += wp.static(wp.float64(drive[i][j])) * change
                        S[wp.static(SHIFT + k), c] = shifted
                        S[wp.static(DRIVE + k), c] = driven
                        S[wp.static(NEW + k), c] = g * moved
                        S[wp.static(NEW + 3 + k), c] = speed
                    c += 1
        c = int(8)
        while c < end:
            versine, sine = versine_sine(S[wp.static(NEW + 2), c])
            S[COSINE, c] = -(S[BASE_COSINE, c] * versine + S[BASE_SINE, c] * sine)
            S[SINE, c] = S[BASE_COSINE, c] * sine - S[BASE_SINE, c] * versine
            c += 1

    @wp.func
    def attempt(K: wp.array2d(dtype=wp.float64), chain: Chain, h: wp.float64, tolerance: wp.float64):
        S = segment_rows(K)
        R = separator_rows_of(K)
        places, full, _ = segment_places(chain.link_count)
        end = place_column(places + 1)
        g = wp.static(wp.float64(gamma)) * h
        c = int(8)
        while c < end:
            S[SLOPE, c + 8] = friction_secant(
                chain,
                S[TANGENT, c + 8],
                S[BASE_TORQUE, c + 8],
                S[BASE_SPIN, c + 8],
                S[SPIN_RATE, c + 8],
                S[wp.static(BASE + 5), c],
                h,
                tolerance,
            )
            c += 1
        joints_slope(S, places)
        assemble(S, chain, g, end, full)
        factor(S, R, places, full)
        # a loop at run time: the unrolled code of a step would not fit into the instruction cache
        stage = int(0)
        while stage < wp.static(stages):
            if stage == 0:
                first_right_hand_side(S, chain, g, wp.static(wp.float64(quadrature[0])), end, full)
            else:
                weight = ZERO
                for i in range(1, wp.static(stages)):
                    weight = wp.where(stage == i, wp.static(wp.float64(quadrature[i])), weight)
                place_stage(S, stage, g, end)
                behind_stage(S, places, full)
                pull_joints(S, chain, weight, end)
                joints_stage(S, places)
                right_hand_side(S, chain, g, end, full)
            solve(S, R, places)
            stage += 1
        # new state and error ratio
        worst = wp.int64(0)
        turned = wp.int64(0)
        c = int(8)
        while c < end:
            for k in range(3):
                z = S[wp.static(RIGHT_SIDE + k), c]
                place_error = g * z
                speed_error = z - S[wp.static(SHIFT + k), c]
                S[wp.static(FIRST_STAGE_ROW + 3 * (stages - 1) + k), c] = (
                    z - wp.static(wp.float64(free[stages - 1])) * S[wp.static(BASE + 3 + k), c]
                )
                moved = S[wp.static(NEW + k), c] + place_error
                if wp.static(k == 2):
                    turned = wp.max(turned, order_bits(moved))
                S[wp.static(NEW + k), c] = S[wp.static(BASE + k), c] + moved
                S[wp.static(NEW + 3 + k), c] = S[wp.static(NEW + 3 + k), c] + speed_error
                speed = S[wp.static(BASE + 3 + k), c]
                # repeated places do not count
                counted = S[COUNTED, c]
                worst = wp.max(worst, error_bits(counted * place_error, S[wp.static(BASE + k), c], speed, h))
                worst = wp.max(worst, error_bits(counted * speed_error, speed, S[wp.static(BASE_RATE + k), c], h))
            c += 1
        greatest = order_bits(wp.cast(worst, wp.float64) / tolerance)
        # a greater turn counts as an error of 2: the step shrinks
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
        # Σ w U, and the changes of the joints' spins and opening rates by it
        c = int(8)
        while c < end:
            dt = wp.static(wp.float64(second.loss_place)) * S[wp.static(BASE + 5), c]
            du = ZERO
            dv = ZERO
            dw = ZERO
            for j in range(wp.static(stages)):
                change = S[wp.static(FIRST_STAGE_ROW + 3 * j + 2), c]
                dt += wp.static(wp.float64(quadrature[j])) * change
                du += wp.static(wp.float64(second.loss[j])) * S[wp.static(FIRST_STAGE_ROW + 3 * j), c]
                dv += wp.static(wp.float64(second.loss[j])) * S[wp.static(FIRST_STAGE_ROW + 3 * j + 1), c]
                dw += wp.static(wp.float64(second.loss[j])) * change
            dt = wp.static(wp.float64(gamma)) * h * dt
            S[CHANGE, c] = dt
            S[wp.static(CHANGE + 1), c] = du
            S[wp.static(CHANGE + 2), c] = dv
            S[wp.static(CHANGE + 3), c] = dw
            c += 1
        behind_end(S, places, full)
        c = int(8)
        while c < end:
            cu, cv, spin = opening_rate(S, chain, c, wp.static(CHANGE + 1), BASE_COSINE)
            swing = a * S[wp.static(BASE + 5), c] * S[CHANGE, c]
            next_swing = a * S[wp.static(BASE + 5), c + 8] * S[CHANGE, c + 8]
            cu += next_swing * S[BASE_COSINE, c + 8] + swing * S[BASE_COSINE, c]
            cv += next_swing * S[BASE_SINE, c + 8] + swing * S[BASE_SINE, c]
            friction = (S[SLOPE, c + 8] * S[BASE_SPIN, c + 8] + S[BASE_TORQUE, c + 8]) * spin
            damping = TWO * chain.joint_damping * (S[BASE_RATE_X, c + 8] * cu + S[BASE_RATE_Y, c + 8] * cv)
            S[POWER_FRICTION, c + 8] = h * S[COUNTED, c] * (S[POWER_FRICTION, c + 8] + friction)
            S[POWER_DAMPING, c + 8] = h * S[COUNTED, c] * (S[POWER_DAMPING, c + 8] + damping)
            c += 1
        s = int(0)
        while s < 8:
            i = int(link_at(0, s, places, full, n))
            c = 8 + s
            while c < end:
                for k in range(6):
                    K[wp.static(X + k), i] = S[wp.static(NEW + k), c]
                K[LOST_FRICTION, i] = K[LOST_FRICTION, i] + S[POWER_FRICTION, c + 8]
                K[LOST_DAMPING, i] = K[LOST_DAMPING, i] + S[POWER_DAMPING, c + 8]
                i = wp.where(i == n - 1, 0, i + 1)
                c += 8
            s += 1

    return first_stage, attempt, commit
