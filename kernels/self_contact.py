"""Contacts of a chain with itself after an accepted step: one fixed sequence, each seeing what those before it left.

A joint p carries a circle of link p (its right end) and one of link p + 1 (its left end). Two joints p < q that touch
are up to four pairs of links. The sequence has two halves: in the first come the link pairs (p, q) and
(p + 1, q + 1), in the second (p, q + 1) and (p + 1, q), which share no link either. Within a half, pairs of joints go
in the order of (p mod 2, q mod 2, p, q). So no link is met twice in a row by the same two joints, and a block of
threads can do the same sequence in about as few parallel rounds as the busiest link has contacts.

What a contact needs of the geometry does not depend on velocities: :func:`touching_circles` finds it for all contacts
at the same time, which leaves :func:`collide` little to do in its turn.
"""

import functools

import warp as wp

from .broadphase import list_layout
from .elementary import HALF, TWO, ZERO, quotient
from .impulse import collision_impulse, inverse_masses
from .layout import (
    INVERSE_INERTIA,
    INVERSE_MASS,
    LEFT_X,
    LEFT_Y,
    OMEGA,
    RIGHT_X,
    RIGHT_Y,
    U,
    V,
    X,
    Y,
)
from .types import Chain

wp.set_module_options({"enable_backward": False})


@wp.func
def are_neighbours(link_a: int, link_b: int, link_count: int):
    """True for the same link or links that share a joint."""
    apart = wp.abs(link_a - link_b)
    return apart < 2 or apart > link_count - 2


@wp.func
def effective_masses(
    K: wp.array2d(dtype=wp.float64),
    link_a: int,
    link_b: int,
    a_n: wp.float64,
    a_t: wp.float64,
    b_n: wp.float64,
    b_t: wp.float64,
):
    """W_nn, W_nt, W_tt [1/kg] of a contact, see :func:`circles_of_links`."""
    mass = K[INVERSE_MASS, link_a] + K[INVERSE_MASS, link_b]
    inertia_a = K[INVERSE_INERTIA, link_a]
    inertia_b = K[INVERSE_INERTIA, link_b]
    return (
        mass + a_n * a_n * inertia_a + b_n * b_n * inertia_b,
        a_n * a_t * inertia_a + b_n * b_t * inertia_b,
        mass + a_t * a_t * inertia_a + b_t * b_t * inertia_b,
    )


@wp.func
def circles_of_links(
    K: wp.array2d(dtype=wp.float64),
    chain: Chain,
    link_a: int,
    end_a_x: wp.float64,
    end_a_y: wp.float64,
    link_b: int,
    end_b_x: wp.float64,
    end_b_y: wp.float64,
):
    """Geometry of the contact of a circle of link A and one of link B, centres given [m].

    Numbers, not a struct: clang would carry that through memory, which makes a pile on the CPU twice as slow.

    Returns:
        Depth of the overlap [m], 0 if there is none (exactly concentric circles have no normal: no contact); normal
        from A to B; levers of A crossed with normal and tangent [m], likewise of B; 1/W_nn [kg] and 1/det W [kg²].
    """
    depth = ZERO
    nx = ZERO
    ny = ZERO
    a_n = ZERO
    a_t = ZERO
    b_n = ZERO
    b_t = ZERO
    inverse_nn = ZERO
    inverse_determinant = ZERO
    dx = end_b_x - end_a_x
    dy = end_b_y - end_a_y
    reach = TWO * chain.circle_radius
    square = dx * dx + dy * dy
    if square < reach * reach and square > ZERO:
        distance = wp.sqrt(square)
        depth = reach - distance
        nx = quotient(dx, distance)
        ny = quotient(dy, distance)
        px = HALF * (end_a_x + end_b_x)
        py = HALF * (end_a_y + end_b_y)
        ax = px - K[X, link_a]
        ay = py - K[Y, link_a]
        bx = px - K[X, link_b]
        by = py - K[Y, link_b]
        a_n = ax * ny - ay * nx
        a_t = ax * nx + ay * ny
        b_n = bx * ny - by * nx
        b_t = bx * nx + by * ny
        w_nn, w_nt, w_tt = effective_masses(K, link_a, link_b, a_n, a_t, b_n, b_t)
        inverse_nn, inverse_determinant = inverse_masses(w_nn, w_nt, w_tt)
    return depth, nx, ny, a_n, a_t, b_n, b_t, inverse_nn, inverse_determinant


@wp.func
def links_of(p: int, q: int, half: int, second: int, n: int):
    """Links A and B of the contact of joints p < q in this half of the sequence, the first (0) or second (1) of two."""
    link_b = q + (second ^ half)
    return p + second, wp.where(link_b == n, 0, link_b)


@wp.func
def touching_circles(K: wp.array2d(dtype=wp.float64), chain: Chain, p: int, q: int, half: int, second: int):
    """The same for that contact, see :func:`links_of`; links that share a joint have none.

    Joint j's left-hand circle belongs to link j's right end, its right-hand circle to the left end of the link after.
    """
    after_q = second ^ half
    link_a, link_b = links_of(p, q, half, second, chain.link_count)
    ax = wp.where(second == 0, K[RIGHT_X, p], K[LEFT_X, p + 1])
    ay = wp.where(second == 0, K[RIGHT_Y, p], K[LEFT_Y, p + 1])
    bx = wp.where(after_q == 0, K[RIGHT_X, q], K[LEFT_X, q + 1])
    by = wp.where(after_q == 0, K[RIGHT_Y, q], K[LEFT_Y, q + 1])
    if are_neighbours(link_a, link_b, chain.link_count):
        bx = ax
        by = ay
    return circles_of_links(K, chain, link_a, ax, ay, link_b, bx, by)


@wp.func
def collide(
    K: wp.array2d(dtype=wp.float64),
    chain: Chain,
    link_a: int,
    link_b: int,
    nx: wp.float64,
    ny: wp.float64,
    a_n: wp.float64,
    a_t: wp.float64,
    b_n: wp.float64,
    b_t: wp.float64,
    inverse_nn: wp.float64,
    inverse_determinant: wp.float64,
):
    """Impulse between two touching links, if they approach; returns the energy lost [J] and the number of impulses."""
    u = K[U, link_a] - K[U, link_b]
    v = K[V, link_a] - K[V, link_b]
    normal_speed = u * nx + v * ny
    normal_speed += K[OMEGA, link_a] * a_n - K[OMEGA, link_b] * b_n
    lost = ZERO
    hits = wp.int64(0)
    if normal_speed > ZERO:
        tangential_speed = v * nx - u * ny
        tangential_speed += K[OMEGA, link_a] * a_t - K[OMEGA, link_b] * b_t
        w_nn, w_nt, w_tt = effective_masses(K, link_a, link_b, a_n, a_t, b_n, b_t)
        jn, jt = collision_impulse(
            normal_speed,
            tangential_speed,
            w_nn,
            w_nt,
            w_tt,
            inverse_nn,
            inverse_determinant,
            chain.chain_restitution,
            chain.chain_friction,
            chain.tangential_restitution,
        )
        jx = jn * nx - jt * ny
        jy = jn * ny + jt * nx
        K[U, link_a] = K[U, link_a] - jx * K[INVERSE_MASS, link_a]
        K[V, link_a] = K[V, link_a] - jy * K[INVERSE_MASS, link_a]
        K[OMEGA, link_a] = K[OMEGA, link_a] - (a_n * jn + a_t * jt) * K[INVERSE_INERTIA, link_a]
        K[U, link_b] = K[U, link_b] + jx * K[INVERSE_MASS, link_b]
        K[V, link_b] = K[V, link_b] + jy * K[INVERSE_MASS, link_b]
        K[OMEGA, link_b] = K[OMEGA, link_b] + (b_n * jn + b_t * jt) * K[INVERSE_INERTIA, link_b]
        changed_n = w_nn * jn + w_nt * jt
        changed_t = w_nt * jn + w_tt * jt
        lost = jn * (normal_speed - HALF * changed_n) + jt * (tangential_speed - HALF * changed_t)
        hits = wp.int64(1)
    return lost, hits


@functools.cache
def self_contacts(columns: int):
    """Warp function that resolves a chain's contacts with itself, for scratch blocks of this width."""
    lists = list_layout(columns)

    @wp.func
    def resolve_self_contacts(
        K: wp.array2d(dtype=wp.float64), L: wp.array(dtype=wp.int32), chain: Chain, opening: wp.float64
    ):
        """Returns impulses, energy lost [J], and the greatest depth [m]; ``opening``: greatest |C| [m]."""
        reach = TWO * chain.circle_radius + TWO * opening
        square = reach * reach
        total = L[wp.static(lists.count)]
        touching = int(0)
        k = int(0)
        while k < total:
            p = L[wp.static(lists.first) + k]
            q = L[wp.static(lists.second) + k]
            dx = K[RIGHT_X, q] - K[RIGHT_X, p]
            dy = K[RIGHT_Y, q] - K[RIGHT_Y, p]
            L[wp.static(lists.touching) + touching] = k
            touching += wp.where(dx * dx + dy * dy < square, 1, 0)
            k += 1
        impulses = wp.int64(0)
        lost = ZERO
        deepest = ZERO
        half = int(0)
        while half < 2:
            k = int(0)
            while k < 2 * touching:
                pair = L[wp.static(lists.touching) + k // 2]
                p = L[wp.static(lists.first) + pair]
                q = L[wp.static(lists.second) + pair]
                link_a, link_b = links_of(p, q, half, k % 2, chain.link_count)
                depth, nx, ny, a_n, a_t, b_n, b_t, inverse_nn, inverse_determinant = touching_circles(
                    K, chain, p, q, half, k % 2
                )
                if depth > ZERO:
                    deepest = wp.max(deepest, depth)
                    energy, hits = collide(
                        K, chain, link_a, link_b, nx, ny, a_n, a_t, b_n, b_t, inverse_nn, inverse_determinant
                    )
                    lost += energy
                    impulses += hits
                k += 1
            half += 1
        return impulses, lost, deepest

    return resolve_self_contacts
