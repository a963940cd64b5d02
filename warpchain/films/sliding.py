"""The friction of a floor from a film, without any simulation."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from warpchain.films.film import CAREFUL, CLOCK, GRAVITY, JOINT_RADIUS, Camera, Film
from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError

RELEASE_SPEED: Final = 2e-3
"""Standard deviation of either speed of the centre of mass at the release [m/s]: links pass the sprocket one by one."""
FALLS: Final = 0.03
"""Time for which a chain falls freely at least, and within 10 ms of the truth: 5 mm or more above the floor [s]."""
MOST_LINKS: Final = 100
"""Longer loops are wider: some of their links stick at the first touch, which made μ up to 17 % too small."""
SLIDES: Final = 0.08
"""After 40 ms of fall nearly all that touches the floor slides for this many v/(μ g), v the speed of the loop."""
STICKS: Final = 0.05
"""Relative error of μ, if v < 11 m/s μ; none above 20 m/s μ: some links stick at the first touch."""
GREATEST: Final = 3.0
"""No floor has a friction above that of tyres on a track; what comes out greater is an error of the film."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionLine:
    """The floor's friction from the slope of way against lift, x and y + g t²/2 since the release.

    Attributes:
        friction: μ.
        error: its standard error, that of the camera included.
        end: of the fit, time since the release [s].
        time: of frames since the release [s].
        lift: of these frames [m].
        way: of these frames [m].
    """

    friction: float
    error: float
    end: float
    time: Array
    lift: Array
    way: Array

    def __str__(self) -> str:
        """One line."""
        return f"floor_friction {self.friction:.4f} ± {self.error:.4f}, to {self.end:.3f} s after the release"


def friction_line(film: Film, camera: Camera = CAREFUL) -> FrictionLine:
    """The friction of the floor while all that touches it slides: m x″ = μ m (y″ + g), whatever happens in the chain.

    Friction, place, height, moment of the release, speed at the release, roll and clock of the camera are fitted
    together, the last five within their errors. The fit ends early for slow loops, whose links soon stick, and its
    error grows.

    Raises:
        InputError: the film is too short, of more than 100 links, not as the camera says, or not of a free fall; or
            its friction would not lie between 0 and 3.
    """
    if film.links > MOST_LINKS:
        raise InputError(f"film.links: {film.links} are too many for a line; give {MOST_LINKS} or less, or a bank")
    film.check(camera)
    x, y = (film.center - film.center[film.time < -2 * camera.release].mean(axis=0)).T
    time, noise = np.maximum(film.time, 0), film.error(camera)
    lift, one, none = y + GRAVITY * time**2 / 2, np.ones_like(y), np.zeros_like(y)
    speed = film.speed or 2 * np.pi * film.frequency * JOINT_RADIUS
    # columns: friction, place, height, delay of the release, speeds at the release, roll, clock
    prior = np.array([1e3, 1, 1, camera.release, RELEASE_SPEED, RELEASE_SPEED, camera.roll, camera.clock])
    vertical = np.column_stack([none, none, one, GRAVITY * time, none, time, none, GRAVITY * time**2])
    forward = np.column_stack([none, one, none, none, time, none, y, none])
    friction, falls = 0.3, film.time < FALLS
    for _ in range(8):
        end = min(FALLS + 0.01 + SLIDES * speed / (max(friction, 0.05) * GRAVITY), CLOCK[-1])
        slides, size = film.time <= end, np.hypot(1, friction)
        along = (forward - friction * vertical + np.outer(lift, np.eye(8)[0])) / size
        matrix = np.vstack([vertical[falls], along[slides]]) / noise
        covariance = np.linalg.inv(matrix.T @ matrix + np.diag(prior**-2.0))
        found = covariance @ (matrix.T @ np.concatenate([lift[falls], x[slides] / size])) / noise
        friction = float(found[0])
    if not 0 < friction < GREATEST:  # NaN, too
        wrong = f"{friction:.3g}, expected 0 to {GREATEST:g}"
        raise InputError(f"film: its floor_friction would be {wrong}; check direction, unit, fps and release")
    sticks = STICKS * np.clip((friction / speed - 0.05) / 0.04, 0, 1)
    after = film.time > 0
    return FrictionLine(
        friction=friction,
        error=float(np.sqrt(covariance[0, 0] + friction**2 * (camera.scale**2 + sticks**2))),
        end=float(end),
        time=time[after],
        lift=(lift - vertical @ found)[after],
        way=(x - forward @ found)[after],
    )
