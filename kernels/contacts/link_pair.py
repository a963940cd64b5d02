"""Two links that may touch: geometry of their circles, order of the contacts, and the impulse."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.impulse import collision_impulse, inverse_masses
from warpchain.kernels.layout import INVERSE_INERTIA, INVERSE_MASS, LEFT_X, RIGHT_X, STRANDS_APART, U, X
from warpchain.kernels.physics.elementary import HALF, ZERO, quotient, square_root
from warpchain.kernels.physics.geometry import put, three, two
from warpchain.kernels.types import Chain, Rows

Contact = wp.types.vector(length=7, dtype=wp.float64)
"""Depth of the overlap [m]; normal from A to B; levers of A crossed with normal and tangent [m]; likewise of B.

A vector, not a struct: clang kept a struct in memory, and a pile on the CPU was twice as slow.
"""
DEPTH, NORMAL_X, NORMAL_Y, A_N, A_T, B_N, B_T = range(7)


@wp.func
def natural(index: int):
    """The same index, known to the compiler not to be negative: Warp counts negative ones from an array's end."""
    return index & 2147483647


@wp.func
def are_neighbours(link_a: int, link_b: int, link_count: int):
    """True for the same link or links that share a joint."""
    apart = wp.abs(link_a - link_b)
    return apart < 2 or apart > link_count - 2


@wp.func
def are_strands(link_a: int, link_b: int, link_count: int):
    """True for links at least :data:`STRANDS_APART` apart along the chain: strands of the loop, no crease of one."""
    apart = wp.abs(link_a - link_b)
    return apart >= STRANDS_APART and apart <= link_count - STRANDS_APART


@wp.func
def effective_masses(mass: wp.float64, inertia_a: wp.float64, inertia_b: wp.float64, contact: Contact):
    """W_nn, W_nt, W_tt [1/kg] of a contact, from inverse masses and inertias of its links."""
    a_n = contact[A_N]
    a_t = contact[A_T]
    b_n = contact[B_N]
    b_t = contact[B_T]
    return (
        mass + a_n * a_n * inertia_a + b_n * b_n * inertia_b,
        a_n * a_t * inertia_a + b_n * b_t * inertia_b,
        mass + a_t * a_t * inertia_a + b_t * b_t * inertia_b,
    )


@wp.func
def circles_of_links(
    radius_a: wp.float64, radius_b: wp.float64, end_a: wp.vec2d, end_b: wp.vec2d, center_a: wp.vec2d, center_b: wp.vec2d
) -> Contact:
    """Geometry of the contact of a circle of link A and one of link B, without branches.

    Arguments: the radii of the circles of A and B, their centres ``end`` and centres of mass ``center`` of the links
    [m]. Without an overlap the depth is 0, and nothing else has a meaning; so it is for concentric circles.
    """
    dx = end_b[0] - end_a[0]
    dy = end_b[1] - end_a[1]
    touching = radius_a + radius_b
    square = dx * dx + dy * dy
    overlap = square < touching * touching and square > ZERO
    distance = square_root(square)
    depth = wp.where(overlap, touching - distance, ZERO)
    nx = quotient(dx, distance)
    ny = quotient(dy, distance)
    # the middle of the overlap; for circles of one size to the bit the middle of their centres
    beyond = HALF * (radius_a - radius_b)
    px = HALF * (end_a[0] + end_b[0]) + beyond * nx
    py = HALF * (end_a[1] + end_b[1]) + beyond * ny
    ax = px - center_a[0]
    ay = py - center_a[1]
    bx = px - center_b[0]
    by = py - center_b[1]
    return Contact(depth, nx, ny, ax * ny - ay * nx, ax * nx + ay * ny, bx * ny - by * nx, bx * nx + by * ny)


@wp.func
def divisors(K: Rows, link_a: int, link_b: int, contact: Contact):
    """1/W_nn [kg] and 1/det W [kg²] of a contact of two links."""
    mass = K[INVERSE_MASS, link_a] + K[INVERSE_MASS, link_b]
    w_nn, w_nt, w_tt = effective_masses(mass, K[INVERSE_INERTIA, link_a], K[INVERSE_INERTIA, link_b], contact)
    return inverse_masses(w_nn, w_nt, w_tt)


@wp.func
def links_of(p: int, q: int, half: int, second: int, n: int):
    """Links A and B of a contact of joints p < q: the first (0) or second (1) in this half of the sequence."""
    link_b = q + (second ^ half)
    return p + second, wp.where(link_b == n, 0, link_b)


@wp.func
def touching_circles(K: Rows, chain: Chain, p: int, q: int, half: int, second: int):
    """A contact of joints p < q, see :func:`links_of`, and its :func:`divisors`; of links that share a joint depth 0.

    Joint j's left-hand circle belongs to link j's right end, its right-hand circle to the left end of the link after.
    """
    link_a, link_b = links_of(p, q, half, second, chain.link_count)
    end_a = wp.where(second == 0, two(K, RIGHT_X, p), two(K, LEFT_X, p + 1))
    end_b = wp.where(second == half, two(K, RIGHT_X, q), two(K, LEFT_X, q + 1))
    if are_neighbours(link_a, link_b, chain.link_count):
        end_b = end_a
    contact = circles_of_links(
        K[layout.RADIUS, link_a], K[layout.RADIUS, link_b], end_a, end_b, two(K, X, link_a), two(K, X, link_b)
    )
    inverse_nn, inverse_determinant = divisors(K, link_a, link_b, contact)
    return contact, inverse_nn, inverse_determinant


@wp.func
def collide(
    K: Rows, chain: Chain, link_a: int, link_b: int, contact: Contact, inverse_nn: wp.float64, inverse_det: wp.float64
):
    """Impulse between two overlapping links, see :func:`divisors`; returns energy lost [J] and number of impulses.

    They meet if they approach, or part more slowly than at ``chain.push_rate`` times the depth of the overlap [m]; the
    impulse is that of links which approach by so much faster.
    """
    push = chain.push_rate * contact[DEPTH]
    nx = contact[NORMAL_X]
    ny = contact[NORMAL_Y]
    a_n = contact[A_N]
    a_t = contact[A_T]
    b_n = contact[B_N]
    b_t = contact[B_T]
    # all is read before anything is written: the compiler does not know that A is not B, and would read again
    motion_a = three(K, U, link_a)
    motion_b = three(K, U, link_b)
    u = motion_a[0] - motion_b[0]
    v = motion_a[1] - motion_b[1]
    normal_speed = u * nx + v * ny
    normal_speed += motion_a[2] * a_n - motion_b[2] * b_n + push
    lost = ZERO
    hits = wp.int64(0)
    if normal_speed > ZERO:
        tangential_speed = v * nx - u * ny
        tangential_speed += motion_a[2] * a_t - motion_b[2] * b_t
        mass_a = K[INVERSE_MASS, link_a]
        mass_b = K[INVERSE_MASS, link_b]
        inertia_a = K[INVERSE_INERTIA, link_a]
        inertia_b = K[INVERSE_INERTIA, link_b]
        w_nn, w_nt, w_tt = effective_masses(mass_a + mass_b, inertia_a, inertia_b, contact)
        e = chain.chain_restitution
        mu = chain.chain_friction
        jn, jt = collision_impulse(
            chain, normal_speed, tangential_speed, w_nn, w_nt, w_tt, inverse_nn, inverse_det, e, mu
        )
        jx = jn * nx - jt * ny
        jy = jn * ny + jt * nx
        put(K, U, link_a, motion_a - wp.vec3d(jx * mass_a, jy * mass_a, (a_n * jn + a_t * jt) * inertia_a))
        put(K, U, link_b, motion_b + wp.vec3d(jx * mass_b, jy * mass_b, (b_n * jn + b_t * jt) * inertia_b))
        changed_n = w_nn * jn + w_nt * jt
        changed_t = w_nt * jn + w_tt * jt
        lost = jn * (normal_speed - push - HALF * changed_n) + jt * (tangential_speed - HALF * changed_t)
        hits = wp.int64(1)
    return lost, hits
