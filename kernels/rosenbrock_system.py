"""The linear systems of the implicit step: the matrix M + g D + g² K and the right-hand sides of its stages.

A joint between link l on its left and link r on its right opens by C = (X_r − a u_r) − (X_l + a u_l) and pulls with
F = k C + b Ċ. With σ = g b + g² k its part of the matrix is g F ≙ σ δC + g² b a (ω_l u_l δθ_l + ω_r u_r δθ_r), where
the last two terms come from the turning of t in Ċ; that of t in the torque a t·F adds g² a u·F to the diagonal. Both
links' columns of the first part are c = −σ a t + g² b a ω u. So the diagonal blocks are diagonal:

    D_i = diag(m + 2σ, m + 2σ, I + 2σ a² + g (φ_i + φ_i₋₁) + g² a u·(F_i + F_i₋₁)),
    U_i = −(1; a t_iᵀ) (σ, c_i₊₁) − g φ_i,    L_i = (1; −a t_iᵀ) (−σ, c_i₋₁) − g φ_i₋₁,

with φ = f'(w) of the joints' friction, in the corner of the angles.
"""

import warp as wp

from .elementary import ONE, TWO, ZERO
from .geometry import end_positions, end_velocities
from .joint import friction_torque, joint_force
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
    COSINE,
    DIAGONAL,
    DRIVE,
    FORCE_X,
    FORCE_Y,
    INERTIA,
    LOWER,
    MASS,
    NEW,
    POWER_DAMPING,
    POWER_FRICTION,
    RIGHT_SIDE,
    SHIFT,
    SHIFT_TORQUE,
    SHIFT_X,
    SHIFT_Y,
    SINE,
    SLOPE,
    TORQUE,
    UPPER,
)
from .types import Chain

wp.set_module_options({"enable_backward": False})


@wp.func
def opening(S: wp.array2d(dtype=wp.float64), chain: Chain, c: int, place: int, direction: int):
    """Opening C of the joint on the right of a link, from the rows of places x, y and of directions."""
    _left_x, _left_y, right_x, right_y = end_positions(
        chain, S[place, c], S[place + 1, c], S[direction, c], S[direction + 1, c]
    )
    left_x, left_y, _right_x, _right_y = end_positions(
        chain, S[place, c + 8], S[place + 1, c + 8], S[direction, c + 8], S[direction + 1, c + 8]
    )
    return left_x - right_x, left_y - right_y


@wp.func
def opening_rate(S: wp.array2d(dtype=wp.float64), chain: Chain, c: int, speed: int, direction: int):
    """Opening rate Ċ of that joint and its spin, from the rows of velocities u, v, ω and of directions."""
    _left_u, _left_v, right_u, right_v = end_velocities(
        chain, S[speed, c], S[speed + 1, c], S[speed + 2, c], S[direction, c], S[direction + 1, c]
    )
    left_u, left_v, _right_u, _right_v = end_velocities(
        chain, S[speed, c + 8], S[speed + 1, c + 8], S[speed + 2, c + 8], S[direction, c + 8], S[direction + 1, c + 8]
    )
    return left_u - right_u, left_v - right_v, S[speed + 2, c] - S[speed + 2, c + 8]


@wp.func
def assemble(S: wp.array2d(dtype=wp.float64), chain: Chain, g: wp.float64, end: int, full: int):
    """The matrix M + g D + g² K."""
    a = chain.half_length
    gg = g * g
    sigma = g * chain.joint_damping + gg * chain.joint_stiffness
    turning = gg * chain.joint_damping * a
    c = int(8)
    while c < end:
        repeats = c < 16 and c >= 8 + full
        tx = -S[BASE_SINE, c]
        ty = S[BASE_COSINE, c]
        before_x = sigma * a * S[BASE_SINE, c - 8] + turning * S[wp.static(BASE + 5), c - 8] * S[BASE_COSINE, c - 8]
        before_y = turning * S[wp.static(BASE + 5), c - 8] * S[BASE_SINE, c - 8] - sigma * a * S[BASE_COSINE, c - 8]
        after_x = sigma * a * S[BASE_SINE, c + 8] + turning * S[wp.static(BASE + 5), c + 8] * S[BASE_COSINE, c + 8]
        after_y = turning * S[wp.static(BASE + 5), c + 8] * S[BASE_SINE, c + 8] - sigma * a * S[BASE_COSINE, c + 8]
        force_x = S[BASE_FORCE_X, c] + S[BASE_FORCE_X, c + 8]
        force_y = S[BASE_FORCE_Y, c] + S[BASE_FORCE_Y, c + 8]
        own = TWO * sigma * a * a + g * (S[SLOPE, c] + S[SLOPE, c + 8])
        own = S[INERTIA, c] + own + gg * a * (ty * force_x - tx * force_y)
        level = S[MASS, c] + TWO * sigma
        S[wp.static(DIAGONAL), c] = wp.where(repeats, ONE, level)
        S[wp.static(DIAGONAL + 1), c] = ZERO
        S[wp.static(DIAGONAL + 2), c] = ZERO
        S[wp.static(DIAGONAL + 3), c] = ZERO
        S[wp.static(DIAGONAL + 4), c] = wp.where(repeats, ONE, level)
        S[wp.static(DIAGONAL + 5), c] = ZERO
        S[wp.static(DIAGONAL + 6), c] = ZERO
        S[wp.static(DIAGONAL + 7), c] = ZERO
        S[wp.static(DIAGONAL + 8), c] = wp.where(repeats, ONE, own)
        S[wp.static(LOWER), c] = wp.where(repeats, -ONE, -sigma)
        S[wp.static(LOWER + 1), c] = ZERO
        S[wp.static(LOWER + 2), c] = wp.where(repeats, ZERO, before_x)
        S[wp.static(LOWER + 3), c] = ZERO
        S[wp.static(LOWER + 4), c] = wp.where(repeats, -ONE, -sigma)
        S[wp.static(LOWER + 5), c] = wp.where(repeats, ZERO, before_y)
        S[wp.static(LOWER + 6), c] = wp.where(repeats, ZERO, sigma * a * tx)
        S[wp.static(LOWER + 7), c] = wp.where(repeats, ZERO, sigma * a * ty)
        corner = -a * (tx * before_x + ty * before_y) - g * S[SLOPE, c]
        S[wp.static(LOWER + 8), c] = wp.where(repeats, -ONE, corner)
        S[wp.static(UPPER), c] = wp.where(repeats, ZERO, -sigma)
        S[wp.static(UPPER + 1), c] = ZERO
        S[wp.static(UPPER + 2), c] = wp.where(repeats, ZERO, -after_x)
        S[wp.static(UPPER + 3), c] = ZERO
        S[wp.static(UPPER + 4), c] = wp.where(repeats, ZERO, -sigma)
        S[wp.static(UPPER + 5), c] = wp.where(repeats, ZERO, -after_y)
        S[wp.static(UPPER + 6), c] = wp.where(repeats, ZERO, -sigma * a * tx)
        S[wp.static(UPPER + 7), c] = wp.where(repeats, ZERO, -sigma * a * ty)
        corner = -a * (tx * after_x + ty * after_y) - g * S[SLOPE, c + 8]
        S[wp.static(UPPER + 8), c] = wp.where(repeats, ZERO, corner)
        c += 1


@wp.func
def first_right_hand_side(
    S: wp.array2d(dtype=wp.float64), chain: Chain, g: wp.float64, weight: wp.float64, end: int, full: int
):
    """Of the stage at the start of the step, r_q = g v and r_v = g v̇; begins the sums of the powers lost."""
    a = chain.half_length
    b = chain.joint_damping
    c = int(8)
    while c < end:
        repeats = c < 16 and c >= 8 + full
        gx = b * (S[BASE_RATE_X, c + 8] - S[BASE_RATE_X, c])
        gy = b * (S[BASE_RATE_Y, c + 8] - S[BASE_RATE_Y, c])
        sum_gx = b * (S[BASE_RATE_X, c + 8] + S[BASE_RATE_X, c])
        sum_gy = b * (S[BASE_RATE_Y, c + 8] + S[BASE_RATE_Y, c])
        gt = S[SLOPE, c + 8] * S[BASE_SPIN, c + 8] - S[SLOPE, c] * S[BASE_SPIN, c]
        gt = gt - a * (S[BASE_COSINE, c] * sum_gy - S[BASE_SINE, c] * sum_gx)
        m = S[MASS, c]
        sx = S[wp.static(BASE + 3), c]
        sy = S[wp.static(BASE + 4), c]
        st = S[wp.static(BASE + 5), c]
        rx = m * (g * S[BASE_RATE, c] + sx) - g * gx
        ry = m * (g * S[wp.static(BASE_RATE + 1), c] + sy) - g * gy
        rt = S[INERTIA, c] * (g * S[wp.static(BASE_RATE + 2), c] + st) + g * gt
        S[SHIFT, c] = sx
        S[wp.static(SHIFT + 1), c] = sy
        S[wp.static(SHIFT + 2), c] = st
        S[wp.static(RIGHT_SIDE), c] = wp.where(repeats, ZERO, rx)
        S[wp.static(RIGHT_SIDE + 1), c] = wp.where(repeats, ZERO, ry)
        S[wp.static(RIGHT_SIDE + 2), c] = wp.where(repeats, ZERO, rt)
        rate_x = S[BASE_RATE_X, c + 8]
        rate_y = S[BASE_RATE_Y, c + 8]
        friction = S[BASE_TORQUE, c + 8] * S[BASE_SPIN, c + 8]
        S[POWER_FRICTION, c + 8] = weight * friction
        S[POWER_DAMPING, c + 8] = weight * (b * (rate_x * rate_x + rate_y * rate_y))
        c += 1


@wp.func
def pull_joints(S: wp.array2d(dtype=wp.float64), chain: Chain, weight: wp.float64, end: int):
    """Forces and torques of the joints at the stage's place, and D r_q / g; sums up the powers lost."""
    c = int(8)
    while c < end:
        cx, cy = opening(S, chain, c, NEW, COSINE)
        cu, cv, spin = opening_rate(S, chain, c, wp.static(NEW + 3), COSINE)
        torque = friction_torque(chain, spin)
        S[FORCE_X, c + 8] = joint_force(chain, cx, cu)
        S[FORCE_Y, c + 8] = joint_force(chain, cy, cv)
        S[TORQUE, c + 8] = torque
        sx, sy, shift_spin = opening_rate(S, chain, c, SHIFT, BASE_COSINE)
        S[SHIFT_X, c + 8] = chain.joint_damping * sx
        S[SHIFT_Y, c + 8] = chain.joint_damping * sy
        S[SHIFT_TORQUE, c + 8] = S[SLOPE, c + 8] * shift_spin
        damping = chain.joint_damping * (cu * cu + cv * cv)
        S[POWER_FRICTION, c + 8] = S[POWER_FRICTION, c + 8] + weight * (torque * spin)
        S[POWER_DAMPING, c + 8] = S[POWER_DAMPING, c + 8] + weight * damping
        c += 1


@wp.func
def right_hand_side(S: wp.array2d(dtype=wp.float64), chain: Chain, g: wp.float64, end: int, full: int):
    """M (r_q / g + r_v) + D r_q of the stage."""
    a = chain.half_length
    c = int(8)
    while c < end:
        repeats = c < 16 and c >= 8 + full
        fx = S[FORCE_X, c + 8] - S[FORCE_X, c]
        fy = S[FORCE_Y, c + 8] - S[FORCE_Y, c]
        sum_x = S[FORCE_X, c + 8] + S[FORCE_X, c]
        sum_y = S[FORCE_Y, c + 8] + S[FORCE_Y, c]
        turn = a * (S[COSINE, c] * sum_y - S[SINE, c] * sum_x) + S[TORQUE, c] - S[TORQUE, c + 8]
        gx = S[SHIFT_X, c + 8] - S[SHIFT_X, c]
        gy = S[SHIFT_Y, c + 8] - S[SHIFT_Y, c]
        sum_gx = S[SHIFT_X, c + 8] + S[SHIFT_X, c]
        sum_gy = S[SHIFT_Y, c + 8] + S[SHIFT_Y, c]
        gt = S[SHIFT_TORQUE, c + 8] - S[SHIFT_TORQUE, c]
        gt = gt - a * (S[BASE_COSINE, c] * sum_gy - S[BASE_SINE, c] * sum_gx)
        m = S[MASS, c]
        rx = g * (fx - gx) + m * (S[DRIVE, c] + S[SHIFT, c])
        ry = g * (fy - m * chain.gravity - gy) + m * (S[wp.static(DRIVE + 1), c] + S[wp.static(SHIFT + 1), c])
        rt = g * (turn + gt) + S[INERTIA, c] * (S[wp.static(DRIVE + 2), c] + S[wp.static(SHIFT + 2), c])
        S[wp.static(RIGHT_SIDE), c] = wp.where(repeats, ZERO, rx)
        S[wp.static(RIGHT_SIDE + 1), c] = wp.where(repeats, ZERO, ry)
        S[wp.static(RIGHT_SIDE + 2), c] = wp.where(repeats, ZERO, rt)
        c += 1
