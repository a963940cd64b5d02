"""Results of sweeps as arrays with named axes, read from a folder or from a merged file.

A folder can be read while its sweep runs: walks that are not there yet are missing, and counted.
"""

import json
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from warpchain.hdf5_files import reading_hdf5
from warpchain.inputs.validation import InputError, shown, suggestion
from warpchain.store.block_result import BlockResult, KeptMotions, Origin, counted, status_counts
from warpchain.store.cell_statistics import CellStatistics
from warpchain.store.folder import read_rows
from warpchain.store.manifest import Folder, Manifest, read_manifest, stored_sweep
from warpchain.store.repeated import place_of_index
from warpchain.store.shards import opened_motions, stamp
from warpchain.sweeps.block import Block
from warpchain.walks.rows import COLUMNS, MISSING, STORED_COLUMNS, Rows, derived_columns, drawn_column, quantity_of
from warpchain.walks.walk_result import WalkResult

if TYPE_CHECKING:
    import h5py
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

Array = NDArray[Any]

KIND: Final = "warpchain sweep result"
REMEDY: Final = "merge the folders again, or fetch another copy of the file"
WANTED: Final = "give a folder of a sweep or a merged file; a saved walk is for plot, animate and load_walk"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SweepResult:
    """What is there of a sweep. If it has just one block, everything of the block is an attribute here, too.

    Attributes:
        blocks: name → block.
        origin: what it was computed from.
    """

    blocks: dict[str, BlockResult]
    origin: Origin

    @cached_property
    def sweep(self) -> dict[str, Any]:
        """The resolved sweep, as in sweep.yaml; of several that were merged the first one."""
        return self.origin.sweeps[0].canonical()

    @property
    def name(self) -> str:
        """Name of the sweep."""
        return str(self.sweep["name"])

    @property
    def seed(self) -> int:
        """Its seed."""
        return int(self.sweep["seed"])

    @property
    def provenance(self) -> dict[str, Any]:
        """Digest of the sweep, version of the numerics, and versions of the software that began it."""
        return self.origin.provenance

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
        lines = [f"<SweepResult {self.name}: {self.walk_count} walks, {counted(self.summary())}>"]
        return "\n  ".join([*lines, *map(repr, self.blocks.values())])

    def _repr_png_(self) -> bytes | None:
        """The main figure; None if there is nothing to draw yet."""
        from warpchain.pictures.inline import first_png

        return first_png([self.plot])

    def _repr_html_(self) -> str:
        """Walks by status, axes of each block, and the main figure."""
        from warpchain.pictures.inline import axes_text, page

        blocks = [(f"block {name}", axes_text(each.axes, each.shape[-1])) for name, each in self.blocks.items()]
        walks = f"{self.walk_count:,}: {counted(self.summary())}"
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
        return status_counts(np.concatenate([block.columns["status"].ravel() for block in self.blocks.values()]))

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

    def walk(self, index: int | None = None, **words: Any) -> WalkResult:
        """Run one walk of any block again by its number; arguments and errors are those of `BlockResult.walk`.

        Its other arguments, without a number, say which walk of the only block it is.
        """
        if index is None:
            walk: WalkResult = self.__getattr__("walk")(**words)
            return walk
        block, _ = self.located(index)
        return block.walk(index, **words)

    def located(self, index: object) -> tuple[BlockResult, tuple[int, ...]]:
        """Block and place of the walk with a number; an `InputError` if there is none."""
        blocks = list(self.blocks.values())
        number, place = place_of_index([block.columns["index"] for block in blocks], index)
        return blocks[number], place

    def plot(
        self,
        kind: Literal["lines", "map"] | None = None,
        quantity: str = "dx",
        x: str | None = None,
        ax: "Axes | None" = None,
        figure: "Figure | SubFigure | None" = None,
    ) -> "Figure | SubFigure":
        """Draw the mean of a quantity over the grids of all blocks, with its standard error.

        Args:
            kind: `lines` or `map`; None for lines, unless two axes have many values.
            quantity: a column of numbers, such as `dx`, `walk_time`, `bounces` or a drawn quantity.
            x: the axis along x, such as `frequency`; by default the frequency if it has three values or more, else the
                longest axis of numbers.
            ax: where to draw a figure of one panel.
            figure: an empty figure to draw into; by default a new one.

        Returns:
            The figure, that of `ax` if it is given.

        Raises:
            InputError: no block has such a column or axis, or there is nothing to show: no axis of several values, or
                no walk that has the quantity.
            ValueError: the kind is unknown, or `ax` is given together with `figure` or for several panels.
        """
        from warpchain.pictures.grid_figure import draw_grid

        return draw_grid(self.cell_statistics(quantity), quantity_of(quantity), kind, x=x, ax=ax, figure=figure)

    def to_xarray(self) -> "xarray.Dataset | xarray.DataTree":
        """The only block as a data set, or several as a tree with one child each."""
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
        """Attributes of a file: what the result is and how to make it again."""
        sweeps = [sweep.canonical() for sweep in self.origin.sweeps]
        return {
            "title": self.name,
            "seed": ", ".join(str(sweep["seed"]) for sweep in sweeps),
            "walks": self.walk_count,
            **{f"walks_{label}": count for label, count in self.summary().items()},
            "sweep": json.dumps(sweeps if len(sweeps) > 1 else sweeps[0], ensure_ascii=False),
            **self.provenance,
            "versions": json.dumps(self.provenance["versions"]),
        }


def load(path: Folder) -> SweepResult:
    """Read the folder of a sweep, as far as the sweep is, or a file that `warpchain merge` wrote.

    Raises:
        OSError: the folder or the file cannot be read.
        InputError: there is no sweep in it, or a file is damaged, foreign or of another version.
    """
    return _load_merged(path) if os.path.isfile(path) else _load_folder(path)


def _load_folder(directory: Folder) -> SweepResult:
    folder = Path(directory).absolute()
    while True:
        manifest, begun = read_manifest(directory), stamp(directory)
        try:
            present = read_rows(directory, manifest)
            break
        except (OSError, InputError):
            if stamp(directory) == begun:  # else a run has begun anew or added samples meanwhile
                raise

    def columns(block: Block) -> dict[str, Array]:
        here = np.flatnonzero(present["block"] == manifest.sweep.blocks.index(block))
        places = _places(present, block)[here]
        found = {"index": block.indices}
        for name in ("status", *STORED_COLUMNS, *map(drawn_column, block.drawn)):
            kind = present.dtype[name]
            values = np.full(block.walk_count, np.nan if kind.kind == "f" else MISSING, kind)
            values[places] = present[name][here]
            found[name] = values.reshape(block.shape)
        return found

    provenance = {name: getattr(manifest, name) for name in ("digest", "numerics_version", "versions")}
    origin = Origin((manifest.sweep,), provenance)
    return _result(origin, columns, lambda block: partial(_motions_in_folder, folder, manifest, block))


def _places(keys: Rows, block: Block) -> NDArray[np.int64]:
    """Places of walks in a flat column of a block, given their keys; of no meaning for walks of other blocks."""
    places: NDArray[np.int64] = keys["cell"].astype(np.int64) * block.samples + keys["sample"]
    return places


def _motions_in_folder(
    folder: Path, manifest: Manifest, block: Block, places: Iterable[int]
) -> "Iterator[tuple[int, h5py.Group]]":
    """`BlockResult.kept_motions` of a block of a folder."""
    number, wanted = manifest.sweep.blocks.index(block), list(places)
    for shard in manifest.shards if wanted else ():
        there = _places(shard.keys, block)
        rows = np.flatnonzero((shard.keys["block"] == number) & np.isin(there, wanted)) if shard.keeps_motion else ()
        if len(rows):
            with opened_motions(folder, shard) as file:
                yield from ((int(there[row]), file[str(row)]) for row in rows)


def _load_merged(path: Folder) -> SweepResult:
    with reading_hdf5(path, KIND, REMEDY, WANTED) as file:
        given, versions = json.loads(file.attrs["sweep"]), json.loads(file.attrs["versions"])
        provenance = {
            "digest": file.attrs["digest"],
            "numerics_version": int(file.attrs["numerics_version"]),
            "versions": versions,
        }
        origin = Origin(
            tuple(stored_sweep(path, each) for each in (given if isinstance(given, list) else [given])), provenance
        )
        several = len(origin.sweeps[0].blocks) > 1

        def columns(block: Block) -> dict[str, Array]:
            group = file[block.name] if several else file
            names = ("index", "status", *STORED_COLUMNS, *map(drawn_column, block.drawn))
            return {name: group[name][()] for name in names}

        whole = Path(path).absolute()
        return _result(origin, columns, lambda block: partial(_motions_in_file, whole, block.name if several else "/"))


def _motions_in_file(path: Path, group: str, places: Iterable[int]) -> "Iterator[tuple[int, h5py.Group]]":
    """`BlockResult.kept_motions` of a block of a merged file, given its group."""
    with reading_hdf5(path, KIND, REMEDY, WANTED) as file:
        yield from ((place, file[f"{group}/motion/{place}"]) for place in places)


def _result(
    origin: Origin, columns: Callable[[Block], dict[str, Array]], motion: Callable[[Block], KeptMotions]
) -> SweepResult:
    """A result, given the stored columns of each block and what reads its motions."""
    blocks = {
        block.name: BlockResult(
            name=block.name,
            number=number,
            axes={name: np.array(values) for name, values in block.axes.items()},
            drawn=block.drawn,
            columns=_in_order(columns(block)),
            origin=origin,
            kept_motions=motion(block),
        )
        for number, block in enumerate(origin.sweeps[0].blocks)
    }
    return SweepResult(blocks=blocks, origin=origin)


def _in_order(stored: dict[str, Array]) -> dict[str, Array]:
    """The columns of a block, those that follow from others among them."""
    columns = stored | derived_columns(stored)
    return {name: columns[name] for name in [*COLUMNS, *(name for name in columns if name not in COLUMNS)]}
