"""What figures need of a walk, whichever class holds it.

Room axes are X forward, Y up and Z = X × Y, to the right of the way the chain walks.
"""

from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.setup import Setup
from warpchain.loop.stationary_loop import StationaryLoop
from warpchain.status import Status

Array = NDArray[np.float64]

Kind = Literal["figure5", "film_strip", "loop", "energy", "tilt"]
"""Figures of a walk; `tilt` only of one whose plane tilts."""


@dataclass(frozen=True, kw_only=True)  # frozen: its attributes are only read
class Walk(Protocol):
    """A walk with t instants and f frames of a chain of n links.

    Attributes:
        setup: parameters, scene and options.
        status: how it ended.
        dx: distance walked [m]; NaN unless the chain came to rest.
        fell_at: when it was first tilted by 45° [s]; NaN if it never was.
        collapsed_at: when its loop collapsed [s]; NaN if it never did.
        energy: its ledger [J], see `WalkResult.energy`.
        time: time since the release [s], shape (t,).
        center: centre of mass x, y in the room [m], shape (t, 2).
        center_velocity: its velocity [m/s], shape (t, 2).
        center_z: centre of mass z [m], shape (t,); empty if the plane is fixed, like tilt and yaw.
        tilt: angle between the plane and the upright, positive if its top leans to the left [rad], shape (t,).
        yaw: heading of the plane, anticlockwise from above, all turns counted [rad], shape (t,).
        kinetic_energy, gravitational_energy, spring_energy: [J], shape (t,).
        frame_time: times of the frames [s], shape (f,).
        frame_joints: joints x, y in the plane [m], shape (f, n, 2); joint i ends link i.
        joints_in_room: joints x, y, z [m], shape (f, n, 3); None if the plane is fixed.
    """

    setup: Setup
    status: Status
    dx: float
    fell_at: float
    collapsed_at: float
    energy: dict[str, float]
    time: Array
    center: Array
    center_velocity: Array
    center_z: Array
    tilt: Array
    yaw: Array
    kinetic_energy: Array
    gravitational_energy: Array
    spring_energy: Array
    frame_time: Array
    frame_joints: Array

    @property
    def sprocket_center(self) -> Array | None:
        """Centre of the sprocket x, y at the release [m], shape (2,); None without one."""
        ...

    @property
    def sprocket_radius(self) -> float:
        """Radius of the sprocket that links touch [m]; NaN without one."""
        ...

    @property
    def joints_in_room(self) -> Array | None:
        """See above."""
        ...

    def mean_loop(self) -> StationaryLoop:
        """The mean loop just before the release; a ValueError if that was not kept."""
        ...


def kinds_of(walk: Walk) -> tuple[Kind, ...]:
    """The figures that a walk has, if it was recorded."""
    kinds: tuple[Kind, ...] = get_args(Kind)
    return tuple(kind for kind in kinds if kind != "tilt" or walk.joints_in_room is not None)


def checked_joints(walk: Walk) -> Array:
    """The joints of a walk in the room [m], shape (f, n, 3); z = 0 if its plane is fixed.

    Raises:
        ValueError: the walk has no frames or broken ones.
    """
    if len(walk.frame_time) == 0:
        raise ValueError(f"walk: it has no frames ({walk.status.label}); run it again with a frame_interval")
    in_room = walk.joints_in_room
    joints = np.insert(walk.frame_joints, 2, 0.0, axis=2) if in_room is None else np.asarray(in_room)
    if not np.all(np.isfinite(joints)):
        raise ValueError(f"walk: its frames are not all finite numbers. {walk.status.sentence}")
    return joints


def center_in_room(walk: Walk) -> Array:
    """Centre of mass x, y, z [m], shape (t, 3); z = 0 if the plane is fixed."""
    return np.column_stack([walk.center, np.zeros(len(walk.time)) if walk.joints_in_room is None else walk.center_z])


def setting(walk: Walk) -> str:
    """Links and frequency, as a title."""
    return walk.setup.described.replace(" at ", ", ", 1)
