"""What figures need of a walk, whichever class holds it."""

from dataclasses import dataclass
from typing import Literal, Protocol, cast, get_args

import numpy as np
from numpy.typing import NDArray

from warpchain.loop.stationary_loop import HeldWalk
from warpchain.status import Status

Array = NDArray[np.float64]

Kind = Literal["figure5", "film_strip", "loop", "energy", "tilt"]
"""Figures of a walk; `tilt` only of one whose plane tilts."""


@dataclass(frozen=True, kw_only=True)  # frozen: its attributes are only read
class Walk(HeldWalk, Protocol):
    """A walk with t instants and f frames of a chain of n links.

    Attributes:
        status: how it ended.
        dx: distance walked [m]; NaN unless the chain came to rest.
        time: time since the release [s], shape (t,).
        center: centre of mass x, y [m], shape (t, 2).
        center_velocity: its velocity [m/s], shape (t, 2).
        frame_time: times of the frames [s], shape (f,).
        frame_joints: joints x, y [m], shape (f, n, 2); joint i ends link i.
    """

    status: Status
    dx: float
    time: Array
    center: Array
    center_velocity: Array
    frame_time: Array
    frame_joints: Array

    @property
    def sprocket_radius(self) -> float:
        """Radius of the sprocket that links touch [m]; NaN without one."""
        ...


class EnergyWalk(Walk, Protocol):
    """A walk with the energies of its chain.

    Attributes:
        energy: ledger of the walk [J], see `WalkResult.energy`.
        kinetic_energy: kinetic energy [J], shape (t,).
        gravitational_energy: energy in the field of gravity [J], shape (t,).
        spring_energy: energy of the joint springs [J], shape (t,).
    """

    energy: dict[str, float]
    kinetic_energy: Array
    gravitational_energy: Array
    spring_energy: Array


class TiltingWalk(Walk, Protocol):
    """A walk whose plane tilts. Room axes: X forward, Y up, Z = X × Y, to the right of the way the chain walks.

    Its `center` is in the room, its `frame_joints` are coordinates in the plane. It may also have `fell_at` and
    `collapsed_at`, the moments at which it was first tilted by 45° and at which its loop collapsed [s], or NaN.

    Attributes:
        joints_in_room: joints x, y, z [m], shape (f, n, 3); None if the plane is fixed.
        center_z: centre of mass z [m], shape (t,).
        tilt: angle between the plane and the upright, positive if its top leans to the left [rad], shape (t,).
        yaw: heading of the plane, anticlockwise from above, all turns counted [rad], shape (t,).
    """

    joints_in_room: Array | None
    center_z: Array
    tilt: Array
    yaw: Array


def tilting(walk: Walk) -> TiltingWalk | None:
    """The walk itself if its plane tilts, None if it is fixed."""
    return cast(TiltingWalk, walk) if getattr(walk, "joints_in_room", None) is not None else None


def kinds_of(walk: Walk) -> tuple[Kind, ...]:
    """The figures that a walk has, if it was recorded."""
    kinds: tuple[Kind, ...] = get_args(Kind)
    return tuple(kind for kind in kinds if kind != "tilt" or tilting(walk) is not None)


def check_frames(walk: Walk) -> None:
    """Refuse a walk that cannot be drawn.

    Raises:
        ValueError: the walk has no frames or broken ones.
    """
    if len(walk.frame_time) == 0:
        raise ValueError(f"walk: it has no frames ({walk.status.label}); run it again with a frame_interval")
    if not np.all(np.isfinite(walk.frame_joints)):
        raise ValueError(f"walk: its frames are not all finite numbers. {walk.status.sentence}")


def setting(walk: Walk) -> str:
    """Links and frequency, as a title."""
    return f"{walk.setup.scene.links} links, {walk.setup.scene.frequency:g} Hz"
