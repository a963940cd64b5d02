"""From the folders of sweeps to the numbers that the page is made of.

The numbers are plain and rounded, so that a small file of JSON holds them.
"""

import hashlib
import json
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from studies.common import Block, at_rest, deviation, mean
from studies.paper import further
from studies.paper.further import CELLS, Cells, Numbers, until_collapse, values_of
from studies.paper.impacts import impacts
from studies.paper.statistics import Effect, paired, spread, unpaired
from warpchain import InputError, Parameters, SweepResult, preset

DIGITS = 4  # Significant digits that are kept


def reduced(result: SweepResult) -> Numbers:
    """The numbers of one sweep."""
    if result.name not in SWEEPS:
        raise InputError(f"{result.name}: not a sweep of this page; use folders of {', '.join(SWEEPS)}")
    if result.missing_count:
        raise InputError(f"{result.name}: {result.missing_count} walks are missing; run the sweep to its end")
    content: Numbers = {
        "sweep": content_digest(result.sweep),
        "samples": {block.name: block.shape[-1] for block in result.blocks.values()},
        "numerics_version": result.provenance["numerics_version"],
        "seed": result.seed,
        "command": f"warpchain sweep studies/paper/sweeps/{result.name}.yaml",
        "walks": result.summary(),
        "inaccurate": result.inaccurate_count,
    }
    for block in result.blocks.values():
        content.setdefault("cells", {name: block.axes[name] for name in CELLS})
        varied = [name for name in block.axes if name not in CELLS]
        if varied and result.name in ("paper_claims", "paper_joints"):
            content.setdefault("effects", {})[varied[0]] = effects_of(result, block, varied[0], at_rest(block))
    if result.name in WHOLE:
        key, reduce = WHOLE[result.name]
        content[key] = reduce(*result.blocks.values())
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


def effects_of(result: SweepResult, block: Block, name: str, table: Cells) -> Numbers:
    """What each value of a block's further axis `name` does to a quantity, against that of the paper."""
    if name in Parameters.model_fields:
        given = next(each for each in result.sweep["blocks"] if each["name"] == block.name)
        reference: Any = float(getattr(preset(given["preset"]), name))
    else:
        reference = further.REFERENCES[name]
    if reference not in (values := block.axes[name].tolist()):
        raise InputError(f"{name}: expected {reference} among {values}; use a sweep that has it")
    return {"reference": reference, "values": values_of(table, name, reference)}


def starts(block: Block) -> Numbers:
    """Of each start means of Δx, bounces and shares of the losses of energy, and steps of Δx along both axes."""
    lost = {name: at_rest(block, name) for name in block.columns if name.startswith("loss_")}
    total = np.sum([values.values for values in lost.values()], axis=0)
    content: Numbers = {}
    for start in block.axes["start"].tolist():
        here, bounces = (at_rest(block, name).sel(start=start) for name in ("dx", "bounces"))
        content[start] = {
            "mean": mean(here),
            "sd": deviation(here),
            "bounces": mean(bounces),
            "faster": unpaired(here.values[:, 1:], here.values[:, :-1]).plain,
            "longer": unpaired(here.values[1:], here.values[:-1]).plain,
            "losses": {name[len("loss_") :]: mean((each / total).sel(start=start)) for name, each in lost.items()},
        }
    return content


def friction(block: Block) -> Numbers:
    """The friction of the floor with which chains walk farthest, cell by cell."""
    means, values = mean(at_rest(block)), block.axes["floor_friction"]
    return {"values": values, "best": values[np.argmax(np.nan_to_num(means, nan=-np.inf), axis=-1)], "mean": means}


def spreads(blocks: Mapping[str, Block]) -> Numbers:
    """Relative standard deviation of Δx in each cell: everything drawn, the release alone, the parameters alone."""
    everything = at_rest(blocks["gravity"]).sel(gravity=preset("soft").gravity, method="nearest")
    alone = {name: at_rest(blocks[f"{name}_only"]) for name in ("release", "parameters")}
    return {name: spread(table) for name, table in {"both": everything, **alone}.items()}


def tolerance(block: Block) -> Numbers:
    """How far walks and means differ at two tolerances."""
    loose, tight = (at_rest(block).sel(end).values for end in further.extremes(block))
    single = np.abs(loose / tight - 1)
    single = single[np.isfinite(single)]
    return {
        "walks": len(single),
        "within_a_tenth": (single <= 0.1).sum(),
        "median": np.median(single),
        "greatest": single.max(),
        "means": paired(loose, tight).plain,
    }


def first_impacts(block: Block) -> Numbers:
    """Changes of shape and speed in the first impact, means over the walks of each cell, and of all walks."""
    found, without = impacts(block)
    content: Numbers = {"walks": sum(map(len, found.values())), "without": without}
    for name in ("area", "height", "width", "speed", "duration"):
        table = np.full([len(block.axes[axis]) for axis in CELLS], np.nan)
        for cell, several in found.items():
            table[cell] = np.mean([getattr(impact, name) for impact in several])
        content[name] = table
    every = [impact for several in found.values() for impact in several]
    for name in ("area", "height", "width", "speed"):
        values = np.array([getattr(impact, name) for impact in every])
        content[f"{name}_of_walks"] = {
            "quantiles": np.quantile(values, [0.05, 0.5, 0.95]),
            "within_a_tenth": (np.abs(values) <= 0.1).sum(),
            "falls": (values < 0).sum(),
            "falls_by_less_than_a_fifth": ((values < 0) & (values > -0.2)).sum(),
        }
    return content


def rounded(content: Any) -> Any:
    """Plain numbers: floats of `DIGITS` significant digits, and None for what is no finite number."""
    if hasattr(content, "tolist"):
        content = content.tolist()
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


def read(text: str) -> Numbers:
    """The numbers of such a file, with effects and arrays in their places."""

    def found(content: Numbers) -> Any:
        if "half_width" in content:
            return Effect.of(content)
        tables = {name: each for name, each in content.items() if isinstance(each, list) and isinstance(each[0], list)}
        return content | {name: np.array(each, float) for name, each in tables.items()}

    return json.loads(text, object_hook=found)


WHOLE: dict[str, tuple[str, Callable[..., Any]]] = {
    "paper_tolerance": ("tolerance", tolerance),
    "paper_shapes": ("impacts", first_impacts),
    "paper_strands": ("strands", further.strands),
    "paper_through": ("through", further.through),
    "paper_through_ellipse": ("through", further.through),
    "paper_open": ("left_open", further.left_open),
    "paper_footnote": ("nonlinear", further.nonlinear),
    "paper_more": ("sliding", further.sliding),
    "paper_distributions": ("distributions", further.distributions),
}
"""Sweeps that one function reduces, of its blocks: name → key of its numbers, and the function."""
SWEEPS = ("paper_claims", "paper_joints", *WHOLE)  # Sweeps that the page is made of
