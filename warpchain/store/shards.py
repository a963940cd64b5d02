"""Shards: immutable HDF5 files that hold the rows and motions of ended walks.

A shard file has the attributes `format`, `key`, `digest` and `numerics_version`; the dataset `rows`, one row for each
walk with the columns of `warpchain.walks.rows`; and, if motions of its walks are kept, the group `motion`, see
`warpchain.store.motion_arrays`. Checksums stand at its end, see `warpchain.hdf5_files`. Walks have their places in the
folder as numbers, see `warpchain.store.manifest`; their numbers in the sweep are found when the shard is read.

A shard appears whole or not at all: it is written to a temporary file, flushed to the disk, and then renamed.
Its content depends only on the digest of the sweep and on the numerics, not on when and where it was computed. So a
sweep leaves the same bytes however often it was killed.
"""

import errno
import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from warpchain.files import NotReplaceable, failure, remedy, replacing
from warpchain.hdf5_files import ContentError, Contents, hdf5_image, put_text, reading_hdf5
from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.store.manifest import (
    NUMERICS_VERSION,
    Folder,
    Manifest,
    known_manifest,
    unreadable,
)
from warpchain.store.manifest_content import FORMAT, FORMAT_VERSION
from warpchain.store.motion_arrays import GROUP, read_motion, write_motions
from warpchain.sweeps.plan import Sweep
from warpchain.walks.motion import Motion
from warpchain.walks.rows import MISSING, Rows, drawn_column, missing_rows, row_type

if TYPE_CHECKING:
    import h5py


def empty_rows(sweep: Sweep, places: range) -> Rows:
    """Rows to fill in, shape (len(places),): indices are the places, status is `MISSING`, the rest NaN or −1."""
    return missing_rows(row_type([name for block in sweep.blocks for name in block.drawn]), places)


def shard_name(places: range) -> str:
    """Name of the file of a shard; names sort like the places."""
    return f"{places.start:09d}-{places.stop - 1:09d}.h5"


def _key(manifest: Manifest, places: range) -> str:
    """A hash of what determines the bytes of a shard: hexadecimal SHA-256."""
    digests = manifest.digests_of(places.start)
    content = (*digests, manifest.numerics_version, FORMAT_VERSION, places.start, places.stop)
    return hashlib.sha256(" ".join(map(str, content)).encode()).hexdigest()


def write_shard(
    directory: Folder, digest: str, places: range, rows: Rows, motions: Mapping[int, Motion] | None = None
) -> str:
    """Write the rows of a shard; needs no lock, so that workers can call it.

    Two workers may write the same shard at the same time: both write the same bytes, and one file replaces the other.

    Args:
        directory: folder of the sweep, opened before by the process that runs the sweep.
        digest: digest of the sweep that the rows were computed for.
        places: places of its walks; one of `SweepFolder.missing`.
        rows: rows of the walks, with their places as index, shape (len(places),), in order, of the manifest's type.
        motions: place → motion of those of the walks whose motion the sweep keeps; None: of none.

    Returns:
        The key of the shard.

    Raises:
        OSError: the file cannot be written; the folder is as it was.
        InputError: the folder is not, or no longer, that of the sweep.
        ValueError: the rows or the motions are not those of the walks.
    """
    manifest, name = known_manifest(directory), f"walks {places.start} to {places.stop - 1}"
    if (manifest.digest, manifest.numerics_version) != (digest, NUMERICS_VERSION):
        raise InputError(f"{directory}: belongs to another sweep now; these walks were not written")
    if places != manifest.shard_of(places.start):
        raise ValueError(f"{name} are no shard of this sweep")
    if rows.dtype != manifest.row_type or not np.array_equal(rows["index"], places):
        raise ValueError(f"the rows are not those of {name}, all in order")
    if problem := _problem(rows, manifest):
        raise ValueError(f"one of {name} {problem}")
    motions = motions or {}
    if sorted(motions) != manifest.kept(places):
        raise ValueError(f"the motions are not those that are kept of {name}")
    rows = rows.copy()
    for column in rows.dtype.names or ():  # a NaN has many bit patterns, and the pattern may depend on the batch
        if rows[column].dtype.kind == "f":
            rows[column][np.isnan(rows[column])] = np.nan
    key = _key(manifest, places)

    def fill(file: "h5py.File") -> None:
        put_text(file, "format", FORMAT)
        put_text(file, "key", key)
        put_text(file, "digest", manifest.digests_of(places.start)[-1])
        file.attrs["numerics_version"] = NUMERICS_VERSION
        file.create_dataset("rows", data=rows)
        if motions:
            write_motions(motions, file)

    put_file(Path(directory) / "shards" / shard_name(places), hdf5_image(fill))
    return key


def read_shard(directory: Folder, manifest: Manifest, places: range) -> Rows:
    """The rows of a shard, their places as index, all checked; needs no lock.

    Args:
        directory: folder of the sweep.
        manifest: its manifest.
        places: all places of the shard.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is damaged or belongs to another sweep.
    """
    with _opened(directory, manifest, places) as contents:
        rows = contents.array("rows", manifest.row_type, (len(places),))
        if not np.array_equal(rows["index"], places):
            raise ContentError(f"its rows are not those of the walks at places {places.start} to {places.stop - 1}")
        if problem := _problem(rows, manifest):
            raise ContentError(f"a walk {problem}")
    return rows


def _problem(rows: Rows, manifest: Manifest) -> str | None:
    """What no ended walk has but one of these rows, with their places as index; None if all is well."""
    if not np.isin(rows["status"], [status for status in Status if status != Status.RUNNING]).all():
        return "has no status that ends a walk"
    if not np.array_equal(np.isfinite(rows["dx"]), rows["status"] == Status.AT_REST):
        return "has a distance without being at rest, or none at rest"
    if any((rows[column] < MISSING).any() for column in rows.dtype.names or () if rows[column].dtype.kind == "i"):
        return "has a negative count"
    places = range(int(rows["index"][0]), int(rows["index"][-1]) + 1)
    for part, at in manifest.overlaps(places):
        here = rows[at.start - places.start : at.stop - places.start]
        if not all(np.isfinite(here[drawn_column(name)]).all() for name in part.block.drawn):
            return "lacks a quantity that was drawn for it"
    return None


def read_motions(directory: Folder, manifest: Manifest, walks: Sequence[int]) -> dict[int, Motion]:
    """The motions of some walks of one shard, by number and in order, all checked; needs no lock.

    Args:
        directory: folder of the sweep.
        manifest: its manifest.
        walks: numbers of walks of one shard whose motion is kept.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is damaged or belongs to another sweep.
    """
    with _opened(directory, manifest, manifest.shard_with(walks[0])) as contents:
        motions = contents.part(GROUP)
        return {walk: read_motion(motions, manifest.place(walk)) for walk in walks}


@contextmanager
def _opened(directory: Folder, manifest: Manifest, places: range) -> Iterator[Contents]:
    """The file of a shard; an error while it is read means that it is damaged."""
    path, is_foreign = Path(directory) / "shards" / shard_name(places), False
    with reading_hdf5(path, "delete it and run the sweep again, which computes only its walks") as contents:
        is_foreign = contents.text("key") != _key(manifest, places)
        if not is_foreign:
            yield contents
    if is_foreign:
        raise InputError(f"{path}: a shard of another sweep; move it out of this folder")


def present_shards(directory: Folder, manifest: Manifest) -> dict[range, Path]:
    """The shards that are there, by their places and in order; hidden files are ignored.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is a file that is no shard of this sweep.
    """
    folder = Path(directory) / "shards"
    named = {shard_name(places): places for places in manifest.shards}
    try:
        names = {name for name in os.listdir(folder) if not name.startswith(".")}
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise unreadable(folder, error) from error
    if strange := sorted(names - named.keys()):
        more = f" (and {len(strange) - 1} more)" if strange[1:] else ""
        raise InputError(f"{folder / strange[0]}: not a shard of this sweep; move it out of this folder{more}")
    return {places: folder / name for name, places in named.items() if name in names}


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an `OSError` of the `with` block into one of one line: the path cannot be written, why, and the remedy."""
    try:
        yield
    except NotReplaceable:
        raise
    except OSError as error:
        number = error.errno or errno.EIO
        problem = f"cannot be written ({os.strerror(number)})"
        remedy_too = f"{remedy(number)} and start again, shards written are kept"
        raise failure(number, f"{path}: {problem}; {remedy_too}") from error


def put_file(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all, and down to the disk before this returns.

    Raises:
        OSError: the file cannot be written; one line that names it and the remedy.
    """
    with writing(path):
        with replacing(path, clear=False) as part:  # parts go when the folder is opened; it may have many names
            part.write_bytes(content)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)  # the new name, too
        finally:
            os.close(folder)
