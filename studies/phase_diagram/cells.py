"""Reduces parts of the sweep ``phase_diagram`` to statistics of its cells: the rows of results/cells.csv."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from studies.common import Array, Columns, deviation, mean, of_cells, standard_error
from studies.phase_diagram.endings import Ending, endings
from warpchain import InputError, Status, SweepResult

Cell = tuple[int, float]  # Links, frequency [Hz]

CSV = Path(__file__).parent / "results" / "cells.csv"
MISSING = -1  # Status of a walk that is not there yet, and any integer that is not known
MOST_ENERGY_ERROR = 0.05  # A walk with a greater energy error counts as inaccurate
FAILURES = tuple(code for code in Status if code not in (Status.RUNNING, Status.AT_REST, Status.FINISHED))
"""What a walk can end with instead of rest."""
WAYS = tuple(code for code in Ending if code != Ending.UNKNOWN)
AVERAGED = ("bounces", "walk_time", "hold_time", "collapsed_at")  # Columns of which the file has means at rest
COLUMNS = ("status", "dx", "energy_error", "flight_before_collapse", "bounces_before_collapse", *AVERAGED)
"""Columns of the sweep that are needed."""


def walks_by_cell(parts: Sequence[SweepResult], names: Sequence[str] = COLUMNS) -> dict[Cell, dict[str, Array]]:
    """The walks of all parts of a sweep by cell: columns of these names, shape (walks,), missing walks included."""
    found: dict[Cell, list[dict[str, Array]]] = {}
    for number, part in enumerate(parts):
        if axes := [block.axes for block in part.blocks.values() if set(block.axes) != {"links", "frequency"}]:
            raise InputError(f"{part.name}: expected links and frequency, got {', '.join(axes[0])}; use such a sweep")
        if settings_of(part) != settings_of(parts[0]):
            raise InputError(f"{part.name}: other settings than the parts before; reduce it alone")
        if part.sweep["seed"] in [other.sweep["seed"] for other in parts[:number]]:
            raise InputError(f"{part.name}: repeats the seed of another part; remove one")
        for block in part.blocks.values():
            for place, at in of_cells(block):
                walks = {name: block.columns[name][place] for name in names}
                found.setdefault((int(at["links"]), float(at["frequency"])), []).append(walks)
    return {
        cell: {name: np.concatenate([walks[name] for walks in cells]) for name in names}
        for cell, cells in sorted(found.items())
    }


def settings_of(result: SweepResult) -> str:
    """What all parts must share: everything but names, seed, samples, grid, device and what is kept."""
    blocks = []
    for block in result.sweep["blocks"]:
        kept = {key: value for key, value in block.items() if key not in ("name", "samples", "grid")}
        blocks.append(kept | {"options": {**block["options"], "device": ""}})
    same = [settings for number, settings in enumerate(blocks) if settings not in blocks[:number]]
    return json.dumps([same, result.provenance["numerics_version"]], sort_keys=True)


def reduced(links: int, frequency: float, walks: Columns) -> dict[str, float]:
    """Statistics of one cell: a row of the file. NaN where there are too few walks."""
    status = walks["status"]
    known = {name: np.where(values == MISSING, np.nan, values) for name, values in walks.items()}
    rest = status == Status.AT_REST
    dx, codes = walks["dx"][rest].astype(float), endings(walks)[rest]
    deciles = np.quantile(dx, [0.1, 0.5, 0.9]) if len(dx) else np.full(3, np.nan)
    return {
        "links": links,
        "frequency": frequency,
        "walks": int((status != MISSING).sum()),
        "missing": int((status == MISSING).sum()),
        "at_rest": len(dx),
        **{code.label: int((status == code).sum()) for code in FAILURES},
        "flight_told": int(np.isfinite(walks["flight_before_collapse"][rest]).sum()),
        "inaccurate": int((walks["energy_error"][rest] > MOST_ENERGY_ERROR).sum()),
        "dx_mean": float(mean(dx)),
        "dx_sd": float(deviation(dx)),
        "dx_se": float(standard_error(dx)),
        **dict(zip(("dx_10", "dx_50", "dx_90"), map(float, deciles), strict=True)),
        **{f"{name}_mean": float(mean(known[name][rest])) for name in AVERAGED},
        "bounces_sd": float(deviation(known["bounces"][rest])),
        **{way.label: int((codes == way).sum()) for way in WAYS},
    }
