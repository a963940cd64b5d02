"""The parts of the page README.md: page.txt names functions of this module in braces, such as {{claims}}.

Each takes the numbers of `studies.paper.reduction` and gives a text. The paper's sentences stand in claims.yaml.
"""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from studies.common import minus, table
from studies.paper import findings
from studies.paper.figure5 import figure5_table
from studies.paper.findings import Numbers, over, percent, plain, steps
from studies.paper.further import EVENTS
from studies.paper.separations import separations_tables
from studies.paper.statistics import Effect
from studies.paper.verdicts import Bounds, Verdict, scaled
from warpchain import Parameters

SYMBOLS = {"phase": "phase of the release", "clearance": "height of the release / m"}
"""Quantities that are none of Table 1."""
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
    """A sentence of the paper.

    Attributes:
        sentence: in short.
        source: where its numbers are from, in Markdown.
        says: what came out, with the names of numbers in braces.
        check: name of the function of `findings`, and its argument; none of what another page shows.
        verdict: set by hand, where it is not clear what the paper says.
        reasons: verdict → why.
    """

    sentence: str
    source: str
    says: str
    check: str = ""
    verdict: str = ""
    reasons: Mapping[str, str] | None = None

    def finding(self, numbers: Numbers) -> tuple[str, Verdict]:
        """What came out, and what it says of the claim."""
        name, _, argument = self.check.partition(" ")
        found: Any = getattr(findings, name) if name else lambda _: (Verdict.OPEN, {})
        verdict, words = (found(argument) if argument else found)(numbers)
        return self.says.format(**words), Verdict(self.verdict) if self.verdict else verdict

    def reason(self, verdict: Verdict) -> str:
        """Why the verdict is what it is; the page admits it if no reason is known."""
        for verdicts, text in (self.reasons or {}).items():
            if verdict in verdicts.split(" | "):
                return text
        return {Verdict.OPEN: "The numbers are missing.", Verdict.AGREES: ""}.get(verdict, "No reason is known.")


CLAIMS = tuple(
    Claim(**given) for given in yaml.safe_load(Path(__file__).with_name("claims.yaml").read_text(encoding="utf-8"))
)


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


def count(numbers: Numbers) -> str:
    """Number of the claims."""
    return str(len(CLAIMS))


def verdicts(numbers: Numbers) -> str:
    """How many claims have which verdict."""
    counts = Counter(all_verdicts(numbers))
    return ", ".join(f"{counts[verdict]} × *{verdict}*" for verdict in Verdict if counts[verdict])


def thresholds(numbers: Numbers) -> str:
    """Which verdicts change if one bound of the rules is halved or doubled."""
    usual, rows = all_verdicts(numbers), []
    for field in fields(Bounds):
        row = [field.name, f"{getattr(Bounds(), field.name):g}"]
        for factor in (0.5, 2.0):
            with scaled(field.name, factor):
                pairs = enumerate(zip(usual, all_verdicts(numbers), strict=True), 1)
            changed = (f"{number}: *{before}* → *{after}*" for number, (before, after) in pairs if before != after)
            row.append("; ".join(changed) or "none")
        rows.append(row)
    return table(["bound", "value", "halved", "doubled"], rows)


def reasons(numbers: Numbers) -> str:
    """The reasons of all claims that have one, numbered as in the table."""
    found = enumerate(zip(CLAIMS, all_verdicts(numbers), strict=True), 1)
    return "\n".join(f"- {k} *{verdict}*: {why}" for k, (claim, verdict) in found if (why := claim.reason(verdict)))


def of_cells(cells: Mapping[str, Any], head: str, rows: Mapping[str, Any]) -> str:
    """A table with a column for each frequency, from texts of rows by their name."""
    heads = (*head.split(" | "), *(f"{frequency:g} Hz" for frequency in cells["frequency"]))
    return table(heads, ((*name.split(" | "), *texts) for name, texts in rows.items()))


def with_width(effect: Effect) -> str:
    """An effect in one cell, with its interval."""
    return percent(float(effect.relative), float(effect.half_width))


def distances(numbers: Numbers) -> str:
    """Mean Δx ± standard deviation of a walk, by start, links and frequency."""
    cells, rows = numbers["paper_claims"]["cells"], {}
    for place, links in enumerate(cells["links"]):
        for start in ("rest", "ellipse"):
            known = numbers["paper_claims"]["starts"][start]
            pairs = zip(known["mean"][place], known["sd"][place], strict=True)
            rows[f"{links} | {start}"] = [" ± ".join(_number(each) for each in pair) for pair in pairs]
    return of_cells(cells, "links | start", rows)


def ellipses(numbers: Numbers) -> str:
    """Greatest relative difference of ellipses of 90 links or more from their mean over the links, from 10 Hz on."""
    content = numbers["paper_claims"]
    links, frequencies = (np.array(content["cells"][name]) for name in ("links", "frequency"))
    means = findings.of_start(numbers, "ellipse", "mean")[links >= 90][:, frequencies >= 10]
    return f"±{plain(float(np.nanmax(np.abs(means / means.mean(axis=0) - 1))))} of their mean from 10 Hz on"


def impacts(numbers: Numbers) -> str:
    """Changes in the first impact: means over the numbers of links at each frequency, and their range."""
    content, rows = numbers["paper_shapes"], []
    for place, frequency in enumerate(content["cells"]["frequency"]):
        row = [f"{frequency:g} Hz"]
        for name in ("area", "height", "width", "speed", "moved"):
            values, show = np.array(content["impacts"][name], float)[:, place], plain if name == "moved" else percent
            values = values[np.isfinite(values)]
            ends = (show(float(each)) for each in (values.min(), values.max())) if len(values) else ()
            row.append(f"{show(float(values.mean()))} ({' to '.join(ends)})" if len(values) else "—")
        rows.append(row)
    return table(["", "area", "height", "width", "speed along the loop", "outline moved"], rows)


def effects(numbers: Numbers) -> str:
    """What each value of each quantity does to Δx."""
    rows, cells = [], numbers["paper_claims"]["cells"]
    for name, content in findings.effects(numbers).items():
        first = _symbol(name) if name not in ("start", "tolerance") else None
        for value, effect in steps(content) if first else ():
            counts = over(effect), effect.rises, effect.falls, plain(effect.cells.typical)
            rows.append([first, f"{value:g}", *counts, _extremes(effect, cells), effect.lost or ""])
            first = ""
    head = "quantity | value | Δx, mean of cells | rise | fall | typical | least and greatest cell | pairs lost"
    return table(head, rows)


def _extremes(effect: Effect, cells: Mapping[str, list[float]]) -> str:
    """The cells with the least and the greatest effect."""
    if not effect.known.any():
        return "—"
    relative, texts = np.where(effect.known, effect.relative, np.nan), []
    for place in (np.nanargmin(relative), np.nanargmax(relative)):
        row, column = np.unravel_index(int(place), relative.shape)
        at = f"{cells['links'][row]}, {cells['frequency'][column]:g} Hz"
        texts.append(f"{percent(float(relative[row, column]))} ({at})")
    return ", ".join(texts)


def friction(numbers: Numbers) -> str:
    """The best friction of the floor in each cell."""
    content = numbers["paper_claims"]
    best = zip(content["cells"]["links"], content["friction"]["best"], strict=True)
    return of_cells(content["cells"], "links", {f"{links}": [f"{value:g}" for value in row] for links, row in best})


def walks(numbers: Numbers) -> str:
    """How many walks there are, and how they ended."""
    total: Counter[str] = Counter()
    for content in numbers.values():
        total.update({name: count for name, count in content["walks"].items() if name != "missing"})
    parts = [f"{total.total():,} walks: {total['at_rest']:,} at rest"]
    parts += [f"{count} {name}" for name, count in total.items() if name != "at_rest" and count]
    inaccurate = sum(content["inaccurate"] for content in numbers.values())
    return f"{', '.join(parts)}; {inaccurate} with an energy error above 5 %"


def contacts(numbers: Numbers) -> str:
    """When loops crease, their strands meet and they collapse, by start and links."""
    content, rows = numbers["paper_strands"], []
    for start in ("rest", "ellipse"):
        for links, each in zip(content["cells"]["links"], content["strands"]["starts"][start], strict=True):
            early = with_width(Effect.of(each["early_over_late"])) if "early_over_late" in each else "—"
            for event, text in zip(EVENTS, ("first crease", "strands meet", "collapse"), strict=True):
                shares = (f"{100 * count / max(1, sum(each[event])):.0f} %" for count in each[event])
                rows.append((start, links, text, *shares, early if event == "strands" else ""))
    return table("start | links |  | before | after 1 | after 2 | after 3 | later | never | early over late", rows)


def through(numbers: Numbers) -> str:
    """What it does to Δx if links pass through one another, cell by cell."""
    cells, rows = numbers["paper_through"]["cells"], {}
    for start, name in (("sprocket", "paper_through"), ("ellipse", "paper_through_ellipse")):
        effect = Effect.of(numbers[name]["through"])
        for place, links in enumerate(cells["links"]):
            texts = [with_width(effect[place, column]) for column in range(len(cells["frequency"]))]
            rows[f"{start} | {links} links"] = texts
    return of_cells(cells, "from | ", rows)


def left_open(numbers: Numbers) -> str:
    """What each other choice of what the paper leaves open does to Δx, over the cells, beside the spread of a walk."""
    rows = []
    for name, found in numbers["paper_open"]["left_open"].items():
        first, walk = NAMES[name], plain(found["spread"])
        for value, effect in steps(found):
            texts = [
                WORDS.get(each, each) if isinstance(each, str) else f"{each:g}" for each in (value, found["reference"])
            ]
            ends = [percent(float(end(effect.relative[effect.known]))) for end in (np.min, np.max)]
            rows.append([first, " for ".join(texts), over(effect), plain(effect.cells.typical), ", ".join(ends), walk])
            first = walk = ""
    return table("left open | value | Δx, mean of cells | typical | least and greatest cell | spread of a walk", rows)


def rest(numbers: Numbers) -> str:
    """Released from rest and spinning, at once and later."""
    content, rows = numbers["paper_rest"], []
    links = np.array(content["cells"]["links"])
    for name, found in content["rest_and_hold"].items():
        effect = Effect.of(found)
        short, long = (effect[chosen].cells for chosen in (links < 150, links >= 150))
        pairs_of = ((found["mean"], found["error"]), (short.mean, short.error), (long.mean, long.error))
        texts = [minus(f"{100 * mean:+.2f} ± {100 * error:.2f} %") for mean, error in pairs_of]
        pairs = f"{int(effect.pairs[effect.known].sum())} in {found['cells']}"
        rows.append([name, *texts, pairs, f"{found['chi2']:.1f}, {found['p']:.2g}"])
    head = "Δx | all cells | 60 and 120 links | 150 and 180 links | pairs, cells | χ² of no difference, p"
    return table(head, rows)


def lengths(numbers: Numbers) -> str:
    """Links of other lengths with the masses and inertias of their length, and with those of Table 1."""
    known, rows = numbers["paper_claims"], []
    alone = [
        {f"{1000 * value:g}": over(effect) for value, effect in steps(content)}
        for content in (known["effects"]["link_length"], known["collapse"])
    ]
    for length, found in numbers["paper_more"]["more"]["lengths"].items():
        both = [over(Effect.of(found[quantity])) for quantity in ("dx", "until_collapse")]
        own = [each.get(length, "—") for each in alone]
        rows.append([f"{length} mm", both[0], own[0], both[1], own[1]])
    return table(["ℓ", "Δx, bars of that length", "ℓ alone", "bounces until the collapse, bars", "ℓ alone"], rows)


def nonlinear(numbers: Numbers) -> str:
    """What explains the variance of Δx in a cell, by start."""
    content, rows = numbers["paper_footnote"], []
    for start, found in content["nonlinear"].items():
        for i, links in enumerate(content["cells"]["links"]):
            for j, frequency in enumerate(content["cells"]["frequency"]):
                shares = (max(0.0, found[name][i][j]) for name in ("linear", "squares", "products", "repeated"))
                rows.append([start, f"{links} × {frequency:g} Hz", *(f"{100 * share:.0f} %" for share in shares)])
    return table("start | cell | linear terms | and squares, turning phase | and products | all but chaos", rows)


def loops(numbers: Numbers) -> str:
    """How loops at their release differ from those that spun from the start and were held longest."""
    content, held, rows = numbers["paper_loops"], numbers["paper_held"], []
    found, links = content["loops"], np.array(content["cells"]["links"])
    height, energy = (np.array(found[name], float) for name in ("height", "energy"))
    place = np.s_[:, :, found["start"].index("spinning"), -1]
    least = height[place], energy[place]
    for which, start in enumerate(found["start"]):
        for hold, seconds in enumerate(found["further_hold"]):
            mm, share = 1e-3 * (height[:, :, which, hold] - least[0]), energy[:, :, which, hold] / least[1] - 1
            rows.append([f"{start}, held on for {seconds:g} s", *_loops_texts(mm, share, links)])
    there = np.isin(links, held["cells"]["links"])
    mm = 1e-3 * (np.array(held["loops"]["height"]) - least[0][there])
    share = np.array(held["loops"]["energy"]) / least[1][there] - 1
    rows.append(["spinning, held for 30 s under its own loads", *_loops_texts(mm, share, links[there])])
    return table("start | height / mm, 150 and 180 links | energy, at most | 60 and 120 links | energy, at most", rows)


def _loops_texts(mm: Any, share: Any, links: Any) -> list[str]:
    """Mean, least and greatest difference of height, and of energy the greatest, of long loops and of short ones."""
    texts = []
    for known, energy in ((mm[chosen], share[chosen]) for chosen in (links >= 150, links < 150)):
        texts += [f"{known.mean():+.2f} ({known.min():+.2f} to {known.max():+.2f})"] if known.size else [""]
        texts += [f"{100 * np.abs(energy).max():.2f} %"] if known.size else [""]
    return list(map(minus, texts))


def same(numbers: Numbers) -> str:
    """How loops of the same samples differ that came to spin in two ways, in words."""
    found = numbers["paper_starts"]["same"]
    texts = [
        f"{words} by {scale * found[name][0]:+.{digits}f} {unit} (greatest {scale * found[name][2]:.{digits}f})"
        for name, words, scale, digits, unit in (
            ("height", "in height", 1e-3, 2, "mm"),
            ("place", "in the place of the centre of mass", 1e-3, 3, "mm"),
            ("energy", "in energy", 100, 3, "%"),
        )
    ]
    return minus(f"{found['pairs']} pairs of loops differ on average {', '.join(texts)}")


def sliding(numbers: Numbers) -> str:
    """Time from the collapse to rest, and Δx, with other frictions of the floor."""
    rows = []
    for value, found in numbers["paper_more"]["more"]["sliding"].items():
        time, distance = (Effect.of(found[name]) for name in ("time", "dx"))
        rows.append([value, over(time), f"{time.rises}, {time.falls}", over(distance)])
    return table("μ_fc | time from collapse to rest | cells that rise, fall | Δx", rows)


def distributions(numbers: Numbers) -> str:
    """Distributions of Δx at both tolerances."""
    rows = [
        [
            f"{each['links']} × {each['frequency']:g} Hz",
            *(f"{mean:.4f} ± {sd:.4f}" for mean, sd in zip(each["means"], each["sds"], strict=True)),
            f"{each['distance']:.2f}",
            f"{each['p']:.2f}",
        ]
        for each in numbers["paper_distributions"]["distributions"]
    ]
    return table(["cell", "Δx at 1e-6 / m", "at 1e-9 / m", "greatest distance", "p"], rows)


def undamped(numbers: Numbers) -> str:
    """What little or no damping of the joints does to Δx, in words."""
    found = numbers["paper_more"]["more"]["undamped"]
    return ", ".join(f"b = {value}: {over(Effect.of(each))}" for value, each in found.items())


def figure5(numbers: Numbers) -> str:
    """Numbers of curves such as those of Figure 5."""
    return figure5_table()


def separations(numbers: Numbers) -> str:
    """How far apart along the chain links are that touch."""
    return separations_tables()


def _symbol(name: str) -> str:
    """A quantity with its value, as a table has it."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    quantity = Parameters.quantities()[name]
    return f"{quantity.symbol} ({quantity.value:g})"


def _number(value: float | None) -> str:
    return "—" if value is None else f"{value:.3f}"
