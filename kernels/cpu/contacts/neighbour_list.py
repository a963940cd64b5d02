"""Pairs of joints that may touch: a neighbour list with a skin, built with a uniform grid.

Joints are the centres of the links' circles (to within the joint opening |C|). Which pairs are listed, and how long a
list lasts: :mod:`contacts.pair_list`. Cells of the grid are hashed into a table, so that the grid needs no bounds, and
memory does not depend on the chain's extent.
"""

import functools

import warp as wp

from warpchain.kernels.contacts import pair_list
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.contacts.pair_list import bucket_of, square_distance
from warpchain.kernels.cpu.contacts.proximity import greatest_distance
from warpchain.kernels.layout import LISTED_X, RIGHT_X, RIGHT_Y
from warpchain.kernels.physics.geometry import put, two
from warpchain.kernels.types import Chain, Integers, Rows


@functools.cache
def neighbour_list(columns: int):
    """Warp function that builds the list, for scratch of this width; False: more pairs are near than fit."""
    lists = list_layout(columns)

    @wp.func
    def arrange(L: Integers, total: int):
        """Sorts the pairs found, (p, q) ascending, by (p mod 2, q mod 2); the sort is stable."""
        kept = int(0)
        parity = int(0)
        while parity < 4:
            k = int(0)
            while k < total:
                p = L[wp.static(lists.found_first) + k]
                q = L[wp.static(lists.found_second) + k]
                if (p & 1) * 2 + (q & 1) == parity:
                    L[wp.static(lists.first) + kept] = p
                    L[wp.static(lists.second) + kept] = q
                    kept += 1
                k += 1
            parity += 1
        L[wp.static(lists.count)] = total

    @wp.func
    def build(K: Rows, L: Integers, chain: Chain, skin: wp.float64, opening: wp.float64):
        """The list before tells whether the chain is far from itself; ``opening``: greatest |C| [m]."""
        n = chain.link_count
        reach = pair_list.listing_reach(chain, skin, opening)
        width = pair_list.cell_width(chain, reach, L[wp.static(lists.count)] == 0)
        square = reach * reach
        nearest = width * width
        fills = pair_list.fills_links(chain, opening)
        i = int(0)
        while i < wp.static(lists.table):
            L[wp.static(lists.bucket) + i] = -1
            i += 1
        i = int(0)
        while i < n:
            cell_x = int(wp.floor(K[RIGHT_X, i] / width))
            cell_y = int(wp.floor(K[RIGHT_Y, i] / width))
            bucket = bucket_of(cell_x, cell_y, wp.static(lists.table))
            L[wp.static(lists.cell_x) + i] = cell_x
            L[wp.static(lists.cell_y) + i] = cell_y
            L[wp.static(lists.next_joint) + i] = L[wp.static(lists.bucket) + bucket]
            L[wp.static(lists.bucket) + bucket] = i
            put(K, LISTED_X, i, two(K, RIGHT_X, i))
            i += 1
        total = int(0)
        fits = bool(True)
        p = int(0)
        while p < n:
            start = total
            near = int(0)
            while near < 9:
                cell_x = L[wp.static(lists.cell_x) + p] + near % 3 - 1
                cell_y = L[wp.static(lists.cell_y) + p] + near // 3 - 1
                q = L[wp.static(lists.bucket) + bucket_of(cell_x, cell_y, wp.static(lists.table))]
                # joints were put in ascending order, so a bucket is read in descending order
                while q > p:
                    if L[wp.static(lists.cell_x) + q] == cell_x and L[wp.static(lists.cell_y) + q] == cell_y:
                        distance = square_distance(K, p, q)
                        counts = pair_list.may_touch(p, q, n, fills)
                        if counts and distance < square:
                            if total < wp.static(lists.capacity):
                                # insertion keeps this joint's partners in ascending order
                                k = total
                                while k > start and L[wp.static(lists.found_second) + wp.max(k - 1, 0)] > q:
                                    L[wp.static(lists.found_second) + k] = L[wp.static(lists.found_second) + k - 1]
                                    k -= 1
                                L[wp.static(lists.found_second) + k] = q
                                L[wp.static(lists.found_first) + total] = p
                                total += 1
                            else:
                                fits = bool(False)
                        elif counts:
                            nearest = wp.min(nearest, distance)
                    q = L[wp.static(lists.next_joint) + q]
                near += 1
            p += 1
        arrange(L, total)
        L[wp.static(lists.nearest)] = wp.cast(wp.float32(wp.sqrt(nearest)), wp.int32)
        return fits

    return build


@wp.func
def list_slack(K: Rows, chain: Chain, nearest: wp.int32, opening: wp.float64):
    """How far joints may still move [m], see :func:`contacts.pair_list.slack_of`."""
    return pair_list.slack_of(chain, nearest, opening, greatest_distance(K, chain, RIGHT_X, 0, LISTED_X))
