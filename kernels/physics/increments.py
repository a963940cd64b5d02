"""The algebra of a step in increments, in single or in double precision: one link or one joint a call.

CPU loops (:mod:`cpu.increments`) and GPU threads make steps of these functions.

The state (places q, velocities q̇) is in double precision: a joint is open by 3e-8 m where places are 1 m. The stages of
a step need differences only, which are formed in double precision at its start and then rounded. The joint between a
link and the next one, whose quantities are primed, is open by C₀ at the rate Ċ₀, and its links have the relative spin
w₀. A stage at the time c h displaces a link by

    c h q̇ + p,    p = h² Σ A k,    and changes its velocities by s = h Σ a k,

with the accelerations k of the stages before. Its angle changes by φ = c h ω + p_θ, and its arm r by c h ω ẑ×r + B with

    B = −(1 − cos φ) r + (p_θ − (φ − sin φ)) ẑ×r.

The even motion c h q̇ and c h ω ẑ×r changes C by c h Ċ₀, so that it need not be known of each link:

    C = C₀ + c h Ċ₀ + (p' − B') − (p + B).

p and B are 1e-8 m and less. So in single precision, too, C is known to 1e-15 m, and the force k C + b Ċ of a joint to
1e-7 of itself. Weight opens no joint: stages leave it out, and the new state falls by it as a whole.

On a plane that tilts each link has a load of its own, by gravity and the plane's motion. The new state falls by that
in the middle of the step; this is of second order, like the plane's own step. Such loads open joints, too: both ends of
a link are drawn to its centre by an acceleration G that free points there would not have, and the plane's motion loads
the two ends of an open joint differently. So stages shift a link's left end by G t²/2, at the rate G t, and its right
end by the opposite and what the opening of its joint adds.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.layout import COSINE, OMEGA, SINE, U, V, X, Y
from warpchain.kernels.physics import elementary
from warpchain.kernels.physics.elementary import LARGEST_TURN, T2, T3, T4, T5, T6, T7, T8
from warpchain.kernels.physics.geometry import end_positions, end_velocities
from warpchain.kernels.types import Chain, Rows

LEAST_TURN = 1e-9
"""A plane that turns more slowly [rad/s] loads no link: powers of smaller numbers are subnormal, and slow on CPUs."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    float e, r;
    asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(e) : "f"(fabsf(x) * 2.885390081777927f));
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(e + 1.0f));
    return __int_as_float(__float_as_int(fmaf(-2.0f, r, 1.0f)) | (__float_as_int(x) & 0x80000000));
#else
    const float low = x < 7.90531110763549805f ? x : 7.90531110763549805f;
    const float y = low > -7.90531110763549805f ? low : -7.90531110763549805f;
    const float z = y * y;
    const float above = (((((-2.76076847742355e-16f * z + 2.00018790482477e-13f) * z - 8.60467152213735e-11f) * z
        + 5.12229709037114e-08f) * z + 1.48572235717979e-05f) * z + 6.37261928875436e-04f) * z + 4.89352455891786e-03f;
    const float below = ((1.19825839466702e-06f * z + 1.18534705686654e-04f) * z + 2.26843463243900e-03f) * z
        + 4.89352518554385e-03f;
    return y * above / below;
#endif
""")
def tanh_single(x: wp.float32) -> wp.float32:
    """Hyperbolic tangent to 2e-7: on a CPU the rational function of Eigen (``ptanh_float``).

    A GPU's ``tanh.approx`` errs by 5e-4, so it takes its exponential function.
    """


@wp.func
def turn_single(turn: wp.float32):
    """1 − cos φ, and φ − sin φ, of a small turn φ [rad]; to rounding up to ``LARGEST_TURN``."""
    z = turn * turn
    versine = z * (wp.float32(1.0 / 2.0) - z * wp.float32(1.0 / 24.0))
    return versine, turn * z * (wp.float32(1.0 / 6.0) - z * wp.float32(1.0 / 120.0))


@wp.func
def turn_double(turn: wp.float64):
    """Likewise."""
    z = turn * turn
    versine = z * (T2 - z * (T4 - z * (T6 - z * T8)))
    return versine, turn * z * (T3 - z * (T5 - z * T7))


@dataclass(frozen=True)
class Increments:
    """Structs and Warp functions in one precision; of those without a struct of their own a joint's x and y alike."""

    Stage: Any  # what all links and joints have in common in a stage
    Joint: Any  # a joint at the start of a step
    Moved: Any  # a link in a stage
    PlaneMotion: Any  # what links feel of a plane that tilts
    EndLoad: Any  # what opens joints on it
    stage_at: Any  # ``(chain, h, ch)`` → Stage
    begin_joint: Any  # ``(K, half_length, i, j)`` → Joint of the right end of link i and the left end of link j
    start_force: Any  # ``(stage, opening, rate)`` → force [N] of a joint at the start of a step
    # ``(stage, arm_x, arm_y, omega, Σ a k: ẍ, ÿ, θ̈, Σ A k: ẍ, ÿ, θ̈)`` → Moved
    displace: Any
    # ``(stage, start force, rate, left of the next link, right of this one)`` → force [N] of a joint in a stage
    force: Any
    torque: Any  # ``(stage, viscous, coulomb, spin)`` → friction torque [N m] of a joint
    # ``(1/m, 1/I, arm_x, arm_y, left force x, y, left torque, right force x, y, right torque)`` → ẍ, ÿ, θ̈
    acceleration: Any
    plane_motion: Any  # ``(chain)`` → PlaneMotion
    # ``(plane, h/2, ω, arm_x, arm_y, opening x, y of the right joint)`` at the start of a step → EndLoad in the middle
    end_load: Any
    plane_load: Any  # ``(plane, h/2, K, half_length, i)``, likewise → ẍ, ÿ, θ̈ of link i
    ends_drawn: Any  # ``(stage, Moved, EndLoad)`` → Moved of a link with that load
    # ``(stage, error ẍ, ÿ, θ̈, value u, v, ω, rate ẍ, ÿ, θ̈, turn, 1/tolerance)`` → error ratio of a link
    error_ratio: Any


@functools.cache
def increments(real: Any) -> Increments:
    """The algebra in single (``wp.float32``) or double precision (``wp.float64``)."""
    is_single = real is wp.float32
    tanh = tanh_single if is_single else elementary.tanh
    small_turn = turn_single if is_single else turn_double
    quotient = elementary.quick_quotient if is_single else elementary.quotient

    @wp.struct
    class Stage:
        h: real  # the step [s]
        even: real  # c h [s], the time of the stage in it
        stiffness: real  # k [N/m]
        damping: real  # b [N s/m]
        inverse_smoothing: real  # 1/ω_c [s/rad]

    @wp.struct
    class Joint:
        x: real  # opening C₀ [m]
        y: real
        u: real  # its rate Ċ₀ [m/s]
        v: real
        spin: real  # ω of its left link less that of its right one [rad/s]

    @wp.struct
    class Moved:
        # k times way plus b times change of velocity of the link's ends, beyond even motion [N]
        left_x: real
        left_y: real
        right_x: real
        right_y: real
        # change of velocity of the ends [m/s]
        left_u: real
        left_v: real
        right_u: real
        right_v: real
        arm_x: real  # [m]
        arm_y: real
        spin: real  # change of ω [rad/s]

    @wp.struct
    class PlaneMotion:
        speed: real  # u [m/s], see physics.plane
        turn_x: real  # ω1, ω2 [rad/s]
        turn_y: real
        fall_x: real  # acceleration of gravity within the plane [m/s²]
        fall_y: real
        inverse_square: real  # 1/a² [1/m²]

    @wp.struct
    class EndLoad:
        left_x: real  # G [m/s²]
        left_y: real
        right_x: real  # its opposite, less what the opening of the right joint adds
        right_y: real
        turn: real  # θ̈ [rad/s²]

    @wp.func
    def turn_of_plane(rate: wp.float64):
        return wp.where(wp.abs(rate) < wp.static(wp.float64(LEAST_TURN)), real(0.0), real(rate))

    @wp.func
    def stage_at(chain: Chain, h: real, even: real) -> Stage:
        stage = Stage()
        stage.h = h
        stage.even = even
        stage.stiffness = real(chain.joint_stiffness)
        stage.damping = real(chain.joint_damping)
        stage.inverse_smoothing = real(chain.inverse_smoothing)
        return stage

    @wp.func
    def begin_joint(K: Rows, a: wp.float64, i: int, j: int) -> Joint:
        arm_x = a * K[COSINE, i]
        arm_y = a * K[SINE, i]
        next_x = a * K[COSINE, j]
        next_y = a * K[SINE, j]
        _x, _y, right_x, right_y = end_positions(K[X, i], K[Y, i], arm_x, arm_y)
        left_x, left_y, _x, _y = end_positions(K[X, j], K[Y, j], next_x, next_y)
        _u, _v, right_u, right_v = end_velocities(K[U, i], K[V, i], K[OMEGA, i], arm_x, arm_y)
        left_u, left_v, _u, _v = end_velocities(K[U, j], K[V, j], K[OMEGA, j], next_x, next_y)
        joint = Joint()
        joint.x = real(left_x - right_x)
        joint.y = real(left_y - right_y)
        joint.u = real(left_u - right_u)
        joint.v = real(left_v - right_v)
        joint.spin = real(K[OMEGA, i] - K[OMEGA, j])
        return joint

    @wp.func
    def start_force(stage: Stage, opening: real, rate: real):
        return stage.stiffness * opening + stage.damping * rate

    @wp.func
    def displace(
        stage: Stage, arm_x: real, arm_y: real, omega: real, su: real, sv: real, sw: real, px: real, py: real, pt: real
    ) -> Moved:
        square = stage.h * stage.h
        even = stage.even * omega
        shift = square * pt
        versine, lag = small_turn(even + shift)
        beyond = shift - lag
        # −B_x and B_y; likewise of the whole change of the arm
        bend_x = arm_x * versine + arm_y * beyond
        bend_y = arm_x * beyond - arm_y * versine
        turned_x = bend_x + arm_y * even
        turned_y = bend_y + arm_x * even
        moved = Moved()
        moved.spin = stage.h * sw
        moved.arm_x = arm_x - turned_x
        moved.arm_y = arm_y + turned_y
        swing_x = moved.spin * moved.arm_y + omega * turned_y
        swing_y = moved.spin * moved.arm_x - omega * turned_x
        give = stage.stiffness * square
        drag = stage.damping * stage.h
        pull_x = give * px + drag * su
        pull_y = give * py + drag * sv
        twist_x = stage.stiffness * bend_x + stage.damping * swing_x
        twist_y = stage.stiffness * bend_y + stage.damping * swing_y
        moved.left_x = pull_x + twist_x
        moved.left_y = pull_y - twist_y
        moved.right_x = pull_x - twist_x
        moved.right_y = pull_y + twist_y
        u = stage.h * su
        v = stage.h * sv
        moved.left_u = u + swing_x
        moved.left_v = v - swing_y
        moved.right_u = u - swing_x
        moved.right_v = v + swing_y
        return moved

    @wp.func
    def force(stage: Stage, start: real, rate: real, left: real, right: real):
        return start + (stage.even * stage.stiffness) * rate + (left - right)

    @wp.func
    def torque(stage: Stage, viscous: real, coulomb: real, spin: real):
        return viscous * spin + coulomb * tanh(spin * stage.inverse_smoothing)

    @wp.func
    def acceleration(
        inverse_mass: real,
        inverse_inertia: real,
        arm_x: real,
        arm_y: real,
        left_x: real,
        left_y: real,
        left_torque: real,
        right_x: real,
        right_y: real,
        right_torque: real,
    ):
        lever = arm_x * (right_y + left_y) - arm_y * (right_x + left_x)
        turn = (lever + left_torque - right_torque) * inverse_inertia
        return (right_x - left_x) * inverse_mass, (right_y - left_y) * inverse_mass, turn

    @wp.func
    def plane_motion(chain: Chain) -> PlaneMotion:
        plane = PlaneMotion()
        plane.speed = real(chain.plane_speed)
        plane.turn_x = turn_of_plane(chain.turn_x)
        plane.turn_y = turn_of_plane(chain.turn_y)
        plane.fall_x = real(-chain.gravity * chain.up_x)
        plane.fall_y = real(-chain.gravity * chain.up_y)
        plane.inverse_square = real(chain.inverse_square)
        return plane

    @wp.func
    def end_load(
        plane: PlaneMotion, half: real, omega: real, start_x: real, start_y: real, open_x: real, open_y: real
    ) -> EndLoad:
        arm_x = start_x - half * omega * start_y
        arm_y = start_y + half * omega * start_x
        about_rod = arm_x * plane.turn_x + arm_y * plane.turn_y
        across_rod = arm_x * plane.turn_y - arm_y * plane.turn_x
        stretch = across_rod * across_rod * plane.inverse_square
        across = plane.turn_x * open_y - plane.turn_y * open_x
        load = EndLoad()
        load.left_x = arm_x * stretch
        load.left_y = arm_y * stretch
        load.right_x = plane.turn_y * across - load.left_x
        load.right_y = -plane.turn_x * across - load.left_y
        load.turn = -(about_rod * across_rod) * plane.inverse_square
        return load

    @wp.func
    def plane_load(plane: PlaneMotion, half: real, K: Rows, a: real, i: int):
        none = real(0.0)
        turn = end_load(plane, half, real(K[OMEGA, i]), a * real(K[COSINE, i]), a * real(K[SINE, i]), none, none).turn
        x = real(K[X, i]) + half * real(K[U, i])
        y = real(K[Y, i]) + half * real(K[V, i])
        across = plane.speed + plane.turn_x * y - plane.turn_y * x
        return plane.fall_x - plane.turn_y * across, plane.fall_y + plane.turn_x * across, turn

    @wp.func
    def ends_drawn(stage: Stage, link: Moved, load: EndLoad) -> Moved:
        pull = stage.even * (real(0.5) * stage.stiffness * stage.even + stage.damping)
        moved = link
        moved.left_x += pull * load.left_x
        moved.left_y += pull * load.left_y
        moved.right_x += pull * load.right_x
        moved.right_y += pull * load.right_y
        moved.left_u += stage.even * load.left_x
        moved.left_v += stage.even * load.left_y
        moved.right_u += stage.even * load.right_x
        moved.right_v += stage.even * load.right_y
        moved.spin += stage.even * load.turn
        return moved

    @wp.func
    def error_ratio(
        stage: Stage,
        eu: real,
        ev: real,
        ew: real,
        u: real,
        v: real,
        omega: real,
        au: real,
        av: real,
        aw: real,
        turn: real,
        inverse_tolerance: real,
    ):
        # Errors of places are shorter by a step [s] and never the greatest. The greatest of three quotients takes one
        # division; the sum keeps a NaN.
        h = stage.h
        one = real(1.0)
        size = wp.abs(h * eu)
        divisor = one + wp.abs(u) + h * wp.abs(au)
        other = wp.abs(h * ev)
        scale = one + wp.abs(v) + h * wp.abs(av)
        is_less = other * divisor <= size * scale
        worst = wp.where(is_less, size, other)
        divisor = wp.where(is_less, divisor, scale)
        third = wp.abs(h * ew)
        scale = one + wp.abs(omega) + h * wp.abs(aw)
        is_less = third * divisor <= worst * scale
        worst = wp.where(is_less, worst, third)
        divisor = wp.where(is_less, divisor, scale)
        ratio = quotient(worst, divisor) * inverse_tolerance + real(0.0) * (size + other + third)
        # a turn beyond the polynomials' range counts as an error of 2: the step shrinks
        return wp.where(wp.abs(turn) > wp.static(real(float(LARGEST_TURN))), wp.max(ratio, real(2.0)), ratio)

    return Increments(
        Stage,
        Joint,
        Moved,
        PlaneMotion,
        EndLoad,
        stage_at,
        begin_joint,
        start_force,
        displace,
        force,
        torque,
        acceleration,
        plane_motion,
        end_load,
        plane_load,
        ends_drawn,
        error_ratio,
    )
