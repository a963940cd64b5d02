"""The motion of walks that a shard keeps: series and frames of any length, one behind the other in flat arrays.

motion/walk            indices of the walks, ascending
motion/series_start    where the samples of each walk begin, and where the last one's end
motion/time …          the samples, see `SERIES`
motion/frame_start     likewise of the frames
motion/frame_time      times of the frames [s]
motion/joint_start     likewise of the joints
motion/joint_x, _y     joints of all frames, frame by frame [m]
motion/sprocket_height height of the sprocket's centre at the release [m]; NaN without a sprocket
motion/before_release/ for each walk of which that was kept a group, named by its number, see `before_release`
motion/checksum        SHA-256 of what is there of each walk
"""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.loop.before_release import FIELDS, BeforeRelease, read_before_release, write_before_release

if TYPE_CHECKING:
    import h5py

Array = NDArray[np.float64]

SERIES: Final = {
    "time": ("s", "time since the release"),
    "center_x": ("m", "x of the centre of mass"),
    "center_y": ("m", "height of the centre of mass above the floor"),
    "center_velocity_x": ("m/s", "velocity of the centre of mass in x"),
    "center_velocity_y": ("m/s", "velocity of the centre of mass, upwards"),
}
"""Columns of a series: name → unit and meaning; what the paper's Figure 5 is drawn from."""

FRAMES: Final = {
    "frame_time": ("s", "time of a frame since the release"),
    "joint_x": ("m", "x of a joint in a frame"),
    "joint_y": ("m", "height of a joint in a frame above the floor"),
}
"""Columns of frames and joints. Joints are in single precision (6e-8 of their distance): they are for pictures."""

GROUP: Final = "motion"
BEFORE: Final = "before_release"


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """What is kept of the motion of one walk; a walk that was never released has neither samples nor frames.

    Attributes:
        series: t samples with the columns of `SERIES`, shape (t, 5).
        frame_time: times of the frames [s], shape (f,).
        frame_joints: joints x, y [m], shape (f, n, 2).
        sprocket_height: height [m] of the sprocket's centre at the release; NaN without a sprocket or a release.
        before_release: the motion just before the release, in single precision but for times; None if not kept.
    """

    series: Array
    frame_time: Array = field(default_factory=lambda: np.empty(0))
    frame_joints: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 0, 2), np.float32))
    sprocket_height: float = math.nan
    before_release: BeforeRelease | None = None

    def checksum(self) -> bytes:
        """SHA-256."""
        parts = [self.series, self.frame_time, self.frame_joints, np.float64(self.sprocket_height)]
        if self.before_release is not None:
            parts += [getattr(self.before_release, name) for name in FIELDS]
        return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).digest()


def write_motions(motions: Mapping[int, Motion], file: "h5py.File") -> None:
    """Put the motions of walks, by index, into a shard."""
    walks = sorted(motions)
    ordered = [motions[walk] for walk in walks]
    group = file.create_group(GROUP, track_order=True)
    group["walk"] = np.array(walks, np.int64)
    group["series_start"] = _starts([len(motion.series) for motion in ordered])
    samples = np.concatenate([motion.series for motion in ordered])
    for column, name in enumerate(SERIES):
        _put(group, name, samples[:, column])
    group["frame_start"] = _starts([len(motion.frame_time) for motion in ordered])
    _put(group, "frame_time", np.concatenate([motion.frame_time for motion in ordered]))
    group["joint_start"] = _starts([motion.frame_joints.shape[0] * motion.frame_joints.shape[1] for motion in ordered])
    joints = np.concatenate([motion.frame_joints.reshape(-1, 2) for motion in ordered])
    for column, name in enumerate(("joint_x", "joint_y")):
        _put(group, name, joints[:, column])
    group["sprocket_height"] = np.array([motion.sprocket_height for motion in ordered])
    for walk, motion in zip(walks, ordered, strict=True):
        if motion.before_release is not None:
            write_before_release(motion.before_release, group.create_group(f"{BEFORE}/{walk}", track_order=True))
    checksums = b"".join(motion.checksum() for motion in ordered)
    group["checksum"] = np.frombuffer(checksums, np.uint8).reshape(-1, 32)


def read_motion(file: "h5py.File", walk: int) -> Motion:
    """The motion of a walk, out of its shard.

    Raises:
        KeyError: the shard does not have it.
        ValueError: it is damaged.
    """
    group = file[GROUP]
    (place,) = np.flatnonzero(group["walk"][()] == walk)
    samples, frames, joints = (
        slice(*group[f"{kind}_start"][place : place + 2]) for kind in ("series", "frame", "joint")
    )
    frame_time = group["frame_time"][frames]
    flat = np.stack([group[name][joints] for name in ("joint_x", "joint_y")], axis=-1)
    motion = Motion(
        series=np.stack([group[name][samples] for name in SERIES], axis=-1),
        frame_time=frame_time,
        frame_joints=flat.reshape(len(frame_time), -1, 2) if len(frame_time) else np.empty((0, 0, 2), np.float32),
        sprocket_height=float(group["sprocket_height"][place]),
        before_release=read_before_release(group[f"{BEFORE}/{walk}"]) if f"{BEFORE}/{walk}" in group else None,
    )
    if motion.checksum() != group["checksum"][place].tobytes():
        raise ValueError(f"motion of walk {walk}")
    return motion


def _starts(lengths: list[int]) -> NDArray[np.int64]:
    """Where each of some pieces in a row begins, and where the last one ends."""
    return np.cumsum([0, *lengths], dtype=np.int64)


def _put(group: "h5py.Group", name: str, values: NDArray[np.floating]) -> None:
    """Write one flat array."""
    dataset = group.create_dataset(name, data=values)
    dataset.attrs["unit"], dataset.attrs["description"] = (SERIES | FRAMES)[name]
