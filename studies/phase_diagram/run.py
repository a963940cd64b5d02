"""Makes the numbers, figures and tables of README.md from the files in results/, in one to two minutes.

Parts of the sweep `phase_diagram` that are given, or the sweep `scaling`, are reduced to these first. Parts have other
seeds; they may be unfinished, and their grids may differ.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import warpchain
from studies.common import Columns, publish, read_columns, run_study, show, table, write_rows
from studies.phase_diagram import candidates, cells, drawing, laws, scales, strands
from studies.phase_diagram.cells import FAILURES, WAYS
from studies.phase_diagram.endings import Ending

FOLDER = Path(__file__).parent


def table_of_cells(cells: Columns) -> str:
    """Markdown: mean Δx for about six links and frequencies, evenly spread, and the share that failed if any did."""
    shown_links, shown_frequencies = (
        known[np.unique(np.linspace(0, len(known) - 1, 6).round().astype(int))]
        for known in (np.unique(cells[name]) for name in ("links", "frequency"))
    )
    rows = []
    for number in shown_links:
        texts = []
        for frequency in shown_frequencies:
            here = (cells["links"] == number) & (cells["frequency"] == frequency)
            mean, rest, walks = (cells[name][here][0] for name in ("dx_mean", "at_rest", "walks"))
            text = "–" if np.isnan(mean) else f"{mean:#.3g}"
            texts.append(text if rest == walks else f"{text} ({100 * (1 - rest / walks):.3g} %)")
        rows.append([f"{number:g}", *texts])
    return table(("links", *(f"{frequency:g} Hz" for frequency in shown_frequencies)), rows)


def table_of_endings(cells: Columns) -> str:
    """Markdown: share of each ending among all walks at rest, and where it is the most frequent one."""
    counts = np.stack([cells[way.label] for way in WAYS], axis=1)
    most = np.where(counts.sum(axis=1) > 0, counts.argmax(axis=1), -1)
    flights, rows = cells["flight_told"].sum(), []
    for number, way in enumerate(WAYS):
        # without the time since the last impulse a collapse in flight counts as one of its bounce
        share = counts[:, number].sum() / (flights if way is Ending.IN_FLIGHT else counts.sum())
        rows.append([way.meaning, f"{100 * share:.2g} %", f"{np.sum(most == number)}"])
    text = f"{counts.sum():,.0f} walks of which this is known; a collapse in flight is known of {flights:,.0f} of them."
    return f"{table('way of ending | share | cells where it is the most frequent', rows)}\n\n{text}"


def table_of_failures(cells: Columns) -> str:
    """Markdown: walks by status."""
    rows = []
    for name in ("at_rest", *(code.label for code in FAILURES), "missing"):
        there = cells[name] > 0
        if there.any() or name == "at_rest":
            rows.append((f"`{name}`", f"{cells[name].sum():,.0f}", there.sum()))
    total = f"{cells['walks'].sum():,.0f} walks in {len(cells['links'])} cells."
    return f"{table('status | walks | cells', rows)}\n\n{total}"


def make(
    parts: Annotated[list[str] | None, typer.Argument()] = None,
    scaling: str | None = None,
) -> None:
    """Reduce the sweeps that are given into the committed files; then draw and write all that is in them."""
    if parts:
        results = [warpchain.load(path) for path in parts]
        walks = cells.walks_by_cell(results)
        write_rows(cells.CSV, (cells.reduced(*cell, columns) for cell, columns in walks.items()), *results)
        write_rows(strands.CSV, strands.reduced(results), *results)
    if scaling is not None:
        result = warpchain.load(scaling)
        write_rows(scales.CSV, scales.reduced(result), result)
    found, met, varied = read_columns(cells.CSV), read_columns(strands.CSV), scales.Cells()
    points = laws.points_of(found)
    ranges = candidates.ranges(found)
    tables = {
        "cells": table_of_cells(found),
        "scales": scales.table(varied, points),
        "candidates": candidates.table({name: ranges[name] for name in candidates.SHOWN}),
        "meetings": strands.meetings(met),
    }
    show({"failures": table_of_failures(found), "endings": table_of_endings(found), **candidates.details(ranges)})
    show({"strands": strands.shares(met), "endings with strands": strands.ways(met)})
    figures = {"maps": drawing.draw_maps(found), "laws": drawing.draw_laws(points)}
    publish(FOLDER, tables, figures | {"scales": scales.draw(varied, points)})


if __name__ == "__main__":
    run_study(make)
