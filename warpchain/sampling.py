"""Random samples of parameters and scenes, reproducible one by one.

A sample is named by (seed, cell, sample). Its generator depends on nothing else, so neither the order nor the
number of the other samples of a sweep changes it.
"""

from typing import Final

import numpy as np

from warpchain.options import Scene
from warpchain.parameters import InputError, Parameters, Quantity, circles_fit, shown, validated

CLEARANCE_RANGE: Final = (0.005, 0.015)
"""Interval of the release height that a sample draws from, in m."""

DRAW_LIMIT: Final = 1000
"""Draws of one quantity before giving up; a mean inside the bounds needs two on average at worst."""


def random_generator(seed: int, cell: int = 0, sample: int = 0) -> np.random.Generator:
    """The random generator of one sample.

    Args:
        seed: seed of the sweep, 0 … 2¹²⁸ − 1.
        cell: index of the sweep's cell (one combination of values), 0 … 2³² − 1.
        sample: index of the sample in its cell, 0 … 2³² − 1.

    Raises:
        InputError: a number is no integer or out of range; a larger one could repeat another sample's stream.
    """
    for name, number, bits in (("seed", seed, 128), ("cell", cell, 32), ("sample", sample, 32)):
        if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < 2**bits:
            raise InputError(f"{name}: {shown(number)} is no whole number from 0 to 2**{bits} - 1; give one")
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(cell, sample)))


def sample_parameters(base: Parameters, rng: np.random.Generator) -> Parameters:
    """Draw every quantity that has an uncertainty from a truncated Gaussian.

    The mean is the value in `base` and the standard deviation that of Table 1. The quantities are drawn in
    the order of the table (the order of the fields of `Parameters`). A draw outside the physical bounds, or a
    link length that leaves no room for its two circles, is drawn again from the same stream.

    Args:
        base: mean values; quantities without an uncertainty are taken over as they are.
        rng: the stream to draw from, see `random_generator`.

    Raises:
        InputError: no draw was physical, which only a `base` that is itself unphysical can cause.
    """
    return base.with_values(
        {
            name: _draw(name, quantity, base, rng)
            for name, quantity in Parameters.quantities().items()
            if quantity.sigma > 0
        }
    )


def sample_scene(base: Scene, rng: np.random.Generator) -> Scene:
    """Draw the moment and the height of the release.

    First the phase, uniform in [0, 1) of a loop period; then the clearance, uniform in `CLEARANCE_RANGE`.

    Args:
        base: scene whose other fields are taken over.
        rng: the stream to draw from, see `random_generator`.
    """
    drawn = {"phase": rng.random(), "clearance": rng.uniform(*CLEARANCE_RANGE)}
    return validated(Scene, {**base.model_dump(), **drawn}, "scene")


def _draw(name: str, quantity: Quantity, base: Parameters, rng: np.random.Generator) -> float:
    """One physical draw of a quantity, in its unit."""
    mean = float(getattr(base, name))
    for _ in range(DRAW_LIMIT):
        value = float(rng.normal(mean, quantity.sigma))
        fits = name != "link_length" or circles_fit(value, base.circle_radius)
        if quantity.bounds.admit(value) and fits:
            return value
    raise InputError(
        f"parameters.{name}: {DRAW_LIMIT} draws about {mean} {quantity.unit} with standard deviation "
        f"{quantity.sigma} were all outside the physical bounds; give a mean inside them"
    )
