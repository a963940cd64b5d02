"""Chains in tilted planes: loops in flight, heaps that a floor cuts through, and mirror images."""

from dataclasses import replace

import numpy as np

from tests.oracle_model.circular_loop import circular_loop
from tests.oracle_model.tilting_plane import Plane, tilted_plane
from tests.support.arrays import Array
from tests.support.folded_chains import crumpled_chain
from warpchain.inputs.parameters import Parameters


def tumbling_loop(n: int, parameters: Parameters, seed: int) -> tuple[Array, Array, Plane]:
    """A disturbed circular loop at 2 m/s in the air whose plane has any attitude and turns fast: all terms matter.

    Returns position (n, 3), velocity (n, 3) and plane.
    """
    generator = np.random.default_rng(seed)
    position, velocity = circular_loop(n, parameters, 2.0)
    position[:, :2] += generator.normal(size=2) * 0.05
    position += generator.normal(size=(n, 3)) * [2e-6, 2e-6, 2e-4]
    velocity += generator.normal(size=(n, 3)) * [0.02, 0.02, 3.0] + [*generator.normal(size=2), 0.0]
    plane = tilted_plane(
        generator.uniform(-1.5, 1.5),
        generator.uniform(-np.pi, np.pi),
        speed=generator.normal(),
        turn=generator.normal(size=2) * 20,
        origin=generator.normal(size=3) * 0.3 + [0.0, 3.0, 0.0],
    )
    return position, velocity, plane


def tilted_heap(seed: int, parameters: Parameters) -> tuple[Array, Array, Plane, Parameters, float]:
    """A heap of links thrown at random in a random plane that the floor cuts through, for contact passes only.

    Every third heap lies almost or exactly flat, every third stands almost upright. Returns position (n, 3), velocity
    (n, 3), plane, parameters with coefficients of collision drawn anew, and half width h [m].
    """
    generator = np.random.default_rng(seed)
    n = int(generator.choice([4, 6, 8, 12]))
    size = generator.uniform(0.5, 3.0)
    position, velocity = crumpled_chain(n, int(generator.integers(2**32)), parameters.link_length, size)
    near = float(generator.choice([0.0, 1e-14, 1e-6, 0.05]))
    tilt = (generator.uniform(-1.57, 1.57), near, np.pi / 2 - near)[seed % 3] * generator.choice([-1, 1])
    reach = size * parameters.link_length * abs(np.cos(tilt)) + parameters.circle_radius
    plane = tilted_plane(
        tilt,
        generator.uniform(-np.pi, np.pi),
        speed=generator.normal(),
        turn=generator.normal(size=2) * 20,
        origin=[generator.normal(), generator.uniform(-0.5, 0.5) * reach, generator.normal()],
    )
    coefficients = {
        "floor_restitution": float(generator.choice([0.0, 1.0, generator.uniform()])),
        "floor_friction": float(generator.choice([0.0, 1.0, generator.uniform()])),
        "tangential_restitution": float(generator.choice([-1.0, 0.0, 1.0, generator.uniform(-1, 1)])),
    }
    half_width = float(generator.choice([0.0, 4e-3, 2e-2]))
    return position, velocity, plane, parameters.with_values(coefficients), half_width


def mirrored(plane: Plane) -> Plane:
    """Mirror image at the room's X̂Ŷ plane, of a plane whose chain keeps its x, y, θ and their rates."""
    mirror = np.array([1.0, 1.0, -1.0])
    return replace(
        plane,
        speed=-plane.speed,
        turn=-plane.turn,
        x=mirror * plane.x,
        y=mirror * plane.y,
        origin=mirror * plane.origin,
    )
