"""The friction of a floor is the slope of way against lift, and its error holds."""

import dataclasses

import numpy as np
import pytest

from tests.support.made_films import films_of, made_bank, motion
from warpchain import InputError, films

AWAY = np.array([0.3, 0.0])
EXACT = motion(0.3).seen(films.Camera(), np.zeros(8), np.random.default_rng(0))


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
        films.friction_line(motion(0.27, frequency=hz).seen(films.Camera(), np.zeros(8), np.random.default_rng(0)))
        for hz in (5.0, 20.0)
    )
    assert slow.end < fast.end and slow.error > 2 * fast.error


@pytest.mark.parametrize(
    ("changes", "camera", "wrong"),
    [
        ({}, films.Camera(noise=1e-4), "camera.noise: .*scatters"),
        ({}, films.Camera(fps=120.0), "camera.fps: 120, .* slow motion, fps to read"),
        ({"time": EXACT.time + 0.1}, films.Camera(), r"film: it shows 0\.00"),
        ({"time": EXACT.time - 0.012}, films.Camera(), "nothing falls freely; check unit, fps and release"),
        ({"time": EXACT.time * 8}, films.Camera(fps=30), "nothing falls freely; check unit, fps and release"),
        ({"center": EXACT.center * [-1, 1]}, films.Camera(), r"direction: .* backwards; give the other direction"),
        ({"speed": 754.0, "outline": None}, films.Camera(), r"speed/\(2πf\) 6 m do not fit; check direction, origin"),
        ({"frequency": 5.0}, films.Camera(), r"speed/\(2πf\) 0\.239 m do not fit; .* frequency"),
        ({"speed": 0.9 * EXACT.speed}, films.Camera(), r"0\.0538 m do not fit"),
        ({"outline": EXACT.outline[[0, 2, 1, 3]]}, films.Camera(), r"outline \[-0\.06, 0\.014, 0\.06, 0\.35\]"),
        ({"outline": EXACT.outline[[1, 0, 2, 3]]}, films.Camera(), "do not fit"),
        ({"outline": EXACT.outline[[0, 1, 3, 2]]}, films.Camera(), "do not fit"),
        ({"outline": EXACT.outline + AWAY[[0, 0, 1, 1]], "center": EXACT.center + AWAY}, films.Camera(), "origin"),
    ],
)
def test_a_film_that_is_not_what_it_says_is_refused(
    changes: dict[str, np.ndarray], camera: films.Camera, wrong: str
) -> None:
    """Noise, frame rate, times, a mirrored picture, and places that contradict one another or speed and frequency."""
    with pytest.raises(InputError, match=wrong):
        films.friction_line(dataclasses.replace(EXACT, **changes), camera)


def test_films_and_banks_are_shown_in_one_line() -> None:
    """They say what they are, without their arrays."""
    bank = made_bank(160, seed=1)
    for shown in (repr(bank), repr(films_of(bank, 5, 1, films.Camera(), 0)[0])):
        assert shown.startswith(("<Bank of ", "<Film of ")) and len(shown) < 150 and "\n" not in shown
