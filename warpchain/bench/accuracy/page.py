"""The page of ``warpchain bench accuracy``: figures, tables and machines in one HTML file that loads nothing."""

from collections.abc import Sequence
from fnmatch import fnmatch
from html import escape
from pathlib import Path
from typing import Any, Final

from warpchain.bench.accuracy.figures import figures
from warpchain.files import write_whole
from warpchain.pictures.style import Picture
from warpchain.reports.html_page import page, pages_of, picture, table

PAGE: Final = "accuracy.html"
_WRITER: Final = "warpchain bench accuracy"
PAGES: Final = pages_of(_WRITER)
"""All that the page replaces."""

Row = dict[str, Any]


def write_pictures_and_page(folder: Path, document: dict[str, Any]) -> list[Path]:
    """Write every figure and the page; an older page and older figures are replaced.

    Returns:
        Paths of the files, the page last.

    Raises:
        OSError: A file cannot be written.
    """
    pictures = list(figures(document))
    paths = [drawn.save(folder) for drawn in pictures]
    write_whole(folder / PAGE, _page(document, pictures), PAGES)
    return [*paths, folder / PAGE]


def _page(document: dict[str, Any], pictures: Sequence[Picture]) -> str:
    """The whole page; a part that has not been run has no section."""
    walks = [*document["walks"], *(one for row in document["ensembles"] for one in row["methods"])]
    methods = {row["method"] for row in (*document["points"], *document["reversals"], *document["hard_cases"], *walks)}
    bad = sum(not row["sound"] for row in document["hard_cases"])
    tiles = {
        "methods": (len({name for name in methods if "SciPy" not in name}), ""),
        "measured points": (len(document["points"]), ""),
        "walks": (sum(one["at_rest"] for one in walks), ""),
        "hard cases": (len(document["hard_cases"]), ""),
        "not sound": (bad, "bad" if bad else ""),
    }
    sections = {
        "Work and precision": _work_precision(document, pictures) if document["points"] else "",
        "Reversing joints": _reversals(document["reversals"], pictures) if document["reversals"] else "",
        "Whole walks": _walks(document["walks"], pictures) if document["walks"] else "",
        "Ensembles": _ensembles(document["ensembles"], pictures) if document["ensembles"] else "",
        "Hard cases": _hard_cases(document["hard_cases"], pictures) if document["hard_cases"] else "",
        "Machines": _machines(document["machines"]),
    }
    return page(_WRITER, "Speed against error", tiles, {title: text for title, text in sections.items() if text})


def _work_precision(document: dict[str, Any], pictures: Sequence[Picture]) -> str:
    """Notes, diagrams and a table of all points."""
    points = _together(document["points"], "problem", "links", "method")
    head = ["problem", "n", "method", "tolerance", "position / m", "velocity / (m/s)", "momentum", "bias"]
    head += ["s / s", "speed", "evaluations / s", "rejected", "status"]
    rows = [
        [
            *(row["problem"], f"{row['links']}", row["method"], f"{row['tolerance']:g}"),
            *(_number(row[name], ".1e") for name in ("position_error", "velocity_error", "momentum_error")),
            _number(row["momentum_bias"], "+.1e"),
            _number(_per_second(row, "seconds"), ".3g"),
            _number(_speed(row, points), ".3g"),
            _number(_per_second(row, "evaluations"), ".2e"),
            "–" if row["rejected"] is None else f"{row['rejected'] / (row['accepted'] + row['rejected']):.0%}",
            row["status"],
        ]
        for row in points
    ]
    text = (
        "<h3>All points</h3><p>Errors as in the figures; momentum: relative error of the floor's impulse (rms) or of "
        "the angular momentum about the sprocket, bias: its mean with sign. Processor time and evaluations are per "
        "simulated second; speed: how many times faster than rkf78 at 1e-6.</p>"
    )
    notes = [f"<p>{escape(note)}</p>" for note in document["notes"].values()]
    drawn = _drawn(pictures, "work_precision_*")
    marked = [row["status"] != "finished" for row in points]
    return "\n".join([*notes, *drawn, text, table(head, rows, numbers_from=3, marked=marked)])


def _reversals(found: Sequence[Row], pictures: Sequence[Picture]) -> str:
    """The figure and a table of all rows."""
    ordered = _together(found, "start", "friction_smoothing", "method")
    text = (
        "<p>Flights of 1 ms at Table 1's values but for ω_c, from 8 starts each. Error: greatest of a link's angular "
        "velocity, median over the starts and greatest. Error of a step: greatest true error of an accepted step in "
        "the first 0.1 ms of one start, in tolerances; it is about 1 if the method's estimate sees all. What is below "
        "the distance of two references from each other is not certain.</p>"
    )
    head = ["start", "ω_c / (rad/s)", "method", "tolerance", "attempts"]
    head += ["error / (rad/s)", "greatest / (rad/s)", "references / (rad/s)", "error of a step / tolerance"]
    rows = [
        [
            *(row["start"], f"{row['friction_smoothing']:g}", row["method"], f"{row['tolerance']:g}"),
            f"{row['attempts']:,.0f}",
            *(_number(row[name], ".1e") for name in ("error", "greatest_error", "trust")),
            _number(row["step_error"], ".2g"),
        ]
        for row in ordered
    ]
    return "\n".join([*_drawn(pictures, "reversals"), text, table(head, rows, numbers_from=3)])


def _walks(walks: Sequence[Row], pictures: Sequence[Picture]) -> str:
    """Figures and a table of the walks that were timed."""
    text = (
        "<p>Table 1's values, chains that start as an ellipse, the same drawn samples for every method and the methods "
        "in turn. Medians over the walks that came to rest: processor time of one core from the release to rest, "
        "time per simulated second, and what the energy ledger leaves open, as a fraction of the energy at release "
        "(and the greatest of that). Speed is how many times cheaper than rkf78 at 1e-6 in the same run.</p>"
    )
    ordered = _together(walks, "links")
    head = ["n", "method", "walks", "at rest", "s", "s / s", "speed", "attempts", "ledger", "greatest"]
    rows = [
        [
            *(f"{row['links']}", row["title"], f"{row['walks']}", f"{row['at_rest']}"),
            _number(row["seconds"], ".3g"),
            _number(_ratio(row["seconds"], row["walk_time"]), ".3g"),
            _number(_ratio(row["reference_seconds"], row["seconds"]), ".3g"),
            _number(row["attempts"], ",.0f"),
            *(_number(row[name], ".1e") for name in ("ledger", "greatest_ledger")),
        ]
        for row in ordered
    ]
    marked = [row["at_rest"] < row["walks"] for row in ordered]
    return "\n".join([text, *_drawn(pictures, "walks_*"), table(head, rows, numbers_from=2, marked=marked)])


def _ensembles(ensembles: Sequence[Row], pictures: Sequence[Picture]) -> str:
    """A figure and a table of each ensemble."""
    parts = [
        "<p>All methods walk from the same drawn samples; the tests treat their ensembles as independent. Intervals "
        "are 95 % bootstrap intervals, p is the exact two-sample Kolmogorov–Smirnov probability, Δ the difference of "
        "the means relative to the reference, in brackets in units of its standard error. A method passes when its "
        "mean is within 1 % of that of rkf78 at 1e-6 or in its interval, and no more walks failed. Ledger: what the "
        "energy ledger of a walk leaves open, of the energy at release, median. Cost is processor "
        "time of one core, time on the sprocket included; on a GPU walks per second. Speed is how many times cheaper "
        "than rkf78 at 1e-6 that is.</p>"
    ]
    with_tight = any(one["p_tight"] is not None for row in ensembles for one in row["methods"])
    suffixes = ("loose", "tight") if with_tight else ("loose",)
    head = ["method", "at rest", "failed", "mean Δx / m", "s.d. / m"]
    head += ["Δ to 1e-6", "p to 1e-6", *(["Δ to 1e-9", "p to 1e-9"] if with_tight else [])]
    head += ["ledger", "cost", "speed", "passes"]
    for row in ensembles:
        true = row["methods"][0]
        rows = [
            [
                *(one["title"], f"{one['at_rest']}"),
                ", ".join(f"{count} {label}" for label, count in one["failed"].items()) or "0",
                _with_interval(one["mean"], one["mean_interval"]),
                _number(one["sd"], ".4f"),
                *(text for suffix in suffixes for text in _agreement(one, suffix)),
                _number(one["ledger"], ".1e"),
                f"{one['seconds_per_walk']:.3g} s"
                if one["seconds_per_walk"] is not None
                else f"{_number(one['walks_per_second'], '.3g')} 1/s",
                _number(
                    _ratio(true["seconds_per_walk"], one["seconds_per_walk"])
                    or _ratio(one["walks_per_second"], true["walks_per_second"]),
                    ".3g",
                ),
                "yes" if one["passes"] else "no",
            ]
            for one in row["methods"]
        ]
        marked = [not one["passes"] for one in row["methods"]]
        parts += [f"<h3>{escape(row['title'])}, {escape(row['device'])}</h3>"]
        parts += _drawn(pictures, f"ensemble_{row['name']}")
        parts += [table(head, rows, numbers_from=1, marked=marked)]
    return "\n".join(parts)


def _hard_cases(cases: Sequence[Row], pictures: Sequence[Picture]) -> str:
    """The figure and a table of all cases."""
    ordered = _together(cases, "case")
    head = ["kind", "case", "method", "status", "result", "s", "simulated s", "attempts", "energy error", "sound"]
    rows = [
        [
            *(row["group"], row["what"], row["method"], row["status"], row["result"]),
            *(f"{row['seconds']:.3g}", f"{row['simulated']:.3g}", f"{row['attempts']:,}"),
            *(_number(row["energy_error"], ".1e"), "yes" if row["sound"] else "no"),
        ]
        for row in ordered
    ]
    marked = [not row["sound"] for row in ordered]
    return "\n".join([*_drawn(pictures, "hard_cases"), table(head, rows, numbers_from=5, marked=marked)])


def _machines(machines: Sequence[dict[str, str]]) -> str:
    """What is known of each machine."""
    names = list(dict.fromkeys(name for machine in machines for name in machine))
    rows = [[name, *(machine.get(name, "–") for machine in machines)] for name in names]
    return table(["", *(f"machine {number}" for number in range(len(machines)))], rows, numbers_from=len(machines) + 1)


def _drawn(pictures: Sequence[Picture], pattern: str) -> list[str]:
    """Pictures with such names."""
    return [picture(drawn.figure, drawn.caption) for drawn in pictures if fnmatch(drawn.name, pattern)]


def _together(rows: Sequence[Row], *keys: str) -> list[Row]:
    """Rows with those that agree in some columns side by side, in the order in which each value first came."""
    first = {key: list(dict.fromkeys(row[key] for row in rows)) for key in keys}
    return sorted(rows, key=lambda row: [first[key].index(row[key]) for key in keys])


def _per_second(row: Row, cost: str) -> float | None:
    """Cost of a point per simulated second; None if it has not come to its end, or does not count this."""
    return row[cost] / row["simulated"] if row["status"] == "finished" and row[cost] is not None else None


def _speed(row: Row, points: Sequence[Row]) -> float | None:
    """How many times faster a point is than rkf78 at 1e-6 in the same problem; None if that was not measured."""
    reference = {"problem": row["problem"], "links": row["links"], "method": "rkf78", "tolerance": 1e-6}
    for point in points:
        if reference.items() <= point.items():
            return _ratio(_per_second(point, "seconds"), _per_second(row, "seconds"))
    return None


def _ratio(value: float | None, by: float | None) -> float | None:
    """Of two numbers; None if one is missing."""
    return value / by if value is not None and by else None


def _with_interval(value: float | None, interval: Sequence[float | None]) -> str:
    """A number with an interval in brackets if that is known."""
    ends = "" if None in interval else f" ({interval[0]:.4f} … {interval[1]:.4f})"
    return _number(value, ".4f") + ends


def _agreement(row: Row, suffix: str) -> tuple[str, str]:
    """Difference of the means with its standard errors, and the probability of the test."""
    difference, errors = row[f"difference_{suffix}"], row[f"errors_{suffix}"]
    text = _number(difference, "+.2%") + ("" if errors is None else f" ({errors:+.1f})")
    return text, _number(row[f"p_{suffix}"], ".2g")


def _number(value: float | None, form: str) -> str:
    """A number in a form, a dash for none."""
    return "–" if value is None else f"{value:{form}}"
