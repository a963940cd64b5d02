"""Proximity of a chain on a GPU, the longest step that follows from it, and contacts with fixed bodies."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.fixed_body import BODIES, link_and_body
from warpchain.kernels.contacts.impulse import Touching
from warpchain.kernels.contacts.pair_list import MOST_WAY
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.contacts.tilting_floor import greatest_across_speed, middle_height, steepness
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.board import ends_of
from warpchain.kernels.gpu.stage import Proximity, Run, constants, felt_plane, read_link
from warpchain.kernels.gpu.threads import block_maxima, vec4i
from warpchain.kernels.layout import COSINE, INVERSE_INERTIA, INVERSE_MASS, RADIUS, SINE, U
from warpchain.kernels.methods.controller import quick_root
from warpchain.kernels.physics.elementary import (
    from_order_key_single,
    order_bits_single,
    order_key_single,
    quick_quotient,
)
from warpchain.kernels.physics.geometry import Link, put
from warpchain.kernels.types import Worlds, with_circles

OPENING_MARGIN = wp.constant(wp.float64(1.0 + 1e-6))
vec3d = wp.types.vector(length=3, dtype=wp.float64)


@wp.func
def upper_bound(opening: wp.float32):
    """An upper bound on an opening, from its value in single precision."""
    return wp.float64(opening) * OPENING_MARGIN


@wp.func
def placed_link(own: Link, cosine: wp.float64, sine: wp.float64) -> Touching:
    """A link as a fixed body meets it, but for what impulses need beside its motion."""
    link = Touching()
    left_x, left_y, right_x, right_y = ends_of(own)
    link.left_x = left_x
    link.left_y = left_y
    link.right_x = right_x
    link.right_y = right_y
    link.x = own.x
    link.y = own.y
    link.cosine = cosine
    link.sine = sine
    link.u = own.u
    link.v = own.v
    link.omega = own.omega
    return link


@wp.func
def touching_link(run: Run) -> Touching:
    """A thread's link, from the board, as a fixed body meets it."""
    K = run.K
    link = placed_link(read_link(K, run.lane), K[COSINE, run.lane], K[SINE, run.lane])
    link.mass = K[layout.MASS, run.column]
    link.inertia = K[layout.INERTIA, run.column]
    link.inverse_mass = K[INVERSE_MASS, run.column]
    link.inverse_inertia = K[INVERSE_INERTIA, run.column]
    link.lost = K[layout.BOARD_LOST_FIXED, run.lane]
    return link


@functools.cache
def block_proximity(features: Features, block_dim: int):
    """Warp functions (write_proximity, read_proximity, time_to_contact) for these features."""
    has_fixed = features.fixed_body != "none"
    has_self = features.self_contact
    if has_fixed:
        gap_of, _meet = link_and_body(features.fixed_body)
        face_of = BODIES[features.fixed_body].face
    sprocket_gap_of, _meet = link_and_body("sprocket")
    tilts = features.tilts
    _maximum, write_maxima, read_maxima = block_maxima(block_dim)

    @wp.func
    def write_proximity(
        run: Run, place: vec3d, cosine: wp.float64, sine: wp.float64, opening: wp.float32, speed: wp.float32
    ):
        """Writes a link's share of the maxima, compared in single precision; returns its gap [m] to floor or sprocket.

        ``opening`` and ``speed``: squares of the opening of its right joint and of a bound on its speed.
        """
        K = run.K
        own_gap = wp.float32(wp.inf)
        values = vec4i(order_bits_single(opening), order_key_single(wp.float32(-wp.inf)), 0, order_bits_single(speed))
        half_length = constants(K).half_length
        link = Link()
        link.x = place[0]
        link.y = place[1]
        link.arm_x = half_length * cosine
        link.arm_y = half_length * sine
        left_x, left_y, right_x, right_y = ends_of(link)
        if wp.static(has_fixed):
            if wp.static(tilts):
                felt = with_circles(felt_plane(run), K[RADIUS, run.column])
                slope = steepness(felt)
                left = middle_height(felt, slope, left_x, left_y)
                right = middle_height(felt, slope, right_x, right_y)
                own_gap = wp.float32(wp.min(left, right) - felt.half_width * wp.abs(felt.up_z))
            else:
                own = with_circles(constants(K), K[RADIUS, run.column])
                placed = placed_link(link, cosine, sine)
                if wp.static(features.has_drive) and run.is_driven:
                    own_gap = wp.float32(sprocket_gap_of(own, run.ground, Face(), placed))
                else:
                    own_gap = wp.float32(gap_of(own, run.ground, face_of(run.ground), placed))
            values[1] = order_key_single(-own_gap)
        if wp.static(has_self):
            dx = wp.float32(right_x - K[layout.BOARD_LISTED_X, run.column])
            dy = wp.float32(right_y - K[layout.BOARD_LISTED_Y, run.column])
            values[2] = order_bits_single(dx * dx + dy * dy)
        if wp.static(tilts):
            across = wp.float32(greatest_across_speed(felt_plane(run), link.x, link.y))
            values[3] = order_bits_single(speed + across * across)
        if run.lane >= run.links:
            values = vec4i(0, order_key_single(wp.float32(-wp.inf)), 0, 0)
        write_maxima(run.maxima, run.lane, values)
        return own_gap

    @wp.func
    def read_proximity(run: Run) -> Proximity:
        """Maxima over all links, after a barrier."""
        values = read_maxima(run.maxima)
        opening = quick_root(wp.cast(values[0], wp.float32))
        displacement = quick_root(wp.cast(values[2], wp.float32))
        speed = quick_root(wp.cast(values[3], wp.float32))
        return Proximity(opening, -from_order_key_single(values[1]), displacement, speed)

    @wp.func
    def time_to_contact(run: Run, pairs: int, gap: wp.float32, slack: wp.float32, speed: wp.float32):
        """Longest step [s] that cannot miss a contact; 0 near contacts, where the contact step is the bound."""
        is_near = pairs > 0 or wp.static(features.moving_sprocket)  # which may come nearer by itself
        distance = run.skin
        if wp.static(has_fixed):
            is_near = is_near or gap < distance
            distance = wp.float32(0.5) * gap
        if wp.static(has_self):
            distance = wp.min(distance, wp.min(slack, wp.static(wp.float32(float(MOST_WAY))) * run.skin))
        return wp.where(is_near, wp.float32(0.0), quick_quotient(distance, speed))

    return write_proximity, read_proximity, time_to_contact


@functools.cache
def block_contact(fixed_body: str):
    """Warp function: applies the impulses between a body and this link on the board; returns their number."""
    _gap_of, meet = link_and_body(fixed_body)
    face_of, face_at = BODIES[fixed_body].face, BODIES[fixed_body].motion

    @wp.func
    def meet_body(run: Run, worlds: Worlds, time: wp.float64):
        K = run.K
        chain = with_circles(constants(K), K[RADIUS, run.lane])
        face = face_at(face_of(run.ground), worlds.drive, run.world, time)
        link = meet(chain, run.ground, face, touching_link(run))
        put(K, U, run.lane, wp.vec3d(link.u, link.v, link.omega))
        K[layout.BOARD_LOST_FIXED, run.lane] = link.lost
        return int(link.hits)

    return meet_body
