"""Walks whose plane tilts that nobody ran."""

import math
from typing import Any

import numpy as np

from tests.support.arrays import Array
from tests.support.made_walks import make_walk
from warpchain.chain.resolution import resolve
from warpchain.results.walk_result import WalkResult


def plane_axes(tilt: Array, yaw: Array) -> Array:
    """Axes e1 and e2 in the room of planes with these tilts and headings [rad], shape (…,) each: (…, 2, 3)."""
    ahead = np.stack([np.cos(yaw), 0 * yaw, -np.sin(yaw)], axis=-1)
    aside = np.stack([np.sin(yaw), 0 * yaw, np.cos(yaw)], axis=-1)
    upward = np.cos(tilt)[..., None] * np.array([0.0, 1.0, 0.0]) - np.sin(tilt)[..., None] * aside
    return np.stack([ahead, upward], axis=-2)


def make_tilting_walk(links: int = 30, frames: int = 41, **changes: Any) -> WalkResult:
    """A ring that rolls forward on its edge, turns to the left and falls over to the left within 1 s."""
    time, frame_time = np.linspace(0.0, 1.0, 801), np.linspace(0.0, 1.0, frames)
    setup = resolve("soft", scene={"links": links, "plane": "tilting"}, options={"method": "explicit"}, parameters={})
    parameters = setup.parameters
    radius = parameters.link_length / (2 * math.sin(math.pi / links))

    def middle(moment: Array) -> tuple[Array, Array, Array]:
        tilt = math.radians(88.0) * np.clip(moment / 0.8, 0.0, 1.0) ** 3
        yaw, rim = 0.6 * moment**2, parameters.circle_radius
        height = (radius + rim) * np.cos(tilt) + parameters.half_width * np.abs(np.sin(tilt))
        place = [0.6 * np.sin(moment), height, -0.15 * moment**2 - radius * np.sin(tilt)]
        return np.stack(place, axis=-1), tilt, yaw

    center, tilt, yaw = middle(time)
    place, lean, heading = middle(frame_time)
    angle = -8 * frame_time[:, None] + 2 * np.pi * np.arange(links) / links
    values: dict[str, Any] = {
        "setup": setup,
        "dx": float(center[-1, 0]),
        "time": time,
        "center": center[:, :2],
        "center_velocity": np.gradient(center[:, :2], time, axis=0),
        "center_z": center[:, 2],
        "tilt": tilt,
        "yaw": yaw,
        "fell_at": float(time[np.argmax(tilt > math.pi / 4)]),
        "frame_time": frame_time,
        "frame_joints": radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1),
        "frame_origin": place,
        "frame_axes": plane_axes(lean, heading),
        "sprocket_height": 0.07,
    }
    return make_walk(links, **(values | changes))
