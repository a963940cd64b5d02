"""The neighbour list on a GPU: pairs are sought in a uniform grid, which is built in parallel, one thread a joint.

Cells of the grid are hashed into a table, so that the grid needs no bounds, and memory does not depend on the chain's
extent. The list holds the same pairs as on a CPU, in any order: keys order the contacts, see
:mod:`gpu.contacts.self_contacts`.
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
from warpchain.kernels.types import Integers


@functools.cache
def block_list(columns: int, block_dim: int):
    """Warp function that builds the list of a chain and returns the number of pairs; above capacity it overflows.

    The grid lies in the memory in which stages exchange ends and forces.
    """
    lists = list_layout(columns)
    table = 1
    while table < 2 * block_dim:
        table *= 2
    next_joint, cells_x, cells_y, count, nearest_other = (k * block_dim for k in range(5))

    @wp.func
    def search_cells(run: Run, B: Integers, C: Integers, p: int, square: wp.float64, furthest: wp.float64, fills: bool):
        """Lists a joint's pairs; the least squared distance of others in cells near by, at most ``furthest``."""
        nearest = furthest
        near = int(0)
        while near < 9:
            cell_x = C[wp.static(cells_x) + p] + near % 3 - 1
            cell_y = C[wp.static(cells_y) + p] + near // 3 - 1
            q = B[bucket_of(cell_x, cell_y, wp.static(table))]
            while q >= 0:
                # a bucket may serve several cells
                if q > p and C[wp.static(cells_x) + q] == cell_x and C[wp.static(cells_y) + q] == cell_y:
                    distance = square_distance(run.K, p, q)
                    if pair_list.may_touch(p, q, run.links, fills):
                        if distance < square:
                            slot = wp.atomic_add(C, wp.static(count), 1)
                            if slot < wp.static(lists.capacity):
                                run.L[wp.static(lists.first) + slot] = p
                                run.L[wp.static(lists.second) + slot] = q
                        else:
                            nearest = wp.min(nearest, distance)
                q = C[wp.static(next_joint) + q]
            near += 1
        return nearest

    @wp.func
    def build(run: Run, skin: wp.float64, opening: wp.float64, is_far: bool):
        """For all threads; RIGHT_X and RIGHT_Y are on the board. ``is_far``: nothing was listed before."""
        K = run.K
        L = run.L
        lane = run.lane
        B = wp.array(ptr=run.E.ptr, shape=(wp.static(table),), dtype=wp.int32)  # last joint of each bucket
        C = wp.array(ptr=run.F.ptr, shape=(wp.static(6 * block_dim),), dtype=wp.int32)
        reach = pair_list.listing_reach(constants(K), skin, opening)
        width = pair_list.cell_width(constants(K), reach, is_far)
        if lane == 0:
            C[wp.static(count)] = 0
            C[wp.static(nearest_other)] = wp.cast(wp.float32(width), wp.int32)
        for i in range(lane, wp.static(table), wp.static(block_dim)):
            B[i] = -1
        barrier()
        if lane < run.links:
            put(K, BOARD_LISTED_X, lane, two(K, RIGHT_X, lane))
            cell_x = int(wp.floor(K[RIGHT_X, lane] / width))
            cell_y = int(wp.floor(K[RIGHT_Y, lane] / width))
            C[wp.static(cells_x) + lane] = cell_x
            C[wp.static(cells_y) + lane] = cell_y
            bucket = bucket_of(cell_x, cell_y, wp.static(table))
            C[wp.static(next_joint) + lane] = wp.atomic_exch(B, bucket, lane)
        barrier()
        nearest = width * width
        if lane < run.links:
            fills = pair_list.fills_links(constants(K), opening)
            nearest = search_cells(run, B, C, lane, reach * reach, nearest, fills)
        bits = -warp_greatest(-wp.cast(wp.float32(wp.sqrt(nearest)), wp.int32))
        if lane % warp_width() == 0:
            wp.atomic_min(C, wp.static(nearest_other), bits)
        barrier()
        pairs = C[wp.static(count)]
        if lane == 0:
            L[wp.static(lists.count)] = pairs
            L[wp.static(lists.nearest)] = C[wp.static(nearest_other)]
        barrier()
        return pairs

    return build
