"""Proximity of a chain on a GPU, the longest step that follows from it, and contacts with fixed bodies."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.fixed_body import BODIES, link_and_body
from warpchain.kernels.contacts.impulse import Touching
from warpchain.kernels.contacts.pair_list import MOST_WAY
from warpchain.kernels.contacts.tilting_floor import greatest_across_speed, middle_height, steepness
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.board import ends_of
from warpchain.kernels.gpu.stage import Proximity, Run, constants, felt_plane, read_link, vec5d
from warpchain.kernels.gpu.threads import block_maxima, vec4i
from warpchain.kernels.layout import COSINE, INVERSE_INERTIA, INVERSE_MASS, RADIUS, SINE, U
from warpchain.kernels.methods.controller import quick_root
from warpchain.kernels.physics.elementary import (
    TWO,
    from_order_key_single,
    order_bits_single,
    order_key_single,
    quick_quotient,
)
from warpchain.kernels.physics.geometry import Link, put
from warpchain.kernels.types import Chain, Control, Drive, with_circles

OPENING_MARGIN = wp.constant(wp.float64(1.0 + 1e-6))


@wp.func
def upper_bound(opening: wp.float32):
    """An upper bound on an opening, from its value in single precision."""
    return wp.float64(opening) * OPENING_MARGIN


@wp.func
def placed_link(chain: Chain, own: Link) -> Touching:
    """A link as a fixed body meets it, but for what impulses need beside its motion."""
    link = Touching()
    left_x, left_y, right_x, right_y = ends_of(own)
    link.left_x = left_x
    link.left_y = left_y
    link.right_x = right_x
    link.right_y = right_y
    link.x = own.x
    link.y = own.y
    link.cosine = own.arm_x / chain.half_length
    link.sine = own.arm_y / chain.half_length
    link.u = own.u
    link.v = own.v
    link.omega = own.omega
    return link


@wp.func
def touching_link(run: Run, chain: Chain) -> Touching:
    """A thread's link, from the board, as a fixed body meets it."""
    K = run.K
    link = placed_link(chain, read_link(K, run.lane))
    link.cosine = K[COSINE, run.lane]
    link.sine = K[SINE, run.lane]
    link.mass = K[layout.MASS, run.column]
    link.inertia = K[layout.INERTIA, run.column]
    link.inverse_mass = K[INVERSE_MASS, run.column]
    link.inverse_inertia = K[INVERSE_INERTIA, run.column]
    link.lost = K[layout.BOARD_LOST_FIXED, run.lane]
    return link


@functools.cache
def block_proximity(features: Features, block_dim: int):
    """Warp functions (write_proximity, read_proximity, time_to_contact) for these features."""
    has_floor = features.fixed_body == "floor"
    has_fixed = features.fixed_body != "none"
    has_self = features.self_contact
    has_contacts = has_fixed or has_self
    if has_fixed:
        gap_of, _meet = link_and_body(features.fixed_body)
        face_of = BODIES[features.fixed_body].face
    tilts = features.tilts
    _maximum, write_maxima, read_maxima = block_maxima(block_dim)

    @wp.func
    def write_proximity(run: Run, link: Link, next_end: vec5d):
        """Writes a link's share of the maxima; computed in double, compared in single precision."""
        K = run.K
        left_x, left_y, right_x, right_y = ends_of(link)
        values = vec4i(0, order_key_single(wp.float32(-wp.inf)), 0, 0)
        if run.lane < run.links:
            cx = next_end[0] - right_x
            cy = next_end[1] - right_y
            values[0] = order_bits_single(wp.float32(cx * cx + cy * cy))
            if wp.static(tilts):
                felt = with_circles(felt_plane(run), K[RADIUS, run.lane])
            if wp.static(has_floor and tilts):
                slope = steepness(felt)
                left = middle_height(felt, slope, left_x, left_y)
                right = middle_height(felt, slope, right_x, right_y)
                gap = wp.min(left, right) - felt.half_width * wp.abs(felt.up_z)
                values[1] = order_key_single(wp.float32(-gap))
            elif wp.static(has_fixed):
                own = with_circles(constants(K), K[RADIUS, run.lane])
                gap = gap_of(own, run.ground, face_of(run.ground), placed_link(own, link))
                values[1] = order_key_single(wp.float32(-gap))
            if wp.static(has_self):
                dx = right_x - K[layout.BOARD_LISTED_X, run.lane]
                dy = right_y - K[layout.BOARD_LISTED_Y, run.lane]
                values[2] = order_bits_single(wp.float32(dx * dx + dy * dy))
            if wp.static(has_contacts):
                turn = constants(K).half_length * link.omega
                speed = TWO * (link.u * link.u + link.v * link.v + turn * turn)
                if wp.static(tilts):
                    across = greatest_across_speed(felt, link.x, link.y)
                    speed += across * across
                values[3] = order_bits_single(wp.float32(speed))
        write_maxima(run.maxima, run.lane, values)

    @wp.func
    def read_proximity(run: Run) -> Proximity:
        """Maxima over all links, after a barrier."""
        values = read_maxima(run.maxima)
        opening = quick_root(wp.cast(values[0], wp.float32))
        displacement = quick_root(wp.cast(values[2], wp.float32))
        speed = quick_root(wp.cast(values[3], wp.float32))
        return Proximity(opening, -from_order_key_single(values[1]), displacement, speed)

    @wp.func
    def time_to_contact(control: Control, pairs: int, gap: wp.float32, slack: wp.float32, speed: wp.float32):
        """Longest step [s] that cannot miss a contact; 0 near contacts, where the contact step is the bound."""
        is_near = pairs > 0 or wp.static(features.moving_sprocket)  # which may come nearer by itself
        distance = wp.float32(control.skin)
        if wp.static(has_fixed):
            is_near = is_near or gap < distance
            distance = wp.float32(0.5) * gap
        if wp.static(has_self):
            distance = wp.min(distance, wp.min(slack, wp.float32(MOST_WAY * control.skin)))
        return wp.where(is_near, wp.float32(0.0), quick_quotient(distance, speed))

    return write_proximity, read_proximity, time_to_contact


@functools.cache
def block_contact(fixed_body: str):
    """Warp function: applies the impulses between a body and this link on the board; returns their number."""
    _gap_of, meet = link_and_body(fixed_body)
    face_of, face_at = BODIES[fixed_body].face, BODIES[fixed_body].motion

    @wp.func
    def meet_body(run: Run, drive: Drive, time: wp.float64):
        K = run.K
        chain = with_circles(constants(K), K[RADIUS, run.lane])
        face = face_at(face_of(run.ground), drive, run.world, time)
        link = meet(chain, run.ground, face, touching_link(run, chain))
        put(K, U, run.lane, wp.vec3d(link.u, link.v, link.omega))
        K[layout.BOARD_LOST_FIXED, run.lane] = link.lost
        return int(link.hits)

    return meet_body
