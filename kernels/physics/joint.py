"""Joints and links: spring, damper, friction, and the acceleration of a link."""

import warp as wp

from warpchain.kernels.physics.elementary import tanh
from warpchain.kernels.types import Chain


@wp.func
def joint_force(chain: Chain, opening: wp.float64, opening_rate: wp.float64):
    """One component of F = k C + b Ċ [N] on the link left of the joint; the link right of it feels −F.

    X is the centre of the link left of the joint, u its direction (a unit vector) and a its half length; primes mark
    the link right of it. The joint is open by C = (X' − a u') − (X + a u). F is −∂V_C/∂q + Q^D (paper, section 2.1).
    """
    return chain.joint_stiffness * opening + chain.joint_damping * opening_rate


@wp.func
def friction_torque(viscous: wp.float64, coulomb: wp.float64, spin: wp.float64, inverse_smoothing: wp.float64):
    """f(w) = β w + τ_c tanh(w / ω_c) [N m], with 1/ω_c [s/rad]; w is ω left of the joint less ω right of it [rad/s]."""
    return viscous * spin + coulomb * tanh(spin * inverse_smoothing)


@wp.func
def link_acceleration(
    inverse_mass: wp.float64, inverse_inertia: wp.float64, arm: wp.vec2d, left: wp.vec3d, right: wp.vec3d
):
    """Accelerations (ẍ, ÿ [m/s²], θ̈ [rad/s²]) of a link by its joints, of which each has a force F and a torque f.

    m Ẍ = F_right − F_left and I θ̈ = arm × (F_right + F_left) + f_left − f_right. ``left`` and ``right`` are (F, f) of
    the joints at its two ends. The arm leads from the link's centre to its right end.
    """
    ax = (right[0] - left[0]) * inverse_mass
    ay = (right[1] - left[1]) * inverse_mass
    lever = arm[0] * (right[1] + left[1]) - arm[1] * (right[0] + left[0])
    return ax, ay, (lever + left[2] - right[2]) * inverse_inertia
