"""Results of sweeps as arrays with named axes, read from a folder or from a merged file.

Users call `load`, and the commands `info`, `plot`, `report` and `merge` do. A folder can be read while its sweep runs;
walks that are not computed yet are counted as missing.

A merged file is one HDF5 file with a whole sweep: columns with named axes, and the recorded motions. Axes and samples
are dimension scales. Units and meanings are attributes of every dataset; the resolved sweep, versions, runs and
counts by status are attributes of the file. A single block is in the root group, which
`xarray.open_dataset(path, engine="h5netcdf")` opens; several blocks are in groups of their names (`group=`). The
recorded motions of a block are in its group `motion`, in the format of a saved walk. The name of a walk's group is the
position of the walk in a flat column. `xarray.open_datatree(path)` opens everything.
"""

import json
import os
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.chain.setup import Setup
from warpchain.files import AnyPath, FileKind, checked_output, clear_parts, given_path, write_whole
from warpchain.hdf5_files import SWEEP_FILE, Format, hdf5_image, kind_of_hdf5, reading_hdf5
from warpchain.inputs.arrays import AnyArray
from warpchain.inputs.validation import InputError, InputWarning, Named, checked_path, full_name
from warpchain.results.block_result import BlockResult, counted, located, status_counts
from warpchain.results.walk_result import WalkResult
from warpchain.store.crate import runs
from warpchain.store.folder import read_rows
from warpchain.store.shards import read_manifest, stamp, stored_sweep
from warpchain.sweeps.plan import Sweep
from warpchain.walks.cell_statistics import CellStatistics
from warpchain.walks.rows import COLUMNS, STORED_COLUMNS, checked_quantity, derived_columns, drawn_column, quantity_of
from warpchain.walks.walk_numbers import MOTION, read_motion, write_motion

if TYPE_CHECKING:
    import h5py
    import pandas
    import xarray
    from matplotlib.figure import Figure, SubFigure

    from warpchain.typed import Columns

    class _OnlyBlock(Columns):
        """What a sweep with one block has of it, to type checkers."""

        axes: dict[str, AnyArray]
        drawn: tuple[str, ...]
        columns: dict[str, AnyArray]
        dims: tuple[str, ...]
        shape: tuple[int, ...]
        is_there: NDArray[np.bool_]
        kept: NDArray[np.bool_]
        inaccurate: NDArray[np.bool_]
        faults: dict[str, NDArray[np.bool_]]
        meaning: Callable[[str], str]
        series: Callable[..., WalkResult]
        statistics: Callable[..., CellStatistics]
        design: Callable[[], xarray.DataArray]
        setup_at: Callable[[tuple[int, ...]], Setup]
        kept_motions: Callable[[Iterable[int]], Iterator[tuple[int, h5py.Group]]]
else:
    _OnlyBlock = object

MERGED: Final = Format.of("warpchain sweep result", COLUMNS, MOTION)
REMEDY: Final = "merge the folders again, or fetch another copy of the file"
TRIES, PAUSE = 100, 0.02
"""Number of attempts to read a folder whose shards are changing, and time between them [s]."""
WANTED: Final = "use the folder of a sweep or a merged file; a saved walk is for plot, animate and load_walk"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SweepResult(_OnlyBlock):
    """Results of a sweep, as far as it has run; `load` and `warpchain.sweep` return it.

    If the sweep has a single block, all attributes of the block are also attributes of the result: `result.dx`.

    Attributes:
        blocks: name of each block → its results.
        origin: definition of the sweep.
        provenance: digest of the sweep, version of the numerics, versions of the software that began it, and `runs`,
            each with its command, its times and the machines that computed its walks.
    """

    blocks: dict[str, BlockResult]
    origin: Sweep
    provenance: dict[str, Any]

    @cached_property
    def sweep(self) -> dict[str, Any]:
        """The resolved sweep, as in sweep.yaml."""
        return self.origin.canonical()

    @property
    def name(self) -> str:
        """Name of the sweep."""
        return str(self.sweep["name"])

    @property
    def seed(self) -> int:
        """Seed of the sweep."""
        return int(self.sweep["seed"])

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """An attribute of the only block."""
            blocks = self.__dict__.get("blocks", {})
            if len(blocks) == 1:
                return getattr(next(iter(blocks.values())), name)
            problem = f"{name}: unknown attribute; with several blocks use blocks[…] with one of {', '.join(blocks)}"
            raise AttributeError(problem, name=name, obj=self)

    def __dir__(self) -> list[str]:
        """Attributes, those of the only block among them."""
        only = dir(next(iter(self.blocks.values()))) if len(self.blocks) == 1 else []
        return sorted({*super().__dir__(), *only})

    def __repr__(self) -> str:
        """One line for the sweep and one for each block."""
        lines = [f"<SweepResult {self.name}: {self.walk_count} walks, {counted(self.summary())}>"]
        return "\n  ".join([*lines, *map(repr, self.blocks.values())])

    def _repr_png_(self) -> bytes | None:
        """The main figure; None if there is nothing to draw yet."""
        from warpchain.pictures.style import first_png

        return first_png([self.plot])

    def _repr_html_(self) -> str:
        """Walks by status, axes of each block, and the main figure."""
        from warpchain.pictures.style import fragment

        return fragment(repr(self), self._repr_png_())

    @property
    def walk_count(self) -> int:
        """Number of walks of the sweep, including missing ones; with `until` it grows by rounds."""
        return sum(self.summary().values())

    @property
    def missing_count(self) -> int:
        """Number of walks not computed yet."""
        return self.summary()["missing"]

    def summary(self) -> dict[str, int]:
        """Number of walks by status label; `at_rest` and `missing` always, others if there are any."""
        blocks = self.blocks.values()
        statuses, missing = ([getattr(each, name).ravel() for each in blocks] for name in ("status", "is_missing"))
        return status_counts(np.concatenate(statuses), np.concatenate(missing))

    @property
    def inaccurate_count(self) -> int:
        """Number of inaccurate walks of any status."""
        return sum(int(block.inaccurate.sum()) for block in self.blocks.values())

    def unit(self, name: str) -> str:
        """SI unit of a column or an axis of any block, "1" for pure numbers; an `UnknownNameError` if there is none."""
        first, *others = self.blocks.values()
        known = (block for block in others if name in (*block.columns, *block.dims, *block.block.points))
        return next(known, first).unit(name)

    def cell_statistics(self, quantity: str = "dx") -> dict[str, CellStatistics]:
        """Name of each block that has a column of numbers → its statistics, see `BlockResult.statistics`.

        Raises:
            UnknownNameError: no block has such a column.
        """
        known = {name: None for block in self.blocks.values() for name in block.columns}
        checked_quantity(quantity, known, "quantity")
        blocks = self.blocks.items()
        return {name: block.statistics(quantity) for name, block in blocks if quantity in block.columns}

    def walk(self, index: int | None = None, **words: Any) -> WalkResult:
        """Run one walk again; arguments and errors are those of `BlockResult.walk`.

        `index` selects a walk of any block; the other arguments select a walk of the only block.
        """
        if index is None and len(self.blocks) > 1:
            raise InputError("index: missing; pass the number of a walk, or call walk of one of the blocks")
        block = next(iter(self.blocks.values())) if index is None else self.located(index)[0]
        return block.walk(index, **words)

    def located(self, index: object) -> tuple[BlockResult, tuple[int, ...]]:
        """Block of the walk with a number, and its position there; an `InputError` if it does not exist."""
        return located(list(self.blocks.values()), index)

    def plot(
        self,
        quantity: str = "dx",
        x: str | None = None,
        figure: "Figure | SubFigure | None" = None,
        width: float | None = None,
    ) -> "Figure | SubFigure":
        """Draw the mean of a quantity over the grids of all blocks, with its standard error.

        Args:
            quantity: a column of numbers, such as `dx`, `walk_time`, `bounces` or a sampled quantity.
            x: the axis along x; None: the frequency if it has at least three values, otherwise the longest axis of
                numbers.
            figure: an empty figure to draw into; None: a new one.
            width: width of a new figure [mm], e.g. 85 for a column of a paper; texts then have at least 6 pt.

        Returns:
            The figure.

        Raises:
            InputError: the column or axis does not exist, no axis has several values, or no walk has the quantity.
        """
        from warpchain.pictures.grid_figure import draw_grid
        from warpchain.pictures.style import on_paper

        found = {name: self.blocks[name].named_sets(cells) for name, cells in self.cell_statistics(quantity).items()}
        with on_paper(width) as inches:
            title = self.setting([*found])
            return draw_grid(found, quantity_of(quantity), full_name(x), figure=figure, title=title, width=inches)

    def setting(self, blocks: Sequence[str]) -> str:
        """What the walks of some blocks have in common that differs from the defaults, and how many they are."""
        from warpchain.pictures.labels import differences, math_symbol

        given = [block for block in self.sweep["blocks"] if block["name"] in blocks]
        alike = [differences(block["scene"] | block["parameters"], block.get("preset"), math_symbol) for block in given]
        common = [text for text in alike[0] if all(text in others for others in alike)]
        cells = [self.blocks[name].statistics() for name in blocks]
        numbers = [
            self.blocks[name].shape[-1] if each.reached is None else each.count + each.absent + each.failed
            for name, each in zip(blocks, cells, strict=True)
        ]
        samples = sorted({int(number) for each in numbers for number in np.ravel(each)})
        failed = sum(int(each.failed.sum()) for each in cells)
        many = f"{'–'.join(map(str, samples[:: max(1, len(samples) - 1)]))} sample{'s' * (samples != [1])} in each cell"
        return ", ".join([*common, many, *[f"{failed:,} walks failed"] * (failed > 0)])

    def to_xarray(self) -> "xarray.Dataset | xarray.DataTree":
        """The only block as a Dataset, or several blocks as a DataTree with one child each."""
        import xarray

        sets = {name: block.to_xarray() for name, block in self.blocks.items()}
        if len(sets) == 1:
            return next(iter(sets.values())).assign_attrs(self.notes())
        return xarray.DataTree.from_dict({"/": xarray.Dataset(attrs=self.notes()), **sets})

    def to_pandas(self) -> "pandas.DataFrame":
        """All walks as one table, the name of the block in its first column; see `BlockResult.to_pandas`."""
        import pandas

        tables = {name: block.to_pandas() for name, block in self.blocks.items()}
        for name, table in tables.items():
            table.insert(0, "block", name)
        return pandas.concat(list(tables.values()), ignore_index=True)

    def notes(self) -> dict[str, Any]:
        """Attributes of a file: name, seed, counts, definition and versions of the sweep."""
        return {
            "title": self.name,
            "seed": str(self.seed),
            "walks": self.walk_count,
            **{f"walks_{label}": count for label, count in self.summary().items()},
            "sweep": json.dumps(self.sweep, ensure_ascii=False),
            **self.provenance,
            **{name: json.dumps(self.provenance[name], ensure_ascii=False) for name in ("versions", "runs")},
        }


def load(path: AnyPath | Sequence[AnyPath]) -> SweepResult:
    """Load the results of a sweep, as far as it has run.

    Args:
        path: the folder of the sweep, or a file that `warpchain merge` wrote; or several of them with different walks
            of one sweep, such as its parts.

    Raises:
        OSError: a folder or a file cannot be read.
        InputError: the path holds no sweep, a file is damaged or of another version, or the paths belong to different
            sweeps.
    """
    if isinstance(path, Sequence) and not isinstance(path, str | bytes):
        return _together(path)
    given = checked_path(path, "path")
    return _load_merged(given) if os.path.isfile(given) else _load_folder(given)


def _together(sources: Sequence[AnyPath]) -> SweepResult:
    """The results of several folders and merged files as one; errors are those of `load`."""
    if not sources:
        raise InputError("path: expected folders of a sweep, got an empty list; pass them")
    first, *others = sources
    whole = load(first)
    for folder in others:
        result = load(folder)
        if any(whole.provenance[name] != result.provenance[name] for name in ("digest", "numerics_version")):
            raise InputError(
                f"{folder}: expected a part of the sweep in {first}, got another sweep; use parts of one sweep"
            )
        blocks = Named[BlockResult]()
        for block, other in zip(whole.blocks.values(), result.blocks.values(), strict=True):
            there = block.is_there
            if (there & other.is_there).any():
                raise InputError(f"{folder}: repeats walks of an earlier folder; pass each part of a sweep once")
            columns = Named({key: np.where(there, each, other.columns[key]) for key, each in block.columns.items()})
            blocks[block.name] = replace(block, columns=columns, motions=np.where(there, block.motions, other.motions))
        ran = [*whole.provenance["runs"], *result.provenance["runs"]]
        whole = replace(whole, blocks=blocks, provenance=whole.provenance | {"runs": ran})
    return whole


def _load_folder(directory: AnyPath) -> SweepResult:
    for left in reversed(range(TRIES)):
        begun = stamp(directory) if os.path.lexists(Path(directory) / SWEEP_FILE) else ""  # then the next line refuses
        manifest = read_manifest(directory)
        try:
            rows, motions = read_rows(directory, manifest)
            break
        except (OSError, InputError) as error:
            # A run may begin anew meanwhile, which deletes shards and then replaces sweep.h5, or add samples.
            is_deleting = isinstance(error, FileNotFoundError)
            if not left or not (is_deleting or stamp(directory) != begun):
                raise
            time.sleep(PAUSE * is_deleting)
    provenance = {"digest": manifest.sweep.digest(), "numerics_version": manifest.numerics_version}
    provenance |= {"versions": manifest.versions, "runs": runs(directory)}
    return _result(manifest.sweep, provenance, rows, motions)


def _load_merged(path: AnyPath) -> SweepResult:
    opened = partial(reading_hdf5, Path(path).absolute(), MERGED, REMEDY, WANTED)
    with reading_hdf5(path, MERGED, REMEDY, WANTED) as file:
        sweep = stored_sweep(path, json.loads(file.attrs["sweep"]))
        provenance = {"digest": file.attrs["digest"], "numerics_version": int(file.attrs["numerics_version"])}
        provenance |= {name: json.loads(file.attrs.get(name, "[]")) for name in ("versions", "runs")}
        groups = [file[block.name] if len(sweep.blocks) > 1 else file for block in sweep.blocks]
        motions = [np.full(block.shape, None) for block in sweep.blocks]
        for group, found in zip(groups, motions, strict=True):
            for place in group.get("motion", ()):
                found.flat[int(place)] = opened, f"{group.name}/motion/{place}"
        return _result(sweep, provenance, groups, motions)


def _result(sweep: Sweep, provenance: dict[str, Any], stored: Sequence[Any], motions: Sequence[Any]) -> SweepResult:
    """A result, given for each block what has its stored columns by name, and its motions, both in any shape."""
    blocks = Named[BlockResult]()
    for number, block in enumerate(sweep.blocks):
        drawn = [*map(drawn_column, block.drawn)]
        names = ("status", *STORED_COLUMNS, *drawn)
        columns = {name: np.ascontiguousarray(stored[number][name]).reshape(block.shape) for name in names}
        columns |= {"index": block.indices} | derived_columns(columns)
        blocks[block.name] = BlockResult(
            name=block.name,
            number=number,
            axes=Named({name: np.array(values) for name, values in block.axes.items()}),
            drawn=block.drawn,
            columns=Named({name: columns[name] for name in (*COLUMNS, *drawn)}),
            origin=sweep,
            versions=provenance["versions"],
            motions=motions[number].reshape(block.shape),
        )
    return SweepResult(blocks=blocks, origin=sweep, provenance=provenance)


def merge(sources: AnyPath | Sequence[AnyPath], path: AnyPath) -> None:
    """Write the results of a sweep to one HDF5 file, whole or not at all; an older merged file is replaced.

    The file is made in memory.

    Args:
        sources: the folder of the sweep, or several, or merged files, which have different walks of one sweep.
        path: the file. An `InputWarning` says how many walks are missing in it, if any are.

    Raises:
        OSError: a folder cannot be read, or the file cannot be written, or is there already and no merged file.
        InputError: there is no sweep in a folder, a shard is damaged or foreign, or sweeps do not fit together.
    """
    target = given_path(path)
    checked_output(target, _MERGED)
    clear_parts(target)
    whole = load(sources)
    write_whole(target, hdf5_image(MERGED, partial(_fill, whole=whole)), _MERGED)
    if missing := whole.missing_count:
        problem = f"{missing:,} of {whole.walk_count:,} walks are missing"
        remedy = "merge again with all parts, once they have run"
        warnings.warn(f"{path}: {problem}; {remedy}", InputWarning, stacklevel=2)


def _is_merged(path: Path) -> bool:
    """Whether `merge` has written this file, and nothing has damaged it since; an `OSError` if it cannot be read."""
    try:
        return not path.is_symlink() and path.is_file() and kind_of_hdf5(path, WANTED) == MERGED.kind
    except InputError:
        return False


_MERGED: Final = FileKind("merged sweep", _is_merged)
"""All that a merged file replaces."""


def _fill(file: "h5py.File", whole: SweepResult) -> None:
    """Fill the empty file."""
    file.attrs.update(whole.notes())
    for name, block in whole.blocks.items():
        group = file if len(whole.blocks) == 1 else file.create_group(name, track_order=True)
        group.attrs["block"] = name
        coordinates, variables = block.variables()
        if further := [name for name, (dims, _, _) in coordinates.items() if dims != (name,)]:
            group.attrs["coordinates"] = " ".join(further)  # as xarray has it
        for name, (dims, values, notes) in {**coordinates, **variables}.items():
            _put(group, name, values, notes, () if dims == (name,) else dims)
        for place, motion in block.kept_motions(np.flatnonzero(block.kept)):
            copied = group.create_group(f"motion/{place}", track_order=True)
            write_motion(copied, read_motion(motion, 0), np.float32)  # HDF5 copies no names of dimensions


def _put(group: "h5py.Group", name: str, values: AnyArray, notes: Mapping[str, Any], dims: Sequence[str]) -> None:
    """Write a variable along some axes, or one of the axes; each is closed here, on which bytes depend."""
    if values.dtype.kind == "b":  # NetCDF has no truth values; xarray's way to write them
        values, notes = values.astype(np.int8), {**notes, "dtype": "bool"}
    data = values.astype(object) if values.dtype.kind == "U" else values
    dataset = group.create_dataset(name, data=data, **({"compression": "gzip", "shuffle": True} if dims else {}))
    dataset.attrs.update(notes)
    if not dims:
        dataset.make_scale(name)
    for place, dim in enumerate(dims):
        dataset.dims[place].attach_scale(group[dim])
