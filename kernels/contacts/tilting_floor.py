"""A link of a tilting plane and the floor: one impulse in three dimensions for each of its rollers that touches.

*Rollers.* A circle of a link is the middle of a roller, a cylinder of half width h across the plane. Its lowest points
lie on the rims at ζ = ±h, in the direction q = −(up1, up2)/ρ with ρ² = up1² + up2², at the heights O·Ŷ + x up1 + y up2
− r ρ ± h up3. a± is the speed at which a rim approaches the floor if it overlaps it, else 0. The roller touches if a₊ +
a₋ > 0. Then the impulse acts between the rims, at ζ = h (a₊ − a₋)/(a₊ + a₋): at the middle of an upright roller, which
thus meets the floor as in the plane; at a rim if it alone approaches.

*Push.* Under softened joints the floor pushes out what has sunk in, as in the plane: at a depth d it rises at
``chain.push_rate`` d. Then a± and the velocities of the law are those over the rising floor.

*Law.* That of :mod:`contacts.impulse` with three components. The impulse J at (X, Y, ζ) changes the link as in the
plane, by (J1, J2), and the plane by A⁻¹ Q with Q = (J3, Y J3 − ζ J2, ζ J1 − X J3) and the mass matrix A of
:mod:`physics.plane`. So W is the link's 2 × 2 matrix plus Gᵀ A⁻¹ G.

*Many contacts at once.* All touching links share the plane. Each of N links gets a copy of it with the mass A/N, and
afterwards the plane has the mean of their velocities: A⁻¹ ΣQ. Momentum is kept, since nothing else acts. Energy does
not rise: no collision of a link and its copy adds any, and the meeting of the copies is inelastic. The result depends
neither on the order of the links, so that threads can take one each, nor on which side of the plane is which. Contacts
one after the other, instead, tip an upright chain over: those on one side come first.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.impulse import Touching
from warpchain.kernels.layout import INVERSE_01, INVERSE_11, INVERSE_12
from warpchain.kernels.physics.elementary import HALF, ONE, ZERO, quotient, square_root
from warpchain.kernels.physics.plane import next_three, plane_times_inverse
from warpchain.kernels.types import Chain, Row

SMALLEST = wp.constant(wp.float64(1e-12))
"""Least ρ: a plane that lies flat has no direction q, and touches with the middle of its faces."""


@wp.struct
class TiltingLink:
    """A link and its copy of the plane, while they meet the floor."""

    motion: wp.vec3d  # u, v [m/s], ω [rad/s]
    rates: wp.vec3d  # of the plane: u [m/s], ω1, ω2 [rad/s]
    push: wp.vec3d  # Q, the generalised impulse on the plane [N s], [N m s]
    lost: wp.float64  # energy [J] of its motion within the plane
    hits: wp.int64  # impulses


@wp.func
def copy_inverse(P: Row, copies: wp.float64):
    """N A⁻¹, the inverse mass matrix of one of so many copies of the plane."""
    b00 = copies * P[layout.INVERSE_00]
    b01 = copies * P[INVERSE_01]
    b02 = copies * P[layout.INVERSE_02]
    b11 = copies * P[INVERSE_11]
    b12 = copies * P[INVERSE_12]
    return wp.mat33d(b00, b01, b02, b01, b11, b12, b02, b12, copies * P[layout.INVERSE_22])


@wp.func
def steepness(chain: Chain):
    """ρ: the sine of the angle between the plane's normal and the room's Y axis; 0 for a plane that lies flat."""
    return square_root(chain.up_x * chain.up_x + chain.up_y * chain.up_y)


@wp.func
def middle_height(chain: Chain, slope: wp.float64, x: wp.float64, y: wp.float64):
    """Height [m] of the lowest line of a roller's surface, at its middle, from the place of its circle."""
    return chain.origin_height + x * chain.up_x + y * chain.up_y - chain.circle_radius * slope


@wp.func
def greatest_across_speed(chain: Chain, x: wp.float64, y: wp.float64):
    """A bound on what the motion of the plane adds to the speed [m/s] of any point of a link's rollers."""
    reach = chain.half_length + chain.circle_radius + chain.half_width
    turn = wp.abs(chain.turn_x) + wp.abs(chain.turn_y)
    return wp.abs(chain.plane_speed + chain.turn_x * y - chain.turn_y * x) + reach * turn


@wp.func
def approaches(chain: Chain, slope: wp.float64, link: TiltingLink, at: Touching, x: wp.float64, y: wp.float64):
    """a₊ and a₋ [m/s] of a link's roller at (x, y). The lever leads from the link's centre to its lowest line."""
    inverse = quotient(ONE, wp.max(slope, SMALLEST))
    point_x = x - chain.circle_radius * chain.up_x * inverse
    point_y = y - chain.circle_radius * chain.up_y * inverse
    lever_x = x - at.x + (-chain.circle_radius * chain.up_x * inverse)
    lever_y = y - at.y + (-chain.circle_radius * chain.up_y * inverse)
    across = link.rates[0] + link.rates[1] * point_y - link.rates[2] * point_x
    u = link.motion[0] - link.motion[2] * lever_y
    v = link.motion[1] + link.motion[2] * lever_x
    middle = -(chain.up_x * u + chain.up_y * v + chain.up_z * across)
    tipping = chain.half_width * (chain.up_y * link.rates[1] - chain.up_x * link.rates[2])
    height = middle_height(chain, slope, x, y)
    rise = chain.half_width * chain.up_z
    front = wp.where(height + rise < ZERO, wp.max(middle + tipping - chain.push_rate * (height + rise), ZERO), ZERO)
    back = wp.where(height - rise < ZERO, wp.max(middle - tipping - chain.push_rate * (height - rise), ZERO), ZERO)
    return front, back


@wp.func
def meet_roller(
    chain: Chain,
    slope: wp.float64,
    B: wp.mat33d,
    link: Touching,
    before: TiltingLink,
    circle_x: wp.float64,
    circle_y: wp.float64,
) -> TiltingLink:
    """One roller against the floor, without branches."""
    inverse_mass = link.inverse_mass
    inverse_inertia = link.inverse_inertia
    inverse = quotient(ONE, wp.max(slope, SMALLEST))
    to_point_x = -chain.circle_radius * chain.up_x * inverse
    to_point_y = -chain.circle_radius * chain.up_y * inverse
    x = circle_x + to_point_x
    y = circle_y + to_point_y
    lever_x = circle_x - link.x + to_point_x
    lever_y = circle_y - link.y + to_point_y
    front, back = approaches(chain, slope, before, link, circle_x, circle_y)
    total = front + back
    hit = total > ZERO
    z = chain.half_width * quotient(front - back, wp.where(hit, total, ONE))
    # velocity over the rising floor of the point at (x, y, z), and W
    n1 = chain.up_x
    n2 = chain.up_y
    n3 = chain.up_z
    rise = chain.push_rate * wp.max(ZERO, -(middle_height(chain, slope, circle_x, circle_y) + z * n3))
    motion = before.motion
    rates = before.rates
    v1 = motion[0] - motion[2] * lever_y + z * rates[2] - rise * n1
    v2 = motion[1] + motion[2] * lever_x - z * rates[1] - rise * n2
    v3 = rates[0] + rates[1] * y - rates[2] * x - rise * n3
    c0 = B[0, 0] + B[0, 1] * y - B[0, 2] * x
    c1 = B[0, 1] + B[1, 1] * y - B[1, 2] * x
    c2 = B[0, 2] + B[1, 2] * y - B[2, 2] * x
    w11 = inverse_mass + lever_y * lever_y * inverse_inertia + z * z * B[2, 2]
    w12 = -lever_x * lever_y * inverse_inertia - z * z * B[1, 2]
    w22 = inverse_mass + lever_x * lever_x * inverse_inertia + z * z * B[1, 1]
    w13 = z * c2
    w23 = -z * c1
    w33 = c0 + y * c1 - x * c2
    wn1 = w11 * n1 + w12 * n2 + w13 * n3
    wn2 = w12 * n1 + w22 * n2 + w23 * n3
    wn3 = w13 * n1 + w23 * n2 + w33 * n3
    m11 = w22 * w33 - w23 * w23
    m12 = w13 * w23 - w12 * w33
    m13 = w12 * w23 - w13 * w22
    m22 = w11 * w33 - w13 * w13
    m23 = w12 * w13 - w11 * w23
    m33 = w11 * w22 - w12 * w12
    normal_w = n1 * wn1 + n2 * wn2 + n3 * wn3
    determinant = w11 * m11 + w12 * m12 + w13 * m13
    # first: the impulse along the normal that ends the approach; second: the one that ends all motion
    inverse_both = quotient(-ONE, normal_w * determinant)
    first = (n1 * v1 + n2 * v2 + n3 * v3) * (determinant * inverse_both)
    scale = normal_w * inverse_both
    second_1 = scale * (m11 * v1 + m12 * v2 + m13 * v3)
    second_2 = scale * (m12 * v1 + m22 * v2 + m23 * v3)
    second_3 = scale * (m13 * v1 + m23 * v2 + m33 * v3)
    second_n = n1 * second_1 + n2 * second_2 + n3 * second_3
    tangent_1 = second_1 - second_n * n1
    tangent_2 = second_2 - second_n * n2
    tangent_3 = second_3 - second_n * n3
    tangential = square_root(tangent_1 * tangent_1 + tangent_2 * tangent_2 + tangent_3 * tangent_3)
    friction = chain.floor_friction
    bounce = (ONE + chain.floor_restitution) * first
    excess = second_n - first
    stick = ONE + chain.tangential_restitution
    sticks = stick * tangential <= friction * (bounce + stick * excess)
    slide = quotient(friction * bounce, tangential - friction * excess)
    kappa = wp.where(sticks, stick, slide)
    normal = bounce + kappa * excess
    j1 = wp.where(hit, normal * n1 + kappa * tangent_1, ZERO)
    j2 = wp.where(hit, normal * n2 + kappa * tangent_2, ZERO)
    j3 = wp.where(hit, normal * n3 + kappa * tangent_3, ZERO)
    q1 = y * j3 - z * j2
    q2 = z * j1 - x * j3
    after = TiltingLink()
    turn = (lever_x * j2 - lever_y * j1) * inverse_inertia
    after.motion = motion + wp.vec3d(j1 * inverse_mass, j2 * inverse_mass, turn)
    after.rates = wp.vec3d(
        rates[0] + B[0, 0] * j3 + B[0, 1] * q1 + B[0, 2] * q2,
        rates[1] + B[0, 1] * j3 + B[1, 1] * q1 + B[1, 2] * q2,
        rates[2] + B[0, 2] * j3 + B[1, 2] * q1 + B[2, 2] * q2,
    )
    after.push = before.push + wp.vec3d(j3, q1, q2)
    after.hits = before.hits + wp.where(hit, wp.int64(1), wp.int64(0))
    return after


@wp.func
def with_copy(chain: Chain, touching: Touching) -> TiltingLink:
    """A link before it meets the floor, with a copy of the chain's plane."""
    link = TiltingLink()
    link.motion = wp.vec3d(touching.u, touching.v, touching.omega)
    link.rates = wp.vec3d(chain.plane_speed, chain.turn_x, chain.turn_y)
    return link


@wp.func
def link_touches(chain: Chain, slope: wp.float64, link: Touching):
    """1 if a roller of the link touches the floor, else 0."""
    own = with_copy(chain, link)
    a, b = approaches(chain, slope, own, link, link.left_x, link.left_y)
    c, d = approaches(chain, slope, own, link, link.right_x, link.right_y)
    return wp.where(a + b + c + d > ZERO, wp.int64(1), wp.int64(0))


@wp.func
def meet_floor(chain: Chain, slope: wp.float64, B: wp.mat33d, link: Touching) -> TiltingLink:
    """One link against the floor, its left roller first, together with its copy of the plane."""
    met = meet_roller(chain, slope, B, link, with_copy(chain, link), link.left_x, link.left_y)
    met = meet_roller(chain, slope, B, link, met, link.right_x, link.right_y)
    before = wp.vec3d(link.u, link.v, link.omega)
    less = wp.cw_mul(before - met.motion, before + met.motion)  # of the squares
    met.lost = HALF * (link.mass * (less[0] + less[1]) + link.inertia * less[2])
    return met


@wp.func
def push_plane_by(P: Row, push: wp.vec3d):
    """Gives the plane the sum of the impulses on its copies; returns the energy [J] that it loses."""
    change = plane_times_inverse(P, push)
    mean = next_three(P, layout.PLANE_SPEED) + HALF * change
    for k in range(3):
        P[layout.PLANE_SPEED + k] = P[layout.PLANE_SPEED + k] + change[k]
    return -(mean[0] * push[0] + mean[1] * push[1] + mean[2] * push[2])
