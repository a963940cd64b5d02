"""Shards: immutable HDF5 files that hold the rows of ended walks, and beside them files with their kept motions.

A shard has the attributes `digest` and `numerics_version` and the dataset `rows`, one row for each walk with the
columns of `warpchain.walks.rows`. If the motion of some of its walks is kept, a second file, NAME-motion.h5, has a
group for each of them, named by its row, with the arrays of a saved walk. A shard is there when both files are.

A file appears whole or not at all. Its content depends only on the sweep and on the numerics, not on when and where it
was computed: a sweep leaves the same bytes however often it was killed.
"""

import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from warpchain.files import unreadable, write_whole
from warpchain.hdf5_files import hdf5_image, open_regular, reading_hdf5
from warpchain.inputs.validation import InputError
from warpchain.store.manifest import Folder, Manifest, Shard
from warpchain.version import NUMERICS_VERSION
from warpchain.walks.rows import KEYS, MISSING, Rows
from warpchain.walks.walk_result import write_motion

if TYPE_CHECKING:
    import h5py

KIND: Final = "warpchain shard"
MOTION_KIND: Final = "warpchain motions"
_FOREIGN: Final = "a shard of another sweep; move it out of this folder"


def stamp(directory: Folder) -> str:
    """What tells whether the folder still holds the same sweep: the SHA-256 of its sweep.json."""
    try:
        with open_regular(Path(directory) / "sweep.json") as file:
            return hashlib.sha256(file.read()).hexdigest()
    except (FileNotFoundError, NotADirectoryError):
        problem = "no sweep in this folder; give the folder of one, which every worker can reach by this path"
        raise InputError(f"{directory}: {problem}") from None


def write_shard(
    directory: Folder, expected: str, shard: Shard, rows: Rows, motions: Mapping[int, Mapping[str, Any]]
) -> None:
    """Write a shard; needs no lock, so that workers can call it.

    Two workers may write the same shard at the same time: both write the same bytes, and one file replaces the other.

    Args:
        directory: folder of the sweep, opened before by the process that runs the sweep.
        expected: `stamp` of the folder when its walks were planned.
        shard: the shard.
        rows: rows of its walks, all ended.
        motions: row → arrays, see `write_motion`, of those of the walks whose motion the sweep keeps.

    Raises:
        OSError: the file cannot be written; the folder is as it was.
        InputError: the folder is not, or no longer, that of the sweep.
        ValueError: the rows are not those of the walks.
    """
    if stamp(directory) != expected:
        raise InputError(f"{directory}: belongs to another sweep now; these walks were not written")
    if any((rows[name] != shard.keys[name]).any() for name in KEYS.names or ()) or (rows["status"] == MISSING).any():
        raise ValueError(f"{shard.name}: the rows are not those of its walks, all ended and in order")
    rows = rows.copy()
    for column in rows.dtype.names or ():  # a NaN has many bit patterns, and the pattern may depend on the batch
        if rows[column].dtype.kind == "f":
            rows[column][np.isnan(rows[column])] = np.nan

    def fill(file: "h5py.File") -> None:
        file.attrs["digest"], file.attrs["numerics_version"] = shard.digest, NUMERICS_VERSION
        file.create_dataset("rows", data=rows)

    def fill_motions(file: "h5py.File") -> None:
        file.attrs["digest"] = shard.digest
        for row in sorted(motions):
            write_motion(file.create_group(str(row), track_order=True), motions[row], np.float32)

    folder = Path(directory) / "shards"
    if shard.keeps_motion:
        write_whole(folder / shard.motion_name, hdf5_image(MOTION_KIND, fill_motions))
    write_whole(folder / shard.name, hdf5_image(KIND, fill))


def read_shard(directory: Folder, shard: Shard) -> Rows:
    """The rows of a shard; needs no lock.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is damaged or belongs to another sweep.
    """
    with _opened(directory, shard, shard.name, KIND) as file:
        rows: Rows = file["rows"][()]
    if len(rows) != len(shard) or any((rows[name] != shard.keys[name]).any() for name in KEYS.names or ()):
        raise InputError(f"{Path(directory) / 'shards' / shard.name}: {_FOREIGN}")
    return rows


def opened_motions(directory: Folder, shard: Shard) -> "AbstractContextManager[h5py.File]":
    """The file with the kept motions of a shard: a group for each, named by its row; errors as of `read_shard`."""
    return _opened(directory, shard, shard.motion_name, MOTION_KIND)


@contextmanager
def _opened(directory: Folder, shard: Shard, name: str, kind: str) -> "Iterator[h5py.File]":
    path = Path(directory) / "shards" / name
    with reading_hdf5(path, kind, "delete it and run the sweep again, which computes only its walks") as file:
        if file.attrs["digest"] != shard.digest:
            raise InputError(f"{path}: {_FOREIGN}")
        yield file


def present_shards(directory: Folder, manifest: Manifest) -> list[Shard]:
    """The shards of which all files are there, in order; hidden files are ignored.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is a file that is none of this sweep.
    """
    folder = Path(directory) / "shards"
    try:
        names = {name for name in os.listdir(folder) if not name.startswith(".")}
    except FileNotFoundError:
        return []
    except OSError as error:
        raise unreadable(folder, error) from error
    if strange := sorted(names.difference(*(shard.files for shard in manifest.shards))):
        more = f" (and {len(strange) - 1} more)" if strange[1:] else ""
        raise InputError(f"{folder / strange[0]}: not a shard of this sweep; move it out of this folder{more}")
    return [shard for shard in manifest.shards if names.issuperset(shard.files)]
