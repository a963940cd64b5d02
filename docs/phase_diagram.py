"""Reduces the sweep ``phase_diagram`` to statistics of its cells, draws them, and writes the tables of its page.

    python docs/phase_diagram.py PART…               # parts of the sweep → docs/results/phase_diagram.csv; then:
    python docs/phase_diagram.py                     # that file → figures, tables of docs/phase-diagram.md, numbers
    python docs/phase_diagram.py --keep FILE FOLDER  # columns of a part → FILE.npz, which is a part, too

Parts have other seeds; they may be unfinished, and their grids may differ. A part is a folder of ``warpchain sweep``,
or such an .npz file of its columns, 8 MB for 100,000 walks, which is quickly fetched from a far machine. The second
command repeats every number and figure of the page. It needs warpchain[scipy] and takes 10 to 25 s.
"""

import argparse
import csv
import json
import sys
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import phase_figures
import phase_scaling
from numpy.typing import NDArray
from page_tables import with_tables

import warpchain
from warpchain.files import replacing, write_whole
from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.endings import Ending, endings
from warpchain.walks.energy_error import MOST_ENERGY_ERROR
from warpchain.walks.rows import COLUMNS, MISSING

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
NEEDED: Final = ("status", "dx")
"""Columns that every part has."""
WANTED: Final = (
    *("steps_accepted", "steps_rejected", "energy_error", "flight_before_collapse"),
    *("bounces_before_collapse", "bounces_before_self_contact", *AVERAGED.values()),
)
"""Columns that are read if a part has them; else they count as unknown: NaN, or −1 in columns of integers."""

TOLD: Final = "is_told"
"""Further column of a part: whether the ending of the walk is known."""


@dataclass(frozen=True)
class Part:
    """Walks over links and frequencies.

    Attributes:
        name: for messages.
        settings: what all parts must share, see `settings_of`; None if that is not known.
        links: values of the first axis.
        frequency: values of the second one [Hz].
        columns: `NEEDED`, `WANTED` and `TOLD`, shape (links, frequencies, samples).
    """

    name: str
    settings: str | None
    links: Array
    frequency: Array
    columns: dict[str, Array]


def read_part(path: str) -> list[Part]:
    """The part in a folder or an .npz file, one for each block.

    Raises:
        InputError: it has other axes than links and frequency, lacks a needed column, or is damaged.
        OSError: it cannot be read.
    """
    if Path(path).suffix != ".npz":
        result = warpchain.load(path)
        return [part_of(path, settings_of(result), block.axes, block.columns) for block in result.blocks.values()]
    try:
        with np.load(path, allow_pickle=False) as file:
            content = {name: file[name] for name in file.files}
    except (ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: damaged, or no part ({error}); write it again with --keep") from None
    settings = str(content.pop("settings")) if "settings" in content else None
    axes = {name: content.pop(name) for name in ("links", "frequency") if name in content}
    return [part_of(path, settings, axes, content)]


def part_of(name: str, settings: str | None, axes: Mapping[str, Array], columns: Mapping[str, Array]) -> Part:
    """A part whose columns have the axes in any order, the samples last; see `read_part` for errors."""
    if set(axes) != {"links", "frequency"}:
        raise InputError(f"{name}: axes are {', '.join(axes) or 'missing'}; give a sweep of links and frequency")
    if lacking := [column for column in NEEDED if column not in columns]:
        raise InputError(f"{name}: no column {lacking[0]}; give a folder of a sweep, or what --keep has written of one")
    order = [list(axes).index(axis) for axis in ("links", "frequency")] + [2]
    shape = columns["dx"].transpose(order).shape
    taken = {
        column: columns[column].transpose(order)
        if column in columns
        else np.full(shape, np.nan if COLUMNS[column].kind == "<f8" else MISSING)
        for column in (*NEEDED, *WANTED)
    }
    # without these columns it would seem that every loop was kept
    taken[TOLD] = np.full(shape, {"bounces_before_collapse", "bounces_before_self_contact"} <= columns.keys())
    return Part(name, settings, axes["links"], axes["frequency"], taken)


def keep(directory: str, path: Path) -> None:
    """Write the columns of a folder as a part of its own.

    Raises:
        InputError: the folder has several blocks, or see `read_part`.
        OSError: it cannot be read, or the file not be written.
    """
    parts = read_part(directory)
    if len(parts) > 1:
        raise InputError(f"{directory}: {len(parts)} blocks; a file has the columns of one")
    (part,) = parts
    small = {
        name: values.astype(np.int32 if values.dtype.kind == "i" else np.float32)
        for name, values in part.columns.items()
        if name != TOLD
    }
    with replacing(path) as target, target.open("wb") as file:
        settings = {} if part.settings is None else {"settings": part.settings}
        np.savez_compressed(file, links=part.links, frequency=part.frequency, **settings, **small)


def walks_by_cell(parts: Iterable[Part]) -> dict[Cell, dict[str, Array]]:
    """The walks of all parts by cell: columns of `Part`, shape (walks,), missing walks included.

    Raises:
        InputError: a part has other settings than the first that has any, or the same walks as another one.
    """
    found: dict[Cell, list[dict[str, Array]]] = {}
    settings: str | None = None
    for part in parts:
        settings = part.settings if settings is None else settings
        if part.settings not in (None, settings):
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
        walks: columns of `Part`, shape (walks,).
    """
    status = walks["status"]
    rest = status == Status.AT_REST
    dx, codes = walks["dx"][rest].astype(float), np.where(walks[TOLD], endings(walks), Ending.UNKNOWN)[rest]
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
        **{f"{name}_mean": _mean(_known(walks[column])[rest]) for name, column in AVERAGED.items()},
        "bounces_sd": _sd(_known(walks["bounces"])[rest]),
        "attempts_mean": _mean(attempts),
        **{way.label: int((codes == way).sum()) for way in WAYS},
        **{f"dx_{way.label}": _mean(dx[codes == way]) for way in WAYS},
    }
    return row


def _known(values: Array) -> Array:
    """As floats, NaN where a number is missing or a part lacks the column."""
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
    """Write the rows, whole or not at all; numbers that are not whole have six digits."""
    names = list(rows[0])
    lines = [",".join(names)]
    for row in rows:
        values = (row[name] for name in names)
        lines.append(",".join(f"{value:.6g}" if isinstance(value, float) else str(value) for value in values))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, "\n".join(lines) + "\n")


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a file, as texts by column."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def read_csv(path: Path) -> dict[str, Array]:
    """The columns of the file, shape (cells,) each."""
    rows = read_rows(path)
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


FEW: Final = 100
"""Walks that each of two groups has in a cell in which they are compared, at least."""


def over_others(cells: Mapping[str, Array], ways: Sequence[Ending], others: Sequence[Ending] | None = None) -> Array:
    """Mean Δx of walks that ended in some ways over that of the others of their cell; NaN where either are few.

    Args:
        cells: Columns of the file.
        ways: How the walks ended.
        others: How those ended that they are compared with; None: in any other way.
    """
    numbers = {way: cells[way.label] for way in WAYS}
    distances = {way: number * np.nan_to_num(cells[f"dx_{way.label}"]) for way, number in numbers.items()}
    rest = [way for way in WAYS if way not in ways] if others is None else others
    (walks, dx), (walks_of_rest, dx_of_rest) = (
        (sum(numbers[way] for way in group), sum(distances[way] for way in group)) for group in (ways, rest)
    )
    compared = (walks >= FEW) & (walks_of_rest >= FEW)
    ratio = np.full(len(compared), np.nan)
    np.divide(dx * walks_of_rest, dx_of_rest * walks, out=ratio, where=compared)
    return ratio


def text_of_ratios(ratios: Array) -> str:
    """Their mean over cells, and the least and the greatest."""
    known = ratios[np.isfinite(ratios)]
    if not len(known):
        return ""
    if len(known) == 1:
        return f"{known[0]:.3f} (one cell)"
    return f"{known.mean():.3f} ({known.min():.2f} to {known.max():.2f}, {len(known)} cells)"


def table_of_endings(cells: Mapping[str, Array]) -> str:
    """Markdown: share of each ending among all walks at rest, where it is the most frequent one, how far they went."""
    counts = np.stack([cells[way.label] for way in WAYS], axis=1)
    most = np.where(counts.sum(axis=1) > 0, counts.argmax(axis=1), -1)
    lines = [
        "| way of ending | share | cells where it is the most frequent | Δx, paper's range | elsewhere |",
        "|---|---|---|---|---|",
    ]
    inside = phase_scaling.in_papers_range(cells["links"], cells["frequency"])
    flights = int(cells["flight_told"].sum())
    for number, way in enumerate(WAYS):
        # without the time since the last impulse a collapse in flight counts as one of its bounce
        base = flights if way is Ending.IN_FLIGHT else counts.sum()
        share = counts[:, number].sum() / max(base, 1)
        ratios = over_others(cells, [way])
        texts = " | ".join(text_of_ratios(ratios[where]) for where in (inside, ~inside))
        percent = "not recorded" if way is Ending.IN_FLIGHT and not flights else f"{100 * share:.2g} %"
        lines.append(f"| {way.meaning} | {percent} | {np.sum(most == number)} | {texts} |")
    text = f"{counts.sum():,.0f} walks of which this is known; a collapse in flight is known of {flights:,} of them."
    early = over_others(cells, [Ending.FOLDED_AT_FIRST, Ending.FOLDED_AT_SECOND], [Ending.FOLDED_LATER])
    touched = (
        "Walks that touched themselves by their second bounce, over those that first did so in a later one: "
        f"{text_of_ratios(early[inside]) or 'too few'} in the paper's range, "
        f"{text_of_ratios(early[~inside]) or 'too few'} elsewhere."
    )
    return "\n".join([*lines, "", text, "", touched])


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


TABLES: Final[Mapping[str, Callable[[Mapping[str, Array]], str]]] = {
    "cells": table_of_cells,
    "failures": table_of_failures,
    "endings": table_of_endings,
    "scaling": phase_scaling.table,
}
"""Tables of the page by the names of their markers."""


def main(parts: Sequence[str]) -> None:
    """Reduce the parts, if there are any, into the committed file; then draw, print and write all that is in it."""
    if parts:
        walks = walks_by_cell(part for path in parts for part in read_part(path))
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
    parser.add_argument("parts", nargs="*", metavar="PART", help="folders or .npz files; none: the committed file")
    parser.add_argument("--keep", metavar="FILE", type=Path, help="write the columns of one folder to this .npz file")
    arguments = parser.parse_args()
    try:
        if arguments.keep is None:
            main(arguments.parts)
        elif len(arguments.parts) == 1:
            keep(arguments.parts[0], arguments.keep)
        else:
            parser.error("--keep: give one folder")
    except (InputError, OSError) as error:
        sys.exit(str(error))
