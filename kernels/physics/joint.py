"""A joint: spring, damper and friction, in double precision; stages have :mod:`physics.increments`."""

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
