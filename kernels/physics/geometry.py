"""Where a link's ends are and how they move.

Scalar functions, one link a call. A link's arm is the vector from its centre of mass to its right end, half a link
length a times its direction (cos θ, sin θ); the left end is at minus the arm.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.physics.elementary import small_turn

wp.set_module_options({"enable_backward": False})

LANES = wp.constant(layout.LANES)


@wp.func
def whole_lanes(n: int):
    """The number of links, rounded up to whole vectors: loops over so many columns have no remainder."""
    return (n + wp.static(LANES - 1)) & wp.static(-LANES)


@wp.func
def end_positions(x: wp.float64, y: wp.float64, arm_x: wp.float64, arm_y: wp.float64):
    """Left end x, y and right end x, y [m] of a link."""
    return x - arm_x, y - arm_y, x + arm_x, y + arm_y


@wp.func
def end_velocities(u: wp.float64, v: wp.float64, spin: wp.float64, arm_x: wp.float64, arm_y: wp.float64):
    """Velocities [m/s] of a link's ends: left ẋ, ẏ and right ẋ, ẏ; linear in spin [rad/s] times arm."""
    return u + spin * arm_y, v - spin * arm_x, u - spin * arm_y, v + spin * arm_x


@wp.func
def turned(x: wp.float64, y: wp.float64, turn: wp.float64):
    """A vector after a small turn [rad], see :func:`small_turn`."""
    versine, small_sine = small_turn(turn)
    return x - (x * versine + y * small_sine), y - (y * versine - x * small_sine)
