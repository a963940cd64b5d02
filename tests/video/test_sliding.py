"""The friction of a floor is the slope of way against lift, and its error holds."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from tests.support.made_videos import motion
from warpchain import InputError, video

EXACT = motion(0.3).seen(video.Camera(), np.zeros(9), np.random.default_rng(0))


def test_line_of_a_sliding_body_is_its_friction() -> None:
    """A body that obeys Coulomb's law is recorded 200 times with all errors of a camera: σ and 2 σ hold."""
    camera, sizes = video.Camera(), []
    for seed in range(200):
        random = np.random.default_rng(seed)
        friction = random.uniform(0.1, 0.5)
        clip = motion(friction, random.uniform(0.006, 0.014)).seen(camera, camera.errors(random), random)
        line = video.friction_line(clip, camera)
        sizes.append((line.friction - friction) / line.error)
    assert abs(np.mean(sizes)) < 0.25
    assert 0.6 < np.mean(np.abs(sizes) < 1) < 0.85
    assert 0.91 < np.mean(np.abs(sizes) < 2)


def test_slow_loops_are_known_less() -> None:
    """The slower the loop, the sooner it sticks: the fit ends earlier and the error is larger."""
    slow, fast = (
        video.friction_line(motion(0.27, frequency=hz).seen(video.Camera(), np.zeros(9), np.random.default_rng(0)))
        for hz in (5.0, 20.0)
    )
    assert slow.end < fast.end and slow.error > 2 * fast.error


@pytest.mark.parametrize(
    ("changes", "camera", "wrong"),
    [
        ({}, video.Camera(noise=1e-4), "camera.noise: expected .* noise before the release"),
        ({}, video.Camera(fps=120.0), "camera.fps: .* got 120; .* slow motion, fps of read"),
        ({"time": EXACT.time - 1e300}, video.Camera(), r"video: expected .* got -1"),
        ({"time": EXACT.time + 0.1}, video.Camera(), r"video: expected .* got 0\.00"),
        ({"time": EXACT.time - 0.012}, video.Camera(), "expected free fall .*; check unit, fps and release"),
        ({"time": EXACT.time * 8}, video.Camera(fps=30), "expected free fall .*; check unit, fps and release"),
        ({"center": EXACT.center * [-1, 1]}, video.Camera(), r"direction: .* backwards; use the other direction"),
        ({"time": np.where(EXACT.time > 0.3, np.nan, EXACT.time)}, video.Camera(), r"time: expected finite"),
        ({"center": np.where(EXACT.center < 0, np.inf, EXACT.center)}, video.Camera(), r"center: expected finite"),
        ({"center": EXACT.center[1:]}, video.Camera(), r"video\.center: expected shape"),
        ({"time": EXACT.time * 1.02}, video.Camera(), r"camera\.fps: .* 235\.3 frames per second, got 240"),
        (
            {"center": EXACT.center.round(2)},
            video.Camera(),
            r"camera\.noise: .* rounding error, 0\.0029 m, .*; export more digits",
        ),
        ({"center": EXACT.center * [0, 1]}, video.Camera(), r"camera\.noise: .* rounding error, inf m"),
        (
            {"center": EXACT.center * [-0.03, 1]},
            video.Camera(),
            r"expected a floor_friction of 0 to 3, got -0\.0\d+; check",
        ),
        ({"links": 120}, video.Camera(), r"video\.links: 120 are too many; use at most 100"),
        ({"speed": 754.0}, video.Camera(), r"speed: expected speed/\(2πf\) of .*, got 6 m; check"),
    ],
)
def test_a_video_that_is_not_what_it_says_is_refused(
    changes: dict[str, np.ndarray], camera: video.Camera, wrong: str
) -> None:
    """Noise, frame rate, times, a mirrored picture, numbers that are not finite, links, and speed in another unit."""
    with pytest.raises(InputError, match=wrong):
        video.friction_line(dataclasses.replace(EXACT, **changes), camera)


def test_rounded_tables_of_quiet_cameras_have_the_error_of_their_steps() -> None:
    """Numbers before the release are all alike, and scatter is none: 36 videos, rounded to the mm, hold within 3 σ."""
    sizes = []
    for seed in range(36):
        random = np.random.default_rng(seed)
        friction = random.uniform(0.15, 0.4)
        clip = motion(friction, random.uniform(0.006, 0.014)).seen(
            video.Camera(noise=1e-5), video.Camera().errors(random), random
        )
        rounded = dataclasses.replace(clip, center=clip.center.round(3))
        assert rounded.rounding == pytest.approx(1e-3 / np.sqrt(12)) and clip.rounding < 1e-6
        line = video.friction_line(rounded)
        sizes.append((line.friction - friction) / line.error)
    assert np.max(np.abs(sizes)) < 3 and np.mean(np.abs(sizes) < 1.96) > 0.9


def test_a_clock_that_is_not_exact_makes_errors_grow() -> None:
    """A clock 1 % slow makes μ too large by 7 standard errors if it is believed; allowed for, it is within two."""
    sizes = []
    for clock in (1e-9, 1e-2):
        camera = video.Camera(noise=1e-4, release=2e-4, scale=1e-3, roll=1e-3, clock=clock)
        clip = motion(0.27).seen(camera, np.append(np.zeros(8), -1e-2), np.random.default_rng(0))
        line = video.friction_line(clip, camera)
        sizes.append((line.friction - 0.27) / line.error)
    assert abs(sizes[1]) < 2 < sizes[0] / 2
    clip = motion(0.27).seen(video.Camera(), np.zeros(9), np.random.default_rng(0))
    believed = video.friction_line(clip, video.Camera(clock=1e-9))
    assert video.friction_line(clip).error > 1.1 * believed.error


@pytest.mark.parametrize("gone", [5, 10])
def test_a_video_that_falls_faster_than_g_is_refused(gone: int) -> None:
    """A body that is thrown up falls freely for 0.3 s; with every tenth frame gone it seems to fall with 12 m/s²."""
    time = np.arange(-0.14, 0.6, 1 / 240)
    flying = np.clip(time - 0.15, 0, None)
    body = motion(0.27)
    place = [np.interp(np.minimum(time, 0.15), body.time, column) for column in body.center.T]
    up = np.where(time > 0.15, 1.4 * flying - 9.809 / 2 * flying**2, 0)
    noise = np.random.default_rng(0).normal(size=(len(time), 2)) * 4e-4
    clip = dataclasses.replace(body, time=time, center=np.column_stack([place[0], place[1] + up]) + noise)
    clip.check(video.Camera())
    kept = np.arange(len(time)) % gone != 3
    dropped = dataclasses.replace(clip, time=time[0] + np.arange(kept.sum()) / 240, center=clip.center[kept])
    shift = clip.time[np.argmax(clip.time >= 0)] - dropped.time[np.count_nonzero(kept[: np.argmax(time >= 0)])]
    with pytest.raises(InputError, match=r"^video: expected .* got 1[1-9]\.\d ± 0\.\d m/s² from .* dropped frames"):
        dataclasses.replace(dropped, time=dropped.time + shift).check(video.Camera())


@pytest.mark.parametrize("value", [0, np.nan, "240", None])
@pytest.mark.parametrize("name", ["fps", "noise"])
def test_a_camera_has_positive_numbers(name: str, value: Any) -> None:
    """Frame rate and errors of a camera are positive numbers; others are refused by name."""
    with pytest.raises(InputError, match=f"^camera.{name}: "):
        video.Camera(**{name: value})
    with pytest.raises(InputError, match=r"^camera\.clock: expected at most 0\.01"):
        video.Camera(clock=0.05)
