"""The motions of walks inside a shard: flat arrays, in which one walk follows the other.

motion/walk            places of the walks in the folder, ascending
motion/series_start    where the samples of each walk begin, and where the last one's end
motion/time …          the samples, see `SERIES`
motion/plane_start     likewise of the samples of walks whose plane tilts: motion/center_z, tilt, yaw
motion/frame_start     likewise of the frames
motion/frame_time      times of the frames [s]
motion/frame_plane_start likewise of the planes of these frames: motion/origin_x …, x_axis_x …, y_axis_x …
motion/joint_start     likewise of the joints
motion/joint_x, _y     joints of all frames, frame by frame [m]
motion/sprocket_height height of the sprocket's centre at the release [m]; NaN without a sprocket
motion/before_release/ a group for each walk of which that was kept, named by its place, see `before_release`
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.hdf5_files import ContentError, Contents
from warpchain.loop.before_release import is_ascending, read_before_release, write_before_release
from warpchain.walks.motion import FRAME_PLANE, PLANE_SERIES, SERIES, Motion

if TYPE_CHECKING:
    import h5py

ARRAYS: Final = {
    "series": SERIES,
    "plane": PLANE_SERIES,
    "frame": {"frame_time": ("s", "time of a frame since the release")},
    "frame_plane": FRAME_PLANE,
    "joint": {
        "joint_x": ("m", "x of a joint in a frame"),
        "joint_y": ("m", "height of a joint in a frame above the floor"),
    },
}
"""Flat arrays: what is counted → name → unit and meaning. Joints are in single precision (6e-8 of their distance)."""

_TYPES: Final = {**dict.fromkeys(("series", "plane", "frame", "frame_plane"), np.float64), "joint": np.float32}
GROUP: Final = "motion"
BEFORE: Final = "before_release"


def flat_arrays(motion: Motion) -> dict[str, dict[str, NDArray[Any]]]:
    """The numbers of one walk in the order of `ARRAYS`: what is counted → name → array of that length."""
    joints = motion.frame_joints.reshape(-1, 2)
    return {
        "series": {name: motion.series[:, column] for column, name in enumerate(SERIES)},
        "plane": {name: motion.plane_series[:, column] for column, name in enumerate(PLANE_SERIES)},
        "frame": {"frame_time": motion.frame_time},
        "frame_plane": {name: motion.frame_planes[:, column] for column, name in enumerate(FRAME_PLANE)},
        "joint": {"joint_x": joints[:, 0], "joint_y": joints[:, 1]},
    }


def count(arrays: Mapping[str, NDArray[Any]]) -> int:
    """Length that some flat arrays have in common."""
    return len(next(iter(arrays.values())))


def write_motions(motions: Mapping[int, Motion], file: "h5py.File") -> None:
    """Put the motions of walks, by place, into a shard."""
    walks = sorted(motions)
    flat = [flat_arrays(motions[walk]) for walk in walks]
    group = file.create_group(GROUP, track_order=True)
    group["walk"] = np.array(walks, np.int64)
    for kind, columns in ARRAYS.items():
        group[f"{kind}_start"] = np.cumsum([0, *(count(arrays[kind]) for arrays in flat)], dtype=np.int64)
        for name, (unit, meaning) in columns.items():
            dataset = group.create_dataset(name, data=np.concatenate([arrays[kind][name] for arrays in flat]))
            dataset.attrs["unit"], dataset.attrs["description"] = unit, meaning
    group["sprocket_height"] = np.array([motions[walk].sprocket_height for walk in walks])
    for walk in walks:
        if (before := motions[walk].before_release) is not None:
            write_before_release(before, group.create_group(f"{BEFORE}/{walk}", track_order=True))


def read_motion(motions: Contents, place: int) -> Motion:
    """The motion of the walk at a place, out of the group of its shard.

    Raises:
        KeyError: the shard does not have it.
        ValueError: it is damaged.
    """
    walks = motions.array("walk", np.int64, (None,))
    found = np.flatnonzero(walks == place)
    if len(found) != 1:
        raise ContentError(f"the motion of the walk at place {place} is not there")
    row = int(found[0])
    series, plane_series, (frame_time,), frame_planes, joints = (
        [motions.array(name, _TYPES[kind], (None,), _range_of(motions, kind, row, len(walks))) for name in columns]
        for kind, columns in ARRAYS.items()
    )
    if not (is_ascending(series[0]) and is_ascending(frame_time)):
        raise ContentError(f"times of the walk at place {place} do not ascend")
    shape = (len(frame_time), -1, 2) if len(frame_time) else (0, 0, 2)
    before = f"{BEFORE}/{place}"
    return Motion(
        series=np.stack(series, axis=-1),
        plane_series=np.stack(plane_series, axis=-1),
        frame_time=frame_time,
        frame_joints=np.stack(joints, axis=-1).reshape(shape),
        frame_planes=np.stack(frame_planes, axis=-1),
        sprocket_height=float(motions.array("sprocket_height", np.float64, (len(walks),))[row]),
        before_release=read_before_release(motions.part(before), np.float32) if motions.has(before) else None,
    )


def _range_of(motions: Contents, kind: str, row: int, count: int) -> slice:
    """Where the numbers of the walk in some row are in the flat arrays of a kind."""
    starts = motions.array(f"{kind}_start", np.int64, (count + 1,))
    if starts[0] != 0 or (np.diff(starts) < 0).any():
        raise ContentError(f"{GROUP}/{kind}_start does not ascend from 0")
    return slice(int(starts[row]), int(starts[row + 1]))
