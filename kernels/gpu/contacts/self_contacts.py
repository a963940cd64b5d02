"""Self-contacts in the block form: found in parallel, resolved in parallel rounds.

A contact, a circle of one link and one of another, has a key that orders as the fixed sequence of
:mod:`cpu.contacts.self_contacts` does, and a thread that works out its geometry once. In each round every contact that
is not done lays its key upon its two links, where the smallest stays, and a contact that finds its own key on both
goes: none before it in the sequence that shares a link is left. Contacts that go together share no link, so the outcome
equals that of the sequence to the bit. The smallest key of all always goes, so there are at most as many rounds as
contacts, and about as many as the busiest link has contacts.

A round costs one barrier: contacts that have to wait lay their keys for the next one while others go, on another board,
while a third is cleared. If there are threads enough, both halves of the sequence go together. What counts in a round
is how many instructions one thread has to get through, at four to six cycles each.
"""

import functools
from dataclasses import dataclass

import warp as wp

from warpchain.kernels.contacts.link_pair import collide, links_of, natural, touching_circles
from warpchain.kernels.contacts.pair_list import list_layout
from warpchain.kernels.gpu.threads import barrier, barrier_if_any
from warpchain.kernels.layout import BOARD_LOST_SELF, RIGHT_X, RIGHT_Y, consecutive_offsets
from warpchain.kernels.physics.elementary import TWO, ZERO
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})

JOINT_BITS = 11
"""Bits for a joint's number in a key: chains have fewer than 2048 links."""

FREE = wp.constant(2**31 - 1)
DONE = wp.constant(-1)


@dataclass(frozen=True)
class TouchLayout:
    """Where the integers of the contact pass lie: offsets into one row of int32.

    Attributes:
        width: Columns of the owners, at least the number of links.
        shared_pairs: How many touching pairs of joints lie at ``pairs``; further ones lie in the list's row.
        owners: Three boards of ``width`` keys, one per link; rounds use them in turn.
        pairs: See ``shared_pairs``.
        touching: Number of touching pairs of joints.
        votes: See :func:`gpu.threads.barrier_if_any`.
        fixed_hits: Impulses with floor or sprocket in this launch.
        self_hits: Impulses between links in this launch.
        mailbox: A status from one thread to all.
        deepest: Greatest depth of a contact in this launch [m], bits of a single-precision number.
        is_late: Whether the launch has taken its time.
        size: Integers from the row's start to the end of the last.
    """

    width: int
    shared_pairs: int
    owners: int
    pairs: int
    touching: int
    votes: int
    fixed_hits: int
    self_hits: int
    mailbox: int
    deepest: int
    is_late: int
    size: int


@functools.cache
def touch_layout(columns: int, block_dim: int, in_lists: bool) -> TouchLayout:
    """Layout for shared memory of its own, a pair per thread, or inside the scratch parts of the list's row."""
    width, shared_pairs = (columns, 0) if in_lists else (block_dim, block_dim)
    single = ("touching", "votes", "fixed_hits", "self_hits", "mailbox", "deepest", "is_late")
    integers = consecutive_offsets(
        list_layout(columns).owners if in_lists else 0,
        **{"owners": 3 * width, "pairs": shared_pairs} | dict.fromkeys(single, 1),
    )
    return TouchLayout(width, shared_pairs, **integers)


@wp.func
def pair_key(p: int, q: int):
    """Orders pairs of joints as (p mod 2, q mod 2, p, q)."""
    return ((((p & 1) * 2 + (q & 1)) << wp.static(JOINT_BITS) | p) << wp.static(JOINT_BITS)) | q


@wp.func
def first_joint(pair: int):
    """p of a pair's key."""
    return (pair >> wp.static(JOINT_BITS)) & wp.static(2**JOINT_BITS - 1)


@wp.func
def second_joint(pair: int):
    """q of a pair's key."""
    return pair & wp.static(2**JOINT_BITS - 1)


@wp.func
def contact_key(pair: int, half: int, second: int):
    """Orders contacts as the sequence does: by half, pair of joints, and first or second of the pair's two."""
    return half << wp.static(2 * JOINT_BITS + 3) | pair << 1 | second


@wp.func
def pair_of(key: int):
    """The pair of joints of a contact."""
    return key >> 1 & wp.static(2 ** (2 * JOINT_BITS + 2) - 1)


@wp.func
def half_of(key: int):
    """The half of a contact, not of DONE."""
    return key >> wp.static(2 * JOINT_BITS + 3)


@wp.func
def links_at(key: int, n: int):
    """The two links of a contact."""
    pair = pair_of(key)
    return links_of(first_joint(pair), second_joint(pair), half_of(key) & 1, key & 1, n)


@wp.func
def claim(T: wp.array(dtype=wp.int32), owners: int, link_a: int, link_b: int, key: int):
    """Lays a key upon the links of a contact."""
    wp.atomic_min(T, natural(owners + link_a), key)
    wp.atomic_min(T, natural(owners + link_b), key)


@wp.func
def is_first(T: wp.array(dtype=wp.int32), owners: int, link_a: int, link_b: int, key: int):
    """True if no smaller key lies on the links of a contact."""
    return T[natural(owners + link_a)] == key and T[natural(owners + link_b)] == key


@functools.cache
def block_self_contacts(columns: int, block_dim: int, touch: TouchLayout):
    """Warp functions (clear, find, resolve) for scratch blocks of this width and blocks of this size."""
    lists = list_layout(columns)

    @wp.func
    def clear(T: wp.array(dtype=wp.int32), lane: int, n: int):
        """Before a barrier that precedes ``find``."""
        if lane < n:
            T[wp.static(touch.owners) + lane] = FREE
            T[wp.static(touch.owners + touch.width) + lane] = FREE
            T[wp.static(touch.owners + 2 * touch.width) + lane] = FREE
        if lane == 0:
            T[wp.static(touch.touching)] = 0

    @wp.func
    def pair_at(L: wp.array(dtype=wp.int32), T: wp.array(dtype=wp.int32), k: int):
        pair = int(0)
        if k < wp.static(touch.shared_pairs):
            pair = T[wp.static(touch.pairs) + k]
        else:
            pair = L[wp.static(lists.touching) + k]
        return pair

    @wp.func
    def order(L: wp.array(dtype=wp.int32), T: wp.array(dtype=wp.int32), lane: int, touching: int):
        """Puts the pairs in the order of their keys.

        Not every contact then has a thread of its own, and the code that prepares one rounds differently from that
        which does not: which way a contact goes must not depend on the order in which threads found the pairs.
        """
        k = lane
        while k < touching:
            pair = pair_at(L, T, k)
            rank = int(0)
            other = int(0)
            while other < touching:
                rank += wp.where(pair_at(L, T, other) < pair, 1, 0)
                other += 1
            L[wp.static(lists.pending) + rank] = pair
            k += wp.static(block_dim)
        barrier()
        k = lane
        while k < touching:
            pair = L[wp.static(lists.pending) + k]
            if k < wp.static(touch.shared_pairs):
                T[wp.static(touch.pairs) + k] = pair
            else:
                L[wp.static(lists.touching) + k] = pair
            k += wp.static(block_dim)
        barrier()

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
        """Number of pairs of joints that may touch now; the board is filled. ``opening``: greatest |C| [m]."""
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
                if slot < wp.static(touch.shared_pairs):
                    T[wp.static(touch.pairs) + slot] = pair_key(p, q)
                else:
                    L[wp.static(lists.touching) + slot] = pair_key(p, q)
            k += wp.static(block_dim)
        barrier()
        touching = T[wp.static(touch.touching)]
        if 2 * touching > wp.static(block_dim):
            order(L, T, lane, touching)
        return touching

    @wp.func
    def note_depth(T: wp.array(dtype=wp.int32), depth: wp.float64):
        wp.atomic_max(T, wp.static(touch.deepest), wp.cast(wp.float32(depth), wp.int32))

    @wp.func
    def prepare(
        K: wp.array2d(dtype=wp.float64),
        T: wp.array(dtype=wp.int32),
        E: wp.array2d(dtype=wp.float64),
        F: wp.array2d(dtype=wp.float64),
        chain: Chain,
        pair: int,
        half: int,
        second: int,
        lane: int,
    ):
        """Lays down the geometry of a thread's first contact; returns its key, or DONE for circles that do not meet."""
        depth, nx, ny, a_n, a_t, b_n, b_t, inverse_nn, inverse_determinant = touching_circles(
            K, chain, first_joint(pair), second_joint(pair), half, second
        )
        key = int(DONE)
        if depth > ZERO:
            key = contact_key(pair, half, second)
            E[0, lane] = nx
            E[1, lane] = ny
            E[2, lane] = a_n
            E[3, lane] = a_t
            E[4, lane] = b_n
            F[0, lane] = b_t
            F[1, lane] = inverse_nn
            F[2, lane] = inverse_determinant
            note_depth(T, depth)
        return key

    @wp.func
    def go_prepared(
        K: wp.array2d(dtype=wp.float64),
        E: wp.array2d(dtype=wp.float64),
        F: wp.array2d(dtype=wp.float64),
        chain: Chain,
        link_a: int,
        link_b: int,
        lane: int,
    ):
        """The turn of a thread's first contact; returns the number of impulses."""
        lost_before = K[BOARD_LOST_SELF, link_a]
        lost, hits = collide(
            K,
            chain,
            link_a,
            link_b,
            E[0, lane],
            E[1, lane],
            E[2, lane],
            E[3, lane],
            E[4, lane],
            F[0, lane],
            F[1, lane],
            F[2, lane],
        )
        K[BOARD_LOST_SELF, link_a] = lost_before + lost
        return int(hits)

    @wp.func
    def write_proximity(
        K: wp.array2d(dtype=wp.float64), T: wp.array(dtype=wp.int32), chain: Chain, pair: int, half: int, second: int
    ):
        """1 if the circles of a further contact meet, else 0."""
        depth, _nx, _ny, _a_n, _a_t, _b_n, _b_t, _inverse_nn, _inverse_determinant = touching_circles(
            K, chain, first_joint(pair), second_joint(pair), half, second
        )
        note_depth(T, depth)
        return wp.where(depth > ZERO, 1, 0)

    @wp.func
    def go(K: wp.array2d(dtype=wp.float64), chain: Chain, key: int, link_a: int, link_b: int):
        """The turn of a further contact; returns the number of impulses."""
        _depth, nx, ny, a_n, a_t, b_n, b_t, inverse_nn, inverse_determinant = touching_circles(
            K, chain, first_joint(pair_of(key)), second_joint(pair_of(key)), half_of(key), key & 1
        )
        lost, hits = collide(K, chain, link_a, link_b, nx, ny, a_n, a_t, b_n, b_t, inverse_nn, inverse_determinant)
        K[BOARD_LOST_SELF, link_a] = K[BOARD_LOST_SELF, link_a] + lost
        return int(hits)

    @wp.func
    def resolve(
        K: wp.array2d(dtype=wp.float64),
        L: wp.array(dtype=wp.int32),
        T: wp.array(dtype=wp.int32),
        E: wp.array2d(dtype=wp.float64),
        F: wp.array2d(dtype=wp.float64),
        chain: Chain,
        lane: int,
        touching: int,
    ):
        """All contacts; the board is filled. Returns this thread's impulses and leaves a barrier behind it.

        A thread keeps the geometry of its first contact in its columns of E and F; should there be more contacts than
        threads, it works that of the others out again in their turn.
        """
        impulses = int(0)
        owners = int(wp.static(touch.owners))
        next_owners = int(wp.static(touch.owners + touch.width))
        last_owners = int(wp.static(touch.owners + 2 * touch.width))
        # both halves at once if that leaves a thread to each contact: the second after the first, so that contacts
        # that go together are in few warps
        contacts = 2 * touching
        in_turn = 4 * touching > wp.static(block_dim)
        if not in_turn:
            contacts = 4 * touching
        turn = int(0)
        while turn < wp.where(in_turn, 2, 1):
            own_key = int(DONE)
            if lane < contacts:
                half = wp.where(lane < 2 * touching, turn, 1)
                k = lane - wp.where(in_turn, 0, half * 2 * touching)
                own_key = prepare(K, T, E, F, chain, pair_at(L, T, k >> 1), half, k & 1, lane)
            own_a, own_b = links_at(own_key, chain.link_count)
            left = wp.where(own_key == DONE, 0, 1)
            if own_key != DONE:
                claim(T, owners, own_a, own_b, own_key)
            k = lane + wp.static(block_dim)
            while k < contacts:
                pair = pair_at(L, T, k >> 1)
                touches = write_proximity(K, T, chain, pair, turn, k & 1)
                L[wp.static(lists.pending) + k] = touches
                left += touches
                if touches != 0:
                    key = contact_key(pair, turn, k & 1)
                    link_a, link_b = links_at(key, chain.link_count)
                    claim(T, owners, link_a, link_b, key)
                k += wp.static(block_dim)
            while barrier_if_any(T, wp.static(touch.votes), left > 0):
                if own_key != DONE:
                    if is_first(T, owners, own_a, own_b, own_key):
                        impulses += go_prepared(K, E, F, chain, own_a, own_b, lane)
                        left -= 1
                        own_key = DONE
                    else:
                        claim(T, next_owners, own_a, own_b, own_key)
                k = lane + wp.static(block_dim)
                while k < contacts:
                    if L[wp.static(lists.pending) + k] != 0:
                        key = contact_key(pair_at(L, T, k >> 1), turn, k & 1)
                        link_a, link_b = links_at(key, chain.link_count)
                        if is_first(T, owners, link_a, link_b, key):
                            impulses += go(K, chain, key, link_a, link_b)
                            left -= 1
                            L[wp.static(lists.pending) + k] = 0
                        else:
                            claim(T, next_owners, link_a, link_b, key)
                    k += wp.static(block_dim)
                if lane < chain.link_count:
                    T[natural(last_owners + lane)] = FREE
                used = owners
                owners = next_owners
                next_owners = last_owners
                last_owners = used
            turn += 1
        return impulses

    return clear, find, resolve
