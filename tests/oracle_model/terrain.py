"""A floor of straight faces in plain NumPy: gaps of links, one contact pass, and a chain that falls on it.

Gaps are distances of nearest points; nothing is shared with the kernels but the order of the contacts of a link.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from tests.oracle_model.contact_equations import collision_impulse, link_radii
from tests.oracle_model.motion_equations import acceleration, cross, link_ends, link_inertias, link_masses, turned
from tests.support.arrays import Array
from warpchain.inputs.parameters import Parameters

Contact = tuple[int, float, Array, Array]
"""Link, gap [m], normal from the floor to the link, and the touching point."""


def endless(points: Array) -> Array:
    """The points of a profile, the first and the last one moved 1 km outwards along their faces."""
    far = points.copy()
    for end, inner in ((0, 1), (-1, -2)):
        step = points[end] - points[inner]
        far[end] += 1000 * step / np.hypot(*step)
    return far


def contacts(position: Array, points: Array, parameters: Parameters) -> Iterator[Contact]:
    """What may touch, link by link, face by face: the circles with face and corner at its beginning, then the side."""
    corners, radii = endless(points), link_radii(len(position), parameters)
    for link, ends in enumerate(np.stack(link_ends(position, parameters), axis=1)):
        r = radii[link]
        axis = (ends[1] - ends[0]) / parameters.link_length
        for k, (begin, end) in enumerate(pairwise(corners)):
            along = (end - begin) / np.hypot(*(end - begin))
            before = (begin - corners[k - 1]) / np.hypot(*(begin - corners[k - 1])) if k > 0 else along
            is_convex = cross(before, along) < 0
            for center in ends:
                share = along @ (center - begin)
                height = cross(along, center - begin)
                if 0 <= share <= np.hypot(*(end - begin)) and height > -r:
                    yield link, height - r, turned(along), center - r * turned(along)
                elif is_convex and share < 0 < before @ (center - begin):
                    away = np.hypot(*(center - begin))
                    outwards = (center - begin) / away
                    yield link, away - r, outwards, center - r * outwards
            to = begin - position[link, :2]
            if is_convex and abs(axis @ to) < parameters.link_length / 2:
                side = turned(axis) * -np.sign(cross(axis, to))
                yield link, abs(cross(axis, to)) - r, side, begin


def resolve(position: Array, velocity: Array, points: Array, parameters: Parameters) -> tuple[Array, int]:
    """Velocities after one pass over all that overlap and approach, and the number of impulses."""
    velocity, count = velocity.copy(), 0
    inv_mass, inv_inertia = (1 / of_links(len(position), parameters) for of_links in (link_masses, link_inertias))
    laws = parameters.floor_restitution, parameters.floor_friction, parameters.tangential_restitution
    for link, gap, normal, point in contacts(position, points, parameters):
        lever = point - position[link, :2]
        if gap < 0:
            speed = velocity[link, :2] + velocity[link, 2] * turned(lever)
            inverses = 0.0, 0.0, inv_mass[link], inv_inertia[link]
            impulse = collision_impulse(-speed, normal, np.zeros(2), lever, *inverses, *laws)
            velocity[link, :2] += inv_mass[link] * impulse
            velocity[link, 2] += inv_inertia[link] * cross(lever, impulse)
            count += bool(impulse.any())
    return velocity, count


def fallen(
    position: Array, velocity: Array, points: Array, parameters: Parameters, duration: float, step: float
) -> tuple[Array, Array, int]:
    """A chain whose links do not touch one another: Runge–Kutta steps of one size, a pass after each; and impulses."""
    count, state = 0, np.stack([position, velocity])

    def rates(state: Array) -> Array:
        return np.stack([state[1], acceleration(*state, parameters)])

    for _ in range(round(duration / step)):
        first = rates(state)
        second = rates(state + step / 2 * first)
        third = rates(state + step / 2 * second)
        state = state + step / 6 * (first + 2 * second + 2 * third + rates(state + step * third))
        state[1], hits = resolve(*state, points, parameters)
        count += hits
    return state[0], state[1], count
