"""Motions of chains by formula, and banks of them: nothing is simulated."""

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


def made_bank(chains: int, seed: int, repetitions: int = 4) -> films.Bank:
    """Chains with drawn friction, radius (which outline and speed show) and restitution (which nothing shows)."""
    random = np.random.default_rng(seed)
    values = np.column_stack(
        [
            random.normal(0.27, 0.05, chains),
            random.normal(0.056, 0.0015, chains),
            random.normal(0.05, 0.01, chains),
        ]
    )
    walks = [[motion(friction, random.uniform(0.006, 0.014)) for _ in range(repetitions)] for friction, *_ in values]
    wider = values[:, None, 1] - 0.056 + random.normal(size=(chains, repetitions)) * 1e-4
    edges = np.array([[film.outline for film in row] for row in walks], float)
    return films.Bank(
        names=np.array(["floor_friction", "sprocket_radius", "floor_restitution"]),
        values=values,
        experiments=np.array([[60.0, 20.0]]),
        time=TIME,
        center=np.array([[film.center for film in row] for row in walks])[:, None],
        outline=(edges + wider[..., None] * np.array([-1, 1, 0, 2]))[:, None],
        speed=np.repeat(40 * np.pi * (values[:, 1] + 0.004)[:, None], repetitions, axis=1)[:, None],
    )


def films_of(bank: films.Bank, chain: int, count: int, camera: films.Camera, seed: int) -> list[films.Film]:
    """Films of a chain by one camera, whose errors they share."""
    random = np.random.default_rng(seed)
    errors = camera.errors(random)
    return [bank.film(chain, 0, number).seen(camera, errors, random) for number in range(count)]
