"""Means of a quantity in each cell of a grid, with standard errors and bounds; all tables and figures use them.

Tables, figures, pages and `info` show these numbers. The error of a mean comes from the spread between groups of walks
that are independent of one another: the single walks of random samples, the randomisations of designed ones.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpchain.inputs.arrays import AnyArray
from warpchain.status import Status
from warpchain.walks.rows import MISSING

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True, eq=False, kw_only=True)
class CellStatistics:
    """Statistics of a quantity over the walks of each cell that ended as planned and have it; arrays over the axes.

    A walk that never collapsed, say, has no `collapsed_at`: it is in no mean of that, and `count` is what was averaged.

    Attributes:
        axes: name of each axis → its values.
        unit: unit of `mean`, `sd`, `standard_error` and `at_least`.
        mean: mean; NaN without such a walk.
        sd: standard deviation of a sample (divisor count − 1); NaN with fewer than two.
        standard_error: standard error of the mean, from the spread between independent groups of walks; NaN with fewer
            than two groups. An interval takes Student's factor for `independent` − 1 degrees of freedom.
        at_least: of Δx a lower bound of the mean of all walks of a cell, where some were still moving at
            `distance_limit` and all others are in the mean: each of them counts as having come so far. Else NaN.
        independent: number of independent groups of walks in the mean.
        count: number of walks that ended as planned and have the quantity: those in the mean.
        absent: number of walks that ended as planned and have none, NaN or −1 in their column.
        failed: number of walks that ended otherwise.
        missing: number of walks that are still to be computed.
        reached: of a block with `until` whether the errors that it asks for are reached; else None.
        worth: of corrected means the number of walks that would have the same error without a correction; else None.
    """

    axes: dict[str, AnyArray]
    unit: str
    mean: Floats
    sd: Floats
    standard_error: Floats
    at_least: Floats
    independent: Counts
    count: Counts
    absent: Counts
    failed: Counts
    missing: Counts
    reached: NDArray[np.bool_] | None = None
    worth: Floats | None = None

    @classmethod
    def of(
        cls,
        axes: dict[str, AnyArray],
        unit: str,
        column: AnyArray,
        status: AnyArray,
        groups: NDArray[np.int64],
        farthest: ArrayLike = np.nan,
    ) -> "CellStatistics":
        """Statistics of a column over its last axis, that of the samples; ``status`` of the same walks.

        Walks of different ``groups``, a number for each along that axis, are independent of one another. Walks that
        ended by their distance had come ``farthest``, in each cell; NaN where that is no bound.
        """
        rested, known = _ended_as_planned(status), known_values(column, status)
        had = ~np.isnan(known)
        values = np.ma.masked_array(known, ~had)
        mean, count = np.ma.filled(values.mean(axis=-1), np.nan), had.sum(axis=-1)
        error, independent = _standard_error(np.where(had, column - mean[..., np.newaxis], 0.0), had, groups)
        absent, failed = (rested & ~had).sum(axis=-1), (~rested & (status != MISSING)).sum(axis=-1)
        beyond = (status == Status.DISTANCE_LIMIT).sum(axis=-1)
        with np.errstate(invalid="ignore"):
            bound = (np.ma.filled(values.sum(axis=-1), 0.0) + beyond * farthest) / np.maximum(count + beyond, 1)
        return cls(
            axes=axes,
            unit=unit,
            mean=mean,
            sd=np.ma.filled(values.std(axis=-1, ddof=1), np.nan),
            standard_error=error,
            at_least=np.where((beyond > 0) & (beyond == absent) & (failed == 0), bound, np.nan),
            independent=independent,
            count=count,
            absent=absent,
            failed=failed,
            missing=(status == MISSING).sum(axis=-1),
        )

    @property
    def of_survivors(self) -> NDArray[np.bool_]:
        """Whether the mean of a cell leaves out walks that were computed: it is then not that of the cell."""
        return np.asarray((self.count > 0) & (self.absent + self.failed > 0))

    @property
    def why_no_error(self) -> str:
        """Why some cells with several walks have no standard error; empty if all of these have one."""
        if self.worth is not None:
            return "" if np.isfinite(self.worth).all() else "cells with failed walks or few walks are not corrected"
        if not ((self.count > 1) & (self.independent < 2)).any():
            return ""
        problem = "walks of one randomisation depend on one another, so their spread gives no standard error"
        return f"{problem}; use randomisations: 8 and more samples"


def known_values(column: AnyArray, status: AnyArray) -> Floats:
    """Values of the walks that ended as planned and have one, those that means are of; NaN of all others."""
    is_known = column != MISSING if column.dtype.kind == "i" else ~np.isnan(column)
    return np.where(_ended_as_planned(status) & is_known, column, np.nan)


def _ended_as_planned(status: AnyArray) -> NDArray[np.bool_]:
    return np.isin(status, [code for code in Status if code.ok])


def _standard_error(deviations: Floats, had: NDArray[np.bool_], groups: NDArray[np.int64]) -> tuple[Floats, Counts]:
    """Standard error of the means over the last axis, and number of the groups that have a walk in them.

    Deviations are those from the mean, 0 of a walk that is not in it. With a walk a group this is sd / √count. Groups
    may have unlike numbers of walks: W. G. Cochran, Sampling Techniques (3rd ed., 1977), section 6.4, the variance of
    a ratio.
    """
    order = np.argsort(groups, kind="stable")
    starts = np.flatnonzero(np.diff(groups[order], prepend=-1))
    totals = np.add.reduceat(deviations[..., order], starts, axis=-1)
    independent = np.logical_or.reduceat(had[..., order], starts, axis=-1).sum(axis=-1)
    several = independent > 1
    inflation = np.where(several, independent / np.maximum(independent - 1, 1), np.nan)
    return np.sqrt(inflation * np.sum(totals**2, axis=-1)) / np.maximum(had.sum(axis=-1), 1), independent
