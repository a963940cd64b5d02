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
        ({"time": EXACT.time * 1.02}, films.Camera(), r"camera\.fps: 240, but the film has 235\.3 frames a second"),
        (
            {"center": EXACT.center.round(2)},
            films.Camera(),
            r"camera\.noise: .* rounded by 0\.0029 m; export more digits",
        ),
        ({"center": EXACT.center * [0, 1]}, films.Camera(), r"camera\.noise: .* rounded by inf m"),
        (
            {"center": EXACT.center * [-0.03, 1]},
            films.Camera(),
            r"floor_friction would be -0\.0\d+, expected 0 to 3; check",
        ),
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


def test_rounded_tables_of_quiet_cameras_have_the_error_of_their_steps() -> None:
    """Numbers before the release are all alike, and scatter is none: 36 films, rounded to the mm, hold within 3 σ."""
    sizes = []
    for seed in range(36):
        random = np.random.default_rng(seed)
        friction = random.uniform(0.15, 0.4)
        film = motion(friction, random.uniform(0.006, 0.014)).seen(
            films.Camera(noise=1e-5), films.Camera().errors(random), random
        )
        rounded = dataclasses.replace(film, center=film.center.round(3))
        assert rounded.rounding == pytest.approx(1e-3 / np.sqrt(12)) and film.rounding < 1e-6
        line = films.friction_line(rounded)
        sizes.append((line.friction - friction) / line.error)
    assert np.max(np.abs(sizes)) < 3 and np.mean(np.abs(sizes) < 1.96) > 0.9


def test_a_clock_that_is_not_exact_makes_errors_grow() -> None:
    """A clock 1 % slow makes μ too large by 7 standard errors if it is believed; allowed for, it is within two."""
    sizes = []
    for clock in (1e-9, 1e-2):
        camera = films.Camera(noise=1e-4, release=2e-4, scale=1e-3, roll=1e-3, clock=clock)
        film = motion(0.27).seen(camera, np.append(np.zeros(8), -1e-2), np.random.default_rng(0))
        line = films.friction_line(film, camera)
        sizes.append((line.friction - 0.27) / line.error)
    assert abs(sizes[1]) < 2 < sizes[0] / 2
    film = motion(0.27).seen(films.Camera(), np.zeros(9), np.random.default_rng(0))
    believed = films.friction_line(film, films.Camera(clock=1e-9))
    assert films.friction_line(film).error > 1.1 * believed.error


@pytest.mark.parametrize("gone", [5, 10])
def test_a_film_that_falls_faster_than_g_is_refused(gone: int) -> None:
    """A body that is thrown up falls freely for 0.3 s; with every tenth frame gone it seems to fall with 12 m/s²."""
    time = np.arange(-0.14, 0.6, 1 / 240)
    flying = np.clip(time - 0.15, 0, None)
    body = motion(0.27)
    place = [np.interp(np.minimum(time, 0.15), body.time, column) for column in body.center.T]
    up = np.where(time > 0.15, 1.4 * flying - 9.809 / 2 * flying**2, 0)
    noise = np.random.default_rng(0).normal(size=(len(time), 2)) * 4e-4
    film = dataclasses.replace(body, time=time, center=np.column_stack([place[0], place[1] + up]) + noise)
    film.check(films.Camera())
    kept = np.arange(len(time)) % gone != 3
    dropped = dataclasses.replace(film, time=time[0] + np.arange(kept.sum()) / 240, center=film.center[kept])
    shift = film.time[np.argmax(film.time >= 0)] - dropped.time[np.count_nonzero(kept[: np.argmax(time >= 0)])]
    with pytest.raises(InputError, match=r"^film: it falls with 1[1-9]\.\d ± 0\.\d m/s² from .* frames were dropped"):
        dataclasses.replace(dropped, time=dropped.time + shift).check(films.Camera())


@pytest.mark.parametrize("value", [0, np.nan, "240", None])
@pytest.mark.parametrize("name", ["fps", "noise"])
def test_a_camera_has_positive_numbers(name: str, value: Any) -> None:
    """Frame rate and errors of a camera are positive numbers; others are refused by name."""
    with pytest.raises(InputError, match=f"^camera.{name}: "):
        films.Camera(**{name: value})
    with pytest.raises(InputError, match=r"^camera\.clock: .* less than or equal to 0\.01"):
        films.Camera(clock=0.05)
