"""Reduces the sweep ``phase_diagram`` to statistics of its cells, draws them, and writes the tables of its page.

    python docs/phase_diagram.py FOLDER…   # parts of the sweep → docs/results/phase_diagram.csv, and all below
    python docs/phase_diagram.py           # that file → figures, tables of docs/phase-diagram.md, printed numbers

Parts are folders of ``warpchain sweep`` with other seeds, also unfinished ones; their grids may differ. The second
command repeats every number and figure of the page. It needs warpchain[scipy] and takes about a minute.
"""

import argparse
import csv
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import phase_figures
import phase_scaling
from numpy.typing import NDArray

import warpchain
from warpchain.files import write_whole
from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.endings import Ending, endings
from warpchain.walks.energy_error import MOST_ENERGY_ERROR
from warpchain.walks.rows import MISSING

Array = NDArray[Any]
Cell = tuple[int, float]
"""Links, frequency [Hz]."""

FOLDER: Final = Path(__file__).parent
CSV: Final = FOLDER / "results" / "phase_diagram.csv"
FIGURES: Final = FOLDER / "figures"
PAGE: Final = FOLDER / "phase-diagram.md"

FAILURES: Final = tuple(code for code in Status if code not in (Status.RUNNING, Status.AT_REST, Status.FINISHED))
"""What a walk can end with instead of rest."""
WAYS: Final = tuple(code for code in Ending if code != Ending.UNKNOWN)
AVERAGED: Final = {
    "bounces": "bounces",
    "walk_time": "walk_time",
    "hold_time": "hold_time",
    "collapsed_at": "collapsed_at",
    "self_contact_at": "self_contact_at",
}
"""Further means over the walks at rest: column of the file, before `_mean` → column of the sweep. NaNs are left out."""
NEEDED: Final = (
    *("status", "dx", "steps_accepted", "steps_rejected", "energy_error", "flight_before_collapse"),
    *("bounces_before_collapse", "bounces_before_self_contact", *AVERAGED.values()),
)
"""Columns of the sweep that are read."""


def walks_by_cell(results: Iterable[SweepResult]) -> dict[Cell, dict[str, Array]]:
    """The walks of all parts by cell: columns of `NEEDED`, shape (walks,), missing walks included.

    Raises:
        InputError: a part has other axes than links and frequency, other settings than the first, or cells and the
            seed of another one.
    """
    parts: dict[Cell, list[dict[str, Array]]] = {}
    seeds: dict[Cell, set[int]] = {}
    first: str | None = None
    for result in results:
        for block in result.blocks.values():
            if set(block.axes) != {"links", "frequency"}:
                raise InputError(
                    f"{result.name}: axes are {', '.join(block.axes)}; give a sweep of links and frequency"
                )
        settings = _settings(result)
        first = settings if first is None else first
        if settings != first:
            raise InputError(f"{result.name}, seed {result.seed}: other settings than the first part; reduce it alone")
        for block in result.blocks.values():
            # the samples are the last axis
            order = [list(block.axes).index(name) for name in ("links", "frequency")] + [2]
            columns = {name: block.columns[name].transpose(order) for name in NEEDED}
            for i, links in enumerate(block.axes["links"]):
                for j, frequency in enumerate(block.axes["frequency"]):
                    cell = (int(links), float(frequency))
                    if result.seed in seeds.setdefault(cell, set()):
                        raise InputError(f"{result.name}: another part has its seed {result.seed}, too; leave one out")
                    seeds[cell].add(result.seed)
                    walks = {name: column[i, j].copy() for name, column in columns.items()}
                    parts.setdefault(cell, []).append(walks)
    return {
        cell: {name: np.concatenate([part[name] for part in found]) for name in NEEDED}
        for cell, found in sorted(parts.items())
    }


def _settings(result: SweepResult) -> str:
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
        walks: columns of `NEEDED`, shape (walks,).
    """
    status = walks["status"]
    rest = status == Status.AT_REST
    dx, codes = walks["dx"][rest], endings(walks)[rest]
    count = len(dx)
    attempts = (walks["steps_accepted"] + walks["steps_rejected"])[status != MISSING]
    deciles = np.quantile(dx, [0.1, 0.5, 0.9]) if count else np.full(3, np.nan)
    row: dict[str, float] = {
        "links": links,
        "frequency": frequency,
        "walks": int((status != MISSING).sum()),
        "missing": int((status == MISSING).sum()),
        "at_rest": count,
        **{code.label: int((status == code).sum()) for code in FAILURES},
        "inaccurate": int((walks["energy_error"][rest] > MOST_ENERGY_ERROR).sum()),
        "dx_mean": _mean(dx),
        "dx_sd": _sd(dx),
        "dx_se": _sd(dx) / np.sqrt(count) if count > 1 else np.nan,
        **dict(zip(("dx_10", "dx_50", "dx_90"), map(float, deciles), strict=True)),
        **{f"{name}_mean": _mean(walks[column][rest]) for name, column in AVERAGED.items()},
        "bounces_sd": _sd(walks["bounces"][rest].astype(float)),
        "attempts_mean": _mean(attempts),
        **{way.label: int((codes == way).sum()) for way in WAYS},
        **{f"dx_{way.label}": _mean(dx[codes == way]) for way in WAYS},
    }
    return row


def _mean(values: Array) -> float:
    """Mean of what is not NaN; NaN of nothing."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _sd(values: Array) -> float:
    """Standard deviation of a sample; NaN of fewer than two."""
    return float(values.std(ddof=1)) if len(values) > 1 else float("nan")


def write_csv(rows: Sequence[Mapping[str, float]], path: Path) -> None:
    """Write the rows, whole or not at all; numbers that are not whole have six digits."""
    names = list(rows[0])
    lines = [",".join(names)]
    for row in rows:
        values = (row[name] for name in names)
        lines.append(",".join(str(value) if isinstance(value, int) else f"{value:.6g}" for value in values))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, "\n".join(lines) + "\n")


def read_csv(path: Path) -> dict[str, Array]:
    """The columns of the file, shape (cells,) each."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def table_of_cells(cells: Mapping[str, Array]) -> str:
    """Markdown: Δx ± s.d. for some links and frequencies."""
    shown_links, shown_frequencies = chosen(cells["links"]), chosen(cells["frequency"])
    head = "| links | " + " | ".join(f"{frequency:g} Hz" for frequency in shown_frequencies) + " |"
    lines = [head, "|" + "---|" * (1 + len(shown_frequencies))]
    for links in shown_links:
        texts = []
        for frequency in shown_frequencies:
            at = np.flatnonzero((cells["links"] == links) & (cells["frequency"] == frequency))
            texts.append(text_of_cell({name: column[at[0]] for name, column in cells.items()}) if len(at) else "")
        lines.append(f"| {links:g} | " + " | ".join(texts) + " |")
    return "\n".join(lines)


def text_of_cell(cell: Mapping[str, float]) -> str:
    """Mean ± standard deviation, and the share that failed if any did."""
    failed = 1 - cell["at_rest"] / cell["walks"] if cell["walks"] else 0.0
    spread = "" if np.isnan(cell["dx_sd"]) else f" ± {cell['dx_sd']:.2g}"
    text = "–" if np.isnan(cell["dx_mean"]) else f"{cell['dx_mean']:.3g}{spread}"
    return text if failed == 0 else f"{text} ({100 * failed:.3g} % failed)"


def chosen(values: Array) -> Array:
    """About six of the values that occur, evenly spread, the first and the last among them."""
    known = np.unique(values)
    return known[np.unique(np.linspace(0, len(known) - 1, 6).round().astype(int))]


def table_of_endings(cells: Mapping[str, Array]) -> str:
    """Markdown: share of each ending among all walks at rest, and where it is the most frequent one."""
    counts = np.stack([cells[way.label] for way in WAYS], axis=1)
    most = np.where(counts.sum(axis=1) > 0, counts.argmax(axis=1), -1)
    lines = [
        "| way of ending | share | cells where it is the most frequent | Δx over the mean of its cells |",
        "|---|---|---|---|",
    ]
    for number, way in enumerate(WAYS):
        share = counts[:, number].sum() / max(counts.sum(), 1)
        weight = counts[:, number] * np.isfinite(cells[f"dx_{way.label}"])
        ratio = (
            np.nansum(weight * cells[f"dx_{way.label}"] / cells["dx_mean"]) / weight.sum() if weight.sum() else np.nan
        )
        text = "" if np.isnan(ratio) else f"{ratio:.3f}"
        lines.append(f"| {way.meaning} | {100 * share:.2g} % | {np.sum(most == number)} | {text} |")
    return "\n".join(lines)


def table_of_failures(cells: Mapping[str, Array]) -> str:
    """Markdown: walks by status."""
    walks = cells["walks"].sum()
    lines = ["| status | walks | cells | where |", "|---|---|---|---|"]
    for name in ("at_rest", *(code.label for code in FAILURES), "missing"):
        number = cells[name]
        if number.sum() == 0 and name != "at_rest":
            continue
        there = number > 0
        where = "" if there.all() else f"{span(cells['links'][there])} links, {span(cells['frequency'][there])} Hz"
        lines.append(f"| `{name}` | {number.sum():,.0f} | {there.sum()} | {where} |")
    return "\n".join([*lines, "", f"{walks:,.0f} walks in {len(cells['links'])} cells."])


def span(values: Array) -> str:
    """The least and the greatest of some values."""
    least, greatest = (f"{value:g}" for value in (values.min(), values.max()))
    return least if least == greatest else f"{least} to {greatest}"


def with_tables(text: str, tables: Mapping[str, str]) -> str:
    """A page with these tables between its markers ``<!-- NAME -->`` and ``<!-- end of NAME -->``.

    Raises:
        ValueError: the page lacks a marker.
    """
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise ValueError(f"{PAGE.name}: needs {begin} and {end} once each")
        before, rest = text.split(begin)
        text = f"{before}{begin}\n\n{table}\n\n{end}{rest.split(end)[1]}"
    return text


TABLES: Final[Mapping[str, Callable[[Mapping[str, Array]], str]]] = {
    "cells": table_of_cells,
    "failures": table_of_failures,
    "endings": table_of_endings,
    "scaling": phase_scaling.table,
}
"""Tables of the page by the names of their markers."""


def main(folders: Sequence[str]) -> None:
    """Reduce the folders, if there are any, into the committed file; then draw, print and write all that is in it."""
    if folders:
        walks = walks_by_cell(warpchain.load(folder) for folder in folders)
        write_csv([reduced(*cell, columns) for cell, columns in walks.items()], CSV)
    cells = read_csv(CSV)
    tables = {name: render(cells) for name, render in TABLES.items()}
    for name, table in tables.items():
        print(f"\n{name}\n{table}")
    write_whole(PAGE, with_tables(PAGE.read_text(encoding="utf-8"), tables))
    phase_figures.draw_maps(cells, FIGURES / "phase_diagram.png")
    phase_figures.draw_scaling(cells, FIGURES / "phase_scaling.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", nargs="*", metavar="FOLDER", help="parts of the sweep; none: the committed file")
    try:
        main(parser.parse_args().folders)
    except (InputError, OSError) as error:
        sys.exit(str(error))
