"""Tables of the page whose numbers are those of `studies.paper.further`."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from studies.common import table
from studies.paper.findings import percent
from studies.paper.reduction import effect_of
from studies.paper.statistics import standard_error, summary

Numbers = Mapping[str, Any]

NAMES: Final = {
    "sprocket_radius_is": "the sprocket's radius is that of",
    "circle_radius": "radius of the circles of links / m",
    "clearance": "height of the release / m",
    "clearance_of": "height is that of the chain",
    "phase": "moment of the release, in loop periods",
    "ellipse_aspect": "aspect of the ellipse",
}
"""What the paper leaves open, by field."""
WORDS: Final = {"pitch": "where joints ride", "contact": "where circles touch"}


def strands_table(numbers: Numbers) -> str:
    """When loops crease, their strands meet and they collapse, by start and links."""
    content = numbers["paper_strands"]
    head = ["start", "links", "", "before", "after 1", "after 2", "after 3", "later", "never", "early over late"]
    rows = []
    for start in ("rest", "ellipse"):
        for links, each in zip(content["cells"]["links"], content["strands"]["starts"][start], strict=True):
            ratio = "—"
            if "early_over_late" in each:
                effect = effect_of(each["early_over_late"])
                ratio = percent(float(effect.relative), float(effect.half_width))
            for event, text, last in (
                ("crease", "first crease", ""),
                ("strands", "strands meet", ratio),
                ("collapse", "collapse", ""),
            ):
                shares = (f"{100 * count / max(1, sum(each[event])):.0f} %" for count in each[event])
                rows.append([start, str(links), text, *shares, last])
    return table(head, rows)


def through_table(numbers: Numbers) -> str:
    """What it does to Δx if links pass through one another, cell by cell."""
    cells, rows = numbers["paper_through"]["cells"], []
    for start, name in (("sprocket", "paper_through"), ("ellipse", "paper_through_ellipse")):
        effect = effect_of(numbers[name]["through"])
        for links, values, widths in zip(cells["links"], effect.relative, effect.half_width, strict=True):
            texts = (percent(float(value), float(width)) for value, width in zip(values, widths, strict=True))
            rows.append([start, f"{links} links", *texts])
    return table(["from", "", *(f"{frequency:g} Hz" for frequency in cells["frequency"])], rows)


def open_table(numbers: Numbers) -> str:
    """What each other choice of what the paper leaves open does to Δx, over the cells, beside the spread of a walk."""
    content = numbers["paper_open"]
    rows = []
    for name, found in content["left_open"].items():
        first, walk = NAMES[name], percent(found["spread"], sign=False)
        for each in found["values"]:
            effect = effect_of(each)
            total = summary(effect)
            value, reference = (_text(other) for other in (each["value"], found["reference"]))
            ends = [percent(float(end(effect.relative[effect.known]))) for end in (np.min, np.max)]
            mean, typical = percent(total.mean, total.half_width), percent(total.typical, sign=False)
            rows.append([first, f"{value} for {reference}", mean, typical, ", ".join(ends), walk])
            first = walk = ""
    head = ["left open", "value", "Δx, mean of cells", "typical", "least and greatest cell", "spread of a walk"]
    return table(head, rows)


def rest_table(numbers: Numbers) -> str:
    """Released from rest and spinning, at once and later."""
    content = numbers["paper_rest"]
    links = np.array(content["cells"]["links"])
    rows = []
    for name, found in content["rest_and_hold"].items():
        effect = effect_of(found)
        error = standard_error(effect)
        long, short = (_mean(effect.relative[chosen], error[chosen]) for chosen in (links >= 150, links < 150))
        texts = [_with_error(*each) for each in ((found["mean"], found["error"]), short, long)]
        pairs = f"{int(effect.pairs[effect.known].sum())} in {found['cells']}"
        rows.append([name, *texts, pairs, f"{found['chi2']:.1f}, {found['p']:.2g}"])
    head = "Δx | all cells | 60 and 120 links | 150 and 180 links | pairs, cells | χ² of no difference, p"
    return table(head, rows)


def lengths_table(numbers: Numbers) -> str:
    """Links of other lengths with the masses and inertias of their length, and with those of Table 1."""
    claims, rows = numbers["paper_claims"], []
    known = {"dx": claims["effects"]["link_length"], "until_collapse": claims["collapse"]}
    alone = {
        quantity: {f"{1000 * each['value']:g}": summary(effect_of(each)) for each in content["values"]}
        for quantity, content in known.items()
    }
    for length, found in numbers["paper_more"]["more"]["lengths"].items():
        cells = [f"{length} mm"]
        for quantity in ("dx", "until_collapse"):
            own, fixed = summary(effect_of(found[quantity])), alone[quantity].get(length)
            cells.append(percent(own.mean, own.half_width))
            cells.append("—" if fixed is None else percent(fixed.mean, fixed.half_width))
        rows.append(cells)
    return table(["ℓ", "Δx, bars of that length", "ℓ alone", "bounces until the collapse, bars", "ℓ alone"], rows)


def nonlinear_table(numbers: Numbers) -> str:
    """What explains the variance of Δx in a cell, by start."""
    content, rows = numbers["paper_footnote"], []
    for start, found in content["nonlinear"].items():
        for i, links in enumerate(content["cells"]["links"]):
            for j, frequency in enumerate(content["cells"]["frequency"]):
                shares = (max(0.0, found[name][i][j]) for name in ("linear", "squares", "products", "repeated"))
                rows.append([start, f"{links} × {frequency:g} Hz", *(f"{100 * share:.0f} %" for share in shares)])
    head = ["start", "cell", "linear terms", "and squares, turning phase", "and products", "all but chaos"]
    return table(head, rows)


def loops_table(numbers: Numbers) -> str:
    """How loops at their release differ from those that spun from the start and were held longest."""
    content, held = numbers["paper_loops"], numbers["paper_held"]
    found, links = content["loops"], np.array(content["cells"]["links"])
    height, energy = (np.array(found[name], float) for name in ("height", "energy"))
    least = (slice(None), slice(None), found["start"].index("spinning"), -1)
    rows = []
    for which, start in enumerate(found["start"]):
        for hold, seconds in enumerate(found["further_hold"]):
            place = (slice(None), slice(None), which, hold)
            mm, share = 1e-3 * (height[place] - height[least]), energy[place] / energy[least] - 1
            rows.append([f"{start}, held on for {seconds:g} s", *_loops_texts(mm, share, links)])
    there = np.isin(links, held["cells"]["links"])
    mm = 1e-3 * (np.array(held["loops"]["height"]) - height[least][there])
    share = np.array(held["loops"]["energy"]) / energy[least][there] - 1
    rows.append(["spinning, held for 30 s under its own loads", *_loops_texts(mm, share, links[there])])
    head = ["start", "height / mm, 150 and 180 links", "energy, at most", "60 and 120 links", "energy, at most"]
    return table(head, rows)


def _loops_texts(mm: Any, share: Any, links: Any) -> list[str]:
    """Mean, least and greatest difference of height, and of energy the greatest, of long loops and of short ones."""
    texts = []
    for chosen in (links >= 150, links < 150):
        known, energy = mm[chosen], share[chosen]
        if known.size:
            texts += [
                f"{known.mean():+.2f} ({known.min():+.2f} to {known.max():+.2f})",
                f"{100 * np.abs(energy).max():.2f} %",
            ]
        else:
            texts += ["", ""]
    return [text.replace("-", "−") for text in texts]


def same_text(numbers: Numbers) -> str:
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
    return f"{found['pairs']} pairs of loops differ on average {', '.join(texts)}".replace("-", "−")


def sliding_table(numbers: Numbers) -> str:
    """Time from the collapse to rest, and Δx, with other frictions of the floor."""
    rows = []
    for value, found in numbers["paper_more"]["more"]["sliding"].items():
        time, distance = (summary(effect_of(found[name])) for name in ("time", "dx"))
        texts = [percent(each.mean, each.half_width) for each in (time, distance)]
        rows.append([value, texts[0], f"{time.rises}, {time.falls}", texts[1]])
    return table("μ_fc | time from collapse to rest | cells that rise, fall | Δx", rows)


def distributions_table(numbers: Numbers) -> str:
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


def undamped_text(numbers: Numbers) -> str:
    """What little or no damping of the joints does to Δx, in words."""
    found = numbers["paper_more"]["more"]["undamped"]
    effects = {value: summary(effect_of(each)) for value, each in found.items()}
    return ", ".join(f"b = {value}: {percent(each.mean, each.half_width)}" for value, each in effects.items())


def _text(value: object) -> str:
    return WORDS.get(value, value) if isinstance(value, str) else f"{value:g}"


def _mean(values: Any, error: Any) -> tuple[float, float]:
    """Mean over the cells and its standard error."""
    known = np.isfinite(values) & np.isfinite(error)
    return float(values[known].mean()), float(np.sqrt(np.sum(error[known] ** 2)) / known.sum())


def _with_error(value: float, error: float) -> str:
    return f"{100 * value:+.2f} ± {100 * error:.2f} %".replace("-", "−")
