"""Numbers of further sweeps: strands, what the paper leaves open, rest against long holds, its last sentences."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, ks_2samp

from studies.paper.statistics import Effect, mean, paired, spread, standard_error, unpaired
from warpchain import Status

Array = NDArray[np.float64]
Numbers = dict[str, Any]
Block = Any

EVENTS: Final = {
    "crease": "bounces_before_self_contact",
    "strands": "bounces_before_strands_met",
    "collapse": "bounces_before_collapse",
}
"""What happens to a loop: name → column with the number of bounces begun before it, −1 if it never does."""
CELLS: Final = ("links", "frequency")


def at_rest(block: Block, quantity: str = "dx") -> Array:
    """A column with the cells in front and the samples behind, NaN for walks that did not come to rest."""
    order = [block.dims.index(name) for name in CELLS]
    others = [number for number in range(len(block.dims)) if number not in order]
    values = np.where(block.columns["status"] == Status.AT_REST, block.columns[quantity], np.nan)
    return np.transpose(values, order + others)


def plain(effect: Effect) -> Numbers:
    """An effect as plain numbers."""
    return {name: np.asarray(values).tolist() for name, values in vars(effect).items()}


# --- when strands meet ---


def endings_by_links(block: Block, start: int) -> list[Numbers]:
    """Of each number of links: after how many bounces loops crease, their strands meet, they collapse; early over late.

    Early is a walk whose strands met before its third bounce; walks are taken relative to the means of their cells.
    """
    counts = {event: at_rest(block, column)[:, :, start] for event, column in EVENTS.items()}
    distance = at_rest(block)[:, :, start]
    relative = distance / mean(distance)[..., np.newaxis]
    found = []
    for links in range(len(distance)):
        there = {event: values[links] for event, values in counts.items()}
        content: Numbers = {event: histogram(values) for event, values in there.items()}
        met = there["strands"]
        early = (met >= 0) & (met <= 2)
        both = [relative[links][np.isfinite(relative[links]) & chosen] for chosen in (early, ~early)]
        content |= {"early": len(both[0]), "late": len(both[1])}
        if min(map(len, both)) > 1:
            content["early_over_late"] = plain(unpaired(*both))
        second = [float((cell[np.isfinite(cell)] == 2).mean()) for cell in met]
        content["second_by_cell"] = second
        content["most_frequent"] = [histogram(cell).index(max(histogram(cell))) for cell in met]
        found.append(content)
    return found


def histogram(bounces: Array) -> list[int]:
    """Numbers of walks with 0, 1, 2, 3 and more bounces before an event, and of those without the event."""
    known = bounces[np.isfinite(bounces)]
    counts = [int((known == number).sum()) for number in range(4)]
    return [*counts, int((known > 3).sum()), int((known < 0).sum())]


def strands(block: Block) -> Numbers:
    """When loops crease, their strands meet and they collapse, by start; how gradually they lose their area."""
    values = block.axes["start"].tolist()
    met = np.where((counts := at_rest(block, EVENTS["strands"])) < 0, np.nan, counts)
    begin, end = (at_rest(block, name) for name in ("softened_at", "collapsed_at"))
    lasts = end - begin
    duration = at_rest(block, "walk_time")
    return {
        "starts": {start: endings_by_links(block, number) for number, start in enumerate(values)},
        "delay": plain(paired(met[:, :, values.index("ellipse")], met[:, :, values.index("rest")])),
        "loss_of_shape": {
            start: {
                "seconds": np.nanquantile(lasts[:, :, number], [0.1, 0.5, 0.9]).tolist(),
                "of_the_walk": np.nanquantile((lasts / duration)[:, :, number], [0.1, 0.5, 0.9]).tolist(),
            }
            for number, start in enumerate(values)
        },
    }


# --- linear or not ---

DRAWN: Final = "_drawn"
"""End of the names of columns with what a sample has drawn."""


def nonlinear(block: Block) -> Numbers:
    """Shares of the variance of Δx in each cell: of linear and further terms of what is drawn, and of all but chaos.

    Terms are fitted cell by cell. What two walks of a sample share that differ in their tolerance only, is not chaos.
    """
    starts, tolerances = (block.axes[name].tolist() for name in ("start", "tolerance"))
    loose, tight = tolerances.index(max(tolerances)), tolerances.index(min(tolerances))
    distance = at_rest(block)
    names = [name for name in block.columns if name.endswith(DRAWN)]
    drawn = {name: at_rest(block, name)[..., loose, :] for name in names}
    found: Numbers = {}
    for number, start in enumerate(starts):
        one, two = (distance[:, :, number, which] for which in (loose, tight))
        shares: dict[str, Array] = {}
        for place in np.ndindex(one.shape[:2]):
            kept = np.isfinite(one[place]) & np.isfinite(two[place])
            columns = {name: values[(*place, number)][kept] for name, values in drawn.items()}
            shape = one.shape[:2]
            known = {name: values for name, values in columns.items() if values.std() > 0}
            linear = [(values - values.mean()) / values.std() for values in known.values()]
            turning = [f(2 * np.pi * known[f"phase{DRAWN}"]) for f in (np.sin, np.cos)]
            products = [one * two for k, one in enumerate(linear) for two in linear[: k + 1]]
            for name, terms in (
                ("linear", linear),
                ("squares", linear + turning + [each**2 for each in linear]),
                ("products", linear + turning + products),
            ):
                shares.setdefault(name, np.empty(shape))[place] = explained(one[place][kept], terms)
            shared = np.corrcoef(one[place][kept], two[place][kept])[0, 1]
            shares.setdefault("repeated", np.empty(shape))[place] = shared
        found[start] = {name: values.tolist() for name, values in shares.items()}
    return found


def explained(values: Array, terms: list[Array]) -> float:
    """Share of the variance of values (samples,) that terms explain, less what as many terms of noise would."""
    design = np.stack([np.ones(len(values)), *terms], axis=-1)
    weights, _, rank, _ = np.linalg.lstsq(design, values, rcond=None)
    left = np.sum((values - design @ weights) ** 2) / (len(values) - rank)
    return float(1 - left / values.var(ddof=1))


def loops(block: Block) -> Numbers:
    """Height of the sprocket over the floor [µm] and kinetic energy [µJ] at the release, means over the phases."""
    further = [name for name in ("start", "further_hold") if name in block.dims]
    order = [block.dims.index(name) for name in (*CELLS, *further)]
    others = [number for number in range(len(block.dims)) if number not in order]
    found: Numbers = {name: block.axes[name].tolist() for name in further}
    for name, column in (("height", "sprocket_height"), ("energy", "energy_kinetic_at_release")):
        values = np.transpose(block.columns[column], order + others)
        found[name] = np.rint(1e6 * values.mean(axis=tuple(range(len(order), values.ndim)))).astype(int).tolist()
    return found


def same_loops(block: Block) -> Numbers:
    """Loops at their release, from rest less spinning, pairs of samples: height and place [µm], energy, relative."""
    order = [block.dims.index(name) for name in (*CELLS, "start", "sample")]
    rest, spinning = (block.axes["start"].tolist().index(name) for name in ("rest", "spinning"))
    places = np.empty(block.columns["status"].shape)
    for at in np.ndindex(places.shape):
        places[at] = block.walk_motion(at).center[0, 0]
    height, energy = (block.columns[name] for name in ("sprocket_height", "energy_kinetic_at_release"))
    found = {}
    for name, values, unit in (("height", height, 1e6), ("place", places, 1e6), ("energy", energy, 1.0)):
        table = np.transpose(values, order)
        change = table[:, :, rest] - table[:, :, spinning]
        change = (change / table[:, :, spinning] if name == "energy" else unit * change).ravel()
        found[name] = [float(each) for each in (change.mean(), change.std(ddof=1), np.abs(change).max())]
    return found | {"pairs": int(change.size)}


# --- links that pass through one another ---


def through(block: Block) -> Numbers:
    """What it does to Δx if links pass through one another, cell by cell."""
    table = at_rest(block)
    touching = block.axes["self_contact"].tolist()
    on, off = touching.index(True), touching.index(False)
    return plain(paired(table[:, :, off], table[:, :, on]))


# --- what the paper leaves open ---

REFERENCES: Final = {
    "sprocket_radius_is": "contact",
    "circle_radius": 4.2e-3,
    "clearance": 0.01,
    "clearance_of": "spinning",
    "phase": 0.0,
    "ellipse_aspect": 1.5,
}
"""What is chosen here."""


def left_open(blocks: Mapping[str, Block]) -> Numbers:
    """What each other choice does to Δx, cell by cell, beside the spread of a walk."""
    found: Numbers = {}
    for block in blocks.values():
        (name,) = (axis for axis in block.axes if axis not in CELLS)
        table, values = at_rest(block), block.axes[name].tolist()
        here = values.index(REFERENCES[name])
        found[name] = {
            "reference": REFERENCES[name],
            "spread": float(np.nanmedian(spread(table[:, :, here]))),
            "values": [
                {"value": value, **plain(paired(table[:, :, number], table[:, :, here]))}
                for number, value in enumerate(values)
                if number != here
            ],
        }
    return found


# --- from rest and after a long hold ---


def rest_and_hold(block: Block) -> Numbers:
    """Differences of Δx between starts, and between holds, over the cells, with χ² of no difference at all."""
    table = at_rest(block)
    starts, holds = (block.axes[name].tolist() for name in ("start", "further_hold"))
    order = [name for name in block.dims if name not in CELLS][:2]
    if order != ["start", "further_hold"]:
        raise ValueError(f"axes are {order}; the sweep has start and further_hold")
    rest, spinning = starts.index("rest"), starts.index("spinning")
    least, most = int(np.argmin(holds)), int(np.argmax(holds))
    pairs = {
        f"rest, at once, over spinning, {holds[most]:g} s later": (
            table[:, :, rest, least],
            table[:, :, spinning, most],
        ),
        "rest over spinning, released at once": (table[:, :, rest, least], table[:, :, spinning, least]),
        f"rest over spinning, both {holds[most]:g} s later": (table[:, :, rest, most], table[:, :, spinning, most]),
        f"{holds[most]:g} s later over at once, rest": (table[:, :, rest, most], table[:, :, rest, least]),
        f"{holds[most]:g} s later over at once, spinning": (table[:, :, spinning, most], table[:, :, spinning, least]),
    }
    return {name: compared(paired(*each)) for name, each in pairs.items()}


def compared(effect: Effect) -> Numbers:
    """Mean of the relative effects over the cells with its standard error, and χ² of no effect in any cell."""
    known = effect.known
    error = standard_error(effect)[known]
    relative = effect.relative[known]
    value = float(np.sum((relative / error) ** 2))
    return {
        **plain(effect),
        "mean": float(relative.mean()),
        "error": float(np.sqrt(np.sum(error**2)) / len(error)),
        "chi2": value,
        "cells": len(relative),
        "p": float(chi2.sf(value, len(relative))),
    }


# --- further sentences ---

FRICTION: Final = 0.27
"""Of the floor, in Table 1."""
OWN_LENGTH: Final = "links_of_12_7_mm"
LENGTHS: Final = {"links_of_11_mm": 11.0, "links_of_15_mm": 15.0, "links_of_18_mm": 18.0}
"""Blocks with links of other lengths [mm], with the masses and inertias of their length."""


def more(blocks: Mapping[str, Block]) -> Numbers:
    """Longer links of their mass, sliding with less friction, undamped joints, distributions at both tolerances."""
    content: Numbers = {"lengths": {}, "sliding": {}, "undamped": {}}
    for quantity in ("dx", "until_collapse"):
        own = until_collapse(blocks[OWN_LENGTH]) if quantity != "dx" else at_rest(blocks[OWN_LENGTH])
        for name, length in LENGTHS.items():
            other = until_collapse(blocks[name]) if quantity != "dx" else at_rest(blocks[name])
            content["lengths"].setdefault(f"{length:g}", {})[quantity] = plain(unpaired(other, own))
    block = blocks["sliding"]
    values = block.axes["floor_friction"].tolist()
    slid = at_rest(block, "walk_time") - at_rest(block, "collapsed_at")
    for number, value in enumerate(values):
        if value != FRICTION:
            content["sliding"][f"{value:g}"] = {
                "time": plain(paired(slid[:, :, number], slid[:, :, values.index(FRICTION)])),
                "dx": plain(paired(at_rest(block)[:, :, number], at_rest(block)[:, :, values.index(FRICTION)])),
            }
    block = blocks["undamped_joints"]
    values = block.axes["joint_damping"].tolist()
    for number, value in enumerate(values):
        if value != 1000:
            effect = paired(at_rest(block)[:, :, number], at_rest(block)[:, :, values.index(1000)])
            content["undamped"][f"{value:g}"] = plain(effect)
    return content


def until_collapse(block: Block) -> Array:
    """Number of bounces before the loop collapses, or all bounces of a loop that never does."""
    collapse, every = at_rest(block, EVENTS["collapse"]), at_rest(block, "bounces")
    return np.where(collapse < 0, every, collapse)


def distributions(block: Block) -> list[Numbers]:
    """Of each cell: Δx at both tolerances, and whether it is of one distribution (Kolmogorov and Smirnov)."""
    table, values = at_rest(block), block.axes["tolerance"]
    loose, tight = int(np.argmax(values)), int(np.argmin(values))
    found = []
    for i, links in enumerate(block.axes["links"].tolist()):
        for j, frequency in enumerate(block.axes["frequency"].tolist()):
            one, two = (each[np.isfinite(each)] for each in (table[i, j, loose], table[i, j, tight]))
            test = ks_2samp(one, two)
            found.append(
                {
                    "links": links,
                    "frequency": frequency,
                    "distance": float(test.statistic),
                    "p": float(test.pvalue),
                    "means": [float(one.mean()), float(two.mean())],
                    "sds": [float(one.std(ddof=1)), float(two.std(ddof=1))],
                    "walks": [len(one), len(two)],
                }
            )
    return found
