"""Fixed bodies on a CPU: their distance from a chain, and their contacts after an accepted step.

Every circle that overlaps and approaches gets one impulse; overlapping circles that separate get none, and positions
are never corrected. Such a contact changes one link only, so the order of links does not matter; each link's left
circle comes before its right one. Contacts between links have a fixed order, see :mod:`cpu.contacts.self_contacts`.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.fixed_body import BODIES, link_and_body
from warpchain.kernels.contacts.impulse import Touching
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.contacts.tilting_floor import greatest_across_speed
from warpchain.kernels.layout import GAP, LEFT_X, LEFT_Y, LOST_FIXED, OMEGA, RADIUS, RIGHT_X, RIGHT_Y, SINE, U, V, X, Y
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, from_order_key, order_bits, order_key
from warpchain.kernels.physics.geometry import LANES, put, two, whole_lanes
from warpchain.kernels.types import Chain, Ground, Row, Rows, with_circles

FURTHEST = wp.constant(wp.int64(2**63 - 1))


@wp.func
def greatest_distance(K: Rows, chain: Chain, a: int, shift: int, b: int):
    """Greatest distance [m] of two points of a link: rows a and a + 1 at i + shift, rows b and b + 1 at i."""
    greatest = wp.int64(0)
    i = int(0)
    while i < whole_lanes(chain.link_count):
        between = two(K, a, i + shift) - two(K, b, i)
        square = between[0] * between[0] + between[1] * between[1]
        greatest = wp.max(greatest, wp.where(i < chain.link_count, order_bits(square), wp.int64(0)))
        i += 1
    return wp.sqrt(wp.cast(greatest, wp.float64))


@wp.func
def greatest_opening(K: Rows, chain: Chain):
    """Greatest joint opening |C| [m] of the placed links."""
    return greatest_distance(K, chain, LEFT_X, 1, RIGHT_X)


@wp.func
def greatest_speed(K: Rows, chain: Chain):
    """A bound on the speed [m/s] of every point of a roller, across the plane, too, if that tilts.

    Within it √2 √(v² + (a ω)²) ≥ |v| + a |ω| bounds that of every circle's centre.
    """
    greatest = wp.int64(0)
    i = int(0)
    while i < whole_lanes(chain.link_count):
        turn = chain.half_length * K[OMEGA, i]
        across = greatest_across_speed(chain, K[X, i], K[Y, i])
        square = TWO * (K[U, i] * K[U, i] + K[V, i] * K[V, i] + turn * turn) + across * across
        greatest = wp.max(greatest, wp.where(i < chain.link_count, order_bits(square), wp.int64(0)))
        i += 1
    return wp.sqrt(wp.cast(greatest, wp.float64))


@wp.func_native("""
    const ::wp::float64* values = &K.data[row * (K.strides[0] / sizeof(::wp::float64)) + first];
    bool any = false;
    for (int lane = 0; lane < 8; ++lane) any |= values[lane] < 0.0;
    return any;
""")
def any_negative(K: Rows, row: int, first: int) -> bool:
    """Whether a number of a row is negative in the vector that begins at this column; in pure Warp it takes longer."""


@wp.func
def placed_link(K: Rows, i: int) -> Touching:
    """A placed link, as a fixed body meets it."""
    link = Touching()
    link.left_x = K[LEFT_X, i]
    link.left_y = K[LEFT_Y, i]
    link.right_x = K[RIGHT_X, i]
    link.right_y = K[RIGHT_Y, i]
    link.x = K[X, i]
    link.y = K[Y, i]
    link.cosine = K[layout.COSINE, i]
    link.sine = K[SINE, i]
    link.mass = K[layout.MASS, i]
    link.inertia = K[layout.INERTIA, i]
    link.inverse_mass = K[layout.INVERSE_MASS, i]
    link.inverse_inertia = K[layout.INVERSE_INERTIA, i]
    link.u = K[U, i]
    link.v = K[V, i]
    link.omega = K[OMEGA, i]
    link.lost = K[LOST_FIXED, i]
    return link


@wp.func
def endless_gap(_K: Rows, _chain: Chain, _ground: Ground, _face: Face):
    """The gap [m] to no body."""
    return wp.float64(wp.inf)


@wp.func
def no_impulses(_K: Rows, _P: Row, _chain: Chain, _ground: Ground, _face: Face):
    """The number of impulses of no body."""
    return wp.int64(0)


@functools.cache
def fixed_contacts(fixed_body: str):
    """Warp functions of all links and a body: (least gap, resolve).

    ``least_gap(K, chain, ground, face)``: the least gap [m] of the placed links, each of which goes to its row.
    ``resolve(K, P, chain, ground, face)``: applies the impulses, after the gaps, and returns their number. Few links
    touch at a time: only vectors with a link that overlaps the body go through the impulse law.
    """
    if fixed_body == "none":
        return endless_gap, no_impulses
    gap_of, meet = link_and_body(fixed_body)
    in_cells = BODIES[fixed_body].in_cells

    @wp.func
    def least_gap(K: Rows, chain: Chain, ground: Ground, face: Face):
        least = FURTHEST
        i = int(0)
        while i < whole_lanes(chain.link_count):
            gap = gap_of(with_circles(chain, K[RADIUS, i]), ground, face, placed_link(K, i))
            K[GAP, i] = wp.where(i < chain.link_count, gap, ONE)
            least = wp.min(least, wp.where(i < chain.link_count, order_key(gap), FURTHEST))
            i += 1
        return from_order_key(least)

    @wp.func
    def resolve(K: Rows, _P: Row, chain: Chain, ground: Ground, face: Face):
        impulses = wp.int64(0)
        first = int(0)
        while first < whole_lanes(chain.link_count):
            if any_negative(K, GAP, first):
                lane = int(0)
                while lane < LANES:
                    i = first + lane
                    lane += 1
                    if wp.static(in_cells):
                        if K[GAP, i] >= ZERO:
                            continue
                    link = meet(with_circles(chain, K[RADIUS, i]), ground, face, placed_link(K, i))
                    put(K, U, i, wp.vec3d(link.u, link.v, link.omega))
                    K[LOST_FIXED, i] = link.lost
                    impulses += wp.where(i < chain.link_count, link.hits, wp.int64(0))
            first += LANES
        return impulses

    return least_gap, resolve
