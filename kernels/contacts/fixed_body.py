"""Bodies that no impulse moves. A body is a function, ``surface``: gaps, times to contact and impulses derive from it.

``surface(chain, face, circle_x, circle_y)`` gives, for the circle of a link about that place, its gap [m] to the body,
the unit vector n̂ from the body to the circle, the velocity [m/s] of the body's surface where they touch, and the
coefficients e and μ. ``Face`` is what it needs to know besides the chain's constants.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.contacts.impulse import fixed_contact
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, quotient
from warpchain.kernels.types import Chain, Drive

wp.set_module_options({"enable_backward": False})

SMALLEST = wp.constant(wp.float64(1e-300))


@wp.struct
class Face:
    """The body at this moment."""

    turning: wp.float64  # angular velocity of the sprocket [rad/s]
    push_rate: wp.float64  # speed at which it pushes out sunken circles, per depth [1/s]


@wp.func
def floor_surface(chain: Chain, _face: Face, _circle_x: wp.float64, circle_y: wp.float64):
    """The floor y = 0; at a depth d it moves up at ``chain.push_rate`` d."""
    gap = circle_y - chain.circle_radius
    push = chain.push_rate * wp.max(ZERO, -gap)
    return gap, ZERO, ONE, ZERO, push, chain.floor_restitution, chain.floor_friction


@wp.func
def sprocket_surface(chain: Chain, face: Face, circle_x: wp.float64, circle_y: wp.float64):
    """The sprocket about the origin; at a depth d its surface moves outwards at ``face.push_rate`` d.

    Without that an impulse stops a circle only after a step in which it has sunk in: in steps of 50 µs loops sank in by
    0.06 to 0.14 mm, which slowed them down. A circle exactly at the centre has no normal, and does not approach.
    """
    distance = wp.max(wp.sqrt(circle_x * circle_x + circle_y * circle_y), SMALLEST)
    normal_x = quotient(circle_x, distance)
    normal_y = quotient(circle_y, distance)
    r = chain.circle_radius
    gap = distance - r - chain.sprocket_radius
    push = face.push_rate * wp.max(ZERO, -gap)
    u = push * normal_x - face.turning * (circle_y - r * normal_y)
    v = push * normal_y + face.turning * (circle_x - r * normal_x)
    return gap, normal_x, normal_y, u, v, chain.sprocket_restitution, chain.sprocket_friction


@wp.func
def sprocket_face(drive: Drive, world: int, time: wp.float64) -> Face:
    """The sprocket, whose angular velocity is a smooth step 3s² − 2s³ from 0 to its final value."""
    ramp = drive.spin_up_time[world]
    since = time - drive.spin_up_start[world]
    s = ONE
    if ramp > ZERO and since < ramp:
        s = wp.max(since, ZERO) / ramp
    face = Face()
    face.turning = drive.sprocket_speed[world] * s * s * (wp.float64(3.0) - TWO * s)
    face.push_rate = drive.push_rate[world]
    return face


@wp.func
def still_face(_drive: Drive, _world: int, _time: wp.float64) -> Face:
    """A body that needs none."""
    return Face()


@dataclass(frozen=True)
class Body:
    """A body: its surface, and its face at a time [s]."""

    surface: Any
    face: Any = still_face


BODIES = {"floor": Body(floor_surface), "sprocket": Body(sprocket_surface, sprocket_face)}
"""Every body by its name."""


@functools.cache
def link_and_body(name: str):
    """Warp functions of one link and a body: (gap, meet). Both take the places of the link's circles.

    ``gap(chain, face, left_x, left_y, right_x, right_y)``: the lesser of its circles' gaps [m].
    ``meet(chain, face, left_x, left_y, right_x, right_y, x, y, 1/m, 1/I, u, v, ω, lost)``: an impulse for each circle
    that overlaps and approaches, the left one first; u, v, ω, the energy lost so far [J], and the number of impulses.
    """
    surface = BODIES[name].surface

    @wp.func
    def gap(chain: Chain, face: Face, left_x: wp.float64, left_y: wp.float64, right_x: wp.float64, right_y: wp.float64):
        left, _nx, _ny, _u, _v, _e, _mu = surface(chain, face, left_x, left_y)
        right, _nx, _ny, _u, _v, _e, _mu = surface(chain, face, right_x, right_y)
        return wp.min(left, right)

    @wp.func
    def meet_circle(
        chain: Chain,
        face: Face,
        circle_x: wp.float64,
        circle_y: wp.float64,
        x: wp.float64,
        y: wp.float64,
        inverse_mass: wp.float64,
        inverse_inertia: wp.float64,
        u: wp.float64,
        v: wp.float64,
        omega: wp.float64,
    ):
        away, nx, ny, surface_u, surface_v, restitution, friction = surface(chain, face, circle_x, circle_y)
        r = chain.circle_radius
        return fixed_contact(
            chain,
            away,
            nx,
            ny,
            circle_x - x - r * nx,
            circle_y - y - r * ny,
            surface_u,
            surface_v,
            inverse_mass,
            inverse_inertia,
            restitution,
            friction,
            u,
            v,
            omega,
        )

    @wp.func
    def meet(
        chain: Chain,
        face: Face,
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
        lost: wp.float64,
    ):
        u, v, omega, lost_left, hit_left = meet_circle(
            chain, face, left_x, left_y, x, y, inverse_mass, inverse_inertia, u, v, omega
        )
        u, v, omega, lost_right, hit_right = meet_circle(
            chain, face, right_x, right_y, x, y, inverse_mass, inverse_inertia, u, v, omega
        )
        return u, v, omega, lost + lost_left + lost_right, hit_left + hit_right

    return gap, meet
