"""What acts on a link besides its joints: by default its weight. Another force on links goes here, and nowhere else.

All stages, on CPU and GPU, take :func:`link_load`; samples take :func:`link_energy`. Links of a plane that tilts feel
:func:`physics.plane.plane_load` instead. What is not there is −0.0: compilers leave out its sums, which change no bit.
"""

import warp as wp

from warpchain.kernels.physics.geometry import Link
from warpchain.kernels.types import Chain

NOTHING = wp.constant(wp.float64(-0.0))

IS_UNIFORM = True
"""Whether all links have the same acceleration everywhere, and no torque. Otherwise joints are not rigid in flight."""


@wp.func
def link_load(chain: Chain, _i: int, _link: Link, _inverse_mass: wp.float64, _inverse_inertia: wp.float64):
    """Accelerations (ẍ, ÿ [m/s²], θ̈ [rad/s²]) of link i: force times 1/m, and torque times 1/I."""
    return NOTHING, -chain.gravity, NOTHING


@wp.func
def link_energy(_chain: Chain, _i: int, _link: Link):
    """Potential energy [J] of link i in what acts on it, but for its weight."""
    return NOTHING


@wp.func
def weight_energy(chain: Chain, moment: wp.float64):
    """Potential energy [J] of all links by their weight, from Σ m y [kg m]."""
    return chain.gravity * moment
