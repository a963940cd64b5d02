"""Shards: immutable HDF5 files that hold the rows of ended walks, and their kept motions.

A shard has the attributes `name`, `digest` and `numerics_version`, the dataset `rows`, one row for each walk with the
columns of `warpchain.walks.rows`, and in the group `motion` one for each walk whose motion is kept, named by its row,
with the arrays of a saved walk.

A file appears whole or not at all. Its content depends only on the sweep and on the numerics, not on when and where it
was computed: a sweep leaves the same bytes however often it was killed.
"""

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from warpchain.files import unreadable, write_whole
from warpchain.hdf5_files import hdf5_image, open_regular, reading_hdf5
from warpchain.inputs.validation import InputError
from warpchain.store.manifest import Folder, Shard
from warpchain.version import NUMERICS_VERSION
from warpchain.walks.rows import KEYS, MISSING, Rows
from warpchain.walks.walk_result import write_motion

if TYPE_CHECKING:
    import h5py

KIND: Final = "warpchain shard"
_NAME: Final = re.compile(r"\d{6,}\.h5")
FOREIGN: Final = "a shard of another sweep; move it out of this folder"


def stamp(directory: Folder) -> str:
    """What tells whether the folder still holds the same sweep: the SHA-256 of its sweep.h5."""
    try:
        with open_regular(Path(directory) / "sweep.h5") as file:
            return hashlib.sha256(file.read()).hexdigest()
    except (FileNotFoundError, NotADirectoryError):
        problem = "no sweep in this folder; give the folder of one, which every worker can reach by this path"
        raise InputError(f"{directory}: {problem}") from None


def write_shard(
    directory: Folder, expected: str, shard: Shard, rows: Rows, motions: Mapping[int, Mapping[str, Any]]
) -> None:
    """Write a shard into a folder that is open in the process that runs the sweep; workers need no lock for it.

    Two workers may write the same shard at the same time: both write the same bytes, and one file replaces the other.
    `expected` is the `stamp` of the folder when the walks were planned; all have ended. `motions` has the arrays of
    `write_motion` by rows, of walks whose motion the sweep keeps.

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
        file.attrs.update(name=shard.name, digest=shard.digest, numerics_version=NUMERICS_VERSION)
        file.create_dataset("rows", data=rows)
        for row in sorted(motions):
            write_motion(file.create_group(f"motion/{row}", track_order=True), motions[row], np.float32)

    write_whole(Path(directory) / "shards" / shard.name, hdf5_image(KIND, fill))


def read_shard(directory: Folder, shard: Shard) -> Rows:
    """The rows of a shard; needs no lock; errors as of `opened_shard`."""
    with opened_shard(directory, shard.name, shard.digest) as file:
        return rows_of(file, shard.kind)


def rows_of(file: "h5py.File", kind: np.dtype[np.void]) -> Rows:
    """The rows in an open shard; asked for their type, h5py would take twice as long."""
    rows = np.zeros(file["rows"].shape, kind)
    file["rows"].read_direct(rows)
    return rows


def shard_files(directory: Folder) -> list[str]:
    """Names of all files of shards, sorted; an `InputError` names one that is none, but for hidden files."""
    folder = Path(directory) / "shards"
    try:
        names = sorted(name for name in os.listdir(folder) if not name.startswith("."))
    except FileNotFoundError:
        return []
    except OSError as error:
        raise unreadable(folder, error) from error
    if strange := [name for name in names if not _NAME.fullmatch(name)]:
        more = f" (and {len(strange) - 1} more)" if strange[1:] else ""
        raise InputError(f"{folder / strange[0]}: not a shard of this sweep; move it out of this folder{more}")
    return names


@contextmanager
def opened_shard(directory: Folder, name: str, digest: str) -> "Iterator[h5py.File]":
    """The shard of this name and digest; an `OSError` if it is unreadable, an `InputError` if damaged or foreign."""
    path = Path(directory) / "shards" / name
    with reading_hdf5(path, KIND, "delete it and run the sweep again, which computes only its walks") as file:
        if (file.attrs["name"], file.attrs["digest"]) != (name, digest):
            raise InputError(f"{path}: {FOREIGN}")
        yield file
