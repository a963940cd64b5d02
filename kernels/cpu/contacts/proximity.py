"""Floor and sprocket on a CPU: their distance from a chain, and their contacts after an accepted step.

Every circle that overlaps and approaches gets one impulse; overlapping circles that separate get none, and positions
are never corrected. Such a contact changes one link only, so the order of links does not matter; each link's left
circle comes before its right one. Contacts between links have a fixed order, see :mod:`cpu.contacts.self_contacts`.
"""

import warp as wp

from warpchain.kernels.contacts.fixed_body import meet_floor, meet_sprocket
from warpchain.kernels.layout import (
    ERROR,
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
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, from_order_key, order_bits, order_key
from warpchain.kernels.physics.geometry import LANES, whole_lanes
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})

FURTHEST = wp.constant(wp.int64(2**63 - 1))
DISTANCE = ERROR
"""Row of what is negative where a link overlaps the fixed body. Between attempts nothing else uses it."""


@wp.func
def greatest_opening(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Greatest joint opening |C| [m] of the placed links."""
    greatest = wp.int64(0)
    i = int(0)
    while i < whole_lanes(chain.link_count):
        cx = K[LEFT_X, i + 1] - K[RIGHT_X, i]
        cy = K[LEFT_Y, i + 1] - K[RIGHT_Y, i]
        greatest = wp.max(greatest, wp.where(i < chain.link_count, order_bits(cx * cx + cy * cy), wp.int64(0)))
        i += 1
    return wp.sqrt(wp.cast(greatest, wp.float64))


@wp.func
def greatest_speed(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """A bound on the speed [m/s] of every circle's centre: the greatest √2 √(v² + (a ω)²) ≥ |v| + a |ω|."""
    greatest = wp.int64(0)
    i = int(0)
    while i < whole_lanes(chain.link_count):
        turn = chain.half_length * K[OMEGA, i]
        square = TWO * (K[U, i] * K[U, i] + K[V, i] * K[V, i] + turn * turn)
        greatest = wp.max(greatest, wp.where(i < chain.link_count, order_bits(square), wp.int64(0)))
        i += 1
    return wp.sqrt(wp.cast(greatest, wp.float64))


@wp.func
def floor_gap(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Height [m] of the chain's lowest point above the floor; negative when it is below."""
    lowest = order_key(K[LEFT_Y, 0])
    i = int(0)
    while i < whole_lanes(chain.link_count):
        here = wp.min(order_key(K[LEFT_Y, i]), order_key(K[RIGHT_Y, i]))
        lowest = wp.min(lowest, wp.where(i < chain.link_count, here, FURTHEST))
        i += 1
    return from_order_key(lowest) - chain.circle_radius


@wp.func
def sprocket_gap(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Least distance [m] between the sprocket's surface and a link's circle; negative when they overlap."""
    least = order_bits(K[LEFT_X, 0] * K[LEFT_X, 0] + K[LEFT_Y, 0] * K[LEFT_Y, 0])
    i = int(0)
    while i < whole_lanes(chain.link_count):
        left = order_bits(K[LEFT_X, i] * K[LEFT_X, i] + K[LEFT_Y, i] * K[LEFT_Y, i])
        right = order_bits(K[RIGHT_X, i] * K[RIGHT_X, i] + K[RIGHT_Y, i] * K[RIGHT_Y, i])
        least = wp.min(least, wp.where(i < chain.link_count, wp.min(left, right), FURTHEST))
        i += 1
    return wp.sqrt(wp.cast(least, wp.float64)) - chain.sprocket_radius - chain.circle_radius


@wp.func
def floor_distance(chain: Chain, left_x: wp.float64, left_y: wp.float64, right_x: wp.float64, right_y: wp.float64):
    """Negative if a circle of a link with these ends overlaps the floor."""
    return wp.min(left_y, right_y) - chain.circle_radius


REACH_MARGIN = wp.constant(wp.float64(1.000001))
"""More than rounding could hide; the impulse law asks each link exactly."""


@wp.func
def sprocket_distance(chain: Chain, left_x: wp.float64, left_y: wp.float64, right_x: wp.float64, right_y: wp.float64):
    """Negative if a circle of a link with these ends overlaps the sprocket, or nearly so."""
    reach = chain.sprocket_radius + chain.circle_radius
    nearest = wp.min(left_x * left_x + left_y * left_y, right_x * right_x + right_y * right_y)
    return nearest - reach * reach * REACH_MARGIN


@wp.func
def has_overlap(K: wp.array2d(dtype=wp.float64), first: int):
    """Whether a link of the vector that begins at this column overlaps the body."""
    least = ONE
    for lane in range(wp.static(LANES)):
        least = wp.min(least, K[DISTANCE, first + lane])
    return least < ZERO


def resolution(meet: wp.Function, distance: wp.Function):
    """Warp function ``resolve`` of all links and a fixed body, from that of one link, see :func:`meeting`.

    Few links touch at a time: only vectors with a link that overlaps the body go through the impulse law.
    """

    @wp.func
    def resolve(K: wp.array2d(dtype=wp.float64), chain: Chain, surface_speed: wp.float64, push_rate: wp.float64):
        """Applies the impulses between links and the body; returns their number."""
        impulses = wp.int64(0)
        i = int(0)
        while i < whole_lanes(chain.link_count):
            away = distance(chain, K[LEFT_X, i], K[LEFT_Y, i], K[RIGHT_X, i], K[RIGHT_Y, i])
            K[DISTANCE, i] = wp.where(i < chain.link_count, away, ONE)
            i += 1
        first = int(0)
        while first < whole_lanes(chain.link_count):
            if has_overlap(K, first):
                lane = int(0)
                while lane < LANES:
                    i = first + lane
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
                    impulses += wp.where(i < chain.link_count, hits, wp.int64(0))
                    lane += 1
            first += LANES
        return impulses

    return resolve


resolve_floor, resolve_sprocket = (
    resolution(meet_floor, floor_distance),
    resolution(meet_sprocket, sprocket_distance),
)
