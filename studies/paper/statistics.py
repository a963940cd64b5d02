"""Differences of mean distances between cells of a sweep, with their errors.

A cell is a number of links and a frequency. Values have the shape (..., samples). Walks that did not come to rest are
NaN and take no part; what they leave is counted.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import t

from studies.common import OverCells, over_cells

Array = NDArray[np.float64]

CONFIDENCE: Final = 0.95
"""Confidence level of every test and interval."""


@dataclass(frozen=True)
class Effect:
    """What a change does to the mean of a quantity, cell by cell; every array has the shape of the cells.

    Attributes:
        relative: mean after the change over that before it, less 1; NaN without two walks to compare.
        half_width: half of the 95 % interval of `relative`; NaN likewise.
        sign: 1 if the mean rises and −1 if it falls, at 95 %; 0 if neither can be said.
        pairs: number of pairs of walks; of two independent samples the smaller number of walks.
        lost: walks or pairs left out, because a walk did not come to rest.
    """

    relative: Array
    half_width: Array
    sign: NDArray[np.int64]
    pairs: NDArray[np.int64]
    lost: int

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "Effect":
        """The effect that `plain` wrote, with its numbers rounded; null stands for NaN."""
        arrays = {name: np.array(content[name], np.float64) for name in ("relative", "half_width")}
        arrays |= {name: np.array(content[name], np.int64) for name in ("sign", "pairs")}
        return cls(**arrays, lost=int(content["lost"]))

    def __getitem__(self, rows: Any) -> "Effect":
        """The effect in some of the cells."""
        return Effect(self.relative[rows], self.half_width[rows], self.sign[rows], self.pairs[rows], self.lost)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Cells that have an interval."""
        return np.isfinite(self.relative) & np.isfinite(self.half_width)

    @cached_property
    def cells(self) -> OverCells:
        """All cells that could be compared together; the interval of their mean says nothing of other cells."""
        return over_cells(self.relative, standard_error(self))

    @property
    def count(self) -> int:
        """Number of cells that could be compared."""
        return len(self.cells)

    @property
    def mean(self) -> float:
        """Mean of the relative effects of the cells."""
        return self.cells.mean

    @property
    def width(self) -> float:
        """Half of its 95 % interval, from the errors of the cells."""
        return 1.96 * self.cells.error

    @property
    def rises(self) -> int:
        """Number of cells with a significant rise."""
        return int((self.sign[self.known] > 0).sum())

    @property
    def falls(self) -> int:
        """Number of cells with a significant fall."""
        return int((self.sign[self.known] < 0).sum())


def paired(values: ArrayLike, reference: ArrayLike) -> Effect:
    """Compare the same samples after and before a change, `reference`.

    The sign is that of a t test of the mean difference; the interval of the ratio of the means follows from its
    linearisation.
    """
    values, reference = np.asarray(values), np.asarray(reference)
    both = np.isfinite(values) & np.isfinite(reference)
    pairs = both.sum(axis=-1)
    after, before = (mean(np.where(both, each, np.nan)) for each in (values, reference))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = after / before
        error = _standard_error(np.where(both, values - reference, np.nan))
        left = np.where(both, values - ratio[..., np.newaxis] * reference, np.nan)
        ratio_error = _standard_error(left) / np.abs(before)
    return _effect(after - before, error, ratio, ratio_error, pairs - 1, pairs, int((~both).sum()))


def unpaired(values: ArrayLike, reference: ArrayLike) -> Effect:
    """Compare independent samples by Welch's t test."""
    both = np.asarray(values), np.asarray(reference)
    (after, before), counts = map(mean, both), [np.isfinite(each).sum(axis=-1) for each in both]
    (after_error, before_error), pairs = map(_standard_error, both), np.minimum(*counts)
    with np.errstate(invalid="ignore", divide="ignore"):
        error = np.hypot(after_error, before_error)
        freedom = error**4 / (after_error**4 / (counts[0] - 1) + before_error**4 / (counts[1] - 1))
        ratio = after / before
        ratio_error = np.hypot(after_error, ratio * before_error) / np.abs(before)
    freedom = np.where(error == 0, pairs - 1.0, freedom)
    lost = sum(int((~np.isfinite(each)).sum()) for each in both)
    return _effect(after - before, error, ratio, ratio_error, freedom, pairs, lost)


def _effect(
    change: Array, error: Array, ratio: Array, ratio_error: Array, freedom: Any, pairs: NDArray[np.int64], lost: int
) -> Effect:
    """An effect from a change and a ratio of means with their standard errors."""
    factor = _factor(freedom)
    with np.errstate(invalid="ignore"):
        sign = np.where(np.abs(change) > factor * error, np.sign(np.nan_to_num(change)), 0).astype(np.int64)
    return Effect(np.where(pairs > 1, ratio - 1, np.nan), factor * ratio_error, sign, pairs, lost)


def standard_error(effect: Effect) -> Array:
    """Standard errors of the relative effects of paired comparisons."""
    return effect.half_width / _factor(effect.pairs - 1)


def exceeding(effect: Effect, bound: float) -> int:
    """Number of cells whose effect is greater than a bound, up or down, with its whole interval."""
    known = effect.known
    return int((np.abs(effect.relative[known]) - effect.half_width[known] > bound).sum())


def within(effect: Effect, bound: float) -> int:
    """Number of cells whose effect is within a bound, up and down, with its whole interval."""
    known = effect.known
    return int((np.abs(effect.relative[known]) + effect.half_width[known] <= bound).sum())


def mean(values: ArrayLike) -> Array:
    """Mean over the samples of each cell, shape (...,); NaN without a walk."""
    values = np.asarray(values)
    there = np.isfinite(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        means: Array = np.where(there, values, 0.0).sum(axis=-1) / there.sum(axis=-1)
    return means


def spread(values: ArrayLike) -> Array:
    """Standard deviation of a walk over the mean of its cell, shape (...,); NaN with fewer than two walks."""
    values = np.asarray(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        relative: Array = _standard_error(values) * np.sqrt(np.isfinite(values).sum(axis=-1)) / mean(values)
    return relative


def _standard_error(values: Array) -> Array:
    """Standard error of the mean of the values that are there; NaN with fewer than two."""
    there = np.isfinite(values)
    count = there.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        deviation = np.where(there, np.where(there, values, 0.0) - mean(values)[..., np.newaxis], 0.0)
        error: Array = np.sqrt((deviation**2).sum(axis=-1) / (count - 1) / count)
    return np.where(count > 1, error, np.nan)


def _factor(freedom: Any) -> Array:
    """Half-width of a 95 % interval over the standard error; NaN without a degree of freedom."""
    return t.ppf((1 + CONFIDENCE) / 2, np.where(np.asarray(freedom) > 0, freedom, np.nan))
