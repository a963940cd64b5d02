"""How well two samples agree: bootstrap intervals, and the two-sample test of Kolmogorov and Smirnov."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CONFIDENCE: Final = 0.95
"""Of the bootstrap intervals."""

_RESAMPLES: Final = 10_000
_SEED: Final = 1979


def bootstrap_interval(sample: Array, statistic: Callable[..., Any]) -> tuple[float, float]:
    """Percentile interval of a statistic (B. Efron, Annals of Statistics 7 (1979) 1-26).

    Args:
        sample: Independent values, (k,).
        statistic: As `numpy.mean`, with the argument `axis`.

    Returns:
        Lower and upper end, the same ones each time; NaN with fewer than two values.
    """
    if len(sample) < 2:
        return float("nan"), float("nan")
    places = np.random.default_rng(_SEED).integers(len(sample), size=(_RESAMPLES, len(sample)))
    tail = (1 - CONFIDENCE) / 2
    lower, upper = np.quantile(statistic(sample[places], axis=-1), [tail, 1 - tail])
    return float(lower), float(upper)


def kolmogorov_smirnov(first: Array, second: Array) -> tuple[float, float]:
    """Greatest distance D of two empirical distribution functions, and the probability of one at least as great.

    The probability is exact for independent samples of one continuous distribution: all orders of the m + k values are
    then equally likely, each order is a path from (0, 0) to (m, k), and the paths are counted that stay closer than D
    to the diagonal (J. L. Hodges, Arkiv för Matematik 3 (1958) 469-486).

    Args:
        first: (m,), m ≥ 1.
        second: (k,), k ≥ 1.

    Returns:
        D and the probability.
    """
    m, k = len(first), len(second)
    values = np.concatenate([first, second])
    steps = [np.searchsorted(np.sort(sample), values, side="right") for sample in (first, second)]
    reached = int(np.abs(steps[0] * k - steps[1] * m).max())  # D in units of 1 / (m k), free of rounding
    # share[j]: of all paths to (i, j), those that have stayed inside; the last step came along i or along j
    share = np.zeros(k + 1)
    for i in range(m + 1):
        for j in range(k + 1):
            if abs(i * k - j * m) >= reached:
                share[j] = 0.0
            elif i == j == 0:
                share[j] = 1.0
            else:
                share[j] = (i * share[j] + (j * share[j - 1] if j else 0.0)) / (i + j)
    return reached / (m * k), 1.0 - float(share[k])
