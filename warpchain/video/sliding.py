"""Estimate the friction of a floor from one video, without any simulation; users call `friction_line`."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError
from warpchain.video.camera import CAREFUL, CLOCK, GRAVITY, JOINT_RADIUS, Camera, Video

RELEASE_SPEED: Final = 2e-3
"""Standard deviation of either velocity of the centre of mass at the release [m/s], as links leave one by one."""
FALLS: Final = 0.03
"""Time for which every chain released at least 5 mm above the floor falls freely, to within 10 ms [s]."""
MOST_LINKS: Final = 100
"""In longer loops some links stick at the first contact, which made μ up to 17 % too small."""
SLIDES: Final = 0.08
"""Duration of sliding after 40 ms of fall, in units of v/(μ g), where v is the speed of the loop."""
STICKS: Final = 0.05
"""Relative error of μ from links that stick at the first contact, if v/μ < 11 m/s; zero above 20 m/s."""
GREATEST: Final = 3.0
"""Maximum plausible μ, that of tyres on a race track; a larger estimate means an error in the video."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionLine:
    """Floor friction as the slope of forward displacement against height gain; `friction_line` returns it.

    Attributes:
        friction: friction coefficient μ.
        error: standard error of μ, including the camera's errors.
        end: end of the fit, as time since the release [s].
        time: times of the frames since the release [s], shape (t,).
        height_gain: y + g t²/2 of the centre of mass, relative to the release [m], shape (t,).
        displacement: x of the centre of mass, relative to the release [m], shape (t,).
    """

    friction: float
    error: float
    end: float
    time: Array
    height_gain: Array
    displacement: Array

    def __str__(self) -> str:
        """One line."""
        return f"floor_friction {self.friction:.4f} ± {self.error:.4f}, to {self.end:.3f} s after the release"


def friction_line(video: Video, camera: Camera = CAREFUL) -> FrictionLine:
    """Estimate the floor's friction while everything that touches it slides: m x″ = μ m (y″ + g).

    This relation holds whatever happens inside the chain. Friction, position, height, moment and speed of the release,
    and the camera's roll and clock are fitted together; the last five are constrained by the camera's errors. For slow
    loops, whose links soon stick, the fit ends earlier and the error is larger.

    Args:
        video: one video, e.g. from `read`.
        camera: standard deviations of the camera's errors.

    Raises:
        InputError: the video is too short, shows more than 100 links or no free fall, or contradicts the camera; or
            the friction would not lie between 0 and 3.
    """
    if video.links > MOST_LINKS:
        raise InputError(f"video.links: {video.links} are too many; use at most {MOST_LINKS}, or a TrainingSet")
    video.check(camera)
    x, y = (video.center - video.center[video.time < -2 * camera.release].mean(axis=0)).T
    time, noise = np.maximum(video.time, 0), video.error(camera)
    lift, one, none = y + GRAVITY * time**2 / 2, np.ones_like(y), np.zeros_like(y)
    speed = video.speed or 2 * np.pi * video.frequency * JOINT_RADIUS
    # columns: friction, place, height, delay of the release, speeds at the release, roll, clock
    prior = np.array([1e3, 1, 1, camera.release, RELEASE_SPEED, RELEASE_SPEED, camera.roll, camera.clock])
    vertical = np.column_stack([none, none, one, GRAVITY * time, none, time, none, GRAVITY * time**2])
    forward = np.column_stack([none, one, none, none, time, none, y, none])
    friction, falls = 0.3, video.time < FALLS
    for _ in range(8):
        end = min(FALLS + 0.01 + SLIDES * speed / (max(friction, 0.05) * GRAVITY), CLOCK[-1])
        slides, size = video.time <= end, np.hypot(1, friction)
        along = (forward - friction * vertical + np.outer(lift, np.eye(8)[0])) / size
        matrix = np.vstack([vertical[falls], along[slides]]) / noise
        covariance = np.linalg.inv(matrix.T @ matrix + np.diag(prior**-2.0))
        found = covariance @ (matrix.T @ np.concatenate([lift[falls], x[slides] / size])) / noise
        friction = float(found[0])
    if not 0 < friction < GREATEST:  # NaN, too
        wrong = f"expected a floor_friction of 0 to {GREATEST:g}, got {friction:.3g}"
        raise InputError(f"video: {wrong}; check direction, unit, fps and release")
    sticks = STICKS * np.clip((friction / speed - 0.05) / 0.04, 0, 1)
    after = video.time > 0
    return FrictionLine(
        friction=friction,
        error=float(np.sqrt(covariance[0, 0] + friction**2 * (camera.scale**2 + sticks**2))),
        end=float(end),
        time=time[after],
        height_gain=(lift - vertical @ found)[after],
        displacement=(x - forward @ found)[after],
    )
