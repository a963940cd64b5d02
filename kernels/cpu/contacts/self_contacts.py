"""Contacts of a chain with itself after an accepted step, resolved in one fixed sequence.

A joint p carries a circle of link p (its right end) and one of link p + 1 (its left end), so two joints p < q that
touch are up to four contacts of links. The sequence has two halves. The first has the link pairs (p, q) and (p + 1, q +
1), the second (p, q + 1) and (p + 1, q); within a half the two share no link. In each half, pairs of joints are sorted
by (p mod 2, q mod 2, p, q). Successive contacts then rarely share a link, so a block of threads can resolve the same
sequence in about as many parallel rounds as the busiest link has contacts.

The geometry of contacts does not depend on velocities. :func:`circles_of_links` evaluates it for all contacts first,
which leaves little for :func:`collide` to do one after the other. That is a vectorised loop over pairs of joints, whose
circles are copied side by side before; gathers in that loop took twice as long. Masses copied as well took longer by
half in a dense heap than dividing for each contact.
"""

import functools

import warp as wp

from warpchain.kernels.contacts import link_pair
from warpchain.kernels.contacts.link_pair import B_T, DEPTH, Contact, are_neighbours, circles_of_links, collide, natural
from warpchain.kernels.contacts.list_layout import GEOMETRY_COLUMNS, GEOMETRY_ROWS, list_layout
from warpchain.kernels.contacts.pair_list import square_distance
from warpchain.kernels.layout import LEFT_X, RADIUS, RIGHT_X, X
from warpchain.kernels.physics.elementary import TWO, ZERO, order_bits
from warpchain.kernels.physics.geometry import put, two
from warpchain.kernels.types import Chain, Integers, Rows

# Rows of the CPU's scratch of contacts, one column per pair of joints. First four circles, the left-hand and the
# right-hand one of joint p, likewise of joint q: its own centre [m], the centre of mass of its link [m] and its radius.
P_LEFT_HAND, P_RIGHT_HAND, Q_LEFT_HAND, Q_RIGHT_HAND = 0, 5, 10, 15
END_X, CENTER_X, END_RADIUS = 0, 2, 4
# Then the two contacts of a half, each as a Contact.
FIRST_CONTACT, SECOND_CONTACT = 20, 27


@wp.func
def copy_circle(K: Rows, G: Rows, row: int, k: int, end: wp.vec2d, link: int):
    """Copies a circle, its link's centre of mass and its radius into column k of the scratch."""
    put(G, row + END_X, k, end)
    put(G, row + CENTER_X, k, two(K, X, link))
    G[row + END_RADIUS, k] = K[RADIUS, link]


@functools.cache
def self_contacts(columns: int):
    """Warp function that resolves a chain's contacts with itself, for scratch of this width."""
    lists = list_layout(columns)

    @wp.func
    def list_touching(K: Rows, L: Integers, chain: Chain, opening: wp.float64):
        """Lists the pairs of joints that may touch, in the order of the list; returns their number."""
        reach = TWO * chain.circle_radius + TWO * opening
        square = reach * reach
        total = L[wp.static(lists.count)]
        touching = int(0)
        k = int(0)
        while k < total:
            p = natural(L[wp.static(lists.first) + k])
            q = natural(L[wp.static(lists.second) + k])
            L[wp.static(lists.found_first) + touching] = p
            L[wp.static(lists.found_second) + touching] = q
            touching += wp.where(square_distance(K, p, q) < square, 1, 0)
            k += 1
        return touching

    @wp.func
    def copy_circles(K: Rows, L: Integers, G: Rows, n: int, first: int, count: int):
        """Copies the circles of ``count`` touching pairs of joints side by side."""
        k = int(0)
        while k < count:
            p = natural(L[wp.static(lists.found_first) + first + k])
            q = natural(L[wp.static(lists.found_second) + first + k])
            after = wp.where(q + 1 == n, 0, q + 1)
            copy_circle(K, G, P_LEFT_HAND, k, two(K, RIGHT_X, p), p)
            copy_circle(K, G, P_RIGHT_HAND, k, two(K, LEFT_X, p + 1), p + 1)
            copy_circle(K, G, Q_LEFT_HAND, k, two(K, RIGHT_X, q), q)
            copy_circle(K, G, Q_RIGHT_HAND, k, two(K, LEFT_X, q + 1), after)
            k += 1

    @wp.func
    def evaluate(K: Rows, L: Integers, G: Rows, chain: Chain, first: int, count: int, half: int, second: int):
        """Evaluates the geometry of one contact of a half for each of these pairs."""
        a = wp.where(second == 0, P_LEFT_HAND, P_RIGHT_HAND)
        b = wp.where(second == half, Q_LEFT_HAND, Q_RIGHT_HAND)
        row = wp.where(second == 0, FIRST_CONTACT, SECOND_CONTACT)
        k = int(0)
        while k < count:
            p = L[wp.static(lists.found_first) + first + k]
            q = L[wp.static(lists.found_second) + first + k]
            link_a, link_b = link_pair.links_of(p, q, half, second, chain.link_count)
            end_a = two(G, a + END_X, k)
            end_b = two(G, b + END_X, k)
            center_a = two(G, a + CENTER_X, k)
            center_b = two(G, b + CENTER_X, k)
            contact = circles_of_links(G[a + END_RADIUS, k], G[b + END_RADIUS, k], end_a, end_b, center_a, center_b)
            G[row + DEPTH, k] = wp.where(are_neighbours(link_a, link_b, chain.link_count), ZERO, contact[DEPTH])
            for number in range(1, wp.static(B_T + 1)):
                G[row + number, k] = contact[number]
            k += 1

    @wp.func
    def resolve_self_contacts(K: Rows, L: Integers, chain: Chain, opening: wp.float64):
        """Resolves all contacts → impulses, those of strands, energy lost [J], greatest depth [m]; opening: |C| [m]."""
        start = L.ptr + wp.uint64(wp.static(4 * lists.geometry))
        G = wp.array(ptr=start, shape=(GEOMETRY_ROWS, GEOMETRY_COLUMNS), dtype=wp.float64)
        touching = list_touching(K, L, chain, opening)
        impulses = wp.int64(0)
        strands = wp.int64(0)
        lost = ZERO
        deepest = wp.int64(0)
        half = int(0)
        while half < 2:
            first = int(0)
            while first < touching:
                count = wp.min(touching - first, GEOMETRY_COLUMNS)
                if half == 0 or touching > GEOMETRY_COLUMNS:
                    copy_circles(K, L, G, chain.link_count, first, count)
                # whole vectors: columns beyond the last pair are evaluated, too, and not used
                padded = (count + 7) & -8
                evaluate(K, L, G, chain, first, padded, half, 0)
                evaluate(K, L, G, chain, first, padded, half, 1)
                k = int(0)
                while k < count:
                    p = natural(L[wp.static(lists.found_first) + first + k])
                    q = natural(L[wp.static(lists.found_second) + first + k])
                    second = int(0)
                    while second < 2:
                        row = wp.where(second == 0, FIRST_CONTACT, SECOND_CONTACT)
                        depth = G[row + DEPTH, k]
                        if depth > ZERO:
                            deepest = wp.max(deepest, order_bits(depth))
                            link_a, link_b = link_pair.links_of(p, q, half, second, chain.link_count)
                            contact = Contact()
                            for number in range(wp.static(B_T + 1)):
                                contact[number] = G[row + number, k]
                            inverse_nn, inverse_det = link_pair.divisors(K, link_a, link_b, contact)
                            energy, hits = collide(K, chain, link_a, link_b, contact, inverse_nn, inverse_det)
                            lost += energy
                            impulses += hits
                            if link_pair.are_strands(link_a, link_b, chain.link_count):
                                strands += hits
                        second += 1
                    k += 1
                first += GEOMETRY_COLUMNS
            half += 1
        return impulses, strands, lost, wp.cast(deepest, wp.float64)

    return resolve_self_contacts
