"""Random samples of parameters and scenes, reproducible one by one.

The generator of a sample depends on (seed, cell, sample) only, so neither the order nor the number of the other
samples of a sweep changes it.

What is drawn is a mapping of names to distributions, in the order of drawing. A single walk with a seed uses
`TABLE`; a sweep may state others.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import NormalDist
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from warpchain.inputs.arrays import Array
from warpchain.inputs.fields import FIELDS, SECTION_OF
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import InputError, Whole, field_bounds

DRAW_LIMIT: Final = 1000
"""Draws of one quantity before giving up; a mean inside the bounds needs two on average at worst."""

Seed = Annotated[Whole, Field(ge=0, le=2**128 - 1)]
"""A greater one could repeat the stream of another."""

DRAWABLE: Final = (
    *Parameters.model_fields,
    *(name for name, field in Scene.model_fields.items() if field.annotation is float),
)
"""Quantities that can have a distribution, in the order of drawing."""


@dataclass(frozen=True)
class Uniform:
    """Equally likely values between two ends; a value outside the physical bounds is drawn again."""

    lower: float
    upper: float
    bounds: tuple[float, float]
    standard: ClassVar = "random"

    @property
    def line(self) -> tuple[float, float]:
        """The value for a standard draw of 0, and how much more it is for one of 1."""
        return self.lower, self.upper - self.lower

    def share(self) -> float:
        """The share of all draws that are physical."""
        lower, upper = self._physical_ends()
        return max(0.0, upper - lower) / (self.upper - self.lower)

    def quantile(self, fraction: float) -> float:
        """The value below which the share `fraction` of the physical draws lies."""
        lower, upper = self._physical_ends()
        return lower + (upper - lower) * fraction

    def expected(self) -> float:
        """Mean of the physical draws."""
        return self.quantile(0.5)

    def _physical_ends(self) -> tuple[float, float]:
        return max(self.lower, self.bounds[0]), min(self.upper, self.bounds[1])

    def canonical(self) -> dict[str, object]:
        """Its form in a sweep file."""
        return {"uniform": [self.lower, self.upper]}


@dataclass(frozen=True)
class Gaussian:
    """A Gaussian truncated at the physical bounds; a value outside is drawn again, never clipped.

    Mean and standard deviation are those of the whole Gaussian; a mean of None is the chain's own value, which
    `Setup.placed` gives it.
    """

    mean: float | None
    sigma: float
    bounds: tuple[float, float]
    standard: ClassVar = "standard_normal"

    @property
    def line(self) -> tuple[float, float]:
        """Mean and standard deviation."""
        return self._placed_mean, self.sigma

    def share(self) -> float:
        """The share of the whole Gaussian's draws that are physical."""
        lower, upper = self._standard_ends()
        return _below(upper) - _below(lower)

    def quantile(self, fraction: float) -> float:
        """The value below which the share `fraction` (0 < fraction < 1) of the physical draws lies."""
        lower, upper = self._standard_ends()
        scale = self.sigma
        if lower > 0:  # by symmetry below the mean, where shares near 0 keep their digits
            lower, upper, fraction, scale = -upper, -lower, 1.0 - fraction, -scale
        first, last = _below(lower), _below(upper)
        return self._placed_mean + scale * NormalDist().inv_cdf(first + (last - first) * fraction)

    def expected(self) -> float:
        """Mean of the physical draws."""
        lower, upper = self._standard_ends()
        heights = [math.exp(-end * end / 2) / math.sqrt(2 * math.pi) for end in (lower, upper)]
        return self._placed_mean + self.sigma * (heights[0] - heights[1]) / self.share()

    @property
    def _placed_mean(self) -> float:
        if self.mean is None:
            raise ValueError("the Gaussian has no mean before `Setup.placed` gives it one")
        return self.mean

    def _standard_ends(self) -> tuple[float, float]:
        """The physical bounds in standard deviations from the mean."""
        least, most = self.bounds
        return (least - self._placed_mean) / self.sigma, (most - self._placed_mean) / self.sigma

    def canonical(self) -> dict[str, object]:
        """Its form in a sweep file."""
        mean = {} if self.mean is None else {"mean": self.mean}
        return {"gaussian": {**mean, "sigma": self.sigma}}


Distribution = Uniform | Gaussian


def _below(end: float) -> float:
    """The share of a standard Gaussian below `end`; erfc keeps the digits of small shares."""
    return 0.5 * math.erfc(-end / math.sqrt(2))


TABLE: Final[Mapping[str, Distribution]] = {
    **{
        name: Gaussian(None, q.sigma, field_bounds(FIELDS[name]))
        for name, q in Parameters.quantities().items()
        if q.sigma
    },
    "phase": Uniform(0.0, 1.0, field_bounds(FIELDS["phase"])),
    "clearance": Uniform(0.005, 0.015, field_bounds(FIELDS["clearance"])),  # m
}
"""Default of what a sample draws: the Gaussians of Table 1 in the order of the table, then phase and clearance of the
release."""


def draw(distributions: Mapping[str, Distribution], rng: Generator) -> dict[str, float]:
    """A value of each of the `placed` distributions, in order, redrawn until in bounds; an `InputError` if none is."""
    drawn = {}
    for name, distribution in distributions.items():
        (least, most), (start, scale) = distribution.bounds, distribution.line
        for _ in range(DRAW_LIMIT):
            value: float = start + scale * getattr(rng, distribution.standard)()
            if least <= value <= most:
                drawn[name] = value
                break
        else:
            path, law = f"{SECTION_OF[name]}.{name}", distribution.canonical()
            raise InputError(
                f"{path}: {DRAW_LIMIT} samples of {law} were all out of bounds; use a mean within the bounds"
            )
    return drawn


def first_draws(
    distributions: Sequence[Mapping[str, Distribution]], generators: Iterable[Generator]
) -> tuple[Array, NDArray[np.bool_]]:
    """What `draw` gives for each of w samples if nothing is drawn twice, (w, q), and of which that is true, (w,).

    All samples draw the same q quantities from distributions of the same kinds, each from a generator of its own.
    """
    different = {id(each): each for each in distributions}
    tables = {key: np.array([law.line + law.bounds for law in each.values()]) for key, each in different.items()}
    start, scale, least, most = np.moveaxis(np.stack([tables[id(each)] for each in distributions]), -1, 0)
    kinds = [(kind, len([*laws])) for kind, laws in groupby(law.standard for law in distributions[0].values())]
    drawn = np.empty_like(start)
    for row, rng in zip(drawn, generators, strict=True):
        first = 0
        for kind, count in kinds:
            getattr(rng, kind)(out=row[first : first + count])
            first += count
    drawn = start + scale * drawn
    return drawn, ((least <= drawn) & (drawn <= most)).all(-1)


def random_generator(seed: int, cell: int = 0, sample: int = 0, *more: int) -> Generator:
    """The random generator of one sample, given the sweep's seed, the number of its cell, and its own in there."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(cell, sample, *more)))
