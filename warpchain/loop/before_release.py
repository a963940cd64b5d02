"""The motion of a chain on its sprocket just before its release, and the forces and moments in its joints."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.hdf5_files import Contents

if TYPE_CHECKING:
    import h5py

Array = NDArray[np.float64]

FIELDS: Final[Mapping[str, tuple[str, str, tuple[str | int, ...]]]] = {
    "time": ("s", "time since the release, negative, shape (t,)", ("t",)),
    "center": ("m", "centre of mass x, y, shape (t, 2)", ("t", 2)),
    "center_velocity": ("m/s", "velocity of the centre of mass x, y, shape (t, 2)", ("t", 2)),
    "frame_time": ("s", "time of a frame since the release, negative, shape (f,)", ("f",)),
    "frame_joints": ("m", "joints x, y, shape (f, n, 2); joint i ends link i, even links inner", ("f", "n", 2)),
    "frame_forces": ("N", "force x, y in each joint on the link that it ends, shape (f, n, 2)", ("f", "n", 2)),
    "frame_moments": ("N m", "friction moment in each joint on the link that it ends, shape (f, n)", ("f", "n")),
}
"""Arrays of a `BeforeRelease`: name → unit, meaning and shape."""
_OF_JOINTS: Final = tuple(name for name, (_, _, shape) in FIELDS.items() if "n" in shape)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BeforeRelease:
    """A chain of n links on its sprocket: t instants and f frames just before its release.

    `FIELDS` has unit, meaning and shape of each array. Coordinates are those of the walk, with the sprocket at its
    height at the release. Forces are F = k C + b dC/dt with the stiffness and damping that the joints had then: they
    may be softened. Moments are positive counter-clockwise. On the link after a joint both act with the opposite sign.

    Raises:
        ValueError: an array does not have its shape, a time is not negative, or times do not ascend.
    """

    time: Array
    center: Array
    center_velocity: Array
    frame_time: Array
    frame_joints: Array
    frame_forces: Array
    frame_moments: Array

    def __post_init__(self) -> None:
        """Check that the arrays fit together."""
        sizes: dict[str | int, int] = {"t": len(self.time), "f": len(self.frame_time), "n": self.frame_joints.shape[1]}
        for name, (_, _, symbols) in FIELDS.items():
            shape, given = tuple(sizes.get(size, 2) for size in symbols), np.shape(getattr(self, name))
            if given != shape:
                raise ValueError(f"before_release.{name}: its shape is {given}; give an array of shape {shape}")
        if np.any(self.time >= 0) or np.any(self.frame_time >= 0):
            raise ValueError("before_release: a time is not negative; give times before the release")
        if not (is_ascending(self.time) and is_ascending(self.frame_time)):
            raise ValueError("before_release: times do not ascend; give them in order")

    def as_type(self, joints: type[np.floating[Any]]) -> "BeforeRelease":
        """A copy with joints, forces and moments in another precision."""
        return replace(self, **{name: getattr(self, name).astype(joints) for name in _OF_JOINTS})

    def __repr__(self) -> str:
        """One line."""
        span = -float(self.frame_time[0]) if len(self.frame_time) else 0.0
        return f"<BeforeRelease: {span:.3g} s, {len(self.time)} instants, {len(self.frame_time)} frames>"


def is_ascending(times: Array) -> bool:
    """Whether times are finite and none is before its predecessor."""
    return bool(np.isfinite(times).all() and (np.diff(times) >= 0).all())


def write_before_release(before: BeforeRelease, group: "h5py.Group") -> None:
    """Write the arrays and their units into a group."""
    for name, (unit, meaning, _) in FIELDS.items():
        dataset = group.create_dataset(name, data=getattr(before, name))
        dataset.attrs["unit"] = unit
        dataset.attrs["description"] = meaning


def read_before_release(group: Contents, joints: type[np.floating[Any]]) -> BeforeRelease:
    """Read what `write_before_release` wrote into a group.

    Args:
        group: the group.
        joints: precision of joints, forces and moments.

    Raises:
        KeyError: an array is missing.
        ValueError: the arrays do not fit together.
    """
    values = {
        name: group.array(name, joints if name in _OF_JOINTS else np.float64, (None,) * len(shape))
        for name, (_, _, shape) in FIELDS.items()
    }
    return BeforeRelease(**values)
