"""Floor and sprocket in the block form: how far they are, how long the next step may be, and what they do."""

import functools

import warp as wp

from warpchain.kernels.contacts.approach import SMALLEST_GAP, falling, meeting_of
from warpchain.kernels.cpu.contacts.fixed_body import meet_floor, meet_sprocket
from warpchain.kernels.cpu.contacts.neighbour_list import list_layout
from warpchain.kernels.cpu.loop import Features, sprocket_turning
from warpchain.kernels.gpu.board import contact_constants, ends_of
from warpchain.kernels.gpu.stage import Link, Place, Surroundings, link_on, vec5d
from warpchain.kernels.gpu.threads import barrier, block_maxima, vec4i
from warpchain.kernels.layout import (
    BOARD_LISTED_X,
    BOARD_LISTED_Y,
    BOARD_LOST_FIXED,
    BOARD_NOTES,
    COSINE,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LEFT_Y,
    NOTE_CIRCLE_RADIUS,
    NOTE_HALF_LENGTH,
    NOTE_SPROCKET_RADIUS,
    OMEGA,
    RIGHT_Y,
    U,
    V,
)
from warpchain.kernels.methods.controller import quick_quotient, quick_root
from warpchain.kernels.physics.elementary import TWO, ZERO, from_order_key_single, order_bits_single, order_key_single
from warpchain.kernels.types import Chain, Control, Drive

wp.set_module_options({"enable_backward": False})

OPENING_MARGIN = wp.constant(wp.float64(1.0 + 1e-6))


@wp.func
def raised(opening: wp.float32):
    """An opening that was compared in single precision, made a bound again."""
    return wp.float64(opening) * OPENING_MARGIN


@functools.cache
def block_surroundings(features: Features, block_dim: int):
    """Warp functions (survey, surveyed, reach of, meet floor or sprocket) of a kernel with these features."""
    has_floor = features.fixed_body == "floor"
    has_sprocket = features.fixed_body == "sprocket"
    has_fixed = has_floor or has_sprocket
    has_self = features.self_contact
    has_contacts = has_fixed or has_self
    _greatest, note, noted = block_maxima(block_dim)

    @wp.func
    def survey(
        K: wp.array2d(dtype=wp.float64),
        memory: wp.uint64,
        place: Place,
        link: Link,
        next_end: vec5d,
    ):
        """Notes what a link knows of its surroundings; computed in double, compared in single precision."""
        left_x, left_y, right_x, right_y = ends_of(link)
        values = vec4i(0, order_key_single(wp.float32(-wp.inf)), 0, 0)
        if place.lane < place.links:
            cx = next_end[0] - right_x
            cy = next_end[1] - right_y
            values[0] = order_bits_single(wp.float32(cx * cx + cy * cy))
            if wp.static(has_floor):
                gap = wp.min(left_y, right_y) - K[BOARD_NOTES, NOTE_CIRCLE_RADIUS]
                values[1] = order_key_single(wp.float32(-gap))
            if wp.static(has_sprocket):
                square = wp.min(left_x * left_x + left_y * left_y, right_x * right_x + right_y * right_y)
                gap = wp.sqrt(square) - K[BOARD_NOTES, NOTE_SPROCKET_RADIUS] - K[BOARD_NOTES, NOTE_CIRCLE_RADIUS]
                values[1] = order_key_single(wp.float32(-gap))
            if wp.static(has_self):
                dx = right_x - K[BOARD_LISTED_X, place.lane]
                dy = right_y - K[BOARD_LISTED_Y, place.lane]
                values[2] = order_bits_single(wp.float32(dx * dx + dy * dy))
            if wp.static(has_contacts):
                turn = K[BOARD_NOTES, NOTE_HALF_LENGTH] * link.omega
                speed = TWO * (link.u * link.u + link.v * link.v + turn * turn)
                values[3] = order_bits_single(wp.float32(speed))
        note(memory, place.lane, values)

    @wp.func
    def surveyed(memory: wp.uint64) -> Surroundings:
        """What all links know, after a barrier."""
        values = noted(memory)
        around = Surroundings()
        around.opening = quick_root(wp.cast(values[0], wp.float32))
        around.gap = -from_order_key_single(values[1])
        around.displacement = quick_root(wp.cast(values[2], wp.float32))
        around.speed = quick_root(wp.cast(values[3], wp.float32))
        return around

    @wp.func
    def reach_of(control: Control, pairs: int, gap: wp.float32, slack: wp.float32, speed: wp.float32):
        """Time [s] in which nothing comes through the skin unseen; 0 near contacts, where steps have a bound anyway."""
        near = pairs > 0
        room = wp.float32(control.skin)
        if wp.static(has_fixed):
            near = near or gap < room
            room = wp.float32(0.5) * gap
        if wp.static(has_self):
            room = wp.min(room, slack)
        return wp.where(near, wp.float32(0.0), quick_quotient(room, speed))

    @wp.func
    def meet_fixed_body(
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        chain: Chain,
        drive: Drive,
        world: int,
        time: wp.float64,
    ):
        """This link, on the board, after floor or sprocket; returns the number of impulses."""
        link = link_on(K, place.lane)
        left_x, left_y, right_x, right_y = ends_of(link)
        u = link.u
        v = link.v
        omega = link.omega
        lost_left = ZERO
        lost_right = ZERO
        hits = wp.int64(0)
        if wp.static(has_floor):
            u, v, omega, lost_left, lost_right, hits = meet_floor(
                chain,
                left_x,
                left_y,
                right_x,
                right_y,
                link.x,
                link.y,
                K[INVERSE_MASS, place.column],
                K[INVERSE_INERTIA, place.column],
                link.u,
                link.v,
                link.omega,
            )
        if wp.static(has_sprocket):
            u, v, omega, lost_left, lost_right, hits = meet_sprocket(
                chain,
                sprocket_turning(drive, world, time),
                drive.push_rate[world],
                left_x,
                left_y,
                right_x,
                right_y,
                link.x,
                link.y,
                K[INVERSE_MASS, place.column],
                K[INVERSE_INERTIA, place.column],
                link.u,
                link.v,
                link.omega,
            )
        K[U, place.lane] = u
        K[V, place.lane] = v
        K[OMEGA, place.lane] = omega
        K[BOARD_LOST_FIXED, place.lane] = K[BOARD_LOST_FIXED, place.lane] + lost_left + lost_right
        return int(hits)

    return survey, surveyed, reach_of, meet_fixed_body


@functools.cache
def block_approach(features: Features, block_dim: int):
    """Warp function: how soon something may touch in flight [1/s], see :mod:`contacts.approach`; 0: never so far."""
    has_floor = features.fixed_body == "floor"
    has_self = features.self_contact
    lists = list_layout(features.columns)
    _greatest, note, noted = block_maxima(block_dim)

    @wp.func
    def approach(
        K: wp.array2d(dtype=wp.float64),
        L: wp.array(dtype=wp.int32),
        memory: wp.uint64,
        place: Place,
        pairs: int,
        slack: wp.float32,
    ):
        """All threads, after a barrier behind the board's rows of ends."""
        lane = place.lane
        n = place.links
        chain = contact_constants(K, n)
        chain.half_length = K[BOARD_NOTES, NOTE_HALF_LENGTH]
        values = vec4i()
        if wp.static(has_floor):
            if lane < n:
                left, right = falling(
                    chain, K[V, lane], K[OMEGA, lane], K[COSINE, lane], K[LEFT_Y, lane], K[RIGHT_Y, lane]
                )
                values[0] = wp.max(order_bits_single(wp.float32(left)), order_bits_single(wp.float32(right)))
        if wp.static(has_self):
            if lane < n:
                turn = chain.half_length * K[OMEGA, lane]
                speed = TWO * (K[U, lane] * K[U, lane] + K[V, lane] * K[V, lane] + turn * turn)
                values[1] = order_bits_single(wp.float32(speed))
            k = lane
            while k < pairs:
                rate = meeting_of(K, chain, L[wp.static(lists.first) + k], L[wp.static(lists.second) + k])
                values[0] = wp.max(values[0], order_bits_single(wp.float32(rate)))
                k += wp.static(block_dim)
        note(memory, lane, values)
        barrier()
        values = noted(memory)
        fastest = wp.cast(values[0], wp.float32)
        if wp.static(has_self):
            room = wp.max(slack, wp.float32(SMALLEST_GAP))
            fastest = wp.max(fastest, wp.sqrt(wp.cast(values[1], wp.float32)) / room)
        return wp.float64(fastest)

    return approach
