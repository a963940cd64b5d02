"""Loads multiplied by one number λ: under them a loop on its sprocket becomes stationary λ times sooner.

A loop of mass ρ per length that runs at speed v is under the tension T = ρ v² + T_e. Waves on it move at v ± √(T/ρ) as
seen from the ground. The slow ones move at T_e / 2ρv, 0.3 to 0.5 m/s, and take seconds to cross the loop, which swings
meanwhile. With shear N, moment M, curvature κ, tangent t, normal n and rotary inertia j per length, the stationary
curve obeys

    (T_e t + N n)' + ρ g = 0,    M' + N = j v² κ',    M = β ℓ v κ' + τ_c tanh(ℓ v κ' / ω_c).

ρ v² has dropped out. So g, β, τ_c and j may all be multiplied by λ: T_e, N and M are multiplied by λ too, the curve
stays, and the slow waves run λ times faster.

*Rotary inertia.* For rigid links j = (I − m ℓ²/6)/ℓ. This follows from the exact dispersion of plane waves of phase φ
per link, ω² [m cos²(φ/2) + (4I/ℓ²) sin²(φ/2)] = (4T/ℓ) sin²(φ/2). Waves that stand still in space have ω = φ v/ℓ, and
to fourth order T_e φ²/ℓ = (m v²/ℓ²) φ⁴ (I/mℓ² − 1/6). So I − m ℓ²/6 is multiplied, with each link's own m. Multiplying
I or I − m ℓ²/12 leads to another curve.

*Drag.* A link of a stationary loop moves along its path. A force −γ m v_n against the velocity v_n across the path
damps every change of shape and vanishes in the stationary state. A link is a chord of its path: its direction and that
of the path at its middle differ by (θ_{i+1} − 2θ_i + θ_{i−1})/12. Without drag a loop of 180 links at 10 Hz swings for
15 periods, for any λ, and the remaining amplitude is multiplied by √λ when λ falls at once. With drag the swing is over
after one period, and the remaining bias is divided by λ. γ is proportional to λ − 1: drag ends with scaled loads.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import COSINE, COULOMB, INERTIA, MASS, OWN_MASS, OWN_RADIUS, RADIUS, SINE, VISCOUS, U, V
from warpchain.kernels.physics.elementary import HALF, ONE, TWO
from warpchain.kernels.types import Chain, Model, Rows

SIX = wp.constant(wp.float64(6.0))
TWELFTH = wp.constant(wp.float64(1.0 / 12.0))
DRAG_PER_CROSSING = wp.constant(wp.float64(8.0))
"""γ times the time in which slow waves cross the loop: about the critical damping of its slowest swing."""
DRAG_PER_TURN = wp.constant(wp.float64(2.5))
"""γ times the time in which the loop runs its height.

It serves loops that bear little load, on which waves stay slow: they become stationary in 8 to 14 s instead of 14 to
30. With 6 instead of 2.5, fast short loops (60 Hz) change their shape when drag ends.
"""
NEVER = wp.constant(wp.float64(1e9))


@wp.func
def under_load(own: Chain, factor: wp.float64) -> Chain:
    """The chain in a field of gravity that is multiplied by a factor; for a factor of 1 the same bits."""
    chain = own
    chain.gravity = factor * own.gravity
    return chain


@wp.func
def write_link(K: Rows, model: Model, world: int, i: int, factor: wp.float64):
    """Writes the constants of link i and of joint i, with loads multiplied by a factor, into their rows."""
    mass = model.links[world, OWN_MASS, i]
    length = TWO * model.chains[world].half_length
    own = model.links[world, layout.OWN_INERTIA, i]
    inertia = own + (factor - ONE) * (own - mass * length * length / SIX)
    K[MASS, i] = mass
    K[layout.INVERSE_MASS, i] = ONE / mass
    K[INERTIA, i] = inertia
    K[layout.INVERSE_INERTIA, i] = ONE / inertia
    K[VISCOUS, i] = factor * model.links[world, layout.OWN_VISCOUS, i]
    K[COULOMB, i] = factor * model.links[world, layout.OWN_COULOMB, i]
    K[RADIUS, i] = model.links[world, OWN_RADIUS, i]


@wp.func
def write_links(K: Rows, model: Model, world: int, factor: wp.float64):
    """Writes the constants of all links and joints, see :func:`write_link`."""
    for i in range(model.chains[world].link_count):
        write_link(K, model, world, i, factor)


@wp.func
def crossing_time(speed: wp.float64, gravity: wp.float64, radius: wp.float64, height: wp.float64):
    """Time [s] in which slow waves cross both sides of a loop of this speed v [m/s] and height [m].

    At a height y above the lowest point T_e is about ρ g (y + y₀), with g [m/s²] multiplied by the load factor. y₀ is
    the radius of curvature at that point, about half the sprocket's radius [m]. Slow waves move at c(y) = √(v² + g (y +
    y₀)) − v; the integral of dy/c has a closed form. Without gravity it is ``NEVER``.
    """
    least = HALF * radius * gravity
    square = speed * speed
    if least <= wp.float64(1e-9) * square:
        return NEVER
    at_bottom = wp.sqrt(square + least)
    at_top = wp.sqrt(square + least + height * gravity)
    logarithm = wp.log((at_top - speed) / (at_bottom - speed))
    return wp.float64(4.0) / gravity * (at_top - at_bottom + speed * logarithm)


@wp.func
def drag_link(K: Rows, i: int, before: int, after: int, left: wp.float64):
    """Multiplies the part of a link's velocity that is across the path of the loop by ``left``."""
    # sines of the turns to the neighbours: their sum is the second difference of θ to third order
    sum_cosine = K[COSINE, before] + K[COSINE, after]
    sum_sine = K[SINE, before] + K[SINE, after]
    turn = TWELFTH * (K[COSINE, i] * sum_sine - K[SINE, i] * sum_cosine)
    cosine = K[COSINE, i] - turn * K[SINE, i]
    sine = K[SINE, i] + turn * K[COSINE, i]
    across = (left - ONE) * (K[V, i] * cosine - K[U, i] * sine)
    K[U, i] = K[U, i] - across * sine
    K[V, i] = K[V, i] + across * cosine


@wp.func
def drag_shape(K: Rows, chain: Chain, left: wp.float64):
    """Drag on all links, see :func:`drag_link`."""
    n = chain.link_count
    for i in range(n):
        drag_link(K, i, wp.where(i == 0, n - 1, i - 1), wp.where(i == n - 1, 0, i + 1), left)
