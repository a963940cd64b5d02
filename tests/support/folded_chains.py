"""Folded chains whose joints are all but closed, as contacts meet them in a pile, and heaps of torn ones."""

import numpy as np

from tests.support.arrays import Array


def chain_of_angles(angle: Array, link_length: float) -> Array:
    """A chain whose links have the given angles (n,), laid end to end from the origin: position (n, 3).

    It is closed if the unit vectors of the angles add up to zero.
    """
    step = link_length * np.column_stack([np.cos(angle), np.sin(angle)])
    right = np.cumsum(step, axis=0)
    return np.column_stack([right - step / 2, angle])


def folded_angles(n: int, generator: np.random.Generator, tilt: float = np.pi) -> Array:
    """Angles (n,) of a closed chain of an even number of links, folded at random: each occurs with its opposite.

    No link stands steeper than `tilt` [rad]; a small one makes a flat pile.
    """
    half = generator.uniform(-tilt, tilt, n // 2)
    return generator.permutation(np.concatenate([half, half + np.pi]))


def folded_chain(
    n: int, seed: int, link_length: float, *, tilt: float = np.pi, opening: float = 2e-4
) -> tuple[Array, Array]:
    """A chain that is folded at random, see `folded_angles`, and moves at random: position and velocity (n, 3).

    It is centred on the origin, so that a floor at y = 0 and a sprocket about it cut it, and moves at about 1 m/s.
    Links are displaced by `opening` [m] in x and in y, standard deviations.
    """
    generator = np.random.default_rng(seed)
    position = chain_of_angles(folded_angles(n, generator, tilt), link_length)
    position[:, :2] -= position[:, :2].mean(axis=0)
    position[:, :2] += generator.normal(size=(n, 2)) * opening
    return position, generator.normal(size=(n, 3)) * [1.0, 1.0, 2 / link_length]


def crumpled_chain(n: int, seed: int, link_length: float, size: float) -> tuple[Array, Array]:
    """A heap of n links thrown at random, joints torn open: position and velocity (n, 3) of the order of 1 m/s.

    Their centres lie in a box about the origin, through which a floor at y = 0 cuts; its half width is `size` links.
    """
    generator = np.random.default_rng(seed)
    position = generator.uniform(-1, 1, (n, 3)) * [size * link_length, size * link_length, np.pi]
    return position, generator.normal(size=(n, 3)) * [1.0, 1.0, 2 / link_length]
