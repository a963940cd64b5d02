"""Waves along a chain: computations on made frames, and the space–time picture."""

from typing import Any

import numpy as np
import pytest

from studies.waves.fields import characteristic, curvatures, normal_velocities, stacked_power, tensions
from studies.waves.picture import waves_figure
from tests.support.made_walks import make_walk

LINKS = 40
MASSES = np.tile([0.003, 0.002], LINKS // 2)
RADIUS = 0.1  # m, of the ring
LENGTH = 2 * RADIUS * np.sin(np.pi / LINKS)  # m, of a link
SPEED = 3.0  # m/s, of the ring's joints
MIDDLE = 0.13  # m, height of the ring's centre


def ring(time: np.ndarray, *, speed: float = SPEED, bumps: Any = 0.0) -> np.ndarray:
    """A ring that turns clockwise and moves on at 1 m/s: joints (f, n, 2); ``bumps`` [m] add to its radius."""
    angle = -2 * np.pi * np.arange(LINKS) / LINKS - speed / RADIUS * time[:, None]
    radius = RADIUS + bumps
    return np.stack([radius * np.cos(angle) + time[:, None], radius * np.sin(angle) + MIDDLE], axis=2)


def wave(time: np.ndarray, speed: float, height: float = 1e-3) -> np.ndarray:
    """A bump [m] that is at joint 10 at time 0 and runs at this speed along the chain, (f, n)."""
    place = 10 + speed * time[:, None] / LENGTH
    apart = (np.arange(LINKS) - place + LINKS / 2) % LINKS - LINKS / 2
    return height * np.exp(-((apart / 2) ** 2))


def test_a_ring_has_constant_fields() -> None:
    """Of a turning ring: curvature 1/R to (π/n)², no velocity across it, the tension put on it."""
    time = np.linspace(0.0, 0.02, 201)
    joints = ring(time)
    center = np.stack([time, np.full(201, MIDDLE)], axis=1)[:, None]
    outward = (joints - center) / RADIUS
    along = np.stack([outward[..., 1], -outward[..., 0]], axis=2)
    np.testing.assert_allclose(tensions(joints, 7.0 * along + 2.0 * outward), 7.0, rtol=1e-9)
    np.testing.assert_allclose(curvatures(joints, LENGTH), 1 / RADIUS, rtol=2e-3)
    inner = slice(1, -1)  # one-sided differences at both ends are less accurate
    assert np.abs(normal_velocities(time, joints, MASSES)[inner]).max() < 1e-4 * SPEED


@pytest.mark.parametrize("speed", [2.2, -2.2])
def test_a_wave_follows_its_characteristic(speed: float) -> None:
    """Of bumps that run at a known speed, the crest of the curvature stays on the line; the stack finds the speed."""
    time = np.linspace(0.0, 0.08, 161)
    joints = ring(time, bumps=wave(time, speed))
    bend = curvatures(joints, LENGTH)
    path = characteristic(time, np.full(161, speed), 0, 10, LENGTH)
    assert path[-1] - path[0] == pytest.approx(speed * 0.08 / LENGTH)
    crest = np.argmax(bend, axis=1)
    apart = (crest - path + LINKS / 2) % LINKS - LINKS / 2
    assert np.abs(apart).max() <= 0.75
    ratios = np.arange(-1.5, 1.55, 0.05)
    power = [stacked_power(bend, ratio * (path - path[0])) for ratio in ratios]
    assert ratios[np.argmax(power)] == pytest.approx(1.0)
    assert max(power) > 0.97 and min(power) < 0.2
    assert stacked_power(bend, path - path[0], (3, 3)) > 0.97 > 0.2 > stacked_power(bend, path[0] - path, (3, 3))
    assert stacked_power(np.ones((5, LINKS)), np.arange(5.0)) == 0.0


@pytest.mark.parametrize("colour", ["curvature", "velocity"])
def test_the_picture(colour: Any) -> None:
    """Of a ring twice at the floor, with a wave: both frames, four characteristics from each impact."""
    time = np.arange(0.0, 0.3, 2e-4)
    joints = ring(time, bumps=wave(time, SPEED))
    joints[..., 1] += 0.0042 - MIDDLE + RADIUS + 0.02 * np.abs(np.cos(20 * time))[:, None] - 1e-5
    ahead = np.roll(joints, -1, axis=1) - np.roll(joints, 1, axis=1)
    forces = 9.0 * ahead / np.linalg.norm(ahead, axis=2, keepdims=True)
    frames = {"frame_time": time, "frame_joints": joints, "frame_moments": np.zeros(joints.shape[:2])}
    walk = make_walk(LINKS, **frames, frame_forces=forces)
    figure = waves_figure(walk, colour=colour, window=(0.02, 0.28))
    figure.draw_without_rendering()
    own, room, _ = figure.axes
    assert len(own.lines) == len(room.lines) == 8 and len(own.images) == len(room.images) == 1
    assert own.get_xlim() == pytest.approx((0.02, 0.28), abs=3e-4) and own.get_ylim() == (-0.5, LINKS - 0.5)
    length = LINKS * walk.setup.parameters.link_length
    for axes, around in ((own, LINKS), (room, length)):  # no contact is drawn across its panel
        drawn = [segment for lines in axes.collections for segment in lines.get_segments()]
        assert drawn and max(np.abs(np.diff(segment[:, 1])).max(initial=0.0) for segment in drawn) < around / 2
