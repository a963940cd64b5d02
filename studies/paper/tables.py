"""The parts of the page README.md: page.txt names functions of this module in braces, such as {{claims}}.

Each takes the numbers of `studies.paper.reduction` and gives a text. The paper's sentences stand in claims.yaml.
"""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from studies.common import minus, table
from studies.paper import findings
from studies.paper.findings import Numbers
from studies.paper.statistics import percent, plain
from studies.paper.verdicts import BOUNDS, Verdict
from warpchain import Parameters

SYMBOLS = {"phase": "phase of the release", "clearance": "height of the release / m"}  # None of Table 1
NAMES = {
    "sprocket_radius_is": "sprocket radius, measured to",
    "circle_radius": "radius of the contact circles / m",
    "clearance": "height of the release / m",
    "clearance_of": "height of the release, of the loop",
    "phase": "time of the release / loop periods",
    "ellipse_aspect": "aspect ratio of the ellipse",
}
"""What the paper leaves open, by field."""
SHOWN = 0.02  # Least change of Δx that the table of Table 1's quantities has
WORDS = {"pitch": "the joints", "contact": "the contact surface"}


def page(numbers: Numbers) -> str:
    """The page."""
    template = Path(__file__).with_name("page.txt").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: globals()[match[1]](numbers), template)


@dataclass(frozen=True)
class Claim:
    """A statement of the paper."""

    sentence: str  # In short
    source: str  # Where its numbers are from, in Markdown
    finds: str  # What came out, in one line, with the names of numbers in braces
    details: str = ""  # Further numbers, likewise
    check: str = ""  # Name of the function of `findings`, and its argument; none of what another page shows
    verdict: str = ""  # Set by hand, where it is not clear what the paper says
    reasons: Mapping[str, str] = field(default_factory=dict)  # Verdict → why

    def finding(self, numbers: Numbers) -> tuple[str, str, Verdict]:
        """What came out, in one line and in detail, and what it says of the claim."""
        name, _, argument = self.check.partition(" ")
        found: Any = getattr(findings, name) if name else lambda _: (Verdict.OPEN, {})
        verdict, words = (found(argument) if argument else found)(numbers)
        return self.finds.format(**words), self.details.format(**words), Verdict(self.verdict or verdict)

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
    return [claim.finding(numbers)[-1] for claim in CLAIMS]


def claims(numbers: Numbers) -> str:
    """All claims with what came out; a mark stands at what a person wrote, from another page."""
    rows = []
    for number, claim in enumerate(CLAIMS, 1):
        text, _, verdict = claim.finding(numbers)
        mark = "" if claim.check else " †"
        rows.append((number, claim.sentence, f"{text}{mark}", verdict))
    return table(["", "the paper says", "warpchain finds", "verdict"], rows)


def notes(numbers: Numbers) -> str:
    """Of each claim that has them: where its numbers are from, further ones, and the reason of its verdict."""
    lines = []
    for number, claim in enumerate(CLAIMS, 1):
        _, details, verdict = claim.finding(numbers)
        texts = [*filter(None, (details, claim.reason(verdict)))]
        lines += [f"- **{number}** ({claim.source}) {' '.join(texts)}"] if texts else []
    return "\n".join(lines)


def verdicts(numbers: Numbers) -> str:
    """How many claims have which verdict."""
    counts = Counter(all_verdicts(numbers))
    return "Of {} statements {} agree, {} agree in part, {} differ and {} cannot be compared".format(
        len(CLAIMS), *(counts[verdict] for verdict in Verdict)
    )


def changed(numbers: Numbers) -> dict[str, list[list[int]]]:
    """Numbers of the claims that get another verdict if a bound of the rules, by name, is halved, and if doubled."""
    usual, found = all_verdicts(numbers), {}
    for name, value in asdict(BOUNDS).items():
        found[name] = []
        for factor in (0.5, 2.0):
            setattr(BOUNDS, name, factor * value)
            pairs = enumerate(zip(usual, all_verdicts(numbers), strict=True), 1)
            found[name].append([number for number, (before, after) in pairs if before != after])
        setattr(BOUNDS, name, value)
    return found


def thresholds(numbers: Numbers) -> str:
    """Which claims get another verdict if one bound of the rules is halved or doubled."""
    rows = (
        (name, f"{getattr(BOUNDS, name):g}", *(", ".join(map(str, each)) or "none" for each in both))
        for name, both in changed(numbers).items()
    )
    return table(["bound", "value", "halved", "doubled"], rows)


def stability(numbers: Numbers) -> str:
    """Which verdicts change if any bound is halved or doubled, and how many no bound decides."""
    moved = sorted({number for both in changed(numbers).values() for each in both for number in each})
    by_hand = sum(bool(claim.verdict or claim.check in ("", "waves")) for claim in CLAIMS)
    statements = f"{', '.join(map(str, moved[:-1]))} and {moved[-1]}"
    return (
        f"{len(moved)} of {len(CLAIMS)} verdicts change if one of the [rules' bounds](#how-verdicts-are-reached) is "
        f"halved or doubled:\n  those of statements {statements}. {by_hand} are set by hand"
    )


def of_cells(cells: Mapping[str, Any], head: str, rows: Mapping[str, Any]) -> str:
    """A table with a column for each frequency, from texts of rows by their name."""
    heads = (*head.split(" | "), *(f"{frequency:g} Hz" for frequency in cells["frequency"]))
    return table(heads, ((*name.split(" | "), *texts) for name, texts in rows.items()))


def distances(numbers: Numbers) -> str:
    """Mean Δx by start, links and frequency."""
    cells, rows = numbers["paper_claims"]["cells"], {}
    for place, links in enumerate(cells["links"]):
        for start in ("rest", "ellipse"):
            rows[f"{links} | {start}"] = [f"{each:.3f}" for each in findings.of_start(numbers, start, "mean")[place]]
    return of_cells(cells, "links | start", rows)


def ellipses(numbers: Numbers) -> str:
    """Greatest relative difference of ellipses of 90 links or more from their mean over the links, from 10 Hz on."""
    links, frequencies = (np.array(numbers["paper_claims"]["cells"][name]) for name in ("links", "frequency"))
    means = findings.of_start(numbers, "ellipse", "mean")[links >= 90][:, frequencies >= 10]
    return f"±{plain(np.nanmax(np.abs(means / means.mean(axis=0) - 1)))} of their mean from 10 Hz on"


def impacts(numbers: Numbers) -> str:
    """Changes in the first impact, means over the numbers of links, of the frequencies at which loops rise again."""
    content = numbers["paper_shapes"]
    rise = np.isfinite(content["impacts"]["speed"]).any(axis=0)
    frequencies = ", ".join(f"{each:g}" for each in np.array(content["cells"]["frequency"])[rise])
    texts = []
    for name in ("speed", "width", "height", "area"):
        means = map(percent, np.nanmean(content["impacts"][name][:, rise], axis=0))
        texts.append(f"their {name} by {', '.join(means)}")
    return f"at {frequencies} Hz {'; '.join(texts)}"


def effects(numbers: Numbers) -> str:
    """What each value of a quantity does to Δx, mean of the cells, if it does more than `SHOWN`."""
    rows = []
    for name, content in findings.effects(numbers).items():
        if name == "start" or max(abs(effect.cells.mean) for effect in content["values"]) < SHOWN:
            continue
        symbol = SYMBOLS.get(name) or "{0.symbol} ({0.value:g})".format(Parameters.quantities()[name])
        texts = (f"{effect.notes['value']:g}: {effect}" for effect in content["values"])
        rows.append([symbol, "; ".join(texts)])
    return minus(table("quantity | value: change of Δx", rows))


def walks(numbers: Numbers) -> str:
    """How many walks there are, and how they ended."""
    total = sum((Counter(content["walks"]) for content in numbers.values()), Counter())
    parts = (f"{count:,} {name.replace('_', ' ')}" for name, count in total.items())
    inaccurate = sum(content["inaccurate"] for content in numbers.values())
    *earlier, last = (str(each) for each in sorted({content["numerics_version"] for content in numbers.values()}))
    numerics = f"{', '.join(earlier)} and {last}" if earlier else last
    return f"{', '.join(parts)}; {inaccurate} with an energy error above 5 %; numerics {numerics}"


def left_open(numbers: Numbers) -> str:
    """What each other choice of what the paper leaves open does to Δx, mean of the cells."""
    rows = []
    for name, found in numbers["paper_open"]["left_open"].items():
        texts = (f"{_word(effect.notes['value'])}: {effect}" for effect in found["values"])
        rows.append([NAMES[name], _word(found["reference"]), "; ".join(texts)])
    return table("left open | chosen here | other choice: change of Δx", rows)


def _word(value: str | float) -> str:
    """A value of what the paper leaves open, in words or as a number."""
    return WORDS.get(value, value) if isinstance(value, str) else f"{value:g}"
