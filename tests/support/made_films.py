"""Motions of chains by formula, and banks of them: nothing is simulated."""

from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from warpchain import films

Array = NDArray[np.float64]

TIME = np.arange(0.0, 0.45, 0.004)
GRAVITY = 9.809


def motion(friction: float, clearance: float = 0.01, stiffness: float = 1.0, frequency: float = 20.0) -> films.Film:
    """A film without errors: a free fall from a clearance, then a lift and, by Coulomb's law, μ times as much way.

    The sprocket's surface, and so the speed of the loop, is that of a radius of 6 cm; the outline is a box.
    """
    on_floor = np.maximum(TIME - np.sqrt(2 * clearance / GRAVITY), 0)
    lift = stiffness * (4 * on_floor**2 + 3e-4 * np.sin(60 * on_floor) ** 2)
    center = np.column_stack([friction * lift - 0.01, 0.17 + clearance - GRAVITY * TIME**2 / 2 + lift])
    outline = np.array([-0.06, 0.06, clearance + 0.004, clearance + 0.34])
    return films.Film(
        time=TIME, center=center, links=60, frequency=frequency, outline=outline, speed=0.12 * np.pi * frequency
    )


def made_bank(
    chains: int, seed: int, repetitions: int = 4, experiments: tuple[tuple[int, float], ...] = ((60, 20.0),)
) -> films.Bank:
    """Chains with drawn friction, radius (which outline and speed show) and restitution (which nothing shows)."""
    random = np.random.default_rng(seed)
    normal = [NormalDist().inv_cdf((number + 0.5) / chains) for number in range(chains)]  # so that few are enough
    drawn = np.column_stack([random.permutation(normal) for _ in range(3)])
    values = np.array([0.27, 0.056, 0.05]) + np.array([0.05, 0.0015, 0.01]) * drawn
    shape = (chains, len(experiments), repetitions)
    center, outline, speed = np.empty((*shape, len(TIME), 2)), np.empty((*shape, 4)), np.empty(shape)
    for chain, at, number in np.ndindex(shape):
        film = motion(values[chain, 0], random.uniform(0.006, 0.014), frequency=experiments[at][1])
        wider = values[chain, 1] - 0.056 + random.normal() * 1e-4
        center[chain, at, number] = film.center
        outline[chain, at, number] = film.outline + wider * np.array([-1, 1, 0, 2])
        speed[chain, at, number] = 2 * np.pi * experiments[at][1] * (values[chain, 1] + 0.004)
    return films.Bank(
        names=np.array(["floor_friction", "sprocket_radius", "floor_restitution"]),
        values=values,
        experiments=np.array(experiments, float),
        time=TIME,
        center=center,
        outline=outline,
        speed=speed,
    )


def films_of(bank: films.Bank, chain: int, count: int, camera: films.Camera, seed: int) -> list[films.Film]:
    """Films of a chain by one camera, whose errors they share."""
    random = np.random.default_rng(seed)
    errors = camera.errors(random)
    return [bank.film(chain, 0, number).seen(camera, errors, random) for number in range(count)]
