"""The motion of a chain on its sprocket just before its release, and the forces and moments in its joints."""

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.hdf5_files import Stored, stored_fields

Array = NDArray[np.float64]

BEFORE: Final = "before_release"
"""Name of the motion before the release, among the arrays of a walk and in its file."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BeforeRelease:
    """A chain of n links on its sprocket: t instants and f frames just before its release.

    Unit, meaning and shape stand beside each array. Coordinates are those of the walk, with the sprocket at its
    height at the release. Forces are F = k C + b dC/dt with the stiffness and damping that the joints had then: they
    may be softened. Moments are positive counter-clockwise. On the link after a joint both act with the opposite sign.
    """

    time: Annotated[Array, Stored("s", "time since the release, negative", "t")]
    center: Annotated[Array, Stored("m", "centre of mass x, y", "t 2")]
    center_velocity: Annotated[Array, Stored("m/s", "velocity of the centre of mass x, y", "t 2")]
    frame_time: Annotated[Array, Stored("s", "time of a frame since the release, negative", "f")]
    frame_joints: Annotated[Array, Stored("m", "joints x, y; joint i ends link i, even links inner", "f n 2")]
    frame_forces: Annotated[Array, Stored("N", "force x, y in each joint on the link that it ends", "f n 2")]
    frame_moments: Annotated[Array, Stored("N m", "friction moment in each joint on the link that it ends", "f n")]


FIELDS: Final[dict[str, Stored]] = stored_fields(BeforeRelease)
"""Arrays of a `BeforeRelease`: name → unit, meaning and shape."""
