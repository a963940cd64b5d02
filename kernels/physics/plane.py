"""The plane of a chain that may tilt: its motion, and what the links feel of it.

*State.* The chain stays plane. A point of it has the coordinates (x, y, ζ) in O + x e1 + y e2 + ζ e3, with e3 = e1 × e2
across the plane. Whatever moves within the plane belongs to the links, so Ȯ = u e3, and the plane turns at
ω = ω1 e1 + ω2 e2. The components of a room axis A along e1, e2, e3 obey

    Ȧ1 = −ω2 A3,    Ȧ2 = ω1 A3,    Ȧ3 = ω2 A1 − ω1 A2;    Ȯ·A = u A3.

A link moves across the plane at w = u + ω1 y − ω2 x. In the room Y points up; its components are called *up*, those of
X, along which the walk goes, *ahead*.

*Links.* With d = (cos θ, sin θ), p = ẑ × d and gravity along −up, forces and torques within the plane are joined by

    ẍ: −g up1 − ω2 w,    ÿ: −g up2 + ω1 w,    θ̈: −(p·ω)(d·ω).

*Plane.* A link is a rod along d with inertia I, and S = m h²/3 for its width 2h. Across the plane the chain has the
momenta p = A (u, ω1, ω2),

        | Σm    Σmy                −Σmx              |
    A = |       Σ(my² + S + I s²)  −Σ(mxy + I s c)   |
        |                          Σ(mx² + S + I c²) |

(symmetric; s, c: sine and cosine of θ), and their energy is half of A's quadratic form. They obey

    ṗ0 = ω2 P1 − ω1 P2 − g up3 Σm,    ṗ1 = u P2 − ω2 L − g up3 Σmy,    ṗ2 = ω1 L − u P1 + g up3 Σmx

with the momentum within the plane, P = Σm(ẋ, ẏ), and its moment, L = Σm(xẏ − yẋ) + ΣI θ̇. Springs and impulses between
links change neither, and A depends on places only.

*Splitting.* The plane changes in 0.1 to 1 s, links within microseconds. So a step is: the plane carried on to its mean
over the step; a step of the links with the plane frozen there; the plane's own step at the rates of that mean, with the
mean of the sums before and after; contacts. This is of second order in the step. The mean, ν + h ν̇/2 + h² ν̈/6, is that
of a half step at the rates after h/3. They need Ȧ: for Σmx and Σmy that is P, for the second moments it is known from
the last two steps. An upright plane at rest stays so exactly. With contacts before the plane's step, impulses make it a
method of first order: in a walk of 20 links at 1e-9 that falls over the ledger of energy missed 8e-7 of the energy at
the release, and misses 1e-9 as it is.

Functions here work on one row of :attr:`Worlds.plane`, see :mod:`layout`.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import AHEAD, MOMENTUM, ORIGIN, RATE_XX, SUM_MU, SUM_MV, SUM_MX, SUM_MY, SUM_XX, UP
from warpchain.kernels.physics.elementary import HALF, ONE, quotient
from warpchain.kernels.types import Chain, Row, Rows

THIRD = wp.constant(wp.float64(1.0 / 3.0))
FIVE_SIXTHS = wp.constant(wp.float64(5.0 / 6.0))
THREE_HALVES = wp.constant(wp.float64(1.5))


@wp.func
def on_plane(own: Chain, P: Row, first: int) -> Chain:
    """The chain on the plane whose values begin at this row."""
    chain = own
    chain.plane_speed = P[first + layout.PLANE_SPEED]
    chain.turn_x = P[first + layout.PLANE_TURN_X]
    chain.turn_y = P[first + layout.PLANE_TURN_Y]
    chain.up_x = P[first + UP]
    chain.up_y = P[first + UP + 1]
    chain.up_z = P[first + UP + 2]
    chain.origin_height = P[first + ORIGIN + 1]
    return chain


@wp.func
def place_terms(K: Rows, chain: Chain, i: int):
    """Link i's part of the sums SUM_MX … SUM_YY, in that order."""
    mass = K[layout.MASS, i]
    inertia = K[layout.INERTIA, i]
    x = K[layout.X, i]
    y = K[layout.Y, i]
    cosine = K[layout.COSINE, i]
    sine = K[layout.SINE, i]
    mx = mass * x
    my = mass * y
    side = mass * chain.half_width * chain.half_width * THIRD
    xx = mx * x + side + inertia * cosine * cosine
    yy = my * y + side + inertia * sine * sine
    return mx, my, xx, mx * y + inertia * cosine * sine, yy


@wp.func
def motion_terms(K: Rows, i: int):
    """Link i's part of the sums SUM_MU, SUM_MV and SUM_MOMENT, in that order."""
    mu = K[layout.MASS, i] * K[layout.U, i]
    mv = K[layout.MASS, i] * K[layout.V, i]
    return mu, mv, K[layout.X, i] * mv - K[layout.Y, i] * mu + K[layout.INERTIA, i] * K[layout.OMEGA, i]


@wp.func
def invert_mass(P: Row):
    """Writes the inverse of the plane's mass matrix, from the sums."""
    a00 = P[layout.SUM_MASS]
    a01 = P[SUM_MY]
    a02 = -P[SUM_MX]
    a11 = P[layout.SUM_YY]
    a12 = -P[layout.SUM_XY]
    a22 = P[SUM_XX]
    c00 = a11 * a22 - a12 * a12
    c01 = a02 * a12 - a01 * a22
    c02 = a01 * a12 - a02 * a11
    scale = quotient(ONE, a00 * c00 + a01 * c01 + a02 * c02)
    P[layout.INVERSE_00] = c00 * scale
    P[layout.INVERSE_01] = c01 * scale
    P[layout.INVERSE_02] = c02 * scale
    P[layout.INVERSE_11] = (a00 * a22 - a02 * a02) * scale
    P[layout.INVERSE_12] = (a01 * a02 - a00 * a12) * scale
    P[layout.INVERSE_22] = (a00 * a11 - a01 * a01) * scale


@wp.func
def plane_times_inverse(P: Row, q: wp.vec3d):
    """A⁻¹ q: rates of (u, ω1, ω2) under generalised forces, or their change by impulses."""
    return wp.vec3d(
        P[layout.INVERSE_00] * q[0] + P[layout.INVERSE_01] * q[1] + P[layout.INVERSE_02] * q[2],
        P[layout.INVERSE_01] * q[0] + P[layout.INVERSE_11] * q[1] + P[layout.INVERSE_12] * q[2],
        P[layout.INVERSE_02] * q[0] + P[layout.INVERSE_12] * q[1] + P[layout.INVERSE_22] * q[2],
    )


@wp.struct
class Plane:
    """Values of a plane, see :mod:`layout`."""

    rates: wp.vec3d  # u, ω1, ω2
    ahead: wp.vec3d
    up: wp.vec3d
    origin: wp.vec3d


@wp.func
def next_three(P: Row, first: int):
    """Three values from this row on."""
    return wp.vec3d(P[first], P[first + 1], P[first + 2])


@wp.func
def read_plane(P: Row, first: int) -> Plane:
    """The plane whose values begin at this row."""
    rates = next_three(P, first + layout.PLANE_SPEED)
    return Plane(rates, next_three(P, first + AHEAD), next_three(P, first + UP), next_three(P, first + ORIGIN))


@wp.func
def write_plane(P: Row, first: int, plane: Plane):
    """Writes a plane's values from this row on."""
    for k in range(3):
        P[first + layout.PLANE_SPEED + k] = plane.rates[k]
        P[first + AHEAD + k] = plane.ahead[k]
        P[first + UP + k] = plane.up[k]
        P[first + ORIGIN + k] = plane.origin[k]


@wp.func
def momenta(P: Row, plane: Plane):
    """A (u, ω1, ω2), from the sums."""
    u = plane.rates[0]
    w1 = plane.rates[1]
    w2 = plane.rates[2]
    return wp.vec3d(
        P[layout.SUM_MASS] * u + P[SUM_MY] * w1 - P[SUM_MX] * w2,
        P[SUM_MY] * u + P[layout.SUM_YY] * w1 - P[layout.SUM_XY] * w2,
        P[SUM_XX] * w2 - P[SUM_MX] * u - P[layout.SUM_XY] * w1,
    )


@wp.func
def momentum_rates(P: Row, gravity: wp.float64, plane: Plane):
    """Rates of the plane's momenta, from the sums."""
    weight = gravity * plane.up[2]
    return wp.vec3d(
        plane.rates[2] * P[SUM_MU] - plane.rates[1] * P[SUM_MV] - weight * P[layout.SUM_MASS],
        plane.rates[0] * P[SUM_MV] - plane.rates[2] * P[layout.SUM_MOMENT] - weight * P[SUM_MY],
        plane.rates[1] * P[layout.SUM_MOMENT] - plane.rates[0] * P[SUM_MU] + weight * P[SUM_MX],
    )


@wp.func
def axis_rate(axis: wp.vec3d, rates: wp.vec3d):
    """Rates of the components of a room axis along e1, e2, e3, on a plane with the rates (u, ω1, ω2)."""
    return wp.vec3d(-rates[2] * axis[2], rates[1] * axis[2], rates[2] * axis[0] - rates[1] * axis[1])


@wp.func
def moved(start: Plane, slope: Plane, h: wp.float64) -> Plane:
    """The plane ``start`` with its place and attitude moved for h as ``slope`` moves."""
    drift = wp.vec3d(slope.ahead[2], slope.up[2], slope.ahead[0] * slope.up[1] - slope.ahead[1] * slope.up[0])
    end = start
    end.ahead = start.ahead + h * axis_rate(slope.ahead, slope.rates)
    end.up = start.up + h * axis_rate(slope.up, slope.rates)
    end.origin = start.origin + (h * slope.rates[0]) * drift
    return end


@wp.func
def pushed(P: Row, gravity: wp.float64, start: Plane, slope: Plane, h: wp.float64) -> Plane:
    """The plane ``start`` and h times the rates that it has at ``slope``, with A ν̇ = ṗ − Ȧ ν."""
    u = slope.rates[0]
    w1 = slope.rates[1]
    w2 = slope.rates[2]
    change = wp.vec3d(
        P[SUM_MV] * w1 - P[SUM_MU] * w2,
        P[SUM_MV] * u + P[RATE_XX + 2] * w1 - P[RATE_XX + 1] * w2,
        P[RATE_XX] * w2 - P[SUM_MU] * u - P[RATE_XX + 1] * w1,
    )
    end = moved(start, slope, h)
    end.rates = start.rates + h * plane_times_inverse(P, momentum_rates(P, gravity, slope) - change)
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
def begin_step(P: Row, gravity: wp.float64, h: wp.float64):
    """Writes the mean of the plane over a step, and its momenta after the first half."""
    half = HALF * h
    plane = read_plane(P, 0)
    mean = pushed(P, gravity, plane, pushed(P, gravity, plane, plane, THIRD * h), half)
    write_plane(P, layout.PLANE_MID, mean)
    momentum = momenta(P, plane) + half * momentum_rates(P, gravity, mean)
    for k in range(3):
        P[MOMENTUM + k] = momentum[k]
        P[layout.START_XX + k] = P[SUM_XX + k]


@wp.func
def end_step(P: Row, gravity: wp.float64, h: wp.float64):
    """Carries the plane to the end of the step that has begun; the sums must be those of the links there."""
    half = HALF * h
    inverse = quotient(ONE, h)
    for k in range(3):
        # from the middle of this step to a third of the next, which is taken to be as long
        rate = inverse * (P[SUM_XX + k] - P[layout.START_XX + k])
        P[RATE_XX + k] = rate + FIVE_SIXTHS * (rate - P[layout.MEAN_RATE_XX + k])
        P[layout.MEAN_RATE_XX + k] = rate
    mean = read_plane(P, layout.PLANE_MID)
    end = straightened(moved(read_plane(P, 0), mean, h))
    end.rates = plane_times_inverse(P, next_three(P, MOMENTUM) + half * momentum_rates(P, gravity, mean))
    write_plane(P, 0, end)


@wp.func
def plane_energy(P: Row):
    """Energy [J] of the motion across the plane, from the sums."""
    plane = read_plane(P, 0)
    return HALF * wp.dot(plane.rates, momenta(P, plane))
