"""Random samples of parameters and scenes, reproducible one by one.

A sample is named by (seed, cell, sample). Its generator depends on nothing else, so neither the order nor the
number of the other samples of a sweep changes it.

What is drawn is a mapping of names to distributions, in the order of drawing. A single walk with a seed uses
`TABLE`; a sweep may state others.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Final

import numpy as np

from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import Bounds, InputError, shown, validated

CLEARANCE_RANGE: Final = (0.005, 0.015)
"""Interval of the release height that a sample draws from, in m."""

DRAW_LIMIT: Final = 1000
"""Draws of one quantity before giving up; a mean inside the bounds needs two on average at worst."""

_STANDARD: Final = NormalDist()


@dataclass(frozen=True)
class Uniform:
    """Equally likely values between two ends; what is not physical is drawn again.

    Attributes:
        lower: lower end, in the unit of the quantity.
        upper: upper end.
        bounds: the physical values.
    """

    lower: float
    upper: float
    bounds: Bounds

    def draw(self, rng: np.random.Generator) -> float:
        """One value, which need not be physical."""
        return float(rng.uniform(self.lower, self.upper))

    def share(self) -> float:
        """The share of all draws that are physical."""
        lower, upper = self._physical_ends()
        return max(0.0, upper - lower) / (self.upper - self.lower)

    def quantile(self, fraction: float) -> float:
        """The value below which the share `fraction` of the physical draws lies."""
        lower, upper = self._physical_ends()
        return lower + (upper - lower) * fraction

    def _physical_ends(self) -> tuple[float, float]:
        return max(self.lower, self.bounds.lower), min(self.upper, self.bounds.upper)

    def described(self, unit: str) -> str:
        """In words, for error messages; `unit` begins with a space unless it is empty."""
        return f"between {self.lower} and {self.upper}{unit}"


@dataclass(frozen=True)
class Gaussian:
    """A Gaussian cut off at the physical bounds; what lies outside is drawn again, never clipped.

    Attributes:
        mean: mean of the whole Gaussian, in the unit of the quantity; None stands for the value that the
            quantity has where it is drawn, see `placed`.
        sigma: standard deviation of the whole Gaussian.
        bounds: the physical values.
    """

    mean: float | None
    sigma: float
    bounds: Bounds

    def draw(self, rng: np.random.Generator) -> float:
        """One value of the whole Gaussian, which need not be physical."""
        return float(rng.normal(self._placed_mean, self.sigma))

    def share(self) -> float:
        """The share of the whole Gaussian's draws that are physical."""
        lower, upper = self._standard_ends()
        return _below(upper) - _below(lower)

    def quantile(self, fraction: float) -> float:
        """The value below which the share `fraction` (0 < fraction < 1) of the physical draws lies."""
        lower, upper = self._standard_ends()
        if lower > 0:  # by symmetry below the mean, where shares near 0 keep their digits
            return self._placed_mean - self.sigma * _between(-upper, -lower, 1.0 - fraction)
        return self._placed_mean + self.sigma * _between(lower, upper, fraction)

    @property
    def _placed_mean(self) -> float:
        if self.mean is None:
            raise ValueError("the Gaussian has no mean before `placed` gives it one")
        return self.mean

    def _standard_ends(self) -> tuple[float, float]:
        """The physical bounds in standard deviations from the mean."""
        mean = self._placed_mean
        return (self.bounds.lower - mean) / self.sigma, (self.bounds.upper - mean) / self.sigma

    def described(self, unit: str) -> str:
        """In words, for error messages; `unit` begins with a space unless it is empty."""
        return f"about {self.mean}{unit} with standard deviation {self.sigma}"


Distribution = Uniform | Gaussian


def _below(end: float) -> float:
    """The share of a standard Gaussian below `end`; erfc keeps the digits of small shares."""
    return 0.5 * math.erfc(-end / math.sqrt(2))


def _between(lower: float, upper: float, fraction: float) -> float:
    """Quantile of a standard Gaussian cut off at `lower` and `upper`."""
    first, last = _below(lower), _below(upper)
    return _STANDARD.inv_cdf(first + (last - first) * fraction)


def physical_values(name: str) -> Bounds:
    """The physical values of a quantity that can be drawn: a field of `Parameters` or a number of `Scene`."""
    quantities = Parameters.quantities()
    if name in quantities:
        return quantities[name].bounds
    lower, upper, lower_included = -math.inf, math.inf, True
    for limit in Scene.model_fields[name].metadata:
        if hasattr(limit, "ge"):
            lower = float(limit.ge)
        if hasattr(limit, "gt"):
            lower, lower_included = float(limit.gt), False
        if hasattr(limit, "le"):
            upper = float(limit.le)
        if hasattr(limit, "lt"):
            upper = math.nextafter(limit.lt, -math.inf)
    return Bounds(lower, upper, lower_included)


def _table() -> dict[str, Distribution]:
    table: dict[str, Distribution] = {
        name: Gaussian(None, quantity.sigma, quantity.bounds)
        for name, quantity in Parameters.quantities().items()
        if quantity.sigma > 0
    }
    table["phase"] = Uniform(0.0, 1.0, physical_values("phase"))
    table["clearance"] = Uniform(*CLEARANCE_RANGE, physical_values("clearance"))
    return table


TABLE: Final[Mapping[str, Distribution]] = _table()
"""What a sample draws unless told otherwise: the Gaussians of Table 1 in the order of the table, then phase and
clearance of the release."""


def placed(distributions: Mapping[str, Distribution], base: Parameters, scene: Scene) -> dict[str, Distribution]:
    """The distributions with means and bounds for one chain.

    A Gaussian without a mean gets the chain's value. A link length must leave room for its two circles.

    Args:
        distributions: name → distribution, names of fields of `Parameters` or `Scene`.
        base: the chain's parameters.
        scene: the chain's scene.
    """
    complete = {}
    for name, distribution in distributions.items():
        if isinstance(distribution, Gaussian) and distribution.mean is None:
            model = base if name in Parameters.model_fields else scene
            distribution = replace(distribution, mean=float(getattr(model, name)))
        if name == "link_length" and "circle_radius" not in distributions:
            room = Bounds(2 * base.circle_radius, lower_included=False)
            distribution = replace(distribution, bounds=room)
        complete[name] = distribution
    return complete


def draw(distributions: Mapping[str, Distribution], rng: np.random.Generator) -> dict[str, float]:
    """One value of each distribution, in their order; one outside its bounds is drawn again.

    Args:
        distributions: name → distribution, see `placed`.
        rng: the stream to draw from, see `random_generator`.

    Raises:
        InputError: a quantity had no physical draw.
    """
    return {name: _physical_draw(name, distribution, rng) for name, distribution in distributions.items()}


def _physical_draw(name: str, distribution: Distribution, rng: np.random.Generator) -> float:
    for _ in range(DRAW_LIMIT):
        value = distribution.draw(rng)
        if distribution.bounds.admit(value):
            return value
    quantity = Parameters.quantities().get(name)
    section, unit = ("parameters", f" {quantity.unit}") if quantity else ("scene", "")
    raise InputError(
        f"{section}.{name}: {DRAW_LIMIT} draws {distribution.described(unit)} were all outside the physical "
        "bounds; give a mean inside them"
    )


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
    gaussians = {name: TABLE[name] for name in TABLE if name in Parameters.model_fields}
    return base.with_values(draw(placed(gaussians, base, Scene()), rng))


def sample_scene(base: Scene, rng: np.random.Generator) -> Scene:
    """Draw the moment and the height of the release.

    First the phase, uniform in [0, 1) of a loop period; then the clearance, uniform in `CLEARANCE_RANGE`.

    Args:
        base: scene whose other fields are taken over.
        rng: the stream to draw from, see `random_generator`.
    """
    release = {name: TABLE[name] for name in TABLE if name in Scene.model_fields}
    return validated(Scene, {**base.model_dump(), **draw(release, rng)}, "scene")
