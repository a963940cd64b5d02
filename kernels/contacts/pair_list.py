"""The neighbour list of a chain: its reach, distances of joints, and the hash of grid cells."""

import warp as wp

from warpchain.kernels.layout import RIGHT_X
from warpchain.kernels.physics.elementary import TWO
from warpchain.kernels.physics.geometry import two
from warpchain.kernels.types import Chain, Rows


@wp.func
def listing_reach(chain: Chain, skin: wp.float64, opening: wp.float64):
    """Distance [m] below which two joints are listed; ``opening``: greatest |C| [m]."""
    return TWO * chain.circle_radius + skin + TWO * opening


@wp.func
def square_distance(K: Rows, p: int, q: int):
    """Square of the distance [m²] of two joints."""
    between = two(K, RIGHT_X, q) - two(K, RIGHT_X, p)
    return between[0] * between[0] + between[1] * between[1]


@wp.func
def bucket_of(cell_x: int, cell_y: int, table: int):
    """Bucket of a cell in a hash table whose size is a power of two."""
    mixed = cell_x * 73856093 ^ cell_y * 19349663
    return (mixed ^ (mixed >> 15)) & (table - 1)
