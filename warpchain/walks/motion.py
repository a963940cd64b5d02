"""The motion of one walk, and which part of it is kept."""

import hashlib
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from warpchain.loop.before_release import FIELDS, BeforeRelease

Array = NDArray[np.float64]

SERIES: Final = {
    "time": ("s", "time since the release"),
    "center_x": ("m", "x of the centre of mass"),
    "center_y": ("m", "height of the centre of mass above the floor"),
    "center_velocity_x": ("m/s", "velocity of the centre of mass in x"),
    "center_velocity_y": ("m/s", "velocity of the centre of mass, upwards"),
}
"""Columns of a series: name → unit and meaning; what the paper's Figure 5 is drawn from."""


PLANE_SERIES: Final = {
    "center_z": ("m", "z of the centre of mass, to the right"),
    "tilt": ("rad", "tilt of the plane, positive to the left"),
    "yaw": ("rad", "heading of the plane, anticlockwise from above, all turns counted"),
}
"""Further columns of the series of a walk whose plane tilts."""
FRAME_PLANE: Final = {
    **{f"origin_{axis}": ("m", f"{axis} of the origin of the plane's coordinates") for axis in "xyz"},
    **{f"{of}_axis_{axis}": ("1", f"{axis} of the plane's axis of {of}") for of in "xy" for axis in "xyz"},
}
"""What a frame of a walk whose plane tilts has besides its joints: where the plane is in the room."""


@dataclass(frozen=True)
class Keep:
    """What is kept of the motion of one walk.

    Attributes:
        series_every: a sample is kept at every so many sample marks; None: no series.
        frame_every: a frame is kept at every so many sample marks; None: no frames.
        frame_interval: time [s] between two frames after the release, instead, if it is shorter than that between two
            sample marks; 0: as `frame_every` says.
        loads: whether force and moment of each joint are kept with the frames after the release.
        before: time [s] before the release of which samples and frames are kept as well, with the loads of the
            joints; 0: none.
    """

    series_every: int | None = None
    frame_every: int | None = None
    frame_interval: float = 0.0
    loads: bool = False
    before: float = 0.0


NOTHING: Final = Keep()

LONGEST_INTERVAL: Final = 1000.0
"""Greatest time [s] between two samples or frames that are kept, and of what is kept before a release."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """What a sweep keeps of the motion of one walk; nothing if the chain was never released.

    Attributes:
        series: t samples with the columns of `SERIES`, shape (t, 5).
        plane_series: the columns of `PLANE_SERIES` for each sample, shape (t, 3); (0, 3) if the plane is fixed.
        frame_time: times of the frames [s], shape (f,).
        frame_joints: joints x, y [m], shape (f, n, 2).
        frame_planes: origin [m] and axes of the plane in each frame, the columns of `FRAME_PLANE`, shape (f, 9); (0, 9)
            if the plane is fixed.
        sprocket_height: height [m] of the sprocket's centre at the release; NaN without a sprocket or a release.
        before_release: the motion just before the release, in single precision but for times; None if not kept.
    """

    series: Array
    plane_series: Array
    frame_time: Array
    frame_joints: NDArray[np.float32]
    frame_planes: Array
    sprocket_height: float
    before_release: BeforeRelease | None

    def checksum(self) -> bytes:
        """SHA-256 of all numbers."""
        parts = [self.series, self.frame_time, self.frame_joints, np.float64(self.sprocket_height)]
        parts += [self.plane_series, self.frame_planes]
        if self.before_release is not None:
            parts += [getattr(self.before_release, name) for name in FIELDS]
        return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).digest()
