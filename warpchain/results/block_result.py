"""The results of one block of a sweep as arrays with named axes; `SweepResult.blocks` holds them."""

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.chain.keep import FRAME_INTERVAL
from warpchain.chain.setup import Setup
from warpchain.inputs.arrays import AnyArray
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import (
    InputError,
    InputWarning,
    UnknownNameError,
    by_name,
    checked,
    plain,
    shown,
    suggestion,
)
from warpchain.results.walk_result import WalkResult
from warpchain.status import Status
from warpchain.sweeps.block import POINT, Block
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.plan import Sweep
from warpchain.sweeps.rounds import Asked
from warpchain.walks import rows
from warpchain.walks.cell_statistics import CellStatistics, known_values
from warpchain.walks.control_variates import controlled
from warpchain.walks.landmarks import LENGTHS
from warpchain.walks.rows import COLUMNS, MISSING, Column, checked_quantity, quantity_of
from warpchain.walks.walk_numbers import read_motion

if TYPE_CHECKING:
    import h5py
    import pandas
    import xarray

    from warpchain.typed import Columns
else:
    Columns = object

RANDOMISATION: Final = "randomisation"
_NUMBERED: Final = {
    "sample": "number of the sample in its cell",
    POINT: "number of the parameter set",
    RANDOMISATION: "number of the randomisation; the spread between the means of several tells the error of a mean",
}
"""Coordinates that number something → their meaning."""

_MOST_NAMED: Final = 3
"""Most quantities of a parameter set that its name has."""
_Variables = dict[str, tuple[tuple[str, ...], AnyArray, dict[str, Any]]]
"""Name → axes, values and attributes, as xarray takes them."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BlockResult(Columns):
    """Results of one block of a sweep, as arrays of shape `shape` with the axes `dims`.

    Every column is an attribute, e.g. `block.dx` and `block.status`. Columns are those of
    `warpchain.walks.rows.COLUMNS`, and NAME_drawn for each sampled quantity. Missing values are NaN, or −1 in integer
    columns such as `status`.

    Attributes:
        name: name of the block.
        number: number of the block in the sweep.
        axes: name of each axis of the grid → its values in order; null is None. The samples are an additional axis.
        drawn: names of the sampled quantities; their values are in the columns NAME_drawn.
        columns: name of each column → its values.
        origin: definition of the sweep.
        versions: versions of the software with which the sweep was begun.
        motions: for each walk the file and the group of its recorded motion; None if none was recorded.
    """

    name: str
    number: int
    axes: dict[str, AnyArray]
    drawn: tuple[str, ...]
    columns: dict[str, AnyArray]
    origin: Sweep
    versions: dict[str, str]
    motions: AnyArray

    @property
    def block(self) -> Block:
        """Definition of this block in the sweep."""
        return self.origin.blocks[self.number]

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the axes of every column."""
        return (*self.axes, "sample")

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis, then the number of samples."""
        return self.columns["index"].shape

    if not TYPE_CHECKING:  # a type checker knows the columns, and what is none

        def __getattr__(self, name: str) -> AnyArray:
            """A column."""
            columns = self.__dict__.get("columns", {})
            if name not in columns:
                raise AttributeError(f"{name}: unknown column; {suggestion(name, [*columns])}", name=None)
            return columns[name]

    def __dir__(self) -> list[str]:
        """Attributes, columns among them."""
        return sorted({*super().__dir__(), *self.columns})

    def __repr__(self) -> str:
        """One line with axes and counts."""
        sizes = ", ".join(f"{name}: {size}" for name, size in zip(self.dims, self.shape, strict=True))
        return f"<BlockResult {self.name} ({sizes}): {counted(self.summary())}>"

    def unit(self, name: str) -> str:
        """SI unit of a column or an axis, "1" for pure numbers; an `UnknownNameError` if there is none."""
        return self._column(name).unit

    def meaning(self, name: str) -> str:
        """One line saying what a column or an axis is; an `UnknownNameError` if there is none."""
        return self._column(name).meaning

    def _column(self, name: str) -> Column:
        if name in _NUMBERED:
            return Column("<i8", "1", _NUMBERED[name])
        if name not in (known := (*self.columns, *self.axes, *self.block.points)):
            raise UnknownNameError(f"{shown(name)}: not a column or an axis; {suggestion(name, known)}")
        return COLUMNS[name] if name in COLUMNS else rows.field_column(name)

    @property
    def is_there(self) -> NDArray[np.bool_]:
        """Whether a walk has been computed, shape `shape`."""
        return np.asarray(self.columns["status"] != MISSING)

    @cached_property
    def _asked(self) -> Asked:
        return Asked.of(self.block, self.columns)

    @property
    def is_missing(self) -> NDArray[np.bool_]:
        """Whether a walk is still to be computed, shape `shape`; with `until` of the cell, as far as is known."""
        return self._asked.walks.reshape(self.shape) & ~self.is_there

    @property
    def kept(self) -> NDArray[np.bool_]:
        """Whether the motion of a walk was recorded and is available, shape `shape`."""
        return np.asarray(self.motions != None)  # noqa: E711 - of each element

    def kept_motions(self, places: Iterable[int]) -> "Iterator[tuple[int, h5py.Group]]":
        """Places in a flat column and groups of kept motions, file by file; errors as of `series`."""
        files: dict[Any, list[tuple[int, str]]] = {}
        for place in places:
            opened, group = self.motions.flat[place]
            files.setdefault(opened, []).append((place, group))
        for opened, walks in files.items():
            with opened() as file:
                yield from ((place, file[group]) for place, group in walks)

    def series(self, *, sample: int = 0, **at: float | str | None) -> WalkResult:
        """Return a walk whose motion was recorded: `series(links=60, frequency=15, sample=2).time`.

        Args:
            sample: number of the sample.
            at: value of each axis; optional for an axis with a single value.

        Raises:
            InputError: the walk does not exist, or its motion was not recorded or is not available yet.
            OSError: its file cannot be read.
        """
        return self.walk_motion(self.place(sample, at))

    def place(self, sample: int, at: Mapping[str, float | str | None]) -> tuple[int, ...]:
        """Position of a walk along the axes and samples; arguments are those of `series`."""
        at = by_name(at)
        if unknown := [name for name in at if name not in self.axes]:
            raise InputError(
                f"{unknown[0]}: not an axis of block {self.name}; {suggestion(unknown[0], tuple(self.axes))}"
            )
        place = []
        for name, values in self.axes.items():
            wanted = plain(at[name], name) if name in at else values[0]
            found = [k for k, value in enumerate(values.tolist()) if value == wanted]
            if not len(found) or (name not in at and len(values) > 1):
                problem = f"{shown(at[name])} is not on the axis" if name in at else "missing"
                raise InputError(f"{name}: {problem}; use one of {', '.join(map(str, values))}")
            place.append(found[0])
        if type(plain(sample)) is not int or not 0 <= sample < self.shape[-1]:
            raise InputError(f"sample: expected 0 to {self.shape[-1] - 1}, got {shown(sample)}; use one of them")
        return (*place, sample)

    def setup_at(self, place: tuple[int, ...]) -> Setup:
        """Setup of the walk at a position along the axes, including its sampled values."""
        return self.origin.walk(int(self.columns["index"][place])).setup

    def walk(
        self,
        index: int | None = None,
        *,
        sample: int | None = None,
        frame_interval: float | None = FRAME_INTERVAL,
        record_before: float | None = None,
        record_joint_forces: bool = False,
        **at: Any,
    ) -> WalkResult:
        """Run one walk again, with series and frames: `walk(17)`, or `walk(links=60, frequency=15, sample=2)`.

        The same version on the same kind of processor reproduces the walk bit for bit.

        Args:
            index: number of the walk, from the column `index`; it does not change when samples are added. None: the
                walk is selected by `sample` and `at`.
            sample: number of the sample; None: 0.
            frame_interval: as in `warpchain.walk`.
            record_before: as in `warpchain.walk`.
            record_joint_forces: as in `warpchain.walk`.
            at: value of each axis; optional for an axis with a single value.

        Raises:
            InputError: the walk does not exist, or a value is refused.

        Warns:
            InputWarning: Δx or status differ from those in the sweep.
        """
        if index is None:
            place = self.place(0 if sample is None else sample, at)
        elif words := [*at, *["sample"] * (sample is not None)]:
            raise InputError(f"{', '.join(words)}: not possible with index; remove one")
        else:
            _, place = located([self], index)
        from warpchain.results.one_walk import run_walk

        recording = {
            "frame_interval": frame_interval,
            "record_before": record_before,
            "record_joint_forces": record_joint_forces,
        }
        walk = run_walk(self.setup_at(place), seed=self.origin.seed, **recording)  # type: ignore[arg-type]
        dx, number = self.columns["dx"][place], self.columns["index"][place]
        if self.is_there[place] and not self.has_same(walk, place):
            problem = f"walk {number}: Δx is {walk.dx:g} m, and {dx:g} m in the sweep"
            remedy = "use the version that ran it, on the same kind of processor, to reproduce it bit for bit"
            warnings.warn(f"{problem}; {remedy}", InputWarning, stacklevel=2)
        return walk

    def has_same(self, walk: WalkResult, place: tuple[int, ...]) -> bool:
        """Whether a walk has the status and Δx of that at a place."""
        status, dx = self.columns["status"][place], self.columns["dx"][place]
        return bool(walk.status == status and (walk.dx == dx or (math.isnan(walk.dx) and math.isnan(dx))))

    def walk_motion(self, place: tuple[int, ...]) -> WalkResult:
        """The walk at a place along the axes and samples, if its motion was kept; errors as of `series`."""
        if not self.kept[place]:
            kept = np.flatnonzero(self.kept.any(axis=tuple(range(len(self.axes)))))
            samples = ", ".join(map(str, kept[:12]))
            remedy = f"use one of the samples {samples}" if samples else "a sweep with record: {series: true} keeps it"
            raise InputError(f"the motion of walk {self.columns['index'][place]} is not there; {remedy}")
        numbers: dict[str, Any] = {}
        for name, column in rows.STORED_COLUMNS.items():
            owner = numbers.setdefault(column.path[0], {}) if column.path[1:] else numbers
            owner[column.path[-1]] = self.columns[name][place].item()
        setup = self.setup_at(place)
        at = [int(np.ravel_multi_index(place, self.shape))]
        (motion,) = (read_motion(group, setup.scene.links) for _, group in self.kept_motions(at))
        return WalkResult(
            status=Status(int(self.columns["status"][place])),
            **numbers,
            **motion,
            wall_time=math.nan,
            setup=setup,
            seed=self.origin.seed,
            versions=self.versions,
        )

    def summary(self) -> dict[str, int]:
        """Number of walks by status label; `at_rest` and `missing` always, others if there are any."""
        return status_counts(self.columns["status"], self.is_missing)

    @cached_property
    def faults(self) -> dict[str, NDArray[np.bool_]]:
        """Kind of inaccuracy, a key of `warpchain.walks.landmarks.FAULTS` → whether each walk has it."""
        return rows.faults_of_columns(self.columns, {name: self.block.parameter(name) for name in LENGTHS})

    @property
    def inaccurate(self) -> NDArray[np.bool_]:
        """Whether a walk has one of the `faults`, shape `shape`."""
        return np.asarray(np.any([*self.faults.values()], axis=0))

    def values(self, name: str = "dx") -> NDArray[np.float64]:
        """A column of numbers, shape `shape`, which `statistics` averages; NaN for walks excluded from means."""
        return known_values(self.columns[checked_quantity(name, self.columns, "name")], self.columns["status"])

    def statistics(self, name: str = "dx", *, control: bool = False) -> CellStatistics:
        """Statistics of a column in each cell, over the walks at rest that have a value.

        Walks without a value (NaN or −1), e.g. `bounces_before_collapse` of a loop that never collapsed, are excluded
        from means and counted in `absent`. Quasi-random designs have a standard error if there are several
        randomisations.

        Args:
            name: the column.
            control: whether means of random samples are corrected, and their errors reduced, by a regression on what
                the samples drew, whose means are known; `worth` of the result says how many walks that is worth. Cells
                in which a walk failed, or that have few walks more than drawn quantities, have no such mean (NaN).

        Raises:
            UnknownNameError: there is no such column of numbers.
            InputError: `control` of samples that are not random, draw nothing, or had to be drawn again.
        """
        column, status = self.columns[checked_quantity(name, self.columns, "name")], self.columns["status"]
        is_bounded = name == "dx" and (status == Status.DISTANCE_LIMIT).any()
        farthest = self._farthest() if is_bounded else np.array(np.nan)
        cells = CellStatistics.of(self.axes, self.unit(name), column, status, self.block.groups, farthest)
        reached = self._asked.reached.reshape(cells.mean.shape) if self.block.until else None
        cells = replace(cells, missing=self.is_missing.sum(axis=-1), reached=reached)
        return self._controlled(cells, name) if checked(control, "control", bool) else cells

    def _controlled(self, cells: CellStatistics, name: str) -> CellStatistics:
        """The statistics of a column with corrected means; errors as of `statistics`."""
        if self.block.sampler != "random" or not self.drawn:
            problem = f"a {self.block.sampler} design fills the ranges evenly" if self.drawn else "nothing is sampled"
            raise InputError(f"control: {problem}, so there is nothing to correct; remove it")
        drawn = np.stack([self.columns[rows.drawn_column(each)] for each in self.drawn], axis=-1)
        expected = np.empty((*cells.mean.shape, len(self.drawn)))
        for cell in np.ndindex(*cells.mean.shape):
            expected[cell] = self.origin.expected(self.block, cell, self.is_there[cell], drawn[cell])
        return controlled(cells, self.values(name), drawn, expected)

    def named_sets(self, cells: CellStatistics) -> CellStatistics:
        """The statistics of some cells, with parameter sets named by their values, as figures show them."""
        from warpchain.pictures.labels import named_values

        if POINT not in self.axes:
            return cells
        texts = [named_values(name, values) for name, values in self.block.points.items()]
        names = [", ".join(parts) for parts in zip(*texts[:_MOST_NAMED], strict=True)]
        if len(texts) > _MOST_NAMED or len(set(names)) < len(names):
            names = [f"{number}: {name}" for number, name in enumerate(names)]
        return replace(cells, axes=cells.axes | {POINT: np.array(names)})

    def _farthest(self) -> NDArray[np.float64]:
        """Distance [m] that walks which ended by it had come, in each cell; NaN where the floor may rise ahead.

        On such a floor a chain may slide back, and end behind the sprocket.
        """
        if {"slope", "distance_limit"} & {*self.drawn}:
            return np.array(np.nan)

        def limit(setup: Setup) -> float:
            scene = setup.scene
            heights = [0.0] if scene.floor == "flat" else [row[1] for row in scene.floor]
            falls = scene.slope >= 0 and bool((np.diff(heights) <= 0).all())
            return scene.distance_limit if scene.distance_limit is not None and falls else math.nan

        return self.block.over_cells(("slope", "distance_limit", "floor"), limit)[..., 0]

    def design(self) -> "xarray.DataArray":
        """The design matrix: every value that differs between walks and is not an axis of the grid.

        These are the values of parameter sets (`points`) and sampled values. Their names are along the last axis,
        `quantity`; missing walks are NaN.
        """
        points = [*self.block.points]
        if words := [name for name, values in self.block.points.items() if isinstance(values[0], str)]:
            raise InputError(f"{words[0]}: its values are words, and a design matrix has numbers; use to_xarray()")
        if not points and not self.drawn:
            raise InputError(f"block {self.name}: its walks differ only along the axes; use to_xarray()")
        whole = self.to_xarray().reset_coords(points)[[*points, *map(rows.drawn_column, self.drawn)]]
        array = whole.to_dataarray("quantity").astype(float).assign_coords(quantity=[*points, *self.drawn])
        return array.transpose(*self.dims, "quantity")

    def to_xarray(self) -> "xarray.Dataset":
        """The block as a data set with named coordinates, units and meanings."""
        import xarray

        coordinates, variables = self.variables()
        return xarray.Dataset(variables, coordinates, {"block": self.name})

    def to_pandas(self) -> "pandas.DataFrame":
        """The block as a table with one row for each walk: values of the axes, sample, columns; statuses by label."""
        table = self.to_xarray().to_dataframe().reset_index()
        table = table[(self.is_there | self.is_missing).ravel()].reset_index(drop=True)
        labels = {MISSING: "missing"} | {int(status): status.label for status in Status}
        return table.assign(status=table["status"].map(labels))

    def variables(self) -> tuple[_Variables, _Variables]:
        """Coordinates and variables; null among numbers is NaN."""
        along = {name: (name, values) for name, values in self.axes.items()}
        along |= {"sample": ("sample", np.arange(self.shape[-1]))}
        along |= {name: (POINT, np.array(values)) for name, values in self.block.points.items()}
        if SAMPLERS[self.block.sampler].engine is not None:
            along[RANDOMISATION] = "sample", self.block.groups
        coordinates: _Variables = {
            name: ((dim,), values.astype(float) if values.dtype.kind == "O" else values, self.notes(name))
            for name, (dim, values) in along.items()
        }
        return coordinates, {name: (self.dims, values, self.notes(name)) for name, values in self.columns.items()}

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


def status_counts(status: AnyArray, is_missing: NDArray[np.bool_]) -> dict[str, int]:
    """Number of walks by status label, in the order of the codes, missing ones last."""
    counts = {code.label: int((status == code).sum()) for code in Status}
    kept = {label: count for label, count in counts.items() if count or label == Status.AT_REST.label}
    return kept | {"missing": int(is_missing.sum())}


def counted(summary: Mapping[str, int]) -> str:
    """Numbers of walks by status, in words."""
    return ", ".join(f"{count} {label}" for label, count in summary.items() if count)


def located(blocks: Sequence[BlockResult], index: object) -> tuple[BlockResult, tuple[int, ...]]:
    """Block and place along axes and samples of the walk with a number; an `InputError` if there is none."""
    number: int = checked(index, "index", int)
    found = [(block, tuple(map(int, at))) for block in blocks for at in np.argwhere(block.columns["index"] == number)]
    if not found:
        largest = max(int(block.columns["index"].max()) for block in blocks)
        raise InputError(
            f"index: expected a number in the column index, at most {largest}, got {number}; use one of these"
        )
    return found[0]
