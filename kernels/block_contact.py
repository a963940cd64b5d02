"""Self-contacts in the block form: found in parallel, resolved in parallel rounds.

A pair of joints (p, q) that may touch gets a key that orders as the fixed sequence of :func:`contact.self_contacts`
does: (p mod 2, q mod 2, p, q). In each round every pair that is not done lays its key upon its four links, where the
smallest stays, and a pair that finds its own key on all four goes: no pair before it in the sequence that shares a
link is left. Pairs that go together share no link, so the outcome equals that of the sequence to the bit. The smallest
key of all always goes, so there are at most as many rounds as pairs; a pile needs a handful.
"""

import functools
from dataclasses import dataclass

import warp as wp

from .block_memory import barrier
from .broadphase import list_layout
from .contact import resolve_joint_pair
from .elementary import TWO
from .layout import BOARD_LOST_SELF, BOARD_SELF_DEPTH, RIGHT_X, RIGHT_Y
from .types import Chain

wp.set_module_options({"enable_backward": False})

JOINT_BITS = 11
"""Bits for a joint's number in a key: chains have fewer than 2048 links."""

FREE = wp.constant(2**31 - 1)
DONE = wp.constant(-1)


@dataclass(frozen=True)
class TouchLayout:
    """Where the integers of the contact pass lie: offsets into one row of int32.

    Attributes:
        owners: Two sets of ``columns`` keys, one per link; rounds use them in turn.
        keys: Keys of the touching pairs, DONE after their turn.
        touching: Number of keys.
        finished: Number of pairs that have gone.
        fixed_hits: Impulses with floor or sprocket in this launch.
        self_hits: Impulses between links in this launch.
        mailbox: A status from one thread to all.
    """

    owners: int
    keys: int
    touching: int
    finished: int
    fixed_hits: int
    self_hits: int
    mailbox: int
    size: int


@functools.cache
def touch_layout(columns: int, in_lists: bool) -> TouchLayout:
    """Layout for memory of its own, or inside the scratch parts of the neighbour list's row."""
    lists = list_layout(columns)
    owners, keys, end = 0, 2 * columns, 2 * columns + lists.capacity
    size = end + 5
    if in_lists:
        owners, keys, end = lists.bucket, lists.touching, lists.found_first
        size = lists.size
    return TouchLayout(
        owners=owners,
        keys=keys,
        touching=end,
        finished=end + 1,
        fixed_hits=end + 2,
        self_hits=end + 3,
        mailbox=end + 4,
        size=size,
    )


@wp.func
def pair_key(p: int, q: int):
    """Orders pairs of joints as (p mod 2, q mod 2, p, q)."""
    parity = (p & 1) * 2 + (q & 1)
    return (((parity << wp.static(JOINT_BITS)) | p) << wp.static(JOINT_BITS)) | q


@wp.func
def first_joint(key: int):
    """p of a key."""
    return (key >> wp.static(JOINT_BITS)) & wp.static(2**JOINT_BITS - 1)


@wp.func
def second_joint(key: int):
    """q of a key."""
    return key & wp.static(2**JOINT_BITS - 1)


@functools.cache
def block_self_contacts(columns: int, block_dim: int, touch: TouchLayout):
    """Warp functions (clear, find, resolve) for scratch blocks of this width and blocks of this size."""
    lists = list_layout(columns)

    @wp.func
    def clear(T: wp.array(dtype=wp.int32), lane: int, n: int):
        """Before a barrier that precedes ``find``."""
        if lane < n:
            T[wp.static(touch.owners) + lane] = FREE
            T[wp.static(touch.owners + columns) + lane] = FREE
        if lane == 0:
            T[wp.static(touch.touching)] = 0
            T[wp.static(touch.finished)] = 0

    @wp.func
    def find(
        K: wp.array2d(dtype=wp.float64),
        L: wp.array(dtype=wp.int32),
        T: wp.array(dtype=wp.int32),
        chain: Chain,
        lane: int,
        pairs: int,
        opening: wp.float64,
    ):
        """Number of listed pairs that may touch now; the board's rows RIGHT_X and RIGHT_Y are filled."""
        reach = TWO * chain.circle_radius + TWO * opening
        square = reach * reach
        k = lane
        while k < pairs:
            p = L[wp.static(lists.first) + k]
            q = L[wp.static(lists.second) + k]
            dx = K[RIGHT_X, q] - K[RIGHT_X, p]
            dy = K[RIGHT_Y, q] - K[RIGHT_Y, p]
            if dx * dx + dy * dy < square:
                slot = wp.atomic_add(T, wp.static(touch.touching), 1)
                T[wp.static(touch.keys) + slot] = pair_key(p, q)
            k += wp.static(block_dim)
        barrier()
        return T[wp.static(touch.touching)]

    @wp.func
    def claim(T: wp.array(dtype=wp.int32), owners: int, n: int, key: int):
        p = first_joint(key)
        q = second_joint(key)
        wp.atomic_min(T, owners + p, key)
        wp.atomic_min(T, owners + p + 1, key)
        wp.atomic_min(T, owners + q, key)
        wp.atomic_min(T, owners + wp.where(q + 1 == n, 0, q + 1), key)

    @wp.func
    def is_first(T: wp.array(dtype=wp.int32), owners: int, n: int, key: int):
        p = first_joint(key)
        q = second_joint(key)
        here = T[owners + p] == key and T[owners + p + 1] == key
        return here and T[owners + q] == key and T[owners + wp.where(q + 1 == n, 0, q + 1)] == key

    @wp.func
    def resolve(K: wp.array2d(dtype=wp.float64), T: wp.array(dtype=wp.int32), chain: Chain, lane: int, touching: int):
        """All touching pairs; the board is filled. Returns this thread's impulses."""
        n = chain.link_count
        impulses = int(0)
        owners = int(wp.static(touch.owners))
        others = int(wp.static(touch.owners + columns))
        finished = int(0)
        while finished < touching:
            k = lane
            while k < touching:
                key = T[wp.static(touch.keys) + k]
                if key != DONE:
                    claim(T, owners, n, key)
                k += wp.static(block_dim)
            barrier()
            gone = int(0)
            k = lane
            while k < touching:
                key = T[wp.static(touch.keys) + k]
                if key != DONE:
                    if is_first(T, owners, n, key):
                        p = first_joint(key)
                        depth, lost, hits = resolve_joint_pair(K, chain, p, second_joint(key), K[BOARD_LOST_SELF, p])
                        K[BOARD_LOST_SELF, p] = lost
                        K[BOARD_SELF_DEPTH, p] = wp.max(K[BOARD_SELF_DEPTH, p], depth)
                        impulses += int(hits)
                        T[wp.static(touch.keys) + k] = DONE
                        gone += 1
                k += wp.static(block_dim)
            if lane < n:
                T[others + lane] = FREE
            if gone > 0:
                wp.atomic_add(T, wp.static(touch.finished), gone)
            barrier()
            finished = T[wp.static(touch.finished)]
            swapped = owners
            owners = others
            others = swapped
        return impulses

    return clear, find, resolve
