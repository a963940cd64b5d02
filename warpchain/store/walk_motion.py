"""A walk of a sweep whose motion was kept, read from the sweep's folder when it is asked for."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.scene import contact_radius
from warpchain.inputs.setup import Setup
from warpchain.loop.before_release import BeforeRelease
from warpchain.status import Status
from warpchain.store.manifest import Manifest
from warpchain.store.shards import read_motions
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.walks.drawn import Drawn
from warpchain.walks.moving_plane import in_room
from warpchain.walks.walk_result import STORED

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WalkMotion(Drawn):
    """The motion of one walk of a sweep: t instants and f frames of a chain of n links; none if it was never released.

    Attributes:
        index: number of the walk in its sweep.
        status: how it ended.
        dx: distance walked [m]; NaN unless it came to rest.
        setup: what it is.
        time: time since the release [s], shape (t,).
        center: centre of mass x, y [m], shape (t, 2), where x is as in `WalkResult`.
        center_velocity: its velocity [m/s], shape (t, 2).
        frame_time: times of the frames [s], shape (f,).
        frame_joints: joints x, y [m], shape (f, n, 2); kept to single precision.
        center_z, tilt, yaw: as of `WalkResult`; empty if the plane is fixed, like the next ones.
        frame_origin, frame_axes: as of `WalkResult`.
        sprocket_center: centre of the sprocket at the release [m], shape (2,); None without one.
        sprocket_radius: radius of the sprocket that links touch [m]; NaN without one.
        before_release: its motion just before the release, kept to single precision; None if it was not kept.
    """

    index: int
    status: Status
    dx: float
    setup: Setup
    time: Array
    center: Array
    center_velocity: Array
    frame_time: Array
    frame_joints: Array
    center_z: Array
    tilt: Array
    yaw: Array
    frame_origin: Array
    frame_axes: Array
    sprocket_center: Array | None
    sprocket_radius: float
    before_release: BeforeRelease | None = None

    def facts(self) -> list[tuple[str, str]]:
        """Names and values that a notebook shows beside the picture."""
        return [
            ("number in the sweep", str(self.index)),
            *super().facts(),
            ("kept", f"{len(self.time)} instants, {len(self.frame_time)} frames"),
        ]

    def __repr__(self) -> str:
        """One line."""
        counts = f"{len(self.time)} instants, {len(self.frame_time)} frames"
        return f"<WalkMotion {self.index} {self.status.label}: dx {self.dx:.4g} m, {counts}>"

    @property
    def joints_in_room(self) -> Array | None:
        """As of `WalkResult`."""
        if self.setup.scene.plane == "fixed":
            return None
        return in_room(self.frame_joints, self.frame_origin, self.frame_axes)

    def unit(self, name: str) -> str:
        """SI unit of an array; a `KeyError` if there is none of that name."""
        return STORED[name].unit

    def meaning(self, name: str) -> str:
        """One line saying what an array is; a `KeyError` if there is none of that name."""
        return STORED[name].meaning


@dataclass(frozen=True)
class MotionReader:
    """Reads the motions of a sweep.

    Attributes:
        directory: absolute path of the sweep's folder.
        manifest: its manifest.
    """

    directory: str | os.PathLike[str]
    manifest: Manifest

    @cached_property
    def sweep(self) -> Sweep:
        """The sweep, checked."""
        return load_sweep(self.manifest.sweep)

    def walk(self, index: int, row: Mapping[str, Any]) -> WalkMotion:
        """A walk whose motion is kept.

        Args:
            index: its number.
            row: its status and distance.

        Raises:
            OSError: its shard cannot be read.
            InputError: its shard is damaged or foreign.
        """
        motion = read_motions(self.directory, self.manifest, [index])[index]
        setup = self.sweep.planned(index).setup
        has_sprocket = not math.isnan(motion.sprocket_height)
        return WalkMotion(
            index=index,
            status=Status(int(row["status"])),
            dx=float(row["dx"]),
            setup=setup,
            time=motion.series[:, 0],
            center=motion.series[:, 1:3],
            center_velocity=motion.series[:, 3:5],
            frame_time=motion.frame_time,
            frame_joints=motion.frame_joints.astype(np.float64),
            center_z=motion.plane_series[:, 0],
            tilt=motion.plane_series[:, 1],
            yaw=motion.plane_series[:, 2],
            frame_origin=motion.frame_planes[:, :3],
            frame_axes=motion.frame_planes[:, 3:].reshape(-1, 2, 3),
            sprocket_center=np.array([0.0, motion.sprocket_height]) if has_sprocket else None,
            sprocket_radius=contact_radius(setup.scene, setup.parameters) if has_sprocket else math.nan,
            before_release=None if motion.before_release is None else motion.before_release.as_type(np.float64),
        )
