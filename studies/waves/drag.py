"""Dose and response of a drag on short waves: the same releases walk on with and without it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import warpchain
from studies.common import Array, area_of, run_study
from studies.waves.wave_drag import distances, drag_waves, inertia_of, lowest

CELLS = tuple((links, frequency) for links in (60, 90, 120, 180) for frequency in (15.0, 20.0, 25.0, 30.0))
SEEDS = (1000, 2000)  # The samples of each are so many, plus the number of the sample
SAMPLES = 20
STEP = 2e-3  # Time [s] between two applications of the drag
LATEST = 4.0  # Time [s] at which the drag ends; it ends earlier when the loop has lost a tenth of its area
END = 20.0
LONGEST = 24.0  # Longest waves that are dragged, in links
NEAR = 1e-3  # A chain whose lowest circle is nearer to the floor than this [m] is in an impact
WHEN = {"always": (True, True), "in flight": (True, False), "in impacts": (False, True)}  # In flight, in impacts
RATES = (10.0, 25.0, 50.0, 100.0, 250.0, 1000.0)
HALVES = (10.0, 50.0, 250.0)
VARIANTS = (
    *(("always", rate) for rate in (0.0, 1e-9, *RATES)),
    *((when, rate) for when in ("in flight", "in impacts") for rate in HALVES),
)
"""Drags: when they act, and at which rate [1/s] fast waves die; the second changes the bits and nothing else."""


def released(links: int, frequency: float, seed: int) -> tuple[Array, Array, warpchain.Parameters]:
    """Position and velocity of the links at the release, (n, 3) each, and the chain's parameters."""
    scene = {"links": links, "frequency": frequency, "start": "spinning", "walk_limit": 1e-4}
    walk = warpchain.walk(preset="soft", **scene, seed=seed)
    state = walk.state(0.0)
    return state.position, state.velocity, walk.setup.parameters


def walked(
    position: Array, velocity: Array, parameters: Sequence[warpchain.Parameters], device: str
) -> dict[str, Array]:
    """Let every release, arrays (releases, n, 3), walk to rest with every variant of the drag.

    Returns Δx [m], NaN of a chain that did not come to rest, and how long it was dragged [s], (variants, releases).
    """
    count, copies, least = len(position), len(VARIANTS), position.shape[1] / LONGEST
    tiled = (np.tile(each, (copies, 1, 1)) for each in (position, velocity))
    chains = warpchain.Chains([*parameters] * copies, *tiled, device=device)
    length, radius = np.array([[each.link_length, each.circle_radius] for each in parameters] * copies).T
    inertia = np.tile([inertia_of(position.shape[1], each) for each in parameters], (copies, 1, 1))
    rate = np.repeat([rate for _, rate in VARIANTS], count)
    acts = np.repeat([WHEN[when] for when, _ in VARIANTS], count, axis=0)
    position, velocity = chains.motions()
    looping, area, dragged_for = np.arange(len(rate)), area_of(position), np.zeros(len(rate))
    while len(looping) and chains.time < LATEST:
        near = lowest(position, length[looping]) - radius[looping] < NEAR
        now = np.where(near, acts[looping, 1], acts[looping, 0]) & (rate[looping] > 0)
        here = looping[now]
        if len(here):
            share = 1 - np.exp(-rate[here] * STEP)
            settings = inertia[here], length[here], share, np.full(len(here), least)
            chains.set_velocity(here, drag_waves(position[now], velocity[now], *settings)[0])
        dragged_for[here] += STEP
        chains.run(chains.time + STEP, looping)
        position, velocity = chains.motions(looping)
        keeps = (area_of(position) > 0.9 * area[looping]) & (chains.status[looping] == warpchain.Status.FINISHED)
        looping, position, velocity = looping[keeps], position[keeps], velocity[keeps]
    chains.run(END, to_rest=True)
    found = {"dx": distances(chains, inertia), "dragged_for": dragged_for}
    return {name: values.reshape(copies, -1) for name, values in found.items()}


def main(out: Path, device: Annotated[str, typer.Argument()] = "cpu") -> None:
    """Hold and release all loops, and walk on with every variant; arrays (variants, releases) by number of the cell."""
    seeds, found = [first + sample for first in SEEDS for sample in range(SAMPLES)], {}
    for cell, (links, frequency) in enumerate(CELLS):
        position, velocity, chains = zip(*(released(links, frequency, seed) for seed in seeds), strict=True)
        result = walked(np.array(position), np.array(velocity), chains, device)
        found |= {f"{name}{cell}": values for name, values in result.items()}
        np.savez_compressed(out, **found)
        print(f"{links} links at {frequency:g} Hz", flush=True)


if __name__ == "__main__":
    run_study(main)
