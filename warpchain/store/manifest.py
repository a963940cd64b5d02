"""The manifest of a sweep's folder, sweep.h5: which sweep the folder holds; and which walks a shard has.

A shard is a file with the rows of some walks, each keyed by its block, cell and sample; no list says which they are. A
sweep that is given more samples gets further shards, for those of its walks that are not there.
"""

import itertools
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from warpchain.hdf5_files import hdf5_image, reading_hdf5
from warpchain.inputs.validation import InputError
from warpchain.sweeps.designs import EXTENSIBLE
from warpchain.sweeps.plan import Sweep
from warpchain.version import NUMERICS_VERSION, package_versions
from warpchain.walks.rows import KEYS, Rows, row_type

Folder = str | os.PathLike[str]

OWN: Final = ("sweep.h5", "sweep.yaml", "shards", "log.txt")
"""What a sweep has in its folder, beside the lock."""
EARLIER: Final = "sweep.json"
"""What earlier versions have there instead of sweep.h5."""
KIND: Final = "warpchain sweep"

FIRST_SHARDS: Final = 32
"""Most walks in each of the first four shards."""


@dataclass(frozen=True, eq=False)
class Shard:
    """Some walks of a sweep that are computed together and kept in one file.

    `kind` is the type of the rows; `keys` of type `KEYS` and `walks` are of each walk its place and its number.
    """

    digest: str
    kind: np.dtype[np.void]
    keys: Rows
    walks: NDArray[np.int64]

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
    numerics_version: int
    versions: dict[str, str]
    part: tuple[int, int] = (1, 1)

    @classmethod
    def of(cls, sweep: Sweep, shard_size: int, part: tuple[int, int] = (1, 1)) -> Self:
        """The manifest of a new folder."""
        return cls(sweep, shard_size, NUMERICS_VERSION, package_versions(), part)

    @cached_property
    def digest(self) -> str:
        """What all shards of the folder have: digest of the sweep, which is the same with more samples."""
        return self.sweep.digest([1 if b.sampler in EXTENSIBLE else b.samples_given for b in self.sweep.blocks])

    @cached_property
    def row_type(self) -> np.dtype[np.void]:
        """Type of the rows: the quantities drawn by any block are columns in all."""
        return row_type([name for block in self.sweep.blocks for name in block.drawn])

    @cached_property
    def keys(self) -> Rows:
        """Block, cell and sample of all walks, in this order."""
        keys, first = np.empty(self.sweep.walk_count, KEYS), 0
        for number, block in enumerate(self.sweep.blocks):
            own = keys[first : first + block.walk_count]
            own["block"], (own["cell"], own["sample"]) = number, np.divmod(np.arange(len(own)), block.samples)
            first += len(own)
        return keys

    @property
    def wanted(self) -> list[Shard]:
        """The shards that are computed in an empty folder: all, or those of its part."""
        return self.left(np.zeros(self.sweep.walk_count, bool))

    def left(self, done: NDArray[np.bool_]) -> list[Shard]:
        """The shards of the walks that are still to be computed; `done` says which are not, in the order of `keys`."""
        (number, parts), walks, found = self.part, self.sweep.indices, []
        own = np.flatnonzero((self.keys["cell"] + self.keys["sample"]) % parts == number - 1)
        for start, stop in itertools.pairwise(_bounds(len(own), self.shard_size)):
            places = own[start:stop][~done[own[start:stop]]]
            if len(places):
                found.append(Shard(self.digest, self.row_type, self.keys[places], walks[places]))
        return found

    def image(self) -> bytes:
        """Content of sweep.h5."""
        given = {"numerics_version": self.numerics_version, "shard_size": self.shard_size, "part": self.part}
        texts = {"versions": json.dumps(self.versions), "sweep": json.dumps(self.sweep.canonical(), ensure_ascii=False)}
        return hdf5_image(KIND, lambda file: file.attrs.update(given | texts))


def _bounds(walks: int, most: int) -> list[int]:
    """Where the shards of some walks begin, and their end.

    The first four have `FIRST_SHARDS` at most, and every four twice as many as those before, so that a sweep that is
    stopped in its first minute has lost seconds.
    """
    bounds = [0]
    while bounds[-1] < walks:
        bounds.append(min(walks, bounds[-1] + min(most, FIRST_SHARDS << (len(bounds) - 1) // 4)))
    return bounds


def stored_sweep(path: Folder, content: Mapping[str, object]) -> Sweep:
    """The sweep in a file of results, given its canonical form; an `InputError` if this warpchain refuses it."""
    try:
        return Sweep.of(content)
    except InputError as error:
        raise InputError(f"{path}: {error.args[0]}; read it with the version that wrote it") from None


def read_manifest(directory: Folder) -> Manifest:
    """The manifest of a folder; an `OSError` if unreadable, an `InputError` if it holds no sweep of this version."""
    path = Path(directory) / "sweep.h5"
    if not os.path.lexists(path):
        if not os.path.exists(directory):
            raise InputError(f"{directory}: is not there; give the folder of a sweep, or a merged file")
        if (Path(directory) / EARLIER).exists():
            raise InputError(f"{directory}: holds a sweep of an earlier warpchain; read it with that version")
        there = "a saved walk, no sweep" if (Path(directory) / "walk.h5").exists() else "no sweep"
        raise InputError(f"{directory}: {there} in this folder; give the folder of one, or a merged file")
    with reading_hdf5(path, KIND, "give the folder of a sweep, or put a copy of the file there") as file:
        return Manifest(
            stored_sweep(path, json.loads(file.attrs["sweep"])),
            int(file.attrs["shard_size"]),
            int(file.attrs["numerics_version"]),
            json.loads(file.attrs["versions"]),
            (int(file.attrs["part"][0]), int(file.attrs["part"][1])),
        )
