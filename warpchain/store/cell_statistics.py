"""Statistics of a quantity in each cell of a grid."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass(frozen=True, eq=False, kw_only=True)
class CellStatistics:
    """Statistics of a quantity over the walks of each cell that came to rest; arrays over the axes of the grid.

    Attributes:
        axes: name of each axis → its values.
        unit: unit of `mean` and `sd`.
        mean: mean; NaN without a walk at rest.
        sd: standard deviation of a sample (divisor count − 1); NaN with fewer than two walks at rest.
        count: number of walks at rest.
        failed: number of walks that ended otherwise.
        missing: number of walks not computed yet.
    """

    axes: dict[str, Array]
    unit: str
    mean: NDArray[np.float64]
    sd: NDArray[np.float64]
    count: NDArray[np.int64]
    failed: NDArray[np.int64]
    missing: NDArray[np.int64]

    @property
    def standard_error(self) -> NDArray[np.float64]:
        """Standard error of the mean, sd / √count."""
        return self.sd / np.sqrt(np.maximum(self.count, 1))
