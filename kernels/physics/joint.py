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
    inverse_mass: wp.float64,
    inverse_inertia: wp.float64,
    arm_x: wp.float64,
    arm_y: wp.float64,
    left_x: wp.float64,
    left_y: wp.float64,
    right_x: wp.float64,
    right_y: wp.float64,
    left_torque: wp.float64,
    right_torque: wp.float64,
):
    """Accelerations (ẍ, ÿ [m/s²], θ̈ [rad/s²]) of a link by its joints.

    m Ẍ = F_right − F_left and I θ̈ = arm × (F_right + F_left) + f_left − f_right. F_left and F_right are the
    forces of the joints at its two ends. f_left and f_right are their friction torques, each f(ω of the link left of
    the joint − ω of the link right of it). The arm leads from the link's centre to its right end.
    """
    ax = (right_x - left_x) * inverse_mass
    ay = (right_y - left_y) * inverse_mass
    lever = arm_x * (right_y + left_y) - arm_y * (right_x + left_x)
    return ax, ay, (lever + left_torque - right_torque) * inverse_inertia
