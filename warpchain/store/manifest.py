"""The manifest of a sweep's folder, sweep.json: what the folder belongs to, and how its walks are laid out.

Walks have places in a folder, and a shard holds a range of places. In a sweep run as it was begun, a walk's place is
its number. When the sweep is given more samples, a new generation of shards gets the added walks, at the places after
all earlier ones, so that no shard changes; the numbers of the walks are then those of the larger sweep.
"""

import bisect
import errno
import itertools
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.validation import InputError
from warpchain.store.manifest_content import damaged, read_content, samples_of, walks_of, with_checksum
from warpchain.sweeps.designs import walks_per_sample
from warpchain.sweeps.plan import Sweep, digest_of
from warpchain.sweeps.recording import Recording
from warpchain.version import package_versions
from warpchain.walks.rows import row_type

Folder = str | os.PathLike[str]

NUMERICS_VERSION: Final = 12
"""Raised by every change that changes a number of any walk; shards of two versions never mix."""

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
    axes: dict[str, tuple[float | int | str | None, ...]]
    samples: int
    first: int
    drawn: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis, then the number of samples."""
        return (*(len(values) for values in self.axes.values()), self.samples)


@dataclass(frozen=True)
class Generation:
    """What a folder held before it grew.

    Attributes:
        digest: `Sweep.digest` then.
        samples: number of samples in each cell of each block then.
        shard_size: number of walks in a shard of this generation; the last has what is left.
    """

    digest: str
    samples: tuple[int, ...]
    shard_size: int


@dataclass(frozen=True)
class _Part:
    """The walks that one generation adds to one block, in C order over cells and added samples.

    Attributes:
        places: their places in the folder.
        block: the block.
        samples: the added samples of each cell.
    """

    places: range
    block: BlockLayout
    samples: range


@dataclass(frozen=True)
class Manifest:
    """What a folder belongs to and how its walks are laid out: what a reader needs beside the shards.

    Attributes:
        name: name of the sweep.
        seed: its seed.
        digest: `Sweep.digest`; equal digests mean equal numbers.
        numerics_version: `NUMERICS_VERSION` of the walks.
        shard_size: number of walks in a shard of the last generation; the last one has what is left.
        walk_count: number of walks.
        blocks: the blocks of the sweep.
        sweep: `Sweep.canonical`.
        versions: the software that began the sweep.
        earlier: the generations before the last one, in order.
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
    earlier: tuple[Generation, ...] = ()

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

    @cached_property
    def row_type(self) -> np.dtype[np.void]:
        """Type of the rows: the quantities drawn by any block are columns in all."""
        return row_type([name for block in self.blocks for name in block.drawn])

    @cached_property
    def generations(self) -> tuple[Generation, ...]:
        """All generations, the present one last."""
        return *self.earlier, Generation(self.digest, tuple(block.samples for block in self.blocks), self.shard_size)

    @cached_property
    def _parts(self) -> list[list[_Part]]:
        """The parts of each generation, one for each block."""
        parts: list[list[_Part]] = []
        place, before = 0, (0,) * len(self.blocks)
        for generation in self.generations:
            parts.append([])
            for block, first, stop in zip(self.blocks, before, generation.samples, strict=True):
                count = math.prod(block.shape[:-1]) * (stop - first)
                parts[-1].append(_Part(range(place, place + count), block, range(first, stop)))
                place += count
            before = generation.samples
        return parts

    @cached_property
    def _parts_in_order(self) -> list[_Part]:
        """The parts of all generations, in the order of their places."""
        return list(itertools.chain(*self._parts))

    def overlaps(self, places: range) -> Iterator[tuple[_Part, range]]:
        """The parts that hold some places, each with those of the places that it holds."""
        parts = self._parts_in_order
        first = max(0, bisect.bisect_right(parts, places.start, key=lambda part: part.places.start) - 1)
        for part in itertools.islice(parts, first, None):
            if part.places.start >= places.stop:
                break
            if here := range(max(places.start, part.places.start), min(places.stop, part.places.stop)):
                yield part, here

    def walks(self, places: range) -> NDArray[np.int64]:
        """Numbers of the walks at some places, shape (len(places),)."""
        found = np.empty(len(places), np.int64)
        for part, here in self.overlaps(places):
            cell, added = np.divmod(np.arange(here.start, here.stop) - part.places.start, len(part.samples))
            numbers = part.block.first + cell * part.block.samples + part.samples.start + added
            found[here.start - places.start : here.stop - places.start] = numbers
        return found

    def place(self, walk: int) -> int:
        """The place of a walk, given its number."""
        number = max(number for number, block in enumerate(self.blocks) if block.first <= walk)
        cell, sample = divmod(walk - self.blocks[number].first, self.blocks[number].samples)
        part = next(parts[number] for parts in self._parts if sample in parts[number].samples)
        return part.places.start + cell * len(part.samples) + sample - part.samples.start

    @property
    def shards(self) -> list[range]:
        """The places of each shard."""
        starts = (
            range(parts[0].places.start, parts[-1].places.stop, generation.shard_size)
            for generation, parts in zip(self.generations, self._parts, strict=True)
        )
        return [self.shard_of(start) for start in itertools.chain(*starts)]

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

    def kept(self, places: range) -> list[int]:
        """Those of some places whose walks have their motion kept."""
        found = []
        for part, here in self.overlaps(places):
            kept = self._kept_samples(part.block)
            added = part.samples
            found += [place for place in here if added[(place - part.places.start) % len(added)] in kept]
        return found

    @property
    def kept_count(self) -> int:
        """Number of walks whose motion is kept."""
        return sum(math.prod(block.shape[:-1]) * len(self._kept_samples(block)) for block in self.blocks)

    def shard_of(self, place: int) -> range:
        """The places of the shard that a place is in."""
        number = self._generation_of(place)
        parts, size = self._parts[number], self.generations[number].shard_size
        start = place - (place - parts[0].places.start) % size
        return range(start, min(start + size, parts[-1].places.stop))

    def shard_with(self, walk: int) -> range:
        """The places of the shard that has a walk, given its number."""
        return self.shard_of(self.place(walk))

    def digests_of(self, place: int) -> list[str]:
        """The digests of the generations up to that of a place: together they name the content of its shard."""
        return [generation.digest for generation in self.generations[: self._generation_of(place) + 1]]

    def _generation_of(self, place: int) -> int:
        """Number of the generation of a place."""
        return bisect.bisect_right(self._parts, place, key=lambda parts: parts[0].places.start) - 1

    def grown_from(self, found: "Manifest") -> "Manifest":
        """This manifest for the folder of another one, which has fewer samples of the same walks."""
        return replace(self, earlier=found.generations, versions=found.versions)

    def text(self) -> str:
        """Content of sweep.json."""
        return json.dumps(with_checksum(asdict(self)), indent=1, allow_nan=False, ensure_ascii=False) + "\n"

    def agrees(self) -> bool:
        """Whether the generations grow, and have the digests of their sweep as far as this version can tell."""
        counts = [generation.samples for generation in self.generations]
        if any(len(samples) != len(self.blocks) for samples in counts):
            return False
        if any(
            more < fewer for one, other in itertools.pairwise(counts) for fewer, more in zip(one, other, strict=True)
        ):
            return False
        if self.numerics_version != NUMERICS_VERSION:
            return True
        walks = [walks_per_sample(block["sampler"], len(block["distributions"]) - 1) for block in self.sweep["blocks"]]
        return all(
            generation.digest == digest_of(self.sweep, [n // each for n, each in zip(samples, walks, strict=True)])
            for generation, samples in zip(self.generations, counts, strict=True)
        )


def read_manifest(directory: Folder) -> Manifest:
    """The manifest of a folder.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is no sweep in it, or one of another version of warpchain.
        DamagedFileError: its sweep.json is damaged.
    """
    path = Path(directory) / "sweep.json"
    try:
        content = read_content(path)
    except (FileNotFoundError, NotADirectoryError):
        problem = "no sweep in this folder; give the folder of one, which every worker can reach by this path"
        raise InputError(f"{directory}: {problem}") from None
    sweep = content["sweep"]
    manifest = Manifest(
        name=sweep["name"],
        seed=sweep["seed"],
        digest=content["digest"],
        numerics_version=content["numerics_version"],
        shard_size=content["shard_size"],
        walk_count=sum(map(walks_of, sweep["blocks"])),
        blocks=_layouts(sweep),
        sweep=sweep,
        versions=content["versions"],
        earlier=tuple(Generation(**{**each, "samples": tuple(each["samples"])}) for each in content["earlier"]),
    )
    try:
        agrees = with_checksum(json.loads(json.dumps(asdict(manifest)))) == with_checksum(content) and manifest.agrees()
    except KeyError:  # a preset that is none
        agrees = False
    if not agrees:
        raise damaged(path, "it contradicts itself")
    return manifest


def _layouts(sweep: Mapping[str, Any]) -> tuple[BlockLayout, ...]:
    """The blocks of a sweep, given its canonical form."""
    found: list[BlockLayout] = []
    first = 0
    for block in sweep["blocks"]:
        axes = {name: tuple(values) for name, values in block["grid"].items()}
        drawn = tuple(name for name in block["distributions"] if name != "all")
        found.append(BlockLayout(block["name"], axes, samples_of(block), first, drawn))
        first += walks_of(block)
    return tuple(found)


def known_manifest(directory: Folder) -> Manifest:
    """The manifest of a folder as of `read_manifest`, read anew only when the file is another; not to be changed.

    A task asks for it again before it writes each shard, and that of a sweep with many blocks takes long to read.
    """
    try:
        descriptor = os.open(Path(directory) / "sweep.json", os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return read_manifest(directory)  # which says what is wrong
    try:
        now = os.fstat(descriptor)  # of the opened file, because shared file systems answer `stat` from memory
    finally:
        os.close(descriptor)
    return _manifest_once(str(directory), now.st_dev, now.st_ino, now.st_size, now.st_mtime_ns, now.st_ctime_ns)


@lru_cache(maxsize=8)
def _manifest_once(directory: str, *identity: int) -> Manifest:
    """The manifest of a folder, for the identity of its file."""
    return read_manifest(directory)


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
