"""When strands of the loop meet, from parts of the sweep ``phase_diagram``: results/strands.csv and its tables.

Walks of one cell are compared: those whose strands met by their second bounce, and the others, as they are and with
what is drawn held: Δx as a linear function of it, of sine and cosine of the phase, and of the early meeting.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from studies.common import DRAWN, Array, Columns, OverCells, drawn_terms, mean, minus, standard_error
from studies.common import table as markdown
from studies.phase_diagram import laws
from studies.phase_diagram.cells import walks_by_cell
from studies.phase_diagram.endings import Ending, endings
from warpchain import Status, SweepResult

CSV = Path(__file__).parent / "results" / "strands.csv"
EVENTS = {"crease": "self_contact", "strands": "strands_met", "collapse": "collapse"}  # Name → end of its column
BEGUN = ("0", "1", "2", "3", "later", "never")  # Bounces begun before an event
FEW = 10  # Walks that each of two groups has in a cell in which they are compared, at least
EARLY = 2  # Strands that met by this bounce met early
OTHERWISE = (1, 3)  # Bounces by which they might be said to have met early instead
WAYS = (Ending.IN_FLIGHT, Ending.FIRST, Ending.SECOND, Ending.LATER)
BEFORE = ("a bounce or more before", "in that bounce", "not before")  # When strands met, of loops that collapse
GROUPS = ((30, 50), (60, 90), (100, 140), (150, 180), (190, 240))  # Numbers of links that are shown together


def reduced(parts: Sequence[SweepResult]) -> Iterator[dict[str, float | str]]:
    """Rows of the file, a cell each."""
    names = [f"bounces_before_{name}" for name in EVENTS.values()]
    names += [name for name in next(iter(parts[0].blocks.values())).columns if name.endswith(DRAWN)]
    names += ["status", "dx", "collapsed_at", "strands_met_at", "flight_before_collapse"]
    for (links, frequency), walks in walks_by_cell(parts, names).items():
        rest = walks["status"] == Status.AT_REST
        at_rest = {name: values[rest] for name, values in walks.items()}
        met, collapse = at_rest["bounces_before_strands_met"], at_rest["bounces_before_collapse"]
        before = at_rest["strands_met_at"] <= at_rest["collapsed_at"]
        when = np.where(before & (met < collapse), 0, np.where(before, 1, 2))
        ways, dx, walked = endings(at_rest), at_rest["dx"], int((walks["status"] >= 0).sum())
        terms = drawn_terms(at_rest) if len(dx) else []
        row: dict[str, float | str] = {"links": links, "frequency": frequency, "walks": walked}
        row |= {"at_rest": int(rest.sum()), "dx": float(mean(dx)), "se": float(standard_error(dx))}
        row |= _early(dx, (met >= 0) & (met <= EARLY), terms)
        for bounce in OTHERWISE:
            found = _early(dx, (met >= 0) & (met <= bounce), terms)
            row |= {f"{name}_{bounce}": found[name] for name in ("held", "held_se")}
        for event, name in EVENTS.items():
            begun = at_rest[f"bounces_before_{name}"]
            counts = [np.sum(begun == number) for number in range(4)] + [np.sum(begun > 3), np.sum(begun < 0)]
            row |= {f"{event}_{key}": int(count) for key, count in zip(BEGUN, counts, strict=True)}
        yield row | {f"{way.label}_{k}": int(np.sum((ways == way) & (when == k))) for way in WAYS for k in range(3)}


def _early(dx: Array, early: Array, terms: Sequence[Array]) -> dict[str, float]:
    """Δx of walks with an early meeting over that of the others, less 1: as it is, and with draws held (HC3)."""
    found = {"early": int(early.sum()), "raw": np.nan, "held": np.nan, "held_se": np.nan}
    if min(early.sum(), (~early).sum()) < FEW:
        return found
    late = dx[~early].mean()
    design = np.stack([early, np.ones(len(dx)), *terms], axis=1)
    solve = np.linalg.pinv(design)
    weights, share = solve @ dx, np.einsum("wk,kw->w", design, solve)
    left = (dx - design @ weights) / (1 - share)
    held = {"held": float(weights[0] / late), "held_se": float(np.sqrt(np.sum((solve[0] * left) ** 2)) / late)}
    return found | {"raw": float(dx[early].mean() / late - 1)} | held


def _over_cells(values: Array, errors: Array, digits: int = 1) -> tuple[str, str, str, str]:
    """Mean over cells ± its standard error in per cent, χ² of none, of one difference, cells that rise, that fall."""
    over = OverCells(100 * values, 100 * np.where(errors > 0, errors, np.nan))
    if not len(over):
        return "", "", "", ""
    texts = over.text(digits), f"{over.chi2:.0f} of {len(over)}", f"{over.chi2_of_one:.0f} of {len(over) - 1}"
    return *texts, f"{over.rises}, {over.falls}"


def _groups(cells: Columns) -> Iterator[tuple[str, Array, Array]]:
    """Name of each group of links, its cells from 5 to 30 Hz, and its slower or faster ones."""
    inside = (cells["frequency"] >= 5) & (cells["frequency"] <= 30)
    for low, high in GROUPS:
        chosen = (cells["links"] >= low) & (cells["links"] <= high)
        yield f"{low} to {high}", chosen & inside, chosen & ~inside


def shares(cells: Columns) -> str:
    """Markdown: after how many bounces loops crease, strands meet and loops collapse, by links; early against late."""
    rows = []
    for which, frequencies in enumerate(("5 to 30 Hz", "slower or faster")):
        for links, *both in _groups(cells):
            chosen = both[which]
            for event in EVENTS:
                counts = np.array([cells[f"{event}_{key}"][chosen].sum() for key in BEGUN])
                texts = (f"{100 * count / max(counts.sum(), 1):.0f} %" for count in counts)
                compared = ("",) * 5
                if event == "strands" and np.isfinite(cells["raw"][chosen]).any():
                    raw = f"{100 * np.nanmean(cells['raw'][chosen]):+.1f} %"
                    compared = raw, *_over_cells(cells["held"][chosen], cells["held_se"][chosen])
                rows.append((frequencies, links, event, *texts, *compared))
    head = " | links |  | before | after 1 | after 2 | after 3 | later | never"
    head += " | early over late | what is drawn held | χ² of none | of one value | rise, fall"
    return minus(markdown(head, rows))


def meetings(cells: Columns) -> str:
    """Markdown, from 5 to 30 Hz: when strands meet; Δx of early walks against late ones, for three bounds of early."""
    rows = []
    for links, chosen, _ in _groups(cells):
        counts = np.array([cells[f"strands_{key}"][chosen].sum() for key in BEGUN])
        when = counts[:2].sum(), counts[2], counts[3:5].sum(), counts[5]
        texts = [f"{100 * count / counts.sum():.0f}" for count in when]
        for end in ("_1", "", "_3"):
            values = cells[f"held{end}"][chosen]
            mean, _, _, ends = _over_cells(values, cells[f"held_se{end}"][chosen])
            texts.append(f"{mean} ({np.isfinite(values).sum()}: {ends})")
        rows.append((links, *texts))
    head = "links | met in bounce 1 / % | 2 / % | later / % | never / %"
    head += " | Δx, if met by the first | by the second | by the third"
    return minus(markdown(head, rows))


def ways(cells: Columns) -> str:
    """Markdown: each way of ending by when strands met, of all walks, and where it is the most frequent."""
    counts = {(way, k): cells[f"{way.label}_{k}"] for way in WAYS for k in range(3)}
    total, most = sum(counts.values()), np.argmax(list(counts.values()), axis=0)
    papers = laws.in_papers_range(cells["links"], cells["frequency"])
    rows = []
    for number, ((way, k), count) in enumerate(counts.items()):
        if count.sum():
            parts = (f"{100 * count[where].sum() / total[where].sum():.2g} %" for where in (papers, ~papers))
            rows.append((way.meaning, BEFORE[k], *parts, f"{np.sum((most == number) & (total > 0))}"))
    head = "way of ending | strands met | share, paper's range | elsewhere | cells where it is the most frequent"
    return f"{markdown(head, rows)}\n\n{total.sum():,.0f} walks at rest of {cells['walks'].sum():,.0f}."
