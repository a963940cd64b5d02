"""The one HDF5 file that holds a whole sweep: columns with named axes, and the kept motions.

Axes and samples are dimension scales; units and meanings are attributes of every dataset, and the resolved sweep,
versions and counts by status those of the file. A single block is in the root group, which
`xarray.open_dataset(path, engine="h5netcdf")` opens; several are in groups of their names (`group=`).

The kept motions of a block are in its group `motion`, those of each walk in a group named by the place of the walk in a
flat column, as in a saved walk.

Folders are parts of one sweep: each fills in the walks that the others lack.
"""

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.files import Kind, checked_output, given_path, write_whole
from warpchain.hdf5_files import hdf5_image, kind_of_hdf5
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.store.shards import Folder
from warpchain.store.sweep_result import KIND, WANTED, SweepResult, load

if TYPE_CHECKING:
    import h5py


def merge(sources: Folder | Sequence[Folder], path: str | os.PathLike[str]) -> None:
    """Write the results of a sweep to one HDF5 file, whole or not at all; an older merged file is replaced.

    The file is made in memory.

    Args:
        sources: the folder of the sweep, or several, or merged files, which have different walks of one sweep.
        path: the file. An `InputWarning` says how many walks are missing in it, if any are.

    Raises:
        OSError: a folder cannot be read, or the file cannot be written, or is there already and no merged file.
        InputError: there is no sweep in a folder, a shard is damaged or foreign, or sweeps do not fit together.
    """
    folders = [sources] if isinstance(sources, str | os.PathLike) else list(sources)
    target = given_path(path)
    checked_output(target, _MERGED)
    whole = _filled(folders)
    write_whole(target, hdf5_image(KIND, partial(_fill, whole=whole)), _MERGED)
    if missing := whole.missing_count:
        warnings.warn(
            f"{path}: {missing:,} of {whole.walk_count:,} walks are missing; merge again with all parts, once they "
            "have run",
            InputWarning,
            stacklevel=2,
        )


def _filled(folders: Sequence[Folder]) -> SweepResult:
    """The result of all folders; an `InputError` if two have the same walk, or they are not of one sweep."""
    first, *others = folders
    whole = load(first)
    for folder in others:
        result = load(folder)
        if any(whole.provenance[name] != result.provenance[name] for name in ("digest", "numerics_version")):
            raise InputError(
                f"{folder}: is not the sweep of {first}, with the same seed and samples; give parts of one sweep, "
                "or put others together with xarray"
            )
        pairs = list(zip(whole.blocks.values(), result.blocks.values(), strict=True))
        if any((a.is_there & b.is_there).any() for a, b in pairs):
            raise InputError(f"{folder}: has walks that a folder before it has; give each part of a sweep once")
        whole = replace(whole, blocks={a.name: a.filled_from(b) for a, b in pairs})
    return whole


def _is_merged(path: Path) -> bool:
    """Whether `merge` has written this file, and nothing has damaged it since; an `OSError` if it cannot be read."""
    try:
        return not path.is_symlink() and path.is_file() and kind_of_hdf5(path, WANTED) == KIND
    except InputError:
        return False


_MERGED: Final = Kind("merged sweep", _is_merged)
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
            group.copy(motion, group.require_group("motion"), str(place))


def _put(group: "h5py.Group", name: str, values: NDArray[Any], notes: Mapping[str, Any], dims: Sequence[str]) -> None:
    """Write a variable along some axes, or one of the axes."""
    if values.dtype.kind == "b":  # NetCDF has no truth values; xarray's way to write them
        values, notes = values.astype(np.int8), {**notes, "dtype": "bool"}
    if values.dtype.kind == "U":
        values = values.astype(object)
    dataset = group.create_dataset(name, data=values, **({"compression": "gzip", "shuffle": True} if dims else {}))
    dataset.attrs.update(notes)
    if not dims:
        dataset.make_scale(name)
    for place, dim in enumerate(dims):
        dataset.dims[place].attach_scale(group[dim])
