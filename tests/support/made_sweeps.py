"""Sweeps whose walks were never simulated: plausible rows in real folders, for everything that reads one."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from warpchain.results.sweep_result import SweepResult, load
from warpchain.status import Status
from warpchain.store.folder import SweepFolder
from warpchain.store.shards import stamp, write_shard
from warpchain.sweeps.plan import PlannedWalk, load_sweep
from warpchain.walks.rows import ROW_KEYS, Rows, missing_rows, quantity_of

Outcome = Callable[[PlannedWalk], "float | Status | None"]
"""What a walk gives: its distance [m], how it failed, or None if it has not been run yet."""

FIGURE_6: dict[str, Any] = {
    "version": 1,
    "name": "made <up> & down",
    "seed": 6,
    "preset": "soft",
    "samples": 12,
    "blocks": [
        {"name": "rest", "grid": {"links": [60, 90, 120, 150, 180], "frequency": [5, 10, 15, 20, 25, 30]}},
        {
            "name": "ellipse",
            "scene": {"start": "ellipse"},
            "grid": {"links": [150, 180], "frequency": [10, 15, 20, 25, 30]},
        },
    ],
}

SMALL: dict[str, Any] = FIGURE_6 | {
    "samples": 3,
    "blocks": [
        {"name": "rest", "grid": {"links": [60, 120], "frequency": [10, 20]}},
        {"name": "ellipse", "scene": {"start": "ellipse"}, "grid": {"links": [120], "frequency": [10, 20]}},
    ],
}

TOLERANCE: dict[str, Any] = {
    "version": 1,
    "name": "tolerance",
    "seed": 7,
    "preset": "soft",
    "samples": 12,
    "same_samples_along": ["tolerance"],
    "grid": {"links": [60, 120], "frequency": [10, 20], "tolerance": [1e-6, 1e-9]},
}


def distance(walk: PlannedWalk) -> float:
    """Roughly what a chain does: farther when fast, short or smooth; tolerances differ by a few per cent [m]."""
    scene, parameters = walk.setup.scene, walk.setup.parameters
    scatter = np.random.default_rng(walk.index).normal(0.0, 0.02)
    same = math.sin(1e5 * parameters.viscous_friction * walk.sample + walk.sample)
    longer = 1.12 if scene.start == "ellipse" else 1.0
    friction = (0.27 / parameters.floor_friction) ** 0.5
    return (
        1.29
        * (scene.frequency / 20) ** 1.7
        * (60 / scene.links) ** 0.8
        * longer
        * friction
        * (1 + 0.05 * same + scatter)
    )


def fill_row(walk: PlannedWalk, outcome: "float | Status", rows: Rows, **own: float) -> None:
    """Fill the row of a walk that came to rest at a distance [m], or failed, with own values of some columns."""
    failed = isinstance(outcome, Status)
    rows["status"] = outcome if failed else Status.AT_REST
    for name in rows.dtype.names or ():
        if (quantity := quantity_of(name)) in walk.draws:
            rows[name] = walk.draws[quantity]
        elif name.startswith("penetration_") or name == "greatest_opening":
            rows[name] = 7e-6
        elif name not in (*(ROW_KEYS.names or ()), "status", "dx"):
            rows[name] = 7
    rows["dx"] = math.nan if failed else outcome
    rows["energy_residual"] = 14e-4  # of 14 J
    for name, value in own.items():
        rows[name] = value


def make_sweep(
    folder: Path,
    content: Mapping[str, object],
    outcome: Outcome = distance,
    columns: Callable[[PlannedWalk], Mapping[str, float]] = lambda walk: {},
) -> SweepResult:
    """A folder in which every walk has its outcome and columns; in shards of one walk, if some are not to be there.

    To these two the walks are numbered cell by cell.
    """
    sweep = load_sweep(content)
    indices = sweep.indices.tolist()
    walks = {index: replace(sweep.walk(index), index=number) for number, index in enumerate(indices)}
    outcomes = {index: outcome(walk) for index, walk in walks.items()}
    with SweepFolder.open(folder, sweep, shard_size=1 if None in outcomes.values() else len(walks)) as store:
        for shard in store.missing():
            rows = missing_rows(shard.kind, shard.keys)
            for row, index in enumerate(shard.walks.tolist()):
                if (given := outcomes[index]) is not None:
                    fill_row(walks[index], given, rows[row : row + 1], **columns(walks[index]))
            if outcomes[shard.walks[0]] is not None:
                write_shard(store.directory, stamp(store.directory), shard, rows, {})
    return load(folder)
