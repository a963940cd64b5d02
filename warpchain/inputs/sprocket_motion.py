"""The sprocket after the release, if it does not vanish at once: where it goes, and how fast it turns."""

import itertools
import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.validation import shown
from warpchain.kernels import layout

Array = NDArray[np.float64]
Motion = tuple[tuple[float, float, float, float], ...]

MOST_ROWS: Final = layout.MOTION_ROWS - 1
LARGEST: Final = 1e4
"""Greatest size of a time, a place and a frequency."""
BEYOND: Final = 1e30
"""Time [s] of the rows behind the last."""


def checked_motion(given: Any) -> Any:
    """A motion as a tuple of rows t, x, y, ν; what is no list of rows is left to the field's other types.

    Raises:
        ValueError: it is a list, but not of rows that make a motion.
    """
    if not isinstance(given, list | tuple):
        return given
    rows: list[tuple[float, float, float, float]] = []
    for number, row in enumerate(given):
        values = list(row) if isinstance(row, list | tuple) else []
        if len(values) != 4 or not all(isinstance(each, int | float) and not isinstance(each, bool) for each in values):
            raise ValueError(f"row {number}, {shown(row)}, is not four numbers; give [time, x, y, frequency]")
        if not all(math.isfinite(each) and abs(each) <= LARGEST for each in values):
            raise ValueError(f"row {number}, {shown(row)}, is not within ±{LARGEST:g}; give smaller numbers")
        time, x, y, frequency = map(float, values)
        rows.append((time, x, y, frequency))
    if not 1 <= len(rows) <= MOST_ROWS:
        raise ValueError(f"{len(rows)} rows; give 1 to {MOST_ROWS}, such as [[0.1, 0, -0.02, 0]]")
    for number, (before, after) in enumerate(itertools.pairwise([(0.0,), *rows])):
        if not after[0] > before[0]:
            raise ValueError(f"row {number}: {after[0]:g} s is not after {before[0]:g} s; let times rise from above 0")
    return tuple(rows)


def motion_rows(motion: Motion, frequency: float, height: float) -> Array:
    """The rows of `Drive.motion`, (MOTION_ROWS, MOTION_VALUES).

    The sprocket starts at rest; between rows it goes on monotone cubics (PCHIP), without overshoot.

    Args:
        motion: rows of time [s], place relative to that at the release [m], turns per second as in the drive [Hz].
        frequency: at the release [Hz].
        height: of the sprocket's centre at the release [m].
    """
    from scipy.interpolate import PchipInterpolator

    given = np.array([(0.0, 0.0, 0.0, frequency), *motion])
    rows = np.zeros((layout.MOTION_ROWS, layout.MOTION_VALUES))
    known = rows[: len(given)]
    known[:, layout.MOTION_TIME] = given[:, 0]
    known[:, layout.MOTION_X : layout.MOTION_Y + 1] = given[:, 1:3] + [0.0, height]
    speeds = PchipInterpolator(given[:, 0], given[:, 1:3]).derivative()(given[:, 0])
    known[1:, layout.MOTION_U : layout.MOTION_V + 1] = speeds[1:]
    known[:, layout.MOTION_TURNING] = -2 * np.pi * given[:, 3]
    rows[len(given) :] = known[-1]
    rows[len(given) :, layout.MOTION_TIME] = BEYOND * np.arange(1, len(rows) - len(given) + 1)
    return rows
