"""Reduces parts of the sweep ``phase_diagram`` to statistics of its cells: the rows of results/cells.csv."""

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from studies.common import write_text
from studies.phase_diagram.endings import Ending, endings
from warpchain import InputError, Status, SweepResult

Array = NDArray[Any]
Cell = tuple[int, float]
"""Links, frequency [Hz]."""

CSV: Final = Path(__file__).parent / "results" / "cells.csv"
MISSING: Final = -1
"""Status of a walk that is not there yet, and any integer that is not known."""
MOST_ENERGY_ERROR: Final = 0.05
"""A walk with a greater energy error counts as inaccurate."""
FAILURES: Final = tuple(code for code in Status if code not in (Status.RUNNING, Status.AT_REST, Status.FINISHED))
"""What a walk can end with instead of rest."""
WAYS: Final = tuple(code for code in Ending if code != Ending.UNKNOWN)
AVERAGED: Final = ("bounces", "walk_time", "hold_time", "collapsed_at", "self_contact_at")
"""Columns of the sweep of which the file has means over the walks at rest. NaNs are left out."""
COLUMNS: Final = (
    *("status", "dx", "steps_accepted", "steps_rejected", "energy_error", "flight_before_collapse"),
    *("bounces_before_collapse", "bounces_before_self_contact", *AVERAGED),
)
"""Columns of the sweep that are needed."""


@dataclass(frozen=True)
class Part:
    """Walks over links and frequencies.

    Attributes:
        name: for messages.
        settings: what all parts must share, see `settings_of`.
        links: values of the first axis.
        frequency: values of the second one [Hz].
        columns: `COLUMNS`, shape (links, frequencies, samples).
    """

    name: str
    settings: str
    links: Array
    frequency: Array
    columns: dict[str, Array]


def parts_of(result: SweepResult, name: str) -> list[Part]:
    """The parts in a sweep, one for each block.

    Args:
        result: the sweep.
        name: for messages.

    Raises:
        InputError: it has other axes than links and frequency.
    """
    parts = []
    for block in result.blocks.values():
        if set(block.axes) != {"links", "frequency"}:
            raise InputError(f"{name}: axes are {', '.join(block.axes)}; give a sweep of links and frequency")
        order = [list(block.axes).index(axis) for axis in ("links", "frequency")] + [2]
        columns = {column: block.columns[column].transpose(order) for column in COLUMNS}
        parts.append(Part(name, settings_of(result), block.axes["links"], block.axes["frequency"], columns))
    return parts


def walks_by_cell(parts: Iterable[Part]) -> dict[Cell, dict[str, Array]]:
    """The walks of all parts by cell: `COLUMNS`, shape (walks,), missing walks included.

    Raises:
        InputError: a part has other settings than the first, or the same walks as another one.
    """
    found: dict[Cell, list[dict[str, Array]]] = {}
    settings = ""
    for part in parts:
        settings = settings or part.settings
        if part.settings != settings:
            raise InputError(f"{part.name}: other settings than the parts before; reduce it alone")
        for i, links in enumerate(part.links):
            for j, frequency in enumerate(part.frequency):
                walks = {name: column[i, j].copy() for name, column in part.columns.items()}
                others = found.setdefault((int(links), float(frequency)), [])
                if any(are_same(walks["dx"], other["dx"]) for other in others):
                    raise InputError(f"{part.name}: walks of another part, the seed is the same; leave one out")
                others.append(walks)
    return {
        cell: {name: np.concatenate([walks[name] for walks in cells]) for name in cells[0]}
        for cell, cells in sorted(found.items())
    }


def are_same(dx: Array, others: Array) -> bool:
    """Whether most distances [m] occur among others to seven digits: by chance hardly one does."""
    known = np.float32(dx[np.isfinite(dx)])
    return len(known) > 1 and bool(np.isin(known, np.float32(others)).mean() > 0.5)


def settings_of(result: SweepResult) -> str:
    """What all parts must share: everything but names, seed, samples, grid, device and what is kept."""
    blocks = []
    for block in result.sweep["blocks"]:
        kept = {key: value for key, value in block.items() if key not in ("name", "samples", "grid")}
        blocks.append(kept | {"options": {**block["options"], "device": ""}})
    same = [settings for number, settings in enumerate(blocks) if settings not in blocks[:number]]
    return json.dumps([same, result.provenance["numerics_version"]], sort_keys=True)


def reduced(links: int, frequency: float, walks: Mapping[str, Array]) -> dict[str, float]:
    """Statistics of one cell: a row of the file. NaN where there are too few walks.

    Args:
        links: of the chain.
        frequency: of the sprocket [Hz].
        walks: `COLUMNS`, shape (walks,).
    """
    status = walks["status"]
    rest = status == Status.AT_REST
    dx, codes = walks["dx"][rest].astype(float), endings(walks)[rest]
    count = len(dx)
    attempts = (_known(walks["steps_accepted"]) + _known(walks["steps_rejected"]))[status != MISSING]
    deciles = np.quantile(dx, [0.1, 0.5, 0.9]) if count else np.full(3, np.nan)
    row: dict[str, float] = {
        "links": links,
        "frequency": frequency,
        "walks": int((status != MISSING).sum()),
        "missing": int((status == MISSING).sum()),
        "at_rest": count,
        **{code.label: int((status == code).sum()) for code in FAILURES},
        "told": int((codes != Ending.UNKNOWN).sum()),
        "flight_told": int(np.isfinite(walks["flight_before_collapse"][rest]).sum()),
        "inaccurate": int((walks["energy_error"][rest] > MOST_ENERGY_ERROR).sum()),
        "dx_mean": _mean(dx),
        "dx_sd": _sd(dx),
        "dx_se": _sd(dx) / np.sqrt(count) if count > 1 else np.nan,
        **dict(zip(("dx_10", "dx_50", "dx_90"), map(float, deciles), strict=True)),
        **{f"{name}_mean": _mean(_known(walks[name])[rest]) for name in AVERAGED},
        "bounces_sd": _sd(_known(walks["bounces"])[rest]),
        "attempts_mean": _mean(attempts),
        **{way.label: int((codes == way).sum()) for way in WAYS},
        **{f"dx_{way.label}": _mean(dx[codes == way]) for way in WAYS},
    }
    return row


def _known(values: Array) -> Array:
    """As floats, NaN where a number is missing."""
    return np.where(values == MISSING, np.nan, values)


def _mean(values: Array) -> float:
    """Mean of what is not NaN; NaN of nothing."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _sd(values: Array) -> float:
    """Standard deviation of what is not NaN; NaN of fewer than two."""
    known = values[np.isfinite(values)]
    return float(known.std(ddof=1)) if len(known) > 1 else float("nan")


def write_csv(rows: Sequence[Mapping[str, float | str]], path: Path) -> None:
    """Write the rows; numbers that are not whole have six digits."""
    names = list(rows[0])
    lines = [",".join(names)]
    for row in rows:
        values = (row[name] for name in names)
        lines.append(",".join(f"{value:.6g}" if isinstance(value, float) else str(value) for value in values))
    write_text(path, "\n".join(lines) + "\n")


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a file, as texts by column."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def read_csv(path: Path = CSV) -> dict[str, Array]:
    """The columns of the file, shape (cells,) each."""
    rows = read_rows(path)
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
