"""The neighbour list on a GPU: the grid of :mod:`cpu.contacts.neighbour_list`, built in parallel, one thread a joint.

It holds the same pairs as on a CPU, in any order: keys order the contacts, see :mod:`gpu.contacts.self_contacts`.
"""

import functools

import warp as wp

from warpchain.kernels.contacts import pair_list
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.contacts.pair_list import bucket_of, square_distance
from warpchain.kernels.gpu.stage import Run, constants
from warpchain.kernels.gpu.threads import barrier, warp_greatest, warp_width
from warpchain.kernels.layout import BOARD_LISTED_X, RIGHT_X, RIGHT_Y
from warpchain.kernels.physics.geometry import put, two
from warpchain.kernels.types import Integers, Rows


@functools.cache
def block_list(columns: int, block_dim: int):
    """Warp function that builds the list of a chain and returns the number of pairs; above capacity it overflows."""
    lists = list_layout(columns)

    @wp.func
    def search_cells(K: Rows, L: Integers, p: int, n: int, square: wp.float64, furthest: wp.float64, fills: bool):
        """Lists a joint's pairs; the least squared distance of others in cells near by, at most ``furthest``."""
        nearest = furthest
        near = int(0)
        while near < 9:
            cell_x = L[wp.static(lists.cell_x) + p] + near % 3 - 1
            cell_y = L[wp.static(lists.cell_y) + p] + near // 3 - 1
            q = L[wp.static(lists.bucket) + bucket_of(cell_x, cell_y, wp.static(lists.table))]
            while q >= 0:
                # a bucket may serve several cells
                if q > p and L[wp.static(lists.cell_x) + q] == cell_x and L[wp.static(lists.cell_y) + q] == cell_y:
                    distance = square_distance(K, p, q)
                    if pair_list.may_touch(p, q, n, fills):
                        if distance < square:
                            slot = wp.atomic_add(L, wp.static(lists.count), 1)
                            if slot < wp.static(lists.capacity):
                                L[wp.static(lists.first) + slot] = p
                                L[wp.static(lists.second) + slot] = q
                        else:
                            nearest = wp.min(nearest, distance)
                q = L[wp.static(lists.next_joint) + q]
            near += 1
        return nearest

    @wp.func
    def build(run: Run, skin: wp.float64, opening: wp.float64, is_far: bool):
        """For all threads; RIGHT_X and RIGHT_Y are on the board. ``is_far``: nothing was listed before."""
        K = run.K
        L = run.L
        lane = run.lane
        reach = pair_list.listing_reach(constants(K), skin, opening)
        width = pair_list.cell_width(constants(K), reach, is_far)
        if lane == 0:
            L[wp.static(lists.count)] = 0
            L[wp.static(lists.nearest)] = wp.cast(wp.float32(width), wp.int32)
        for i in range(lane, wp.static(lists.table), wp.static(block_dim)):
            L[wp.static(lists.bucket) + i] = -1
        barrier()
        if lane < run.links:
            put(K, BOARD_LISTED_X, lane, two(K, RIGHT_X, lane))
            cell_x = int(wp.floor(K[RIGHT_X, lane] / width))
            cell_y = int(wp.floor(K[RIGHT_Y, lane] / width))
            bucket = bucket_of(cell_x, cell_y, wp.static(lists.table))
            L[wp.static(lists.cell_x) + lane] = cell_x
            L[wp.static(lists.cell_y) + lane] = cell_y
            L[wp.static(lists.next_joint) + lane] = wp.atomic_exch(L, wp.static(lists.bucket) + bucket, lane)
        barrier()
        nearest = width * width
        if lane < run.links:
            fills = pair_list.fills_links(constants(K), opening)
            nearest = search_cells(K, L, lane, run.links, reach * reach, nearest, fills)
        bits = -warp_greatest(-wp.cast(wp.float32(wp.sqrt(nearest)), wp.int32))
        if lane % warp_width() == 0:
            wp.atomic_min(L, wp.static(lists.nearest), bits)
        barrier()
        return L[wp.static(lists.count)]

    return build
