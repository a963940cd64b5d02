"""From the folders of sweeps to the numbers that the page is made of.

The numbers are plain and rounded, so that a small file of JSON holds them.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from studies.paper.impacts import Block, impacts
from studies.paper.statistics import Effect, mean, paired, spread, unpaired
from warpchain import InputError, Parameters, Status, SweepResult, preset

Array = NDArray[np.float64]
Numbers = dict[str, Any]

DIGITS: Final = 4
"""Significant digits that are kept."""

SWEEPS: Final = ("paper_claims", "paper_joints", "paper_tolerance", "paper_shapes")
"""Sweeps that the page is made of."""

CONTACT: Final = "bounces_before_self_contact"
"""Column with the number of bounces before a loop first touches itself, −1 if it never does."""
COLLAPSE: Final = "bounces_before_collapse"
"""Column with the number of bounces before a loop collapses, −1 if it never does."""

DEFAULTS: Final = {"clearance": 0.01, "phase": 0.0}
"""Scene of a walk that is not told otherwise: height of the release [m] and part of a loop period."""

CELLS: Final = ("links", "frequency")
"""Axes of the cells."""


def reduced(result: SweepResult) -> Numbers:
    """The numbers of one sweep.

    Raises:
        InputError: it is none of `SWEEPS`, or not complete.
    """
    if result.name not in SWEEPS:
        raise InputError(f"{result.name}: no sweep of this page; give folders of {', '.join(SWEEPS)}")
    if result.missing_count:
        raise InputError(f"{result.name}: {result.missing_count} walks are missing; run the sweep to its end")
    content: Numbers = {
        "sweep": content_digest(result.sweep),
        "samples": {block.name: block.shape[-1] for block in result.blocks.values()},
        "numerics_version": result.provenance["numerics_version"],
        "walks": result.summary(),
        "inaccurate": result.inaccurate_count,
    }
    for block in result.blocks.values():
        content.setdefault("cells", {name: block.axes[name].tolist() for name in CELLS})
        further = [name for name in block.axes if name not in CELLS]
        if further:
            name = further[0]
            content.setdefault("effects", {})[name] = effects(
                at_rest(block), block, name, _reference(result, block, name)
            )
    for key, name, reduce in (
        ("starts", "start", starts),
        ("friction", "floor_friction", friction),
    ):
        if name in result.blocks:
            content[key] = reduce(result.blocks[name])
    if "link_length" in result.blocks and CONTACT in (block := result.blocks["link_length"]).columns:
        content["collapse"] = effects(
            bounces_until_collapse(block), block, "link_length", _reference(result, block, "link_length")
        )
    if "floor_friction" in result.blocks:
        block = result.blocks["floor_friction"]
        content["lost_on_floor"] = effects(
            at_rest(block, "loss_floor"), block, "floor_friction", _reference(result, block, "floor_friction")
        )
    if "gravity" in result.blocks:
        content["spread"] = spreads(result.blocks)
    if result.name == "paper_tolerance":
        content["tolerance"] = tolerance(result.blocks["main"])
    if result.name == "paper_shapes":
        content["impacts"] = first_impacts(result.blocks["main"])
    rounded_content: Numbers = rounded(content)
    return rounded_content


def content_digest(sweep: Mapping[str, Any]) -> str:
    """SHA-256 of what a sweep varies and draws, whatever computes it and however many samples it has."""
    kept = ("name", "preset", "sampler", "distributions", "grid")
    content = {name: sweep[name] for name in ("seed", "same_samples_along")}
    content["blocks"] = [
        {name: block.get(name) for name in kept} | {"start": block["scene"].get("start")} for block in sweep["blocks"]
    ]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def at_rest(block: Block, quantity: str = "dx") -> Array:
    """A column with the cells in front and the samples behind, NaN for walks that did not come to rest."""
    order = [block.dims.index(name) for name in CELLS]
    others = [number for number in range(len(block.dims)) if number not in order]
    values = np.where(block.columns["status"] == Status.AT_REST, block.columns[quantity], np.nan)
    return np.transpose(values, order + others)


def effects(table: Array, block: Block, name: str, reference: float | str) -> Numbers:
    """What each value of a block's further axis `name` does to a quantity, against a reference on the axis.

    Raises:
        InputError: the reference is not on the axis.
    """
    values = block.axes[name].tolist()
    if reference not in values:
        raise InputError(f"{name}: {reference} is not among {values}; give a sweep that has it")
    before = table[:, :, values.index(reference)]
    return {
        "reference": reference,
        "values": [
            {"value": value, **_content(paired(table[:, :, number], before))}
            for number, value in enumerate(values)
            if value != reference
        ],
    }


def starts(block: Block) -> Numbers:
    """Distances by start, their steps along both axes of the cells, and when loops first ran into themselves."""
    table, values = at_rest(block), block.axes["start"].tolist()
    losses = shares_of_losses(block)
    content: Numbers = {}
    for number, start in enumerate(values):
        here = table[:, :, number]
        content[start] = {
            "count": np.isfinite(here).sum(axis=-1).tolist(),
            "mean": mean(here).tolist(),
            "sd": (spread(here) * mean(here)).tolist(),
            "bounces": mean(at_rest(block, "bounces")[:, :, number]).tolist(),
            "faster": _content(unpaired(here[:, 1:], here[:, :-1])),
            "longer": _content(unpaired(here[1:], here[:-1])),
        }
        content[start]["losses"] = {name: value[:, :, number].tolist() for name, value in losses.items()}
        if CONTACT in block.columns:
            content[start] |= self_contact(block, number)
    if CONTACT in block.columns:
        before = at_rest(block, CONTACT)
        before = np.where(before < 0, np.nan, before)
        ends = (before[:, :, values.index(start)] for start in ("ellipse", "rest"))
        content["delay"] = _content(paired(*ends))
    return content


def shares_of_losses(block: Block) -> dict[str, Array]:
    """Mean share of each loss in the energy that a walk loses from its release to rest, cells in front."""
    lost = {name: at_rest(block, name) for name in block.columns if name.startswith("loss_")}
    total = np.sum(list(lost.values()), axis=0)
    return {name.removeprefix("loss_"): mean(each / total) for name, each in lost.items()}


def self_contact(block: Block, start: int) -> Numbers:
    """After how many bounces loops first touched themselves and collapsed, and what early contact does to Δx."""
    contact, collapse, distance = (at_rest(block, name)[:, :, start] for name in (CONTACT, COLLAPSE, "dx"))
    # Relative to the mean of the cell, so that walks of all frequencies of one number of links can be put together.
    relative = distance / mean(distance)[..., np.newaxis]
    by_links = []
    for links in range(len(contact)):
        there, ratio = contact[links][np.isfinite(contact[links])], relative[links]
        early, late = (ratio[np.isfinite(ratio) & each] for each in (_early(contact[links]), ~_early(contact[links])))
        by_links.append(
            {
                "contact": _histogram(there),
                "collapse": _histogram(collapse[links][np.isfinite(collapse[links])]),
                "early": len(early),
                "late": len(late),
                **({"early_over_late": _content(unpaired(early, late))} if min(len(early), len(late)) > 1 else {}),
            }
        )
    return {"by_links": by_links}


def _early(bounces: Array) -> NDArray[np.bool_]:
    """Whether a loop touched itself before its third bounce."""
    return (bounces >= 0) & (bounces <= 2)


def _histogram(bounces: Array) -> list[int]:
    """Numbers of walks with 0, 1, 2, 3 and more bounces before an event, and of those without the event."""
    counts = [int((bounces == number).sum()) for number in range(4)]
    return [*counts, int((bounces > 3).sum()), int((bounces < 0).sum())]


def bounces_until_collapse(block: Block) -> Array:
    """Number of bounces before the loop collapses, or all bounces of a loop that never does; see `at_rest`."""
    collapse, every = at_rest(block, COLLAPSE), at_rest(block, "bounces")
    return np.where(collapse < 0, every, collapse)


def friction(block: Block) -> Numbers:
    """The friction of the floor with which chains walk farthest, cell by cell."""
    means, values = mean(at_rest(block)), block.axes["floor_friction"]
    best = values[np.argmax(np.nan_to_num(means, nan=-np.inf), axis=-1)]
    return {"values": values.tolist(), "best": best.tolist(), "mean": means.tolist()}


def spreads(blocks: Mapping[str, Block]) -> Numbers:
    """Relative standard deviation of Δx in each cell: everything drawn, the release alone, the parameters alone."""
    gravity = blocks["gravity"]
    everything = at_rest(gravity)[:, :, int(np.argmin(np.abs(gravity.axes["gravity"] - preset("soft").gravity)))]
    tables = {"both": everything, "release": at_rest(blocks["release_only"])}
    tables["parameters"] = at_rest(blocks["parameters_only"])
    return {name: spread(table).tolist() for name, table in tables.items()}


def tolerance(block: Block) -> Numbers:
    """How far walks and means differ at two tolerances."""
    table, values = at_rest(block), block.axes["tolerance"]
    loose, tight = (table[:, :, int(end(values))] for end in (np.argmax, np.argmin))
    single = np.abs(loose / tight - 1)
    single = single[np.isfinite(single)]
    means = paired(loose, tight)
    return {
        "loose": float(values.max()),
        "tight": float(values.min()),
        "walks": len(single),
        "within_a_tenth": int((single <= 0.1).sum()),
        "median": float(np.median(single)),
        "nine_of_ten": float(np.quantile(single, 0.9)),
        "greatest": float(single.max()),
        "means": _content(means),
    }


def first_impacts(block: Block) -> Numbers:
    """Changes of shape and speed in the first impact, means over the walks of each cell."""
    found, without = impacts(block)
    shape = tuple(len(block.axes[name]) for name in CELLS)
    content: Numbers = {"walks": sum(map(len, found.values())), "without": without}
    for name in ("area", "height", "width", "speed", "moved", "duration"):
        table = np.full(shape, np.nan)
        for cell, several in found.items():
            table[cell] = np.mean([getattr(impact, name) for impact in several])
        content[name] = table.tolist()
    every = [impact for several in found.values() for impact in several]
    for name in ("area", "height", "width", "speed"):
        values = np.array([getattr(impact, name) for impact in every])
        tails = np.quantile(values, [0.05, 0.5, 0.95]) if len(values) else np.full(3, np.nan)
        content[f"{name}_of_walks"] = {
            "quantiles": tails.tolist(),
            "within_a_tenth": int((np.abs(values) <= 0.1).sum()),
            "falls": int((values < 0).sum()),
            "falls_by_less_than_a_fifth": int(((values < 0) & (values > -0.2)).sum()),
        }
    return content


def _reference(result: SweepResult, block: Block, name: str) -> float | str:
    """The value that others are compared with: that of the paper, or what the paper begins with."""
    if name == "start":
        return "rest"
    if name == "tolerance":
        return float(block.axes[name].min())
    if name in Parameters.model_fields:
        given = next(each for each in result.sweep["blocks"] if each["name"] == block.name)
        return float(getattr(preset(given["preset"]), name))
    return DEFAULTS[name]


def _content(effect: Effect) -> Numbers:
    """An effect as plain numbers."""
    return {
        "relative": effect.relative.tolist(),
        "half_width": effect.half_width.tolist(),
        "sign": effect.sign.tolist(),
        "pairs": effect.pairs.tolist(),
        "lost": effect.lost,
    }


def effect_of(content: Mapping[str, Any]) -> Effect:
    """The effect that `_content` wrote, with its numbers rounded; null stands for NaN."""
    return Effect(
        relative=np.array(content["relative"], np.float64),
        half_width=np.array(content["half_width"], np.float64),
        sign=np.array(content["sign"], np.int64),
        pairs=np.array(content["pairs"], np.int64),
        lost=int(content["lost"]),
    )


def rounded(content: Any) -> Any:
    """The same with floats of `DIGITS` significant digits, and None for what is no finite number."""
    if isinstance(content, Mapping):
        return {name: rounded(value) for name, value in content.items()}
    if isinstance(content, list):
        return [rounded(value) for value in content]
    if isinstance(content, float):
        return float(f"{content:.{DIGITS}g}") if np.isfinite(content) else None
    return content


def text_of(content: Mapping[str, Any]) -> str:
    """The numbers as a file: JSON with each list of numbers on one line."""
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
    return re.sub(r"\[[^\[\]{}]*\]", lambda match: re.sub(r"\s+", " ", match[0]), text) + "\n"
