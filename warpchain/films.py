"""Films of walks: the friction of a floor, and the parameters of a chain with errors that hold.

    from warpchain import films
    film = films.read("film.csv", links=60, frequency=20.0)
    print(films.friction_line(film))
    bank = films.Bank.of(warpchain.sweep("film_bank.yaml", "bank"))
    print(bank.posterior([film]))

A film gives time and centre of mass of a chain, and may give the outline of its joints and its speed at the release.
A bank is a sweep of chains whose parameters are drawn from a prior, each walking every experiment some times. The
chains of a bank are filmed with a `Camera` whose errors are drawn as well; a ridge regression gives the parameters
from what the films of one chain have in common, all of them together, and its residuals on chains that it was not
fitted to are the errors. So errors that films share, of the camera and of the regression, are counted as shared.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.validation import InputError
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.rows import MISSING
from warpchain.walks.walk_result import WalkResult

Array = NDArray[np.float64]

CLOCK: Final = np.arange(0.02, 0.361, 0.02)
"""Times since the release [s] at which films are compared, each a mean over 20 ms."""
FOUND: Final = (
    "floor_friction",
    "viscous_friction",
    "coulomb_friction",
    "sprocket_radius",
    "circle_radius",
    "floor_restitution",
)
"""Parameters that a posterior has, those of them that the bank draws."""
BEFORE: Final = 0.1
"""Time before the release [s] that a synthetic film has."""
FOLDS: Final = 8
GRAVITY: Final = 9.809
"""As of Table 1 [m/s²]."""


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A camera, and the standard deviations of its errors; those of a film are drawn again for each film.

    Attributes:
        fps: frames a second.
        noise: of each coordinate in each frame of a film [m].
        release: of the moment of the release, of a film [s].
        speed: of the loop's speed, relative, of a film.
        scale: of the scale, relative.
        floor: of the height of the floor [m].
        origin: of the place of the sprocket's axis along the floor [m].
        roll: of the camera's tilt about its axis [rad].
        outline: of each edge of the outline [m].
    """

    fps: float = 240.0
    noise: float = 5e-4
    release: float = 2e-3
    speed: float = 5e-3
    scale: float = 2.5e-3
    floor: float = 5e-4
    origin: float = 5e-4
    roll: float = 2.6e-3
    outline: float = 5e-4

    def shared(self, random: np.random.Generator) -> Array:
        """Errors that all films of a set have: scale, floor, origin, roll, four edges."""
        sigma = [self.scale, self.floor, self.origin, self.roll, *[self.outline] * 4]
        return random.normal(size=8) * sigma


@dataclass(frozen=True, kw_only=True, eq=False)
class Film:
    """What was measured of a walk: x from the axis of the sprocket, forwards; y from the floor, upwards.

    Attributes:
        time: since the release [s], ascending; some frames lie before the release.
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


def summary(film: Film) -> Array:
    """What films are compared by: place before the release, way since then on `CLOCK`, slopes of the friction line.

    Then outline and speed, if the film has them.
    """
    time, center = film.time, film.center
    start = center[time < 0].mean(axis=0)
    fine = np.arange(CLOCK[0] - 0.01, CLOCK[-1] + 0.01, 1e-3)
    way = np.column_stack([np.interp(fine, time, center[:, k]) for k in (0, 1)]) - start
    way = way[: len(CLOCK) * 20].reshape(len(CLOCK), 20, 2).mean(axis=1)
    lift = way[:, 1] + GRAVITY * CLOCK**2 / 2
    slopes = [way[:stop, 0] @ lift[:stop] / (lift[:stop] @ lift[:stop]) for stop in (5, 7, 10)]
    known = [*([] if film.outline is None else film.outline), *([] if film.speed is None else [film.speed])]
    return np.concatenate([start, way.ravel(), slopes, known])


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a simulated walk that a camera can film; arrays as in `Film`, without errors."""

    time: Array
    center: Array
    outline: Array
    speed: float
    links: int
    frequency: float

    @classmethod
    def of(cls, walk: WalkResult) -> Self:
        """The motion of a walk with series and frames."""
        joints, scene = walk.frame_joints[0], walk.setup.scene
        outline = np.array([*np.sort(joints[:, 0])[[0, -1]], *np.sort(joints[:, 1])[[0, -1]]])
        return cls(walk.time, walk.center, outline, float(walk.rms_speed[0]), scene.links, scene.frequency)

    def filmed(self, camera: Camera, errors: Array, random: np.random.Generator) -> Film:
        """A film, given the errors that it shares with others of its set."""
        scale, floor, origin, roll = errors[:4]
        true = np.arange(-BEFORE + random.uniform() / camera.fps, self.time[-1], 1 / camera.fps)
        center = np.column_stack([np.interp(true, self.time, self.center[:, k]) for k in (0, 1)])
        height = center[0, 1]
        center += random.normal(size=center.shape) * camera.noise
        center += roll * np.column_stack([center[:, 1] - height, -center[:, 0]])
        shift = np.array([origin, floor])
        return Film(
            time=true + random.normal() * camera.release,
            center=(1 + scale) * center + shift,
            links=self.links,
            frequency=self.frequency,
            outline=(1 + scale) * self.outline + np.repeat(shift, 2) + errors[4:],
            speed=self.speed * (1 + random.normal() * camera.speed),
        )


def film_of(walk: WalkResult, camera: Camera | None = None, seed: int = 0) -> Film:
    """A film of a simulated walk, with errors as a camera makes them."""
    camera, random = camera or Camera(), np.random.default_rng(seed)
    return Motion.of(walk).filmed(camera, camera.shared(random), random)


@dataclass(frozen=True, eq=False, kw_only=True)
class Bank:
    """Chains whose parameters are known, and their walks.

    Attributes:
        names: of the parameters.
        values: of each chain, (c, p).
        experiments: links and frequency of each, (e, 2).
        time: of the motions [s], (t,).
        center: centre of mass in experiment e, repetition r of chain c [m], (c, e, r, t, 2).
        outline: at the release [m], (c, e, r, 4).
        speed: of the loop [m/s], (c, e, r).
    """

    names: NDArray[np.str_]
    values: Array
    experiments: Array
    time: Array
    center: Array
    outline: Array
    speed: Array

    @classmethod
    def of(cls, result: SweepResult | Any) -> Self:
        """The bank of a sweep, or of one of its blocks, over links, frequency and repetitions such as `phase`.

        Chains are its samples, so `same_samples_along` has all axes. Chains of which a walk failed are left out.
        """
        axes, columns = list(result.axes), result.columns
        if axes[:2] != ["links", "frequency"]:
            raise InputError(f"grid: its axes are {', '.join(axes)}; give links, frequency, and others for repetitions")
        names = [name for name in FOUND if name in result.drawn]
        drawn = np.stack([columns[f"{name}_drawn"] for name in names], axis=-1)
        if np.any(np.ptp(drawn, axis=tuple(range(len(axes))))):
            raise InputError(f"same_samples_along: chains differ between experiments; give {axes}")
        if np.any(columns["status"] == MISSING):
            raise InputError("bank: walks are missing; let the sweep end")
        links, frequencies, samples = result.axes["links"], result.axes["frequency"], result.shape[-1]
        found: list[Any] = [None] * columns["index"].size
        for place, group in result.kept_motions(range(len(found))):  # in the order of the files
            series, joints = group["series"], group["frames/joints"][0].astype(float)
            found[place] = series["time"][()], series["center"][()], joints, series["rms_speed"][0]
        step = round(float(np.median(np.diff(found[0][0]))), 4)
        time = np.arange(0.0, CLOCK[-1] + 0.03, step)
        ok = np.array([each[0][-1] >= time[-1] for each in found]).reshape(-1, samples).all(axis=0)
        center = np.array([[np.interp(time, each[0], each[1][:, k]) for k in (0, 1)] for each in found])
        joints = [each[2] for each in found]
        edges = np.array([[x.min(), x.max(), y.min(), y.max()] for x, y in (each.T for each in joints)])

        def by_chain(values: Any, *shape: int) -> Any:
            whole = np.reshape(values, (len(links) * len(frequencies), -1, samples, *shape))
            return np.moveaxis(whole, 2, 0)[ok]

        return cls(
            names=np.array(names),
            values=drawn.reshape(-1, samples, len(names))[0][ok],
            experiments=np.array([(n, f) for n in links for f in frequencies], float),
            time=time,
            center=by_chain(np.moveaxis(center, 1, 2), len(time), 2),
            outline=by_chain(edges, 4),
            speed=by_chain([each[3] for each in found]),
        )

    def save(self, path: str | Path) -> None:
        """Write the bank to a .npz file, in single precision."""
        arrays = {name: value.astype("f4") if value.ndim > 2 else value for name, value in vars(self).items()}
        np.savez_compressed(path, **arrays)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote."""
        with np.load(path) as file:
            return cls(**{name: file[name].astype(float) if name != "names" else file[name] for name in file.files})

    def motion(self, chain: int, experiment: int, repetition: int) -> Motion:
        """A walk of a chain."""
        at = chain, experiment, repetition
        links, frequency = self.experiments[experiment]
        return Motion(self.time, self.center[at], self.outline[at], self.speed[at], int(links), float(frequency))
