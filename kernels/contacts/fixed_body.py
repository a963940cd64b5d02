"""Bodies that no impulse moves. A body is a function, ``surface``: gaps, times to contact and impulses derive from it.

``surface(chain, face, circle_x, circle_y)`` gives, for the circle of a link about that place, its gap [m] to the body,
the unit vector n̂ from the body to the circle, the velocity [m/s] of the body's surface where they touch, and the
coefficients e and μ. ``Face`` is what it needs besides the chain's constants. A new body needs a line in ``BODIES``.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts import terrain
from warpchain.kernels.contacts.impulse import Touching, struck
from warpchain.kernels.contacts.terrain import SMALLEST, Face, read_face
from warpchain.kernels.hooks import Hooks, hook
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, quotient, square_root
from warpchain.kernels.types import Chain, Drive, Ground


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
    distance = wp.max(square_root(circle_x * circle_x + circle_y * circle_y), SMALLEST)
    normal_x = quotient(circle_x, distance)
    normal_y = quotient(circle_y, distance)
    r = chain.circle_radius
    gap = distance - r - chain.sprocket_radius
    push = face.push_rate * wp.max(ZERO, -gap)
    u = push * normal_x - face.turning * (circle_y - r * normal_y)
    v = push * normal_y + face.turning * (circle_x - r * normal_x)
    return gap, normal_x, normal_y, u, v, chain.sprocket_restitution, chain.sprocket_friction


@wp.func
def lesser_sprocket_gap(chain: Chain, left_x: wp.float64, left_y: wp.float64, right_x: wp.float64, right_y: wp.float64):
    """The lesser gap of two circles by one square root; with two a driven step on a GPU takes 7 % longer."""
    square = wp.min(left_x * left_x + left_y * left_y, right_x * right_x + right_y * right_y)
    return square_root(square) - chain.circle_radius - chain.sprocket_radius


@wp.func
def moving_sprocket_surface(chain: Chain, face: Face, circle_x: wp.float64, circle_y: wp.float64):
    """The sprocket about another place than the origin, with a velocity of its centre."""
    gap, nx, ny, u, v, restitution, friction = sprocket_surface(chain, face, circle_x - face.x, circle_y - face.y)
    return gap, nx, ny, u + face.u, v + face.v, restitution, friction


@wp.func
def nowhere(_ground: Ground) -> Face:
    """A body whose place needs no face."""
    return Face()


@wp.func
def unmoved(face: Face, _drive: Drive, _world: int, _time: wp.float64) -> Face:
    """A body that does not move."""
    return face


@wp.func
def turning_sprocket(face: Face, drive: Drive, world: int, time: wp.float64) -> Face:
    """The sprocket, whose angular velocity is a smooth step 3s² − 2s³ from 0 to its final value."""
    ramp = drive.spin_up_time[world]
    since = time - drive.spin_up_start[world]
    s = ONE
    if ramp > ZERO and since < ramp:
        s = wp.max(since, ZERO) / ramp
    moving = face
    moving.turning = drive.sprocket_speed[world] * s * s * (wp.float64(3.0) - TWO * s)
    moving.push_rate = drive.push_rate[world]
    return moving


@wp.func
def on_cubic(drive: Drive, world: int, k: int, place: int, velocity: int, s: wp.float64, span: wp.float64):
    """Place and velocity at the share s of the time between rows k and k + 1, on the cubic that has both of both."""
    x = drive.motion[world, k, place]
    change = drive.motion[world, k + 1, place] - x
    first = span * drive.motion[world, k, velocity] - change
    second = span * drive.motion[world, k + 1, velocity] - change
    rest = ONE - s
    at = x + s * change + s * rest * (rest * first - s * second)
    rate = change + (rest - s) * (rest * first - s * second) - s * rest * (first + second)
    return at, rate / span


@wp.func
def moved_sprocket(face: Face, drive: Drive, world: int, time: wp.float64) -> Face:
    """The sprocket on its given motion: places on cubics between the rows, turning at a rate that changes evenly."""
    k = int(0)
    while k + 2 < layout.MOTION_ROWS and time >= drive.motion[world, k + 1, layout.MOTION_TIME]:
        k += 1
    span = drive.motion[world, k + 1, layout.MOTION_TIME] - drive.motion[world, k, layout.MOTION_TIME]
    s = (time - drive.motion[world, k, layout.MOTION_TIME]) / span
    moving = face
    x, u = on_cubic(drive, world, k, layout.MOTION_X, layout.MOTION_U, s, span)
    y, v = on_cubic(drive, world, k, layout.MOTION_Y, layout.MOTION_V, s, span)
    moving.x = x
    moving.y = y
    moving.u = u
    moving.v = v
    turning = drive.motion[world, k, layout.MOTION_TURNING]
    moving.turning = turning + s * (drive.motion[world, k + 1, layout.MOTION_TURNING] - turning)
    moving.push_rate = drive.push_rate[world]
    return moving


@dataclass(frozen=True)
class Body(Hooks):
    """A body that no impulse moves, as Warp functions and facts that step loops are made of."""

    # → gap, normal, velocity, e, μ of a circle, see the head of this module; None: there is no body
    surface: Any = hook(chain=Chain, face=Face, circle_x=wp.float64, circle_y=wp.float64)
    # → its Face but for its motion
    face: Any = hook(ground=Ground, otherwise=nowhere)
    # → its Face at a time [s]
    motion: Any = hook(face=Face, drive=Drive, world=int, time=wp.float64, otherwise=unmoved)
    in_cells: bool = False  # whether it has many faces, found through cells, and corners
    is_plane: bool = False  # then rigid flights bound their steps by the speed of approach, not by any speed
    is_driven: bool = False  # whether it holds and drives a chain before its release, and is no floor
    # → the lesser gap [m] of two circles, if that is less work than two surfaces
    lesser_gap: Any = hook(
        chain=Chain, left_x=wp.float64, left_y=wp.float64, right_x=wp.float64, right_y=wp.float64, otherwise=None
    )


BODIES = {
    "none": Body(surface=None),
    "floor": Body(floor_surface, is_plane=True),
    "sprocket": Body(sprocket_surface, motion=turning_sprocket, is_driven=True, lesser_gap=lesser_sprocket_gap),
    "moving sprocket": Body(moving_sprocket_surface, motion=moved_sprocket),
    "slope": Body(terrain.slope_surface, terrain.first_face, is_plane=True),
    "terrain": Body(terrain.terrain_surface, in_cells=True),
}
"""Every body by its name."""


@functools.cache
def link_and_body(name: str):
    """Warp functions of one link and a body.

    ``gap(chain, ground, face, link)``: the least gap [m] of the link. ``meet(chain, ground, face, link)`` → Touching:
    the link after an impulse for each circle that overlaps and approaches, the left one first, and then for its sides.
    """
    surface, in_cells, lesser_gap = BODIES[name].surface, BODIES[name].in_cells, BODIES[name].lesser_gap
    has_lesser_gap = lesser_gap is not None

    @wp.func
    def gap_to_face(chain: Chain, _ground: Ground, face: Face, link: Touching):
        least = ZERO
        if wp.static(has_lesser_gap):
            least = lesser_gap(chain, link.left_x, link.left_y, link.right_x, link.right_y)
        else:
            left, _nx, _ny, _u, _v, _e, _mu = surface(chain, face, link.left_x, link.left_y)
            right, _nx, _ny, _u, _v, _e, _mu = surface(chain, face, link.right_x, link.right_y)
            least = wp.min(left, right)
        if wp.static(in_cells):
            side, _nx, _ny = terrain.corner_and_side(chain, face, link.x, link.y, link.cosine, link.sine)
            least = wp.min(least, side)
        return least

    @wp.func
    def meet_circle(chain: Chain, face: Face, link: Touching, x: wp.float64, y: wp.float64) -> Touching:
        gap, nx, ny, u, v, restitution, friction = surface(chain, face, x, y)
        r = chain.circle_radius
        return struck(chain, link, gap, nx, ny, x - link.x - r * nx, y - link.y - r * ny, u, v, restitution, friction)

    @wp.func
    def meet_face(chain: Chain, _ground: Ground, face: Face, before: Touching) -> Touching:
        link = meet_circle(chain, face, before, before.left_x, before.left_y)
        link = meet_circle(chain, face, link, link.right_x, link.right_y)
        if wp.static(in_cells):
            gap, nx, ny = terrain.corner_and_side(chain, face, link.x, link.y, link.cosine, link.sine)
            push = chain.push_rate * wp.max(ZERO, -gap)
            lever_x = face.x - link.x
            lever_y = face.y - link.y
            e = face.restitution
            mu = face.friction
            link = struck(chain, link, gap, nx, ny, lever_x, lever_y, push * nx, push * ny, e, mu)
        return link

    if not in_cells:
        return gap_to_face, meet_face

    @wp.func
    def gap(chain: Chain, ground: Ground, _face: Face, link: Touching):
        least = ground.cells[layout.GROUND_CELLS, layout.GROUND_MARGIN]
        cell = terrain.cell_at(ground, link.x)
        height = wp.min(link.left_y, link.right_y) - chain.circle_radius - ground.cells[cell, layout.TOP]
        if height < least:
            last = int(ground.cells[cell, layout.LAST_FACE])
            k = int(ground.cells[cell, layout.FIRST_FACE])
            while k <= last:
                least = wp.min(least, gap_to_face(chain, ground, read_face(ground, k), link))
                k += 1
        return least

    @wp.func
    def meet(chain: Chain, ground: Ground, _face: Face, before: Touching) -> Touching:
        link = before
        cell = terrain.cell_at(ground, link.x)
        last = int(ground.cells[cell, layout.LAST_FACE])
        k = int(ground.cells[cell, layout.FIRST_FACE])
        while k <= last:
            link = meet_face(chain, ground, read_face(ground, k), link)
            k += 1
        return link

    return gap, meet
