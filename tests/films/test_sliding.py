"""The friction of a floor is the slope of way against lift, and its error holds."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from tests.support.made_films import motion
from warpchain import InputError, films

EXACT = motion(0.3).seen(films.Camera(), np.zeros(9), np.random.default_rng(0))


def test_line_of_a_sliding_body_is_its_friction() -> None:
    """A body that obeys Coulomb's law is filmed 200 times with all errors of a camera: σ and 2 σ hold."""
    camera, sizes = films.Camera(), []
    for seed in range(200):
        random = np.random.default_rng(seed)
        friction = random.uniform(0.1, 0.5)
        film = motion(friction, random.uniform(0.006, 0.014)).seen(camera, camera.errors(random), random)
        line = films.friction_line(film, camera)
        sizes.append((line.friction - friction) / line.error)
    assert abs(np.mean(sizes)) < 0.25
    assert 0.6 < np.mean(np.abs(sizes) < 1) < 0.85
    assert 0.91 < np.mean(np.abs(sizes) < 2)


def test_slow_loops_are_known_less() -> None:
    """The slower the loop, the sooner it sticks: the fit ends earlier and the error is larger."""
    slow, fast = (
        films.friction_line(motion(0.27, frequency=hz).seen(films.Camera(), np.zeros(9), np.random.default_rng(0)))
        for hz in (5.0, 20.0)
    )
    assert slow.end < fast.end and slow.error > 2 * fast.error


@pytest.mark.parametrize(
    ("changes", "camera", "wrong"),
    [
        ({}, films.Camera(noise=1e-4), "camera.noise: .*scatters"),
        ({}, films.Camera(fps=120.0), "camera.fps: 120, .* slow motion, fps to read"),
        ({"time": EXACT.time - 1e300}, films.Camera(), r"film: it shows -1"),
        ({"time": EXACT.time + 0.1}, films.Camera(), r"film: it shows 0\.00"),
        ({"time": EXACT.time - 0.012}, films.Camera(), "nothing falls freely; check unit, fps and release"),
        ({"time": EXACT.time * 8}, films.Camera(fps=30), "nothing falls freely; check unit, fps and release"),
        ({"center": EXACT.center * [-1, 1]}, films.Camera(), r"direction: .* backwards; give the other direction"),
        ({"time": np.where(EXACT.time > 0.3, np.nan, EXACT.time)}, films.Camera(), r"film\.time: .* not finite"),
        ({"center": np.where(EXACT.center < 0, np.inf, EXACT.center)}, films.Camera(), r"film\.center: .* not finite"),
        ({"center": EXACT.center[1:]}, films.Camera(), r"film\.center: its shape is"),
        ({"links": 120}, films.Camera(), r"film\.links: 120 are too many for a line; give 100 or less"),
        ({"speed": 754.0}, films.Camera(), r"speed/\(2πf\) is 6 m, no sprocket's; check speed \(m/s\) and frequency"),
    ],
)
def test_a_film_that_is_not_what_it_says_is_refused(
    changes: dict[str, np.ndarray], camera: films.Camera, wrong: str
) -> None:
    """Noise, frame rate, times, a mirrored picture, numbers that are not finite, links, and speed in another unit."""
    with pytest.raises(InputError, match=wrong):
        films.friction_line(dataclasses.replace(EXACT, **changes), camera)


@pytest.mark.parametrize("value", [0, np.nan, "240", None])
@pytest.mark.parametrize("name", ["fps", "noise"])
def test_a_camera_has_positive_numbers(name: str, value: Any) -> None:
    """Frame rate and errors of a camera are positive numbers; others are refused by name."""
    with pytest.raises(InputError, match=f"^camera.{name}: "):
        films.Camera(**{name: value})
