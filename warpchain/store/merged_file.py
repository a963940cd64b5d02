"""The one HDF5 file that holds a whole sweep: rows with named axes, and the motions that were kept.

Axes and samples are dimension scales; units and meanings are attributes of every dataset, and the resolved sweep,
versions and counts by status those of the file. A single block is in the root group, which
`xarray.open_dataset(path, engine="h5netcdf")` opens; several are in groups of their names (`group=`).

Motions are one behind the other, as the CF conventions have contiguous ragged arrays: of the walk at some place,
samples `series_start` to `series_start + series_count` along `instant` are in `series_time`, `series_center_y` …;
likewise its frames along `frame`. The n joints of its frame k are from `joint_start + k n` on along `joint`.
"""

import os
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from warpchain.files import replacing
from warpchain.inputs.validation import InputError
from warpchain.store.manifest import Folder, check_not_own, read_manifest
from warpchain.store.motion_arrays import ARRAYS, count, flat_arrays
from warpchain.store.shards import open_new_hdf5, present_shards, read_motions, writing
from warpchain.store.sweep_result import FORMAT, BlockResult, SweepResult, load
from warpchain.walks.motion import Motion

if TYPE_CHECKING:
    import h5py

_AXES: Final = {"series": "instant", "frame": "frame", "joint": "joint"}
"""What is counted of a walk, see `ARRAYS` → name of the axis that it is along."""
_ROOM: Final = 2**20
"""Most bytes that a merged file takes beyond its shards, for the tables of axes."""
_NO_VARIABLE: Final = "This is a netCDF dimension but not a netCDF variable."


def merge(directory: Folder, path: str | os.PathLike[str]) -> None:
    """Write the results of a folder to one HDF5 file, whole or not at all; an older merged file is replaced.

    Raises:
        OSError: the folder cannot be read, or the file cannot be written.
        InputError: there is no sweep in the folder, a shard is damaged or foreign, or the file is one of the sweep's
            own or there already and no merged file.
    """
    result = load(directory)
    target = Path(path)
    check_not_own(directory, target)
    if os.path.lexists(target) and not _is_merged(target):
        raise InputError(f"{target}: is there and is no merged sweep; give another name")
    most = _ROOM + sum(path.stat().st_size for path in present_shards(directory, read_manifest(directory)).values())
    with writing(target), replacing(target) as part, open_new_hdf5(part, most) as file:
        _fill(file, result)


def _is_merged(path: Path) -> bool:
    """Whether `merge` has written this file."""
    import h5py

    if not path.is_file():  # opening a pipe would wait for ever
        return False
    try:
        with h5py.File(path, "r") as file:
            found = file.attrs.get("format")
            return isinstance(found, str) and found == FORMAT
    except OSError:
        return False


def _fill(file: "h5py.File", result: SweepResult) -> None:
    """Fill the empty file."""
    file.attrs.update(result.notes())
    for name, block in result.blocks.items():
        group = file if len(result.blocks) == 1 else file.create_group(name, track_order=True)
        group.attrs["block"] = name
        _write_rows(block, group)
        if block.kept.any():
            _write_motions(block, group)


def _write_rows(block: BlockResult, group: "h5py.Group") -> None:
    """Fill the group of a block with its rows."""
    coordinates, variables = block.variables()
    for name, (dims, values, notes) in {**coordinates, **variables}.items():
        if values.dtype.kind == "b":  # NetCDF has no truth values; xarray's way to write them
            values, notes = values.astype(np.int8), {**notes, "dtype": "bool"}
        if values.dtype.kind == "U":
            values = values.astype(object)
        filters = {} if name in coordinates else {"compression": "gzip", "shuffle": True}
        dataset = group.create_dataset(name, data=values, **filters)
        dataset.attrs.update(notes)
        if name in coordinates:
            dataset.make_scale(name)
        else:
            _attach(dataset, group, dims)


def _write_motions(block: BlockResult, group: "h5py.Group") -> None:
    """Add the motions of a block, one shard in memory at a time."""
    counts = {kind: np.zeros(block.shape, np.int64) for kind in _AXES}
    for place, motion in _motions(block):
        for kind, arrays in flat_arrays(motion).items():
            counts[kind].ravel()[place] = count(arrays)
    totals = {kind: total for kind, found in counts.items() if (total := int(found.sum()))}
    for kind, total in totals.items():
        # As netCDF writes a dimension that has no coordinates.
        group.create_dataset(_AXES[kind], (total,), ">f4").make_scale(f"{_NO_VARIABLE}{total:10d}")
        starts = np.cumsum(counts[kind]).reshape(block.shape) - counts[kind]
        for name, values, notes in (
            (f"{kind}_start", starts, {"description": f"place of a walk's first one along {_AXES[kind]}"}),
            (
                f"{kind}_count",
                counts[kind],
                {"description": f"number of a walk's along {_AXES[kind]}", "sample_dimension": _AXES[kind]},
            ),
        ):
            dataset = group.create_dataset(name, data=values, compression="gzip", shuffle=True)
            dataset.attrs.update({"units": "1", **notes})
            _attach(dataset, group, block.dims)
    for kind, total in totals.items():
        for name, (unit, meaning) in ARRAYS[kind].items():
            dataset = group.create_dataset(_name(kind, name), (total,), "f4" if kind == "joint" else "f8")
            dataset.attrs.update({"units": unit, "description": meaning})
            _attach(dataset, group, (_AXES[kind],))
    ends = dict.fromkeys(totals, 0)
    for _, motion in _motions(block):
        for kind, arrays in flat_arrays(motion).items():
            if kind in totals:
                first, ends[kind] = ends[kind], ends[kind] + count(arrays)
                for name, values in arrays.items():
                    group[_name(kind, name)][first : ends[kind]] = values


def _name(kind: str, name: str) -> str:
    """Name that a flat array has in the file."""
    return f"series_{name}" if kind == "series" else name


def _motions(block: BlockResult) -> Iterator[tuple[int, Motion]]:
    """The motions of a block in the order of its walks, each with its place in a flat column."""
    if block.motions is None:
        return
    places = np.flatnonzero(block.kept)
    walks = block.columns["index"].ravel()[places].tolist()
    first = walks[0] - int(places[0])
    manifest = block.motions.manifest
    for _, group in groupby(walks, lambda walk: manifest.shard_of(manifest.place(walk))):
        found = read_motions(block.motions.directory, manifest, list(group))
        yield from ((walk - first, motion) for walk, motion in found.items())


def _attach(dataset: "h5py.Dataset", group: "h5py.Group", dims: tuple[str, ...]) -> None:
    """Name the axes of a dataset."""
    for place, dim in enumerate(dims):
        dataset.dims[place].attach_scale(group[dim])
