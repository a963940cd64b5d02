"""The grammar of sweep files, `SweepFile`, from which checks, the JSON schema and the reference page are made.

`read_sweep` makes `Block`s of a file, with every range written out and every distribution resolved. An error is a line
that begins with the path of the offending value, such as `sweep.blocks[0].grid.frequency[3]`. Sweeps that come with the
package are found by their bare names, and so is the file that a new sweep starts from.
"""

import math
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import pydantic
from pydantic import AfterValidator, BaseModel, Field, PlainValidator, ValidationError, ValidationInfo, model_validator

from warpchain.files import AnyPath, write_whole
from warpchain.inputs import validation
from warpchain.inputs.distributions import DRAWABLE, TABLE, Distribution, Gaussian, Seed, Uniform
from warpchain.inputs.fields import FIELDS, SECTION_OF, SECTIONS, SYMBOL_OF
from warpchain.inputs.parameters import PRESETS
from warpchain.inputs.scene import COMPOUND
from warpchain.inputs.validation import STRICT, InputError, ModelT, shown
from warpchain.inputs.yaml_files import read_yaml
from warpchain.sweeps.block import CELL_LIMIT, POINT, Block, Name, Sections, Value, axis, list_of, named_axis
from warpchain.sweeps.designs import RANDOMISATIONS, SAMPLERS, check_design
from warpchain.sweeps.recording import Frames, Recording
from warpchain.sweeps.until import AT_MOST, LEAST_GROUPS, Target, targets

VERSION: Final = 1
"""Version of the file format."""

WALK_LIMIT: Final = 2**24
"""Most walks of a sweep, 17 million: results are read as a whole, some 700 bytes a walk, and have to fit into memory.

A power of two, because numbers of designed samples are.
"""

_Preset = Literal[*PRESETS]  # type: ignore[valid-type]
_Sampler = Literal[*SAMPLERS]  # type: ignore[valid-type]

_PACKAGE: Final = Path(__file__).parents[1]
_INSTALLED: Final = _PACKAGE / "shipped_sweeps"
_SHIPPED: Final = _INSTALLED if _INSTALLED.is_dir() else _PACKAGE.parent / "sweeps"
"""Folder of the shipped sweeps: in the package where it is installed, beside the package in a checkout."""

# Fields by name or symbol


def _with_symbols(schema: dict[str, Any]) -> None:
    """Let a JSON schema take symbols for names, without defaults, some of which depend on the method."""
    fields = schema["properties"]
    for given in fields.values():
        given.pop("default", None)
    fields |= {SYMBOL_OF[name]: given for name, given in fields.items() if name in SYMBOL_OF}


class _Given(BaseModel):
    """A mapping of names or symbols; what comes of it is a dict of what is given, by full names and in its order."""

    model_config = STRICT | pydantic.ConfigDict(json_schema_extra=_with_symbols)

    @model_validator(mode="wrap")
    @classmethod
    def _in_its_order(cls, values: Any, check: Callable[[Any], Self]) -> Any:
        if not isinstance(values, Mapping):
            return check(values)
        named = validation.by_name(values)
        checked = check(named)
        return {name: getattr(checked, name) for name in named}


_TYPES: Final[Mapping[str, Any]] = {
    name: Annotated[f.annotation, Field(description=f.description, json_schema_extra=f.json_schema_extra), *f.metadata]
    for name, f in FIELDS.items()
}
_AXES: Final = {name: (named_axis if name in COMPOUND else axis)(kind) for name, kind in _TYPES.items()}


def _mapping_of(title: str, types: Mapping[str, Any]) -> Any:
    """Annotation of a mapping of names with values of these types."""
    fields: dict[str, Any] = {name: (kind, None) for name, kind in types.items()}
    model = pydantic.create_model(title, __base__=_Given, **fields)
    return pydantic.GetPydanticSchema(lambda _, handler: handler(model))


def _section(name: str) -> Any:
    """Annotation of the values of a section."""
    return _mapping_of(name, {field: _TYPES[field] for field in SECTIONS[name].model_fields})


# Distributions


class _Moments(BaseModel):
    model_config = STRICT
    mean: float | None = None
    sigma: float = Field(gt=0)


class _Law(BaseModel):
    """A distribution of one quantity."""

    model_config = STRICT
    uniform: list[float] | None = Field(None, min_length=2, max_length=2)
    gaussian: _Moments | None = None


def _distribution(given: Any, info: ValidationInfo) -> Distribution | None:
    """What is drawn of the quantity; None for what is fixed."""
    name = str(info.field_name)
    if given == "table" and name not in TABLE:
        raise ValueError(f"Table 1 has no uncertainty of {name}; use uniform or gaussian")
    if isinstance(given, str):
        return TABLE[name] if given == "table" else None
    if (given.uniform is None) == (given.gaussian is None):
        raise ValueError("unknown distribution; use {uniform: [lower, upper]} or {gaussian: {mean: …, sigma: …}}")
    bounds = validation.field_bounds(FIELDS[name])
    law: Distribution
    if given.gaussian is not None:
        law = Gaussian(given.gaussian.mean, given.gaussian.sigma, bounds)
        numbers = {"gaussian.mean": law.mean}
    else:
        lower, upper = given.uniform
        if lower >= upper:
            raise InputError(f"uniform[1]: expected more than {lower}, got {upper}; use a greater value")
        law, numbers = Uniform(lower, upper, bounds), {"uniform[0]": lower, "uniform[1]": upper}
    least, most = math.nextafter(bounds[0], -math.inf), math.nextafter(bounds[1], math.inf)  # one may be an open bound
    for where, number in numbers.items():
        if number is not None and not least <= number <= most:
            raise InputError(f"{where}: {number} is not physical; see `warpchain parameters {name}`")
    return law


_Word = Literal["table", "fixed"]
_Drawn = Annotated[
    Annotated[_Word, pydantic.Tag("(word)")] | Annotated[_Law, pydantic.Tag("(law)")],
    pydantic.Discriminator(lambda given: "(law)" if isinstance(given, Mapping) else "(word)"),
    AfterValidator(_distribution),
]


# The file

_OneUntil = Annotated[float, Field(gt=0)] | str


def _printable(name: str) -> str:
    if not name.strip() or not name.isprintable():
        raise ValueError(f"expected a line of text, got {shown(name)}; use a short name")
    return name


class WalkKeys(BaseModel):
    """The keys of the file of a walk, which a sweep file has, too; what has nothing behind it is not given."""

    model_config = STRICT

    preset: _Preset | None = Field(None, description="parameters to start from; may also be an axis of the grid")
    scene: Annotated[dict[str, Value], _section("scene")] = Field(
        {}, description="fields of the [scene](scene.md) that differ from their defaults"
    )
    options: Annotated[dict[str, Value], _section("options")] = Field(
        {}, description="[options](options.md) that differ from their defaults"
    )
    parameters: Annotated[dict[str, Value], _section("parameters")] = Field(
        {}, description="[parameters](parameters.md) that differ from the preset"
    )

    @model_validator(mode="before")
    @classmethod
    def _without_empty_keys(cls, values: Any) -> Any:
        return {k: value for k, value in values.items() if value is not None} if isinstance(values, dict) else values


class BlockKeys(WalkKeys):
    """The keys that a block and the file itself may have."""

    samples: Annotated[int, Field(ge=1, le=2**30), validation.WHOLE] | None = Field(
        None, description="samples in each cell of the grid; with `until` those of its first round"
    )
    until: Annotated[dict[str, Target], PlainValidator(targets, _OneUntil | dict[str, _OneUntil])] | None = Field(
        None, description="errors of means at which a cell stops, see below; by default its samples are all run"
    )
    at_most: Annotated[int, Field(ge=LEAST_GROUPS, le=2**30), validation.WHOLE] | None = Field(
        None, description=f"most samples in each cell with `until`; default: {AT_MOST}"
    )
    sampler: _Sampler | None = Field(None, description="how samples are drawn, see below; default: random")
    randomisations: Annotated[int, Field(ge=1, le=1024), validation.WHOLE] | None = Field(
        None, description=f"independent randomisations of designed samples, see below; default: {RANDOMISATIONS}"
    )
    distributions: Annotated[
        dict[str, Any], _mapping_of("distributions", {"all": _Word, **dict.fromkeys(DRAWABLE, _Drawn)})
    ] = Field({}, description="what samples draw, see below")
    independent: list[str] = Field(
        [], description="quantities that are sampled separately in every cell, even along axes with the same samples"
    )
    grid: Annotated[
        dict[str, list[Value] | dict[str, Value]], _mapping_of("grid", {"preset": axis(_Preset), **_AXES})
    ] = Field({}, description="axes of the grid, see below; not in a file with blocks")
    points: Annotated[
        dict[str, list[Value]],
        _mapping_of("points", {name: list_of(kind) for name, kind in _TYPES.items() if name not in COMPOUND}),
    ] = Field(
        {},
        description="parameter sets: quantity → its value in each; one more axis, `point`; not in a file with blocks",
    )

    @model_validator(mode="after")
    def _axes_have_no_other_value(self) -> Self:
        for key, name in [("grid", name) for name in self.grid] + [("points", name) for name in self.points]:
            home = SECTION_OF.get(name, name)
            if self.preset is not None if name == "preset" else name in getattr(self, home):
                raise InputError(f"{key}.{name}: given twice, also in {home}; remove one")
            if key == "points" and name in self.grid:
                raise InputError(f"points.{name}: given twice, also in grid; remove one")
        first = next(iter(self.points), "")
        for name, values in self.points.items():
            if len(values) != len(self.points[first]):
                raise InputError(
                    f"points.{name}: expected {len(self.points[first])} values, as {first} has, got {len(values)}"
                )
        return self


class BlockOfFile(BlockKeys):
    """An item of `blocks`."""

    name: Name = Field(description="name of the block, unique in its sweep")


class SweepFile(BlockKeys):
    """A sweep file."""

    version: Literal[1] = Field(description="version of the format: 1")
    name: Annotated[str, AfterValidator(_printable)] = Field(
        max_length=validation.LONGEST_NAME,
        description="name of the sweep, in figures and pages; of a block, unique in its sweep",
    )
    seed: Seed = Field(description="whole number from which all random numbers follow")
    blocks: list[BlockOfFile] | None = Field(
        None, min_length=1, description="list of blocks; what a block does not say is taken from the file"
    )
    same_samples_along: list[str] = Field(
        [], description="axes along which the samples of all cells draw the same numbers"
    )
    record: Recording = Field(Recording(), description="what is kept of the motion of walks, see below")

    @model_validator(mode="after")
    def _one_grid_or_blocks(self) -> Self:
        names = [block.name for block in self.blocks or ()]
        for key in ("grid", "points"):
            if names and getattr(self, key):
                raise InputError(f"{key}: not possible with blocks; move it into a block")
        for number, name in enumerate(names):
            if name in names[:number]:
                raise InputError(f"blocks[{number}].name: {shown(name)} is given twice; use another name")
        return self


_KEYS: Final = [name for model in (SweepFile, Recording, Frames, _Law) for name in model.model_fields]


def sweep_schema() -> dict[str, Any]:
    """The JSON schema of sweep files, draft 07; what only whole cells can tell is left to `load_sweep`."""
    return {"$schema": "http://json-schema.org/draft-07/schema#", **SweepFile.model_json_schema()}


def _checked(model: type[ModelT], content: object, path: str, source: object) -> ModelT:
    """Content of a file by its grammar; an `InputError` has a line for each problem."""
    if not isinstance(content, dict):
        raise InputError(f"{source}: expected a mapping; use the keys {', '.join(model.model_fields)}")
    try:
        return model.model_validate(content, context={"expanded": 0})
    except ValidationError as error:
        keys = _KEYS if model is SweepFile else model.model_fields
        raise InputError(*validation.refusals(error, path, keys)) from None


def read_walk_file(path: AnyPath) -> tuple[str | None, dict[str, dict[str, Any]]]:
    """Preset or None, and values by section and full names, of the YAML file of a walk; else an `InputError`."""
    file = _checked(WalkKeys, read_yaml(path), "", path)
    return file.preset, {section: getattr(file, section) for section in SECTIONS}


# From a file to blocks


Fields = tuple[str, int, tuple[str, ...], tuple[Block, ...], Recording]
"""Of a `Sweep`: name, seed, axes of equal samples, blocks, recording."""


def read_sweep(source: AnyPath | Mapping[str, object], **replaced: object) -> Fields:
    """The fields of a `Sweep`, see `load_sweep`."""
    content = validation.plain(source, "sweep") if isinstance(source, Mapping) else read_yaml(sweep_path(source))
    replaced = {key: value for key, value in replaced.items() if value is not None}
    if isinstance(content, dict):
        if "samples" in replaced and content.get("samples") is None:
            raise InputError("samples: each block of the sweep has its own; change the file")
        content |= replaced
    return fields_of(content, source)


def fields_of(content: Any, source: AnyPath | Mapping[str, object] = "") -> Fields:
    """The fields of a `Sweep`, from the content of a file in Python's own types, however many values it has."""
    file = _checked(SweepFile, content, "sweep", source)
    if file.blocks is None:
        blocks = [_block("main", "sweep", None, file)]
    else:
        blocks = [_block(each.name, f"sweep.blocks[{i}]", file, each) for i, each in enumerate(file.blocks)]
    same = {*map(validation.full_name, file.same_samples_along)}
    known = {name for block in blocks for name in block.axes}
    for name in same - known:
        remedy = validation.suggestion(name, sorted(known))
        raise InputError(f"sweep.same_samples_along: {shown(name)} is not an axis of any block; {remedy}")
    along = tuple(sorted(same))
    return file.name, file.seed, along, tuple(_numbered(blocks, along)), file.record


def _block(name: str, path: str, outer: BlockKeys | None, inner: BlockKeys) -> Block:
    """A block: its own keys and values, and those of the top level that it does not give."""

    def either(key: str) -> Any:
        return getattr(inner, key) or (getattr(outer, key) if outer else None)

    def merged(key: str) -> dict[str, Any]:
        return {**(getattr(outer, key) if outer else {}), **getattr(inner, key)}

    points = {name: tuple(values) for name, values in inner.points.items()}
    axes: dict[str, tuple[Value, ...]] = {axis: tuple(values) for axis, values in inner.grid.items()}
    named = {axis: values for axis, values in inner.grid.items() if isinstance(values, dict)}
    if points:
        axes = {POINT: tuple(range(len(next(iter(points.values()))))), **axes}
    varied = {*axes, *points}
    sections = {key: {name: value for name, value in merged(key).items() if name not in varied} for key in SECTIONS}
    preset, samples, sampler = (either(key) for key in ("preset", "samples", "sampler"))
    if preset is None and "preset" not in axes:
        raise InputError(f"{path}.preset: missing; set the parameters to start from, e.g. preset: paper")
    if samples is None:
        raise InputError(f"{path}.samples: missing; set the number of samples per cell")
    drawn = _drawn(merged("distributions"), sections, varied, f"{path}.distributions")
    sampler, randomisations = sampler or "random", either("randomisations") or RANDOMISATIONS
    if inner.randomisations is not None and SAMPLERS[sampler].engine is None:
        raise InputError(f"{path}.randomisations: {sampler} samples are independent anyway; remove it")
    check_design(sampler, samples, len(drawn), randomisations, path)
    until, at_most = either("until") or {}, either("at_most")
    most = (at_most or AT_MOST) if until else samples
    if until and at_most is None and samples >= AT_MOST:
        problem = f"the first round has samples: {samples} in each cell, so that no cell could stop early"
        raise InputError(f"{path}.until: {problem}; use fewer samples, such as 8, or set at_most")
    if until:
        _check_until(sampler, samples, most, len(drawn), randomisations, path)
    elif inner.at_most is not None:
        raise InputError(f"{path}.at_most: until is missing; remove it, or add until: {{dx: 1 %}}")
    own = {*map(validation.full_name, either("independent") or ())}
    for quantity in own - drawn.keys():
        remedy = validation.suggestion(quantity, sorted(drawn))
        raise InputError(f"{path}.independent: {shown(quantity)} is not sampled; {remedy}")
    independent, fixed = tuple(each for each in drawn if each in own), None if "preset" in axes else preset
    own_values = path, name, fixed, sections, axes, named, points
    return Block(*own_values, drawn, independent, sampler, randomisations, most, samples, until)


def _check_until(sampler: str, first: int, most: int, dimensions: int, randomisations: int, path: str) -> None:
    """Check that samples can grow from the first round to the most, and that errors can come of them."""
    if dimensions == 0:
        raise InputError(f"{path}.until: nothing is sampled, so more samples change nothing; remove it")
    if not SAMPLERS[sampler].grows:
        raise InputError(f"{path}.until: a {sampler} design cannot grow; use sampler: sobol or random")
    if sampler != "random" and randomisations < LEAST_GROUPS:
        problem = f"until needs {LEAST_GROUPS}, got {randomisations}"
        raise InputError(f"{path}.randomisations: {problem}; use {LEAST_GROUPS}")
    if most < first:
        raise InputError(f"{path}.at_most: expected samples: {first} or more, got {most}; use {first}")
    check_design(sampler, most, dimensions, randomisations, path, "at_most")


def _drawn(given: Mapping[str, Any], sections: Sections, varied: set[str], path: str) -> dict[str, Distribution]:
    """What a block draws, in the order of drawing.

    Given values are exact, unless their quantity has a distribution of its own name, without a mean and ends.
    """
    drawn: dict[str, Distribution] = {}
    for name in DRAWABLE:
        home = "grid" if name in varied else SECTION_OF[name] if name in sections[SECTION_OF[name]] else None
        usual = TABLE.get(name) if home is None and given.get("all", "table") == "table" else None
        distribution = given.get(name, usual)
        if distribution is None:
            continue
        if home is not None and not (isinstance(distribution, Gaussian) and distribution.mean is None):
            raise InputError(f"{path}.{name}: {name} also has a value in {home}; remove one, or use fixed")
        drawn[name] = distribution
    return drawn


def _numbered(blocks: list[Block], same_samples_along: tuple[str, ...]) -> Iterator[Block]:
    """The blocks, numbered through their cells and streams; an `InputError` if there are too many cells or walks."""
    walks = first_stream = cells = 0
    stride = sum(math.prod(block.shape[:-1]) for block in blocks)
    for block in blocks:
        yield replace(block, first_cell=cells, stride=stride, first_stream=first_stream)
        cells += math.prod(block.shape[:-1])
        walks += block.walk_count
        if cells > CELL_LIMIT:
            raise InputError(
                f"{block.path}.grid: expected at most {CELL_LIMIT} cells, got {cells:.6g}; use fewer values"
            )
        if walks > WALK_LIMIT:
            key = "at_most" if block.until else "samples"
            raise InputError(f"{block.path}.{key}: expected at most {WALK_LIMIT} walks, got {walks:.6g}; use fewer")
        first_stream += math.prod(len(values) for name, values in block.axes.items() if name not in same_samples_along)


# Where files are


def shipped_sweeps() -> list[str]:
    """Bare names of the sweeps that come with the package."""
    return sorted(path.stem for path in _SHIPPED.glob("*.yaml"))


def sweep_path(source: AnyPath) -> Path:
    """Path of a sweep file, or of a sweep of the package by its bare name; an `InputError` if it is neither."""
    path = validation.checked_path(source, "sweep")
    name = str(path)
    if os.path.isfile(path) or not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        return path
    known = shipped_sweeps()
    if name not in known:
        raise InputError(f"{name}: neither a file nor a shipped sweep; {validation.suggestion(name, known)}")
    return _SHIPPED / f"{name}.yaml"


def write_new_sweep(path: Path) -> None:
    """Write a small sweep file whose comments explain its keys; an `InputError` if there is a file already."""
    text = (_PACKAGE / "sweeps" / "new_sweep.yaml").read_text(encoding="utf-8")
    if os.path.lexists(path):
        raise InputError(f"--new: {path} already exists; use another name")
    write_whole(path, text)
