"""A chain whose plane may tilt, as hooks of the CPU loop: sums over links, and the floor."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts import tilting_floor
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.cpu.contacts.proximity import FURTHEST, any_negative, placed_link
from warpchain.kernels.cpu.joints import Joints
from warpchain.kernels.cpu.upright import PlaneHooks
from warpchain.kernels.layout import GAP, LOST_FIXED, SUMS, U
from warpchain.kernels.physics import plane
from warpchain.kernels.physics.elementary import ONE, ZERO, from_order_key, order_key
from warpchain.kernels.physics.geometry import LANES, whole_lanes
from warpchain.kernels.types import Chain, Ground, Row, Rows, Worlds, with_circles

SUMMED_IN_CONTACT = 3
"""Impulse on the plane and its two moments."""
SUMMED = layout.SUMS_OF_PLACES + layout.SUMS_OF_MOTION
TOUCHES = SUMS + SUMMED_IN_CONTACT
"""Row of −1 for links that touch the floor, 0 for others."""


@wp.func_native("""
    const ::wp::float64* values = &K.data[row * (K.strides[0] / sizeof(::wp::float64))];
    ::wp::float64 sums[8] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    for (int i = 0; i < count; i += 8)
        for (int lane = 0; lane < 8; ++lane) sums[lane] += values[i + lane];
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
""")
def row_sum(K: Rows, row: int, count: int) -> wp.float64:
    """Sum of the first ``count`` columns of a row, a multiple of 8; in pure Warp clang adds one after the other."""


def sums_source() -> str:
    """Source of :func:`write_sums`: eight links at a time, each row is read once, and sums stay in registers."""
    rows = "m j x y u v w c s".split(), "MASS INERTIA X Y U V OMEGA COSINE SINE".split()
    lines = [
        "typedef ::wp::float64 Lanes __attribute__((ext_vector_type(8), aligned(8)));",
        f"Lanes sums[{SUMMED}] = {{}};",
        "for (int i = 0; i < count; i += 8) {",
        "const ::wp::float64* column = &K.data[i];",
        "const size_t row = K.strides[0] / sizeof(::wp::float64);",
    ]
    for symbol, name in zip(*rows, strict=True):
        lines.append(f"const Lanes {symbol} = *reinterpret_cast<const Lanes*>(column + {getattr(layout, name)} * row);")
    terms = "mx", "my", "mx * x + j * c * c", "mx * y + j * c * s", "my * y + j * s * s", "mu", "mv"
    lines.append("const Lanes mx = m * x, my = m * y, mu = m * u, mv = m * v;")
    lines += [f"sums[{k}] += {term};" for k, term in enumerate((*terms, "x * mv - y * mu + j * w"))]
    lines.append("}")
    # add neighbours, then pairs, then halves: the lanes of one vector become the sums
    orders = (0, 8, 2, 10, 4, 12, 6, 14), (0, 1, 8, 9, 4, 5, 12, 13), (0, 1, 2, 3, 8, 9, 10, 11)
    for order, apart, left in zip(orders, (1, 2, 4), (4, 2, 1), strict=True):
        first, second = (", ".join(str(lane + shift) for lane in order) for shift in (0, apart))
        pair = "sums[2 * k], sums[2 * k + 1]"
        lines.append(
            f"for (int k = 0; k < {left}; ++k) sums[k] = __builtin_shufflevector({pair}, {first})"
            f" + __builtin_shufflevector({pair}, {second});"
        )
    lines.append(f"*reinterpret_cast<Lanes*>(&P.data[{layout.PLANE_SUMS}]) = sums[0];")
    return "\n".join(lines)


@wp.func_native(sums_source())
def write_sums(K: Rows, P: Row, count: int):
    """Writes the sums over the first ``count`` columns of a placed chain, a multiple of 8, but for the links' width.

    Terms are those of :func:`plane.place_terms` and :func:`plane.motion_terms`; columns behind the links have no mass.
    In pure Warp each term is stored before it is added, because clang keeps the order of sums: twice as long.
    """


@wp.func
def write_plane_sums(K: Rows, P: Row, chain: Chain):
    """Writes all sums over the placed links, and the inverse of the plane's mass matrix."""
    write_sums(K, P, whole_lanes(chain.link_count))
    side = chain.mass * chain.half_width * chain.half_width * plane.THIRD
    P[layout.SUM_XX] = P[layout.SUM_XX] + side
    P[layout.SUM_YY] = P[layout.SUM_YY] + side
    P[layout.SUM_MASS] = chain.mass
    plane.invert_mass(P)


@wp.func
def tilting_gap(K: Rows, chain: Chain, _ground: Ground, _face: Face):
    """Height [m] of the lowest rim of a roller above the floor, and of each link in its row; negative when below."""
    slope = tilting_floor.steepness(chain)
    tipped = wp.abs(chain.half_width * chain.up_z)
    lowest = FURTHEST
    i = int(0)
    while i < whole_lanes(chain.link_count):
        own = with_circles(chain, K[layout.RADIUS, i])
        rise = chain.half_length * wp.abs(K[layout.COSINE, i] * chain.up_x + K[layout.SINE, i] * chain.up_y)
        middle = tilting_floor.middle_height(own, slope, K[layout.X, i], K[layout.Y, i]) - rise
        K[GAP, i] = wp.where(i < chain.link_count, middle - tipped, ONE)
        lowest = wp.min(lowest, wp.where(i < chain.link_count, order_key(middle), FURTHEST))
        i += 1
    return from_order_key(lowest) - tipped


@wp.func
def write_touches(K: Rows, chain: Chain, slope: wp.float64):
    """Writes −1 for each link that touches the floor and 0 for others; returns their number.

    Only in lanes of links of which one is below the floor, see their gaps.
    """
    touching = wp.int64(0)
    first = int(0)
    while first < whole_lanes(chain.link_count):
        if any_negative(K, GAP, first):
            lane = int(0)
            while lane < wp.static(LANES):
                i = first + lane
                own = with_circles(chain, K[layout.RADIUS, i])
                touches = tilting_floor.link_touches(own, slope, placed_link(K, i))
                touches = wp.where(i < chain.link_count, touches, wp.int64(0))
                K[wp.static(TOUCHES), i] = -wp.float64(touches)
                touching += touches
                lane += 1
        first += wp.static(LANES)
    return touching


@wp.func
def resolve_tilting_floor(K: Rows, P: Row, chain: Chain, ground: Ground, face: Face):
    """Applies the impulses between rollers and floor to links, plane and sums; returns their number.

    The sums must be those of the present places. Lanes of links of which none touches are passed over.
    """
    present = plane.on_plane(chain, P, 0)
    slope = tilting_floor.steepness(present)
    tilting_gap(K, present, ground, face)
    touching = write_touches(K, present, slope)
    if touching == wp.int64(0):
        return touching
    B = tilting_floor.copy_inverse(P, wp.float64(touching))
    impulses = wp.int64(0)
    count = whole_lanes(chain.link_count)
    first = int(0)
    while first < count:
        for k in range(wp.static(SUMMED_IN_CONTACT)):
            for lane in range(wp.static(LANES)):
                K[wp.static(SUMS + k), first + lane] = ZERO
        if any_negative(K, GAP, first) and any_negative(K, wp.static(TOUCHES), first):
            lane = int(0)
            while lane < wp.static(LANES):
                i = first + lane
                own = with_circles(present, K[layout.RADIUS, i])
                link = tilting_floor.meet_floor(own, slope, B, placed_link(K, i))
                touches = K[wp.static(TOUCHES), i] < ZERO
                for k in range(wp.static(SUMMED_IN_CONTACT)):
                    K[U + k, i] = wp.where(touches, link.motion[k], K[U + k, i])
                    K[wp.static(SUMS + k), i] = wp.where(touches, link.push[k], ZERO)
                K[LOST_FIXED, i] = K[LOST_FIXED, i] + wp.where(touches, link.lost, ZERO)
                impulses += wp.where(touches, link.hits, wp.int64(0))
                lane += 1
        first += wp.static(LANES)
    push = wp.vec3d()
    for k in range(wp.static(SUMMED_IN_CONTACT)):
        push[k] = row_sum(K, wp.static(SUMS + k), count)
    K[LOST_FIXED, 0] = K[LOST_FIXED, 0] + tilting_floor.push_plane_by(P, push)
    write_plane_sums(K, P, chain)
    return impulses


@functools.cache
def tilting_plane(joints: Joints) -> PlaneHooks:
    """A plane that may tilt, above a flat floor."""

    @wp.func
    def at_start(P: Row, chain: Chain) -> Chain:
        return plane.on_plane(chain, P, 0)

    @wp.func
    def begin_step(K: Rows, P: Row, chain: Chain, worlds: Worlds, world: int, h: wp.float64) -> Chain:
        plane.begin_step(P, chain.gravity, h)
        felt = plane.on_plane(chain, P, wp.static(layout.PLANE_MID))
        joints.first_stage(K, felt, worlds, world)
        return felt

    @wp.func
    def end_step(K: Rows, P: Row, chain: Chain, h: wp.float64):
        write_plane_sums(K, P, chain)
        plane.end_step(P, chain.gravity, h)

    return PlaneHooks(write_plane_sums, at_start, begin_step, end_step, tilting_gap, resolve_tilting_floor)
