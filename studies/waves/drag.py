"""Dose and response of a drag on short waves: the same releases walk on with and without it.

    python -m studies.waves.drag release releases.npz            # six minutes of one core: the loops at their release
    python -m studies.waves.drag walk releases.npz drag.npz cuda    # five minutes of a GPU: how far they walk

`studies.waves.doses` makes the tables of the page from drag.npz.
"""

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import warpchain
from studies.waves.wave_drag import drag_waves

Array = NDArray[np.float64]

CELLS: Final = tuple((links, frequency) for links in (60, 90, 120, 180) for frequency in (15.0, 20.0, 25.0, 30.0))
SEEDS: Final = (1000, 2000)
"""The samples of each are so many, plus the number of the sample."""
SAMPLES: Final = 20
STEP: Final = 2e-3
"""Time [s] between two applications of the drag."""
LATEST: Final = 4.0
"""Time [s] at which the drag ends; it ends earlier when the loop has lost a tenth of its area."""
END: Final = 20.0
LONGEST: Final = 24.0
"""Longest waves that are dragged, in links."""
NEAR: Final = 1e-3
"""A chain whose lowest circle is nearer to the floor than this [m] is in an impact."""


@dataclass(frozen=True)
class Variant:
    """A drag: at which rate [1/s] fast waves die of it, and whether it acts in flight and in impacts."""

    rate: float
    in_flight: bool = True
    in_impacts: bool = True

    @property
    def when(self) -> str:
        """In words."""
        if self.in_flight and self.in_impacts:
            return "always"
        return "in flight" if self.in_flight else "in impacts"


RATES: Final = (10.0, 25.0, 50.0, 100.0, 250.0, 1000.0)
HALVES: Final = (10.0, 50.0, 250.0)
VARIANTS: Final = (
    Variant(0.0),
    Variant(1e-9),
    *(Variant(rate) for rate in RATES),
    *(Variant(rate, in_impacts=False) for rate in HALVES),
    *(Variant(rate, in_flight=False) for rate in HALVES),
)
"""The first is none at all, the second changes the bits and nothing else."""

NAMES: Final = ("position", "velocity", "numbers")
"""Arrays of a release."""
PARAMETERS: Final = tuple(warpchain.Parameters.model_fields)


def released(links: int, frequency: float, seed: int) -> tuple[Array, Array, Array]:
    """Position and velocity of the links at the release, (n, 3) each, and the chain's parameters.

    Velocities are those of joints over the first three frames, some 1e-5 s apart, to second order: good to 1e-5 m/s.
    """
    walk = warpchain.walk(
        links=links,
        frequency=frequency,
        preset="soft",
        start="spinning",
        frame_interval=1e-5,
        walk_limit=4e-5,
        seed=seed,
    )
    first, second, third = walk.frame_joints[:3]
    one, two = walk.frame_time[1:3]
    joints = np.stack([first, ((second - first) * two / one - (third - first) * one / two) / (two - one)])
    before = np.roll(joints, 1, axis=1)
    chord, change = joints - before
    center, speed = 0.5 * (joints + before)
    angle = np.arctan2(chord[:, 1], chord[:, 0])
    turning = (chord[:, 0] * change[:, 1] - chord[:, 1] * change[:, 0]) / np.sum(chord**2, axis=1)
    numbers = np.array([getattr(walk.setup.parameters, name) for name in PARAMETERS])
    return np.column_stack([center, angle]), np.column_stack([speed, turning]), numbers


def release(path: Path) -> None:
    """Hold and release all loops, and write their states: arrays of each cell by its number."""
    kept: dict[str, Array] = {}
    for cell, (links, frequency) in enumerate(CELLS):
        seeds = [first + sample for first in SEEDS for sample in range(SAMPLES)]
        states = [released(links, frequency, seed) for seed in seeds]
        kept |= {f"{name}{cell}": np.array([state[k] for state in states]) for k, name in enumerate(NAMES)}
        print(f"{links} links at {frequency:g} Hz", flush=True)
    np.savez_compressed(path, **kept)


class Loops:
    """All chains of n links: every release with every variant of the drag.

    Attributes:
        chains: those chains.
        first: index of the first chain of each variant; they stand one variant after the other.
    """

    def __init__(self, position: Array, velocity: Array, numbers: Array, device: str) -> None:
        """Place each release once for each variant; arrays of shape (releases, n, 3) and (releases, parameters)."""
        count, copies = len(position), len(VARIANTS)
        parameters = [warpchain.Parameters(**dict(zip(PARAMETERS, map(float, row), strict=True))) for row in numbers]
        self.chains = warpchain.Chains(
            parameters * copies, np.tile(position, (copies, 1, 1)), np.tile(velocity, (copies, 1, 1)), device=device
        )
        self._variant = np.repeat(np.arange(copies), count)
        self._length = np.array([each.link_length for each in parameters] * copies)
        self._radius = np.array([each.circle_radius for each in parameters] * copies)
        halves = [
            [(p.inner_mass, p.inner_mass, p.inner_inertia), (p.outer_mass, p.outer_mass, p.outer_inertia)]
            for p in parameters
        ]
        self._inertia = np.tile(np.array(halves), (copies, position.shape[1] // 2, 1))
        self._rate = np.array([each.rate for each in VARIANTS])[self._variant]
        self._acts = np.array([(each.in_flight, each.in_impacts) for each in VARIANTS])[self._variant]
        self._least = np.full(len(self._variant), position.shape[1] / LONGEST)

    def walk(self) -> dict[str, Array]:
        """Let all walk to rest; returns arrays of shape (variants, releases): Δx, and when the loop was lost.

        Δx is NaN of a chain that did not come to rest.
        """
        chains = self.chains
        looping = np.arange(len(self._variant))
        position, velocity = chains.motions()
        area = areas(position)
        lost_at = np.full(len(looping), np.nan)
        dragged_for = np.zeros(len(looping))
        while len(looping) and chains.time < LATEST:
            dragged_for[looping] += self._drag(looping, position, velocity) * STEP
            chains.run(chains.time + STEP, looping)
            position, velocity = chains.motions(looping)
            keeps = areas(position) > 0.9 * area[looping]
            lost_at[looping[~keeps]] = chains.time
            keeps &= chains.status[looping] == warpchain.Status.FINISHED
            looping, position, velocity = looping[keeps], position[keeps], velocity[keeps]
        chains.run(END, to_rest=True)
        mass = self._inertia[..., 0]
        dx = np.sum(mass * chains.motions()[0][..., 0], axis=1) / mass.sum(axis=1)
        dx[chains.status != warpchain.Status.AT_REST] = np.nan
        found = {"dx": dx, "lost_at": lost_at, "dragged_for": dragged_for}
        return {name: values.reshape(len(VARIANTS), -1) for name, values in found.items()}

    def _drag(self, looping: NDArray[np.int64], position: Array, velocity: Array) -> NDArray[np.bool_]:
        """Apply the drag to these chains, where it acts now; returns where it does."""
        half = 0.5 * self._length[looping, None] * np.abs(np.sin(position[..., 2]))
        gap = np.min(position[..., 1] - half, axis=1) - self._radius[looping]
        acts = np.where(gap < NEAR, self._acts[looping, 1], self._acts[looping, 0]) & (self._rate[looping] > 0)
        here = looping[acts]
        if len(here):
            share = 1 - np.exp(-self._rate[here] * STEP)
            settings = (self._inertia[here], self._length[here], share, self._least[here])
            changed, _energy, _speed = drag_waves(position[acts], velocity[acts], *settings)
            self.chains.set_velocity(here, changed)
        return np.asarray(acts)


def areas(position: Array) -> Array:
    """Area [m²] inside loops of links with these centres, (W, n, 3)."""
    x, y = position[..., 0], position[..., 1]
    return np.abs(0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1))


def walk(releases: Path, out: Path, device: str = "cpu", only: int | None = None) -> None:
    """Walk on from all releases with every variant, or those of so many links; arrays (variants, releases) by cell."""
    states = np.load(releases)
    found: dict[str, Any] = {}
    for cell, (links, frequency) in enumerate(CELLS):
        if only in (None, links) and f"position{cell}" in states:
            begun = time.perf_counter()
            result = Loops(*(states[f"{name}{cell}"] for name in NAMES), device).walk()
            found |= {f"{name}{cell}": values for name, values in result.items()}
            np.savez_compressed(out, **found)
            print(f"{links} links at {frequency:g} Hz: {time.perf_counter() - begun:.0f} s", flush=True)


def main(arguments: list[str]) -> None:
    """Release, or walk."""
    match arguments:
        case ["release", path]:
            release(Path(path))
        case ["walk", releases, out, *device]:
            walk(Path(releases), Path(out), *device[:1], *map(int, device[1:]))
        case _:
            sys.exit("give release FILE.npz, or walk RELEASES.npz FILE.npz [cpu|cuda [LINKS]]")


if __name__ == "__main__":
    main(sys.argv[1:])
