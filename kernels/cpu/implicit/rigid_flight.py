"""Flight on rigid joints: a W-method on the accelerations of :mod:`cpu.implicit.rigid`, with projections after a step.

Only joint friction is stiff, so the matrix of the method is that of friction under the constraint of the joints:
A = −P M⁻¹ D, where D = −∂Q/∂v has the slopes f'(w) of the joints' friction and P projects on Ċ = G v = 0. A stage
(1 − g A) z = r with g = hγ is (M + g D) z + Gᵀ λ = M r with G z = G r. Eliminating the links' x and y gives, with
y = z_θ − r_θ and joint i between the links l and r,

    (1/m_l + 1/m_r) λ_i − λ_i−1/m_l − λ_i+1/m_r + a (t_l y_l + t_r y_r) = 0,
    I_i y_i + g (D y)_i − a t_i·(λ_i + λ_i−1) = −g (D r_θ)_i:

a cyclic block-tridiagonal system with 3 × 3 submatrices for (λ_i, y_i). Its symmetric part is positive definite, so no
pivoting is needed.

The spin w of some joint passes through zero a thousand times a second in a loop. Coulomb friction then changes its sign
within a millionth of a step; to resolve that, steps of a few µs would be needed. So friction is smoothed over a part of
the change of w in the step: tanh(w / max(ω_c, c h |ẇ|)). By symmetry this does not change the impulse of friction
during a passage through zero. A sticking joint has ẇ = 0 and keeps ω_c, and the smoothing vanishes with h. c = 0.2 was
best in a prototype: 0.05 gained nothing, and with 1 the larger errors outweighed the steps saved.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit.rigid import rigid_joints
from warpchain.kernels.cpu.implicit.rigid_layout import (
    BASE,
    BASE_RATE,
    COSINE,
    COULOMB,
    COUNTED,
    COUPLED,
    DRAG,
    FIRST_STAGE_ROW,
    FLIGHT_SYSTEM,
    INERTIA,
    INVERSE_MASS,
    INVERSE_SMOOTHING,
    NEW,
    POWER,
    RATE,
    SINE,
    SLOPE,
    SPIN,
    STAGE_U,
    STAGE_V,
    TARGET,
    TORQUE,
    VISCOUS,
    force_layout,
    friction_layout,
    pad_behind,
    pad_joints,
)
from warpchain.kernels.cpu.implicit.solver import (
    LANES,
    cyclic_solver,
    link_at,
    place_column,
    segment_places,
    view,
)
from warpchain.kernels.layout import LOST_FRICTION
from warpchain.kernels.methods.controller import error_bits
from warpchain.kernels.methods.w_tableaus import ROS34PW2
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, cos_sin, order_bits
from warpchain.kernels.physics.rigid_joint import steepness, switch_smoothing
from warpchain.kernels.types import Chain, Rows

wp.set_module_options({"enable_backward": False})

GREATEST_TURN = wp.constant(wp.float64(1.0))
"""Greatest turn of a link [rad] in one step: beyond it the error estimate, made from four places, is no estimate."""


@functools.cache
def flight_memory(columns: int, first_row: int):
    """Views of flights' memory from ``first_row`` on, in scratch of this width.

    Returns:
        (the rows in segment order, the separators' rows of S, the separators' rows of the stages' system).
    """
    forces, friction = force_layout(columns), friction_layout(columns)
    count, width = FLIGHT_SYSTEM + 48, forces.columns
    offset = 8 * first_row * columns
    force_offset = offset + 8 * count * width
    friction_offset = force_offset + 8 * LANES * forces.separator_rows
    return (
        view(offset, count, width),
        view(force_offset, forces.separator_rows, LANES),
        view(friction_offset, friction.separator_rows, LANES),
    )


@functools.cache
def flight_method(columns: int, first_row: int):
    """Warp functions of rigid flight with memory from ``first_row`` on.

    Returns:
        ``attempt(K, chain, h, tolerance)`` → bits of the greatest error ratio (see :func:`order_bits`), and
        ``commit(K, chain, h)``, which projects the new state → whether joints may stay rigid.
    """
    table = ROS34PW2
    stages, gamma = table.stages, table.gamma
    nodes, couplings, weights, errors = table.nodes, table.couplings, table.weights, table.errors
    friction = friction_layout(columns)
    rigid = rigid_joints(columns)
    factorise, solve_forces = rigid.factorise, rigid.solve_forces
    close, begin, store, are_stiff = rigid.close, rigid.begin, rigid.store, rigid.are_stiff
    flight_rows_of, force_rows_of, friction_rows_of = flight_memory(columns, first_row)
    factor, solve = cyclic_solver(friction)
    lower, diagonal, upper = (friction.submatrix(k) for k in range(3))
    right = friction.right
    pad_stage = pad_behind((COSINE, SINE, SPIN))
    pad_target = pad_behind((TARGET,))
    pad_slopes = pad_joints((SLOPE,))
    pad_drag = pad_joints((DRAG,))
    pad_solution = pad_joints((right, right + 1))
    first = FIRST_STAGE_ROW

    @wp.func
    def prepare(S: Rows, chain: Chain, h: wp.float64, places: int, full: int):
        """Smoothing and slopes of friction for a step h, and the matrix of its stages."""
        a = chain.half_length
        g = wp.static(wp.float64(gamma)) * h
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            cosine, sine = cos_sin(S[wp.static(BASE + 2), c])
            S[COSINE, c] = cosine
            S[SINE, c] = sine
            S[SPIN, c] = S[wp.static(BASE + 5), c]
            S[TARGET, c] = S[wp.static(BASE_RATE + 2), c]
            c += 1
        pad_stage(S, places, full)
        pad_target(S, places, full)
        c = int(8)
        while c < end:
            inverse = switch_smoothing(chain, h, S[TARGET, c] - S[TARGET, c + 8])
            S[INVERSE_SMOOTHING, c] = inverse
            S[SLOPE, c] = g * steepness(S[VISCOUS, c], S[COULOMB, c], S[SPIN, c] - S[SPIN, c + 8], inverse)
            S[POWER, c] = ZERO
            c += 1
        pad_slopes(S, places, full)
        c = int(8)
        while c < end:
            repeats = c < 16 and c >= 8 + full
            tx = -a * S[SINE, c]
            ty = a * S[COSINE, c]
            m_left = S[INVERSE_MASS, c]
            m_right = S[INVERSE_MASS, c + 8]
            before = S[SLOPE, c - 8]
            here = S[SLOPE, c]
            S[wp.static(diagonal), c] = wp.where(repeats, ONE, m_left + m_right)
            S[wp.static(diagonal + 1), c] = ZERO
            S[wp.static(diagonal + 2), c] = wp.where(repeats, ZERO, tx)
            S[wp.static(diagonal + 3), c] = ZERO
            S[wp.static(diagonal + 4), c] = wp.where(repeats, ONE, m_left + m_right)
            S[wp.static(diagonal + 5), c] = wp.where(repeats, ZERO, ty)
            S[wp.static(diagonal + 6), c] = wp.where(repeats, ZERO, -tx)
            S[wp.static(diagonal + 7), c] = wp.where(repeats, ZERO, -ty)
            S[wp.static(diagonal + 8), c] = wp.where(repeats, ONE, S[INERTIA, c] + here + before)
            S[wp.static(lower), c] = wp.where(repeats, -ONE, -m_left)
            S[wp.static(lower + 1), c] = ZERO
            S[wp.static(lower + 2), c] = ZERO
            S[wp.static(lower + 3), c] = ZERO
            S[wp.static(lower + 4), c] = wp.where(repeats, -ONE, -m_left)
            S[wp.static(lower + 5), c] = ZERO
            S[wp.static(lower + 6), c] = wp.where(repeats, ZERO, -tx)
            S[wp.static(lower + 7), c] = wp.where(repeats, ZERO, -ty)
            S[wp.static(lower + 8), c] = wp.where(repeats, -ONE, -before)
            S[wp.static(upper), c] = wp.where(repeats, ZERO, -m_right)
            S[wp.static(upper + 1), c] = ZERO
            S[wp.static(upper + 2), c] = wp.where(repeats, ZERO, -a * S[SINE, c + 8])
            S[wp.static(upper + 3), c] = ZERO
            S[wp.static(upper + 4), c] = wp.where(repeats, ZERO, -m_right)
            S[wp.static(upper + 5), c] = wp.where(repeats, ZERO, a * S[COSINE, c + 8])
            S[wp.static(upper + 6), c] = ZERO
            S[wp.static(upper + 7), c] = ZERO
            S[wp.static(upper + 8), c] = wp.where(repeats, ZERO, -here)
            c += 1

    @wp.func
    def place_stage(S: Rows, stage: int, end: int):
        """Directions and rates of a stage, and Σ γ_ij k_j of the rates."""
        for i in range(wp.static(stages)):
            if stage == i:
                c = int(8)
                while c < end:
                    turn = ZERO
                    u = S[wp.static(BASE + 3), c]
                    v = S[wp.static(BASE + 4), c]
                    w = S[wp.static(BASE + 5), c]
                    cu = ZERO
                    cv = ZERO
                    cw = ZERO
                    for j in range(wp.static(i)):
                        ku = S[wp.static(first + 6 * j + 3), c]
                        kv = S[wp.static(first + 6 * j + 4), c]
                        kw = S[wp.static(first + 6 * j + 5), c]
                        turn += wp.static(wp.float64(nodes[i][j])) * S[wp.static(first + 6 * j + 2), c]
                        u += wp.static(wp.float64(nodes[i][j])) * ku
                        v += wp.static(wp.float64(nodes[i][j])) * kv
                        w += wp.static(wp.float64(nodes[i][j])) * kw
                        cu += wp.static(wp.float64(couplings[i][j])) * ku
                        cv += wp.static(wp.float64(couplings[i][j])) * kv
                        cw += wp.static(wp.float64(couplings[i][j])) * kw
                    S[TARGET, c] = S[wp.static(BASE + 2), c] + turn
                    S[STAGE_U, c] = u
                    S[STAGE_V, c] = v
                    S[SPIN, c] = w
                    S[COUPLED, c] = cu
                    S[wp.static(COUPLED + 1), c] = cv
                    S[wp.static(COUPLED + 2), c] = cw
                    c += 1
        c = int(8)
        while c < end:
            cosine, sine = cos_sin(S[TARGET, c])
            S[COSINE, c] = cosine
            S[SINE, c] = sine
            c += 1

    @wp.func
    def damp(S: Rows, R: Rows, h: wp.float64, weight: wp.float64, places: int, full: int):
        """Solves for (λ, y) of a stage from its accelerations; adds its part of the power lost to friction."""
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            coupled = S[wp.static(COUPLED + 2), c]
            S[TARGET, c] = h * S[wp.static(RATE + 2), c] + wp.static(wp.float64(1.0 / gamma)) * coupled
            c += 1
        pad_target(S, places, full)
        c = int(8)
        while c < end:
            S[DRAG, c] = S[SLOPE, c] * (S[TARGET, c] - S[TARGET, c + 8])
            S[POWER, c] = S[POWER, c] + weight * S[TORQUE, c] * (S[SPIN, c] - S[SPIN, c + 8])
            c += 1
        pad_drag(S, places, full)
        c = int(8)
        while c < end:
            repeats = c < 16 and c >= 8 + full
            S[wp.static(right), c] = ZERO
            S[wp.static(right + 1), c] = ZERO
            S[wp.static(right + 2), c] = wp.where(repeats, ZERO, S[DRAG, c - 8] - S[DRAG, c])
            c += 1
        solve(S, R, places)
        pad_solution(S, places, full)

    @wp.func
    def keep_stage(S: Rows, stage: int, h: wp.float64, end: int):
        """Stores k of a stage."""
        for i in range(wp.static(stages)):
            if stage == i:
                c = int(8)
                while c < end:
                    share = S[INVERSE_MASS, c]
                    ku = h * S[RATE, c] + share * (S[wp.static(right), c] - S[wp.static(right), c - 8])
                    kv = h * S[wp.static(RATE + 1), c] + share * (
                        S[wp.static(right + 1), c] - S[wp.static(right + 1), c - 8]
                    )
                    kw = h * S[wp.static(RATE + 2), c] + S[wp.static(right + 2), c]
                    S[wp.static(first + 6 * i + 3), c] = ku
                    S[wp.static(first + 6 * i + 4), c] = kv
                    S[wp.static(first + 6 * i + 5), c] = kw
                    ku = S[STAGE_U, c] + S[COUPLED, c] + wp.static(wp.float64(gamma)) * ku
                    kv = S[STAGE_V, c] + S[wp.static(COUPLED + 1), c] + wp.static(wp.float64(gamma)) * kv
                    kw = S[SPIN, c] + S[wp.static(COUPLED + 2), c] + wp.static(wp.float64(gamma)) * kw
                    S[wp.static(first + 6 * i), c] = h * ku
                    S[wp.static(first + 6 * i + 1), c] = h * kv
                    S[wp.static(first + 6 * i + 2), c] = h * kw
                    c += 1

    @wp.func
    def attempt(K: Rows, chain: Chain, h: wp.float64, tolerance: wp.float64):
        S = flight_rows_of(K)
        R = force_rows_of(K)
        Q = friction_rows_of(K)
        places, full, _ = segment_places(chain.link_count)
        end = place_column(places + 1)
        prepare(S, chain, h, places, full)
        factor(S, Q, places, full)
        stage = int(0)
        while stage < wp.static(stages):
            place_stage(S, stage, end)
            factorise(S, R, chain, places, full)
            solve_forces(S, R, chain, places, full)
            weight = ZERO
            for i in range(wp.static(stages)):
                if stage == i:
                    weight = wp.static(wp.float64(weights[i]))
            damp(S, Q, h, weight, places, full)
            keep_stage(S, stage, h, end)
            stage += 1
        worst = wp.int64(0)
        turned = wp.int64(0)
        c = int(8)
        while c < end:
            for k in range(6):
                value = S[wp.static(BASE + k), c]
                change = ZERO
                error = ZERO
                for j in range(wp.static(stages)):
                    change += wp.static(wp.float64(weights[j])) * S[wp.static(first + 6 * j + k), c]
                    error += wp.static(wp.float64(errors[j])) * S[wp.static(first + 6 * j + k), c]
                S[wp.static(NEW + k), c] = value + change
                rate = ZERO
                if wp.static(k < 3):
                    rate = S[wp.static(BASE + 3 + k), c]
                else:
                    rate = S[wp.static(BASE_RATE + k - 3), c]
                worst = wp.max(worst, error_bits(error, value, rate, h))
                if wp.static(k == 2):
                    turned = wp.max(turned, order_bits(change))
            c += 1
        greatest = order_bits(wp.cast(worst, wp.float64) / tolerance)
        # a greater turn counts as an error of 2: the step shrinks
        if wp.cast(turned, wp.float64) > GREATEST_TURN:
            greatest = wp.max(greatest, order_bits(TWO))
        return greatest

    @wp.func
    def commit(K: Rows, chain: Chain, h: wp.float64):
        S = flight_rows_of(K)
        R = force_rows_of(K)
        n = chain.link_count
        places, full, _ = segment_places(n)
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            for k in range(6):
                S[wp.static(BASE + k), c] = S[wp.static(NEW + k), c]
            S[POWER, c] = h * S[COUNTED, c] * S[POWER, c]
            c += 1
        p = int(0)
        while p < places:
            s = int(0)
            while s < 8:
                i = link_at(p, s, places, full, n)
                K[LOST_FRICTION, i] = K[LOST_FRICTION, i] + S[POWER, 8 * p + 8 + s]
                s += 1
            p += 1
        closed = close(S, R, chain, places, full)
        begin(S, R, chain, places, full)
        store(S, K, chain)
        return closed and are_stiff(S, chain, end)

    return attempt, commit
