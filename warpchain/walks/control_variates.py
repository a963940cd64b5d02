"""Means with less error, by control variates: samples happen to draw more or less than the mean of a distribution.

The mean of every drawn quantity is known, so a linear regression of the result on what was drawn tells what the result
would be had the samples drawn these means exactly. Its residuals tell the error that is left. Whatever is not linear in
the drawn quantities stays in the error; the corrected mean has a bias of the order of one over the number of walks,
far below its error. B. L. Nelson, Operations Research 38 (1990) 974; S. S. Lavenberg, P. D. Welch, Management Science
27 (1981) 322.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpchain.walks.cell_statistics import CellStatistics

Floats = NDArray[np.float64]

_FREE = 2
"""Least number of walks beyond those that the regression takes for its coefficients."""


def controlled(cells: CellStatistics, values: Floats, drawn: Floats, expected: Floats) -> CellStatistics:
    """The statistics of random samples with corrected means and errors; `worth` says how many walks each would take.

    The walks' values are of shape (…, walks), with NaN of missing walks; what they drew (…, walks, q), and the means of
    what they draw (…, q). Cells in which a walk failed or has no value have no corrected mean, since what is expected
    of the others is not known; nor have cells with few walks more than drawn quantities. `independent` − 1 are the
    degrees of freedom of Student's factor.
    """
    taken = drawn.shape[-1]
    mean, error = (np.full(cells.mean.shape, np.nan) for _ in range(2))
    free = np.where(cells.of_survivors, 0, cells.count - taken)  # one more than the degrees of freedom
    for place in np.ndindex(*cells.mean.shape):
        if free[place] <= _FREE:
            continue
        there = ~np.isnan(values[place])
        deviations = drawn[place][there] - expected[place]
        matrix = np.column_stack([np.ones(len(deviations)), deviations / deviations.std(axis=0)])
        coefficients, _, rank, _ = np.linalg.lstsq(matrix, values[place][there], rcond=None)
        residuals = values[place][there] - matrix @ coefficients
        variance = residuals @ residuals / (len(matrix) - rank)
        mean[place] = coefficients[0]
        error[place] = np.sqrt(variance * np.linalg.pinv(matrix.T @ matrix)[0, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        worth = cells.count * (cells.standard_error / error) ** 2
    independent = np.where(np.isfinite(mean), free, 0)
    return replace(cells, mean=mean, standard_error=error, independent=independent, worth=worth)
