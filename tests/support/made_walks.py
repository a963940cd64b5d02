"""Results of walks that nobody ran."""

import dataclasses
import math
from typing import Any, get_args

import numpy as np

from warpchain.chain.resolution import resolve
from warpchain.chain.setup import Setup
from warpchain.engine.tallies import CONTACTS
from warpchain.loop.stationary_loop import BeforeRelease
from warpchain.results.walk_result import WalkResult
from warpchain.status import Status
from warpchain.walks.landmarks import RELEASE
from warpchain.walks.outcome import ENERGIES
from warpchain.walks.walk_numbers import MOTION, NUMBERS


def make_walk(links: int = 30, **changes: Any) -> WalkResult:
    """A chain that rolls to the right as an ellipse, touches the floor and sinks flat: 0.8 s, 41 frames."""
    time, frame_time = np.linspace(0.0, 0.8, 801), np.linspace(0.0, 0.8, 41)

    def height(moment: np.ndarray) -> np.ndarray:
        return np.where(moment < 0.5, 0.0642 + 0.01 * np.cos(12 * moment), 0.06 * np.exp(8 * (0.5 - moment)))

    center = np.stack([time**2, height(time)], axis=1)
    angle = -40 * frame_time[:, None] + 2 * np.pi * np.arange(links) / links
    half_height = height(frame_time) - 0.0042 - 0.005 * np.maximum(0.0, np.cos(12 * frame_time))
    offset = np.stack([0.04 * np.cos(angle), half_height[:, None] * np.sin(angle)], axis=2)
    middle = np.stack([frame_time**2, height(frame_time)], axis=1)
    rng = np.random.default_rng(5)
    values: dict[str, Any] = {
        "status": Status.AT_REST,
        "dx": 0.64 + 1e-17,
        "walk_time": 0.8,
        "simulated_time": 3.3,
        "hold_time": 0.4,
        "drift": 0.002,
        "self_contact_at": 0.45,
        "wall_time": 1.23456789012345678,
        "bounces": 3,
        "steps_accepted": 123_456_789_012,
        "steps_rejected": 17,
        "impulses": dict(zip(CONTACTS, (5, 7, 11), strict=True)),
        "greatest_opening": 1.1e-5,
        "greatest_penetration": dict(zip(CONTACTS, (1e-5, 0.0, 2e-5), strict=True)),
        "energy": {key: 0.1 * number for number, key in enumerate(ENERGIES)} | {"residual": 1e-6},
        "sprocket_height": 0.1,
        "release": {key: 0.01 * number for number, key in enumerate(RELEASE)},
        "release_speed": 3.7,
        "setup": resolve("soft", scene={"links": links}, options={"method": "dp5"}, parameters={"floor_friction": 0.3}),
        "seed": 2**100 + 1,
        "versions": {"warpchain": "0.1.0", "warp-lang": "1.19.0"},
        "time": time,
        "center": center,
        "center_velocity": np.gradient(center, time, axis=0),
        "kinetic_energy": rng.random(801),
        "gravitational_energy": rng.random(801),
        "spring_energy": rng.random(801),
        "lowest": rng.random(801),
        "rms_speed": rng.random(801),
        "frame_time": frame_time,
        "frame_joints": offset + middle[:, None],
    }
    return WalkResult(**(_unset(links) | values | changes))


def made_setup(**scene: Any) -> Setup:
    """The setup of a made walk with something else in its scene."""
    return resolve("soft", scene={"links": 30, **scene}, options={"method": "dp5"}, parameters={})


def _unset(links: int) -> dict[str, Any]:
    """Every number and array of a walk that has none of them."""
    sizes = {"t": 0, "f": 0, "n": links, "2": 2, "3": 3}
    empty = {name: np.empty([sizes[size] for size in stored.shape.split()]) for name, stored in MOTION.items()}
    types = {item.name: get_args(item.type) for item in dataclasses.fields(WalkResult)}
    return empty | {name: -1 if types[name][0] is int else math.nan for name in NUMBERS}


def make_unreleased() -> WalkResult:
    """A walk that ended on the sprocket: no series, no frames, no distance."""
    unset = _unset(30)
    gone = {name: unset[name] for name in (*MOTION, "dx", "sprocket_height")}
    return make_walk(status=Status.NOT_STEADY, energy=dict.fromkeys(ENERGIES, math.nan), seed=None, **gone)


def assert_same(first: Any, second: Any, *but: str) -> None:
    """Every field is equal, numbers to the bit and in type, but for those that are named."""
    for name in {item.name for item in dataclasses.fields(first)} - {*but}:
        one, other = getattr(first, name), getattr(second, name)
        assert type(one) is type(other), name
        if isinstance(one, np.ndarray):
            assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes()), name
        elif isinstance(one, BeforeRelease):
            assert_same(one, other)
        else:
            assert repr(one) == repr(other), name
