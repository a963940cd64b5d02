"""What acts on a link besides its joints: weight, or a load of another name in :data:`LOADS`.

A step kernel is compiled for one load. On a plane that tilts links feel the plane's motion instead, see
:attr:`physics.increments.Increments.plane_load`. What is not there is −0.0: compilers leave out its sums, which change
no bit.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.hooks import Hooks, hook
from warpchain.kernels.physics.geometry import Link
from warpchain.kernels.types import Chain

NOTHING = wp.constant(wp.float64(-0.0))


@wp.func
def weight(chain: Chain, _i: int, _link: Link, _inverse_mass: wp.float64, _inverse_inertia: wp.float64):
    """Accelerations (ẍ, ÿ [m/s²], θ̈ [rad/s²]) of link i: force times 1/m, and torque times 1/I."""
    return NOTHING, -chain.gravity, NOTHING


@wp.func
def no_energy(_chain: Chain, _i: int, _link: Link):
    """Potential energy [J] of link i in what acts on it, but for its weight."""
    return NOTHING


@dataclass(frozen=True)
class Load(Hooks):
    """Warp functions of a load, with the arguments of :func:`weight` and :func:`no_energy`."""

    acceleration: Any = hook(chain=Chain, i=int, link=Link, inverse_mass=wp.float64, inverse_inertia=wp.float64)
    energy: Any = hook(chain=Chain, i=int, link=Link)


LOADS = {"weight": Load(weight, no_energy)}
"""Loads by name. A script may add its own before it asks for a kernel."""
