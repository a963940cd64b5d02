"""Dose and response of a drag on short waves: the same releases walk on with and without it.

    python -m studies.waves.drag release releases.npz            # six minutes of one core: the loops at their release
    python -m studies.waves.drag walk releases.npz drag.npz cuda    # five minutes of a GPU: how far they walk

`studies.waves.doses` makes the tables of the page from drag.npz.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer

import warpchain
from studies.common import Array, run_study
from studies.waves.wave_drag import distances, drag_waves, inertia_of

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


WHEN: Final = {"always": (True, True), "in flight": (True, False), "in impacts": (False, True)}
"""Whether a drag acts in flight, and in impacts."""
RATES: Final = (10.0, 25.0, 50.0, 100.0, 250.0, 1000.0)
HALVES: Final = (10.0, 50.0, 250.0)
VARIANTS: Final = (
    *(("always", rate) for rate in (0.0, 1e-9, *RATES)),
    *((when, rate) for when in ("in flight", "in impacts") for rate in HALVES),
)
"""Drags: when they act, and at which rate [1/s] fast waves die; the second changes the bits and nothing else."""

NAMES: Final = ("position", "velocity", "numbers")
"""Arrays of a release."""


def released(links: int, frequency: float, seed: int) -> tuple[Array, Array, warpchain.Parameters]:
    """Position and velocity of the links at the release, (n, 3) each, and the chain's parameters.

    Velocities are those of joints over the first three frames, some 1e-5 s apart, to second order: good to 1e-5 m/s.
    """
    scene = {"links": links, "frequency": frequency, "start": "spinning", "walk_limit": 4e-5}
    walk = warpchain.walk(preset="soft", **scene, frame_interval=1e-5, seed=seed)
    first, second, third = walk.frame_joints[:3]
    one, two = walk.frame_time[1:3]
    joints = np.stack([first, ((second - first) * two / one - (third - first) * one / two) / (two - one)])
    before = np.roll(joints, 1, axis=1)
    chord, change = joints - before
    center, speed = 0.5 * (joints + before)
    angle = np.arctan2(chord[:, 1], chord[:, 0])
    turning = (chord[:, 0] * change[:, 1] - chord[:, 1] * change[:, 0]) / np.sum(chord**2, axis=1)
    return np.column_stack([center, angle]), np.column_stack([speed, turning]), walk.setup.parameters


def release(path: Path) -> None:
    """Hold and release all loops, and write their states: arrays of each cell by its number."""
    kept: dict[str, Array] = {}
    for cell, (links, frequency) in enumerate(CELLS):
        seeds = [first + sample for first in SEEDS for sample in range(SAMPLES)]
        states = [released(links, frequency, seed) for seed in seeds]
        arrays = ((position, velocity, list(chain.model_dump().values())) for position, velocity, chain in states)
        kept |= {f"{name}{cell}": np.array(each) for name, each in zip(NAMES, zip(*arrays, strict=True), strict=True)}
        print(f"{links} links at {frequency:g} Hz", flush=True)
    np.savez_compressed(path, **kept)


class Loops:
    """All chains of n links: every release with every variant of the drag.

    Attributes:
        chains: those chains.
        first: index of the first chain of each variant; they stand one variant after the other.
    """

    def __init__(
        self, position: Array, velocity: Array, parameters: Sequence[warpchain.Parameters], device: str
    ) -> None:
        """Place each release once for each variant; arrays of shape (releases, n, 3)."""
        count, copies = len(position), len(VARIANTS)
        self.chains = warpchain.Chains(
            [*parameters] * copies, np.tile(position, (copies, 1, 1)), np.tile(velocity, (copies, 1, 1)), device=device
        )
        self._variant = np.repeat(np.arange(copies), count)
        self._length = np.array([each.link_length for each in parameters] * copies)
        self._radius = np.array([each.circle_radius for each in parameters] * copies)
        self._inertia = np.tile([inertia_of(position.shape[1], each) for each in parameters], (copies, 1, 1))
        self._rate = np.array([rate for _, rate in VARIANTS])[self._variant]
        self._acts = np.array([WHEN[when] for when, _ in VARIANTS])[self._variant]
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
        found = {"dx": distances(chains, self._inertia), "lost_at": lost_at, "dragged_for": dragged_for}
        return {name: values.reshape(len(VARIANTS), -1) for name, values in found.items()}

    def _drag(self, looping: Array, position: Array, velocity: Array) -> Array:
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


def walk(
    releases: Path,
    out: Path,
    device: Annotated[str, typer.Argument()] = "cpu",
    only: Annotated[int | None, typer.Argument()] = None,
) -> None:
    """Walk on from all releases with every variant, or those of so many links; arrays (variants, releases) by cell."""
    states = np.load(releases)
    found: dict[str, Any] = {}
    for cell, (links, frequency) in enumerate(CELLS):
        if only in (None, links) and f"position{cell}" in states:
            begun = time.perf_counter()
            position, velocity, numbers = (states[f"{name}{cell}"] for name in NAMES)
            names = warpchain.Parameters.model_fields
            chains = [warpchain.Parameters(**dict(zip(names, row, strict=True))) for row in numbers.tolist()]
            result = Loops(position, velocity, chains, device).walk()
            found |= {f"{name}{cell}": values for name, values in result.items()}
            np.savez_compressed(out, **found)
            print(f"{links} links at {frequency:g} Hz: {time.perf_counter() - begun:.0f} s", flush=True)


if __name__ == "__main__":
    run_study(release, walk)
