"""The sprocket's motion after the release, as kernels read it."""

from typing import Final

import numpy as np

from warpchain.inputs.arrays import Array
from warpchain.inputs.sprocket_motion import Motion
from warpchain.kernels import layout

BEYOND: Final = 1e30
"""Time [s] of the rows behind the last."""


def motion_rows(motion: Motion, frequency: float, height: float) -> Array:
    """The rows of `Drive.motion`, given frequency [Hz] and height of the sprocket's centre [m] at the release.

    The sprocket starts at rest; between rows it goes on monotone cubics (PCHIP), without overshoot.
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
