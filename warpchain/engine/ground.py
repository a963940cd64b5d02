"""The arrays by which kernels know a floor that is not flat, see `warpchain.kernels.contacts.terrain`."""

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.floor import heights
from warpchain.kernels import layout

Array = NDArray[np.float64]

ENDLESS = 1e9
"""How far the first and the last cell reach [m]."""


def faces_of(points: Array) -> Array:
    """The faces between points (p, 2) of a profile, (p − 1, FACE_VALUES)."""
    step = np.diff(points, axis=0)
    length = np.hypot(*step.T)
    along = step / length[:, None]
    turn = along[:-1, 0] * along[1:, 1] - along[:-1, 1] * along[1:, 0]
    before = np.zeros_like(along)
    before[1:] = np.where((turn < 0)[:, None], along[:-1], 0.0)
    begin, end = np.zeros(len(along)), length
    begin[0], end[-1] = -np.inf, np.inf
    return np.column_stack([points[:-1], along, before, begin, end])


def cells_of(points: Array, link_length: float, circle_radius: float) -> Array:
    """The cells of a profile for links of one size, (GROUND_CELLS + 1, CELL_VALUES)."""
    left, right = points[0, 0], points[-1, 0]
    width = (right - left) / layout.GROUND_CELLS
    margin = link_length
    reach = margin + 1.01 * (link_length / 2 + circle_radius)
    lows = left + width * np.arange(layout.GROUND_CELLS) - reach
    highs = lows + width + 2 * reach
    lows[0], highs[-1] = -ENDLESS, ENDLESS
    first = np.searchsorted(points[1:-1, 0], lows, side="left")
    last = np.searchsorted(points[1:-1, 0], highs, side="right")
    x, y = points.T
    inside = np.where((x >= lows[:, None]) & (x <= highs[:, None]), y, -np.inf).max(axis=1)
    top = np.maximum(inside, heights(points, np.stack([lows, highs])).max(axis=0))
    return np.vstack([np.column_stack([first, last, top]), [left, 1 / width, margin]])
