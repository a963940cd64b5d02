"""Differences of mean distances between cells of a sweep, with their errors.

A cell is a number of links and a frequency. Values have the shape (..., samples). Walks that did not come to rest are
NaN and take no part; what they leave is counted.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

Array = NDArray[np.float64]

CONFIDENCE: Final = 0.95
"""Confidence level of every test and interval."""

_TAIL: Final = (1 + CONFIDENCE) / 2


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

    @property
    def known(self) -> NDArray[np.bool_]:
        """Cells that have an interval."""
        return np.isfinite(self.relative) & np.isfinite(self.half_width)


@dataclass(frozen=True)
class Summary:
    """An effect over all cells.

    Attributes:
        cells: number of cells that could be compared.
        rises: number of cells with a significant rise.
        falls: number of cells with a significant fall.
        mean: mean of the relative effects of the cells.
        half_width: half of its 95 % interval, from the errors of the cells.
        typical: root mean square of the relative effects without what their errors contribute.
    """

    cells: int
    rises: int
    falls: int
    mean: float
    half_width: float
    typical: float


def paired(values: Array, reference: Array) -> Effect:
    """Compare the same samples after and before a change, `reference`.

    The sign is that of a t test of the mean difference; the interval of the ratio of the means follows from its
    linearisation.
    """
    both = np.isfinite(values) & np.isfinite(reference)
    pairs = both.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        after, before = (np.where(both, each, 0.0).sum(axis=-1) / pairs for each in (values, reference))
        ratio = after / before
        error = _standard_error(values - reference, both)
        ratio_error = _standard_error(values - ratio[..., np.newaxis] * reference, both) / np.abs(before)
    factor = _factor(pairs - 1)
    return Effect(
        relative=np.where(pairs > 1, ratio - 1, np.nan),
        half_width=factor * ratio_error,
        sign=_sign(after - before, factor * error),
        pairs=pairs,
        lost=int((~both).sum()),
    )


def unpaired(values: Array, reference: Array) -> Effect:
    """Compare independent samples by Welch's t test."""
    parts = []
    with np.errstate(invalid="ignore", divide="ignore"):
        for each in (values, reference):
            there = np.isfinite(each)
            count = there.sum(axis=-1)
            parts.append((np.where(there, each, 0.0).sum(axis=-1) / count, _standard_error(each, there), count))
        (after, after_error, after_count), (before, before_error, before_count) = parts
        error = np.hypot(after_error, before_error)
        freedom = error**4 / (after_error**4 / (after_count - 1) + before_error**4 / (before_count - 1))
        ratio = after / before
        ratio_error = np.hypot(after_error, ratio * before_error) / np.abs(before)
    freedom = np.where(error == 0, np.minimum(after_count, before_count) - 1.0, freedom)
    factor, pairs = _factor(freedom), np.minimum(after_count, before_count)
    return Effect(
        relative=np.where(pairs > 1, ratio - 1, np.nan),
        half_width=factor * ratio_error,
        sign=_sign(after - before, factor * error),
        pairs=pairs,
        lost=sum(int((~np.isfinite(each)).sum()) for each in (values, reference)),
    )


def summary(effect: Effect) -> Summary:
    """An effect over all cells that could be compared.

    The interval of the mean is that of these cells, from their walks; it says nothing of other cells.
    """
    known = effect.known
    relative, sign = effect.relative[known], effect.sign[known]
    cells = len(relative)
    if not cells:
        return Summary(0, 0, 0, math.nan, math.nan, math.nan)
    error = standard_error(effect)[known]
    return Summary(
        cells=cells,
        rises=int((sign > 0).sum()),
        falls=int((sign < 0).sum()),
        mean=float(relative.mean()),
        half_width=float(1.96 * np.sqrt((error**2).sum()) / cells),
        typical=float(np.sqrt(max(0.0, float((relative**2 - error**2).mean())))),
    )


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


def mean(values: Array) -> Array:
    """Mean over the samples of each cell, shape (...,); NaN without a walk."""
    there = np.isfinite(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        means: Array = np.where(there, values, 0.0).sum(axis=-1) / there.sum(axis=-1)
    return means


def spread(values: Array) -> Array:
    """Standard deviation of a walk over the mean of its cell, shape (...,); NaN with fewer than two walks."""
    there = np.isfinite(values)
    count = there.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        relative: Array = _standard_error(values, there) * np.sqrt(count) / mean(values)
    return relative


def _standard_error(values: Array, there: NDArray[np.bool_]) -> Array:
    """Standard error of the mean of the values that are there; NaN with fewer than two."""
    count = there.sum(axis=-1)
    kept = np.where(there, values, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        deviation = np.where(there, kept - (kept.sum(axis=-1) / count)[..., np.newaxis], 0.0)
        error: Array = np.sqrt((deviation**2).sum(axis=-1) / (count - 1) / count)
    return np.where(count > 1, error, np.nan)


def _factor(freedom: Any) -> Array:
    """Half-width of a 95 % interval over the standard error; NaN without a degree of freedom."""
    return t.ppf(_TAIL, np.where(np.asarray(freedom) > 0, freedom, np.nan))


def _sign(difference: Array, half_width: Array) -> NDArray[np.int64]:
    """Sign of a difference that is significant, 0 of another and where there is no interval."""
    with np.errstate(invalid="ignore"):
        significant = np.abs(difference) > half_width
    return np.where(significant, np.sign(np.nan_to_num(difference)), 0).astype(np.int64)
