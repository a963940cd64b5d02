"""A link and the floor or the sprocket: one impulse for each of its circles that overlaps and approaches."""

import warp as wp

from warpchain.kernels.contacts.impulse import fixed_contact
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, quotient
from warpchain.kernels.types import Chain, Drive

wp.set_module_options({"enable_backward": False})

SMALLEST = wp.constant(wp.float64(1e-300))


@wp.func
def sprocket_turning(drive: Drive, world: int, time: wp.float64):
    """Angular velocity [rad/s] of the sprocket: a smooth step 3s² − 2s³ from 0 to its final value."""
    ramp = drive.spin_up_time[world]
    since = time - drive.spin_up_start[world]
    s = ONE
    if ramp > ZERO and since < ramp:
        s = wp.max(since, ZERO) / ramp
    return drive.sprocket_speed[world] * s * s * (wp.float64(3.0) - TWO * s)


@wp.func
def floor_circle(
    chain: Chain,
    _surface_speed: wp.float64,
    _push_rate: wp.float64,
    _circle_x: wp.float64,
    circle_y: wp.float64,
    arm_x: wp.float64,
    arm_y: wp.float64,
    inverse_mass: wp.float64,
    inverse_inertia: wp.float64,
    u: wp.float64,
    v: wp.float64,
    omega: wp.float64,
):
    """One circle against the floor y = 0 (body A; n̂ = ŷ); ``arm`` leads from the link's centre to the circle's.

    At a depth d the floor moves up at ``chain.push_rate`` d.
    """
    r = chain.circle_radius
    gap = circle_y - r
    return fixed_contact(
        chain,
        gap,
        ZERO,
        ONE,
        arm_x,
        arm_y - r,
        ZERO,
        chain.push_rate * wp.max(ZERO, -gap),
        inverse_mass,
        inverse_inertia,
        chain.floor_restitution,
        chain.floor_friction,
        u,
        v,
        omega,
    )


@wp.func
def sprocket_circle(
    chain: Chain,
    surface_speed: wp.float64,
    push_rate: wp.float64,
    circle_x: wp.float64,
    circle_y: wp.float64,
    arm_x: wp.float64,
    arm_y: wp.float64,
    inverse_mass: wp.float64,
    inverse_inertia: wp.float64,
    u: wp.float64,
    v: wp.float64,
    omega: wp.float64,
):
    """One circle against the sprocket about the origin (body A; n̂ points outwards).

    ``arm`` leads from the link's centre to the circle's; ``surface_speed`` is the sprocket's angular velocity. The
    touching point is that of the circle which is nearest to the sprocket's centre. At a depth d the surface moves
    outwards at ``push_rate`` d. Without that an impulse stops a circle only after a step in which it has sunk in: in
    steps of 50 µs loops sank in by 0.06 to 0.14 mm, which slowed them down.
    """
    # a circle exactly at the centre has no normal; with a normal of zero it does not approach
    distance = wp.max(wp.sqrt(circle_x * circle_x + circle_y * circle_y), SMALLEST)
    normal_x = quotient(circle_x, distance)
    normal_y = quotient(circle_y, distance)
    r = chain.circle_radius
    point_x = circle_x - r * normal_x
    point_y = circle_y - r * normal_y
    gap = distance - r - chain.sprocket_radius
    push = push_rate * wp.max(ZERO, -gap)
    return fixed_contact(
        chain,
        gap,
        normal_x,
        normal_y,
        arm_x - r * normal_x,
        arm_y - r * normal_y,
        push * normal_x - surface_speed * point_y,
        push * normal_y + surface_speed * point_x,
        inverse_mass,
        inverse_inertia,
        chain.sprocket_restitution,
        chain.sprocket_friction,
        u,
        v,
        omega,
    )


def meeting(circle: wp.Function):
    """Warp function ``meet`` of a link and a fixed body, from that of one circle and the body."""

    @wp.func
    def meet(
        chain: Chain,
        surface_speed: wp.float64,
        push_rate: wp.float64,
        left_x: wp.float64,
        left_y: wp.float64,
        right_x: wp.float64,
        right_y: wp.float64,
        x: wp.float64,
        y: wp.float64,
        inverse_mass: wp.float64,
        inverse_inertia: wp.float64,
        u: wp.float64,
        v: wp.float64,
        omega: wp.float64,
    ):
        """One link against the body, its left circle first.

        The sprocket turns at ``surface_speed`` [rad/s] and pushes out circles that have sunk in at ``push_rate`` [1/s].

        Returns:
            u, v, ω afterwards, energy lost [J] by the left and the right circle, number of impulses.
        """
        u, v, omega, lost_left, hit_left = circle(
            chain,
            surface_speed,
            push_rate,
            left_x,
            left_y,
            left_x - x,
            left_y - y,
            inverse_mass,
            inverse_inertia,
            u,
            v,
            omega,
        )
        u, v, omega, lost_right, hit_right = circle(
            chain,
            surface_speed,
            push_rate,
            right_x,
            right_y,
            right_x - x,
            right_y - y,
            inverse_mass,
            inverse_inertia,
            u,
            v,
            omega,
        )
        return u, v, omega, lost_left, lost_right, hit_left + hit_right

    return meet


meet_floor, meet_sprocket = meeting(floor_circle), meeting(sprocket_circle)
