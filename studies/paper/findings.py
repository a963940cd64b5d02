"""What came out for each claim of the paper, from the numbers of `studies.paper.reduction`.

A function takes the numbers of all sweeps, name → content. It gives a verdict by the rules of `studies.paper.verdicts`
and, by name, what the words of the claim in claims.yaml need.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from studies.common import minus
from studies.paper import figure5
from studies.paper.statistics import Effect, percent, plain
from studies.paper.verdicts import BOUNDS, Verdict, direction, share, together
from studies.waves import directions, doses
from warpchain import Parameters

Numbers = Mapping[str, Any]
Found = tuple[Verdict, Mapping[str, object]]
Check = Callable[[Numbers], Found]

LONG = 150  # Chains of so many links or more are those that the paper's start from rest underestimates


def of_start(numbers: Numbers, start: str, name: str) -> Any:
    """Numbers of chains that began so."""
    return numbers["paper_claims"]["starts"][start][name]


def long_chains(numbers: Numbers) -> slice:
    """Rows of the cells with `LONG` links or more."""
    links = numbers["paper_claims"]["cells"]["links"]
    return slice(next(place for place, each in enumerate(links) if each >= LONG), None)


def effects(numbers: Numbers) -> dict[str, Any]:
    """Effects of quantities by name, with Table 1's joints last."""
    return {**numbers["paper_claims"]["effects"], **numbers["paper_joints"]["effects"]}


def ellipse(numbers: Numbers) -> Effect:
    """What an ellipse does to Δx of long chains, in place of a start from rest."""
    values = effects(numbers)["start"]["values"]
    return next(each for each in values if each.notes["value"] == "ellipse")[long_chains(numbers)]


def rising(effect: Effect, **words: object) -> Found:
    """A claim that an effect is a rise; its words, and the effect as `found`."""
    return direction(effect.rises, effect.falls, effect.count), {**words, "found": effect}


def bounces(numbers: Numbers) -> Found:
    """Chains bounce."""
    table = of_start(numbers, "rest", "bounces")
    several = int((table >= 2).sum())
    found = {"least": np.nanmin(table), "most": np.nanmax(table), "several": several, "cells": table.size}
    return share(several, table.size), found


def velocities(_: Numbers) -> Found:
    """Height and v_x of a walk look as in Figure 5: the chain bounces again, and v_x does not reverse."""
    bounces_again, is_forward = figure5.shapes()
    again, cells, back = int(bounces_again.sum()), len(is_forward), int((~is_forward).sum())
    return share(int((bounces_again & is_forward).sum()), cells), {"again": again, "cells": cells, "back": back}


def shape(numbers: Numbers) -> Found:
    """A loop that rises again keeps its shape in its first impact."""
    found = numbers["paper_shapes"]["impacts"]
    kept = {name: found[f"{name}_of_walks"] for name in ("area", "height", "width")}
    inside, count, without = [each["within_a_tenth"] for each in kept.values()], found["walks"], found["without"]
    medians = (f"{name} {percent(each['quantiles'][1])}" for name, each in kept.items())
    words = {"walks": count, "medians": ", ".join(medians), "inside": ", ".join(map(str, inside)), "without": without}
    words |= {"every": count + without, "of_all": ", ".join(plain(each / (count + without)) for each in inside)}
    return together(*(share(each, total) for each in inside for total in (count, count + without))), words


def speed(numbers: Numbers) -> Found:
    """The speed along a loop that rises again falls slightly in the first impact."""
    found = numbers["paper_shapes"]["impacts"]
    of_walks, count, without = found["speed_of_walks"], found["walks"], found["without"]
    slightly = of_walks["falls_by_less_than_a_fifth"]
    words = dict(zip(("low", "median", "high"), map(percent, of_walks["quantiles"]), strict=True))
    words |= {"slightly": slightly, "walks": count, "without": without}
    words |= {"rises": count - of_walks["falls"], "of_all": plain(slightly / (count + without))}
    return together(share(slightly, count), share(slightly, count + without)), words


def faster(numbers: Numbers) -> Found:
    """Δx rises with the frequency."""
    return rising(of_start(numbers, "rest", "faster"))


def longer(numbers: Numbers) -> Found:
    """Δx falls with the number of links."""
    found, ellipses = (of_start(numbers, start, "longer") for start in ("rest", "ellipse"))
    return direction(found.falls, found.rises, found.count), {"found": found, "ellipses": ellipses}


def moderate(numbers: Numbers) -> Found:
    """Δx varies only moderately while links and frequency stay."""
    relative = of_start(numbers, "rest", "sd") / of_start(numbers, "rest", "mean")
    words = dict(zip(("least", "median", "most"), map(plain, np.nanquantile(relative, [0, 0.5, 1])), strict=True))
    return share(int((relative <= BOUNDS.moderate).sum()), relative.size), words


def underestimate(numbers: Numbers) -> Found:
    """From rest, long chains walk less far than as an ellipse."""
    return rising(ellipse(numbers), ratio=1 + ellipse(numbers).cells.mean)


def self_collision(numbers: Numbers) -> Found:
    """Strands of long chains from rest meet right after their second collision with the floor."""
    found = numbers["paper_strands"]["strands"]["starts"]["rest"][long_chains(numbers)]
    met, crease = (np.sum([each[event] for each in found], axis=0) for event in ("strands", "crease"))
    words = dict(zip(("first", "second", "third", "later"), map(plain, met[1:5] / met.sum()), strict=True))
    most = [bounce for each in found for bounce in each["most_frequent"]]
    words |= {"crease": plain(crease[1] / crease.sum()), "twos": most.count(2), "cells": len(most)}
    return share(most.count(2), len(most)), words


def cause(numbers: Numbers) -> Found:
    """Long chains whose links pass through one another walk further, and nearly as far as an ellipse."""
    rest, control = (numbers[name]["through"] for name in ("paper_through", "paper_through_ellipse"))
    further, tried = ellipse(numbers), numbers["paper_through"]["cells"]["frequency"]
    there = further.relative[:, np.isin(numbers["paper_claims"]["cells"]["frequency"], tried)]
    content = numbers["paper_strands"]
    early = [
        f"{links} links {each['early_over_late']}"
        for links, each in zip(content["cells"]["links"], content["strands"]["starts"]["rest"], strict=True)
        if "early_over_late" in each and links >= LONG - 30
    ]
    verdict, words = rising(
        rest,
        rest=rest,
        control=control,
        further=plain(further.cells.mean),
        early=", ".join(early),
        band=f"{tried[0]:g} to {tried[-1]:g} Hz",
        there=plain(there.mean()),
    )
    is_closed = rest.cells.mean - control.cells.mean >= BOUNDS.most * further.cells.mean
    return together(verdict, Verdict.AGREES if is_closed else Verdict.PART), words


def losses(numbers: Numbers) -> Found:
    """A chain loses most of its energy in collisions."""
    found, as_ellipse = (of_start(numbers, start, "losses") for start in ("rest", "ellipse"))
    most = int((found["floor"] + found["self_contact"] > 0.5).sum())
    damped = [
        int((each["floor"] + each["self_contact"] + each["joint_damping"] > each["joint_friction"]).sum())
        for each in (found, as_ellipse)
    ]
    words = {name: plain(np.nanmean(each)) for name, each in found.items()}
    words |= {"most": most, "cells": found["floor"].size, "damped": damped}
    return share(most, found["floor"].size), words


def delay(numbers: Numbers) -> Found:
    """Starting as an ellipse delays the meeting of the loop's strands."""
    found = numbers["paper_strands"]["strands"]["delay"][long_chains(numbers)]
    slower = found.relative[:, np.array(numbers["paper_claims"]["cells"]["frequency"]) <= 20]
    return rising(found, mean=found, least=percent(slower.min()), most=percent(slower.max()))


def single_walks(numbers: Numbers) -> Found:
    """Single walks differ by up to 10 % between the tolerances."""
    found = numbers["paper_tolerance"]["tolerance"]
    words = {**found, "median": plain(found["median"]), "greatest": plain(found["greatest"])}
    return share(found["within_a_tenth"], found["walks"]), words


def means(numbers: Numbers) -> Found:
    """Means of 12 walks differ by less than a few per cent between the tolerances."""
    effect = numbers["paper_tolerance"]["tolerance"]["means"]
    off = np.abs(effect.relative[effect.known])
    inside = int((off <= BOUNDS.unseen).sum())
    words = {"greatest": plain(off.max(initial=0.0)), "inside": inside, "found": effect, "mean": effect}
    return share(inside, effect.count), words | {"significant": effect.rises + effect.falls}


def falling(name: str) -> Check:
    """Δx falls as a quantity grows."""
    return lambda numbers: monotonic(numbers, name, effects(numbers)[name]["values"], -1)


def floor_friction(numbers: Numbers) -> Found:
    """Δx falls as the friction of the floor grows: for all values, and for those beside Table 1's."""
    content = effects(numbers)["floor_friction"]
    known = {effect.notes["value"]: effect for effect in content["values"]}
    below = max(value for value in known if value < content["reference"])
    above = min(value for value in known if value > content["reference"])
    (first, words), (second, beside) = (
        monotonic(numbers, "floor_friction", each, -1) for each in (content["values"], [known[below], known[above]])
    )
    words = {**words, "verdict": first, "below": below, "above": above, "near": beside["counts"]}
    return together(first, second), words


def collapse(numbers: Numbers) -> Found:
    """Longer links lose their loop after fewer bounces."""
    return monotonic(numbers, "link_length", numbers["paper_claims"]["collapse"]["values"], -1)


def lost_on_floor(numbers: Numbers) -> Found:
    """Less friction of the floor takes less energy in collisions with it."""
    return monotonic(numbers, "floor_friction", numbers["paper_claims"]["lost_on_floor"]["values"], 1)


def sliding(numbers: Numbers) -> Found:
    """Less friction of the floor lets a chain slide for longer after its collapse."""
    return monotonic(numbers, "floor_friction", numbers["paper_more"]["sliding"], -1)


def monotonic(numbers: Numbers, name: str, values: Sequence[Effect], slope: int) -> Found:
    """Whether a quantity has a slope: a greater value changes it one way, a smaller one the other."""
    reference = numbers["paper_claims"]["effects"][name]["reference"]
    known = {effect.notes["value"]: effect for effect in values}
    ways = [(each.rises, each.falls)[:: slope if value > reference else -slope] for value, each in known.items()]
    agreeing, against = (sum(way) for way in zip(*ways, strict=True))
    cells = sum(effect.count for effect in values)
    counts = f"{agreeing} of {cells} comparisons as claimed, {against} the other way"
    texts = "; ".join(f"{value:g}: {effect}" for value, effect in known.items())
    return direction(agreeing, against, cells), {"steps": texts, "counts": counts}


def small(kind_and_names: str) -> Check:
    """Quantities, given after the kind of bound that `verdicts.Bounds` has, have an effect smaller than it."""
    kind, *names = kind_and_names.split()

    def check(numbers: Numbers) -> Found:
        bound, known = getattr(BOUNDS, kind), {name: effects(numbers)[name]["values"] for name in names}
        every = [effect for found in known.values() for effect in found]
        _, name, greatest = max((abs(each.cells.mean), name, str(each)) for name in names for each in known[name])
        sizes = np.abs(np.concatenate([effect.relative[effect.known] for effect in every]))
        widths = np.concatenate([effect.half_width[effect.known] for effect in every])
        above, inside = int(np.sum(sizes - widths > bound)), int(np.sum(sizes + widths <= bound))
        words = {"bound": 100 * bound, "above": above, "inside": inside, "total": len(sizes)}
        words |= {"most": f"{greatest} ({Parameters.quantities()[name].symbol})", "cell": plain(sizes.max())}
        return share(len(sizes) - above, len(sizes)), words

    return check


def spread(numbers: Numbers) -> Found:
    """Drawing the release as well spreads Δx further."""
    found = numbers["paper_claims"]["spread"]
    greater = int((found["both"] > found["parameters"]).sum())
    words = {name: plain(np.nanmedian(table)) for name, table in found.items()}
    return share(greater, found["both"].size), words | {"greater": greater, "cells": found["both"].size}


def waves(numbers: Numbers) -> Found:
    """Short fast waves influence the distance: from drags of another page; set by hand, for the effect is small."""
    drags = [doses.changes(*drag) for drag in (("in flight", 50.0), ("in flight", 250.0), ("always", 50.0))]
    (values, errors), (nothing, scatter) = drags[0], doses.changes("always", 1e-9)
    words: dict[str, object] = {"cells": len(values)}
    words["known"] = [int(np.sum(np.abs(each) > 1.96 * error)) for each, error in drags]
    words["ends"] = [f"{percent(each.min() / 100)} to {percent(each.max() / 100)}" for each, _ in drags]
    words["beyond"] = int(np.sum(np.abs(values - nothing) > 1.96 * np.hypot(errors, scatter)))
    words |= {way: minus(directions.change(way, 0.05).text()) for way in ("fast", "slow")}
    return Verdict.PART, words


def gradual(numbers: Numbers) -> Found:
    """A loop loses its shape gradually: nine of ten take longer than an impact lasts."""
    found = numbers["paper_strands"]["strands"]["loss_of_shape"]["rest"]
    low, median, high = found["seconds"]
    impact = np.nanmedian(numbers["paper_shapes"]["impacts"]["duration"])
    words = {"low": low, "median": median, "high": high, "of_walk": plain(found["of_the_walk"][1]), "impact": impact}
    return Verdict.AGREES if low > impact else Verdict.PART if median > impact else Verdict.DIFFERS, words


def nonlinear(numbers: Numbers) -> Found:
    """Linear propagation of the uncertainties fails: linear terms explain less than half of the variance in a cell."""
    words, fails = {}, []
    for start, found in numbers["paper_footnote"]["nonlinear"].items():
        shares = {name: np.maximum(each, 0.0) for name, each in found.items()}
        linear = shares["linear"]
        words[start] = {name: plain(np.median(each)) for name, each in shares.items()}
        words[start] |= {"least": plain(linear.min()), "most": plain(linear.max())}
        fails.append(share(int((linear < BOUNDS.most).sum()), linear.size))
    return together(*fails), words


def same_distributions(numbers: Numbers) -> Found:
    """Δx is distributed alike at both tolerances."""
    found = numbers["paper_distributions"]["distributions"]
    alike, least = sum(each["p"] > 0.05 for each in found), min(each["p"] for each in found)
    cells = ", ".join(f"{each['links']} × {each['frequency']:g} Hz" for each in found)
    words = {"alike": alike, "count": len(found), "cells": cells, "walks": found[0]["walks"], "least": least}
    return share(alike, len(found)), words
