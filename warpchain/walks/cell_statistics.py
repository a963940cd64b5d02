"""Statistics of a quantity in each cell of a grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.arrays import AnyArray
from warpchain.status import Status
from warpchain.walks.rows import MISSING


@dataclass(frozen=True, eq=False, kw_only=True)
class CellStatistics:
    """Statistics of a quantity over the walks of each cell that ended as planned and have it; arrays over the axes.

    A walk that never collapsed, say, has no `collapsed_at`: it is in no mean of that, and `count` is what was averaged.

    Attributes:
        axes: name of each axis → its values.
        unit: unit of `mean` and `sd`.
        mean: mean; NaN without such a walk.
        sd: standard deviation of a sample (divisor count − 1); NaN with fewer than two.
        count: number of walks that ended as planned and have the quantity: those in the mean.
        absent: number of walks that ended as planned and have none, NaN or −1 in their column.
        failed: number of walks that ended otherwise.
        missing: number of walks not computed yet.
    """

    axes: dict[str, AnyArray]
    unit: str
    mean: NDArray[np.float64]
    sd: NDArray[np.float64]
    count: NDArray[np.int64]
    absent: NDArray[np.int64]
    failed: NDArray[np.int64]
    missing: NDArray[np.int64]

    @classmethod
    def of(cls, axes: dict[str, AnyArray], unit: str, column: AnyArray, status: AnyArray) -> "CellStatistics":
        """Statistics of a column over its last axis, that of the samples; ``status`` of the same walks."""
        rested = np.isin(status, [code for code in Status if code.ok])
        had = rested & (column != MISSING if column.dtype.kind == "i" else ~np.isnan(column))
        values = np.ma.masked_array(column.astype(float), ~had)
        return cls(
            axes=axes,
            unit=unit,
            mean=np.ma.filled(values.mean(axis=-1), np.nan),
            sd=np.ma.filled(values.std(axis=-1, ddof=1), np.nan),
            count=had.sum(axis=-1),
            absent=(rested & ~had).sum(axis=-1),
            failed=(~rested & (status != MISSING)).sum(axis=-1),
            missing=(status == MISSING).sum(axis=-1),
        )

    @property
    def standard_error(self) -> NDArray[np.float64]:
        """Standard error of the mean, sd / √count."""
        return self.sd / np.sqrt(np.maximum(self.count, 1))
