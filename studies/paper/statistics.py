"""Differences of mean distances between cells of a sweep, with their errors, and how pages have them.

A cell is a number of links and a frequency. Values have the shape (..., samples). Walks that did not come to rest are
NaN and take no part; what they leave is counted.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import t

from studies.common import Array, OverCells, deviation, mean, minus, standard_error

CONFIDENCE = 0.95  # Confidence level of every test and interval


@dataclass(frozen=True)
class Effect:
    """What a change does to the mean of a quantity, cell by cell; every array has the shape of the cells."""

    relative: Array  # Mean after the change over that before it, less 1; NaN without two walks to compare
    half_width: Array  # Half of the 95 % interval of `relative`; NaN likewise
    sign: Array  # 1 if the mean rises and −1 if it falls, at 95 %; 0 if neither can be said
    pairs: Array  # Number of pairs of walks; of two independent samples the smaller number of walks
    lost: int  # Walks or pairs left out, because a walk did not come to rest
    notes: Mapping[str, Any] = field(default_factory=dict)  # What else a file has of it, such as the value it is of

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "Effect":
        """The effect that `plain` wrote, with its numbers rounded; null stands for NaN."""
        kinds = {"relative": float, "half_width": float, "sign": int, "pairs": int}
        arrays = {name: np.array(content[name], kind) for name, kind in kinds.items()}
        return cls(**arrays, lost=content["lost"], notes={name: content[name] for name in content if name not in kinds})

    @property
    def plain(self) -> dict[str, Any]:
        """The numbers by their names."""
        return {name: getattr(self, name) for name in ("relative", "half_width", "sign", "pairs", "lost")}

    def __getitem__(self, rows: Any) -> "Effect":
        """The effect in some of the cells."""
        return Effect(self.relative[rows], self.half_width[rows], self.sign[rows], self.pairs[rows], self.lost)

    def __str__(self) -> str:
        """Mean over the cells, or the effect in the only one, with its interval."""
        if self.relative.ndim == 0:
            return percent(float(self.relative), float(self.half_width))
        return percent(self.cells.mean, 1.96 * self.cells.error)

    @property
    def known(self) -> Array:
        """Cells that have an interval."""
        return np.isfinite(self.relative) & np.isfinite(self.half_width)

    @cached_property
    def cells(self) -> OverCells:
        """All cells that could be compared together; the interval of their mean says nothing of other cells."""
        return OverCells(self.relative, self.half_width / _factor(self.pairs - 1))

    @property
    def count(self) -> int:
        """Number of cells that could be compared."""
        return len(self.cells)

    @property
    def rises(self) -> int:
        """Number of cells with a significant rise."""
        return int((self.sign[self.known] > 0).sum())

    @property
    def falls(self) -> int:
        """Number of cells with a significant fall."""
        return int((self.sign[self.known] < 0).sum())


def percent(value: float, half_width: float | None = None, *, sign: bool = True) -> str:
    """A share in per cent with two significant digits of its interval, such as ``+3.1 ± 0.4 %``."""
    if not np.isfinite(value):
        return "—"
    number, width = 100 * value, 100 * (half_width or np.nan)
    if np.isfinite(width):
        digits, end = 0 if width >= 2 else 1 if width >= 0.2 else 2, " ± {:.{}f}"
    else:
        digits, end = 0 if abs(number) >= 10 else 1, ""
    return minus(f"{number:{'+' if sign else ''}.{digits}f}") + f"{end.format(width, digits)} %"


def plain(value: float) -> str:
    """A share in per cent without a sign."""
    return percent(float(value), sign=False)


def paired(values: ArrayLike, reference: ArrayLike) -> Effect:
    """Compare the same samples after and before a change by a t test; the interval is that of the linearised ratio."""
    both = np.asarray(np.isfinite(values) & np.isfinite(reference))
    after, before = (np.where(both, each, np.nan) for each in (values, reference))
    pairs = both.sum(axis=-1)

    def error_of(ratio: Any) -> Any:
        return standard_error(after - np.expand_dims(ratio, -1) * before)

    return _effect(after, before, error_of, pairs - 1, pairs, int((~both).sum()))


@np.errstate(invalid="ignore", divide="ignore")
def unpaired(values: ArrayLike, reference: ArrayLike) -> Effect:
    """Compare independent samples by Welch's t test."""
    both = np.asarray(values), np.asarray(reference)
    errors, counts = [standard_error(each) for each in both], [np.isfinite(each).sum(axis=-1) for each in both]

    def error_of(ratio: Any) -> Any:
        return np.hypot(errors[0], ratio * errors[1])

    pairs = np.minimum(*counts)
    parts = (error**4 / (count - 1) for error, count in zip(errors, counts, strict=True))
    freedom = np.where(error_of(1.0) == 0, pairs - 1.0, error_of(1.0) ** 4 / sum(parts))
    return _effect(*both, error_of, freedom, pairs, sum(int((~np.isfinite(each)).sum()) for each in both))


@np.errstate(invalid="ignore", divide="ignore")
def _effect(
    after: Array, before: Array, error_of: Callable[[Any], Any], freedom: Array, pairs: Array, lost: int
) -> Effect:
    """An effect; `error_of` gives the standard error of the mean after the change less a ratio times that before it."""
    means = mean(after), mean(before)
    ratio, change, factor = means[0] / means[1], means[0] - means[1], _factor(freedom)
    sign = np.where(np.abs(change) > factor * error_of(1.0), np.sign(np.nan_to_num(change)), 0).astype(np.int64)
    half_width = factor * error_of(ratio) / np.abs(means[1])
    return Effect(np.where(pairs > 1, ratio - 1, np.nan), half_width, sign, pairs, lost)


def spread(values: ArrayLike) -> Array:
    """Standard deviation of a walk over the mean of its cell, shape (...,); NaN with fewer than two walks."""
    return np.asarray(deviation(values) / mean(values))


def _factor(freedom: Any) -> Array:
    """Half-width of a 95 % interval over the standard error; NaN without a degree of freedom."""
    return t.ppf((1 + CONFIDENCE) / 2, np.where(np.asarray(freedom) > 0, freedom, np.nan))
