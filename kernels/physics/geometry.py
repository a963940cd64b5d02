"""Where a link's ends are and how they move.

Scalar functions, one link a call. A link's arm is the vector from its centre of mass to its right end, half a link
length a times its direction (cos θ, sin θ); the left end is at minus the arm.
"""

from typing import Any

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.physics.elementary import small_turn
from warpchain.kernels.types import Chain, Rows

LANES = wp.constant(layout.LANES)


@wp.struct
class Link:
    """State of a link, with its arm instead of its angle, which no stage needs."""

    x: wp.float64  # [m]
    y: wp.float64  # [m]
    u: wp.float64  # ẋ [m/s]
    v: wp.float64  # ẏ [m/s]
    omega: wp.float64  # θ̇ [rad/s]
    arm_x: wp.float64  # [m]
    arm_y: wp.float64


@wp.func
def read_link(K: Rows, chain: Chain, i: int) -> Link:
    """Link i, from the rows of the state."""
    arm_x = chain.half_length * K[layout.COSINE, i]
    arm_y = chain.half_length * K[layout.SINE, i]
    return Link(K[layout.X, i], K[layout.Y, i], K[layout.U, i], K[layout.V, i], K[layout.OMEGA, i], arm_x, arm_y)


@wp.func
def put(rows: Rows, first: int, i: int, values: Any):
    """Writes a vector's components into column i of consecutive rows."""
    for k in range(len(values)):
        rows[first + k, i] = values[k]


@wp.func
def two(rows: Rows, first: int, i: int):
    """Column i of two consecutive rows."""
    return wp.vec2d(rows[first, i], rows[first + 1, i])


@wp.func
def three(rows: Rows, first: int, i: int):
    """Column i of three consecutive rows."""
    return wp.vec3d(rows[first, i], rows[first + 1, i], rows[first + 2, i])


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
