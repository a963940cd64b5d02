"""Two links that may touch: geometry of their circles, order of the contacts, and the impulse."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.impulse import collision_impulse, inverse_masses
from warpchain.kernels.layout import INVERSE_INERTIA, INVERSE_MASS, LEFT_X, LEFT_Y, OMEGA, STRANDS_APART, U, V, X, Y
from warpchain.kernels.physics.elementary import HALF, ZERO, quotient
from warpchain.kernels.types import Chain, Rows


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
def effective_masses(
    mass: wp.float64,
    inertia_a: wp.float64,
    inertia_b: wp.float64,
    a_n: wp.float64,
    a_t: wp.float64,
    b_n: wp.float64,
    b_t: wp.float64,
):
    """W_nn, W_nt, W_tt [1/kg] of a contact; arguments as those and the results of :func:`circles_of_links`."""
    return (
        mass + a_n * a_n * inertia_a + b_n * b_n * inertia_b,
        a_n * a_t * inertia_a + b_n * b_t * inertia_b,
        mass + a_t * a_t * inertia_a + b_t * b_t * inertia_b,
    )


@wp.func
def circles_of_links(
    radius_a: wp.float64,
    radius_b: wp.float64,
    end_a_x: wp.float64,
    end_a_y: wp.float64,
    end_b_x: wp.float64,
    end_b_y: wp.float64,
    center_a_x: wp.float64,
    center_a_y: wp.float64,
    center_b_x: wp.float64,
    center_b_y: wp.float64,
):
    """Geometry of the contact of a circle of link A and one of link B, without branches.

    It returns numbers, not a struct: clang kept a struct in memory, and a pile on the CPU was twice as slow.

    Arguments: the radii of the circles of A and B, their centres ``end`` and centres of mass ``center`` of
    the links [m].

    Returns:
        Depth of the overlap [m], 0 if there is none (concentric circles have no normal and count as none); normal from
        A to B; levers of A crossed with normal and tangent [m], likewise of B. Without an overlap only the depth has a
        meaning.
    """
    dx = end_b_x - end_a_x
    dy = end_b_y - end_a_y
    touching = radius_a + radius_b
    square = dx * dx + dy * dy
    overlap = square < touching * touching and square > ZERO
    distance = wp.sqrt(square)
    depth = wp.where(overlap, touching - distance, ZERO)
    nx = quotient(dx, distance)
    ny = quotient(dy, distance)
    # the middle of the overlap; for circles of one size to the bit the middle of their centres
    beyond = HALF * (radius_a - radius_b)
    px = HALF * (end_a_x + end_b_x) + beyond * nx
    py = HALF * (end_a_y + end_b_y) + beyond * ny
    ax = px - center_a_x
    ay = py - center_a_y
    bx = px - center_b_x
    by = py - center_b_y
    a_n = ax * ny - ay * nx
    a_t = ax * nx + ay * ny
    b_n = bx * ny - by * nx
    b_t = bx * nx + by * ny
    return depth, nx, ny, a_n, a_t, b_n, b_t


@wp.func
def divisors(K: Rows, link_a: int, link_b: int, a_n: wp.float64, a_t: wp.float64, b_n: wp.float64, b_t: wp.float64):
    """1/W_nn [kg] and 1/det W [kg²] of a contact of two links; the levers are those of :func:`circles_of_links`."""
    w_nn, w_nt, w_tt = effective_masses(
        K[INVERSE_MASS, link_a] + K[INVERSE_MASS, link_b],
        K[INVERSE_INERTIA, link_a],
        K[INVERSE_INERTIA, link_b],
        a_n,
        a_t,
        b_n,
        b_t,
    )
    inverse_nn, inverse_determinant = inverse_masses(w_nn, w_nt, w_tt)
    return inverse_nn, inverse_determinant


@wp.func
def links_of(p: int, q: int, half: int, second: int, n: int):
    """Links A and B of a contact of joints p < q: the first (0) or second (1) in this half of the sequence."""
    link_b = q + (second ^ half)
    return p + second, wp.where(link_b == n, 0, link_b)


@wp.func
def touching_circles(K: Rows, chain: Chain, p: int, q: int, half: int, second: int):
    """Geometry of a contact and its divisors, see :func:`links_of`, :func:`circles_of_links` and :func:`divisors`.

    The depth is 0 for links that share a joint.

    Joint j's left-hand circle belongs to link j's right end, its right-hand circle to the left end of the link after.
    """
    after_q = second ^ half
    link_a, link_b = links_of(p, q, half, second, chain.link_count)
    ax = wp.where(second == 0, K[layout.RIGHT_X, p], K[LEFT_X, p + 1])
    ay = wp.where(second == 0, K[layout.RIGHT_Y, p], K[LEFT_Y, p + 1])
    bx = wp.where(after_q == 0, K[layout.RIGHT_X, q], K[LEFT_X, q + 1])
    by = wp.where(after_q == 0, K[layout.RIGHT_Y, q], K[LEFT_Y, q + 1])
    if are_neighbours(link_a, link_b, chain.link_count):
        bx = ax
        by = ay
    depth, nx, ny, a_n, a_t, b_n, b_t = circles_of_links(
        K[layout.RADIUS, link_a],
        K[layout.RADIUS, link_b],
        ax,
        ay,
        bx,
        by,
        K[X, link_a],
        K[Y, link_a],
        K[X, link_b],
        K[Y, link_b],
    )
    inverse_nn, inverse_determinant = divisors(K, link_a, link_b, a_n, a_t, b_n, b_t)
    return depth, nx, ny, a_n, a_t, b_n, b_t, inverse_nn, inverse_determinant


@wp.func
def collide(
    K: Rows,
    chain: Chain,
    link_a: int,
    link_b: int,
    nx: wp.float64,
    ny: wp.float64,
    a_n: wp.float64,
    a_t: wp.float64,
    b_n: wp.float64,
    b_t: wp.float64,
    inverse_nn: wp.float64,
    inverse_determinant: wp.float64,
    depth: wp.float64,
):
    """Impulse between two overlapping links; returns energy lost [J] and number of impulses.

    They meet if they approach, or part more slowly than at ``chain.push_rate`` times the depth of the overlap [m]; the
    impulse is that of links which approach by so much faster.
    """
    push = chain.push_rate * depth
    # all is read before anything is written: the compiler does not know that A is not B, and would read again
    u_a = K[U, link_a]
    v_a = K[V, link_a]
    omega_a = K[OMEGA, link_a]
    u_b = K[U, link_b]
    v_b = K[V, link_b]
    omega_b = K[OMEGA, link_b]
    u = u_a - u_b
    v = v_a - v_b
    normal_speed = u * nx + v * ny
    normal_speed += omega_a * a_n - omega_b * b_n + push
    lost = ZERO
    hits = wp.int64(0)
    if normal_speed > ZERO:
        tangential_speed = v * nx - u * ny
        tangential_speed += omega_a * a_t - omega_b * b_t
        mass_a = K[INVERSE_MASS, link_a]
        mass_b = K[INVERSE_MASS, link_b]
        inertia_a = K[INVERSE_INERTIA, link_a]
        inertia_b = K[INVERSE_INERTIA, link_b]
        w_nn, w_nt, w_tt = effective_masses(mass_a + mass_b, inertia_a, inertia_b, a_n, a_t, b_n, b_t)
        jn, jt = collision_impulse(
            normal_speed,
            tangential_speed,
            w_nn,
            w_nt,
            w_tt,
            inverse_nn,
            inverse_determinant,
            chain.chain_restitution,
            chain.chain_friction,
            chain.tangential_restitution,
        )
        jx = jn * nx - jt * ny
        jy = jn * ny + jt * nx
        K[U, link_a] = u_a - jx * mass_a
        K[V, link_a] = v_a - jy * mass_a
        K[OMEGA, link_a] = omega_a - (a_n * jn + a_t * jt) * inertia_a
        K[U, link_b] = u_b + jx * mass_b
        K[V, link_b] = v_b + jy * mass_b
        K[OMEGA, link_b] = omega_b + (b_n * jn + b_t * jt) * inertia_b
        changed_n = w_nn * jn + w_nt * jt
        changed_t = w_nt * jn + w_tt * jt
        lost = jn * (normal_speed - push - HALF * changed_n) + jt * (tangential_speed - HALF * changed_t)
        hits = wp.int64(1)
    return lost, hits
