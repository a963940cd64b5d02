"""The loop on its sprocket: its mean against curves that are known, and its figure."""

import numpy as np
import pytest

from tests.support.made_walks import make_walk
from tests.support.presets import SOFT
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.loop.stationary_loop import BeforeRelease, StationaryLoop, average_frames

LENGTH, MASS = SOFT.link_length, (SOFT.inner_mass + SOFT.outer_mass) / 2
RATE = 591.3  # links a second


def frames_of(joints: np.ndarray, forces: np.ndarray | None = None) -> BeforeRelease:
    """Frames (f, n, 2), 2 ms apart, without moments and, unless given, without forces."""
    time = 2e-3 * (np.arange(len(joints)) - len(joints))
    return BeforeRelease(
        time=time,
        center=np.zeros((len(time), 2)),
        center_velocity=np.zeros((len(time), 2)),
        frame_time=time,
        frame_joints=joints,
        frame_forces=np.zeros_like(joints) if forces is None else forces,
        frame_moments=np.zeros(joints.shape[:2]),
    )


def average(before: BeforeRelease, top: float) -> StationaryLoop:
    """The mean loop of frames whose highest joints pass at some height [m] over the origin, where a sprocket ends."""
    return average_frames(before, SOFT, MASS, np.array([0.0, top - 0.01]), 0.01)


def make_ring(links: int, frames: int = 100) -> tuple[BeforeRelease, float, float]:
    """A regular polygon that turns clockwise without gravity; its radius [m] and the tension in its joints [N].

    Links of mass m at the apothem a turn at Ω: 2 F sin(π/n) = m a Ω², F along the circle through the joints.
    """
    radius = LENGTH / (2 * np.sin(np.pi / links))
    turning = 2 * np.pi * RATE / links
    moved = RATE * 2e-3 * (np.arange(frames) - frames)
    angle = -2 * np.pi * (np.arange(links) + moved[:, None]) / links
    radial = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    tension = MASS * radius * np.cos(np.pi / links) * turning**2 / (2 * np.sin(np.pi / links))
    along = np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
    return frames_of(radius * radial, tension * along), radius, tension


def test_a_ring_has_its_radius_speed_and_tension() -> None:
    """A turning polygon: curvature 1/R, tension as momentum wants it, nothing beyond that, no shear, no spread."""
    before, radius, tension = make_ring(30)
    loop = average(before, radius)
    np.testing.assert_allclose(loop.curvature, 1 / radius, rtol=1e-9)
    np.testing.assert_allclose(loop.bending, 0.0, atol=1e-6 / radius)
    np.testing.assert_allclose(loop.tension, tension, rtol=1e-9)
    assert loop.speed == pytest.approx(LENGTH * RATE, rel=1e-9)
    assert loop.length == pytest.approx(2 * np.pi * radius, rel=1e-9)
    # cot is expanded to second order: 2π/n to the fourth over 720 is left
    np.testing.assert_allclose(loop.effective_tension, 0.0, atol=1.1 * (2 * np.pi / 30) ** 4 / 720 * tension)
    np.testing.assert_allclose(loop.shear, 0.0, atol=1e-9 * tension)
    np.testing.assert_allclose(loop.angle, loop.s / radius, atol=1e-9)
    assert loop.spread.max() < 3e-6 * radius
    assert abs(np.interp(0.0, loop.s, loop.position[:, 0])) < 1e-6


def test_an_ellipse_has_its_curvature() -> None:
    """Joints that follow an ellipse: curvature at bottom and flank, and its slope, are the ellipse's."""
    links, speed = 120, LENGTH * RATE
    shape = ellipse(1.5)
    phases = (0.382 * np.arange(200)) % 1.0
    joints = []
    for number, phase in enumerate(phases):
        position, _ = lay_chain(shape, links, LENGTH, speed, float(phase))
        half = LENGTH / 2 * np.stack([np.cos(position[:, 2]), np.sin(position[:, 2])], axis=1)
        ends = position[:, :2] + half
        joints.append(np.roll(ends, -number, axis=0))
    middle = np.mean(joints[0], axis=0)
    frames = np.array(joints) - middle
    a, b = np.ptp(frames[..., 1]) / 2, np.ptp(frames[..., 0]) / 2
    loop = average(frames_of(frames), a)
    assert a / b == pytest.approx(1.5, rel=1e-3)
    assert loop.bottom_curvature == pytest.approx(a / b**2, rel=1e-3)
    flank = np.interp(-np.pi / 2, loop.angle, loop.curvature)
    assert flank == pytest.approx(b / a**2, rel=1e-3)
    slope = (np.roll(loop.curvature, -1) - np.roll(loop.curvature, 1)) / (2 * (loop.s[1] - loop.s[0]))
    np.testing.assert_allclose(loop.bending, slope, atol=2e-2 * np.abs(slope).max())
    np.testing.assert_allclose(loop.s[len(loop.s) // 2], 0.0, atol=1e-12)


def test_what_makes_no_mean_loop_is_refused() -> None:
    """Too few frames, a loop that stands, runs backwards or is nowhere free, and a walk without frames of the time."""
    before, radius, _ = make_ring(30)
    for joints, problem in (
        (before.frame_joints[:5], "5 frames are too few"),
        (before.frame_joints[::-1], "expected a loop that circulates clockwise"),
        (np.repeat(before.frame_joints[:1], 20, axis=0), "expected a loop that circulates clockwise"),
    ):
        with pytest.raises(ValueError, match=problem):
            average(frames_of(joints), radius)
    with pytest.raises(ValueError, match="expected a loop that hangs on a sprocket"):
        average_frames(before, SOFT, MASS, np.zeros(2), radius)
    with pytest.raises(ValueError, match="record_before"):
        make_walk().plot("loop")
