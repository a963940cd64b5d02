"""The plane of a chain that may tilt: its motion, and what the links feel of it.

*State.* The chain stays plane. A point of it has the coordinates (x, y, ζ) in O + x e1 + y e2 + ζ e3, with e3 = e1 × e2
across the plane. Whatever moves within the plane belongs to the links, so Ȯ = u e3, and the plane turns at
ω = ω1 e1 + ω2 e2. The components of a room axis A along e1, e2, e3 obey

    Ȧ1 = −ω2 A3,    Ȧ2 = ω1 A3,    Ȧ3 = ω2 A1 − ω1 A2;    Ȯ·A = u A3.

A link moves across the plane at w = u + ω1 y − ω2 x. In the room Y points up; its components are called *up*, those of
X, along which the walk goes, *ahead*.

*Links.* With d = (cos θ, sin θ), p = ẑ × d and gravity along −up, forces and torques within the plane are joined by

    ẍ: −g up1 − ω2 w,    ÿ: −g up2 + ω1 w,    θ̈: −(p·ω)(d·ω).

*Plane.* A link is a rod along d with inertia I, and S = m h²/3 for its width 2h. With κ = 2 (ω1 ẏ − ω2 ẋ),

    | Σm    Σmy                −Σmx              | | u̇  |   | −Σmκ  − g up3 Σm                    |
    |       Σ(my² + S + I s²)  −Σ(mxy + I s c)   | | ω̇1 | = | −Σmyκ − g up3 Σmy − ω2 ΣIΩ − j1     |
    |                          Σ(mx² + S + I c²) | | ω̇2 |   |  Σmxκ + g up3 Σmx + ω1 ΣIΩ − j2     |

(symmetric; s, c: sine and cosine of θ; Ω = θ̇) and j = −ΣIΩ [d (p·ω) + p (d·ω)]. Half the quadratic form of the matrix
is the energy of the motion across the plane.

*Splitting.* The plane changes in 0.1 to 1 s, links within microseconds. So a step is: half a step of the plane with the
links frozen, a step of the links with the plane frozen, half a step of the plane, contacts. This is of second order in
the step. A half step is one of the midpoint rule. An upright plane at rest stays so exactly. With contacts before the
last half step, impulses make it a method of first order: in a walk of 20 links at 1e-9 that falls over the ledger of
energy then misses 8e-7 of the energy at the release, and 1e-9 as it is.

Functions here work on one row of :attr:`State.plane`, see :mod:`layout`.
"""

import warp as wp

from warpchain.kernels.layout import (
    AHEAD,
    INVERSE_00,
    INVERSE_01,
    INVERSE_02,
    INVERSE_11,
    INVERSE_12,
    INVERSE_22,
    ORIGIN,
    PLANE_MID,
    PLANE_SPEED,
    PLANE_TURN_X,
    PLANE_TURN_Y,
    PLANE_VALUES,
    SUM_MASS,
    SUM_MU,
    SUM_MV,
    SUM_MX,
    SUM_MY,
    SUM_SPIN,
    SUM_SPIN_COSINE,
    SUM_SPIN_SINE,
    SUM_XU,
    SUM_XV,
    SUM_XX,
    SUM_XY,
    SUM_YU,
    SUM_YV,
    SUM_YY,
    UP,
)
from warpchain.kernels.physics.elementary import HALF, ONE, TWO, quotient
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})

THIRD = wp.constant(wp.float64(1.0 / 3.0))
THREE_HALVES = wp.constant(wp.float64(1.5))


@wp.func
def plane_load(chain: Chain, x: wp.float64, y: wp.float64, arm_x: wp.float64, arm_y: wp.float64):
    """Accelerations (ẍ, ÿ [m/s²], θ̈ [rad/s²]) of a link by gravity and the motion of its plane."""
    across = chain.plane_speed + chain.turn_x * y - chain.turn_y * x
    about_rod = arm_x * chain.turn_x + arm_y * chain.turn_y
    across_rod = arm_x * chain.turn_y - arm_y * chain.turn_x
    ax = -chain.gravity * chain.up_x - chain.turn_y * across
    ay = chain.turn_x * across - chain.gravity * chain.up_y
    return ax, ay, -(about_rod * across_rod) * chain.inverse_square


@wp.func
def on_plane(own: Chain, P: wp.array(dtype=wp.float64), first: int) -> Chain:
    """The chain on the plane whose values begin at this row."""
    chain = own
    chain.plane_speed = P[first + PLANE_SPEED]
    chain.turn_x = P[first + PLANE_TURN_X]
    chain.turn_y = P[first + PLANE_TURN_Y]
    chain.up_x = P[first + UP]
    chain.up_y = P[first + UP + 1]
    chain.up_z = P[first + UP + 2]
    chain.origin_height = P[first + ORIGIN + 1]
    chain.inverse_square = ONE / (own.half_length * own.half_length)
    return chain


@wp.func
def place_terms(
    chain: Chain,
    mass: wp.float64,
    inertia: wp.float64,
    x: wp.float64,
    y: wp.float64,
    cosine: wp.float64,
    sine: wp.float64,
):
    """One link's part of the sums SUM_MASS … SUM_YY, in that order."""
    mx = mass * x
    my = mass * y
    side = mass * chain.half_width * chain.half_width * THIRD
    return (
        mass,
        mx,
        my,
        mx * x + side + inertia * cosine * cosine,
        mx * y + inertia * cosine * sine,
        my * y + side + inertia * sine * sine,
    )


@wp.func
def motion_terms(
    mass: wp.float64,
    inertia: wp.float64,
    x: wp.float64,
    y: wp.float64,
    u: wp.float64,
    v: wp.float64,
    omega: wp.float64,
    cosine: wp.float64,
    sine: wp.float64,
):
    """One link's part of the sums SUM_MU … SUM_SPIN_COSINE, in that order."""
    mu = mass * u
    mv = mass * v
    spin = inertia * omega
    return (
        mu,
        mv,
        x * mu,
        x * mv,
        y * mu,
        y * mv,
        spin,
        TWO * spin * sine * cosine,
        spin * (cosine * cosine - sine * sine),
    )


@wp.func
def invert_plane_mass(P: wp.array(dtype=wp.float64)):
    """Writes the inverse of the plane's mass matrix, from the sums."""
    a00 = P[SUM_MASS]
    a01 = P[SUM_MY]
    a02 = -P[SUM_MX]
    a11 = P[SUM_YY]
    a12 = -P[SUM_XY]
    a22 = P[SUM_XX]
    c00 = a11 * a22 - a12 * a12
    c01 = a02 * a12 - a01 * a22
    c02 = a01 * a12 - a02 * a11
    scale = quotient(ONE, a00 * c00 + a01 * c01 + a02 * c02)
    P[INVERSE_00] = c00 * scale
    P[INVERSE_01] = c01 * scale
    P[INVERSE_02] = c02 * scale
    P[INVERSE_11] = (a00 * a22 - a02 * a02) * scale
    P[INVERSE_12] = (a01 * a02 - a00 * a12) * scale
    P[INVERSE_22] = (a00 * a11 - a01 * a01) * scale


@wp.func
def plane_times_inverse(P: wp.array(dtype=wp.float64), q0: wp.float64, q1: wp.float64, q2: wp.float64):
    """A⁻¹ q: rates of (u, ω1, ω2) under generalised forces, or their change by impulses."""
    return (
        P[INVERSE_00] * q0 + P[INVERSE_01] * q1 + P[INVERSE_02] * q2,
        P[INVERSE_01] * q0 + P[INVERSE_11] * q1 + P[INVERSE_12] * q2,
        P[INVERSE_02] * q0 + P[INVERSE_12] * q1 + P[INVERSE_22] * q2,
    )


@wp.struct
class Plane:
    """Values of a plane, see :mod:`layout`."""

    speed: wp.float64
    turn_x: wp.float64
    turn_y: wp.float64
    ahead: wp.vec3d
    up: wp.vec3d
    origin: wp.vec3d


@wp.func
def read_plane(P: wp.array(dtype=wp.float64), first: int) -> Plane:
    """The plane whose values begin at this row."""
    plane = Plane()
    plane.speed = P[first + PLANE_SPEED]
    plane.turn_x = P[first + PLANE_TURN_X]
    plane.turn_y = P[first + PLANE_TURN_Y]
    plane.ahead = wp.vec3d(P[first + AHEAD], P[first + AHEAD + 1], P[first + AHEAD + 2])
    plane.up = wp.vec3d(P[first + UP], P[first + UP + 1], P[first + UP + 2])
    plane.origin = wp.vec3d(P[first + ORIGIN], P[first + ORIGIN + 1], P[first + ORIGIN + 2])
    return plane


@wp.func
def write_plane(P: wp.array(dtype=wp.float64), first: int, plane: Plane):
    """Writes a plane's values from this row on."""
    P[first + PLANE_SPEED] = plane.speed
    P[first + PLANE_TURN_X] = plane.turn_x
    P[first + PLANE_TURN_Y] = plane.turn_y
    for k in range(3):
        P[first + AHEAD + k] = plane.ahead[k]
        P[first + UP + k] = plane.up[k]
        P[first + ORIGIN + k] = plane.origin[k]


@wp.func
def plane_rates(P: wp.array(dtype=wp.float64), gravity: wp.float64, plane: Plane):
    """Rates of u, ω1 and ω2, from the sums over the links."""
    w1 = plane.turn_x
    w2 = plane.turn_y
    weight = gravity * plane.up[2]
    spin = P[SUM_SPIN]
    j1 = P[SUM_SPIN_SINE] * w1 - P[SUM_SPIN_COSINE] * w2
    j2 = -P[SUM_SPIN_COSINE] * w1 - P[SUM_SPIN_SINE] * w2
    q0 = -TWO * (w1 * P[SUM_MV] - w2 * P[SUM_MU]) - weight * P[SUM_MASS]
    q1 = -TWO * (w1 * P[SUM_YV] - w2 * P[SUM_YU]) - weight * P[SUM_MY] - w2 * spin - j1
    q2 = TWO * (w1 * P[SUM_XV] - w2 * P[SUM_XU]) + weight * P[SUM_MX] + w1 * spin - j2
    return plane_times_inverse(P, q0, q1, q2)


@wp.func
def axis_rate(axis: wp.vec3d, w1: wp.float64, w2: wp.float64):
    """Rates of the components of a room axis along e1, e2, e3."""
    return wp.vec3d(-w2 * axis[2], w1 * axis[2], w2 * axis[0] - w1 * axis[1])


@wp.func
def pushed(P: wp.array(dtype=wp.float64), gravity: wp.float64, start: Plane, slope: Plane, h: wp.float64) -> Plane:
    """The plane ``start`` and h times the rates that it has at ``slope``; links are frozen."""
    du, d1, d2 = plane_rates(P, gravity, slope)
    drift = wp.vec3d(slope.ahead[2], slope.up[2], slope.ahead[0] * slope.up[1] - slope.ahead[1] * slope.up[0])
    end = Plane()
    end.speed = start.speed + h * du
    end.turn_x = start.turn_x + h * d1
    end.turn_y = start.turn_y + h * d2
    end.ahead = start.ahead + h * axis_rate(slope.ahead, slope.turn_x, slope.turn_y)
    end.up = start.up + h * axis_rate(slope.up, slope.turn_x, slope.turn_y)
    end.origin = start.origin + (h * slope.speed) * drift
    return end


@wp.func
def straightened(plane: Plane) -> Plane:
    """The plane with room axes that are orthogonal unit vectors again, which they nearly are.

    A unit vector that is too long by ε has the factor (3 − y·y)/2 = 1 − ε, less ε² and higher powers.
    """
    straight = plane
    y = (THREE_HALVES - HALF * wp.dot(plane.up, plane.up)) * plane.up
    x = plane.ahead - wp.dot(plane.ahead, y) * y
    straight.up = y
    straight.ahead = (THREE_HALVES - HALF * wp.dot(x, x)) * x
    return straight


@wp.func
def half_step(P: wp.array(dtype=wp.float64), start: int, target: int, gravity: wp.float64, h: wp.float64):
    """Carries the plane at row ``start`` on by half of h, by the midpoint rule, to row ``target``; links are frozen."""
    half = HALF * h
    plane = read_plane(P, start)
    between = pushed(P, gravity, plane, plane, HALF * half)
    write_plane(P, target, straightened(pushed(P, gravity, plane, between, half)))


@wp.func
def accept_plane(P: wp.array(dtype=wp.float64)):
    """Makes the plane of the middle of the step the present one."""
    k = int(0)
    while k < PLANE_VALUES:
        P[k] = P[PLANE_MID + k]
        k += 1


@wp.func
def plane_energy(P: wp.array(dtype=wp.float64)):
    """Energy [J] of the motion across the plane, from the sums."""
    u = P[PLANE_SPEED]
    w1 = P[PLANE_TURN_X]
    w2 = P[PLANE_TURN_Y]
    square = P[SUM_MASS] * u * u + P[SUM_YY] * w1 * w1 + P[SUM_XX] * w2 * w2
    mixed = P[SUM_MY] * u * w1 - P[SUM_MX] * u * w2 - P[SUM_XY] * w1 * w2
    return HALF * square + mixed
