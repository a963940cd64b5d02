"""Contacts of a chain after an accepted step: floor, then sprocket, then its own links.

Overlapping and approaching circles get one impulse each; overlapping ones that separate are left alone, and
positions are never corrected. A floor or sprocket contact touches one link only, so those are done link by link,
each link's left circle before its right one: the result is that of any sequence over the links. Contacts between
links follow one fixed order, see :func:`resolve_self_contacts`.
"""

import functools

import warp as wp

from .broadphase import list_layout
from .elementary import HALF, ONE, TWO, ZERO, from_order_key, order_bits, order_key, quotient
from .impulse import collision_impulse, fixed_contact
from .layout import (
    INVERSE_INERTIA,
    INVERSE_MASS,
    LEFT_X,
    LEFT_Y,
    LOST_FIXED,
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

SMALLEST = wp.constant(wp.float64(1e-300))


@wp.func
def greatest_opening(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Greatest joint opening |C| [m] of the placed links."""
    greatest = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        cx = K[LEFT_X, i + 1] - K[RIGHT_X, i]
        cy = K[LEFT_Y, i + 1] - K[RIGHT_Y, i]
        greatest = wp.max(greatest, order_bits(cx * cx + cy * cy))
        i += 1
    return wp.sqrt(wp.cast(greatest, wp.float64))


@wp.func
def greatest_speed(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """A bound of the speed [m/s] of every circle's centre: the greatest of |v| + a |ω|."""
    greatest = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        turn = chain.half_length * K[OMEGA, i]
        square = TWO * (K[U, i] * K[U, i] + K[V, i] * K[V, i] + turn * turn)
        greatest = wp.max(greatest, order_bits(square))
        i += 1
    return wp.sqrt(wp.cast(greatest, wp.float64))


@wp.func
def floor_gap(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Height [m] of the chain's lowest point above the floor; negative when it is below."""
    lowest = order_key(K[LEFT_Y, 0])
    i = int(0)
    while i < chain.link_count:
        lowest = wp.min(lowest, wp.min(order_key(K[LEFT_Y, i]), order_key(K[RIGHT_Y, i])))
        i += 1
    return from_order_key(lowest) - chain.circle_radius


@wp.func
def sprocket_gap(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Least distance [m] between the sprocket's surface and a link's circle; negative when they overlap."""
    least = order_bits(K[LEFT_X, 0] * K[LEFT_X, 0] + K[LEFT_Y, 0] * K[LEFT_Y, 0])
    i = int(0)
    while i < chain.link_count:
        left = order_bits(K[LEFT_X, i] * K[LEFT_X, i] + K[LEFT_Y, i] * K[LEFT_Y, i])
        right = order_bits(K[RIGHT_X, i] * K[RIGHT_X, i] + K[RIGHT_Y, i] * K[RIGHT_Y, i])
        least = wp.min(least, wp.min(left, right))
        i += 1
    return wp.sqrt(wp.cast(least, wp.float64)) - chain.sprocket_radius - chain.circle_radius


@wp.func
def meet_floor(
    chain: Chain,
    left_x: wp.float64,
    left_y: wp.float64,
    right_x: wp.float64,
    right_y: wp.float64,
    x: wp.float64,
    y: wp.float64,
    inverse_mass: wp.float64,
    inverse_inertia: wp.float64,
    u: wp.float64,
    v: wp.float64,
    omega: wp.float64,
):
    """One link against the floor y = 0 (body A; n̂ = ŷ), its left circle first.

    Returns:
        u, v, ω afterwards, energy lost [J] by the left and the right circle, number of impulses.
    """
    r = chain.circle_radius
    u, v, omega, lost_left, hit_left = fixed_contact(
        chain,
        left_y - r,
        ZERO,
        ONE,
        left_x - x,
        left_y - y - r,
        ZERO,
        ZERO,
        inverse_mass,
        inverse_inertia,
        chain.floor_restitution,
        chain.floor_friction,
        u,
        v,
        omega,
    )
    u, v, omega, lost_right, hit_right = fixed_contact(
        chain,
        right_y - r,
        ZERO,
        ONE,
        right_x - x,
        right_y - y - r,
        ZERO,
        ZERO,
        inverse_mass,
        inverse_inertia,
        chain.floor_restitution,
        chain.floor_friction,
        u,
        v,
        omega,
    )
    return u, v, omega, lost_left, lost_right, hit_left + hit_right


@wp.func
def resolve_floor(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Impulses between links and the floor; returns their number."""
    impulses = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        u, v, w, lost_left, lost_right, hits = meet_floor(
            chain,
            K[LEFT_X, i],
            K[LEFT_Y, i],
            K[RIGHT_X, i],
            K[RIGHT_Y, i],
            K[X, i],
            K[Y, i],
            K[INVERSE_MASS, i],
            K[INVERSE_INERTIA, i],
            K[U, i],
            K[V, i],
            K[OMEGA, i],
        )
        K[U, i] = u
        K[V, i] = v
        K[OMEGA, i] = w
        K[LOST_FIXED, i] = K[LOST_FIXED, i] + lost_left + lost_right
        impulses += hits
        i += 1
    return impulses


@wp.func
def sprocket_circle(
    chain: Chain,
    surface_speed: wp.float64,
    circle_x: wp.float64,
    circle_y: wp.float64,
    arm_x: wp.float64,
    arm_y: wp.float64,
    inverse_mass: wp.float64,
    inverse_inertia: wp.float64,
    u: wp.float64,
    v: wp.float64,
    omega: wp.float64,
):
    """One circle against the sprocket about the origin (body A; n̂ points outwards).

    ``arm`` leads from the link's centre to the circle's; ``surface_speed`` is the sprocket's angular velocity. The
    touching point is the circle's nearest to the sprocket's centre.
    """
    # a circle exactly at the centre has no normal: zero instead makes it one that does not approach
    distance = wp.max(wp.sqrt(circle_x * circle_x + circle_y * circle_y), SMALLEST)
    normal_x = quotient(circle_x, distance)
    normal_y = quotient(circle_y, distance)
    r = chain.circle_radius
    point_x = circle_x - r * normal_x
    point_y = circle_y - r * normal_y
    return fixed_contact(
        chain,
        distance - r - chain.sprocket_radius,
        normal_x,
        normal_y,
        arm_x - r * normal_x,
        arm_y - r * normal_y,
        -surface_speed * point_y,
        surface_speed * point_x,
        inverse_mass,
        inverse_inertia,
        chain.sprocket_restitution,
        chain.sprocket_friction,
        u,
        v,
        omega,
    )


@wp.func
def meet_sprocket(
    chain: Chain,
    surface_speed: wp.float64,
    left_x: wp.float64,
    left_y: wp.float64,
    right_x: wp.float64,
    right_y: wp.float64,
    x: wp.float64,
    y: wp.float64,
    inverse_mass: wp.float64,
    inverse_inertia: wp.float64,
    u: wp.float64,
    v: wp.float64,
    omega: wp.float64,
):
    """One link against the sprocket turning at ``surface_speed`` [rad/s]; otherwise as :func:`meet_floor`."""
    u, v, omega, lost_left, hit_left = sprocket_circle(
        chain,
        surface_speed,
        left_x,
        left_y,
        left_x - x,
        left_y - y,
        inverse_mass,
        inverse_inertia,
        u,
        v,
        omega,
    )
    u, v, omega, lost_right, hit_right = sprocket_circle(
        chain,
        surface_speed,
        right_x,
        right_y,
        right_x - x,
        right_y - y,
        inverse_mass,
        inverse_inertia,
        u,
        v,
        omega,
    )
    return u, v, omega, lost_left, lost_right, hit_left + hit_right


@wp.func
def resolve_sprocket(K: wp.array2d(dtype=wp.float64), chain: Chain, surface_speed: wp.float64):
    """Impulses between links and the sprocket turning at ``surface_speed`` [rad/s]; returns their number."""
    impulses = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        u, v, w, lost_left, lost_right, hits = meet_sprocket(
            chain,
            surface_speed,
            K[LEFT_X, i],
            K[LEFT_Y, i],
            K[RIGHT_X, i],
            K[RIGHT_Y, i],
            K[X, i],
            K[Y, i],
            K[INVERSE_MASS, i],
            K[INVERSE_INERTIA, i],
            K[U, i],
            K[V, i],
            K[OMEGA, i],
        )
        K[U, i] = u
        K[V, i] = v
        K[OMEGA, i] = w
        K[LOST_FIXED, i] = K[LOST_FIXED, i] + lost_left + lost_right
        impulses += hits
        i += 1
    return impulses


@wp.func
def resolve_link_pair(
    K: wp.array2d(dtype=wp.float64),
    chain: Chain,
    link_a: int,
    end_a_x: wp.float64,
    end_a_y: wp.float64,
    link_b: int,
    end_b_x: wp.float64,
    end_b_y: wp.float64,
):
    """One circle of link A against one of link B, centres given [m].

    Returns:
        Depth of the overlap [m] (0 if none), energy lost [J], and 1 if there was an impulse, else 0. Exactly
        concentric circles have no normal and are left alone.
    """
    dx = end_b_x - end_a_x
    dy = end_b_y - end_a_y
    reach = TWO * chain.circle_radius
    square = dx * dx + dy * dy
    depth = ZERO
    lost = ZERO
    hits = wp.int64(0)
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
        vx = (K[U, link_a] - K[OMEGA, link_a] * ay) - (K[U, link_b] - K[OMEGA, link_b] * by)
        vy = (K[V, link_a] + K[OMEGA, link_a] * ax) - (K[V, link_b] + K[OMEGA, link_b] * bx)
        normal_speed = vx * nx + vy * ny
        if normal_speed > ZERO:
            tangential_speed = vy * nx - vx * ny
            a_n = ax * ny - ay * nx
            a_t = ax * nx + ay * ny
            b_n = bx * ny - by * nx
            b_t = bx * nx + by * ny
            mass_a = K[INVERSE_MASS, link_a]
            mass_b = K[INVERSE_MASS, link_b]
            inertia_a = K[INVERSE_INERTIA, link_a]
            inertia_b = K[INVERSE_INERTIA, link_b]
            w_nn = mass_a + mass_b + a_n * a_n * inertia_a + b_n * b_n * inertia_b
            w_nt = a_n * a_t * inertia_a + b_n * b_t * inertia_b
            w_tt = mass_a + mass_b + a_t * a_t * inertia_a + b_t * b_t * inertia_b
            jn, jt = collision_impulse(
                normal_speed,
                tangential_speed,
                w_nn,
                w_nt,
                w_tt,
                chain.chain_restitution,
                chain.chain_friction,
                chain.tangential_restitution,
            )
            jx = jn * nx - jt * ny
            jy = jn * ny + jt * nx
            K[U, link_a] = K[U, link_a] - jx * mass_a
            K[V, link_a] = K[V, link_a] - jy * mass_a
            K[OMEGA, link_a] = K[OMEGA, link_a] - (a_n * jn + a_t * jt) * inertia_a
            K[U, link_b] = K[U, link_b] + jx * mass_b
            K[V, link_b] = K[V, link_b] + jy * mass_b
            K[OMEGA, link_b] = K[OMEGA, link_b] + (b_n * jn + b_t * jt) * inertia_b
            changed_n = w_nn * jn + w_nt * jt
            changed_t = w_nt * jn + w_tt * jt
            lost = jn * (normal_speed - HALF * changed_n) + jt * (tangential_speed - HALF * changed_t)
            hits = wp.int64(1)
    return depth, lost, hits


@wp.func
def are_neighbours(link_a: int, link_b: int, link_count: int):
    """True for the same link or links that share a joint."""
    apart = wp.abs(link_a - link_b)
    return apart < 2 or apart > link_count - 2


@wp.func
def resolve_joint_pair(K: wp.array2d(dtype=wp.float64), chain: Chain, p: int, q: int, lost: wp.float64):
    """The four link pairs of two joints p < q, one after the other.

    Returns:
        Greatest depth [m], ``lost`` plus the energy lost [J], number of impulses.
    """
    n = chain.link_count
    impulses = wp.int64(0)
    deepest = ZERO
    c = int(0)
    while c < 4:
        # c = 0 … 3: links (p, q), (p, q + 1), (p + 1, q), (p + 1, q + 1); joint j's left-hand circle
        # belongs to link j's right end, its right-hand circle to the left end of the link after it
        after_p = c // 2
        after_q = c % 2
        link_a = p + after_p
        link_b = q + after_q
        ax = wp.where(after_p == 0, K[RIGHT_X, p], K[LEFT_X, p + 1])
        ay = wp.where(after_p == 0, K[RIGHT_Y, p], K[LEFT_Y, p + 1])
        bx = wp.where(after_q == 0, K[RIGHT_X, q], K[LEFT_X, q + 1])
        by = wp.where(after_q == 0, K[RIGHT_Y, q], K[LEFT_Y, q + 1])
        if link_b == n:
            link_b = 0
        if not are_neighbours(link_a, link_b, n):
            depth, energy, hits = resolve_link_pair(K, chain, link_a, ax, ay, link_b, bx, by)
            deepest = wp.max(deepest, depth)
            lost += energy
            impulses += hits
        c += 1
    return deepest, lost, impulses


@functools.cache
def self_contacts(columns: int):
    """Warp function that resolves a chain's contacts with itself, for scratch blocks of this width.

    Order. A joint p carries a circle of link p (its right end) and one of link p + 1 (its left end). Pairs of joints
    (p, q), p < q, go in the order of (p mod 2, q mod 2, p, q); within a pair, the links (p, q), (p, q + 1),
    (p + 1, q), (p + 1, q + 1), each seeing the velocities left by those before. Joint pairs of one parity class
    seldom share a link, so a block of threads can do the same sequence in a few parallel rounds.
    """
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
        k = int(0)
        while k < touching:
            pair = L[wp.static(lists.touching) + k]
            p = L[wp.static(lists.first) + pair]
            q = L[wp.static(lists.second) + pair]
            depth, lost, hits = resolve_joint_pair(K, chain, p, q, lost)
            deepest = wp.max(deepest, depth)
            impulses += hits
            k += 1
        return impulses, lost, deepest

    return resolve_self_contacts
