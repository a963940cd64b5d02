"""Directions and ends of the links of a placed chain."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import X, Y
from warpchain.kernels.physics.elementary import cos_sin
from warpchain.kernels.physics.geometry import end_positions, put, two, whole_lanes
from warpchain.kernels.types import Chain, Rows


@wp.func
def place_link(K: Rows, a: wp.float64, i: int):
    """Direction and end positions of link i, exactly, from the rows of the state; a: half length [m]."""
    cosine, sine = cos_sin(K[layout.THETA, i])
    put(K, layout.COSINE, i, wp.vec2d(cosine, sine))
    left_x, left_y, right_x, right_y = end_positions(K[X, i], K[Y, i], a * cosine, a * sine)
    put(K, layout.LEFT_X, i, wp.vec4d(left_x, left_y, right_x, right_y))


@wp.func
def close_ends(K: Rows, n: int):
    """Repeats the first link's left end behind the last link."""
    put(K, layout.LEFT_X, n, two(K, layout.LEFT_X, 0))


@wp.func
def place_ends(K: Rows, chain: Chain):
    """Directions and end positions of all links."""
    lanes = whole_lanes(chain.link_count)
    i = int(0)
    while i < lanes:
        place_link(K, chain.half_length, i)
        i += 1
    close_ends(K, chain.link_count)
