"""Flight on rigid joints: a W-method on the accelerations of :mod:`cpu.implicit.rigid`, with projections after a step.

Only joint friction is stiff, so the matrix of the method is that of friction under the constraint of the joints:
A = −P M⁻¹ D, where D = −∂Q/∂v has the slopes f'(w) of the joints' friction and P projects on Ċ = G v = 0. A stage
(1 − g A) z = r with g = hγ is (M + g D) z + Gᵀ λ = M r with G z = G r. Eliminating the links' x and y gives, with
y = z_θ − r_θ and joint i between the links l and r,

    (1/m_l + 1/m_r) λ_i − λ_i−1/m_l − λ_i+1/m_r + a (t_l y_l + t_r y_r) = 0,
    I_i y_i + g (D y)_i − a t_i·(λ_i + λ_i−1) = −g (D r_θ)_i:

a cyclic block-tridiagonal system (3 × 3) for (λ_i, y_i). Its symmetric part is positive definite: it needs no pivoting.

The spin w of some joint passes through zero a thousand times a second in a loop. Coulomb friction then changes its sign
within a millionth of a step; to resolve that, steps of a few µs would be needed. So friction is smoothed over a part of
the change of w in the step: tanh(w / max(ω_c, c h |ẇ|)). By symmetry this does not change the impulse of friction
during a passage through zero. A sticking joint has ẇ = 0 and keeps ω_c, and the smoothing vanishes with h. c = 0.2 was
best in a prototype: 0.05 gained nothing, and with 1 the larger errors outweighed the steps saved.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit import rigid_layout as at
from warpchain.kernels.cpu.implicit.rigid import are_stiff, begin, closing, factorise, solve_forces, store
from warpchain.kernels.cpu.implicit.rigid_layout import BASE, COUPLED, POWER, RATE, SINE, SLOPE, SPIN, STAGE, TARGET
from warpchain.kernels.cpu.implicit.solver import cyclic_solver, end_column, link_at, segment_places
from warpchain.kernels.layout import LOST_FRICTION
from warpchain.kernels.methods.controller import error_bits
from warpchain.kernels.methods.w_tableaus import COUPLINGS, ERRORS, GAMMA, NODES, STAGES, WEIGHTS
from warpchain.kernels.physics.elementary import TWO, ZERO, cos_sin, order_bits
from warpchain.kernels.physics.geometry import put, three
from warpchain.kernels.physics.rigid_joint import steepness, switch_smoothing
from warpchain.kernels.types import Chain, Rows

GREATEST_TURN = wp.constant(wp.float64(1.0))
"""Greatest turn of a link [rad] in one step: beyond it the error estimate, made from four places, is no estimate."""
G = wp.constant(wp.float64(GAMMA))
LOWER, DIAGONAL, UPPER = (at.FRICTION.submatrix(k) for k in range(3))
RIGHT = at.FRICTION.right
factor, solve = cyclic_solver(at.FRICTION)
nine = wp.types.vector(length=9, dtype=wp.float64)


@wp.func
def prepare(S: Rows, chain: Chain, h: wp.float64):
    """Smoothing and slopes of friction for a step h, and the factors of the matrix of its stages."""
    a = chain.half_length
    g = G * h
    c = int(8)
    while c < end_column(chain):
        cosine, sine = cos_sin(S[BASE + 2, c])
        put(S, SPIN, c, wp.vec3d(S[BASE + 5, c], cosine, sine))
        S[TARGET, c] = S[at.BASE_RATE + 2, c]
        c += 1
    at.pad_behind(S, SPIN, 3, chain)
    at.pad_behind(S, TARGET, 1, chain)
    c = int(8)
    while c < end_column(chain):
        inverse = switch_smoothing(chain, h, S[TARGET, c] - S[TARGET, c + 8])
        S[at.INVERSE_SMOOTHING, c] = inverse
        S[SLOPE, c] = g * steepness(S[at.VISCOUS, c], S[at.COULOMB, c], S[SPIN, c] - S[SPIN, c + 8], inverse)
        S[POWER, c] = ZERO
        c += 1
    at.pad_joints(S, SLOPE, 1, chain)
    c = int(8)
    while c < end_column(chain):
        tx = -a * S[SINE, c]
        ty = a * S[at.COSINE, c]
        after_tx = -a * S[SINE, c + 8]
        after_ty = a * S[at.COSINE, c + 8]
        left = S[at.INVERSE_MASS, c]
        right = S[at.INVERSE_MASS, c + 8]
        both = left + right
        before = S[SLOPE, c - 8]
        here = S[SLOPE, c]
        turning = S[at.INERTIA, c] + here + before
        put(S, LOWER, c, nine(-left, ZERO, ZERO, ZERO, -left, ZERO, -tx, -ty, -before))
        put(S, DIAGONAL, c, nine(both, ZERO, tx, ZERO, both, ty, -tx, -ty, turning))
        put(S, UPPER, c, nine(-right, ZERO, after_tx, ZERO, -right, after_ty, ZERO, ZERO, -here))
        c += 1
    places, full = segment_places(chain.link_count)
    factor(S, places, full)


@wp.func
def place_stage(S: Rows, stage: int, chain: Chain):
    """Directions and rates of a stage, and Σ γ_ij k_j of the rates."""
    for i in range(STAGES):
        if stage == i:
            c = int(8)
            while c < end_column(chain):
                turn = ZERO
                rate = three(S, BASE + 3, c)
                coupled = wp.vec3d(ZERO, ZERO, ZERO)
                for j in range(wp.static(i)):
                    k = three(S, STAGE + 6 * j + 3, c)
                    turn += wp.static(wp.float64(NODES[i][j])) * S[STAGE + 6 * j + 2, c]
                    rate += wp.static(wp.float64(NODES[i][j])) * k
                    coupled += wp.static(wp.float64(COUPLINGS[i][j])) * k
                S[TARGET, c] = S[BASE + 2, c] + turn
                put(S, at.STAGE_RATE, c, rate)
                put(S, COUPLED, c, coupled)
                c += 1
    c = int(8)
    while c < end_column(chain):
        cosine, sine = cos_sin(S[TARGET, c])
        put(S, at.COSINE, c, wp.vec2d(cosine, sine))
        c += 1


@wp.func
def damp(S: Rows, h: wp.float64, weight: wp.float64, chain: Chain):
    """Solves for (λ, y) of a stage from its accelerations; adds its part of the power lost to friction."""
    c = int(8)
    while c < end_column(chain):
        coupled = S[COUPLED + 2, c]  # not in the sum: clang would fuse the other product
        S[TARGET, c] = h * S[RATE + 2, c] + wp.static(wp.float64(1.0 / GAMMA)) * coupled
        c += 1
    at.pad_behind(S, TARGET, 1, chain)
    c = int(8)
    while c < end_column(chain):
        S[at.DRAG, c] = S[SLOPE, c] * (S[TARGET, c] - S[TARGET, c + 8])
        S[POWER, c] = S[POWER, c] + weight * S[at.TORQUE, c] * (S[SPIN, c] - S[SPIN, c + 8])
        c += 1
    at.pad_joints(S, at.DRAG, 1, chain)
    c = int(8)
    while c < end_column(chain):
        put(S, RIGHT, c, wp.vec3d(ZERO, ZERO, S[at.DRAG, c - 8] - S[at.DRAG, c]))
        c += 1
    places, full = segment_places(chain.link_count)
    solve(S, places, full)
    at.pad_joints(S, RIGHT, 2, chain)


@wp.func
def keep_stage(S: Rows, stage: int, h: wp.float64, chain: Chain):
    """Stores k of a stage."""
    for i in range(STAGES):
        if stage == i:
            c = int(8)
            while c < end_column(chain):
                share = S[at.INVERSE_MASS, c]
                ku = h * S[RATE, c] + share * (S[RIGHT, c] - S[RIGHT, c - 8])
                kv = h * S[RATE + 1, c] + share * (S[RIGHT + 1, c] - S[RIGHT + 1, c - 8])
                k = wp.vec3d(ku, kv, h * S[RATE + 2, c] + S[RIGHT + 2, c])
                put(S, STAGE + 6 * i + 3, c, k)
                put(S, STAGE + 6 * i, c, h * (three(S, at.STAGE_RATE, c) + three(S, COUPLED, c) + G * k))
                c += 1


@functools.cache
def flight_method(columns: int, first_row: int):
    """Warp functions of rigid flight with memory from ``first_row`` on.

    ``attempt(K, chain, h, tolerance)`` → bits of the greatest error ratio (see :func:`order_bits`);
    ``commit(K, chain, h)``, which projects the new state → whether joints may stay rigid.
    """
    rows = at.segment_rows(columns, first_row)
    close = closing(columns, first_row)

    @wp.func
    def attempt(K: Rows, chain: Chain, h: wp.float64, tolerance: wp.float64):
        S = rows(K)
        prepare(S, chain, h)
        stage = int(0)
        while stage < STAGES:
            place_stage(S, stage, chain)
            factorise(S, chain)
            solve_forces(S, chain)
            weight = ZERO
            for i in range(STAGES):
                if stage == i:
                    weight = wp.static(wp.float64(WEIGHTS[i]))
            damp(S, h, weight, chain)
            keep_stage(S, stage, h, chain)
            stage += 1
        worst = wp.int64(0)
        turned = wp.int64(0)
        c = int(8)
        while c < end_column(chain):
            for k in range(6):
                value = S[BASE + k, c]
                change = ZERO
                error = ZERO
                for j in range(STAGES):
                    change += wp.static(wp.float64(WEIGHTS[j])) * S[STAGE + 6 * j + k, c]
                    error += wp.static(wp.float64(ERRORS[j])) * S[STAGE + 6 * j + k, c]
                S[at.NEW + k, c] = value + change
                rate = S[wp.static(BASE + 3 + k if k < 3 else at.BASE_RATE + k - 3), c]
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
        S = rows(K)
        c = int(8)
        while c < end_column(chain):
            for k in range(6):
                S[BASE + k, c] = S[at.NEW + k, c]
            S[POWER, c] = h * S[at.COUNTED, c] * S[POWER, c]
            c += 1
        c = int(8)
        while c < end_column(chain):
            i, _is_copy = link_at(c, chain.link_count)
            K[LOST_FRICTION, i] = K[LOST_FRICTION, i] + S[POWER, c]
            c += 1
        closed = close(K, chain)
        begin(S, chain)
        store(S, K, chain)
        return closed and are_stiff(S, chain)

    return attempt, commit
