"""The neighbour list of a chain: its reach, how long it lasts, distances of joints, and the hash of grid cells.

The list holds all pairs of joints closer than its reach, 2r + skin + 2|C|, but for those that a link keeps apart. It
lasts until the nearest pair that it lacks may touch, see :func:`slack_of`. While a chain is far from itself, pairs are
sought farther than the reach: then the nearest pair is known to be far, and lists last long.
"""

import warp as wp

from warpchain.kernels.layout import RIGHT_X
from warpchain.kernels.physics.elementary import HALF, TWO
from warpchain.kernels.physics.geometry import two
from warpchain.kernels.types import Chain, Rows

ALMOST = wp.constant(wp.float64(0.9))
"""Radius of circles, as a part of half a link, from which on they are almost as wide as links."""
MOST_WAY = wp.constant(wp.float64(0.15))
"""Way of a joint in one step away from all contacts, as a part of the skin.

Longer steps would save 1 to 2 % of them where joints are soft, and ledgers would miss more of the energy: with `soft`,
100 links at 40 Hz and `os32` 1.4 thousandths without this bound, 0.6 with 0.25, 0.3 with 0.2, 0.13 with 0.15.
"""


@wp.func
def listing_reach(chain: Chain, skin: wp.float64, opening: wp.float64):
    """Distance [m] below which two joints are listed; ``opening``: greatest |C| [m]."""
    return TWO * chain.circle_radius + skin + TWO * opening


@wp.func
def cell_width(chain: Chain, reach: wp.float64, is_far: bool):
    """How far pairs are sought [m], on a GPU the width of cells.

    It is the reach or, while a chain is far from itself, two links: next joints but one are closer.
    """
    return wp.where(is_far, wp.max(reach, TWO * TWO * chain.half_length), reach)


@wp.func
def slack_of(chain: Chain, nearest: wp.int32, opening: wp.float64, displacement: wp.float64):
    """How far joints may still move [m] before the list may lack a pair of circles that touch; 0 or less: it is stale.

    ``nearest``: least distance of a pair that is not listed, as the list holds it; ``opening``: greatest |C| [m]: so
    far are circles from their joints; ``displacement``: greatest of a joint since the list was built [m].
    """
    return HALF * wp.float64(wp.cast(nearest, wp.float32)) - chain.circle_radius - opening - displacement


@wp.func
def fills_links(chain: Chain, opening: wp.float64):
    """Whether circles are almost as wide as links, so that those at both ends of one link may touch."""
    return chain.circle_radius + TWO * opening > ALMOST * chain.half_length


@wp.func
def may_touch(p: int, q: int, n: int, fills: bool):
    """Whether circles at the joints p < q may ever touch: unless they fill links, not those that a link joins."""
    return fills or (q - p != 1 and q - p != n - 1)


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
