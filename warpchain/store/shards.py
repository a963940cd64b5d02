"""Shards: immutable HDF5 files that hold the rows and motions of ended walks, and the manifest that says what they are.

A shard appears whole or not at all: its bytes go to a temporary name, to the disk, and then get their name.
Only what the digest of the sweep and the numerics decide is in it, no time and no place, so that a sweep
leaves the same bytes however often it was killed and wherever its shards were computed.
"""

import errno
import hashlib
import importlib.metadata
import io
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.sweeps.recording import Recording
from warpchain.walks.motion import Motion, read_motion, write_motions
from warpchain.walks.rows import Rows, missing_rows, row_type
from warpchain.walks.walk_result import replacing

if TYPE_CHECKING:
    import h5py

    from warpchain.sweeps.plan import Sweep

Folder = str | os.PathLike[str]

NUMERICS_VERSION: Final = 10
"""Raised by every change that changes a number of any walk; shards of two versions never mix."""

FORMAT: Final = "warpchain sweep"
FORMAT_VERSION: Final = 2

OWN: Final = ("sweep.json", "sweep.yaml", "shards", "log.txt")
"""What a sweep has in its folder, beside the lock."""


@dataclass(frozen=True)
class BlockLayout:
    """Where the walks of a block are: C order over the axes, then samples, from walk `first` on.

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
    """What a folder belongs to and how its walks are laid out: all that a reader needs beside the shards.

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
    def of(cls, sweep: "Sweep", shard_size: int) -> Self:
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
            versions={name: importlib.metadata.version(name) for name in ("warpchain", "warp-lang", "numpy")},
        )

    @property
    def row_type(self) -> np.dtype[np.void]:
        """Type of the rows: the quantities drawn by any block are columns in all."""
        return row_type([name for block in self.blocks for name in block.drawn])

    @property
    def shards(self) -> list[range]:
        """The walks of each shard."""
        starts = range(0, self.walk_count, self.shard_size)
        return [range(start, min(start + self.shard_size, self.walk_count)) for start in starts]

    @property
    def recording(self) -> Recording:
        """What is kept of the motion of walks."""
        return Recording.of(self.sweep.get("record", {}))

    def kept(self, walks: range) -> list[int]:
        """Those of some walks whose motion is kept."""
        series = self.recording.series
        if series is None:
            return []
        found = []
        for block in self.blocks:
            last = block.first + int(np.prod(block.shape))
            part = range(max(walks.start, block.first), min(walks.stop, last))
            found += [walk for walk in part if series.includes((walk - block.first) % block.samples)]
        return found

    @property
    def kept_count(self) -> int:
        """Number of walks whose motion is kept."""
        series = self.recording.series
        if series is None:
            return 0
        return sum(
            int(np.prod(block.shape[:-1]))
            * (block.samples if series.samples is None else sum(sample < block.samples for sample in series.samples))
            for block in self.blocks
        )

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
        if (version := content["format_version"]) != FORMAT_VERSION:
            raise InputError(f"{path}: format version {version}, not {FORMAT_VERSION}; use another warpchain")
        del content["format"], content["format_version"]
        blocks = [
            BlockLayout(
                name=block["name"],
                axes={name: tuple(values) for name, values in block["axes"].items()},
                samples=block["samples"],
                first=block["first"],
                drawn=tuple(block["drawn"]),
            )
            for block in content.pop("blocks")
        ]
        return Manifest(**content, blocks=tuple(blocks))
    except InputError:
        raise
    except (FileNotFoundError, NotADirectoryError):
        problem = "no sweep in this folder; give the folder of one, which every worker can reach by this path"
        raise InputError(f"{directory}: {problem}") from None
    except OSError as error:
        raise _unreadable(path, error) from error
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{path}: damaged, or not of warpchain; give the folder of a sweep") from None


def empty_rows(sweep: "Sweep", walks: range) -> Rows:
    """Rows to fill in, shape (len(walks),): indices are there, status is `MISSING`, the rest NaN or −1."""
    return missing_rows(row_type([name for block in sweep.blocks for name in block.drawn]), walks)


def shard_name(walks: range) -> str:
    """Name of the file of a shard; names sort like the walks."""
    return f"{walks.start:09d}-{walks.stop - 1:09d}.h5"


def shard_key(digest: str, walks: range, numerics_version: int = NUMERICS_VERSION) -> str:
    """What names the content of a shard: equal keys, equal bytes; hexadecimal SHA-256."""
    return hashlib.sha256(f"{digest} {numerics_version} {walks.start} {walks.stop}".encode()).hexdigest()


def write_shard(
    directory: Folder, digest: str, walks: range, rows: Rows, motions: Mapping[int, Motion] | None = None
) -> str:
    """Write the rows of a shard; needs no lock and no `SweepFolder`, so that the workers of a sweep can call it.

    Two workers may write the same shard at the same time: both have the same bytes, and one replaces the
    other's.

    Args:
        directory: folder of the sweep, opened before by the process that runs the sweep.
        digest: digest of the sweep that the rows were computed for.
        walks: indices of the walks; one of `SweepFolder.missing`.
        rows: their rows, shape (len(walks),), in order, of the type that the manifest says.
        motions: index → motion of those of the walks whose motion the sweep keeps; None: of none.

    Returns:
        The key of the shard.

    Raises:
        OSError: the file cannot be written; the folder is as it was.
        InputError: the folder is not that of the sweep, perhaps not any more.
        ValueError: the rows or the motions are not those of the walks.
    """
    manifest = read_manifest(directory)
    if (manifest.digest, manifest.numerics_version) != (digest, NUMERICS_VERSION):
        raise InputError(f"{directory}: belongs to another sweep now; these walks were not written")
    if walks not in manifest.shards:
        raise ValueError(f"walks {walks.start} to {walks.stop - 1} are no shard of this sweep")
    if rows.dtype != manifest.row_type or not np.array_equal(rows["index"], walks):
        raise ValueError(f"the rows are not those of walks {walks.start} to {walks.stop - 1}, all in order")
    if not np.isin(rows["status"], [status for status in Status if status != Status.RUNNING]).all():
        raise ValueError(f"a walk of {walks.start} to {walks.stop - 1} has no status that ends a walk")
    motions = motions or {}
    if sorted(motions) != manifest.kept(walks):
        raise ValueError(f"the motions are not those that are kept of walks {walks.start} to {walks.stop - 1}")
    rows = rows.copy()
    for name in rows.dtype.names or ():  # there are many NaNs, and which one may depend on the batch
        if rows[name].dtype.kind == "f":
            rows[name][np.isnan(rows[name])] = np.nan
    key = shard_key(digest, walks)

    def fill(file: "h5py.File") -> None:
        file.attrs["format"] = FORMAT
        file.attrs["key"] = key
        file.attrs["digest"] = digest
        file.attrs["numerics_version"] = NUMERICS_VERSION
        dataset = file.create_dataset("rows", data=rows)
        dataset.attrs["sha256"] = _checksum(rows)
        if motions:
            write_motions(motions, file)

    put_file(Path(directory) / "shards" / shard_name(walks), hdf5_image(fill))
    return key


def read_shard(directory: Folder, digest: str, walks: range, *, numerics_version: int = NUMERICS_VERSION) -> Rows:
    """The rows of a shard, all checked; needs no lock.

    Args:
        directory: folder of the sweep.
        digest: digest of the sweep.
        walks: indices of the walks of the shard.
        numerics_version: version of the numerics that they were computed with.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is damaged or belongs to another sweep.
    """
    with _opened(directory, digest, walks, numerics_version) as file:
        rows = np.asarray(file["rows"][()])
        if _checksum(rows) != file["rows"].attrs["sha256"]:
            raise ValueError("rows")
    return rows


def read_motions(directory: Folder, manifest: Manifest, walks: range) -> dict[int, Motion]:
    """The motions of some walks of one shard, by index and in order, all checked; needs no lock.

    Args:
        directory: folder of the sweep.
        manifest: its manifest.
        walks: indices of walks of one shard; those whose motion is not kept are left out.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is damaged or belongs to another sweep.
    """
    shard = manifest.shard_of(walks.start)
    with _opened(directory, manifest.digest, shard, manifest.numerics_version) as file:
        return {walk: read_motion(file, walk) for walk in manifest.kept(walks)}


@contextmanager
def _opened(directory: Folder, digest: str, walks: range, numerics_version: int) -> "Iterator[h5py.File]":
    """The file of a shard; whatever goes wrong while it is read means that it is damaged."""
    import h5py

    path = Path(directory) / "shards" / shard_name(walks)
    try:
        content = path.open("rb")
    except OSError as error:
        raise _unreadable(path, error) from error
    is_foreign = False
    with content:
        try:
            with h5py.File(content, "r") as file:
                is_foreign = str(file.attrs["key"]) != shard_key(digest, walks, numerics_version)
                if not is_foreign:
                    yield file
        except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError):
            problem = "damaged or cut short; delete it and run the sweep again, which computes only its walks"
            raise InputError(f"{path}: {problem}") from None
    if is_foreign:
        raise InputError(f"{path}: a shard of another sweep; move it out of this folder")


def _checksum(rows: Rows) -> str:
    """Hexadecimal SHA-256 of rows and their type."""
    return hashlib.sha256(json.dumps(rows.dtype.descr).encode() + rows.tobytes()).hexdigest()


def present_shards(directory: Folder, manifest: Manifest) -> dict[range, Path]:
    """The shards that are there, by their walks and in order; hidden files are passed over.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is a file that is no shard of this sweep.
    """
    folder = Path(directory) / "shards"
    named = {shard_name(walks): walks for walks in manifest.shards}
    try:
        names = {name for name in os.listdir(folder) if not name.startswith(".")}
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise _unreadable(folder, error) from error
    if strange := sorted(names - named.keys()):
        more = f" (and {len(strange) - 1} more)" if strange[1:] else ""
        raise InputError(f"{folder / strange[0]}: not a shard of this sweep; move it out of this folder{more}")
    return {walks: folder / name for name, walks in named.items() if name in names}


def check_not_own(directory: Folder, path: Path) -> None:
    """Check that a file or folder to be written is none that a sweep has in its folder.

    Raises:
        InputError: it is one of them, or lies among the shards.
    """
    folder, place = Path(directory).resolve(), path.parent.resolve() / path.name
    if place.is_relative_to(folder) and place.relative_to(folder).parts[:1] in {(name,) for name in (*OWN, "lock")}:
        raise InputError(f"{path}: belongs to the sweep itself; give another path")


def hdf5_image(fill: "Callable[[h5py.File], None]") -> bytes:
    """The bytes of an HDF5 file.

    The file is made in memory, because HDF5 on a full disk neither says what is wrong nor lets go of the
    file. Version bounds and times are fixed: equal content gives equal bytes.

    Args:
        fill: fills the empty file.
    """
    import h5py

    image = io.BytesIO()
    with h5py.File(image, "w", **_FIXED) as file:
        fill(file)
    return image.getvalue()


@contextmanager
def open_new_hdf5(path: Path, most: int) -> "Iterator[h5py.File]":
    """A new HDF5 file that is too large for `hdf5_image`, with the same bytes.

    Its room is taken beforehand, for the reason given there; what is left over is given back.

    Args:
        path: the file, which may be there.
        most: bytes that it takes at most.

    Raises:
        OSError: there is not enough room, or the file cannot be written.
    """
    import h5py

    with path.open("w+b") as content, h5py.File(content, "w", **_FIXED) as file:
        _take_room(content.fileno(), most)
        yield file


def _take_room(descriptor: int, size: int) -> None:
    """Take room for a file on the disk, so that a full one is found now; what is in the file stays.

    Raises:
        OSError: there is not enough room.
    """
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(descriptor, 0, size)
        return
    zeros, end = bytes(2**20), os.fstat(descriptor).st_size  # macOS
    while end < size:
        end += os.pwrite(descriptor, zeros[: size - end], end)


_FIXED: Final[dict[str, Any]] = {"libver": ("v108", "v108"), "track_order": True}
"""What equal bytes take."""


_REMEDIES: Final = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), "make room"),
    **dict.fromkeys((errno.EROFS, errno.EACCES, errno.EPERM), "make the folder writable"),
    **dict.fromkeys((errno.ENOENT, errno.ENOTDIR, errno.EEXIST), "give a folder that is there"),
}


def unwritable(path: Path, error: OSError) -> OSError:
    """One line for what the system refused, and the remedy."""
    number = error.errno or getattr(error.__cause__, "errno", None) or errno.EIO
    remedy = _REMEDIES.get(number, "see to the disk")
    return OSError(
        f"{path}: cannot be written ({os.strerror(number)}); {remedy} and start again, shards written are kept"
    )


def _unreadable(path: Path, error: OSError) -> OSError:
    """One line for what the system refused."""
    return OSError(f"{path}: cannot be read ({os.strerror(error.errno or errno.EIO)}); make it readable")


def put_file(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all, and down to the disk before this returns.

    Raises:
        OSError: the file cannot be written; one line that names it and the remedy.
    """
    try:
        with replacing(path) as part:
            part.write_bytes(content)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)  # the new name, too
        finally:
            os.close(folder)
    except OSError as error:
        raise unwritable(path, error) from error
