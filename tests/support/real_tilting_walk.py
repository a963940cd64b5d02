"""A short walk in a plane that tilts, run on a batch, as pictures need it."""

import math

import numpy as np

from tests.support.made_tilting_walks import Array, MadeWalk
from warpchain.engine.batch import Batch
from warpchain.inputs.setup import resolve
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels import layout
from warpchain.status import Status


def room_axes(planes: Array) -> Array:
    """Axes e1, e2, e3 in the room of planes, shape (…, PLANE_VALUES): (…, 3, 3)."""
    ahead, up = (planes[..., first : first + 3] for first in (layout.AHEAD, layout.UP))
    return np.stack([ahead, up, np.cross(ahead, up)], axis=-1)


def run_tilting_walk(tap: Array, *, links: int = 20, end: float = 0.4) -> tuple[MadeWalk, Array]:
    """Drop a circulating ring in a plane with a lateral speed [m/s] and rates ω1 and ω2 [rad/s].

    Returns:
        The walk, with a frame every 4 ms, and the height of its lowest point in each frame [m], shape (f,).
    """
    setup = resolve(
        "soft", scene={"links": links, "start": "ellipse"}, options={"method": "os32", "tolerance": 1e-4}, parameters={}
    )
    parameters = setup.parameters
    batch = Batch(1, links, setup.options, keeps_samples=True, frame_every=4, tilts=True)
    position, velocity = lay_chain(ellipse(1.0), links, parameters.link_length, 3.0)
    position[:, 1] += 0.05 + links * parameters.link_length / (2 * np.pi)
    batch.set_chain(0, parameters, links)
    batch.load(0, position, velocity, stop_time=end, stop_status=Status.TIME_LIMIT)
    plane = np.zeros(layout.PLANE_VALUES)
    plane[:3] = tap
    plane[layout.AHEAD] = plane[layout.UP + 1] = 1.0
    batch.set_plane(0, plane)
    parts = []

    def drain() -> None:
        """Take what a launch wrote, before the record is full."""
        planes = batch.record.frames.numpy()[0, :, -layout.PLANE_VALUES :].copy()
        frame_time, joints = batch.drain_frames(0)
        parts.append((batch.drain_samples(0), frame_time, joints, planes[: len(frame_time)]))

    batch.run([0], batch.features(fixed_body="floor", watch="rest", tilts=True), drain)
    drain()
    samples, frame_time, joints, planes = (np.concatenate(part) for part in zip(*parts, strict=True))
    origin = planes[:, None, layout.ORIGIN : layout.ORIGIN + 3]
    axes = room_axes(planes)
    angles = room_axes(samples[:, layout.PLANE_COLUMN : layout.PLANE_COLUMN + layout.PLANE_VALUES])
    fell_at, collapsed_at = batch.state.watch.numpy()[0, [layout.FELL_AT, layout.COLLAPSED_AT]]
    walk = MadeWalk(
        setup=setup,
        status=batch.status(0),
        dx=math.nan,
        time=samples[:, layout.TIME],
        center=samples[:, [layout.CENTER_X, layout.CENTER_Y]],
        center_velocity=samples[:, [layout.CENTER_U, layout.CENTER_V]],
        center_z=samples[:, layout.CENTER_Z],
        tilt=np.arcsin(angles[:, 2, 1]),
        yaw=np.unwrap(np.arctan2(-angles[:, 0, 2], angles[:, 0, 0])),
        fell_at=fell_at if fell_at >= 0 else math.nan,
        collapsed_at=collapsed_at if collapsed_at >= 0 else math.nan,
        frame_time=frame_time,
        frame_joints=joints,
        joints_in_room=origin + joints @ axes[:, :2],
        sprocket_center=None,
        sprocket_radius=math.nan,
    )
    return walk, np.interp(frame_time, samples[:, layout.TIME], samples[:, layout.LOWEST])
