"""A film of a walk, real or of a simulated walk, and the camera that made it."""

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
"""As of Table 1 [m/s²]."""
JOINT_RADIUS: Final = _TABLE_1.sprocket_radius + _TABLE_1.circle_radius
"""Distance of the joints from the centre of Table 1's sprocket [m]."""
LEAD: Final = 0.1
"""Time before the release that a film shows [s]."""
CLOCK: Final = np.arange(0.02, 0.361, 0.02)
"""Times since the release [s] at which films are compared, each a mean over 20 ms."""
WINDOW: Final = 0.1
"""Time over which a fall is measured [s]; in shorter windows 0.5 mm of noise hides a tenth of all frames dropped."""
OBVIOUS: Final = 3.5
"""A fall in any window is too fast if it is so many standard deviations above all that scale and clock may add to g: of
128 simulated films at 20 Hz none came to more than 2.9."""


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A camera, and the standard deviations of its errors, above 0; the lower six are common to all films of a chain.

    Attributes:
        fps: frames a second.
        noise: of each coordinate in each frame [m].
        release: of the moment of the release [s].
        speed: of the loop's speed, relative.
        scale: of the scale, relative.
        floor: of the height of the floor [m].
        origin: of the place of the sprocket's axis along the floor [m].
        roll: of the plumb line in the picture [rad].
        outline: of each edge of the outline [m].
        clock: of the frame rate, relative, at most 0.01; a film with dropped frames has a wrong one.
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
        """Refuse what is no positive number, and a clock that films of 0.4 s cannot allow for."""
        for name, value in vars(self).items():
            most = 0.01 if name == "clock" else None
            checked(value, f"camera.{name}", Annotated[float, Field(gt=0, le=most)])

    def errors(self, random: np.random.Generator) -> Array:
        """Errors that all films of a chain have: scale, floor, origin, roll, four edges, clock."""
        sizes = [self.scale, self.floor, self.origin, self.roll, *[self.outline] * 4, self.clock]
        return random.normal(size=len(sizes)) * sizes


CAREFUL: Final = Camera()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Film:
    """What was measured of a walk: x forwards from the axis of the sprocket, y up from the floor.

    Attributes:
        time: since the release [s], ascending; negative before it.
        center: centre of mass x, y [m], shape (t, 2).
        links: number of links.
        frequency: of the sprocket [Hz].
        outline: x of the leftmost and rightmost, y of the lowest and highest joint at the release [m]; None: unknown.
        speed: of the links along the loop before the release [m/s]; None: unknown.
    """

    time: Array
    center: Array
    links: int
    frequency: float
    outline: Array | None = None
    speed: float | None = None

    def __repr__(self) -> str:
        """One line."""
        return f"<Film of {self.links} links at {self.frequency:g} Hz, {len(self.time)} frames>"

    def seen(self, camera: Camera, errors: Array, random: np.random.Generator) -> Self:
        """A film without errors as a camera shows it, given the errors that other films of the chain share."""
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
        """Scatter of a coordinate before the release [m]; 0 where a quiet camera's numbers were rounded alike."""
        return float(np.sqrt(self.center[self.time < 0].var(axis=0, ddof=1).mean()))

    @property
    def rounding(self) -> float:
        """Standard error of numbers that were rounded to the least step between different ones [m]."""
        return max(map(rounding_of, self.center.T))

    def error(self, camera: Camera) -> float:
        """Standard error of a coordinate [m]: the scatter, and no less than camera and rounding together."""
        return max(self.noise, float(np.hypot(self.rounding, camera.noise)))

    def check(self, camera: Camera) -> None:
        """Refuse a film that has no finite numbers, is too short, not as the camera says, or goes backwards."""
        checked_array(self.time, "film.time", "t")
        checked_array(self.center, "film.center", len(self.time), 2)
        first, last = self.time[0], self.time[-1]
        if first > 0.02 - LEAD or last < CLOCK[-1] + 0.01:
            needed = f"−{LEAD:g} to {CLOCK[-1] + 0.02:g} s; if the film has them, check unit, fps, or give release"
            raise InputError(f"film: it shows {first:.3f} to {last:.3f} s after the release; give {needed}")
        if abs((rate := 1 / float(np.median(np.diff(self.time)))) / camera.fps - 1) > 0.01:
            wrong = f"{camera.fps:g}, but the film has {rate:.4g} frames a second"
            raise InputError(f"camera.fps: {wrong}; give that or, if it plays in slow motion, fps to read")
        if self.noise > 1.5 * camera.noise:
            wrong = f"{camera.noise} m, but before the release the film scatters by {self.noise:.2g} m"
            raise InputError(f"camera.noise: {wrong}; give that, or check unit and release")
        if (rounding := self.rounding) > 1.5 * camera.noise:
            wrong = f"{camera.noise} m, but the film's numbers were rounded by {rounding:.2g} m"
            raise InputError(f"camera.noise: {wrong}; export more digits, or give that")
        near, (x, y) = (self.time > 0.02) & (self.time < 0.03), self.center[self.time < 0].mean(axis=0)
        off = (self.center[:, 1] - y + GRAVITY * self.time**2 / 2)[near]
        if not near.any() or abs(off.mean()) > 5e-4 + 3 * np.hypot(0.03 * GRAVITY * camera.release, camera.noise):
            raise InputError("film: 20 to 30 ms after the release nothing falls freely; check unit, fps and release")
        self._check_fall(camera)
        if (way := self.center[self.time < CLOCK[-1]][-1, 0] - x) < -5e-3 - 3 * camera.noise:
            raise InputError(f"direction: the chain goes {-way:.3f} m backwards; give the other direction")
        if self.speed and not 0.01 < (radius := self.speed / (2 * np.pi * self.frequency)) < 0.5:
            raise InputError(f"speed: speed/(2πf) is {radius:.3g} m, no sprocket's; check speed (m/s) and frequency")

    def _check_fall(self, camera: Camera) -> None:
        """Refuse a film that falls faster than g: the floor can only lift, so frames are missing or marks are wrong.

        The acceleration of a quadratic fit is a mean with positive weights, so no error of the model adds to its own.
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
                seen = f"{fall:.1f} ± {sigma:.1f} m/s² from {start:.2f} to {start + WINDOW:.2f} s, faster than g"
                raise InputError(f"film: it falls with {seen}; frames were dropped, or check fps, unit and marks")


def film_of(walk: WalkResult, camera: Camera | None = CAREFUL, seed: int = 0) -> Film:
    """A film of a simulated walk with series and frames, with the errors of a camera; None: without any."""
    if not isinstance(walk, WalkResult):
        raise InputError(f"walk: expected a WalkResult, got {shown(walk)}; give what warpchain.walk returns")
    if not len(walk.time) or not len(walk.frame_time):
        raise InputError("walk: it has no series or no frames; record both")
    scene, random = walk.setup.scene, np.random.default_rng(seed)
    exact = Film(
        time=walk.time,
        center=walk.center,
        links=scene.links,
        frequency=scene.frequency,
        outline=edges(walk.frame_joints[0]),
        speed=walk.setup.loop_speed,
    )
    return exact if camera is None else exact.seen(camera, camera.errors(random), random)


def rounding_of(numbers: Array) -> float:
    """Standard error of numbers that were rounded to the least step between different ones, to 1e-9 at most."""
    return float(np.diff(np.unique(numbers.round(9))).min(initial=np.inf) / np.sqrt(12))


def edges(joints: Array) -> Array:
    """Outline of joints, (n, 2)."""
    return np.stack([joints.min(axis=0), joints.max(axis=0)], axis=1).ravel()


def summary(film: Film, outline: bool, speed: bool) -> Array:
    """What films are compared by: place before the release, way since then, friction line, outline, speed."""
    start = film.center[film.time < 0].mean(axis=0)
    fine = np.add.outer(CLOCK, np.arange(-0.0095, 0.01, 1e-3))
    x, y = (np.interp(fine, film.time, film.center[:, k]).mean(axis=1) - start[k] for k in (0, 1))
    lift = y + GRAVITY * CLOCK**2 / 2
    slopes = [x[:stop] @ lift[:stop] / (lift[:stop] @ lift[:stop]) for stop in (5, 7, 10)]
    return np.concatenate([start, x, y, slopes, film.outline if outline else [], [film.speed] if speed else []])
