"""The algebraic collision law of Chatterjee and Ruina (J. Appl. Mech. 65 (1998) 939-951), for circles of links.

Two misprints of the roller-chain paper are corrected here:

1. It prints J₁ = (v·n̂)/α(n̂,n̂) n̂. Its words ("the impulse necessary to bring the normal component of the relative
   velocity to zero") need the whole diagonal element W_nn = 1/m_A + 1/m_B + α(n̂,n̂); as printed, a central impact,
   where α = 0, divides by zero.
2. Its J_ij = ∂C_j/∂q_i is the transpose of the Jacobian that its equation (1) uses.
"""

import warp as wp

from warpchain.kernels.physics.elementary import HALF, ONE, ZERO, quotient
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})


@wp.func
def inverse_masses(w_nn: wp.float64, w_nt: wp.float64, w_tt: wp.float64):
    """1/W_nn [kg] and 1/det W [kg²]: what the law divides by that does not depend on velocities."""
    return quotient(ONE, w_nn), quotient(ONE, w_nn * w_tt - w_nt * w_nt)


@wp.func
def collision_impulse(
    normal_speed: wp.float64,
    tangential_speed: wp.float64,
    w_nn: wp.float64,
    w_nt: wp.float64,
    w_tt: wp.float64,
    inverse_nn: wp.float64,
    inverse_determinant: wp.float64,
    restitution: wp.float64,
    friction: wp.float64,
    tangential_restitution: wp.float64,
):
    """Impulse (J_n, J_t) [N s] on body B for the relative velocity v = v_A − v_B [m/s] in the basis (n̂, t̂).

    ``w_nn``, ``w_nt``, ``w_tt`` [1/kg]: the inverse effective mass W with W J = v − v'; of it the caller has
    :func:`inverse_masses` ready. The caller makes sure that the bodies approach (v·n̂ > 0). In the sliding case the
    denominator of κ is positive, because |J_t| > μ J_n is the same as
    (1 + e_t)(|J₂ₜ| − μ(J₂ₙ − J₁ₙ)) > μ (1 + e) J₁ₙ.
    """
    first = normal_speed * inverse_nn
    second_n = (w_tt * normal_speed - w_nt * tangential_speed) * inverse_determinant
    second_t = (w_nn * tangential_speed - w_nt * normal_speed) * inverse_determinant
    bounce = (ONE + restitution) * first
    excess = second_n - first
    stick_n = bounce + (ONE + tangential_restitution) * excess
    stick_t = (ONE + tangential_restitution) * second_t
    sticks = wp.abs(stick_t) <= friction * stick_n
    kappa = quotient(friction * bounce, wp.abs(second_t) - friction * excess)
    impulse_n = wp.where(sticks, stick_n, bounce + kappa * excess)
    impulse_t = wp.where(sticks, stick_t, kappa * second_t)
    return impulse_n, impulse_t


@wp.func
def fixed_contact(
    chain: Chain,
    gap: wp.float64,
    normal_x: wp.float64,
    normal_y: wp.float64,
    lever_x: wp.float64,
    lever_y: wp.float64,
    surface_u: wp.float64,
    surface_v: wp.float64,
    inverse_mass: wp.float64,
    inverse_inertia: wp.float64,
    restitution: wp.float64,
    friction: wp.float64,
    u: wp.float64,
    v: wp.float64,
    omega: wp.float64,
):
    """Velocities of a link after one of its circles met an immovable body, without branches.

    A is the body, B the link. ``lever`` [m] leads from the link's centre to the touching point, ``surface`` [m/s] is
    the velocity of the body's surface there.

    Returns:
        u, v, ω after the contact, the energy [J] that the link lost (negative if it gained), and 1 if there was an
        impulse, else 0. Unless the circle overlaps (gap < 0) and approaches, nothing changes.
    """
    relative_x = surface_u - (u - omega * lever_y)
    relative_y = surface_v - (v + omega * lever_x)
    normal_speed = relative_x * normal_x + relative_y * normal_y
    tangential_speed = relative_y * normal_x - relative_x * normal_y
    # t̂ = ẑ × n̂ = (−n_y, n_x); the levers' cross products with n̂ and t̂
    cross_n = lever_x * normal_y - lever_y * normal_x
    cross_t = lever_x * normal_x + lever_y * normal_y
    w_nn = inverse_mass + cross_n * cross_n * inverse_inertia
    w_nt = cross_n * cross_t * inverse_inertia
    w_tt = inverse_mass + cross_t * cross_t * inverse_inertia
    inverse_nn, inverse_determinant = inverse_masses(w_nn, w_nt, w_tt)
    impulse_n, impulse_t = collision_impulse(
        normal_speed,
        tangential_speed,
        w_nn,
        w_nt,
        w_tt,
        inverse_nn,
        inverse_determinant,
        restitution,
        friction,
        chain.tangential_restitution,
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
    return (
        u + impulse_x * inverse_mass,
        v + impulse_y * inverse_mass,
        omega + (cross_n * impulse_n + cross_t * impulse_t) * inverse_inertia,
        -gained,
        wp.where(hit, wp.int64(1), wp.int64(0)),
    )
