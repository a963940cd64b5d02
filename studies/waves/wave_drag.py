"""A drag on the waves of a free loop that leaves its momenta and its run along itself.

A loop that runs along itself, however fast, has no velocity across its path, seen from its centre of mass. A wave has:
it moves the path; the fast one of both directions twice as fast as in the frame of the links, the slow one hardly. So a
drag on the velocity across the path takes the fast wave. It is an experiment, no physics of the chain: with it one asks
whether the waves matter for how far a chain walks.
"""

import numpy as np
from numpy.typing import ArrayLike

from studies.common import Array
from warpchain import Chains, Parameters, Status

TWELFTH = 1.0 / 12.0
"""A link is a chord: its direction is that of the path at its middle less this share of the second difference of θ."""

RUNNING = [0, 1, 3]  # Motions of `loop_motions` that leave the path in its shape and direction
RIGID = [0, 1, 2]  # Motions of `loop_motions` that hold momentum and angular momentum


def inertia_of(links: int, parameters: Parameters) -> Array:
    """Mass, mass [kg] and moment of inertia [kg m²] of each link, (n, 3)."""
    inner, outer = (parameters.inner_mass, parameters.inner_inertia), (parameters.outer_mass, parameters.outer_inertia)
    return np.tile([[mass, mass, inertia] for mass, inertia in (inner, outer)], (links // 2, 1))


def distances(chains: Chains, inertia: Array) -> Array:
    """Δx [m] of chains, NaN of one that did not come to rest; `inertia` (W, n, 3) as of `wave_motion`."""
    dx = np.average(chains.motions()[0][..., 0], axis=1, weights=inertia[..., 0])
    return np.where(chains.status == Status.AT_REST, dx, np.nan)


def lowest(position: Array, link_length: ArrayLike) -> Array:
    """Height [m] of the lowest joint of loops (…, n, 3) of links of such length [m], (…)."""
    half = 0.5 * np.expand_dims(link_length, -1) * np.abs(np.sin(position[..., 2]))
    return np.min(position[..., 1] - half, axis=-1)


def loop_motions(position: Array, link_length: Array) -> tuple[Array, Array]:
    """Motions of W loops of n links that are no waves, (W, 4, n, 3), and the normals of their paths, (W, n, 2).

    Position is x, y [m], θ [rad] of each link's centre, (W, n, 3). Motions are velocities x, y and the angular velocity
    of each link in a translation along x and along y, a rotation about the origin at 1 rad/s, and a run along the path
    at 1 m/s towards links of higher number.
    """
    x, y, angle = np.moveaxis(position, -1, 0)
    ahead = _wrapped(np.roll(angle, -1, axis=1) - angle)
    behind = _wrapped(angle - np.roll(angle, 1, axis=1))
    direction = angle - TWELFTH * (ahead - behind)
    along = np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    normal = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    one, zero = np.ones_like(x), np.zeros_like(x)
    turning = (ahead + behind) / (2 * link_length[:, None])
    motions = [(one, zero, zero), (zero, one, zero), (-y, x, one), (along[..., 0], along[..., 1], turning)]
    return np.stack([np.stack(motion, axis=-1) for motion in motions], axis=1), normal


def wave_motion(motions: Array, velocity: Array, inertia: Array) -> tuple[Array, Array]:
    """Velocities (W, n, 3) taken apart: amounts of some of `loop_motions`, (W, j), and what is none of them, (W, n, 3).

    Amounts are those nearest in kinetic energy; `inertia` is mass, mass [kg] and moment of inertia [kg m²], (W, n, 3).
    """
    weighted = motions * inertia[:, None]
    squares = np.einsum("wjnc,wknc->wjk", weighted, motions, optimize=True)
    products = np.einsum("wjnc,wnc->wj", weighted, velocity, optimize=True)
    amounts = np.linalg.solve(squares, products[..., None])[..., 0]
    return amounts, velocity - np.einsum("wj,wjnc->wnc", amounts, motions, optimize=True)


def drag_waves(
    position: Array, velocity: Array, inertia: Array, link_length: Array, share: Array, least_mode: Array
) -> tuple[Array, Array, Array]:
    """Take a share (W,) of the waves out of the velocities (W, n, 3) of loops, but for those with fewer crests.

    Momentum and angular momentum stay, and very nearly the speed along the path. What goes is the velocity across the
    path, as seen from the centre of mass, with the rotation of the links that belongs to it.

    Returns the new velocities; the kinetic energy of all velocities across the path [J], (W,), before; and the speed
    along the path [m/s], (W,).
    """
    motions, normal = loop_motions(position, link_length)
    amounts, rest = wave_motion(motions[:, RUNNING], velocity, inertia)
    across = np.einsum("wnc,wnc->wn", rest[..., :2], normal)
    energy = 0.5 * np.einsum("wn,wn,wn->w", inertia[..., 0], across, across)
    modes = np.fft.rfft(across, axis=1)
    modes[np.arange(modes.shape[1]) < least_mode[:, None]] = 0.0
    taken = share[:, None] * np.fft.irfft(modes, across.shape[1], axis=1)
    turning = (np.roll(taken, -1, axis=1) - np.roll(taken, 1, axis=1)) / (2 * link_length[:, None])
    change = -np.concatenate([taken[..., None] * normal, turning[..., None]], axis=-1)
    _, change = wave_motion(motions[:, RIGID], change, inertia)
    return velocity + change, energy, amounts[:, -1]


def _wrapped(angle: Array) -> Array:
    """Angles [rad] within half a turn of zero."""
    return angle - 2 * np.pi * np.round(angle / (2 * np.pi))
