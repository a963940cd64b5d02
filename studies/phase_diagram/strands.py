"""When strands of the loop meet, from parts of the sweep ``strands``: results/strands.csv and its tables.

Walks of one cell are compared: those whose strands met by their second bounce, and the others.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from studies.common import table as markdown
from studies.phase_diagram import laws
from studies.phase_diagram.cells import walks_by_cell
from studies.phase_diagram.endings import Ending, endings
from warpchain import Status, SweepResult

Array = NDArray[Any]
Cells = Mapping[str, Array]

CSV: Final = Path(__file__).parent / "results" / "strands.csv"
EVENTS: Final = {"crease": "self_contact", "strands": "strands_met", "collapse": "collapse"}
"""What happens to a loop: name → end of the name of its column."""
BEGUN: Final = ("0", "1", "2", "3", "later", "never")
"""Bounces begun before an event."""
EARLY: Final = 2
"""Strands that met by this bounce met early."""
WAYS: Final = (Ending.IN_FLIGHT, Ending.FIRST, Ending.SECOND, Ending.LATER)
BEFORE: Final = ("a bounce or more before", "in that bounce", "not before")
"""When strands met, of loops that collapse."""
GROUPS: Final = ((30, 50), (60, 90), (100, 140), (150, 180), (190, 240))
"""Numbers of links that are shown together."""


def reduced(parts: Sequence[SweepResult]) -> Iterator[dict[str, float | str]]:
    """Rows of the file, a cell each."""
    names = [f"bounces_before_{name}" for name in EVENTS.values()]
    names += ["status", "dx", "collapsed_at", "strands_met_at", "flight_before_collapse"]
    for (links, frequency), walks in walks_by_cell(parts, names).items():
        rest = walks["status"] == Status.AT_REST
        at_rest = {name: values[rest] for name, values in walks.items()}
        met, collapse = at_rest["bounces_before_strands_met"], at_rest["bounces_before_collapse"]
        before = at_rest["strands_met_at"] <= at_rest["collapsed_at"]
        when = np.where(before & (met < collapse), 0, np.where(before, 1, 2))
        ways, early, dx = endings(at_rest), (met >= 0) & (met <= EARLY), at_rest["dx"]
        row: dict[str, float | str] = {
            "links": links,
            "frequency": frequency,
            "walks": int((walks["status"] >= 0).sum()),
        }
        row |= {
            "at_rest": int(rest.sum()),
            **_moments("", dx),
            **_moments("_early", dx[early]),
            **_moments("_late", dx[~early]),
        }
        for event, name in EVENTS.items():
            begun = at_rest[f"bounces_before_{name}"]
            counts = [np.sum(begun == number) for number in range(4)] + [np.sum(begun > 3), np.sum(begun < 0)]
            row |= {f"{event}_{key}": int(count) for key, count in zip(BEGUN, counts, strict=True)}
        row |= {f"{way.label}_{k}": int(np.sum((ways == way) & (when == k))) for way in WAYS for k in range(3)}
        yield row


def _moments(name: str, dx: Array) -> dict[str, float | str]:
    """Number, mean and standard error."""
    return {
        f"n{name}": len(dx),
        f"dx{name}": float(dx.mean()) if len(dx) else np.nan,
        f"se{name}": float(dx.std(ddof=1) / np.sqrt(len(dx))) if len(dx) > 1 else np.nan,
    }


def early_over_late(cells: Cells) -> tuple[Array, Array]:
    """Δx of walks whose strands met early over that of the others, less 1, and its standard error; NaN of few."""
    known = np.minimum(cells["n_early"], cells["n_late"]) >= 10
    early, late = (np.where(known, cells[name], np.nan) for name in ("dx_early", "dx_late"))
    errors = np.hypot(cells["se_early"] / early, cells["se_late"] / late)
    return early / late - 1, errors * early / late


def _weighted(values: Array, errors: Array) -> tuple[str, str, str]:
    """Weighted mean ± its standard error in per cent, χ² of no difference, how many rise and fall significantly."""
    known = np.isfinite(values) & (errors > 0)
    values, weight = values[known], errors[known] ** -2.0
    if not len(values):
        return "", "", ""
    mean, error = 100 * np.sum(weight * values) / weight.sum(), 100 * weight.sum() ** -0.5
    significant = values * np.sqrt(weight)
    chi2 = f"{np.sum(significant**2):.0f} of {len(values)}"
    return f"{mean:+.1f} ± {error:.1f} %", chi2, f"{np.sum(significant > 1.96)}, {np.sum(significant < -1.96)}"


def shares(cells: Cells) -> str:
    """Markdown: after how many bounces loops crease, strands meet and loops collapse, by links; early against late."""
    inside = (cells["frequency"] >= 5) & (cells["frequency"] <= 30)
    ratio, error = early_over_late(cells)
    rows = []
    for name, frequencies in (("5 to 30 Hz", inside), ("slower or faster", ~inside)):
        for low, high in GROUPS:
            chosen = frequencies & (cells["links"] >= low) & (cells["links"] <= high)
            for event in EVENTS:
                counts = np.array([cells[f"{event}_{key}"][chosen].sum() for key in BEGUN])
                texts = (f"{100 * count / max(counts.sum(), 1):.0f} %" for count in counts)
                compared = _weighted(ratio[chosen], error[chosen]) if event == "strands" else ("", "", "")
                rows.append((name, f"{low} to {high}", event, *texts, *compared))
    head = ("", "links", "", "before", "after 1", "after 2", "after 3", "later", "never")
    return markdown((*head, "early over late", "χ²", "rise, fall"), rows).replace("-", "−").replace("−−−", "---")


def ways(cells: Cells) -> str:
    """Markdown: each way of ending by when strands met, of all walks, and where it is the most frequent."""
    counts = {(way, k): cells[f"{way.label}_{k}"] for way in WAYS for k in range(3)}
    total, most = sum(counts.values()), np.argmax(list(counts.values()), axis=0)
    papers = laws.in_papers_range(cells["links"], cells["frequency"])
    rows = []
    for number, ((way, k), count) in enumerate(counts.items()):
        if count.sum():
            parts = (f"{100 * count[where].sum() / total[where].sum():.2g} %" for where in (papers, ~papers))
            rows.append((way.meaning, BEFORE[k], *parts, f"{np.sum((most == number) & (total > 0))}"))
    head = ("way of ending", "strands met", "share, paper's range", "elsewhere", "cells where it is the most frequent")
    return f"{markdown(head, rows)}\n\n{total.sum():,.0f} walks at rest of {cells['walks'].sum():,.0f}."


def against_million(cells: Cells, million: Cells) -> str:
    """Whether these walks, of today's engine, go as far as those of the million, in words."""
    places = {key: i for i, key in enumerate(zip(million["links"], million["frequency"], strict=True))}
    at = np.array([places[key] for key in zip(cells["links"], cells["frequency"], strict=True)])
    failed = 1 - million["at_rest"][at] / million["walks"][at]
    used = (cells["n"] > 10) & (failed <= laws.MOST_FAILED)
    ratio = cells["dx"] / million["dx_mean"][at] - 1
    error = np.hypot(cells["se"] / cells["dx"], million["dx_se"][at] / million["dx_mean"][at])
    texts = []
    for name, chosen in (
        ("all", used),
        ("the paper's range", used & laws.in_papers_range(cells["links"], cells["frequency"])),
    ):
        mean, chi2, ends = _weighted(ratio[chosen], error[chosen])
        texts.append(f"in {name} {mean} (χ² {chi2} cells; rise, fall: {ends})")
    return f"Mean Δx of these walks over that of the million, less 1, weighted by errors: {'; '.join(texts)}.".replace(
        "-", "−"
    )


def tables(cells: Cells, million: Cells) -> dict[str, str]:
    """The tables of the page by their markers."""
    return {
        "strands": shares(cells),
        "ways with strands": ways(cells),
        "against the million": against_million(cells, million),
    }
