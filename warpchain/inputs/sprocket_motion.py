"""The sprocket after the release, if it does not vanish at once: where it goes, and how fast it turns."""

import itertools
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AfterValidator, Field, Strict

Motion = tuple[tuple[float, float, float, float], ...]

LARGEST: Final = 1e4
"""Greatest size of a time, a place and a frequency."""


def _in_order(rows: Motion) -> Motion:
    if not rows:
        raise ValueError("no rows; give at least one, such as [[0.1, 0, -0.02, 0]], or null")
    for number, (before, after) in enumerate(itertools.pairwise([(0.0,), *rows])):
        if not after[0] > before[0]:
            raise ValueError(f"row {number}: {after[0]:g} s is not after {before[0]:g} s; let times rise from above 0")
    return rows


_Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Rows = Annotated[
    tuple[Annotated[tuple[_Number, _Number, _Number, _Number], Strict(False)], ...],
    Strict(False),
    Field(max_length=16),
    AfterValidator(_in_order),
]
"""A motion: rows [time, x, y, frequency]."""


def sprocket_places(motion: Motion | None, times: ArrayLike) -> NDArray[np.float64]:
    """Places x, y of the sprocket relative to that at the release [m], (t, 2), at times since then [s], (t,).

    They are NaN where it has vanished; without a motion it vanishes at once.
    """
    if motion is None:
        return np.full((np.size(times), 2), np.nan)
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    knots, places = np.split(np.array([(0.0, 0.0, 0.0), *(row[:3] for row in motion)]), [1], axis=1)
    speeds = PchipInterpolator(knots[:, 0], places).derivative()(knots[:, 0])
    speeds[0] = 0.0  # it starts at rest
    there = CubicHermiteSpline(knots[:, 0], places, speeds)(times)
    return np.where(np.reshape(times, (-1, 1)) < motion[-1][0], there, np.nan)
