"""What came out for each claim of the paper, from the numbers of `studies.paper.reduction`.

A function takes the numbers of all sweeps, name → content, and gives a sentence with a verdict by the rules of
`studies.paper.verdicts`.
"""

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from studies.paper.reduction import effect_of
from studies.paper.statistics import Effect, exceeding, summary
from studies.paper.verdicts import LITTLE, UNSEEN, Verdict, direction, share, smallness, together

Numbers = Mapping[str, Any]

MODERATE: Final = 0.2
"""Greatest standard deviation of a walk over the mean of its cell that "varies only moderately" may mean."""
PAIRS: Final = Path(__file__).parents[1] / "waves" / "results" / "do_waves_matter.csv"
"""Pairs of walks with and without a drag on waves."""
LONG: Final = 150
"""Chains of so many links or more are those that the paper's start from rest underestimates."""


@dataclass(frozen=True)
class Finding:
    """What came out, and what it says of the claim."""

    text: str
    verdict: Verdict


Check = Callable[[Numbers], Finding]


def percent(value: float, half_width: float | None = None, *, sign: bool = True) -> str:
    """A share in per cent with two significant digits of its interval, such as ``+3.1 ± 0.4 %``."""
    if not np.isfinite(value):
        return "—"
    number = 100 * value
    if half_width is None or not np.isfinite(half_width) or half_width == 0:
        digits = 0 if abs(number) >= 10 else 1
        text = f"{number:+.{digits}f}" if sign else f"{number:.{digits}f}"
        return f"{text.replace('-', '−')} %"
    width = 100 * half_width
    digits = 0 if width >= 2 else 1 if width >= 0.2 else 2
    text = f"{number:+.{digits}f}" if sign else f"{number:.{digits}f}"
    return f"{text.replace('-', '−')} ± {width:.{digits}f} %"


def counted(effect: Effect) -> str:
    """Mean effect, and in how many cells it is significant."""
    found = summary(effect)
    mean = percent(found.mean, found.half_width)
    return f"{mean}; of {found.cells} cells {found.rises} rise, {found.falls} fall"


def part(effect: Effect, rows: slice) -> Effect:
    """The effect in the cells of some numbers of links."""
    return Effect(effect.relative[rows], effect.half_width[rows], effect.sign[rows], effect.pairs[rows], effect.lost)


def long_chains(numbers: Numbers) -> slice:
    """Rows of the cells with `LONG` links or more."""
    links = numbers["paper_claims"]["cells"]["links"]
    return slice(next(place for place, each in enumerate(links) if each >= LONG), None)


def changes(numbers: Numbers, name: str) -> list[tuple[Any, Effect]]:
    """Value → effect, for each value of a quantity but that of the paper."""
    for sweep in ("paper_claims", "paper_joints"):
        found = numbers[sweep]["effects"].get(name)
        if found is not None:
            return [(each["value"], effect_of(each)) for each in found["values"]]
    raise KeyError(name)


def bounces(numbers: Numbers) -> Finding:
    """Chains bounce."""
    table = np.array(numbers["paper_claims"]["starts"]["rest"]["bounces"], np.float64)
    several = int((table >= 2).sum())
    ends = f"{np.nanmin(table):.1f} to {np.nanmax(table):.1f}"
    text = f"{ends} bounces on average; at least two in {several} of {table.size} cells"
    return Finding(text, share(several, table.size))


def shape(numbers: Numbers) -> Finding:
    """A loop that rises again keeps its shape in its first impact."""
    found = numbers["paper_shapes"]["impacts"]
    names = ("area", "height", "width")
    kept = {name: found[f"{name}_of_walks"] for name in names}
    texts = [f"{name} {percent(kept[name]['quantiles'][1])}" for name in names]
    within = [kept[name]["within_a_tenth"] for name in names]
    count, without = found["walks"], found["without"]
    text = (
        f"medians of {count} loops: {', '.join(texts)}; within 10 % in {', '.join(map(str, within))}; "
        f"{without} more loops do not rise again"
    )
    return Finding(text, together([share(each, count) for each in within]))


def speed(numbers: Numbers) -> Finding:
    """The speed along a loop that rises again falls slightly in the first impact."""
    found = numbers["paper_shapes"]["impacts"]
    of_walks, count, without = found["speed_of_walks"], found["walks"], found["without"]
    low, median, high = (percent(each) for each in of_walks["quantiles"])
    slightly = of_walks["falls_by_less_than_a_fifth"]
    text = (
        f"median {median}, {low} to {high} in nine of ten loops; falls by up to 20 % in {slightly} of {count}, "
        f"rises in {count - of_walks['falls']}; {without} more loops do not rise again"
    )
    return Finding(text, share(slightly, count))


def faster(numbers: Numbers) -> Finding:
    """Δx rises with the frequency."""
    found = summary(effect_of(numbers["paper_claims"]["starts"]["rest"]["faster"]))
    text = f"from one frequency to the next: {found.rises} of {found.cells} steps rise, {found.falls} fall"
    return Finding(text, direction(found.rises, found.falls, found.cells))


def longer(numbers: Numbers) -> Finding:
    """Δx falls with the number of links."""
    found, ellipses = (
        summary(effect_of(numbers["paper_claims"]["starts"][start]["longer"])) for start in ("rest", "ellipse")
    )
    text = (
        f"from one number of links to the next: {found.falls} of {found.cells} steps fall, {found.rises} rise; as an "
        f"ellipse {ellipses.falls} fall, {ellipses.rises} rise"
    )
    return Finding(text, direction(found.falls, found.rises, found.cells))


def moderate(numbers: Numbers) -> Finding:
    """Δx varies only moderately while links and frequency stay."""
    rest = numbers["paper_claims"]["starts"]["rest"]
    relative = np.array(rest["sd"], np.float64) / np.array(rest["mean"], np.float64)
    within = int((relative <= MODERATE).sum())
    text = (
        f"standard deviation of a walk {percent(np.nanmin(relative), sign=False)} to "
        f"{percent(np.nanmax(relative), sign=False)} of the mean, median "
        f"{percent(float(np.nanmedian(relative)), sign=False)}"
    )
    return Finding(text, share(within, relative.size))


def _ellipse(numbers: Numbers) -> Effect:
    return next(effect for value, effect in changes(numbers, "start") if value == "ellipse")


def underestimate(numbers: Numbers) -> Finding:
    """From rest, long chains walk less far than as an ellipse."""
    found = summary(part(_ellipse(numbers), long_chains(numbers)))
    text = (
        f"150 and 180 links: ellipses walk {1 + found.mean:.2f} times as far; {found.rises} of {found.cells} cells "
        "differ so"
    )
    return Finding(text, direction(found.rises, found.falls, found.cells))


def _histograms(numbers: Numbers, start: str) -> NDArray[np.int64] | None:
    """Walks by number of bounces before they touch themselves, of the long chains together."""
    found = numbers["paper_claims"]["starts"][start].get("by_links")
    if found is None:
        return None
    counts: NDArray[np.int64] = np.sum([each["contact"] for each in found[long_chains(numbers)]], axis=0)
    return counts


NOT_RECORDED: Final = Finding("the sweep has no such column; run it again", Verdict.OPEN)


def self_collision(numbers: Numbers) -> Finding:
    """Long chains from rest run into themselves right after their second collision with the floor."""
    counts = _histograms(numbers, "rest")
    if counts is None:
        return NOT_RECORDED
    first, second, third = (counts[place] / counts.sum() for place in (1, 2, 3))
    text = (
        "150 and 180 links from rest first crease or touch themselves after the first bounce in "
        f"{percent(first, sign=False)} of the walks, after the second in {percent(second, sign=False)}, after the "
        f"third in {percent(third, sign=False)}"
    )
    return Finding(text, Verdict.OPEN)


def cause(numbers: Numbers) -> Finding:
    """Among long chains from rest, those that run into themselves early walk less far than others of their cell."""
    content = numbers["paper_claims"]
    found = content["starts"]["rest"].get("by_links")
    if found is None:
        return NOT_RECORDED
    texts, falls, known = [], 0, 0
    for links, each in zip(content["cells"]["links"], found, strict=True):
        if links < LONG - 30:
            continue
        if "early_over_late" not in each:
            texts.append(f"{links} links: no walk touched itself later")
            continue
        effect = effect_of(each["early_over_late"])
        change = percent(float(effect.relative), float(effect.half_width))
        texts.append(f"{links} links: {change} ({each['early']} and {each['late']} walks)")
        falls, known = falls + int(effect.sign < 0), known + 1
    text = (
        "Δx of walks that creased or touched themselves by their second bounce against the others of their cell, from "
        "rest: "
        f"{'; '.join(texts)}"
    )
    return Finding(text, share(falls, known))


def losses(numbers: Numbers) -> Finding:
    """A chain loses most of its energy in collisions."""
    found = {
        name: np.array(each, np.float64) for name, each in numbers["paper_claims"]["starts"]["rest"]["losses"].items()
    }
    collisions = found["floor"] + found["self_contact"]
    means = {name: percent(float(np.nanmean(each)), sign=False) for name, each in found.items()}
    text = (
        f"from the release to rest: floor {means['floor']}, self-contacts {means['self_contact']}, friction of joints "
        f"{means['joint_friction']}, damping of joints {means['joint_damping']}; collisions take the most in "
        f"{int((collisions > 0.5).sum())} of {collisions.size} cells"
    )
    return Finding(text, share(int((collisions > 0.5).sum()), collisions.size))


def delay(numbers: Numbers) -> Finding:
    """Starting as an ellipse delays the loop's running into itself."""
    if "delay" not in numbers["paper_claims"]["starts"]:
        return NOT_RECORDED
    effect = part(effect_of(numbers["paper_claims"]["starts"]["delay"]), long_chains(numbers))
    found = summary(effect)
    text = (
        f"bounces before the first crease or touch, ellipse against rest, pairs in which both touch: {counted(effect)}"
    )
    return Finding(text, direction(found.rises, found.falls, found.cells))


def single_walks(numbers: Numbers) -> Finding:
    """Single walks differ by up to 10 % between the tolerances."""
    found = numbers["paper_tolerance"]["tolerance"]
    text = (
        f"median {percent(found['median'], sign=False)}, greatest {percent(found['greatest'], sign=False)}; "
        f"{found['within_a_tenth']} of {found['walks']} walks within 10 %"
    )
    return Finding(text, share(found["within_a_tenth"], found["walks"]))


def means(numbers: Numbers) -> Finding:
    """Means of 12 walks differ by less than a few per cent between the tolerances."""
    effect = effect_of(numbers["paper_tolerance"]["tolerance"]["means"])
    found, within = summary(effect), int((np.abs(effect.relative[effect.known]) <= UNSEEN).sum())
    greatest = float(np.abs(effect.relative[effect.known]).max(initial=0.0))
    text = (
        f"means of 12 by up to {percent(greatest, sign=False)}, within 5 % in {within} of {found.cells} cells; all "
        f"together {percent(found.mean, found.half_width)}, {found.rises + found.falls} cells differ significantly"
    )
    return Finding(text, share(within, found.cells))


def falling(name: str) -> Check:
    """Δx falls as a quantity grows."""

    def check(numbers: Numbers) -> Finding:
        return _monotonic(numbers, name, changes(numbers, name), -1)

    return check


def floor_friction(numbers: Numbers) -> Finding:
    """Δx falls as the friction of the floor grows: for all values, and for those beside Table 1's."""
    steps = changes(numbers, "floor_friction")
    reference = numbers["paper_claims"]["effects"]["floor_friction"]["reference"]
    beside = [end(v for v, _ in steps if (v > reference) is above) for end, above in ((max, False), (min, True))]
    every, near = (
        _monotonic(numbers, "floor_friction", chosen, -1)
        for chosen in (steps, [(value, effect) for value, effect in steps if value in beside])
    )
    counts = near.text.rpartition("; ")[2]
    text = f"{every.text}; at {beside[0]:g} and {beside[1]:g} alone {counts}"
    return Finding(text, together([every.verdict, near.verdict]))


def collapse(numbers: Numbers) -> Finding:
    """Longer links lose their loop after fewer bounces."""
    found = numbers["paper_claims"].get("collapse")
    if found is None:
        return NOT_RECORDED
    steps = [(each["value"], effect_of(each)) for each in found["values"]]
    bounced = _monotonic(numbers, "link_length", steps, -1, "bounces before the collapse")
    distances = (f"{value:g}: {percent(summary(effect).mean)}" for value, effect in changes(numbers, "link_length"))
    return Finding(f"{bounced.text}; Δx at {', '.join(distances)}", bounced.verdict)


def lost_on_floor(numbers: Numbers) -> Finding:
    """Less friction of the floor takes less energy in collisions with it."""
    found = numbers["paper_claims"]["lost_on_floor"]
    steps = [(each["value"], effect_of(each)) for each in found["values"]]
    return _monotonic(numbers, "floor_friction", steps, 1, "energy lost in collisions with the floor")


def _monotonic(
    numbers: Numbers, name: str, steps: Sequence[tuple[float, Effect]], slope: int, what: str = "Δx"
) -> Finding:
    """Whether a quantity has a slope: a greater value changes it one way, a smaller one the other."""
    reference = numbers["paper_claims"]["effects"][name]["reference"]
    agreeing = against = cells = 0
    texts = []
    for value, effect in steps:
        found, expected = summary(effect), slope if value > reference else -slope
        agreeing += found.rises if expected > 0 else found.falls
        against += found.falls if expected > 0 else found.rises
        cells += found.cells
        texts.append(f"{value:g}: {percent(found.mean, found.half_width)}")
    text = f"{what} at {'; '.join(texts)}; {agreeing} of {cells} comparisons as claimed, {against} the other way"
    return Finding(text, direction(agreeing, against, cells))


def small(names: Mapping[str, str], bound: float) -> Check:
    """Quantities have an effect smaller than a bound.

    Args:
        names: quantity → its symbol.
        bound: greatest relative effect.
    """

    def check(numbers: Numbers) -> Finding:
        texts, total, above = [], 0, 0
        for name, symbol in names.items():
            steps = changes(numbers, name)
            worst = max((summary(effect) for _, effect in steps), key=lambda found: abs(found.mean))
            texts.append(f"{symbol} {percent(worst.mean, worst.half_width)}")
            above += sum(exceeding(effect, bound) for _, effect in steps)
            total += sum(summary(effect).cells for _, effect in steps)
        text = f"means of all cells at most {', '.join(texts)}; more than {bound:.0%} in {above} of {total} comparisons"
        return Finding(text.replace("%", " %").replace("  %", " %"), smallness(above, total))

    return check


def spread(numbers: Numbers) -> Finding:
    """Drawing the release as well spreads Δx further."""
    found = {name: np.array(table, np.float64) for name, table in numbers["paper_claims"]["spread"].items()}
    middle = {name: percent(float(np.nanmedian(table)), sign=False) for name, table in found.items()}
    greater = int((found["both"] > found["parameters"]).sum())
    text = (
        f"standard deviation of a walk, median over the cells: {middle['both']} with all drawn, {middle['parameters']} "
        f"with Table 1's parameters alone, {middle['release']} with the release alone; greater with all in {greater} "
        f"of {found['both'].size} cells"
    )
    return Finding(text, share(greater, found["both"].size))


def waves(numbers: Numbers) -> Finding:
    """Waves influence the distance: from the pairs of walks of the study of waves, not from this page's sweeps.

    One drag, of one rate, cannot show more than a part of that.
    """
    with PAIRS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    changes = {
        name: [
            (float(row["change_percent"]), float(row["change_error_percent"])) for row in rows if row["variant"] == name
        ]
        for name in ("drag 50/s on waves of up to 24 links", "drag 50/s")
    }
    short, every = changes.values()
    known = sum(abs(change) > 1.96 * error for change, error in short)
    ends = [percent(end([change for change, _ in found]) / 100) for found in (short, every) for end in (min, max)]
    text = (
        f"with a drag of 50/s on fast waves of up to 24 links Δx changes by {ends[0]} to {ends[1]}, significantly in "
        f"{known} of {len(short)} cells; on all, long swings of the loop included, by {ends[2]} to {ends[3]}"
    )
    return Finding(text, together([share(known, len(short)), Verdict.DIFFERS]))


def stated(text: str, verdict: Verdict) -> Check:
    """What another page shows; nothing of this page's sweeps."""

    def check(numbers: Numbers) -> Finding:
        return Finding(text, verdict)

    return check


ADJUSTED: Final = {
    "joint_stiffness": "k",
    "joint_damping": "b",
    "friction_smoothing": "ω_c",
    "tangential_restitution": "e_t",
    "sprocket_restitution": "e_sc",
    "sprocket_friction": "μ_sc",
}
"""Table 1's adjusted parameters and their symbols."""

LITTLE_EFFECT: Final = small(ADJUSTED, LITTLE)
UNNOTICED_DAMPING: Final = small({"joint_damping": "b"}, UNSEEN)
NO_RESTITUTION: Final = small({"floor_restitution": "e_fc"}, UNSEEN)
MASSES: Final = small({"inner_mass": "m_inner", "outer_mass": "m_outer"}, UNSEEN)
INERTIAS: Final = small({"inner_inertia": "I_inner", "outer_inertia": "I_outer"}, UNSEEN)
