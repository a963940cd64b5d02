"""Crumpled chains whose joints are all but closed, as contacts and the broad phase meet them in a pile."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def chain_of_angles(angle: Array, link_length: float) -> Array:
    """A chain whose links have the given angles (n,), laid end to end from the origin: position (n, 3).

    It is closed if the unit vectors of the angles add up to zero.
    """
    step = link_length * np.column_stack([np.cos(angle), np.sin(angle)])
    right = np.cumsum(step, axis=0)
    return np.column_stack([right - step / 2, angle])


def folded_angles(n: int, generator: np.random.Generator, tilt: float = np.pi) -> Array:
    """Angles (n,) of a closed chain that is folded at random: each angle occurs with its opposite.

    Args:
        n: number of links, even.
        generator: random numbers.
        tilt: greatest angle of a link against the horizontal, in rad; a small one makes a flat pile.
    """
    half = generator.uniform(-tilt, tilt, n // 2)
    return generator.permutation(np.concatenate([half, half + np.pi]))


def folded_chain(
    n: int, seed: int, link_length: float, *, tilt: float = np.pi, opening: float = 2e-4
) -> tuple[Array, Array]:
    """A chain that is folded at random and moves at random.

    Args:
        n: number of links, even.
        seed: of the random numbers.
        link_length: in m.
        tilt: see `folded_angles`.
        opening: standard deviation of the links' displacements in x and in y, in m.

    Returns:
        position (n, 3), centred on the origin, so that a floor at y = 0 and a sprocket about it cut the chain;
        velocity (n, 3): speeds of about 1 m/s.
    """
    generator = np.random.default_rng(seed)
    position = chain_of_angles(folded_angles(n, generator, tilt), link_length)
    position[:, :2] -= position[:, :2].mean(axis=0)
    position[:, :2] += generator.normal(size=(n, 2)) * opening
    return position, generator.normal(size=(n, 3)) * [1.0, 1.0, 2 / link_length]
