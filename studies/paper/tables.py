"""The parts of the page README.md: page.txt names functions of this module in braces, such as {{claims}}.

Each takes the numbers of `studies.paper.reduction` and gives a text. The paper's sentences stand in claims.yaml.
"""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from studies.common import table
from studies.paper import findings
from studies.paper.findings import Numbers
from studies.paper.statistics import percent, plain
from studies.paper.verdicts import BOUNDS, Verdict
from warpchain import Parameters

SYMBOLS = {"phase": "phase of the release", "clearance": "height of the release / m"}  # None of Table 1
NAMES = {
    "sprocket_radius_is": "the sprocket's radius is that of",
    "circle_radius": "radius of the circles of links / m",
    "clearance": "height of the release / m",
    "clearance_of": "height is that of the chain",
    "phase": "moment of the release, in loop periods",
    "ellipse_aspect": "aspect of the ellipse",
}
"""What the paper leaves open, by field."""
WORDS = {"pitch": "where joints ride", "contact": "where circles touch"}


def page(numbers: Numbers) -> str:
    """The page."""
    template = Path(__file__).with_name("page.txt").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: globals()[match[1]](numbers), template)


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper."""

    sentence: str  # In short
    source: str  # Where its numbers are from, in Markdown
    says: str  # What came out, with the names of numbers in braces
    check: str = ""  # Name of the function of `findings`, and its argument; none of what another page shows
    verdict: str = ""  # Set by hand, where it is not clear what the paper says
    reasons: Mapping[str, str] = field(default_factory=dict)  # Verdict → why

    def finding(self, numbers: Numbers) -> tuple[str, Verdict]:
        """What came out, and what it says of the claim."""
        name, _, argument = self.check.partition(" ")
        found: Any = getattr(findings, name) if name else lambda _: (Verdict.OPEN, {})
        verdict, words = (found(argument) if argument else found)(numbers)
        return self.says.format(**words), Verdict(self.verdict or verdict)

    def reason(self, verdict: Verdict) -> str:
        """Why the verdict is what it is; the page admits it if no reason is known."""
        for verdicts, text in self.reasons.items():
            if verdict in verdicts.split(" | "):
                return text
        return {Verdict.OPEN: "The numbers are missing.", Verdict.AGREES: ""}.get(verdict, "No reason is known.")


CLAIMS = [
    Claim(**given) for given in yaml.safe_load(Path(__file__).with_name("claims.yaml").read_text(encoding="utf-8"))
]


def all_verdicts(numbers: Numbers) -> list[Verdict]:
    """The verdicts of all claims."""
    return [claim.finding(numbers)[1] for claim in CLAIMS]


def claims(numbers: Numbers) -> str:
    """All claims with what came out; a mark stands at what a person wrote, from another page."""
    rows = []
    for number, claim in enumerate(CLAIMS, 1):
        text, verdict = claim.finding(numbers)
        mark = " †" if claim.check in ("", "waves") else ""
        rows.append((number, claim.sentence, f"{text}{mark}", claim.source, f"*{verdict}*"))
    return table(["", "the paper", "here", "from", "verdict"], rows)


def verdicts(numbers: Numbers) -> str:
    """How many claims have which verdict."""
    counts = Counter(all_verdicts(numbers))
    each = ", ".join(f"{counts[verdict]} × *{verdict}*" for verdict in Verdict if counts[verdict])
    return f"Of {len(CLAIMS)} statements of the paper {each}"


def thresholds(numbers: Numbers) -> str:
    """Which verdicts change if one bound of the rules is halved or doubled."""
    usual, rows = all_verdicts(numbers), []
    for name, value in asdict(BOUNDS).items():
        texts = []
        for factor in (0.5, 2.0):
            setattr(BOUNDS, name, factor * value)
            pairs = enumerate(zip(usual, all_verdicts(numbers), strict=True), 1)
            changed = (f"{number}: *{before}* → *{after}*" for number, (before, after) in pairs if before != after)
            texts.append("; ".join(changed) or "none")
        setattr(BOUNDS, name, value)
        rows.append([name, f"{value:g}", *texts])
    return table(["bound", "value", "halved", "doubled"], rows)


def reasons(numbers: Numbers) -> str:
    """The reasons of all claims that have one, numbered as in the table."""
    found = enumerate(zip(CLAIMS, all_verdicts(numbers), strict=True), 1)
    return "\n".join(f"- {k} *{verdict}*: {why}" for k, (claim, verdict) in found if (why := claim.reason(verdict)))


def of_cells(cells: Mapping[str, Any], head: str, rows: Mapping[str, Any]) -> str:
    """A table with a column for each frequency, from texts of rows by their name."""
    heads = (*head.split(" | "), *(f"{frequency:g} Hz" for frequency in cells["frequency"]))
    return table(heads, ((*name.split(" | "), *texts) for name, texts in rows.items()))


def distances(numbers: Numbers) -> str:
    """Mean Δx ± standard deviation of a walk, by start, links and frequency."""
    cells, rows = numbers["paper_claims"]["cells"], {}
    for place, links in enumerate(cells["links"]):
        for start in ("rest", "ellipse"):
            mean, sd = (findings.of_start(numbers, start, name)[place] for name in ("mean", "sd"))
            rows[f"{links} | {start}"] = [f"{one:.3f} ± {other:.3f}" for one, other in zip(mean, sd, strict=True)]
    return of_cells(cells, "links | start", rows)


def ellipses(numbers: Numbers) -> str:
    """Greatest relative difference of ellipses of 90 links or more from their mean over the links, from 10 Hz on."""
    links, frequencies = (np.array(numbers["paper_claims"]["cells"][name]) for name in ("links", "frequency"))
    means = findings.of_start(numbers, "ellipse", "mean")[links >= 90][:, frequencies >= 10]
    return f"±{plain(np.nanmax(np.abs(means / means.mean(axis=0) - 1)))} of their mean from 10 Hz on"


def impacts(numbers: Numbers) -> str:
    """Changes in the first impact: means over the numbers of links at each frequency, and their range."""
    content, rows = numbers["paper_shapes"], []
    for place, frequency in enumerate(content["cells"]["frequency"]):
        row = [f"{frequency:g} Hz"]
        for name in ("area", "height", "width", "speed"):
            values = content["impacts"][name][:, place]
            ends = (percent(each(values[np.isfinite(values)])) for each in (np.mean, np.min, np.max))
            row.append("{} ({} to {})".format(*ends) if np.isfinite(values).any() else "—")
        rows.append(row)
    return table(["", "area", "height", "width", "speed along the loop"], rows)


def effects(numbers: Numbers) -> str:
    """What each value of each quantity does to Δx."""
    rows, cells = [], numbers["paper_claims"]["cells"]
    for name, content in findings.effects(numbers).items():
        if name == "start":
            continue
        first = SYMBOLS.get(name) or "{0.symbol} ({0.value:g})".format(Parameters.quantities()[name])
        for effect in content["values"]:
            counts = str(effect), effect.rises, effect.falls, plain(effect.cells.typical)
            ends, relative = [], np.where(effect.known, effect.relative, np.nan)
            for place in (np.nanargmin(relative), np.nanargmax(relative)):
                row, column = np.unravel_index(place, relative.shape)
                at = f"{cells['links'][row]}, {cells['frequency'][column]:g} Hz"
                ends.append(f"{percent(relative[row, column])} ({at})")
            rows.append([first, effect.notes["value"], *counts, ", ".join(ends), effect.lost or ""])
            first = ""
    head = "quantity | value | Δx, mean of cells | rise | fall | typical | least and greatest cell | pairs lost"
    return table(head, rows, "s g s d d s s d")


def friction(numbers: Numbers) -> str:
    """The best friction of the floor in each cell."""
    content = numbers["paper_claims"]
    best = zip(content["cells"]["links"], content["friction"]["best"], strict=True)
    return of_cells(content["cells"], "links", {f"{links}": [f"{value:g}" for value in row] for links, row in best})


def walks(numbers: Numbers) -> str:
    """How many walks there are, and how they ended."""
    total = sum((Counter(content["walks"]) for content in numbers.values()), Counter())
    parts = (f"{count:,} {name.replace('_', ' ')}" for name, count in total.items())
    inaccurate = sum(content["inaccurate"] for content in numbers.values())
    return f"{', '.join(parts)}; {inaccurate} with an energy error above 5 %"


def through(numbers: Numbers) -> str:
    """What it does to Δx if links pass through one another, cell by cell."""
    cells, rows = numbers["paper_through"]["cells"], {}
    for start, name in (("sprocket", "paper_through"), ("ellipse", "paper_through_ellipse")):
        effect = numbers[name]["through"]
        for place, links in enumerate(cells["links"]):
            rows[f"{start} | {links} links"] = [effect[place, column] for column in range(len(cells["frequency"]))]
    return of_cells(cells, "from | ", rows)


def left_open(numbers: Numbers) -> str:
    """What each other choice of what the paper leaves open does to Δx, over the cells, beside the spread of a walk."""
    rows = []
    for name, found in numbers["paper_open"]["left_open"].items():
        first, walk = NAMES[name], plain(found["spread"])
        for effect in found["values"]:
            both = effect.notes["value"], found["reference"]
            texts = (WORDS.get(each, each) if isinstance(each, str) else f"{each:g}" for each in both)
            ends = ", ".join(percent(end(effect.relative[effect.known])) for end in (np.min, np.max))
            rows.append([first, " for ".join(texts), effect, plain(effect.cells.typical), ends, walk])
            first = walk = ""
    return table("left open | value | Δx, mean of cells | typical | least and greatest cell | spread of a walk", rows)


def nonlinear(numbers: Numbers) -> str:
    """What explains the variance of Δx in a cell, by start."""
    content, rows = numbers["paper_footnote"], []
    for start, found in content["nonlinear"].items():
        for (i, links), (j, frequency) in product(*(enumerate(axis) for axis in content["cells"].values())):
            shares = (max(0.0, found[name][i, j]) for name in ("linear", "squares", "products", "repeated"))
            rows.append([start, f"{links} × {frequency:g} Hz", *(f"{100 * share:.0f} %" for share in shares)])
    return table("start | cell | linear terms | and squares, turning phase | and products | all but chaos", rows)
