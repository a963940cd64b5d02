"""The prescribed motion of the sprocket after the release (`release` of a scene): position and frequency.

It starts at rest; between the rows of its motion it follows monotone cubics (PCHIP), without overshoot.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from warpchain.inputs.arrays import Array
from warpchain.inputs.compound_fields import SprocketMotion
from warpchain.kernels import layout

BEYOND: Final = 1e30
"""Time [s] of the rows for kernels behind the last."""


def _knots(motion: SprocketMotion) -> tuple[Array, Array, Array]:
    """Times since the release [s], (k,), places x, y [m], (k, 2), and speeds [m/s], (k, 2), of release and rows."""
    from scipy.interpolate import PchipInterpolator

    times, places = np.split(np.array([(0.0, 0.0, 0.0), *(row[:3] for row in motion)]), [1], axis=1)
    speeds = PchipInterpolator(times[:, 0], places).derivative()(times[:, 0])
    speeds[0] = 0.0
    return times[:, 0], places, speeds


def sprocket_places(motion: SprocketMotion | None, times: ArrayLike) -> Array:
    """Places x, y of the sprocket relative to that at the release [m], (t, 2), at times since then [s], (t,).

    They are NaN where it has vanished; without a motion it vanishes at once.
    """
    if motion is None:
        return np.full((np.size(times), 2), np.nan)
    from scipy.interpolate import CubicHermiteSpline

    there = CubicHermiteSpline(*_knots(motion))(times)
    return np.where(np.reshape(times, (-1, 1)) < motion[-1][0], there, np.nan)


def motion_rows(motion: SprocketMotion, frequency: float, height: float) -> Array:
    """The rows of `Drive.motion`, given frequency [Hz] and height of the sprocket's centre [m] at the release."""
    times, places, speeds = _knots(motion)
    rows = np.zeros((layout.MOTION_ROWS, layout.MOTION_VALUES))
    known, later = np.split(rows, [len(times)])
    known[:, layout.MOTION_TIME] = times
    known[:, layout.MOTION_X : layout.MOTION_Y + 1] = places + np.array([0.0, height])
    known[:, layout.MOTION_U : layout.MOTION_V + 1] = speeds
    known[:, layout.MOTION_TURNING] = -2 * np.pi * np.array([frequency, *(row[3] for row in motion)])
    later[:] = known[-1]
    later[:, layout.MOTION_TIME] = BEYOND * np.arange(1, len(later) + 1)
    return rows
