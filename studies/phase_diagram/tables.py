"""Tables of the page, from the statistics of the cells."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from studies.common import table
from studies.phase_diagram import laws
from studies.phase_diagram.cells import FAILURES, WAYS
from studies.phase_diagram.endings import Ending

Array = NDArray[Any]

FEW: Final = 100
"""Walks that each of two groups has in a cell in which they are compared, at least."""


def table_of_cells(cells: Mapping[str, Array]) -> str:
    """Markdown: Δx ± s.d. for some links and frequencies."""
    shown_links, shown_frequencies = chosen(cells["links"]), chosen(cells["frequency"])
    rows = []
    for links in shown_links:
        texts = []
        for frequency in shown_frequencies:
            at = np.flatnonzero((cells["links"] == links) & (cells["frequency"] == frequency))
            texts.append(text_of_cell({name: column[at[0]] for name, column in cells.items()}) if len(at) else "")
        rows.append([f"{links:g}", *texts])
    return table(("links", *(f"{frequency:g} Hz" for frequency in shown_frequencies)), rows)


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


def over_others(cells: Mapping[str, Array], ways: Sequence[Ending]) -> Array:
    """Mean Δx of walks that ended in some ways over that of the others of their cell; NaN where either are few.

    Args:
        cells: Columns of the file.
        ways: How the walks ended.
    """
    numbers = {way: cells[way.label] for way in WAYS}
    distances = {way: number * np.nan_to_num(cells[f"dx_{way.label}"]) for way, number in numbers.items()}
    rest = [way for way in WAYS if way not in ways]
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
    rows = []
    inside = laws.in_papers_range(cells["links"], cells["frequency"])
    flights = int(cells["flight_told"].sum())
    for number, way in enumerate(WAYS):
        # without the time since the last impulse a collapse in flight counts as one of its bounce
        base = flights if way is Ending.IN_FLIGHT else counts.sum()
        share = counts[:, number].sum() / max(base, 1)
        ratios = over_others(cells, [way])
        texts = (text_of_ratios(ratios[where]) for where in (inside, ~inside))
        percent = "not recorded" if way is Ending.IN_FLIGHT and not flights else f"{100 * share:.2g} %"
        rows.append([way.meaning, percent, f"{np.sum(most == number)}", *texts])
    text = f"{counts.sum():,.0f} walks of which this is known; a collapse in flight is known of {flights:,} of them."
    head = ("way of ending", "share", "cells where it is the most frequent", "Δx, paper's range", "elsewhere")
    return "\n\n".join([table(head, rows), text])


def table_of_failures(cells: Mapping[str, Array]) -> str:
    """Markdown: walks by status."""
    walks = cells["walks"].sum()
    rows = []
    for name in ("at_rest", *(code.label for code in FAILURES), "missing"):
        number = cells[name]
        if number.sum() == 0 and name != "at_rest":
            continue
        there = number > 0
        where = "" if there.all() else f"{span(cells['links'][there])} links, {span(cells['frequency'][there])} Hz"
        rows.append((f"`{name}`", f"{number.sum():,.0f}", f"{there.sum()}", where))
    return f"{table(('status', 'walks', 'cells', 'where'), rows)}\n\n{walks:,.0f} walks in {len(cells['links'])} cells."


def span(values: Array) -> str:
    """The least and the greatest of some values."""
    least, greatest = (f"{value:g}" for value in (values.min(), values.max()))
    return least if least == greatest else f"{least} to {greatest}"


TABLES: Final[Mapping[str, Callable[[Mapping[str, Array]], str]]] = {
    "cells": table_of_cells,
    "failures": table_of_failures,
    "endings": table_of_endings,
}
"""Tables of the page by the names of their markers."""
