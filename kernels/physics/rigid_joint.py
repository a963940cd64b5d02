"""Terms of one link or one joint in the equations of rigid joints, see :mod:`cpu.implicit.rigid`: scalar functions."""

import warp as wp

from warpchain.kernels.physics.elementary import ONE
from warpchain.kernels.types import Chain

SWITCH_WIDTH = wp.constant(wp.float64(0.2))
"""c of :mod:`cpu.implicit.rigid_flight`: fraction of a joint's change of spin over which friction is smoothed."""


@wp.func
def turning_share(half_length: wp.float64, inverse_inertia: wp.float64, cosine: wp.float64, sine: wp.float64):
    """Contribution of a link's turning to S [1/kg]: xx, xy and yy of a² t tᵀ / I with t = (−sin, cos)."""
    share = half_length * half_length * inverse_inertia
    return share * sine * sine, -share * sine * cosine, share * cosine * cosine


@wp.func
def inward_pull(cosine: wp.float64, sine: wp.float64, spin: wp.float64, free: wp.float64):
    """A link's part of the right-hand side r / a [1/s²]: u ω² − t α, α [rad/s²] being due to friction alone."""
    square = spin * spin
    return square * cosine + free * sine, square * sine - free * cosine


@wp.func
def switch_smoothing(chain: Chain, h: wp.float64, relative_acceleration: wp.float64):
    """1/ω [s/rad] by which a joint's friction is smoothed in a step h, from the rate of change of its spin [rad/s²]."""
    width = SWITCH_WIDTH * h * wp.abs(relative_acceleration)
    return chain.inverse_smoothing / wp.max(ONE, width * chain.inverse_smoothing)


@wp.func
def steepness(viscous: wp.float64, coulomb: wp.float64, spin: wp.float64, inverse_smoothing: wp.float64):
    """Approximation of f(w)/w [N m s], used for f'(w) in the matrix of the stages."""
    return viscous + coulomb * inverse_smoothing / (ONE + wp.abs(spin) * inverse_smoothing)
