"""What was measured in a video of a walk, and the errors of the camera that recorded it.

`read` makes a `Video` from an exported table, `video_of` from a simulated walk. The estimators call `Video.check`, so
a video that contradicts its camera, or physics, is refused before anything is estimated from it.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Final, Self

import numpy as np
from pydantic import Field

from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.parameters import preset
from warpchain.inputs.validation import InputError, checked, shown
from warpchain.results.walk_result import WalkResult

_TABLE_1: Final = preset("paper")
GRAVITY: Final = _TABLE_1.gravity
"""Gravity of Table 1 [m/s²]."""
JOINT_RADIUS: Final = _TABLE_1.sprocket_radius + _TABLE_1.circle_radius
"""Distance of the joints from the centre of Table 1's sprocket [m]."""
LEAD: Final = 0.1
"""Time before the release that a video must show [s]."""
CLOCK: Final = np.arange(0.02, 0.361, 0.02)
"""Times since the release [s] at which videos are compared; each value is a mean over 20 ms."""
WINDOW: Final = 0.1
"""Length of the window in which the acceleration is fitted [s].

In shorter windows 0.5 mm of noise would hide that a tenth of the frames was dropped.
"""
OBVIOUS: Final = 3.5
"""Standard deviations above g, enlarged by errors of scale and clock, at which a fall counts as too fast.

The maximum in 128 simulated videos at 20 Hz was 2.9.
"""


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Frame rate of a camera, and the standard deviations of its errors, all positive.

    The last six errors are shared by all videos of a chain; the others are independent.

    Attributes:
        fps: frames per second.
        noise: error of each coordinate in each frame [m].
        release: error of the moment of the release [s].
        speed: relative error of the loop's speed.
        scale: relative error of the scale.
        floor: error of the height of the floor [m].
        origin: error of the horizontal position of the sprocket's axis [m].
        roll: error of the vertical direction in the picture [rad].
        outline: error of each edge of the outline [m].
        clock: relative error of the frame rate, at most 0.01; dropped frames make it wrong.
    """

    fps: float = 240.0
    noise: float = 5e-4
    release: float = 2e-3
    speed: float = 2e-3
    scale: float = 2.5e-3
    floor: float = 5e-4
    origin: float = 5e-4
    roll: float = 2.6e-3
    outline: float = 5e-4
    clock: float = 2e-3

    def __post_init__(self) -> None:
        """Refuse values that are not positive, and a clock error that videos of 0.4 s cannot correct."""
        for name, value in vars(self).items():
            most = 0.01 if name == "clock" else None
            checked(value, f"camera.{name}", Annotated[float, Field(gt=0, le=most)])

    def errors(self, random: np.random.Generator) -> Array:
        """Sample the errors that all videos of a chain share: scale, floor, origin, roll, four edges, clock."""
        sizes = [self.scale, self.floor, self.origin, self.roll, *[self.outline] * 4, self.clock]
        return random.normal(size=len(sizes)) * sizes


CAREFUL: Final = Camera()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Video:
    """The measured motion of one walk, with x forwards from the sprocket's axis and y upwards from the floor.

    Attributes:
        time: time since the release [s], ascending; negative before the release.
        center: x and y of the centre of mass [m], shape (t, 2).
        links: number of links.
        frequency: frequency of the sprocket [Hz].
        outline: x of the leftmost and rightmost, y of the lowest and highest joint at the release [m]; None: unknown.
        speed: speed of the links along the loop before the release [m/s]; None: unknown.
    """

    time: Array
    center: Array
    links: int
    frequency: float
    outline: Array | None = None
    speed: float | None = None

    def __repr__(self) -> str:
        """One line."""
        return f"<Video of {self.links} links at {self.frequency:g} Hz, {len(self.time)} frames>"

    def seen(self, camera: Camera, errors: Array, random: np.random.Generator) -> Self:
        """This error-free video with a camera's errors, of which `errors` are shared by all videos of the chain."""
        scale, floor, origin, roll, *edges_off, clock = errors
        time = np.arange(-LEAD + random.uniform() / camera.fps, (1 + clock) * self.time[-1], 1 / camera.fps)
        center = np.column_stack([np.interp(time / (1 + clock), self.time, x) for x in self.center.T])
        turned = roll * np.column_stack([center[:, 1] - center[0, 1], -center[:, 0]])
        shift, noise = np.array([origin, floor]), random.normal(size=center.shape) * camera.noise
        delay, slip = random.normal(size=2) * [camera.release, camera.speed]
        return replace(
            self,
            time=time + delay,
            center=(1 + scale) * (center + turned) + noise + shift,
            outline=None if self.outline is None else (1 + scale) * self.outline + np.repeat(shift, 2) + edges_off,
            speed=None if self.speed is None else self.speed * (1 + slip) / (1 + clock),
        )

    @property
    def noise(self) -> float:
        """Standard deviation of a coordinate before the release [m]; 0 if all values were rounded alike."""
        return float(np.sqrt(self.center[self.time < 0].var(axis=0, ddof=1).mean()))

    @property
    def rounding(self) -> float:
        """Standard error due to rounding to the smallest step between different values [m]."""
        return max(map(rounding_of, self.center.T))

    def error(self, camera: Camera) -> float:
        """Standard error of a coordinate [m]: its standard deviation, at least that of camera and rounding."""
        return max(self.noise, float(np.hypot(self.rounding, camera.noise)))

    def check(self, camera: Camera) -> None:
        """Refuse a video that is too short or not finite, contradicts the camera, or moves backwards.

        Raises:
            InputError: its text says which value is wrong, and what to check.
        """
        checked_array(self.time, "video.time", "t")
        checked_array(self.center, "video.center", len(self.time), 2)
        first, last = self.time[0], self.time[-1]
        if first > 0.02 - LEAD or last < CLOCK[-1] + 0.01:
            needed = f"−{LEAD:g} to {CLOCK[-1] + 0.02:g} s after the release"
            raise InputError(
                f"video: expected {needed}, got {first:.3f} to {last:.3f} s; check unit, fps, or set release"
            )
        if abs((rate := 1 / float(np.median(np.diff(self.time)))) / camera.fps - 1) > 0.01:
            wrong = f"expected the video's {rate:.4g} frames per second, got {camera.fps:g}"
            raise InputError(f"camera.fps: {wrong}; use the former or, for slow motion, fps of read")
        if self.noise > 1.5 * camera.noise:
            wrong = f"expected the video's noise before the release, {self.noise:.2g} m, got {camera.noise} m"
            raise InputError(f"camera.noise: {wrong}; use the former, or check unit and release")
        if (rounding := self.rounding) > 1.5 * camera.noise:
            wrong = f"expected at least the video's rounding error, {rounding:.2g} m, got {camera.noise} m"
            raise InputError(f"camera.noise: {wrong}; export more digits, or use the former")
        near, (x, y) = (self.time > 0.02) & (self.time < 0.03), self.center[self.time < 0].mean(axis=0)
        off = (self.center[:, 1] - y + GRAVITY * self.time**2 / 2)[near]
        if not near.any() or abs(off.mean()) > 5e-4 + 3 * np.hypot(0.03 * GRAVITY * camera.release, camera.noise):
            raise InputError("video: expected free fall 20 to 30 ms after the release; check unit, fps and release")
        self._check_fall(camera)
        if (way := self.center[self.time < CLOCK[-1]][-1, 0] - x) < -5e-3 - 3 * camera.noise:
            raise InputError(f"direction: the chain moves {-way:.3f} m backwards; use the other direction")
        if self.speed and not 0.01 < (radius := self.speed / (2 * np.pi * self.frequency)) < 0.5:
            raise InputError(
                f"speed: expected speed/(2πf) of 0.01 to 0.5 m, got {radius:.3g} m; check speed and frequency"
            )

    def _check_fall(self, camera: Camera) -> None:
        """Refuse a video in which the chain falls faster than g, because then frames are missing or marks are wrong.

        The floor can only push upwards. The acceleration of a quadratic fit is a mean with positive weights, so it
        cannot exceed g because of a model error.
        """
        limit, error = GRAVITY * (1 + 3 * np.hypot(camera.scale, 2 * camera.clock)), self.error(camera)
        for start in np.arange(0, min(self.time[-1], 0.5) - WINDOW, 0.0025):
            inside = (self.time >= start) & (self.time <= start + WINDOW)
            if inside.sum() < 5:
                continue
            time = self.time[inside] - start - WINDOW / 2
            matrix = np.column_stack([np.ones_like(time), time, -(time**2) / 2])
            inverse = np.linalg.pinv(matrix)
            fall, sigma = inverse[2] @ self.center[inside, 1], error * float(np.linalg.norm(inverse[2]))
            if fall > limit + OBVIOUS * sigma:
                seen = f"{fall:.1f} ± {sigma:.1f} m/s² from {start:.2f} to {start + WINDOW:.2f} s"
                raise InputError(
                    f"video: expected a fall of at most g, got {seen}; check for dropped frames, fps and unit"
                )


def video_of(walk: WalkResult, camera: Camera | None = CAREFUL, seed: int = 0) -> Video:
    """Make a `Video` from a simulated walk, e.g. to test an experiment before it is made.

    Args:
        walk: a walk with time series and frames.
        camera: standard deviations of the camera's errors; None: no errors.
        seed: seed of the random errors.

    Raises:
        InputError: `walk` is not a WalkResult, or has no time series or frames.
    """
    if not isinstance(walk, WalkResult):
        raise InputError(f"walk: expected a WalkResult, got {shown(walk)}; use what warpchain.walk returns")
    if not len(walk.time) or not len(walk.frame_time):
        raise InputError("walk: expected time series and frames; record both")
    scene, random = walk.setup.scene, np.random.default_rng(seed)
    exact = Video(
        time=walk.time,
        center=walk.center,
        links=scene.links,
        frequency=scene.frequency,
        outline=edges(walk.frame_joints[0]),
        speed=walk.setup.loop_speed,
    )
    return exact if camera is None else exact.seen(camera, camera.errors(random), random)


def rounding_of(numbers: Array) -> float:
    """Standard error due to rounding to the smallest step between different numbers, at least 1e-9."""
    return float(np.diff(np.unique(numbers.round(9))).min(initial=np.inf) / np.sqrt(12))


def edges(joints: Array) -> Array:
    """Leftmost and rightmost x, lowest and highest y of joints (n, 2)."""
    return np.stack([joints.min(axis=0), joints.max(axis=0)], axis=1).ravel()


def summary(video: Video, outline: bool, speed: bool) -> Array:
    """Features of a video: position before the release, displacement since, friction line, outline and speed."""
    start = video.center[video.time < 0].mean(axis=0)
    fine = np.add.outer(CLOCK, np.arange(-0.0095, 0.01, 1e-3))
    x, y = (np.interp(fine, video.time, video.center[:, k]).mean(axis=1) - start[k] for k in (0, 1))
    lift = y + GRAVITY * CLOCK**2 / 2
    slopes = [x[:stop] @ lift[:stop] / (lift[:stop] @ lift[:stop]) for stop in (5, 7, 10)]
    return np.concatenate([start, x, y, slopes, video.outline if outline else [], [video.speed] if speed else []])
