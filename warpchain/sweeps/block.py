"""One block of a sweep: its grid of cells, the distributions of its samples, and the values of axes in a file.

These are a list, a range that is written out, or names with values that are lists.
"""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, Field, ValidationError, ValidationInfo, WrapValidator

from warpchain.chain.setup import Setup
from warpchain.inputs import validation
from warpchain.inputs.distributions import Distribution, Gaussian
from warpchain.inputs.fields import FIELDS, SECTION_OF, SECTIONS
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset as parameter_preset
from warpchain.inputs.scene import COMPOUND, Scene
from warpchain.inputs.validation import InputError, checked, json_value, path_of, shown, validated
from warpchain.sweeps.designs import SAMPLERS, independent_groups
from warpchain.sweeps.until import Target
from warpchain.walks.landmarks import least

Value = float | int | str | tuple[Any, ...] | None
"""A value of a field; truth values are integers to Python, and None is null."""
Sections = Mapping[str, Mapping[str, Value]]
POINT: Final = "point"
"""Name of the axis of parameter sets."""
_Place = tuple[tuple[str, Value], ...]
"""Names and values of the axes of one section in a cell."""

AXIS_LIMIT: Final = 10_000
"""Most values of one axis."""
CELL_LIMIT: Final = 100_000
"""Most cells of a sweep, because each is checked when the sweep is loaded."""
Name = Annotated[str, Field(pattern="^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=validation.LONGEST_NAME)]
"""Of a block, or of a value on an axis."""


@dataclass(frozen=True)
class Block:
    """One block of a sweep.

    Attributes:
        path: where the block was given, for errors.
        name: its name, unique in the sweep.
        preset: name of the parameter preset; None when the preset is an axis.
        sections: `scene`, `options` and `parameters` → values that differ from the defaults or the preset, axes apart.
        axes: name of each axis, a field, `preset` or `point` → its values; the last one varies fastest.
        named: name of each axis that has names for values, such as `floor` → name → value of the field.
        points: name of each quantity that parameter sets have → its value in each, along the axis `point`.
        distributions: name → distribution, in the order of drawing.
        independent: names of those that each cell draws by itself, also along axes with the same samples.
        sampler: a key of `warpchain.sweeps.designs.SAMPLERS`.
        randomisations: number of independent randomisations of designed samples; random ones need none.
        samples_given: samples per cell, as the file says; with `until` the most of them.
        first_given: samples of the first round of each cell; all without `until`.
        until: quantity → the error of its mean at which a cell has no more rounds; empty without such.
        first_cell: number of the block's first cell among all cells of the sweep.
        stride: number of all cells of the sweep.
        first_stream: number of the block's first stream of random numbers.
    """

    path: str
    name: str
    preset: str | None
    sections: Sections
    axes: dict[str, tuple[Value, ...]]
    named: Mapping[str, Mapping[str, Value]]
    points: Mapping[str, tuple[Value, ...]]
    distributions: Mapping[str, Distribution]
    independent: tuple[str, ...]
    sampler: str
    randomisations: int
    samples_given: int
    first_given: int
    until: Mapping[str, Target] = dataclasses.field(default_factory=dict)
    first_cell: int = 0
    stride: int = 0
    first_stream: int = 0

    @property
    def drawn(self) -> tuple[str, ...]:
        """Names of the quantities that samples draw, in the order of drawing."""
        return tuple(self.distributions)

    @property
    def samples(self) -> int:
        """Walks in each cell, with `until` at most; for `saltelli` all walks of all samples."""
        return self.samples_given * SAMPLERS[self.sampler].walks(len(self.distributions))

    @property
    def rounds(self) -> tuple[int, ...]:
        """Walks in each cell at the end of each round, see `warpchain.sweeps.rounds`; one round without `until`."""
        sizes = [self.first_given]
        while sizes[-1] < self.samples_given:
            sizes.append(min(2 * sizes[-1], self.samples_given))
        return tuple(size * self.samples // self.samples_given for size in sizes)

    @property
    def groups(self) -> NDArray[np.int64]:
        """Number of the group of each walk of a cell, see `independent_groups`."""
        return independent_groups(self.sampler, self.samples, len(self.distributions), self.randomisations)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis, then walks per cell."""
        return (*(len(values) for values in self.axes.values()), self.samples)

    @property
    def walk_count(self) -> int:
        """Number of walks."""
        return math.prod(self.shape)

    @property
    def indices(self) -> NDArray[np.int64]:
        """Numbers of the walks in the sweep, shape `shape`; samples that are added later change none of them."""
        cells = np.arange(math.prod(self.shape[:-1])).reshape((*self.shape[:-1], 1))
        return self.first_cell + cells + self.stride * np.arange(self.samples)

    @property
    def varied(self) -> dict[str, tuple[Value, ...]]:
        """Name of each quantity that differs between cells → its values, on an axis of its own or in parameter sets."""
        return {**{name: values for name, values in self.axes.items() if name != POINT}, **self.points}

    def fixed(self, cell: tuple[int, ...]) -> Setup:
        """The setup of a cell before anything is drawn: the values that Gaussians are centred on."""
        return next(self.fixed_in([cell]))

    def fixed_in(self, cells: Iterable[tuple[int, ...]]) -> Iterator[Setup]:
        """The `fixed` setups of some cells; those that are alike in a section share its checked values."""
        sections = self.sections
        axes = self.axes | {name: tuple(values.values()) for name, values in self.named.items()}
        kept = lru_cache(2**14)  # more than an axis has values
        scene = kept(lambda at: validated(Scene, {**sections["scene"], **dict(at)}, "scene"))
        options = kept(lambda tilts, at: Options.chosen({**sections["options"], **dict(at)}, tilts=tilts))
        changed = kept(lambda name, at: parameter_preset(name).with_values({**sections["parameters"], **dict(at)}))
        for cell in cells:
            at: dict[str, _Place] = dict.fromkeys(SECTIONS, ())
            preset = str(self.preset)
            for (name, values), place in zip(axes.items(), cell, strict=True):
                if name == "preset":
                    preset = str(values[place])
                    continue
                given = self.points if name == POINT else {name: values}
                for field, column in given.items():
                    at[SECTION_OF[field]] += ((field, column[place]),)
            try:
                own, parameters = scene(at["scene"]), changed(preset, at["parameters"])
                yield Setup(preset, parameters, own, options(own.plane == "tilting", at["options"])).checked()
            except InputError as error:
                raise InputError(self._located(error, cell)) from None

    def cells_along(self, names: Container[str]) -> Iterator[tuple[int, ...]]:
        """The cells along the axes of some quantities, at the first value of every other axis."""
        along = {POINT if name in self.points else name for name in self.varied if name in names}
        return np.ndindex(*(len(values) if name in along else 1 for name, values in self.axes.items()))

    def _located(self, error: InputError, cell: tuple[int, ...]) -> str:
        """The text of an error about a cell, with the path of the value that it names."""
        where, _, problem = str(error).partition(": ")
        name, bracket, number = where.rpartition(".")[2].partition("[")
        within = bracket + number  # of a value that is a list
        at = dict(zip(self.axes, cell, strict=True))
        if name in self.points:
            return f"{self.path}.points.{name}[{at[POINT]}]{within}: {problem}"
        if name in at:
            key = self.axes[name][at[name]] if name in self.named else at[name]
            return f"{path_of(f'{self.path}.grid.{name}', key)}{within}: {problem}"
        place = ", ".join(f"{name} {self.axes[name][number]}" for name, number in at.items())
        return f"{self.path}.{where}: {problem}" + (f" (in the cell {place})" if place else "")

    def parameter(self, name: str) -> NDArray[Any]:
        """Values of a parameter or length of the scene before anything is drawn: of several the least, ∞ for null.

        They lie along the axes, one for all samples, shape (…, 1).
        """
        return self.over_cells((name, "preset"), lambda setup: least(getattr(getattr(setup, SECTION_OF[name]), name)))

    def over_cells(self, names: Container[str], value_of: Callable[[Setup], float]) -> NDArray[Any]:
        """A number of the `fixed` setup of each cell, which depends on some quantities only, shape (…, 1)."""
        cells = list(self.cells_along(names))
        values = [value_of(setup) for setup in self.fixed_in(cells)]
        sizes = [1 + max(places) for places in zip(*cells, strict=True)]
        return np.broadcast_to(np.reshape(values, (*sizes, 1)), (*self.shape[:-1], 1))

    def canonical(self) -> dict[str, Any]:
        """The block as JSON-able content of a file, with every default and range written out.

        A value that a distribution or an axis replaces is left out. With the preset as an axis, only the parameters
        that differ from it can be written out.
        """
        first = self.fixed((0,) * len(self.axes))
        replaced = {
            name
            for name, distribution in self.distributions.items()
            if not (isinstance(distribution, Gaussian) and distribution.mean is None)
        } | self.varied.keys()
        if self.preset is None:
            replaced |= first.parameters.model_dump().keys() - self.sections["parameters"].keys()
        return {
            "name": self.name,
            **({} if self.preset is None else {"preset": self.preset}),
            "samples": self.first_given,
            **({"until": {n: each.canonical() for n, each in self.until.items()}} if self.until else {}),
            **({"at_most": self.samples_given} if self.until else {}),
            "sampler": self.sampler,
            **({} if SAMPLERS[self.sampler].engine is None else {"randomisations": self.randomisations}),
            **{section: getattr(first, section).model_dump(exclude=replaced) for section in SECTIONS},
            "distributions": {"all": "fixed"} | {name: each.canonical() for name, each in self.distributions.items()},
            **({"independent": list(self.independent)} if self.independent else {}),
            **({"points": {name: list(values) for name, values in self.points.items()}} if self.points else {}),
            "grid": {n: json_value(self.named.get(n)) or list(values) for n, values in self.axes.items() if n != POINT},
        }


class _Range(BaseModel):
    """Values from one to another, both included, in steps or of a number."""

    model_config = validation.STRICT
    first: float = Field(alias="from")
    last: float = Field(alias="to")
    step: float | None = Field(None, gt=0)
    count: int | None = Field(None, ge=2, le=AXIS_LIMIT)

    def values(self) -> list[int | float]:
        """All values, computed in decimals, so that three steps of 0.1 from 0 lead to 0.3 and to no other number."""
        first, last = Decimal(str(self.first)), Decimal(str(self.last))
        if first >= last:
            raise InputError(f"to: expected more than from, {self.first}, got {self.last}; use a greater value")
        if (self.step is None) == (self.count is None):
            raise InputError("step: expected either step or count; use one of them")
        step = (last - first) / (self.count - 1) if self.count else Decimal(str(self.step))
        if (last - first) / step >= AXIS_LIMIT:
            raise InputError(f"step: expected at most {AXIS_LIMIT} values, got more; use a larger step")
        intervals = int((last - first) / step) if self.count is None else self.count - 1
        below = first + intervals * step
        if self.count is None and below != last:
            raise InputError(f"to: steps of {step} from {first} miss {last}; use {below}, {below + step} or a count")
        values = [first + number * step for number in range(intervals)] + [last]
        return [int(value) if value == int(value) and abs(value) < 2**53 else float(value) for value in values]


def _expanded(values: Any, check: Callable[[Any], list[Any]], info: ValidationInfo) -> list[Any]:
    """The values of an axis, those of a range written out; together no more than sweeps of `CELL_LIMIT` cells have."""
    if isinstance(values, Mapping):
        if info.context["expanded"] > CELL_LIMIT + validation.MOST_VALUES:  # type: ignore[index]
            raise ValueError(f"expected at most {CELL_LIMIT} values in all ranges, got more; use fewer")
        try:
            values = _Range.model_validate(values).values()
        except ValidationError as error:
            raise InputError(validation.refusals(error, "", ("from", *_Range.model_fields))[0]) from None
        info.context["expanded"] += len(values)  # type: ignore[index]
    checked = check(values)
    value, count = Counter(checked).most_common(1)[0]
    if count > 1:
        raise ValueError(f"{shown(value)} is given twice; remove one")
    return checked


def list_of(kind: Any) -> Any:
    """Annotation of a list of values."""
    return Annotated[list[kind], Field(min_length=1, max_length=AXIS_LIMIT)]


def axis(kind: Any) -> Any:
    """Annotation of the values of an axis, a list or a range."""
    return Annotated[list_of(kind), WrapValidator(_expanded, json_schema_input_type=list_of(kind) | _Range)]


def _with_names(values: Any) -> Any:
    if not isinstance(values, Mapping):
        raise ValueError("expected a name for each value; use e.g. floor: {flat: flat, ramp: [[0, 0], [1, 0.1]]}")
    return values


def named_axis(kind: Any) -> Any:
    """Annotation of the values of an axis whose values may be lists: name → value."""
    named = Annotated[dict[Name, kind], Field(min_length=1, max_length=AXIS_LIMIT)]
    return Annotated[named, BeforeValidator(_with_names, json_schema_input_type=named)]


def refuse_axes(values: Mapping[str, object]) -> None:
    """Refuse values of a walk, by names of fields, that are axes of a sweep, in one line that names `sweep`."""
    for name, value in validation.by_name(values).items():
        if name in FIELDS and is_axis(name, given := validation.plain(value, name)):
            problem = f"expected one value for a walk, got {shown(given)}"
            raise InputError(f"{SECTION_OF[name]}.{name}: {problem}; use warpchain.sweep or a sweep file for a grid")


def is_axis(name: str, given: object) -> bool:
    """Whether a list or mapping that is given for a field by its name is an axis, and no value of the field."""

    def is_value(value: object) -> bool:
        try:
            checked(value, name, Annotated[FIELDS[name].annotation, Field(), *FIELDS[name].metadata])
        except InputError:
            return False
        return True

    if isinstance(given, list) and name in COMPOUND:  # of values without names, which an axis refuses
        return not is_value(given) and bool(given) and all(map(is_value, given))
    return isinstance(given, list) or (isinstance(given, dict) and not is_value(given))
