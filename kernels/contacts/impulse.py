"""The algebraic collision law of Chatterjee and Ruina (J. Appl. Mech. 65 (1998) 939-951), for circles of links.

*Effective mass.* Bodies A and B touch at P, n̂ points from A to B, t̂ = ẑ × n̂, and r leads from a body's centre of mass
to P. An impulse J on B, and −J on A, changes v = v_A − v_B at P to v' = v − W J, where

    W = (1/m_A + 1/m_B) 𝟙 + p_A p_Aᵀ/I_A + p_B p_Bᵀ/I_B,    p = ẑ × r,

and 𝟙 is the unit matrix.

*Two impulses.* J₁ = v_n/W_nn n̂ alone ends the approach, J₂ = W⁻¹ v ends all relative motion. D = J₂ − J₁ is the
difference. W D has no normal component, so adding a multiple of D does not change v'_n.

*The law.* e is the coefficient of restitution, e_t that of tangential restitution and μ that of friction.
J = (1 + e) J₁ + (1 + e_t) D if this lies in the friction cone |J_t| ≤ μ J_n (sticking). Otherwise the factor of D is
reduced from 1 + e_t to κ, for which J lies on the cone (sliding):

    |κ D_t| = μ ((1 + e) J₁ₙ + κ D_n)    gives    κ = μ (1 + e) J₁ₙ / (|D_t| − μ D_n).

The divisor is positive whenever sticking fails, because then (1 + e_t)(|D_t| − μ D_n) > μ (1 + e) J₁ₙ.
In both cases v'_n = −e v_n. As J₁ᵀ W D = 0, the kinetic energy changes by (sticking: κ = 1 + e_t)

    ΔT = −½ (1 − e²) J₁ᵀ W J₁ − ½ κ (2 − κ) Dᵀ W D ≤ 0    for e in [0, 1], e_t in [−1, 1] and any μ ≥ 0.

Two misprints of the roller-chain paper are corrected here:

1. It prints J₁ = (v·n̂)/α(n̂,n̂) n̂, with α the part of W without the masses. Its words ("the impulse necessary to bring
   the normal component of the relative velocity to zero") need all of W_nn; as printed, a central impact, where α = 0,
   divides by zero.
2. Its J_ij = ∂C_j/∂q_i is the transpose of the Jacobian that its equation (1) uses.
"""

import warp as wp

from warpchain.kernels.physics.elementary import HALF, ONE, ZERO, quotient
from warpchain.kernels.types import Chain


@wp.struct
class Touching:
    """A link as a fixed body meets it."""

    left_x: wp.float64  # places of its circles [m]
    left_y: wp.float64
    right_x: wp.float64
    right_y: wp.float64
    x: wp.float64  # centre of mass [m]
    y: wp.float64
    cosine: wp.float64  # direction
    sine: wp.float64
    mass: wp.float64  # [kg]
    inertia: wp.float64  # [kg m²]
    inverse_mass: wp.float64  # [1/kg]
    inverse_inertia: wp.float64  # [1/(kg m²)]
    u: wp.float64  # velocity [m/s]
    v: wp.float64
    omega: wp.float64  # [rad/s]
    lost: wp.float64  # energy so far [J]
    hits: wp.int64  # impulses so far


@wp.func
def inverse_masses(w_nn: wp.float64, w_nt: wp.float64, w_tt: wp.float64):
    """1/W_nn [kg] and 1/det W [kg²], the divisors of the law that do not depend on velocities."""
    return quotient(ONE, w_nn), quotient(ONE, w_nn * w_tt - w_nt * w_nt)


@wp.func
def collision_impulse(
    chain: Chain,
    normal_speed: wp.float64,
    tangential_speed: wp.float64,
    w_nn: wp.float64,
    w_nt: wp.float64,
    w_tt: wp.float64,
    inverse_nn: wp.float64,
    inverse_determinant: wp.float64,
    restitution: wp.float64,
    friction: wp.float64,
):
    """Impulse (J_n, J_t) [N s] on body B from v = (normal_speed, tangential_speed) [m/s] and W [1/kg], see above.

    ``inverse_nn`` and ``inverse_determinant`` are those of :func:`inverse_masses`; ``restitution`` is e and
    ``friction`` μ. The caller makes sure that the bodies approach (v·n̂ > 0).
    """
    stick = ONE + chain.tangential_restitution
    first = normal_speed * inverse_nn
    second_n = (w_tt * normal_speed - w_nt * tangential_speed) * inverse_determinant
    second_t = (w_nn * tangential_speed - w_nt * normal_speed) * inverse_determinant
    bounce = (ONE + restitution) * first
    excess = second_n - first
    stick_n = bounce + stick * excess
    stick_t = stick * second_t
    sticks = wp.abs(stick_t) <= friction * stick_n
    kappa = quotient(friction * bounce, wp.abs(second_t) - friction * excess)
    impulse_n = wp.where(sticks, stick_n, bounce + kappa * excess)
    impulse_t = wp.where(sticks, stick_t, kappa * second_t)
    return impulse_n, impulse_t


@wp.func
def struck(
    chain: Chain,
    link: Touching,
    gap: wp.float64,
    normal_x: wp.float64,
    normal_y: wp.float64,
    lever_x: wp.float64,
    lever_y: wp.float64,
    surface_u: wp.float64,
    surface_v: wp.float64,
    restitution: wp.float64,
    friction: wp.float64,
) -> Touching:
    """A link (B) after one of its circles met a fixed body (A), without branches.

    A fixed body is a body that no impulse moves; its surface may run. ``gap`` [m] is the distance between the circle
    and the body. ``normal`` is the unit vector n̂ from the body to the link. ``lever`` [m] leads from the link's centre
    to the touching point; ``surface`` [m/s] is the velocity of the body's surface there. Unless the circle overlaps
    (gap < 0) and approaches, nothing changes; a link may also gain energy from a surface that runs.
    """
    relative_x = surface_u - (link.u - link.omega * lever_y)
    relative_y = surface_v - (link.v + link.omega * lever_x)
    normal_speed = relative_x * normal_x + relative_y * normal_y
    tangential_speed = relative_y * normal_x - relative_x * normal_y
    # t̂ = ẑ × n̂ = (−n_y, n_x); the levers' cross products with n̂ and t̂
    cross_n = lever_x * normal_y - lever_y * normal_x
    cross_t = lever_x * normal_x + lever_y * normal_y
    w_nn = link.inverse_mass + cross_n * cross_n * link.inverse_inertia
    w_nt = cross_n * cross_t * link.inverse_inertia
    w_tt = link.inverse_mass + cross_t * cross_t * link.inverse_inertia
    inverse_nn, inverse_determinant = inverse_masses(w_nn, w_nt, w_tt)
    impulse_n, impulse_t = collision_impulse(
        chain, normal_speed, tangential_speed, w_nn, w_nt, w_tt, inverse_nn, inverse_determinant, restitution, friction
    )
    hit = (gap < ZERO) and (normal_speed > ZERO)
    impulse_n = wp.where(hit, impulse_n, ZERO)
    impulse_t = wp.where(hit, impulse_t, ZERO)
    surface_n = surface_u * normal_x + surface_v * normal_y
    surface_t = surface_v * normal_x - surface_u * normal_y
    changed_n = w_nn * impulse_n + w_nt * impulse_t
    changed_t = w_nt * impulse_n + w_tt * impulse_t
    # the work J·(v_B + v_B')/2 with v_B = v_surface − v and v_B' = v_B + W J
    gained = impulse_n * (surface_n - normal_speed + HALF * changed_n)
    gained += impulse_t * (surface_t - tangential_speed + HALF * changed_t)
    impulse_x = impulse_n * normal_x - impulse_t * normal_y
    impulse_y = impulse_n * normal_y + impulse_t * normal_x
    after = link
    after.u = link.u + impulse_x * link.inverse_mass
    after.v = link.v + impulse_y * link.inverse_mass
    after.omega = link.omega + (cross_n * impulse_n + cross_t * impulse_t) * link.inverse_inertia
    after.lost = link.lost - gained
    after.hits = link.hits + wp.where(hit, wp.int64(1), wp.int64(0))
    return after
