"""Results of a sweep as arrays with named axes.

A folder can be read while its sweep runs: walks that are not there yet are missing, and counted.
"""

import importlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError, plain, shown, suggestion
from warpchain.status import Status
from warpchain.store.cell_statistics import CellStatistics
from warpchain.store.folder import read_rows
from warpchain.store.manifest import Folder, read_manifest
from warpchain.store.manifest_content import FORMAT_VERSION
from warpchain.store.walk_motion import MotionReader, WalkMotion
from warpchain.walks.faulty_rows import faults_of_columns, lengths_of_block
from warpchain.walks.rows import COLUMNS, MISSING, Column, drawn_column, field_column, missing_rows, quantity_of

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

Array = NDArray[Any]

FORMAT: Final = "warpchain sweep result"

_Variables = dict[str, tuple[tuple[str, ...], Array, dict[str, Any]]]
"""Name → axes, values and attributes, as xarray takes them."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BlockResult:
    """A block of a sweep. Every column is an attribute, an array of shape `shape`: `block.dx`, `block.status`.

    Columns are those of `warpchain.walks.rows.COLUMNS`, and NAME_drawn for each drawn quantity. A missing walk has −1
    in columns of integers, `status` among them, and NaN in those of floats.

    Attributes:
        name: name of the block.
        axes: name of each axis of the grid → its values, in order; null is None. The samples are one more axis.
        drawn: names of the quantities that samples draw; the values are in the columns NAME_drawn.
        columns: name → values.
        sweep: the resolved sweep.
        motions: reads the motions of walks; None if none was kept.
    """

    name: str
    axes: dict[str, Array]
    drawn: tuple[str, ...]
    columns: dict[str, Array]
    sweep: Mapping[str, Any]
    motions: MotionReader | None = None

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the axes of every column."""
        return (*self.axes, "sample")

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis, then the number of samples."""
        return self.columns["index"].shape

    def __getattr__(self, name: str) -> Array:
        """A column."""
        columns: dict[str, Array] = self.__dict__.get("columns", {})
        if name not in columns:
            raise AttributeError(f"{name}: no such column; columns are {', '.join(columns)}", name=name, obj=self)
        return columns[name]

    def __dir__(self) -> list[str]:
        """Attributes, columns among them."""
        return sorted({*super().__dir__(), *self.columns})

    def __repr__(self) -> str:
        """One line with axes and counts."""
        sizes = ", ".join(f"{name}: {size}" for name, size in zip(self.dims, self.shape, strict=True))
        return f"<BlockResult {self.name} ({sizes}): {_counts(self.summary())}>"

    def unit(self, name: str) -> str:
        """SI unit of a column or an axis, "1" for pure numbers; a `KeyError` if there is none of that name."""
        return self._column(name).unit

    def meaning(self, name: str) -> str:
        """One line saying what a column or an axis is; a `KeyError` if there is none of that name."""
        return self._column(name).meaning

    def _column(self, name: str) -> Column:
        if name == "sample":
            return Column("<i8", "1", "number of the sample in its cell")
        if name not in self.columns and name not in self.axes:
            raise KeyError(f"{shown(name)}: {suggestion(name, (*self.columns, *self.axes))}")
        return COLUMNS[name] if name in COLUMNS else field_column(name)

    @cached_property
    def kept(self) -> NDArray[np.bool_]:
        """Whether the motion of a walk was kept and is there, shape `shape`."""
        series = None if self.motions is None else self.motions.manifest.recording.series
        chosen = [series is not None and series.includes(sample) for sample in range(self.shape[-1])]
        kept: NDArray[np.bool_] = np.array(chosen) & (self.columns["status"] != MISSING)
        return kept

    def series(self, *, sample: int = 0, **at: float | str | None) -> WalkMotion:
        """The motion of one walk: `series(links=60, frequency=15, sample=2).time`.

        Args:
            sample: number of the sample.
            at: value of each axis; of an axis with just one value it may be left out.

        Raises:
            InputError: there is no such walk, or its motion was not kept or is not there yet.
            OSError: its shard cannot be read.
        """
        if unknown := [name for name in at if name not in self.axes]:
            known = suggestion(unknown[0], tuple(self.axes)) if self.axes else "there are no axes"
            raise InputError(f"{unknown[0]}: no axis of block {self.name}; {known}")
        place = []
        for name, values in self.axes.items():
            found = np.flatnonzero(values == at.get(name, values[0]))
            if not len(found) or (name not in at and len(values) > 1):
                problem = f"{shown(at[name])} is not on the axis" if name in at else "missing"
                raise InputError(f"{name}: {problem}; give one of {', '.join(map(str, values))}")
            place.append(int(found[0]))
        if type(plain(sample)) is not int or not 0 <= sample < self.shape[-1]:
            raise InputError(f"sample: there is no sample {shown(sample)}; give 0 to {self.shape[-1] - 1}")
        return self.walk_motion((*place, sample))

    def walk_motion(self, place: tuple[int, ...]) -> WalkMotion:
        """The motion of the walk at a place along the axes and samples; errors as of `series`."""
        if self.motions is None or not self.kept[place]:
            kept = np.flatnonzero(self.kept.any(axis=tuple(range(len(self.axes)))))
            samples = ", ".join(map(str, kept[:12]))
            remedy = f"give one of the samples {samples}" if samples else "a sweep with record: {series: true} keeps it"
            raise InputError(f"the motion of walk {self.columns['index'][place]} is not there; {remedy}")
        row = {name: self.columns[name][place] for name in ("status", "dx")}
        return self.motions.walk(int(self.columns["index"][place]), row)

    def summary(self) -> dict[str, int]:
        """Number of walks by status label; `at_rest` and `missing` always, others if there are any."""
        return _summary(self.columns["status"])

    @cached_property
    def faults(self) -> dict[str, NDArray[np.bool_]]:
        """What makes walks inaccurate, a key of `warpchain.walks.faults.FAULTS` → whether each walk has it."""
        (content,) = (block for block in self.sweep["blocks"] if block["name"] == self.name)
        return faults_of_columns(self.columns, lengths_of_block(content, self.shape))

    @property
    def inaccurate(self) -> NDArray[np.bool_]:
        """Whether a walk has one of the `faults`, shape `shape`."""
        found: NDArray[np.bool_] = np.any(list(self.faults.values()), axis=0)
        return found

    def statistics(self, name: str = "dx") -> CellStatistics:
        """Statistics of a column in each cell, over the walks at rest that have a number there.

        NaN and −1 stand for none, such as `bounces_before_collapse` of a loop that never collapsed: such walks are in
        no mean, and `absent` counts them.

        Raises:
            KeyError: there is no such column.
        """
        return CellStatistics.of(self.axes, self.unit(name), self.columns[name], self.columns["status"])

    def to_xarray(self) -> "xarray.Dataset":
        """The block as a data set with named coordinates, units and meanings.

        Raises:
            ImportError: xarray is not installed.
        """
        coordinates, variables = self.variables()
        dataset: xarray.Dataset = _package("xarray").Dataset(variables, coordinates, {"block": self.name})
        return dataset

    def to_pandas(self) -> "pandas.DataFrame":
        """The block as a table with one row for each walk: values of the axes, sample, columns.

        Raises:
            ImportError: pandas is not installed.
        """
        grid = np.meshgrid(*self._places().values(), indexing="ij")
        places = dict(zip(self.dims, grid, strict=True))
        table = {name: values.ravel() for name, values in (places | self.columns).items()}
        return _package("pandas").DataFrame(table)

    def variables(self) -> tuple[_Variables, _Variables]:
        """Coordinates and variables."""
        places = self._places().items()
        coordinates: _Variables = {name: ((name,), values, self.notes(name)) for name, values in places}
        return coordinates, {name: (self.dims, values, self.notes(name)) for name, values in self.columns.items()}

    def _places(self) -> dict[str, Array]:
        """Values of each axis and numbers of the samples; an axis with null has numbers, and NaN for it."""
        numbers = {name: given.astype(float) if given.dtype.kind == "O" else given for name, given in self.axes.items()}
        return {**numbers, "sample": np.arange(self.shape[-1])}

    def notes(self, name: str) -> dict[str, Any]:
        """Attributes of a variable."""
        column = self._column(name)
        notes: dict[str, Any] = {"units": column.unit, "description": column.meaning}
        if quantity_of(name) in Parameters.model_fields:
            notes["symbol"] = Parameters.quantities()[quantity_of(name)].symbol
        if name == "status":
            notes["flag_values"] = np.array([MISSING, *Status], np.int8)
            notes["flag_meanings"] = " ".join(["missing", *(status.label for status in Status)])
        return notes


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SweepResult:
    """What is there of a sweep. If it has just one block, everything of the block is an attribute here, too.

    Attributes:
        name: name of the sweep.
        seed: its seed.
        blocks: name → block.
        sweep: the resolved sweep, as in sweep.yaml.
        provenance: digest of the sweep, version of the numerics, and versions of the software that began it.
    """

    name: str
    seed: int
    blocks: dict[str, BlockResult]
    sweep: dict[str, Any]
    provenance: dict[str, Any]

    def __getattr__(self, name: str) -> Any:
        """An attribute of the only block."""
        blocks: dict[str, BlockResult] = self.__dict__.get("blocks", {})
        if len(blocks) == 1:
            return getattr(next(iter(blocks.values())), name)
        problem = f"{name}: no such attribute; there are several blocks, blocks[…] with {', '.join(blocks)}"
        raise AttributeError(problem, name=name, obj=self)

    def __dir__(self) -> list[str]:
        """Attributes, those of the only block among them."""
        only = dir(next(iter(self.blocks.values()))) if len(self.blocks) == 1 else []
        return sorted({*super().__dir__(), *only})

    def __repr__(self) -> str:
        """One line for the sweep and one for each block."""
        lines = [f"<SweepResult {self.name}: {self.walk_count} walks, {_counts(self.summary())}>"]
        return "\n  ".join([*lines, *map(repr, self.blocks.values())])

    def _repr_png_(self) -> bytes | None:
        """The main figure; None if there is nothing to draw yet."""
        from warpchain.pictures.inline import first_png

        return first_png([self.plot])

    def _repr_html_(self) -> str:
        """Walks by status, axes of each block, and the main figure."""
        from warpchain.pictures.inline import axes_text, page

        blocks = [(f"block {name}", axes_text(each.axes, each.shape[-1])) for name, each in self.blocks.items()]
        walks = f"{self.walk_count:,}: {_counts(self.summary())}"
        return page(f"Sweep {self.name}", [("walks", walks), ("seed", str(self.seed)), *blocks], self._repr_png_())

    @property
    def walk_count(self) -> int:
        """Number of walks of the sweep, missing ones included."""
        return sum(block.columns["index"].size for block in self.blocks.values())

    @property
    def missing_count(self) -> int:
        """Number of walks not computed yet."""
        return self.summary()["missing"]

    def summary(self) -> dict[str, int]:
        """Number of walks by status label; `at_rest` and `missing` always, others if there are any."""
        return _summary(np.concatenate([block.columns["status"].ravel() for block in self.blocks.values()]))

    @property
    def inaccurate_count(self) -> int:
        """Number of walks with faults, whatever their status."""
        return sum(int(block.inaccurate.sum()) for block in self.blocks.values())

    def unit(self, name: str) -> str:
        """SI unit of a column or an axis of any block, "1" for pure numbers.

        Raises:
            KeyError: there is none of that name.
        """
        first, *others = self.blocks.values()
        owner = next((block for block in others if name in block.columns or name in block.dims), first)
        return owner.unit(name)

    def cell_statistics(self, quantity: str = "dx") -> dict[str, CellStatistics]:
        """Name of each block that has a column of numbers → its statistics, see `BlockResult.statistics`.

        Raises:
            InputError: no block has such a column.
        """
        known = {name: None for block in self.blocks.values() for name in block.columns}
        columns = [name for name in known if name not in ("index", "status")]
        if quantity not in columns:
            raise InputError(f"quantity: {shown(quantity)} is no column of numbers; {suggestion(quantity, columns)}")
        blocks = self.blocks.items()
        return {name: block.statistics(quantity) for name, block in blocks if quantity in block.columns}

    def plot(
        self,
        kind: Literal["lines", "map"] | None = None,
        quantity: str = "dx",
        ax: "Axes | None" = None,
        figure: "Figure | SubFigure | None" = None,
    ) -> "Figure | SubFigure":
        """Draw the mean of a quantity over the grids of all blocks, with its standard error.

        Args:
            kind: `lines` or `map`; None for lines, unless two axes have many values.
            quantity: a column of numbers, such as `dx`, `walk_time`, `bounces` or a drawn quantity.
            ax: where to draw a figure of one panel.
            figure: an empty figure to draw into; by default a new one.

        Returns:
            The figure, that of `ax` if it is given.

        Raises:
            InputError: no block has such a column.
            ValueError: the kind is unknown, `ax` is given together with `figure` or for several panels, or there is
                nothing to show: no axis of several values, or no walk at rest.
        """
        from warpchain.pictures.grid_figure import draw_grid

        return draw_grid(self.cell_statistics(quantity), quantity_of(quantity), kind, ax=ax, figure=figure)

    def to_xarray(self) -> "xarray.Dataset | xarray.DataTree":
        """The only block as a data set, or several as a tree with one child each.

        Raises:
            ImportError: xarray is not installed.
        """
        package = _package("xarray")
        sets = {name: block.to_xarray() for name, block in self.blocks.items()}
        attributes = self.notes()
        if len(sets) == 1:
            dataset: xarray.Dataset = next(iter(sets.values())).assign_attrs(attributes)
            return dataset
        tree: xarray.DataTree = package.DataTree.from_dict({"/": package.Dataset(attrs=attributes), **sets})
        return tree

    def to_pandas(self) -> "pandas.DataFrame":
        """All walks as one table, the name of the block in its first column; see `BlockResult.to_pandas`.

        Raises:
            ImportError: pandas is not installed.
        """
        tables = {name: block.to_pandas() for name, block in self.blocks.items()}
        for name, table in tables.items():
            table.insert(0, "block", name)
        return _package("pandas").concat(list(tables.values()), ignore_index=True)

    def notes(self) -> dict[str, Any]:
        """Attributes of a file: what the result is and how to make it again."""
        return {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "title": self.name,
            "seed": str(self.seed),
            "walks": self.walk_count,
            **{f"walks_{label}": count for label, count in self.summary().items()},
            "sweep": json.dumps(self.sweep, ensure_ascii=False),
            **{
                name: json.dumps(value) if isinstance(value, Mapping) else value
                for name, value in self.provenance.items()
            },
        }


def load(directory: Folder) -> SweepResult:
    """Read the folder of a sweep, as far as the sweep is.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is no sweep in it, or a shard is damaged or foreign.
    """
    manifest = read_manifest(directory)
    rows = missing_rows(manifest.row_type, range(manifest.walk_count))
    present = read_rows(directory, manifest)
    rows[present["index"]] = present
    motions = MotionReader(Path(directory).absolute(), manifest) if manifest.recording.series is not None else None
    blocks = {}
    for block in manifest.blocks:
        part = rows[block.first : block.first + math.prod(block.shape)].reshape(block.shape)
        names = (*COLUMNS, *map(drawn_column, block.drawn))
        blocks[block.name] = BlockResult(
            name=block.name,
            axes={name: np.array(values) for name, values in block.axes.items()},
            drawn=block.drawn,
            columns={name: np.ascontiguousarray(part[name]) for name in names},
            sweep=manifest.sweep,
            motions=motions,
        )
    return SweepResult(
        name=manifest.name,
        seed=manifest.seed,
        blocks=blocks,
        sweep=manifest.sweep,
        provenance={name: getattr(manifest, name) for name in ("digest", "numerics_version", "versions")},
    )


def _summary(status: Array) -> dict[str, int]:
    """Number of walks by status label, in the order of the codes, missing ones last."""
    counts = {code.label: int((status == code).sum()) for code in Status}
    kept = {label: count for label, count in counts.items() if count or label == Status.AT_REST.label}
    return kept | {"missing": int((status == MISSING).sum())}


def _counts(summary: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {label}" for label, count in summary.items() if count)


def _package(name: str) -> ModuleType:
    """An optional package.

    Raises:
        ImportError: it is not installed; the message says how to get it.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ImportError(f"{name} is not installed; pip install 'warpchain[xarray]'", name=name) from None
