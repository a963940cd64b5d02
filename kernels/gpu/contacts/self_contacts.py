"""Contacts of a chain with itself on a GPU: found in parallel, resolved in parallel rounds.

A contact, of one circle of a link and one of another, has a key. Keys are ordered as the fixed sequence of
:mod:`cpu.contacts.self_contacts`. In each round every pending contact writes its key to both links by atomic minimum; a
contact that owns both links is resolved, because no earlier contact of either link is pending. Contacts of one round
share no link, so the result equals that of the sequence to the bit. The smallest key is resolved in every round, so
there are at most as many rounds as contacts, and about as many as the busiest link has contacts.

A round takes one barrier: contacts that must wait write their keys for the next round to a second array of owners,
while a third is cleared. If there are enough threads, both halves of the sequence are resolved together. The cost of a
round is the number of instructions of one thread, at four to six cycles each.
"""

import functools
from dataclasses import dataclass

import warp as wp

from warpchain.kernels.contacts import link_pair
from warpchain.kernels.contacts.link_pair import B_T, DEPTH, Contact, natural
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.contacts.pair_list import square_distance
from warpchain.kernels.gpu.stage import Run
from warpchain.kernels.gpu.threads import barrier, barrier_count
from warpchain.kernels.layout import BOARD_LOST_SELF, consecutive_offsets
from warpchain.kernels.physics.elementary import TWO, ZERO
from warpchain.kernels.physics.geometry import put
from warpchain.kernels.types import Chain, Integers, Rows

JOINT_BITS = 11
"""Bits of a joint's number in a key: chains have fewer than 2048 links."""

FREE = wp.constant(2**31 - 1)
DONE = wp.constant(-1)


@dataclass(frozen=True)
class TouchLayout:
    """Where the integers of the contact pass lie: offsets into one row of int32."""

    width: int  # columns of the owners, at least the number of links
    shared_pairs: int  # how many touching pairs of joints lie at ``pairs``; further ones lie in the list's row
    owners: int  # three arrays of ``width`` keys, one per link; rounds use them in turn
    pairs: int  # see ``shared_pairs``
    touching: int  # number of touching pairs of joints
    votes: int  # see :func:`gpu.threads.barrier_count`
    fixed_hits: int  # impulses with floor or sprocket that are not booked yet
    self_hits: int  # likewise between links
    strand_hits: int  # those between strands of the loop
    deepest: int  # greatest depth of a contact in this launch [m], bits of a single-precision number
    is_late: int  # 1 when the launch has lasted long enough
    size: int  # integers from the row's start to the end of the last


@functools.cache
def touch_layout(columns: int, block_dim: int, in_lists: bool) -> TouchLayout:
    """Layout for shared memory of its own, a pair per thread, or inside the scratch parts of the list's row."""
    width, shared_pairs = (columns, 0) if in_lists else (block_dim, block_dim)
    single = ("touching", "votes", "fixed_hits", "self_hits", "strand_hits", "deepest", "is_late")
    integers = consecutive_offsets(
        list_layout(columns).owners if in_lists else 0,
        **{"owners": 3 * width, "pairs": shared_pairs} | dict.fromkeys(single, 1),
    )
    return TouchLayout(width, shared_pairs, **integers)


@wp.func
def pair_key(p: int, q: int):
    """Orders pairs of joints as (p mod 2, q mod 2, p, q); it leaves the last bit free."""
    return ((((p & 1) * 2 + (q & 1)) << wp.static(JOINT_BITS) | p) << wp.static(JOINT_BITS) | q) << 1


@wp.func
def contact_key(pair: int, half: int, second: int):
    """Orders contacts as the sequence does: by half, pair of joints, and first or second of the pair's two."""
    return half << wp.static(2 * JOINT_BITS + 3) | pair | second


@wp.func
def joints_of(key: int):
    """The joints p < q and the half of a contact; the key is not DONE."""
    most = wp.static(2**JOINT_BITS - 1)
    return key >> wp.static(JOINT_BITS + 1) & most, key >> 1 & most, key >> wp.static(2 * JOINT_BITS + 3)


@wp.func
def links_at(key: int, n: int):
    """The two links of a contact."""
    p, q, half = joints_of(key)
    return link_pair.links_of(p, q, half & 1, key & 1, n)


@wp.func
def circles_at(K: Rows, chain: Chain, key: int):
    """The geometry of a contact, see :func:`contacts.link_pair.touching_circles`."""
    p, q, half = joints_of(key)
    return link_pair.touching_circles(K, chain, p, q, half, key & 1)


@wp.func
def claim(T: Integers, owners: int, link_a: int, link_b: int, key: int):
    """Writes a contact's key to both links if none there is smaller."""
    wp.atomic_min(T, natural(owners + link_a), key)
    wp.atomic_min(T, natural(owners + link_b), key)


@wp.func
def owns_links(T: Integers, owners: int, link_a: int, link_b: int, key: int):
    """Whether a contact owns both links: no pending contact of theirs has a smaller key."""
    return T[natural(owners + link_a)] == key and T[natural(owners + link_b)] == key


@functools.cache
def block_self_contacts(columns: int, block_dim: int, touch: TouchLayout):
    """Warp functions (clear, find, resolve) for scratch of this width and blocks of this size."""
    lists = list_layout(columns)

    @wp.func
    def clear(run: Run):
        """Before a barrier that precedes ``find``."""
        T = run.T
        lane = run.lane
        if lane < run.links:
            for k in range(3):
                T[wp.static(touch.owners + k * touch.width) + lane] = FREE
        if lane == 0:
            T[wp.static(touch.touching)] = 0

    @wp.func
    def pair_at(L: Integers, T: Integers, k: int):
        if k < wp.static(touch.shared_pairs):
            return T[wp.static(touch.pairs) + k]
        return L[wp.static(lists.touching) + k]

    @wp.func
    def order(L: Integers, T: Integers, lane: int, touching: int):
        """Sorts the pairs by their keys.

        It is called when not every contact has a thread of its own. A thread's first contact takes other code than
        further ones, which rounds differently; so that choice must not depend on the order in which pairs were found.
        """
        for k in range(lane, touching, wp.static(block_dim)):
            pair = pair_at(L, T, k)
            rank = int(0)
            for other in range(touching):
                rank += wp.where(pair_at(L, T, other) < pair, 1, 0)
            L[wp.static(lists.pending) + rank] = pair
        barrier()
        for k in range(lane, touching, wp.static(block_dim)):
            pair = L[wp.static(lists.pending) + k]
            if k < wp.static(touch.shared_pairs):
                T[wp.static(touch.pairs) + k] = pair
            else:
                L[wp.static(lists.touching) + k] = pair
        barrier()

    @wp.func
    def find(run: Run, chain: Chain, pairs: int, opening: wp.float64):
        """Number of pairs of joints that may touch now; the board is written. ``opening``: greatest |C| [m]."""
        L = run.L
        T = run.T
        lane = run.lane
        reach = TWO * chain.circle_radius + TWO * opening
        square = reach * reach
        for k in range(lane, pairs, wp.static(block_dim)):
            p = L[wp.static(lists.first) + k]
            q = L[wp.static(lists.second) + k]
            if square_distance(run.K, p, q) < square:
                slot = wp.atomic_add(T, wp.static(touch.touching), 1)
                if slot < wp.static(touch.shared_pairs):
                    T[wp.static(touch.pairs) + slot] = pair_key(p, q)
                else:
                    L[wp.static(lists.touching) + slot] = pair_key(p, q)
        barrier()
        touching = T[wp.static(touch.touching)]
        if 2 * touching > wp.static(block_dim):
            order(L, T, lane, touching)
        return touching

    @wp.func
    def raise_depth(T: Integers, depth: wp.float64):
        wp.atomic_max(T, wp.static(touch.deepest), wp.cast(wp.float32(depth), wp.int32))

    @wp.func
    def prepare(run: Run, chain: Chain, key: int):
        """Stores the geometry of a thread's first contact; its key, or DONE without an overlap, and its depth [m]."""
        lane = run.lane
        contact, inverse_nn, inverse_determinant = circles_at(run.K, chain, key)
        depth = contact[DEPTH]
        own = int(DONE)
        if depth > ZERO:
            own = key
            for k in range(5):
                run.E[k, lane] = contact[1 + k]
            put(run.F, 0, lane, wp.vec3d(contact[B_T], inverse_nn, inverse_determinant))
            raise_depth(run.T, depth)
        return own, depth

    @wp.func
    def hit(run: Run, chain: Chain, a: int, b: int, contact: Contact, inverse_nn: wp.float64, inverse_det: wp.float64):
        """Resolves a contact of links A and B; returns the number of impulses."""
        K = run.K
        lost_before = K[BOARD_LOST_SELF, a]
        lost, hits = link_pair.collide(K, chain, a, b, contact, inverse_nn, inverse_det)
        K[BOARD_LOST_SELF, a] = lost_before + lost
        if link_pair.are_strands(a, b, chain.link_count):
            wp.atomic_add(run.T, wp.static(touch.strand_hits), int(hits))
        return int(hits)

    @wp.func
    def resolve_prepared(run: Run, chain: Chain, link_a: int, link_b: int, depth: wp.float64):
        """Resolves a thread's first contact; returns the number of impulses."""
        E = run.E
        F = run.F
        lane = run.lane
        contact = Contact(depth, E[0, lane], E[1, lane], E[2, lane], E[3, lane], E[4, lane], F[0, lane])
        return hit(run, chain, link_a, link_b, contact, F[1, lane], F[2, lane])

    @wp.func
    def resolve(run: Run, chain: Chain, touching: int):
        """Resolves all contacts; the board is written. Returns this thread's impulses and ends with a barrier.

        A thread keeps the geometry of its first contact in its columns of E and F. With more contacts than threads, the
        geometry of the others is evaluated again when they are resolved.
        """
        L = run.L
        T = run.T
        lane = run.lane
        impulses = int(0)
        owners = int(wp.static(touch.owners))
        next_owners = int(wp.static(touch.owners + touch.width))
        last_owners = int(wp.static(touch.owners + 2 * touch.width))
        # both halves at once if there is a thread for each contact; contacts of one half have neighbouring threads, so
        # that those resolved in one round are in few warps
        contacts = 2 * touching
        in_turn = 4 * touching > wp.static(block_dim)
        if not in_turn:
            contacts = 4 * touching
        for turn in range(wp.where(in_turn, 2, 1)):
            own_key = int(DONE)
            own_depth = wp.float64(0.0)
            if lane < contacts:
                half = wp.where(lane < 2 * touching, turn, 1)
                k = lane - wp.where(in_turn, 0, half * 2 * touching)
                own_key, own_depth = prepare(run, chain, contact_key(pair_at(L, T, k >> 1), half, k & 1))
            own_a, own_b = links_at(own_key, chain.link_count)
            left = wp.where(own_key == DONE, 0, 1)
            if own_key != DONE:
                claim(T, owners, own_a, own_b, own_key)
            k = lane + wp.static(block_dim)
            while k < contacts:
                key = contact_key(pair_at(L, T, k >> 1), turn, k & 1)
                contact, _inverse_nn, _inverse_det = circles_at(run.K, chain, key)
                raise_depth(T, contact[DEPTH])
                touches = wp.where(contact[DEPTH] > ZERO, 1, 0)
                L[wp.static(lists.pending) + k] = touches
                left += touches
                if touches != 0:
                    link_a, link_b = links_at(key, chain.link_count)
                    claim(T, owners, link_a, link_b, key)
                k += wp.static(block_dim)
            while barrier_count(T, wp.static(touch.votes), left > 0) > 0:
                if own_key != DONE:
                    if owns_links(T, owners, own_a, own_b, own_key):
                        impulses += resolve_prepared(run, chain, own_a, own_b, own_depth)
                        left -= 1
                        own_key = DONE
                    else:
                        claim(T, next_owners, own_a, own_b, own_key)
                k = lane + wp.static(block_dim)
                while k < contacts:
                    if L[wp.static(lists.pending) + k] != 0:
                        key = contact_key(pair_at(L, T, k >> 1), turn, k & 1)
                        link_a, link_b = links_at(key, chain.link_count)
                        if owns_links(T, owners, link_a, link_b, key):
                            contact, inverse_nn, inverse_det = circles_at(run.K, chain, key)
                            impulses += hit(run, chain, link_a, link_b, contact, inverse_nn, inverse_det)
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
        return impulses

    return clear, find, resolve
