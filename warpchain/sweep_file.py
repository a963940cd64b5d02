"""What a sweep file says, checked and completed, before any walk is planned.

`read_sweep` turns the content of a YAML file into a `SweepPlan` of `BlockPlan`s: every value converted by the
model it belongs to, every range written out, every distribution resolved. An error is one line that begins with
the path of the offending value, such as `sweep.blocks[0].grid.frequency[3]`.
"""

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, cast

from pydantic import BaseModel

from warpchain.design import SAMPLERS
from warpchain.options import Options, Scene, read_yaml
from warpchain.parameters import InputError, Parameters, shown, suggestion
from warpchain.sampling import Distribution

Value = float | int | str
"""A value of a field; truth values are integers to Python."""

VERSION: Final = 1
"""Version of the file format."""

AXIS_LIMIT: Final = 10_000
"""Most values of one axis."""

SECTIONS: Final[Mapping[str, type[BaseModel]]] = {
    "scene": Scene,
    "options": Options,
    "parameters": Parameters,
}
"""Sections of a sweep file and the models whose fields they hold."""

DRAWABLE: Final = (
    *Parameters.model_fields,
    *(name for name, field in Scene.model_fields.items() if field.annotation is float),
)
"""Quantities that can have a distribution, in the order of drawing."""

_BLOCK_KEYS: Final = ("name", "preset", "samples", "sampler", *SECTIONS, "distributions", "grid")
_TOP_KEYS: Final = ("version", "seed", "blocks", "same_samples_along", "record", *_BLOCK_KEYS)
_AXES: Final = ("preset", *(name for model in SECTIONS.values() for name in model.model_fields))


@dataclass(frozen=True)
class BlockPlan:
    """One block of a sweep: a grid of cells and what is drawn in each.

    Attributes:
        path: where the block was given, for errors.
        name: its name.
        preset: name of the parameter preset; None when the preset is an axis.
        scene: values of `Scene` that differ from its defaults, axes apart.
        options: values of `Options` that differ from its defaults, axes apart.
        parameters: values of `Parameters` that differ from the preset, axes apart.
        axes: name of a field, or `preset` → its values; the last one varies fastest.
        distributions: name → distribution, in the order of drawing.
        sampler: one of `warpchain.design.SAMPLERS`.
        samples: samples per cell.
    """

    path: str
    name: str
    preset: str | None
    scene: dict[str, Value]
    options: dict[str, Value]
    parameters: dict[str, Value]
    axes: dict[str, tuple[Value, ...]]
    distributions: dict[str, Distribution]
    sampler: str
    samples: int


@dataclass(frozen=True)
class SweepPlan:
    """A whole sweep file.

    Attributes:
        name: name of the sweep.
        seed: seed of all random numbers.
        same_samples_along: axes along which the same samples are used, sorted.
        blocks: at least one.
    """

    name: str
    seed: int
    same_samples_along: tuple[str, ...]
    blocks: tuple[BlockPlan, ...]


def read_sweep(source: str | os.PathLike[str] | Mapping[str, object]) -> SweepPlan:
    """Read a sweep file, or take its content as a mapping.

    Raises:
        InputError: the file cannot be read, or something in it is refused.
    """
    content = source if isinstance(source, Mapping) else read_yaml(source)
    top = _mapping(content, "sweep", _TOP_KEYS)
    _require(top, "sweep", {"version": f"give {VERSION}", "name": "give a name", "seed": "give a whole number"})
    if top["version"] != VERSION or isinstance(top["version"], bool):
        raise InputError(f"sweep.version: {shown(top['version'])} is not supported; give {VERSION}")
    record = _mapping(top.get("record"), "sweep.record", ("series",))
    if record.get("series", False) is not False:
        raise InputError(f"sweep.record.series: {shown(record['series'])} is not supported; give false")
    blocks = tuple(_blocks(top))
    return SweepPlan(
        name=_text(top["name"], "sweep.name"),
        seed=_whole(top["seed"], "sweep.seed", 0, 2**128 - 1),
        same_samples_along=_same_samples_along(top.get("same_samples_along"), blocks),
        blocks=blocks,
    )


@dataclass(frozen=True)
class _Level:
    """What one level of the file gives, the top or a block: each value with its path."""

    path: str
    given: Mapping[str, object]
    sections: Mapping[str, Mapping[str, Value]]
    distributions: Mapping[str, tuple[str, "Distribution | str"]]


def _blocks(top: Mapping[str, object]) -> Iterable[BlockPlan]:
    outer = _level(top, "sweep")
    if top.get("blocks") is None:
        yield _block(outer, _Level("sweep", {**top, "name": "main"}, {}, {}))
        return
    if top.get("grid") is not None:
        raise InputError("sweep.grid: given together with blocks; move it into a block")
    blocks = _sequence(top["blocks"], "sweep.blocks")
    if not blocks:
        raise InputError("sweep.blocks: empty; give one block or more, or a grid")
    names: set[str] = set()
    for number, content in enumerate(blocks):
        path = f"sweep.blocks[{number}]"
        block = _mapping(content, path, _BLOCK_KEYS)
        _require(block, path, {"name": "give the block a name"})
        name = _text(block["name"], f"{path}.name")
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
            raise InputError(
                f"{path}.name: {shown(name)} is no plain name; give letters, digits, - and _, "
                "beginning with a letter or digit"
            )
        if name in names:
            raise InputError(f"{path}.name: {shown(name)} is given twice; give another name")
        names.add(name)
        yield _block(outer, _level(block, path))


def _level(content: Mapping[str, object], path: str) -> _Level:
    sections = {
        section: {
            name: checked(model, name, value, f"{path}.{section}.{name}")
            for name, value in _mapping(content.get(section), f"{path}.{section}", tuple(model.model_fields)).items()
        }
        for section, model in SECTIONS.items()
    }
    where = f"{path}.distributions"
    distributions = {
        name: (f"{where}.{name}", _distribution(name, value, f"{where}.{name}"))
        for name, value in _mapping(content.get("distributions"), where, ("all", *DRAWABLE)).items()
    }
    return _Level(path, content, sections, distributions)


def _block(outer: _Level, inner: _Level) -> BlockPlan:
    """A block, with what it does not give itself taken from the top level."""
    path, given = inner.path, {**outer.given, **inner.given}
    axes = _axes(inner)
    sections = {
        section: {
            name: value
            for name, value in {**outer.sections[section], **inner.sections.get(section, {})}.items()
            if name not in axes
        }
        for section in SECTIONS
    }
    if "preset" in axes:
        chosen = None
        if inner.given.get("preset") is not None and inner is not outer and path != "sweep":
            raise InputError(f"{path}.preset: also given in grid; leave one out")
    else:
        _require(given, path, {"preset": "name the parameters to start from, such as preset: paper"})
        chosen = cast(str, checked(None, "preset", given["preset"], f"{path}.preset"))
    _require(given, path, {"samples": "give the number of samples per cell"})
    samples = _whole(given["samples"], f"{path}.samples", 1, 2**30)
    sampler = given.get("sampler", "random")
    if sampler not in SAMPLERS:
        raise InputError(f"{path}.sampler: {shown(sampler)} is unknown; {suggestion(sampler, SAMPLERS)}")
    return BlockPlan(...)
