"""What came out for each claim of the paper, from the numbers of `studies.paper.reduction`.

A function takes the numbers of all sweeps, name → content, and gives a sentence with a verdict by the rules of
`studies.paper.verdicts`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from studies.common import read_rows
from studies.paper.reduction import effect_of
from studies.paper.statistics import Effect, exceeding, summary, within
from studies.paper.verdicts import Verdict, bounds, direction, share, smallness, together
from studies.waves import directions, doses

Numbers = Mapping[str, Any]

LONG: Final = 150
"""Chains of so many links or more are those that the paper's start from rest underestimates."""


@dataclass(frozen=True)
class Finding:
    """What came out, and what it says of the claim."""

    text: str
    verdict: Verdict
    is_typed: bool = False
    """Whether a person wrote it, from another page, or set its verdict."""


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
    every = count + without
    text = (
        f"medians of {count} loops that rise again: {', '.join(texts)}; within 10 % in "
        f"{', '.join(map(str, within))} of them; {without} of all {every} do not rise again, so of all "
        f"{', '.join(percent(each / every, sign=False) for each in within)} keep them"
    )
    return Finding(text, together([share(each, total) for each in within for total in (count, every)]))


def speed(numbers: Numbers) -> Finding:
    """The speed along a loop that rises again falls slightly in the first impact."""
    found = numbers["paper_shapes"]["impacts"]
    of_walks, count, without = found["speed_of_walks"], found["walks"], found["without"]
    low, median, high = (percent(each) for each in of_walks["quantiles"])
    slightly = of_walks["falls_by_less_than_a_fifth"]
    text = (
        f"median {median}, {low} to {high} in nine of ten loops that rise again; falls by up to 20 % in {slightly} of "
        f"{count}, rises in {count - of_walks['falls']}; {without} more do not rise again: slightly in "
        f"{percent(slightly / (count + without), sign=False)} of all"
    )
    return Finding(text, together([share(slightly, total) for total in (count, count + without)]))


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
    within = int((relative <= bounds().moderate).sum())
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


def _by_links(numbers: Numbers, start: str) -> list[Any]:
    """What happens to loops, of each number of links of the long chains."""
    return numbers["paper_strands"]["strands"]["starts"][start][long_chains(numbers)]


def self_collision(numbers: Numbers) -> Finding:
    """Strands of long chains from rest meet right after their second collision with the floor."""
    found = _by_links(numbers, "rest")
    met, crease = (np.sum([each[event] for each in found], axis=0) for event in ("strands", "crease"))
    first, second, third, later = (percent(each, sign=False) for each in met[1:5] / met.sum())
    most = [bounce for each in found for bounce in each["most_frequent"]]
    text = (
        f"strands of 150 and 180 links from rest first meet after the first collision in {first} of the walks, after "
        f"the second in {second}, the third in {third}, later in {later}; after the second most often in "
        f"{most.count(2)} of {len(most)} cells. They first crease after the first collision in "
        f"{percent(crease[1] / crease.sum(), sign=False)}"
    )
    return Finding(text, share(most.count(2), len(most)))


def cause(numbers: Numbers) -> Finding:
    """Long chains whose links pass through one another walk further, and nearly as far as an ellipse."""
    rest, control = (
        summary(effect_of(numbers[name]["through"])) for name in ("paper_through", "paper_through_ellipse")
    )
    further = part(_ellipse(numbers), long_chains(numbers))
    gap, tried = summary(further).mean, numbers["paper_through"]["cells"]["frequency"]
    there = further.relative[:, np.isin(numbers["paper_claims"]["cells"]["frequency"], tried)]
    band = f"{tried[0]:g} to {tried[-1]:g} Hz"
    early = [
        f"{links} links {percent(float(effect.relative), float(effect.half_width))}"
        for links, effect in (
            (links, effect_of(each["early_over_late"]))
            for links, each in zip(
                numbers["paper_strands"]["cells"]["links"],
                numbers["paper_strands"]["strands"]["starts"]["rest"],
                strict=True,
            )
            if "early_over_late" in each and links >= LONG - 30
        )
    ]
    text = (
        f"with links that pass through one another 150 and 180 links walk {percent(rest.mean, rest.half_width)} "
        f"further from the sprocket, in {rest.rises} of {rest.cells} cells ({band}), as an ellipse "
        f"{percent(control.mean, control.half_width)}; an ellipse walks {percent(gap, sign=False)} further than loops "
        f"from rest, {percent(float(there.mean()), sign=False)} at {band}; "
        f"within a cell, strands met by the second bounce against later: {', '.join(early)}"
    )
    closes = Verdict.AGREES if rest.mean - control.mean >= bounds().most * gap else Verdict.PART
    return Finding(text, together([direction(rest.rises, rest.falls, rest.cells), closes]))


def losses(numbers: Numbers) -> Finding:
    """A chain loses most of its energy in collisions."""
    found, ellipse = (_losses(numbers, start) for start in ("rest", "ellipse"))
    collisions = found["floor"] + found["self_contact"]
    damped, as_ellipse = (
        int((each["floor"] + each["self_contact"] + each["joint_damping"] > each["joint_friction"]).sum())
        for each in (found, ellipse)
    )
    means = {name: percent(float(np.nanmean(each)), sign=False) for name, each in found.items()}
    text = (
        f"from the release to rest: floor {means['floor']}, self-contacts {means['self_contact']}, friction of joints "
        f"{means['joint_friction']}, damping of joints {means['joint_damping']}; collisions take more than half in "
        f"{int((collisions > 0.5).sum())} of {collisions.size} cells, with damping of the joints more than friction of "
        f"the joints in {damped} (as an ellipse {as_ellipse})"
    )
    return Finding(text, share(int((collisions > 0.5).sum()), collisions.size))


def _losses(numbers: Numbers, start: str) -> dict[str, np.ndarray]:
    """Shares of the energy at the release that each loss takes, (links, frequencies)."""
    tables = numbers["paper_claims"]["starts"][start]["losses"]
    return {name: np.array(each, np.float64) for name, each in tables.items()}


def delay(numbers: Numbers) -> Finding:
    """Starting as an ellipse delays the meeting of the loop's strands."""
    effect = part(effect_of(numbers["paper_strands"]["strands"]["delay"]), long_chains(numbers))
    found = summary(effect)
    fast = np.array(numbers["paper_claims"]["cells"]["frequency"]) > 20
    slower = effect.relative[:, ~fast]
    text = (
        f"bounces before strands meet, ellipse against rest, pairs in which they do: {counted(effect)}; "
        f"25 and 30 Hz carry it, from 5 to 20 Hz it is {percent(slower.min())} to {percent(slower.max())} in a cell"
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
    found, within = summary(effect), int((np.abs(effect.relative[effect.known]) <= bounds().unseen).sum())
    greatest = float(np.abs(effect.relative[effect.known]).max(initial=0.0))
    text = (
        f"means of 12 by up to {percent(greatest, sign=False)}, within 5 % in {within} of {found.cells} cells; all "
        f"together {percent(found.mean, found.half_width)}, {found.rises + found.falls} cells differ significantly"
    )
    return Finding(text, share(within, found.cells))


def falling(name: str) -> Check:
    """Δx falls as a quantity grows."""

    def check(numbers: Numbers) -> Finding:
        return monotonic(numbers, name, changes(numbers, name), -1)

    return check


def floor_friction(numbers: Numbers) -> Finding:
    """Δx falls as the friction of the floor grows: for all values, and for those beside Table 1's."""
    steps = changes(numbers, "floor_friction")
    reference = numbers["paper_claims"]["effects"]["floor_friction"]["reference"]
    beside = [end(v for v, _ in steps if (v > reference) is above) for end, above in ((max, False), (min, True))]
    every, near = (
        monotonic(numbers, "floor_friction", chosen, -1)
        for chosen in (steps, [(value, effect) for value, effect in steps if value in beside])
    )
    counts = near.text.rpartition("; ")[2]
    text = f"{every.text}, by which alone it {every.verdict}; at {beside[0]:g} and {beside[1]:g} alone {counts}"
    return Finding(text, together([every.verdict, near.verdict]))


def collapse(numbers: Numbers) -> Finding:
    """Longer links lose their loop after fewer bounces."""
    found = numbers["paper_claims"]["collapse"]
    steps = [(each["value"], effect_of(each)) for each in found["values"]]
    bounced = monotonic(numbers, "link_length", steps, -1, "bounces before the collapse")
    distances = (f"{value:g}: {percent(summary(effect).mean)}" for value, effect in changes(numbers, "link_length"))
    return Finding(f"{bounced.text}; Δx at {', '.join(distances)}", bounced.verdict)


def lost_on_floor(numbers: Numbers) -> Finding:
    """Less friction of the floor takes less energy in collisions with it."""
    found = numbers["paper_claims"]["lost_on_floor"]
    steps = [(each["value"], effect_of(each)) for each in found["values"]]
    return monotonic(numbers, "floor_friction", steps, 1, "energy lost in collisions with the floor")


def monotonic(
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


def small(names: Mapping[str, str], kind: str) -> Check:
    """Quantities have an effect smaller than a bound.

    Args:
        names: quantity → its symbol.
        kind: of bound, as `verdicts.Bounds` has it.
    """

    def check(numbers: Numbers) -> Finding:
        texts, total, above, inside, bound = [], 0, 0, 0, getattr(bounds(), kind)
        for name, symbol in names.items():
            steps = changes(numbers, name)
            worst = max((summary(effect) for _, effect in steps), key=lambda found: abs(found.mean))
            texts.append(f"{symbol} {percent(worst.mean, worst.half_width)}")
            above += sum(exceeding(effect, bound) for _, effect in steps)
            inside += sum(within(effect, bound) for _, effect in steps)
            total += sum(summary(effect).cells for _, effect in steps)
        text = (
            f"means of all cells at most {', '.join(texts)}; more than {bound:.0%} in {above} of {total} comparisons; "
            f"shown to be within {bound:.0%} in {inside}"
        )
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
    """Short fast waves influence the distance: from the drags of the study of waves, not from this page's sweeps.

    Its verdict is set by hand: a drag shows an effect, a small one.
    """
    rows = read_rows(doses.RESULTS)
    gentle, strong = (doses.changes(rows, "in flight", rate) for rate in (50.0, 250.0))
    always = doses.changes(rows, "always", 50.0)
    known = [int(np.sum(np.abs(values) > 1.96 * errors)) for values, errors in (gentle, strong, always)]
    nothing, scatter = doses.changes(rows, "always", 1e-9)
    beyond = int(np.sum(np.abs(gentle[0] - nothing) > 1.96 * np.hypot(gentle[1], scatter)))
    ends = [f"{percent(values.min() / 100)} to {percent(values.max() / 100)}" for values, _ in (gentle, strong, always)]
    count, waves = len(gentle[0]), read_rows(directions.RESULTS)
    given = [directions.mean_of_cells(*directions.changes(waves, way, 0.05)[:2]) for way in ("fast", "slow")]
    text = (
        f"a drag of 50/s on fast waves of up to 24 links, in flight alone, changes Δx by {ends[0]}, significantly in "
        f"{known[0]} of {count} cells ({beyond} against a drag of 1e-9/s); "
        f"250/s by {ends[1]}, {known[1]} cells; 50/s in impacts as well by {ends[2]}, "
        f"{known[2]} cells; waves of 12 links and 0.05 rad given at the release change it by {given[0]} on average if "
        f"they are fast, by {given[1]} if slow"
    )
    return Finding(text, Verdict.PART, is_typed=True)


def stated(text: str, verdict: Verdict) -> Check:
    """What another page shows; nothing of this page's sweeps."""

    def check(numbers: Numbers) -> Finding:
        return Finding(text, verdict, is_typed=True)

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

LITTLE_EFFECT: Final = small(ADJUSTED, "little")
UNNOTICED_DAMPING: Final = small({"joint_damping": "b"}, "unseen")
NO_RESTITUTION: Final = small({"floor_restitution": "e_fc"}, "unseen")
MASSES: Final = small({"inner_mass": "m_inner", "outer_mass": "m_outer"}, "unseen")
INERTIAS: Final = small({"inner_inertia": "I_inner", "outer_inertia": "I_outer"}, "unseen")
