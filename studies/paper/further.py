"""Numbers of further sweeps: strands, what the paper leaves open, its last sentences."""

from itertools import combinations_with_replacement, product
from typing import Any

import numpy as np
import xarray
from scipy.stats import ks_2samp

from studies.common import DRAWN, Array, Block, at_rest, mean
from studies.paper.statistics import paired, spread, unpaired

Cells = xarray.DataArray  # Values of walks at rest, axes links and frequency in front, samples last
Numbers = dict[str, Any]

EVENTS = {"crease": "bounces_before_self_contact", "strands": "bounces_before_strands_met"}
"""What happens to a loop: name → column with the number of bounces begun before it, −1 if it never does."""
CELLS = ("links", "frequency")


def values_of(table: Cells, axis: str, reference: Any) -> list[Numbers]:
    """What each other value on an axis does to a quantity, in pairs with a reference on it."""
    values = table[axis].values.tolist()
    before = table.isel({axis: values.index(reference)})
    return [
        {"value": value, **paired(table.isel({axis: number}), before).plain}
        for number, value in enumerate(values)
        if value != reference
    ]


def extremes(block: Block) -> list[dict[str, float]]:
    """The greatest and the least tolerance of a block, as places on its axis."""
    return [{"tolerance": end(block.axes["tolerance"])} for end in (np.max, np.min)]


def histogram(bounces: Array) -> Array:
    """Numbers of walks with 0, 1, 2, 3 and more bounces before an event, and of those without the event."""
    known = np.where(bounces < 0, 5, np.minimum(bounces, 4))[np.isfinite(bounces)]
    return np.bincount(known.astype(int), minlength=6)


def strands(block: Block) -> Numbers:
    """When loops crease and their strands meet, by start and links; how gradually they lose their area.

    Early is a walk whose strands met before its third bounce; walks are taken relative to the means of their cells.
    """
    counts = {event: at_rest(block, column) for event, column in EVENTS.items()}
    met = counts["strands"].where(counts["strands"] >= 0)
    lasts, duration = at_rest(block, "collapsed_at") - at_rest(block, "softened_at"), at_rest(block, "walk_time")
    starts, loss = {}, {}
    for start in block.axes["start"].tolist():
        here = {event: values.sel(start=start).values for event, values in counts.items()}
        distance, starts[start] = at_rest(block).sel(start=start).values, []
        for links, of_cells in enumerate(distance / mean(distance)[..., np.newaxis]):
            content: Numbers = {event: histogram(values[links]) for event, values in here.items()}
            early = (here["strands"][links] >= 0) & (here["strands"][links] <= 2)
            both = [of_cells[np.isfinite(of_cells) & chosen] for chosen in (early, ~early)]
            if min(map(len, both)) > 1:
                content["early_over_late"] = unpaired(*both).plain
            content["most_frequent"] = [np.argmax(histogram(cell)) for cell in here["strands"][links]]
            starts[start].append(content)
        loss[start] = {
            name: np.nanquantile(values.sel(start=start), [0.1, 0.5, 0.9])
            for name, values in (("seconds", lasts), ("of_the_walk", lasts / duration))
        }
    delay = paired(met.sel(start="ellipse"), met.sel(start="rest"))
    return {"starts": starts, "delay": delay.plain, "loss_of_shape": loss}


def nonlinear(block: Block) -> Numbers:
    """Shares of the variance of Δx in each cell: of terms of what is drawn, and of what two tolerances share."""
    loose, tight = extremes(block)
    distance = at_rest(block)
    drawn = {name: at_rest(block, name).sel(loose) for name in block.columns if name.endswith(DRAWN)}
    found: Numbers = {}
    for start in block.axes["start"].tolist():
        one, two = (distance.sel({"start": start} | which).values for which in (loose, tight))
        shares = {name: np.empty(one.shape[:2]) for name in ("linear", "squares", "products", "repeated")}
        for place in np.ndindex(one.shape[:2]):
            kept = np.isfinite(one[place]) & np.isfinite(two[place])
            columns = {name: values.sel(start=start).values[place][kept] for name, values in drawn.items()}
            known = {name: values for name, values in columns.items() if values.std() > 0}
            linear = [(values - values.mean()) / values.std() for values in known.values()]
            turning = [f(2 * np.pi * known[f"phase{DRAWN}"]) for f in (np.sin, np.cos)]
            products = [first * second for first, second in combinations_with_replacement(linear, 2)]
            squares = [each**2 for each in linear]
            for name, terms in (("linear", []), ("squares", turning + squares), ("products", turning + products)):
                shares[name][place] = explained(one[place][kept], linear + terms)
            shares["repeated"][place] = np.corrcoef(one[place][kept], two[place][kept])[0, 1]
        found[start] = shares
    return found


def explained(values: Array, terms: list[Array]) -> float:
    """Share of the variance of values (samples,) that terms explain, less what as many terms of noise would."""
    design = np.stack([np.ones(len(values)), *terms], axis=-1)
    weights, _, rank, _ = np.linalg.lstsq(design, values, rcond=None)
    left = np.sum((values - design @ weights) ** 2) / (len(values) - rank)
    return float(1 - left / values.var(ddof=1))


REFERENCES = {
    "start": "rest",
    "sprocket_radius_is": "contact",
    "circle_radius": 4.2e-3,
    "clearance": 0.01,
    "clearance_of": "spinning",
    "phase": 0.0,
    "ellipse_aspect": 1.5,
}
"""What is chosen where walks are not told otherwise."""


def through(block: Block) -> Numbers:
    """What it does to Δx if links pass through one another, cell by cell."""
    table = at_rest(block)
    return paired(table.sel(self_contact=False), table.sel(self_contact=True)).plain


def left_open(*blocks: Block) -> Numbers:
    """What each other choice does to Δx, cell by cell, beside the spread of a walk."""
    found: Numbers = {}
    for block in blocks:
        (name,) = (axis for axis in block.axes if axis not in CELLS)
        table, reference = at_rest(block), REFERENCES[name]
        here = table.isel({name: block.axes[name].tolist().index(reference)})
        content = {"reference": reference, "spread": np.nanmedian(spread(here))}
        found[name] = content | {"values": values_of(table, name, reference)}
    return found


def sliding(*blocks: Block) -> list[Numbers]:
    """What the friction of the floor does to the time from the collapse to rest; other blocks are left aside."""
    (block,) = (block for block in blocks if block.name == "sliding")
    return values_of(at_rest(block, "walk_time") - at_rest(block, "collapsed_at"), "floor_friction", 0.27)


def until_collapse(block: Block) -> Cells:
    """Number of bounces before the loop collapses, or all bounces of a loop that never does."""
    collapse = at_rest(block, "bounces_before_collapse")
    return xarray.where(collapse < 0, at_rest(block, "bounces"), collapse)


def distributions(block: Block) -> list[Numbers]:
    """Of each cell: number of walks, and p of one distribution of Δx at both tolerances (Kolmogorov and Smirnov)."""
    table, found = at_rest(block), []
    for links, frequency in product(*(block.axes[name].tolist() for name in CELLS)):
        cell = table.sel(links=links, frequency=frequency)
        both = [cell.sel(each).dropna("sample").values for each in extremes(block)]
        known = {"links": links, "frequency": frequency, "walks": len(both[0])}
        found.append(known | {"p": ks_2samp(*both).pvalue})
    return found
