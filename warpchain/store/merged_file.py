"""The one HDF5 file that holds a whole sweep, or several of one grid: columns with named axes, and the kept motions.

Axes and samples are dimension scales; units and meanings are attributes of every dataset, and the resolved sweep,
versions and counts by status those of the file. A single block is in the root group, which
`xarray.open_dataset(path, engine="h5netcdf")` opens; several are in groups of their names (`group=`).

The kept motions of a block are in its group `motion`, those of each walk in a group named by the place of the walk in a
flat column, as in a saved walk.

Folders of one seed are parts of one sweep: each fills in the walks that the others lack. Samples of several seeds stand
one behind the other along `sample`; `seed` has the seed of each, and `index` the number of a walk in its own sweep.
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
from warpchain.store.block_result import Origin
from warpchain.store.manifest import Folder
from warpchain.store.sweep_result import KIND, WANTED, SweepResult, load

if TYPE_CHECKING:
    import h5py


def merge(sources: Folder | Sequence[Folder], path: str | os.PathLike[str]) -> None:
    """Write the results of a sweep to one HDF5 file, whole or not at all; an older merged file is replaced.

    The file is made in memory.

    Args:
        sources: the folder of the sweep, or several, or merged files, whose sweeps differ in nothing but seed, samples
            and names; their samples are put together. Those of the same seed have different walks of one sweep.
        path: the file. An `InputWarning` says how many walks are missing in it, if any are.

    Raises:
        OSError: a folder cannot be read, or the file cannot be written, or is there already and no merged file.
        InputError: there is no sweep in a folder, a shard is damaged or foreign, or sweeps do not fit together.
    """
    folders = [sources] if isinstance(sources, str | os.PathLike) else list(sources)
    target = given_path(path)
    checked_output(target, _MERGED)
    whole = _joined(_by_seed({folder: load(folder) for folder in folders}, folders))
    write_whole(target, hdf5_image(KIND, partial(_fill, whole=whole)), _MERGED)
    if missing := whole.missing_count:
        warnings.warn(
            f"{path}: {missing:,} of {whole.walk_count:,} walks are missing; merge again with all parts, once they "
            "have run",
            InputWarning,
            stacklevel=2,
        )


def _by_seed(results: Mapping[Folder, SweepResult], folders: Sequence[Folder]) -> list[SweepResult]:
    """Results of different seeds: each is filled in with the walks of those that have its seed.

    Raises:
        InputError: walks of one sweep are in two of the folders, or sweeps differ in more than seed, samples and names,
            or their samples draw nothing.
    """
    whole: dict[Folder, SweepResult] = {}
    for folder in folders:
        result = results[folder]
        seeds = {sweep.seed for sweep in result.origin.sweeps}
        other = next((one for one in whole if seeds & {sweep.seed for sweep in whole[one].origin.sweeps}), None)
        if other is None:
            whole[folder] = result
            continue
        digests = [[sweep.digest() for sweep in each.origin.sweeps] for each in (whole[other], result)]
        pairs = list(zip(whole[other].blocks.values(), result.blocks.values(), strict=False))
        if digests[0] != digests[1] or any((a.is_there & b.is_there).any() for a, b in pairs):
            raise InputError(
                f"{folder}: has walks that {other} has, of seed {result.seed}; give each folder once, parts of one "
                "sweep, or sweeps with different seeds"
            )
        whole[other] = replace(whole[other], blocks={a.name: a.filled_from(b) for a, b in pairs})
    kinds = set()
    for folder, result in whole.items() if len(whole) > 1 else ():
        for sweep in result.origin.sweeps:
            if still := [block.name for block in sweep.blocks if not block.drawn]:
                raise InputError(f"{folder}: block {still[0]} draws nothing, so that more samples are the same walks")
            kinds.add((replace(sweep, seed=0).digest([1] * len(sweep.blocks)), result.provenance["numerics_version"]))
        if len(kinds) > 1:
            raise InputError(
                f"{folder}: is not the sweep of {folders[0]} with another seed; give folders that differ in nothing "
                "but seed, samples and names"
            )
    return list(whole.values())


def _joined(results: Sequence[SweepResult]) -> SweepResult:
    """One result with the samples of all."""
    if len(results) == 1:
        return results[0]
    sweeps = tuple(sweep for result in results for sweep in result.origin.sweeps)
    software = [result.provenance["versions"] for result in results]
    provenance = {
        **results[0].provenance,
        "digest": ", ".join(result.provenance["digest"] for result in results),
        "versions": {name: ", ".join(dict.fromkeys(each[name] for each in software)) for name in software[0]},
    }
    origin, blocks = Origin(sweeps, provenance), {}
    for parts in zip(*(result.blocks.values() for result in results), strict=True):
        columns = {name: np.concatenate([part.columns[name] for part in parts], axis=-1) for name in parts[0].columns}
        samples, first, motions = columns["index"].shape[-1], 0, {}
        for part in parts:
            for place, motion in part.motions.items():
                cell, sample = divmod(place, part.shape[-1])
                motions[cell * samples + first + sample] = motion
            first += part.shape[-1]
        blocks[parts[0].name] = replace(parts[0], columns=columns, origin=origin, motions=motions)
    return SweepResult(blocks=blocks, origin=origin)


def _is_merged(path: Path) -> bool:
    """Whether `merge` has written this file, and nothing has damaged it since; pipes and devices are none.

    Raises:
        OSError: it cannot be read.
    """
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
        if len(whole.origin.sweeps) > 1:
            seeds = [str(whole.origin.sweeps[number].seed) for number, _ in whole.origin.samples(block.number)]
            notes = {"units": "1", "description": "seed of the sweep that the sample belongs to"}
            variables["seed"] = (("sample",), np.array(seeds, object), notes)
        for name, (dims, values, notes) in {**coordinates, **variables}.items():
            _put(group, name, values, notes, () if dims == (name,) else dims)
        for place, motion in block.kept_motions(block.motions):
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
