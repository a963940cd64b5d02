"""The shards of a sweep's folder, and its manifest, sweep.h5: which sweep it holds, and which walks a shard has.

A shard is an immutable HDF5 file with the rows of some ended walks, each keyed by its block, cell and sample; no list
says which they are. A sweep that is given more samples gets further shards, for those of its walks that are not there.

It has the attributes `name`, `digest`, `numerics_version` and `part`. The dataset `rows` has one row for each walk with
the columns of `warpchain.walks.rows`; the group `motion` has one group for each walk whose motion is kept, named by its
row, with the arrays of a saved walk.

A file appears whole or not at all. Its content depends only on the sweep and on the numerics, not on when and where it
was computed: a sweep leaves the same bytes however often it was killed.
"""

import hashlib
import itertools
import json
import math
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.files import AnyPath, naming, write_whole
from warpchain.hdf5_files import SWEEP_FILE, WALK_FILE, Format, claims_to_be, hdf5_image, open_regular, reading_hdf5
from warpchain.inputs.validation import DamagedFileError, InputError
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.plan import Sweep
from warpchain.sweeps.sweep_file import fields_of
from warpchain.version import NUMERICS_VERSION, package_versions
from warpchain.walks.rows import MISSING, ROW_KEYS, STORED_COLUMNS, Rows, row_type
from warpchain.walks.walk_numbers import MOTION, write_motion

if TYPE_CHECKING:
    import h5py

Part = tuple[int, int]
"""Number of a part of a sweep, and number of parts."""
CRATE: Final = "ro-crate-metadata.json"
"""Where and when the sweep was run, see `warpchain.store.crate`."""
OWN: Final = (SWEEP_FILE, "sweep.yaml", "shards", "log.txt", CRATE)
"""What a sweep has in its folder, beside the lock."""
MANIFEST: Final = Format.of("warpchain sweep")
SHARD: Final = Format.of("warpchain shard", STORED_COLUMNS, MOTION, dict(ROW_KEYS.fields or {}))
_NAME: Final = re.compile(r"\d{6,}\.h5")
FOREIGN: Final = "a shard of another sweep; move it out of this folder"
REBUILT: Final = "run the sweep in this folder again; all shards are kept"

SHARDS: Final = 32
"""Least number of shards of a sweep or a round, about, if it has as many walks: the grain of a restart."""
FIRST_SHARDS: Final = 32
"""Most walks in each of the first four shards."""


@dataclass(frozen=True, eq=False)
class Shard:
    """Some walks of a sweep that are computed together and kept in one file.

    `kind` is the type of the rows; `keys` of type `ROW_KEYS` and `walks` are of each walk its place and its number;
    `part` is that of the folder which the shard was computed for.
    """

    digest: str
    kind: np.dtype[np.void]
    keys: Rows
    walks: NDArray[np.int64]
    part: Part = (1, 1)

    def __len__(self) -> int:
        """Number of walks."""
        return len(self.walks)

    @property
    def name(self) -> str:
        """Name of the file, the number of its first walk."""
        return f"{self.walks[0]:06d}.h5"


@dataclass(frozen=True)
class Manifest:
    """What a folder holds.

    A shard has `shard_size` walks at most, the first ones fewer, see `_bounds`. `versions` are those of the software
    that began the sweep. Of `part` (k, N), 1 ≤ k ≤ N, it only has the k-th of N parts; more samples move no walk.
    """

    sweep: Sweep
    shard_size: int
    part: Part = (1, 1)
    numerics_version: int = NUMERICS_VERSION
    versions: dict[str, str] = field(default_factory=package_versions)

    @cached_property
    def digest(self) -> str:
        """What all shards of the folder have: digest of the sweep, which is the same with more samples."""
        return self.sweep.digest([1 if SAMPLERS[b.sampler].grows else b.samples_given for b in self.sweep.blocks])

    @cached_property
    def row_type(self) -> np.dtype[np.void]:
        """Type of the rows: the quantities drawn by any block are columns in all."""
        return row_type([name for block in self.sweep.blocks for name in block.drawn])

    @cached_property
    def keys(self) -> Rows:
        """Block, cell and sample of all walks, in this order."""
        keys, first = np.empty(self.sweep.walk_count, ROW_KEYS), 0
        for number, block in enumerate(self.sweep.blocks):
            own = keys[first : first + block.walk_count]
            own["block"], (own["cell"], own["sample"]) = number, np.divmod(np.arange(len(own)), block.samples)
            first += len(own)
        return keys

    @cached_property
    def mine(self) -> NDArray[np.bool_]:
        """Whether each walk belongs to the part, in the order of `keys`; of cells with `until` all walks or none."""
        (number, parts), own = self.part, []
        for block in self.sweep.blocks:
            cells, samples = np.indices(block.shape[:-1]).sum(axis=0).reshape(-1, 1), np.zeros(block.samples, int)
            if not block.until:
                cells, samples = np.arange(len(cells))[:, np.newaxis], np.arange(block.samples)
            own.append(((cells + samples) % parts == number - 1).ravel())
        return np.concatenate(own)

    @cached_property
    def turns(self) -> NDArray[np.int8]:
        """Number of the round of each walk, in the order of `keys`; a sweep without `until` has just one round."""
        turns = [np.searchsorted(each.rounds, np.arange(each.samples), side="right") for each in self.sweep.blocks]
        cells = [math.prod(block.shape[:-1]) for block in self.sweep.blocks]
        return np.concatenate([np.tile(turn.astype(np.int8), count) for turn, count in zip(turns, cells, strict=True)])

    @property
    def wanted(self) -> list[Shard]:
        """The shards that are first computed in an empty folder, of its part: all, or with `until` a round."""
        return self.left(np.zeros(self.sweep.walk_count, bool), self.turns == 0)

    def left(self, done: NDArray[np.bool_], asked: NDArray[np.bool_]) -> list[Shard]:
        """The shards of the walks that are still to be computed, in the first round that has any.

        In the order of `keys`, `done` says which walks are there, `asked` which there are to be. The shards of a round
        do not depend on how far it is.
        """
        walks, mine = self.sweep.indices, self.mine & asked
        for turn in range(self.turns.max() + 1):
            own, found = np.flatnonzero(mine & (self.turns == turn)), []
            most = min(self.shard_size, max(1, len(own) // SHARDS)) if self.sweep.has_rounds else self.shard_size
            for start, stop in itertools.pairwise(_bounds(len(own), most)):
                places = own[start:stop][~done[own[start:stop]]]
                if len(places):
                    found.append(Shard(self.digest, self.row_type, self.keys[places], walks[places], self.part))
            if found:
                return found
        return []

    def image(self) -> bytes:
        """Content of sweep.h5."""
        given = {"numerics_version": self.numerics_version, "shard_size": self.shard_size, "part": self.part}
        texts = {"versions": json.dumps(self.versions), "sweep": json.dumps(self.sweep.canonical(), ensure_ascii=False)}
        return hdf5_image(MANIFEST, lambda file: file.attrs.update(given | texts))


def _bounds(walks: int, most: int) -> list[int]:
    """Where the shards of some walks begin, and their end.

    The first four have `FIRST_SHARDS` at most, and every four twice as many as those before, so that a sweep that is
    stopped in its first minute has lost seconds.
    """
    bounds = [0]
    while bounds[-1] < walks:
        bounds.append(min(walks, bounds[-1] + min(most, FIRST_SHARDS << (len(bounds) - 1) // 4)))
    return bounds


def stored_sweep(path: AnyPath, content: Mapping[str, object]) -> Sweep:
    """The sweep in a file of results, given its canonical form; an `InputError` if this warpchain refuses it."""
    try:
        return Sweep(*fields_of(content))
    except InputError as error:
        problem = error.args[0].partition("; ")[0]
        raise InputError(f"{path}: {problem}; read it with the version that wrote it") from None


def read_manifest(directory: AnyPath) -> Manifest:
    """The manifest of a folder; an `OSError` if unreadable, an `InputError` if it holds no sweep of this version."""
    path = Path(directory) / SWEEP_FILE
    if not os.path.lexists(path):
        if not os.path.exists(directory):
            raise InputError(f"{directory}: does not exist; use the folder of a sweep, or a merged file")
        if any(own_shards(directory)):
            raise DamagedFileError(f"{path}: is missing; {REBUILT}")
        there = "a saved walk, no sweep" if (Path(directory) / WALK_FILE).exists() else "no sweep"
        raise InputError(f"{directory}: {there} in this folder; use the folder of a sweep, or a merged file")
    with reading_hdf5(path, MANIFEST, REBUILT) as file:
        return Manifest(
            stored_sweep(path, json.loads(file.attrs["sweep"])),
            int(file.attrs["shard_size"]),
            (int(file.attrs["part"][0]), int(file.attrs["part"][1])),
            int(file.attrs["numerics_version"]),
            json.loads(file.attrs["versions"]),
        )


def stamp(directory: AnyPath) -> str:
    """What tells whether the folder still holds the same sweep: the SHA-256 of its sweep.h5."""
    try:
        with open_regular(Path(directory) / SWEEP_FILE) as file:
            return hashlib.sha256(file.read()).hexdigest()
    except (FileNotFoundError, NotADirectoryError):
        problem = "no sweep in this folder; use the folder of a sweep that every worker can reach by this path"
        raise InputError(f"{directory}: {problem}") from None


def write_shard(
    directory: AnyPath, expected: str, shard: Shard, rows: Rows, motions: Mapping[int, Mapping[str, Any]]
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
    others = any((rows[name] != shard.keys[name]).any() for name in ROW_KEYS.names or ())
    if others or (rows["status"] == MISSING).any():
        raise ValueError(f"{shard.name}: the rows are not those of its walks, all ended and in order")
    rows = rows.copy()
    for column in rows.dtype.names or ():  # a NaN has many bit patterns, and the pattern may depend on the batch
        if rows[column].dtype.kind == "f":
            rows[column][np.isnan(rows[column])] = np.nan

    def fill(file: "h5py.File") -> None:
        numbers = {"numerics_version": NUMERICS_VERSION, "part": shard.part}
        file.attrs.update(name=shard.name, digest=shard.digest, **numbers)
        file.create_dataset("rows", data=rows)
        for row in sorted(motions):
            write_motion(file.create_group(f"motion/{row}", track_order=True), motions[row], np.float32)

    write_whole(Path(directory) / "shards" / shard.name, hdf5_image(SHARD, fill))


def rows_of(file: "h5py.File", kind: np.dtype[np.void]) -> Rows:
    """The rows in an open shard; asked for their type, h5py would take twice as long."""
    rows = np.zeros(file["rows"].shape, kind)
    file["rows"].read_direct(rows)
    return rows


def shard_files(directory: AnyPath) -> list[str]:
    """Names of all files of shards, sorted; an `InputError` names one that is none, but for hidden files."""
    folder = Path(directory) / "shards"
    try:
        with naming(folder, "read"):
            names = sorted(name for name in os.listdir(folder) if not name.startswith("."))
    except FileNotFoundError:
        return []
    if strange := [name for name in names if not _NAME.fullmatch(name)]:
        more = f" (and {len(strange) - 1} more)" if strange[1:] else ""
        raise InputError(f"{folder / strange[0]}: not a shard of this sweep; move it out of this folder{more}")
    return names


@contextmanager
def opened_shard(directory: AnyPath, name: str, digest: str, numerics: int) -> "Iterator[h5py.File]":
    """The shard of this name, of a sweep with this digest and of these numerics.

    An `OSError` says that it cannot be read, an `InputError` that it is damaged or belongs elsewhere.
    """
    path = Path(directory) / "shards" / name
    with reading_hdf5(path, SHARD, "move it out of this folder and run the sweep again, for its walks only") as file:
        if (file.attrs["name"], file.attrs["digest"]) != (name, digest):
            raise InputError(f"{path}: {FOREIGN}")
        if (own := int(file.attrs["numerics_version"])) != numerics:
            remedy = "move it out of this folder, and run the sweep again for its walks"
            raise InputError(f"{path}: its walks are of numerics {own}, those of this folder of {numerics}; {remedy}")
        yield file


def own_shards(directory: AnyPath) -> Iterator[Path]:
    """The files in a folder of shards that a sweep has written there, of any sweep and damaged or not."""
    folder = Path(directory) / "shards"
    with naming(folder, "read"):
        there = sorted(folder.iterdir()) if folder.is_dir() else []
    for path in there:
        if _NAME.fullmatch(path.name) and path.is_file() and not path.is_symlink() and claims_to_be(path, SHARD.kind):
            yield path


def check_numerics(directory: AnyPath) -> None:
    """What a worker does before it computes: an `InputError` if the folder's walks are of other numerics than ours."""
    path = Path(directory) / SWEEP_FILE
    with reading_hdf5(path, MANIFEST, REBUILT) as file:
        check_numerics_of(directory, int(file.attrs["numerics_version"]))


def check_numerics_of(directory: AnyPath, version: int) -> None:
    """An `InputError` if the walks of a folder, of this version of the numerics, cannot be gone on with here."""
    if version != NUMERICS_VERSION:
        raise InputError(
            f"{directory}: its walks are of numerics {version}, but this warpchain has {NUMERICS_VERSION}; "
            "use one version for all workers, another folder, or fresh"
        )
