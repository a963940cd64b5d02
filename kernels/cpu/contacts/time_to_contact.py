"""The longest step that cannot miss a contact.

On springs it follows from a margin and the greatest speed. Steps on rigid joints are long and are bounded by actual
distances: of each circle from the floor at its speed of approach, of each listed pair at its relative speed. They are
never so long that gravity adds more than ``FALL``.
"""

import functools

import warp as wp

from warpchain.kernels.contacts.fixed_body import BODIES
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.contacts.pair_list import MOST_WAY, square_distance
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.cpu.contacts.proximity import greatest_speed
from warpchain.kernels.features import Features
from warpchain.kernels.layout import COSINE, LEFT_X, LEFT_Y, OMEGA, RADIUS, RIGHT_X, RIGHT_Y, SINE, U, V
from warpchain.kernels.physics.elementary import HALF, ONE, TWO, ZERO, order_bits
from warpchain.kernels.types import Chain, Integers, Rows, Worlds, with_circles

FLIGHT_SKIN = wp.constant(wp.float64(4.0))
"""The skin of the neighbour list is so many times as wide in a flight, whose steps may move joints by half of it."""

LEAST_SLACK = wp.constant(wp.float64(0.25))
"""A flight builds its list anew when less than this part of that skin is left: short steps would cost more."""

FALL = wp.constant(wp.float64(1e-4))
"""Way [m] that gravity may add in one step; steps of a loop that turns are shorter by themselves."""

SMALLEST_GAP = wp.constant(wp.float64(1e-9))
"""Least distance [m]; overlaps count as this."""


@wp.func
def meeting_of(K: Rows, chain: Chain, p: int, q: int):
    """(Relative speed) / (distance) [1/s] of the circles of two joints."""
    a = chain.half_length
    turn_p = a * K[OMEGA, p]
    turn_q = a * K[OMEGA, q]
    du = K[U, q] - turn_q * K[SINE, q] - K[U, p] + turn_p * K[SINE, p]
    dv = K[V, q] + turn_q * K[COSINE, q] - K[V, p] - turn_p * K[COSINE, p]
    gap = wp.max(wp.sqrt(square_distance(K, p, q)) - TWO * chain.circle_radius, SMALLEST_GAP)
    return wp.sqrt(du * du + dv * dv) / gap


@functools.cache
def fastest_approach(fixed_body: str):
    """Warp function: greatest (speed of approach) / (gap to the body) [1/s] of all circles; 0 if none approaches."""
    surface = BODIES[fixed_body].surface

    @wp.func
    def approach(chain: Chain, face: Face, x: wp.float64, y: wp.float64, u: wp.float64, v: wp.float64):
        gap, nx, ny, _u, _v, _e, _mu = surface(chain, face, x, y)
        return wp.max(-(nx * u + ny * v), ZERO) / wp.max(gap, SMALLEST_GAP)

    @wp.func
    def fastest(K: Rows, chain: Chain, face: Face):
        greatest = wp.int64(0)
        i = int(0)
        while i < chain.link_count:
            turn = chain.half_length * K[OMEGA, i]
            u = turn * K[SINE, i]
            v = turn * K[COSINE, i]
            own = with_circles(chain, K[RADIUS, i])
            left = approach(own, face, K[LEFT_X, i], K[LEFT_Y, i], K[U, i] + u, K[V, i] - v)
            right = approach(own, face, K[RIGHT_X, i], K[RIGHT_Y, i], K[U, i] - u, K[V, i] + v)
            greatest = wp.max(greatest, wp.max(order_bits(left), order_bits(right)))
            i += 1
        return wp.cast(greatest, wp.float64)

    return fastest


@functools.cache
def fastest_meeting(columns: int):
    """Warp function: greatest (relative speed) / (distance) [1/s] of the pairs in the neighbour list."""
    lists = list_layout(columns)

    @wp.func
    def meeting(K: Rows, L: Integers, chain: Chain):
        greatest = wp.int64(0)
        total = L[wp.static(lists.count)]
        k = int(0)
        while k < total:
            rate = meeting_of(K, chain, L[wp.static(lists.first) + k], L[wp.static(lists.second) + k])
            greatest = wp.max(greatest, order_bits(rate))
            k += 1
        return wp.cast(greatest, wp.float64)

    return meeting


@functools.cache
def step_bound(features: Features, has_flight: bool):
    """Warp function: longest step [s] from a placed state that cannot miss a contact; ∞ if there are none.

    ``bound(K, L, chain, face, worlds, world, longest)``; ``longest`` [s] bounds steps near a contact.
    """
    has_fixed = features.fixed_body != "none"
    has_self = features.self_contact
    count = list_layout(features.columns).count
    meeting = fastest_meeting(features.columns)
    is_plane = BODIES[features.fixed_body].is_plane
    if is_plane:
        approaching = fastest_approach(features.fixed_body)

    @wp.func
    def bound(K: Rows, L: Integers, chain: Chain, face: Face, worlds: Worlds, world: int, longest: wp.float64):
        if wp.static(not (has_fixed or has_self)):
            return wp.float64(wp.inf)
        gap = worlds.gap[world]
        slack = worlds.slack[world]
        if wp.static(has_flight):
            if worlds.is_rigid[world] != 0:
                approach = ZERO
                if wp.static(is_plane):
                    approach = approaching(K, chain, face)
                elif wp.static(has_fixed):
                    # what a circle approaches may be another face than that which is nearest to it
                    approach = greatest_speed(K, chain) / wp.max(gap, SMALLEST_GAP)
                if wp.static(has_self):
                    approach = wp.max(approach, meeting(K, L, chain))
                    approach = wp.max(approach, greatest_speed(K, chain) / wp.max(slack, SMALLEST_GAP))
                approach = wp.max(approach, wp.sqrt(HALF * chain.gravity / FALL))
                return wp.max(longest, ONE / approach)
        distance = worlds.control.skin
        is_near = bool(False)
        if wp.static(has_fixed):
            is_near = gap < worlds.control.skin
            distance = HALF * gap
        if wp.static(has_self):
            is_near = is_near or L[wp.static(count)] > 0
            distance = wp.min(distance, wp.min(slack, MOST_WAY * worlds.control.skin))
        if is_near:
            return longest
        return wp.max(longest, distance / greatest_speed(K, chain))

    return bound
