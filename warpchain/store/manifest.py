"""The manifest of a sweep's folder, sweep.json: which sweep the folder holds, and which walks are in which shard.

A shard is a file with the rows of some walks, each keyed by its block, cell and sample. A sweep that is given more
samples gets further shards for the added ones: `growth` says how many samples there were each time.
"""

import hashlib
import itertools
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from warpchain.hdf5_files import open_regular
from warpchain.inputs.validation import DamagedFileError, InputError
from warpchain.sweeps.plan import Sweep
from warpchain.version import FORMAT_VERSION, NUMERICS_VERSION, package_versions, version_refusal
from warpchain.walks.rows import KEYS, Rows, row_type

Folder = str | os.PathLike[str]

OWN: Final = ("sweep.json", "sweep.yaml", "shards", "log.txt")
"""What a sweep has in its folder, beside the lock."""
MOST_BYTES: Final = 2**24
"""Size of the largest sweep.json that is read; 12 axes of 10,000 values take 3 MB."""

FIRST_SHARDS: Final = 32
"""Most walks in each of the first four shards."""

_HEAD: Final = re.compile(rb'\{\s*"format": "warpchain sweep",\s*"format_version": (\d{1,9}),')
_CHECKED: Final = re.compile(rb'(.*),\n "sha256": "([0-9a-f]{64})"\n\}\n', re.DOTALL)


@dataclass(frozen=True)
class Growth:
    """What a folder was given at some time.

    Attributes:
        digest: `Sweep.digest` of the sweep with these samples.
        samples: samples of each block, as the sweep file says.
        shard_size: most walks in a shard of the samples that were added; the first shards have fewer, see `_bounds`.
    """

    digest: str
    samples: tuple[int, ...]
    shard_size: int


@dataclass(frozen=True, eq=False)
class Shard:
    """Some walks of a sweep that are computed together and kept in one file.

    Attributes:
        name: name of the file.
        digest: digest of the sweep when it was given these walks.
        kind: type of the rows.
        keys: block, cell and sample of each walk, of type `KEYS`.
        walks: number of each walk in the sweep as it is now.
        keeps_motion: whether the motion of any of them is kept, in a second file.
    """

    name: str
    digest: str
    kind: np.dtype[np.void]
    keys: Rows
    walks: NDArray[np.int64]
    keeps_motion: bool

    def __len__(self) -> int:
        """Number of walks."""
        return len(self.walks)

    @property
    def motion_name(self) -> str:
        """Name of the file with the kept motions."""
        return self.name.replace(".h5", "-motion.h5")

    @property
    def files(self) -> tuple[str, ...]:
        """Names of its files, in the order in which they are written."""
        return (self.motion_name, self.name) if self.keeps_motion else (self.name,)


@dataclass(frozen=True)
class Manifest:
    """What a folder holds.

    Attributes:
        sweep: the sweep as it is now.
        numerics_version: version of the numbers of its walks.
        growth: what it was given, the present sweep last.
        versions: the software that began the sweep.
        part: (k, N), if the folder is only to have the k-th of N parts of the shards, 1 ≤ k ≤ N.
    """

    sweep: Sweep
    numerics_version: int
    growth: tuple[Growth, ...]
    versions: dict[str, str]
    part: tuple[int, int] = (1, 1)

    @classmethod
    def of(cls, sweep: Sweep, shard_size: int, part: tuple[int, int] = (1, 1)) -> Self:
        """The manifest of a new folder."""
        growth = Growth(sweep.digest(), tuple(block.samples_given for block in sweep.blocks), shard_size)
        return cls(sweep, NUMERICS_VERSION, (growth,), package_versions(), part)

    @property
    def digest(self) -> str:
        """Digest of the sweep; equal digests mean equal numbers."""
        return self.growth[-1].digest

    @cached_property
    def row_type(self) -> np.dtype[np.void]:
        """Type of the rows: the quantities drawn by any block are columns in all."""
        return row_type([name for block in self.sweep.blocks for name in block.drawn])

    @cached_property
    def shards(self) -> tuple[Shard, ...]:
        """All shards, in the order in which they are computed."""
        found: list[Shard] = []
        blocks, series = self.sweep.blocks, self.sweep.recording.series
        before, firsts = [0] * len(blocks), np.array([block.first_cell for block in blocks])
        for step, growth in enumerate(self.growth):
            upto = [
                replace(block, samples_given=count).samples for block, count in zip(blocks, growth.samples, strict=True)
            ]
            keys = np.concatenate(
                [
                    _keys(number, math.prod(block.shape[:-1]), range(first, stop))
                    for number, (block, first, stop) in enumerate(zip(blocks, before, upto, strict=True))
                ]
            )
            walks, before = firsts[keys["block"]] + keys["cell"] + blocks[0].stride * keys["sample"], upto
            for place, (start, stop) in enumerate(itertools.pairwise(_bounds(len(keys), growth.shard_size))):
                part = slice(start, stop)
                keeps = series is not None and any(map(series.includes, keys["sample"][part].tolist()))
                name = f"{step}-{place:06d}.h5"
                found.append(Shard(name, growth.digest, self.row_type, keys[part], walks[part], keeps))
        return tuple(found)

    @property
    def wanted(self) -> tuple[Shard, ...]:
        """The shards that are computed in this folder: all, or those of its part."""
        number, parts = self.part
        return self.shards[number - 1 :: parts]

    def grown_from(self, found: "Manifest") -> "Manifest":
        """This manifest for the folder of another one, which has fewer samples of the same walks."""
        return replace(self, growth=(*found.growth, *self.growth), versions=found.versions, part=found.part)

    def text(self) -> str:
        """Content of sweep.json; its last line has the SHA-256 of the text before the comma in front of it."""
        content = {
            "format": "warpchain sweep",
            "format_version": FORMAT_VERSION,
            "numerics_version": self.numerics_version,
            "part": self.part,
            "growth": [vars(growth) for growth in self.growth],
            "versions": self.versions,
            "sweep": self.sweep.canonical(),
        }
        text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False).removesuffix("\n}")
        return f'{text},\n "sha256": "{hashlib.sha256(text.encode()).hexdigest()}"\n}}\n'


def _bounds(walks: int, most: int) -> list[int]:
    """Where the shards of some walks begin, and their end.

    The first four have `FIRST_SHARDS` at most, and every four twice as many as those before: a sweep that is stopped in
    its first minute has lost seconds.
    """
    bounds = [0]
    while bounds[-1] < walks:
        bounds.append(min(walks, bounds[-1] + min(most, FIRST_SHARDS << (len(bounds) - 1) // 4)))
    return bounds


def _keys(block: int, cells: int, samples: Sequence[int]) -> Rows:
    """Keys of some samples of all cells of a block."""
    keys = np.empty(cells * len(samples), KEYS)
    keys["block"] = block
    keys["cell"], keys["sample"] = np.repeat(np.arange(cells), len(samples)), np.tile(samples, cells)
    return keys


def stored_sweep(path: Folder, content: Mapping[str, object]) -> Sweep:
    """The sweep in a file of results, given its canonical form; an `InputError` if this warpchain refuses it."""
    try:
        return Sweep.of(content)
    except InputError as error:
        raise InputError(f"{path}: {error.args[0]}; read it with the version that wrote it") from None


def read_manifest(directory: Folder) -> Manifest:
    """The manifest of a folder.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is no sweep in it, or one of another version of warpchain.
        DamagedFileError: its sweep.json is damaged.
    """
    path = Path(directory) / "sweep.json"
    try:
        with open_regular(path) as file:
            text = file.read(MOST_BYTES + 1)
    except (FileNotFoundError, NotADirectoryError):
        if not os.path.exists(directory):
            raise InputError(f"{directory}: is not there; give the folder of a sweep, or a merged file") from None
        there = "a saved walk, no sweep" if (Path(directory) / "walk.h5").exists() else "no sweep"
        raise InputError(f"{directory}: {there} in this folder; give the folder of one, or a merged file") from None
    if len(text) > MOST_BYTES:
        raise InputError(f"{path}: over {MOST_BYTES} bytes, the limit of a sweep.json; give the folder of a sweep")
    head, checked = _HEAD.match(text), _CHECKED.fullmatch(text)
    if head is not None and (refusal := version_refusal(int(head[1]), "run the sweep again in another folder")):
        raise InputError(f"{path}: {refusal}")
    if head is None or checked is None or hashlib.sha256(checked[1]).hexdigest() != checked[2].decode():
        raise DamagedFileError(
            f"{path}: damaged, or not of warpchain; give the folder of a sweep, or put a copy of the file there"
        )
    content = json.loads(text)
    growth = tuple(Growth(**{**each, "samples": tuple(each["samples"])}) for each in content["growth"])
    return Manifest(
        stored_sweep(path, content["sweep"]),
        content["numerics_version"],
        growth,
        content["versions"],
        tuple(content["part"]),
    )
