"""Where a link's ends are and how they move.

Scalar functions, one link a call. A link's ends lie half a link length from its centre of mass, along its direction
(cos θ, sin θ) and against it.
"""

import warp as wp

from .elementary import small_turn
from .types import Chain

wp.set_module_options({"enable_backward": False})


@wp.func
def end_positions(chain: Chain, x: wp.float64, y: wp.float64, cosine: wp.float64, sine: wp.float64):
    """Left end x, y and right end x, y [m] of a link."""
    a = chain.half_length
    return x - a * cosine, y - a * sine, x + a * cosine, y + a * sine


@wp.func
def end_velocities(chain: Chain, u: wp.float64, v: wp.float64, spin: wp.float64, cosine: wp.float64, sine: wp.float64):
    """Velocities [m/s] of a link's ends: left ẋ, ẏ and right ẋ, ẏ."""
    a = chain.half_length
    return u + a * spin * sine, v - a * spin * cosine, u - a * spin * sine, v + a * spin * cosine


@wp.func
def turned_direction(cosine: wp.float64, sine: wp.float64, turn: wp.float64):
    """The direction (cos θ, sin θ) after a small turn [rad], see :func:`small_turn`."""
    versine, small_sine = small_turn(turn)
    return (
        cosine - (cosine * versine + sine * small_sine),
        sine - (sine * versine - cosine * small_sine),
    )
