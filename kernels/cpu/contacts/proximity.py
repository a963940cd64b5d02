"""Floor and sprocket on a CPU: their distance from a chain, and their contacts after an accepted step.

Every circle that overlaps and approaches gets one impulse; overlapping circles that separate get none, and positions
are never corrected. Such a contact changes one link only, so the order of links does not matter; each link's left
circle comes before its right one. Contacts between links have a fixed order, see :mod:`cpu.contacts.self_contacts`.
"""

import warp as wp

from warpchain.kernels.contacts.fixed_body import meet_floor, meet_sprocket
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
from warpchain.kernels.physics.elementary import TWO, from_order_key, order_bits, order_key
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})


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
    """A bound on the speed [m/s] of every circle's centre: the greatest √2 √(v² + (a ω)²) ≥ |v| + a |ω|."""
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


def resolution(meet: wp.Function):
    """Warp function ``resolve`` of all links and a fixed body, from that of one link, see :func:`meeting`."""

    @wp.func
    def resolve(K: wp.array2d(dtype=wp.float64), chain: Chain, surface_speed: wp.float64, push_rate: wp.float64):
        """Applies the impulses between links and the body; returns their number."""
        impulses = wp.int64(0)
        i = int(0)
        while i < chain.link_count:
            u, v, w, lost_left, lost_right, hits = meet(
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

    return resolve


resolve_floor, resolve_sprocket = resolution(meet_floor), resolution(meet_sprocket)
