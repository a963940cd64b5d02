"""Contacts of a chain with floor and sprocket after an accepted step, and how near they are.

Overlapping and approaching circles get one impulse each; overlapping ones that separate are left alone, and
positions are never corrected. A floor or sprocket contact touches one link only, so those are done link by link,
each link's left circle before its right one: the result is that of any sequence over the links. Contacts between
links follow one fixed order, see :mod:`cpu.contacts.self_contacts`.
"""

import warp as wp

from warpchain.kernels.contacts.impulse import fixed_contact
from warpchain.kernels.layout import (
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
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, from_order_key, order_bits, order_key, quotient
from warpchain.kernels.types import Chain

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
    push_rate: wp.float64,
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
    touching point is the circle's nearest to the sprocket's centre. Where the circle has sunk in by d, the surface
    moves outwards at ``push_rate`` d. Impulses alone stop a circle only after a step in which it has sunk in: in steps
    of 50 µs loops sank by 0.06 to 0.14 mm, and were slower for it.
    """
    # a circle exactly at the centre has no normal: zero instead makes it one that does not approach
    distance = wp.max(wp.sqrt(circle_x * circle_x + circle_y * circle_y), SMALLEST)
    normal_x = quotient(circle_x, distance)
    normal_y = quotient(circle_y, distance)
    r = chain.circle_radius
    point_x = circle_x - r * normal_x
    point_y = circle_y - r * normal_y
    gap = distance - r - chain.sprocket_radius
    push = push_rate * wp.max(ZERO, -gap)
    return fixed_contact(
        chain,
        gap,
        normal_x,
        normal_y,
        arm_x - r * normal_x,
        arm_y - r * normal_y,
        push * normal_x - surface_speed * point_y,
        push * normal_y + surface_speed * point_x,
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
    push_rate: wp.float64,
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
    """One link against the sprocket, otherwise as :func:`meet_floor`.

    It turns at ``surface_speed`` [rad/s] and pushes out what has sunk in at ``push_rate`` [1/s].
    """
    u, v, omega, lost_left, hit_left = sprocket_circle(
        chain,
        surface_speed,
        push_rate,
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
        push_rate,
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
def resolve_sprocket(K: wp.array2d(dtype=wp.float64), chain: Chain, surface_speed: wp.float64, push_rate: wp.float64):
    """Impulses between links and the sprocket, see :func:`meet_sprocket`; returns their number."""
    impulses = wp.int64(0)
    i = int(0)
    while i < chain.link_count:
        u, v, w, lost_left, lost_right, hits = meet_sprocket(
            chain,
            surface_speed,
            push_rate,
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
