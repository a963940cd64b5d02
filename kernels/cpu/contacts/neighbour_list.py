"""Pairs of joints that may touch: a neighbour list with a skin.

Joints are the centres of the links' circles (to within the joint opening |C|). Which pairs are listed, and how long a
list lasts: :mod:`contacts.pair_list`. Each joint is compared with the joints after it, eight at a time; of far groups
of eight only the middle joints are compared. For the few hundred joints of a chain this is faster than any grid.
"""

import functools

import warp as wp

from warpchain.kernels.contacts import pair_list
from warpchain.kernels.contacts.link_pair import natural
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.cpu.contacts.proximity import greatest_distance
from warpchain.kernels.layout import LISTED_X, RIGHT_X
from warpchain.kernels.physics.elementary import TWO
from warpchain.kernels.physics.geometry import put, two, whole_lanes
from warpchain.kernels.types import Chain, Integers, Rows

GROUP = wp.constant(wp.float64(8.0))
"""Joints in a group. So many links at most are between the middles of two groups, beyond those between two joints."""


@wp.func_native("""
    const ::wp::float64* x = &K.data[row * (K.strides[0] / sizeof(::wp::float64))];
    const ::wp::float64* y = x + K.strides[0] / sizeof(::wp::float64);
    ::wp::int32 *groups = &L.data[group], *firsts = &L.data[first], *seconds = &L.data[second];
    ::wp::float64 nearest[8] = {furthest, furthest, furthest, furthest, furthest, furthest, furthest, furthest};
    int total = 0;
    for (int p = 0, near_groups = 0; p < n; ++p) {
        if (p % 8 == 0) {
            near_groups = 0;
            for (int q = p; q < n; q += 8) {
                const int a = p + 4 < n ? p + 4 : n - 1, b = q + 4 < n ? q + 4 : n - 1;
                groups[near_groups] = q;
                near_groups += (x[b] - x[a]) * (x[b] - x[a]) + (y[b] - y[a]) * (y[b] - y[a]) <= far;
            }
        }
        for (int k = 0; k < near_groups; ++k) {
            int near = 0;
            for (int lane = 0; lane < 8; ++lane) {
                const int q = groups[k] + lane;
                const ::wp::float64 dx = x[q] - x[p], dy = y[q] - y[p], square = dx * dx + dy * dy;
                const bool counts = (q - p >= apart) & (q - p <= n - apart) & (q < n);
                near |= (counts & (square < reach)) << lane;
                const ::wp::float64 other = (counts & (square >= reach)) ? square : furthest;
                nearest[lane] = other < nearest[lane] ? other : nearest[lane];
            }
            for (; near; near &= near - 1, ++total)
                if (total < capacity) {
                    firsts[total] = p;
                    seconds[total] = groups[k] + __builtin_ctz(near);
                }
        }
    }
    L.data[count] = total;
    for (int lane = 1; lane < 8; ++lane) nearest[0] = nearest[lane] < nearest[0] ? nearest[lane] : nearest[0];
    return nearest[0];
""")
def find_pairs(
    K: Rows,
    row: int,
    n: int,
    apart: int,
    reach: wp.float64,
    furthest: wp.float64,
    far: wp.float64,
    L: Integers,
    count: int,
    first: int,
    second: int,
    capacity: int,
    group: int,
) -> wp.float64:
    """Finds the pairs of joints p < q closer than ``reach``, ascending; counts also those beyond ``capacity``.

    All distances are squares [m²]: what is returned, the least of another pair or ``furthest``, and ``far``, beyond
    which the middle joints of two groups are so far apart that no other pair of theirs is closer than ``furthest``.
    Joints less than ``apart`` from one another along the loop do not count. ``group`` and the following: scratch.
    """


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
                p = natural(L[wp.static(lists.found_first) + k])
                q = natural(L[wp.static(lists.found_second) + k])
                L[wp.static(lists.first) + kept] = p
                L[wp.static(lists.second) + kept] = q
                kept += wp.where((p & 1) * 2 + (q & 1) == parity, 1, 0)
                k += 1
            parity += 1

    @wp.func
    def build(K: Rows, L: Integers, chain: Chain, skin: wp.float64, opening: wp.float64):
        """The list before tells whether the chain is far from itself; ``opening``: greatest |C| [m]."""
        n = chain.link_count
        reach = pair_list.listing_reach(chain, skin, opening)
        width = pair_list.cell_width(chain, reach, L[wp.static(lists.count)] == 0)
        far = width + GROUP * (TWO * chain.half_length + opening)
        nearest = find_pairs(
            K,
            RIGHT_X,
            n,
            wp.where(pair_list.fills_links(chain, opening), 1, 2),
            reach * reach,
            width * width,
            far * far,
            L,
            wp.static(lists.count),
            wp.static(lists.found_first),
            wp.static(lists.found_second),
            wp.static(lists.capacity),
            wp.static(lists.group),
        )
        found = L[wp.static(lists.count)]
        total = wp.min(found, wp.static(lists.capacity))
        L[wp.static(lists.count)] = total
        arrange(L, total)
        L[wp.static(lists.nearest)] = wp.cast(wp.float32(wp.sqrt(nearest)), wp.int32)
        i = int(0)
        while i < whole_lanes(n):
            put(K, LISTED_X, i, two(K, RIGHT_X, i))
            i += 1
        return found == total

    return build


@wp.func
def list_slack(K: Rows, chain: Chain, nearest: wp.int32, opening: wp.float64):
    """How far joints may still move [m], see :func:`contacts.pair_list.slack_of`."""
    return pair_list.slack_of(chain, nearest, opening, greatest_distance(K, chain, RIGHT_X, 0, LISTED_X))
