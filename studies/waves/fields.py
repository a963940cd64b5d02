"""Waves along a chain, computed from its frames: tension, curvature, velocity, contacts, characteristics.

Joint i ends link i. The number of a joint names the same piece of chain at all times: it is the place in the chain's
own frame, in which long transverse waves run at ±c, c = √(Tℓ/m̄), with the tension T and the mean link mass m̄. The
chain itself runs along its loop at the speed v, and v ≈ c because the tension bends the path of the links. In the frame
of the room one of the two waves hence hardly moves, and the other one runs twice as fast as the chain.

Functions take the `time` of f frames [s], shape (f,), `joints`, their x, y [m], shape (f, n, 2), and the `masses` of n
links [kg]. Contacts are taken from the frames: a joint touches if its circle is not farther than a tolerance from the
floor, or from the circle of a joint that is no neighbour.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Truths = NDArray[np.bool_]

NEAR: Final = 0.02
"""A circle touches if its distance is at most this part of its radius."""
QUIET: Final = 0.01
"""Contacts with the floor less than this time [s] apart are one impact, as in the number of bounces."""
_CHUNK: Final = 2_000_000
"""Distances of joints that are in memory together."""


@dataclass(frozen=True)
class Impact:
    """An impact on the floor.

    Attributes:
        frame: number of the first frame in which a joint touches the floor.
        joint: the joint that touches then, the lowest one if there are several.
        last_frame: number of the last such frame.
        last_joint: the joint that touches then, likewise.
    """

    frame: int
    joint: int
    last_frame: int
    last_joint: int


def tensions(joints: Array, forces: Array) -> Array:
    """Force in each joint along the chain [N], positive if it pulls, shape (f, n).

    The direction of the chain at a joint is that of the line between its two neighbours.
    `forces` are those on the link that the joint ends [N], shape (f, n, 2).
    """
    return np.sum(forces * _tangents(joints), axis=2)


def curvatures(joints: Array, link_length: float) -> Array:
    """Angle between the two links at each joint over their length [1/m], shape (f, n).

    It is positive where the chain bends as the loop of the first frame does, also if that runs clockwise.
    """
    link = joints - np.roll(joints, 1, axis=1)
    ahead = np.roll(link, -1, axis=1)
    turn = np.arctan2(_cross(link, ahead), np.sum(link * ahead, axis=2))
    return _turning(joints) * turn / link_length


def normal_velocities(time: Array, joints: Array, masses: Array) -> Array:
    """Velocity of each joint across the chain, relative to the centre of mass [m/s], outwards, shape (f, n)."""
    velocity = np.gradient(joints, time, axis=0) - np.gradient(centers(joints, masses), time, axis=0)[:, None]
    return -_turning(joints) * _cross(_tangents(joints), velocity)


def centers(joints: Array, masses: Array) -> Array:
    """Centre of mass of links that lie between joints [m], shape (f, 2)."""
    middle = (joints + np.roll(joints, 1, axis=1)) / 2
    return np.einsum("fnk,n->fk", middle, masses) / masses.sum()


def wave_speeds(tension: Array, link_length: float, mean_mass: float) -> Array:
    """Speed c = √(Tℓ/m̄) of long transverse waves in the chain's frame [m/s] for each T; 0 where T is negative."""
    return np.sqrt(np.maximum(tension, 0.0) * link_length / mean_mass)


def moving_average(time: Array, values: Array, width: float) -> Array:
    """Mean of values (f,) over `width` [s] around each time, less at both ends."""
    area = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))])
    first, last = np.maximum(time - width / 2, time[0]), np.minimum(time + width / 2, time[-1])
    span = last - first
    if not np.all(span > 0):
        return values.copy()
    return (np.interp(last, time, area) - np.interp(first, time, area)) / span


def stacked_power(values: Array, way: Array, modes: tuple[int, int] | None = None) -> float:
    """Part of a field's variance along the loop that runs along given paths around it, 0 to 1.

    The field is moved back by the way of each frame and averaged over the frames: what runs along adds up.

    Args:
        values: at joints, shape (f, n).
        way: how far the paths have come at each frame [links], shape (f,).
        modes: first and last number of waves around the loop that count, from 1 to below n/2; None: all of these.
    """
    links = values.shape[1]
    first, last = (1, (links - 1) // 2) if modes is None else modes
    waves = np.fft.rfft(values, axis=1)[:, first : last + 1]
    moved = waves * np.exp(2j * np.pi * np.arange(first, last + 1) * way[:, None] / links)
    whole = float(np.mean(np.sum(np.abs(waves) ** 2, axis=1)))
    return float(np.sum(np.abs(moved.mean(axis=0)) ** 2)) / whole if whole > 0 else 0.0


def bin_means(time: Array, values: Array, most: int) -> tuple[Array, Array]:
    """Edges of even spans of time, at most `most`, and the mean of the values in each, shapes (b + 1,) and (b, n).

    There are as many as frames if these are fewer; a span without frames has the values of the one before.
    """
    count = min(most, len(time))
    edges = np.linspace(time[0], time[-1], count + 1)
    span = np.minimum(np.searchsorted(edges, time, side="right") - 1, count - 1)
    filled, first = np.unique(span, return_index=True)
    means = np.add.reduceat(values, first, axis=0) / np.diff(first, append=len(time))[:, None]
    return edges, means[np.searchsorted(filled, np.arange(count), side="right") - 1]


def characteristic(time: Array, speed: Array, start: int, joint: float, link_length: float) -> Array:
    """Path of a wave in the chain's frame: joint number at each time from frame `start` on, not wrapped, (f − start,).

    It begins at `joint` and runs at `speed` [m/s], shape (f,), in the order of the joints' numbers.
    """
    time, speed = time[start:], speed[start:]
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(time))])
    return joint + way / link_length


def joints_below(joints: Array, masses: Array) -> Array:
    """Joint number, with fraction, of the lowest point of the chain vertically below its centre of mass, shape (f,).

    Numbers go on beyond n − 1 and below 0, so that they change little from frame to frame. Unlike the lowest joint,
    this point moves smoothly while the bottom of the loop lies flat on the floor.
    """
    place = joints - centers(joints, masses)[:, None]
    x, y = place[..., 0], place[..., 1]
    ahead_x, ahead_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    crosses = (x <= 0) != (ahead_x <= 0)
    step = np.where(crosses, ahead_x - x, 1.0)
    share = np.where(crosses, -x / step, 0.0)
    height = np.where(crosses, y + share * (ahead_y - y), np.inf)
    lowest = np.argmin(height, axis=1)
    number: Array = lowest + share[np.arange(len(joints)), lowest]
    return np.unwrap(number, period=joints.shape[1])


def in_room(values: Array, below: Array, points: int) -> Array:
    """Values at places that stand still in the room: at `points` even distances from the point below the centre.

    Args:
        values: at joints, shape (f, n).
        below: joint number of that point, shape (f,), see `joints_below`.
        points: number of places.

    Returns:
        Values between joints, linear, shape (f, points), from half a loop behind that point to half a loop ahead.
    """
    frames, links = values.shape
    place = below[:, None] + links * ((np.arange(points) + 0.5) / points - 0.5)
    behind = np.floor(place)
    share, row = place - behind, np.arange(frames)[:, None]
    first = behind.astype(np.intp) % links
    return (1 - share) * values[row, first] + share * values[row, (first + 1) % links]


def floor_contacts(joints: Array, radius: float) -> Truths:
    """Whether the circles of a joint are at the floor y = 0, at most `NEAR` of their radius [m] above; shape (f, n)."""
    return joints[..., 1] <= (1 + NEAR) * radius


def self_contacts(joints: Array, radius: float) -> Truths:
    """Whether the circles of a joint touch those of one that is no neighbour, shape (f, n).

    They are then at most `NEAR` of their diameter apart.
    """
    frames, links = joints.shape[:2]
    touching = np.zeros((frames, links), dtype=np.bool_)
    first, second = np.triu_indices(links, 2)
    apart = second - first < links - 1  # joint 0 is the neighbour of the last one
    first, second = first[apart], second[apart]
    rows = max(1, _CHUNK // max(1, len(first)))
    for begin in range(0, frames, rows):
        part = joints[begin : begin + rows]
        span = part[:, first] - part[:, second]
        frame, pair = np.nonzero(np.sum(span**2, axis=2) <= (2 * (1 + NEAR) * radius) ** 2)
        touching[begin + frame, first[pair]] = True
        touching[begin + frame, second[pair]] = True
    return touching


def impacts(time: Array, joints: Array, touching: Truths) -> list[Impact]:
    """Impacts on the floor: contacts with less than `QUIET` between them."""
    frames = np.flatnonzero(touching.any(axis=1))
    if not len(frames):
        return []
    begins = np.concatenate([[True], np.diff(time[frames]) > QUIET])
    firsts, lasts = frames[begins], frames[np.append(begins[1:], True)]
    lowest = np.argmin(joints[..., 1], axis=1)
    return [
        Impact(int(first), int(lowest[first]), int(last), int(lowest[last]))
        for first, last in zip(firsts, lasts, strict=True)
    ]


def _tangents(joints: Array) -> Array:
    """Directions of the chain at its joints, from the joint behind to the one ahead, shape (f, n, 2)."""
    span = np.roll(joints, -1, axis=1) - np.roll(joints, 1, axis=1)
    length = np.hypot(span[..., 0], span[..., 1])[..., None]
    return span / np.where(length > 0, length, 1.0)


def _cross(first: Array, second: Array) -> Array:
    """z of the cross product of vectors, shape (…, 2)."""
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def _turning(joints: Array) -> float:
    """1 if the loop of the first frame runs counter-clockwise in the order of its joints, −1 if clockwise."""
    first = joints[0]
    return 1.0 if _cross(first, np.roll(first, -1, axis=0)).sum() > 0 else -1.0
