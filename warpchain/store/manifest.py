"""The manifest of a sweep's folder, sweep.json: what the folder belongs to, and how its walks are laid out."""

import errno
import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from warpchain.files import version_refusal
from warpchain.inputs.validation import InputError
from warpchain.sweeps.plan import Sweep
from warpchain.sweeps.recording import Recording
from warpchain.version import package_versions
from warpchain.walks.rows import row_type

Folder = str | os.PathLike[str]

NUMERICS_VERSION: Final = 10
"""Raised by every change that changes a number of any walk; shards of two versions never mix."""

FORMAT: Final = "warpchain sweep"
FORMAT_VERSION: Final = 3
"""Of the manifest and of the shards."""

OWN: Final = ("sweep.json", "sweep.yaml", "shards", "log.txt")
"""What a sweep has in its folder, beside the lock."""


@dataclass(frozen=True)
class BlockLayout:
    """Which walks a block has: from `first` on, in C order over the axes and then the samples.

    Attributes:
        name: name of the block.
        axes: name of each axis of the grid → its values, in order.
        samples: number of samples in each cell.
        first: index of the first walk.
        drawn: names of the quantities that the samples draw.
    """

    name: str
    axes: dict[str, tuple[float | int | str, ...]]
    samples: int
    first: int
    drawn: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis, then the number of samples."""
        return (*(len(values) for values in self.axes.values()), self.samples)


@dataclass(frozen=True)
class Manifest:
    """What a folder belongs to and how its walks are laid out: what a reader needs beside the shards.

    Attributes:
        name: name of the sweep.
        seed: its seed.
        digest: `Sweep.digest`; equal digests mean equal numbers.
        numerics_version: `NUMERICS_VERSION` of the walks.
        shard_size: number of walks in a shard; the last has what is left.
        walk_count: number of walks.
        blocks: the blocks of the sweep.
        sweep: `Sweep.canonical`.
        versions: the software that began the sweep.
    """

    name: str
    seed: int
    digest: str
    numerics_version: int
    shard_size: int
    walk_count: int
    blocks: tuple[BlockLayout, ...]
    sweep: dict[str, Any]
    versions: dict[str, str]

    @classmethod
    def of(cls, sweep: Sweep, shard_size: int) -> Self:
        """The manifest of a new folder."""
        return cls(
            name=sweep.name,
            seed=sweep.seed,
            digest=sweep.digest(),
            numerics_version=NUMERICS_VERSION,
            shard_size=shard_size,
            walk_count=sweep.walk_count,
            blocks=tuple(
                BlockLayout(block.name, dict(block.axes), block.samples, block.first, tuple(block.drawn))
                for block in sweep.blocks
            ),
            sweep=sweep.canonical(),
            versions=package_versions(),
        )

    @property
    def row_type(self) -> np.dtype[np.void]:
        """Type of the rows: the quantities drawn by any block are columns in all."""
        return row_type([name for block in self.blocks for name in block.drawn])

    @property
    def shards(self) -> list[range]:
        """The walks of each shard."""
        return [self.shard_of(start) for start in range(0, self.walk_count, self.shard_size)]

    @property
    def recording(self) -> Recording:
        """What is kept of the motion of walks."""
        return Recording.of(self.sweep.get("record", {}))

    def _kept_samples(self, block: BlockLayout) -> Sequence[int]:
        """Samples of each cell of a block whose motion is kept."""
        series = self.recording.series
        if series is None:
            return ()
        return range(block.samples) if series.samples is None else [n for n in series.samples if n < block.samples]

    def kept(self, walks: range) -> list[int]:
        """Those of some walks whose motion is kept."""
        found = []
        for block in self.blocks:
            samples, last = self._kept_samples(block), block.first + math.prod(block.shape)
            part = range(max(walks.start, block.first), min(walks.stop, last))
            found += [walk for walk in part if (walk - block.first) % block.samples in samples]
        return found

    @property
    def kept_count(self) -> int:
        """Number of walks whose motion is kept."""
        return sum(math.prod(block.shape[:-1]) * len(self._kept_samples(block)) for block in self.blocks)

    def shard_of(self, walk: int) -> range:
        """The walks of the shard that a walk is in."""
        start = walk - walk % self.shard_size
        return range(start, min(start + self.shard_size, self.walk_count))

    def text(self) -> str:
        """Content of sweep.json."""
        content = {"format": FORMAT, "format_version": FORMAT_VERSION, **asdict(self)}
        return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def read_manifest(directory: Folder) -> Manifest:
    """The manifest of a folder.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is no sweep in it, or one of another version of warpchain.
    """
    path = Path(directory) / "sweep.json"
    try:
        content = json.loads(path.read_bytes())
        if content["format"] != FORMAT:
            raise KeyError("format")
        if refusal := version_refusal(content["format_version"], FORMAT_VERSION, "run it again in another folder"):
            raise InputError(f"{path}: {refusal}")
        del content["format"], content["format_version"]
        for block in content["blocks"]:
            block["axes"] = {name: tuple(values) for name, values in block["axes"].items()}
            block["drawn"] = tuple(block["drawn"])
        content["blocks"] = tuple(BlockLayout(**block) for block in content["blocks"])
        return Manifest(**content)
    except InputError:
        raise
    except (FileNotFoundError, NotADirectoryError):
        problem = "no sweep in this folder; give the folder of one, which every worker can reach by this path"
        raise InputError(f"{directory}: {problem}") from None
    except OSError as error:
        raise unreadable(path, error) from error
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{path}: damaged, or not of warpchain; give the folder of a sweep") from None


def check_not_own(directory: Folder, path: Path) -> None:
    """Refuse to write a file or folder over one that a sweep has in its folder.

    Raises:
        InputError: it is one of them, or lies among the shards.
    """
    folder, place = Path(directory).resolve(), path.parent.resolve() / path.name
    if place.is_relative_to(folder) and place.relative_to(folder).parts[:1] in {(name,) for name in (*OWN, "lock")}:
        raise InputError(f"{path}: belongs to the sweep itself; give another path")


def unreadable(path: Path, error: OSError) -> OSError:
    """One line for what the system refused."""
    return OSError(f"{path}: cannot be read ({os.strerror(error.errno or errno.EIO)}); make it readable")
