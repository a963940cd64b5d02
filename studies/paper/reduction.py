"""From the folders of sweeps to the numbers that the page is made of.

The numbers are plain and rounded, so that a small file of JSON holds them.
"""

import hashlib
import json
import re
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from studies.paper.further import (
    CELLS,
    at_rest,
    distributions,
    left_open,
    loops,
    more,
    nonlinear,
    plain,
    rest_and_hold,
    same_loops,
    strands,
    through,
    until_collapse,
)
from studies.paper.impacts import Block, impacts
from studies.paper.statistics import Effect, mean, paired, spread, unpaired
from warpchain import InputError, Parameters, SweepResult, preset

Array = NDArray[np.float64]
Numbers = dict[str, Any]

DIGITS: Final = 4
"""Significant digits that are kept."""

WHOLE: Final[dict[str, tuple[str, Callable[[Mapping[str, Block]], Any]]]] = {
    "paper_tolerance": ("tolerance", lambda blocks: tolerance(blocks["main"])),
    "paper_shapes": ("impacts", lambda blocks: first_impacts(blocks["main"])),
    "paper_strands": ("strands", lambda blocks: strands(blocks["start"])),
    "paper_through": ("through", lambda blocks: through(blocks["main"])),
    "paper_through_ellipse": ("through", lambda blocks: through(blocks["main"])),
    "paper_open": ("left_open", left_open),
    "paper_rest": ("rest_and_hold", lambda blocks: rest_and_hold(blocks["main"])),
    "paper_loops": ("loops", lambda blocks: loops(blocks["main"])),
    "paper_held": ("loops", lambda blocks: loops(blocks["main"])),
    "paper_starts": ("same", lambda blocks: same_loops(blocks["main"])),
    "paper_footnote": ("nonlinear", lambda blocks: nonlinear(blocks["main"])),
    "paper_more": ("more", more),
    "paper_distributions": ("distributions", lambda blocks: distributions(blocks["main"])),
}
"""Sweeps that one function reduces: name → key of its numbers, and the function."""
SWEEPS: Final = ("paper_claims", "paper_joints", *WHOLE)
"""Sweeps that the page is made of."""

DEFAULTS: Final = {"clearance": 0.01, "phase": 0.0}
"""Scene of a walk that is not told otherwise: height of the release [m] and part of a loop period."""


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
        if further and result.name in ("paper_claims", "paper_joints", "paper_tolerance"):
            content.setdefault("effects", {})[further[0]] = effects_of(result, block, further[0], at_rest(block))
    if result.name in WHOLE:
        key, reduce = WHOLE[result.name]
        content[key] = reduce(result.blocks)
    if result.name == "paper_claims":
        block, lengths = (result.blocks[name] for name in ("floor_friction", "link_length"))
        content["starts"], content["friction"] = starts(result.blocks["start"]), friction(block)
        content["collapse"] = effects_of(result, lengths, "link_length", until_collapse(lengths))
        content["lost_on_floor"] = effects_of(result, block, "floor_friction", at_rest(block, "loss_floor"))
        content["spread"] = spreads(result.blocks)
    return rounded(content)


def content_digest(sweep: Mapping[str, Any]) -> str:
    """SHA-256 of what a sweep varies and draws, whatever computes it and however many samples it has."""
    kept = ("name", "preset", "sampler", "distributions", "grid")
    content = {name: sweep[name] for name in ("seed", "same_samples_along")}
    content["blocks"] = [
        {name: block.get(name) for name in kept} | {"start": block["scene"].get("start")} for block in sweep["blocks"]
    ]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def effects_of(result: SweepResult, block: Block, name: str, table: Array) -> Numbers:
    """What each value of a block's further axis `name` does to a quantity, against a reference on the axis.

    Raises:
        InputError: the reference is not on the axis.
    """
    values, reference = block.axes[name].tolist(), _reference(result, block, name)
    if reference not in values:
        raise InputError(f"{name}: {reference} is not among {values}; give a sweep that has it")
    before = table[:, :, values.index(reference)]
    return {
        "reference": reference,
        "values": [
            {"value": value, **plain(paired(table[:, :, number], before))}
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
            "faster": plain(unpaired(here[:, 1:], here[:, :-1])),
            "longer": plain(unpaired(here[1:], here[:-1])),
        }
        content[start]["losses"] = {name: value[:, :, number].tolist() for name, value in losses.items()}
    return content


def shares_of_losses(block: Block) -> dict[str, Array]:
    """Mean share of each loss in the energy that a walk loses from its release to rest, cells in front."""
    lost = {name: at_rest(block, name) for name in block.columns if name.startswith("loss_")}
    total = np.sum(list(lost.values()), axis=0)
    return {name.removeprefix("loss_"): mean(each / total) for name, each in lost.items()}


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
        "means": plain(means),
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


def effect_of(content: Mapping[str, Any]) -> Effect:
    """The effect that `further.plain` wrote, with its numbers rounded; null stands for NaN."""
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
