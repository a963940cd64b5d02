"""Waves along a chain, computed from its frames: tension, curvature, velocity, contacts, characteristics.

Joint i ends link i. The number of a joint names the same piece of chain at all times: it is the place in the chain's
own frame, in which long transverse waves run at ±c, c = √(Tℓ/m̄), with the tension T and the mean link mass m̄.

Functions take the `time` of f frames [s], shape (f,), `joints`, their x, y [m], shape (f, n, 2), and the `masses` of n
links [kg]. A joint touches if its circle is not farther than a tolerance from the floor, or from the circle of a joint
that is no neighbour. Inside, vectors are complex numbers x + iy.
"""

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.spatial import KDTree

from studies.common import Array

NEAR = 0.02  # A circle touches if its distance is at most this part of its radius
QUIET = 0.01  # Contacts with the floor less than this time [s] apart are one impact, as in the number of bounces
AVERAGED = 0.02  # Time [s] over which the mean tension is averaged for c; in an impact it swings to both sides


def tensions(joints: Array, forces: Array) -> Array:
    """Pull in each joint along the line between its neighbours [N], (f, n), of the forces on the link that it ends."""
    return np.real(np.conj(_tangents(_complex(joints))) * _complex(forces))


def curvatures(joints: Array, link_length: float) -> Array:
    """Angle of two links over their length [1/m], (f, n), positive where the chain bends as the first frame's loop."""
    places = _complex(joints)
    link = places - np.roll(places, 1, axis=1)
    return _turning(places) * np.angle(np.roll(link, -1, axis=1) * np.conj(link)) / link_length


def normal_velocities(time: Array, joints: Array, masses: Array) -> Array:
    """Velocity of each joint across the chain, relative to the centre of mass [m/s], outwards, shape (f, n)."""
    places = _complex(joints)
    velocity = np.gradient(places - _centers(places, masses), time, axis=0)
    return -_turning(places) * np.imag(np.conj(_tangents(places)) * velocity)


def wave_speeds(time: Array, joints: Array, forces: Array, link_length: float, mean_mass: float) -> Array:
    """Speed c of long waves in the chain's frame [m/s], (f,), with its mean tension; 0 where that pushes."""
    area = cumulative_trapezoid(tensions(joints, forces).mean(axis=1), time, initial=0.0)
    first, last = np.maximum(time - AVERAGED / 2, time[0]), np.minimum(time + AVERAGED / 2, time[-1])
    tension = (np.interp(last, time, area) - np.interp(first, time, area)) / (last - first)
    return np.sqrt(np.maximum(tension, 0.0) * link_length / mean_mass)


def stacked_power(values: Array, way: Array, modes: tuple[int, int] | None = None) -> float:
    """Part of the variance of a field (f, n) along the loop that runs along given paths around it, 0 to 1.

    The field is moved back by the way of each frame [links] and averaged over the frames: what runs along adds up.
    `modes` are the first and last number of waves around the loop that count, from 1 to below n/2; None: all of these.
    """
    links = values.shape[1]
    first, last = modes or (1, (links - 1) // 2)
    waves = np.fft.rfft(values, axis=1)[:, first : last + 1]
    moved = waves * np.exp(2j * np.pi * np.arange(first, last + 1) * way[:, None] / links)
    whole = float(np.mean(np.sum(np.abs(waves) ** 2, axis=1)))
    return float(np.sum(np.abs(moved.mean(axis=0)) ** 2)) / whole if whole > 0 else 0.0


def bin_means(values: Array, most: int) -> Array:
    """Means of even frames next to one another, at most `most` of them, shape (b, n)."""
    edges = np.linspace(0, len(values), min(most, len(values)) + 1).astype(int)
    return np.add.reduceat(values, edges[:-1], axis=0) / np.diff(edges)[:, None]


def characteristic(time: Array, speed: Array, start: int, joint: float, link_length: float) -> Array:
    """Path of a wave in the chain's frame: joint number at each time from frame `start` on, not wrapped, (f − start,).

    It begins at `joint` and runs at `speed` [m/s], shape (f,), in the order of the joints' numbers.
    """
    return joint + cumulative_trapezoid(speed[start:], time[start:], initial=0.0) / link_length


def joints_below(joints: Array, masses: Array) -> Array:
    """Joint number, with fraction, of the lowest point of the chain vertically below its centre of mass, shape (f,).

    Numbers go on beyond n − 1 and below 0, so that they change little from frame to frame. Unlike the lowest joint,
    this point moves smoothly while the bottom of the loop lies flat on the floor.
    """
    places = _complex(joints)
    place = places - _centers(places, masses)
    ahead = np.roll(place, -1, axis=1)
    crosses = (place.real <= 0) != (ahead.real <= 0)
    share = np.where(crosses, -place.real / np.where(crosses, ahead.real - place.real, 1.0), 0.0)
    lowest = np.argmin(np.where(crosses, place.imag + share * (ahead.imag - place.imag), np.inf), axis=1)
    return np.unwrap(lowest + share[np.arange(len(joints)), lowest], period=joints.shape[1])


def in_room(values: Array, below: Array, points: int) -> Array:
    """Values (f, n) at so many even distances from the point of `joints_below`, half a loop to both sides, linear."""
    frames, links = values.shape
    place = below[:, None] + links * ((np.arange(points) + 0.5) / points - 0.5)
    behind = np.floor(place)
    share, row = place - behind, np.arange(frames)[:, None]
    first = behind.astype(np.intp) % links
    return (1 - share) * values[row, first] + share * values[row, (first + 1) % links]


def self_contacts(joints: Array, radius: float) -> Array:
    """Whether a joint's circles are at most `NEAR` of their diameter from those of one that is no neighbour, (f, n)."""
    touching = np.zeros(joints.shape[:2], dtype=np.bool_)
    for row, places in zip(touching, joints, strict=True):
        pairs = KDTree(places).query_pairs(2 * (1 + NEAR) * radius, output_type="ndarray")
        row[pairs[~np.isin(np.ptp(pairs, axis=1), (1, len(row) - 1))]] = True
    return touching


def impacts(time: Array, touching: Array) -> list[tuple[int, int]]:
    """First and last frame of impacts on the floor: contacts with less than `QUIET` between them."""
    frames = np.flatnonzero(touching.any(axis=1))
    parts = np.split(frames, np.flatnonzero(np.diff(time[frames]) > QUIET) + 1)
    return [(int(part[0]), int(part[-1])) for part in parts if len(part)]


def _complex(vectors: Array) -> Array:
    return vectors[..., 0] + 1j * vectors[..., 1]


def _centers(places: Array, masses: Array) -> Array:
    """Centre of mass of links that lie between joints [m], shape (f, 1)."""
    return ((places + np.roll(places, 1, axis=1)) / 2 @ masses / masses.sum())[:, None]


def _tangents(places: Array) -> Array:
    """Directions of the chain at its joints, from the joint behind to the one ahead."""
    span = np.roll(places, -1, axis=1) - np.roll(places, 1, axis=1)
    return span / np.abs(span)


def _turning(places: Array) -> float:
    """1 if the loop of the first frame runs counter-clockwise in the order of its joints, −1 if clockwise."""
    return float(np.sign(np.sum(np.conj(places[0]) * np.roll(places[0], -1)).imag))
