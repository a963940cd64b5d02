"""The sprocket after the release, if it does not vanish at once: where it goes, and how fast it turns."""

import itertools
import math
from typing import Any, Final

from warpchain.inputs.validation import shown

Motion = tuple[tuple[float, float, float, float], ...]

MOST_ROWS: Final = 16
LARGEST: Final = 1e4
"""Greatest size of a time, a place and a frequency."""


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
