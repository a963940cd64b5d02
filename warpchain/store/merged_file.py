"""The one HDF5 file that holds a whole sweep, or several of one grid: rows with named axes, and the kept motions.

Axes and samples are dimension scales; units and meanings are attributes of every dataset, and the resolved sweep,
versions and counts by status those of the file. A single block is in the root group, which
`xarray.open_dataset(path, engine="h5netcdf")` opens; several are in groups of their names (`group=`).

Motions are one behind the other, as the CF conventions have contiguous ragged arrays: of the walk at some place,
samples `series_start` to `series_start + series_count` along `instant` are in `series_time`, `series_center_y` …;
likewise its frames along `frame`. The n joints of its frame k are from `joint_start + k n` on along `joint`.

Checksums stand at its end, see `warpchain.hdf5_files`; `check_merged` compares them.

Samples of several sweeps stand one behind the other along `sample`; `seed` has the seed of each, and `index` the number
of a walk in its own sweep.
"""

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.files import Kind, checked_output, given_path, replacing
from warpchain.hdf5_files import check_hdf5, open_new_hdf5, put_text, reading_hdf5
from warpchain.inputs.validation import InputError
from warpchain.store.manifest import Folder, check_not_own, read_manifest
from warpchain.store.motion_arrays import ARRAYS, count, flat_arrays
from warpchain.store.shards import present_shards, read_motions, writing
from warpchain.store.sweep_result import FORMAT, BlockResult, SweepResult, load
from warpchain.sweeps.plan import load_sweep
from warpchain.walks.motion import Motion

if TYPE_CHECKING:
    import h5py

_AXES: Final = {
    "series": "instant",
    "plane": "plane_instant",
    "frame": "frame",
    "frame_plane": "frame_plane",
    "joint": "joint",
}
"""What is counted of a walk, see `ARRAYS` → name of the axis that it is along."""
_ROOM: Final = 2**19
"""Most bytes that a block takes in a merged file beyond its rows and motions: 156 kB were seen."""
_REMEDY: Final = "merge the folders again, or fetch another copy of the file"
_WANTED: Final = "give a folder of a sweep, or a file that warpchain merge wrote"
_NO_VARIABLE: Final = "This is a netCDF dimension but not a netCDF variable."


def merge(directories: Folder | Sequence[Folder], path: str | os.PathLike[str]) -> None:
    """Write the results of a folder to one HDF5 file, whole or not at all; an older merged file is replaced.

    Args:
        directories: the folder, or several whose sweeps differ in nothing but seed, samples and names; their samples
            are put together.
        path: the file.

    Raises:
        OSError: a folder cannot be read, or the file cannot be written, or is there already and no merged file.
        InputError: there is no sweep in a folder, a shard is damaged or foreign, sweeps do not fit together, or the
            file is one of a sweep's own.
    """
    folders = [directories] if isinstance(directories, str | os.PathLike) else list(directories)
    target = given_path(path)
    for folder in folders:
        check_not_own(folder, target)
    with writing(target):
        checked_output(target, _MERGED)
    _check_fit(folders)
    results = [load(folder) for folder in folders]
    most = 0
    for folder in folders:
        manifest = read_manifest(folder)
        most += _ROOM * len(manifest.blocks) + 2 * (Path(folder) / "sweep.json").stat().st_size  # texts and axes
        most += sum(path.stat().st_size for path in present_shards(folder, manifest).values())
    with writing(target), replacing(target, _MERGED) as part, open_new_hdf5(part, most) as file:
        _fill(file, results)


def check_merged(path: str | os.PathLike[str]) -> dict[str, str | int]:
    """Check every byte of a merged file.

    Returns:
        What it says of itself: title, seed, number of walks, and of walks by status.

    Raises:
        OSError: it cannot be read.
        InputError: it is no merged file.
        DamagedFileError: it is damaged or cut short, or of a version without checksums.
    """
    check_hdf5(path, _REMEDY, _WANTED)
    with reading_hdf5(path, _REMEDY) as contents:
        if contents.text("format") == FORMAT:
            counts = {name: contents.whole(name) for name in contents.attributes() if name.startswith("walks")}
            return {"title": contents.text("title"), "seed": contents.text("seed"), **counts}
    raise InputError(f"{path}: HDF5, but no merged sweep; {_WANTED}")


def _check_fit(folders: Sequence[Folder]) -> None:
    """Refuse folders whose samples are not independent samples of the same cells.

    Raises:
        InputError: sweeps differ in more than seed, samples and names, or some of their walks are the same.
    """
    seeds: dict[int, Folder] = {}
    expected = None
    for folder in folders if len(folders) > 1 else ():
        manifest = read_manifest(folder)
        sweep = load_sweep(manifest.sweep)
        if (other := seeds.get(manifest.seed)) is not None:
            if os.path.samefile(other, folder):
                raise InputError(f"{folder}: given twice; give each folder once")
            raise InputError(
                f"{folder}: has seed {manifest.seed}, as {other} has, so that walks are the same; "
                "give sweeps with different seeds"
            )
        seeds[manifest.seed] = folder
        for block in sweep.blocks:
            if not block.drawn:
                raise InputError(f"{folder}: block {block.name} draws nothing, so that more samples are the same walks")
        cells = (replace(sweep, seed=0).digest([1] * len(sweep.blocks)), manifest.numerics_version)
        expected = expected or cells
        if cells != expected:
            raise InputError(
                f"{folder}: is not the sweep of {folders[0]} with another seed; give folders that differ in "
                "nothing but seed, samples and names"
            )


def _is_merged(path: Path) -> bool:
    """Whether `merge` has written this file, and nothing has damaged its head since; pipes and devices are none.

    Raises:
        OSError: it cannot be read.
    """
    if path.is_symlink() or not path.is_file():
        return False
    try:
        with reading_hdf5(path, _REMEDY) as contents:
            return contents.text("format") == FORMAT
    except InputError:
        return False


_MERGED: Final = Kind("merged sweep", _is_merged)
"""All that a merged file replaces."""


def _fill(file: "h5py.File", results: Sequence[SweepResult]) -> None:
    """Fill the empty file."""
    names = list(results[0].blocks)
    parts = {name: [list(result.blocks.values())[number] for result in results] for number, name in enumerate(names)}
    blocks = {name: _joined(of_block) for name, of_block in parts.items()}
    file.attrs.update(replace(results[0], blocks=blocks).notes())
    if len(results) > 1:
        notes = [result.notes() for result in results]
        file.attrs["sweep"] = json.dumps([result.sweep for result in results], ensure_ascii=False)
        file.attrs.update({name: ", ".join(str(note[name]) for note in notes) for name in ("seed", "digest")})
    for name in ("format", "title", "seed"):
        put_text(file, name, file.attrs[name])
    for name, block in blocks.items():
        group = file if len(blocks) == 1 else file.create_group(name, track_order=True)
        group.attrs["block"] = name
        _write_rows(block, group)
        if len(results) > 1:
            seeds = [
                str(result.seed)
                for result, part in zip(results, parts[name], strict=True)
                for _ in range(part.shape[-1])
            ]
            dataset = group.create_dataset("seed", data=np.array(seeds, object))
            dataset.attrs.update({"units": "1", "description": "seed of the sweep that the sample belongs to"})
            _attach(dataset, group, ("sample",))
        if any(part.kept.any() for part in parts[name]):
            _write_motions(block, parts[name], group)


def _joined(parts: Sequence[BlockResult]) -> BlockResult:
    """One block with the samples of all, without their motions."""
    columns = {name: np.concatenate([part.columns[name] for part in parts], axis=-1) for name in parts[0].columns}
    return replace(parts[0], columns=columns, motions=None)


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


def _write_motions(block: BlockResult, parts: Sequence[BlockResult], group: "h5py.Group") -> None:
    """Add the motions of a block, which has the samples of its parts, one shard in memory at a time."""
    counts = {kind: np.zeros(block.shape, np.int64) for kind in _AXES}
    starts: dict[str, NDArray[np.int64]] = {}
    for place, motion in _motions(block, parts):
        for kind, arrays in flat_arrays(motion).items():
            counts[kind].ravel()[place] = count(arrays)
    totals = {kind: total for kind, found in counts.items() if (total := int(found.sum()))}
    for kind, total in totals.items():
        # As netCDF writes a dimension that has no coordinates.
        group.create_dataset(_AXES[kind], (total,), ">f4").make_scale(f"{_NO_VARIABLE}{total:10d}")
        starts[kind] = np.cumsum(counts[kind]).reshape(block.shape) - counts[kind]
        for name, values, notes in (
            (f"{kind}_start", starts[kind], {"description": f"place of a walk's first one along {_AXES[kind]}"}),
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
    for place, motion in _motions(block, parts):
        for kind, arrays in flat_arrays(motion).items():
            if kind in totals:
                first = starts[kind].ravel()[place]
                for name, values in arrays.items():
                    group[_name(kind, name)][first : first + count(arrays)] = values


def _name(kind: str, name: str) -> str:
    """Name that a flat array has in the file."""
    return f"series_{name}" if kind in ("series", "plane") else name


def _motions(block: BlockResult, parts: Sequence[BlockResult]) -> Iterator[tuple[int, Motion]]:
    """The motions of a block's parts, each with its place in a flat column of the block."""
    ends = np.cumsum([part.shape[-1] for part in parts])
    places = np.split(np.arange(block.columns["index"].size).reshape(block.shape), ends[:-1], axis=-1)
    for part, place in zip(parts, places, strict=True):
        if part.motions is None:
            continue
        manifest = part.motions.manifest
        place_of = dict(zip(part.columns["index"][part.kept].tolist(), place[part.kept].tolist(), strict=True))
        for _, group in groupby(place_of, manifest.shard_with):
            found = read_motions(part.motions.directory, manifest, list(group))
            yield from ((place_of[walk], motion) for walk, motion in found.items())


def _attach(dataset: "h5py.Dataset", group: "h5py.Group", dims: tuple[str, ...]) -> None:
    """Name the axes of a dataset."""
    for place, dim in enumerate(dims):
        dataset.dims[place].attach_scale(group[dim])
