"""The linear systems of the implicit step: the matrix M + g D + g² K and the right-hand sides of its stages.

A joint between link l on its left and link r on its right opens by C = (X_r − a u_r) − (X_l + a u_l) and pulls with
F = k C + b Ċ, where u is a link's direction and t = ẑ × u. Let δ be a change along Z and σ = g b + g² k. In
(g D + g² K) Z the joint then acts like the pull σ δC + g² b a (ω_l u_l δθ_l + ω_r u_r δθ_r); its last two terms come
from the turning of t in Ċ. The angle of either link enters this pull with the factor c = −σ a t + g² b a ω u. The
turning of t in the torque a t·F adds g² a u·F to the diagonal. So the submatrices D_i are diagonal:

    D_i = diag(m + 2σ, m + 2σ, I + 2σ a² + g (φ_i + φ_i₋₁) + g² a u·(F_i + F_i₋₁)),
    U_i = −(1; a t_iᵀ) (σ, c_i₊₁) − g φ_i,    L_i = (1; −a t_iᵀ) (−σ, c_i₋₁) − g φ_i₋₁,

where φ = f'(w) of the joints' friction, see :func:`friction_secant`, stands in the element of the two angles.

Stiff joints open by 1e-8 m. Rounding places to 1e-16 m changes their force by 1e-7 N. If this error differed between
stages, the error estimate would show it at tolerances of 1e-9, because it is a sum over the stages with coefficients up
to 100. So the opening of a stage is computed as that at the start plus its change, which is rounded a thousand times
more finely: all stages then share one error of 1e-16 m.
"""

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
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO
from warpchain.kernels.physics.geometry import end_velocities
from warpchain.kernels.physics.joint import friction_torque, joint_force
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})


UNSEEN = wp.constant(wp.float64(10.0))
"""Tolerances below which a joint's spin may be found sticking, see :func:`friction_secant`."""
SATURATED = wp.constant(wp.float64(4.0))
"""Spin over ω_c beyond which friction is constant to a thousandth."""


@wp.func
def opening(S: wp.array2d(dtype=wp.float64), chain: Chain, c: int, place: int, direction: int):
    """Opening C of the joint on the right of a link, or its change, from rows of places x, y and of directions."""
    a = chain.half_length
    return (
        (S[place, c + 8] - S[place, c]) - a * (S[direction, c + 8] + S[direction, c]),
        (S[place + 1, c + 8] - S[place + 1, c]) - a * (S[direction + 1, c + 8] + S[direction + 1, c]),
    )


@wp.func
def opening_rate(S: wp.array2d(dtype=wp.float64), chain: Chain, c: int, speed: int, direction: int):
    """Opening rate Ċ and spin of the joint on the right of a link, from rows of velocities and of directions."""
    a = chain.half_length
    _left_u, _left_v, right_u, right_v = end_velocities(
        S[speed, c], S[speed + 1, c], a * S[speed + 2, c], S[direction, c], S[direction + 1, c]
    )
    left_u, left_v, _right_u, _right_v = end_velocities(
        S[speed, c + 8], S[speed + 1, c + 8], a * S[speed + 2, c + 8], S[direction, c + 8], S[direction + 1, c + 8]
    )
    return left_u - right_u, left_v - right_v, S[speed + 2, c] - S[speed + 2, c + 8]


@wp.func
def stage_opening_rate(S: wp.array2d(dtype=wp.float64), chain: Chain, c: int):
    """:func:`opening_rate` at a stage's place, whose directions are those at the start plus their changes."""
    a = chain.half_length
    _left_u, _left_v, right_u, right_v = end_velocities(
        S[wp.static(NEW + 3), c],
        S[wp.static(NEW + 4), c],
        a * S[wp.static(NEW + 5), c],
        S[BASE_COSINE, c] + S[COSINE, c],
        S[BASE_SINE, c] + S[SINE, c],
    )
    left_u, left_v, _right_u, _right_v = end_velocities(
        S[wp.static(NEW + 3), c + 8],
        S[wp.static(NEW + 4), c + 8],
        a * S[wp.static(NEW + 5), c + 8],
        S[BASE_COSINE, c + 8] + S[COSINE, c + 8],
        S[BASE_SINE, c + 8] + S[SINE, c + 8],
    )
    return left_u - right_u, left_v - right_v, S[wp.static(NEW + 5), c] - S[wp.static(NEW + 5), c + 8]


@wp.func
def friction_secant(
    chain: Chain,
    tangent: wp.float64,
    torque: wp.float64,
    spin: wp.float64,
    spin_rate: wp.float64,
    omega: wp.float64,
    h: wp.float64,
    tolerance: wp.float64,
):
    """φ of a joint for a step h [N m s]: f'(w), or f(w)/w where the step would jump over the change of sign unseen.

    A sliding joint has hardly any f'(w). Near w = 0 each step overshoots zero by less than the tolerance, so the joint
    never sticks. Its errors then fall with h only, and the controller, which expects a higher order, stayed at steps of
    4 µs at a tolerance of 1e-3 where 1e-4 took 20 µs. With f(w)/w the joint sticks at once. It is used where w is
    beyond the smoothing (4 ω_c), would change its sign, and is below :data:`UNSEEN` tolerances of ω. Limits of 3, 30
    and none cost the same at 1e-3, but none adds rejected steps and errors at 1e-7. Steps that resolve the switch have
    f'(w), and with it the method's order.

    Args:
        chain: The joint's chain.
        tangent: f'(w) [N m s].
        torque: f(w) [N m].
        spin: w [rad/s].
        spin_rate: ẇ at the start of the step [rad/s²].
        omega: Angular velocity of the link on the joint's left [rad/s].
        h: Step [s].
        tolerance: Of the step's errors.
    """
    size = wp.abs(spin)
    turns_round = spin * (spin + h * spin_rate) < ZERO
    is_unseen = size < UNSEEN * tolerance * (ONE + wp.abs(omega))
    jumps = turns_round and is_unseen and size * chain.inverse_smoothing > SATURATED
    return wp.where(jumps, torque / wp.where(jumps, spin, ONE), tangent)


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
    """Right-hand side of the first stage, with r_q = g v and r_v = g v̇; begins the sums of the powers lost."""
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
    """Forces and torques of the joints at the stage's place, and D r_q / g; adds to the sums of the powers lost."""
    c = int(8)
    while c < end:
        cx, cy = opening(S, chain, c, NEW, COSINE)
        cx += S[BASE_OPENING_X, c + 8]
        cy += S[BASE_OPENING_Y, c + 8]
        cu, cv, spin = stage_opening_rate(S, chain, c)
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
    """Right-hand side M (r_q / g + r_v) + D r_q of a later stage."""
    a = chain.half_length
    c = int(8)
    while c < end:
        repeats = c < 16 and c >= 8 + full
        fx = S[FORCE_X, c + 8] - S[FORCE_X, c]
        fy = S[FORCE_Y, c + 8] - S[FORCE_Y, c]
        sum_x = S[FORCE_X, c + 8] + S[FORCE_X, c]
        sum_y = S[FORCE_Y, c + 8] + S[FORCE_Y, c]
        turn = a * ((S[BASE_COSINE, c] + S[COSINE, c]) * sum_y - (S[BASE_SINE, c] + S[SINE, c]) * sum_x)
        turn += S[TORQUE, c] - S[TORQUE, c + 8]
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
