"""The friction of a floor is the slope of way against lift, and its error holds."""

import dataclasses

import numpy as np
import pytest

import warpchain
from tests.support.made_films import films_of, made_bank, motion
from warpchain import InputError, films


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


def test_line_of_a_walk_is_its_friction() -> None:
    """A simulated chain of 60 links at 20 Hz slides: μ is within 3 σ, which is less than 2 %, in each of five films."""
    walk = warpchain.walk(
        links=60, frequency=20.0, start="spinning", preset="soft", walk_limit=0.42, floor_friction=0.31
    )
    for seed in range(5):
        line = films.friction_line(films.film_of(walk, seed=seed))
        assert line.error < 0.02 * 0.31 and abs(line.friction - 0.31) < 3 * line.error


def test_slow_loops_are_known_less() -> None:
    """The slower the loop, the sooner it sticks: the fit ends earlier and the error is larger."""
    slow, fast = (films.friction_line(motion(0.27, frequency=hz).seen(*_camera())) for hz in (5.0, 20.0))
    assert slow.end < fast.end and slow.error > 2 * fast.error


def _camera() -> tuple[films.Camera, np.ndarray, np.random.Generator]:
    return films.Camera(), np.zeros(8), np.random.default_rng(0)


@pytest.mark.parametrize(
    ("camera", "wrong"),
    [
        (films.Camera(noise=1e-4), "camera.noise: .*scatters"),
        (films.Camera(fps=120.0), "camera.fps: 120, .* give that"),
    ],
)
def test_a_film_that_is_not_as_the_camera_says_is_refused(camera: films.Camera, wrong: str) -> None:
    """A film that scatters more, or has another frame rate, would have errors too small."""
    with pytest.raises(InputError, match=wrong):
        films.friction_line(motion(0.3).seen(*_camera()), camera)


def test_a_film_that_begins_at_the_release_is_refused() -> None:
    """Its place before the release is unknown."""
    film = motion(0.3).seen(*_camera())
    late = dataclasses.replace(film, time=film.time[film.time > 0], center=film.center[film.time > 0])
    with pytest.raises(InputError, match=r"film: it shows 0\.00"):
        films.friction_line(late)


def test_films_and_banks_are_shown_in_one_line() -> None:
    """They say what they are, without their arrays."""
    bank = made_bank(160, seed=1)
    for shown in (repr(bank), repr(films_of(bank, 5, 1, films.Camera(), 0)[0])):
        assert shown.startswith(("<Bank of ", "<Film of ")) and len(shown) < 150 and "\n" not in shown
