"""The page README.md, rendered from the numbers of `studies.paper.reduction`."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from studies.common import table
from studies.paper import further_tables as tables
from studies.paper.claims import CLAIMS
from studies.paper.figure5 import figure5_table
from studies.paper.findings import changes, percent
from studies.paper.separations import separations_tables
from studies.paper.statistics import Effect, summary
from studies.paper.verdicts import Bounds, Verdict, scaled
from warpchain import Parameters

Numbers = Mapping[str, Any]

TEMPLATE: Final = Path(__file__).with_name("page.txt")
"""The text of the page, with names of its automatic parts in braces: {{claims}}."""

SYMBOLS: Final = {"phase": "phase of the release", "clearance": "height of the release / m"}
"""Quantities that are none of Table 1."""


def page(numbers: Numbers) -> str:
    """The page.

    Raises:
        KeyError: the template names a part that there is not.
        ValueError: the template leaves out a part.
    """
    parts = {
        "claims": claims_table(numbers),
        "count": str(len(CLAIMS)),
        "verdicts": verdict_counts(numbers),
        "reasons": reasons(numbers),
        "distances": distances_table(numbers),
        "ellipses": ellipses_text(numbers),
        "contacts": tables.strands_table(numbers),
        "through": tables.through_table(numbers),
        "open": tables.open_table(numbers),
        "rest": tables.rest_table(numbers),
        "loops": tables.loops_table(numbers),
        "same": tables.same_text(numbers),
        "nonlinear": tables.nonlinear_table(numbers),
        "lengths": tables.lengths_table(numbers),
        "sliding": tables.sliding_table(numbers),
        "distributions": tables.distributions_table(numbers),
        "undamped": tables.undamped_text(numbers),
        "thresholds": thresholds_table(numbers),
        "figure5": figure5_table(),
        "separations": separations_tables(),
        "impacts": impacts_table(numbers),
        "effects": effects_table(numbers),
        "friction": friction_table(numbers),
        "walks": walks_text(numbers),
    }
    template = TEMPLATE.read_text(encoding="utf-8")
    names = re.findall(r"\{\{(\w+)\}\}", template)
    if unused := parts.keys() - set(names):
        raise ValueError(f"{TEMPLATE.name} leaves out {', '.join(sorted(unused))}")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], template)


def claims_table(numbers: Numbers) -> str:
    """All claims with what came out."""
    rows = []
    for number, claim in enumerate(CLAIMS, 1):
        finding = claim.check(numbers)
        mark = " †" if finding.is_typed else ""
        rows.append([str(number), claim.sentence, f"{finding.text}{mark}", claim.source, f"*{finding.verdict}*"])
    return table(["", "the paper", "here", "from", "verdict"], rows)


def thresholds_table(numbers: Numbers) -> str:
    """Which verdicts change if one bound of the rules is halved or doubled."""
    usual = [claim.check(numbers).verdict for claim in CLAIMS]
    rows = []
    for field in fields(Bounds):
        row = [field.name, f"{getattr(Bounds(), field.name):g}"]
        for factor in (0.5, 2.0):
            with scaled(field.name, factor):
                found = [claim.check(numbers).verdict for claim in CLAIMS]
            changed = [
                f"{number}: *{before}* → *{after}*"
                for number, (before, after) in enumerate(zip(usual, found, strict=True), 1)
                if before != after
            ]
            row.append("; ".join(changed) or "none")
        rows.append(row)
    return table(["bound", "value", "halved", "doubled"], rows)


def verdict_counts(numbers: Numbers) -> str:
    """How many claims have which verdict."""
    counts = Counter(claim.check(numbers).verdict for claim in CLAIMS)
    return ", ".join(f"{counts[verdict]} × *{verdict}*" for verdict in Verdict if counts[verdict])


def reasons(numbers: Numbers) -> str:
    """The reasons of all claims that have one, numbered as in the table."""
    lines = []
    for number, claim in enumerate(CLAIMS, 1):
        verdict = claim.check(numbers).verdict
        if reason := claim.reason(verdict):
            lines.append(f"- {number} *{verdict}*: {reason}")
    return "\n".join(lines)


def distances_table(numbers: Numbers) -> str:
    """Mean Δx ± standard deviation of a walk, by start, links and frequency."""
    content = numbers["paper_claims"]
    cells, starts = content["cells"], content["starts"]
    head = ["links", "start", *(f"{frequency:g} Hz" for frequency in cells["frequency"])]
    rows = []
    for place, links in enumerate(cells["links"]):
        for start in ("rest", "ellipse"):
            pairs = zip(starts[start]["mean"][place], starts[start]["sd"][place], strict=True)
            rows.append([str(links), start, *(f"{_number(mean, 3)} ± {_number(sd, 3)}" for mean, sd in pairs)])
    return table(head, rows)


def ellipses_text(numbers: Numbers) -> str:
    """Greatest relative difference of ellipses of 90 links or more from their mean over the links, from 10 Hz on."""
    content = numbers["paper_claims"]
    links, frequencies = (np.array(content["cells"][name]) for name in ("links", "frequency"))
    means = np.array(content["starts"]["ellipse"]["mean"], np.float64)[links >= 90][:, frequencies >= 10]
    difference = np.abs(means / means.mean(axis=0) - 1)
    return f"±{percent(float(np.nanmax(difference)), sign=False)} of their mean from 10 Hz on"


def impacts_table(numbers: Numbers) -> str:
    """Changes in the first impact: means over the numbers of links at each frequency, and their range."""
    content = numbers["paper_shapes"]
    found = content["impacts"]
    names = ("area", "height", "width", "speed", "moved")
    rows = []
    for place, frequency in enumerate(content["cells"]["frequency"]):
        row = [f"{frequency:g} Hz"]
        for name in names:
            values, signed = np.array(found[name], np.float64)[:, place], name != "moved"
            values = values[np.isfinite(values)]
            if not len(values):
                row.append("—")
                continue
            ends = " to ".join(percent(float(each), sign=signed) for each in (values.min(), values.max()))
            row.append(f"{percent(float(values.mean()), sign=signed)} ({ends})")
        rows.append(row)
    return table(["", "area", "height", "width", "speed along the loop", "outline moved"], rows)


def effects_table(numbers: Numbers) -> str:
    """What each value of each quantity does to Δx."""
    names = [
        name
        for sweep in ("paper_claims", "paper_joints")
        for name in numbers[sweep]["effects"]
        if name not in ("start", "tolerance")
    ]
    rows, cells = [], numbers["paper_claims"]["cells"]
    for name in names:
        first = _symbol(name)
        for value, effect in changes(numbers, name):
            found = summary(effect)
            mean, typical = percent(found.mean, found.half_width), percent(found.typical, sign=False)
            counts = mean, found.rises, found.falls, typical
            rows.append([first, f"{value:g}", *counts, _extremes(effect, cells), effect.lost or ""])
            first = ""
    return table(
        "quantity | value | Δx, mean of cells | rise | fall | typical | least and greatest cell | pairs lost", rows
    )


def _extremes(effect: Effect, cells: Mapping[str, list[float]]) -> str:
    """The cells with the least and the greatest effect."""
    if not effect.known.any():
        return "—"
    relative = np.where(effect.known, effect.relative, np.nan)
    texts = []
    for place in (np.nanargmin(relative), np.nanargmax(relative)):
        row, column = np.unravel_index(int(place), relative.shape)
        at = f"{cells['links'][row]}, {cells['frequency'][column]:g} Hz"
        texts.append(f"{percent(float(relative[row, column]))} ({at})")
    return ", ".join(texts)


def friction_table(numbers: Numbers) -> str:
    """The best friction of the floor in each cell."""
    content = numbers["paper_claims"]
    head = ["links", *(f"{frequency:g} Hz" for frequency in content["cells"]["frequency"])]
    best = zip(content["cells"]["links"], content["friction"]["best"], strict=True)
    return table(head, [[str(links), *(f"{value:g}" for value in row)] for links, row in best])


def walks_text(numbers: Numbers) -> str:
    """How many walks there are, and how they ended."""
    total: Counter[str] = Counter()
    for content in numbers.values():
        total.update({name: count for name, count in content["walks"].items() if name != "missing"})
    failed = ", ".join(f"{count} {name}" for name, count in total.items() if name != "at_rest" and count)
    inaccurate = sum(content["inaccurate"] for content in numbers.values())
    rest = f"{total.total():,} walks: {total['at_rest']:,} at rest" + (f", {failed}" if failed else "")
    return f"{rest}; {inaccurate} with an energy error above 5 %"


def _symbol(name: str) -> str:
    """A quantity with its unit, as a table has it."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    quantity = Parameters.quantities()[name]
    reference = f"{quantity.value:g}"
    return f"{quantity.symbol} ({reference})"


def _number(value: float | None, digits: int) -> str:
    return "—" if value is None else f"{value:.{digits}f}"
