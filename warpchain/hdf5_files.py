"""HDF5 files with checksums: written from memory or into reserved room, and read with distrust.

Behind the HDF5 content, where other readers do not look, stand the SHA-256 of each `PIECE` bytes of it, and a line:

    warpchain checksums: SHA-256 of 0000000000123456 bytes in pieces, HEX

with the length of the content and the SHA-256 of length and checksums. A piece is checked before the HDF5 library gets
a byte of it, because that library may hang, or crash, on damaged files. So a look into a large file costs little.
A user block before the content was tried instead: xarray then does not know the file by itself.

Checksums tell of damage, not of intent. `Contents` therefore opens only what is asked for, and takes only datasets
that lie in the file itself as they are, of the type and the shape that are asked for: nothing leads to another file,
and nothing is larger in memory than in the file.
"""

import hashlib
import io
import json
import os
import re
import stat
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from warpchain.files import reason
from warpchain.inputs.validation import DamagedFileError, InputError

if TYPE_CHECKING:
    import h5py

PIECE: Final = 2**18
"""Bytes of content that have a checksum of their own."""
SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
"""First bytes of an HDF5 file."""


class ContentError(ValueError):
    """The content of a file is not what warpchain writes; the text says in which way."""


class ForeignContentError(ContentError):
    """The content of a file was never HDF5."""


_LINE: Final = "\nwarpchain checksums: SHA-256 of {:016d} bytes in pieces, {}\n"
_LINE_LENGTH: Final = len(_LINE.format(0, "0" * 64))
_FOUND: Final = re.compile(rb"\nwarpchain checksums: SHA-256 of (\d{16}) bytes in pieces, ([0-9a-f]{64})\n")
_PIECES_KEPT: Final = 64
_FIXED: Final[dict[str, Any]] = {"libver": ("v108", "v108"), "track_order": True}
"""Version bounds without which equal content would not give equal bytes; they also leave out times."""


def hdf5_image(fill: "Callable[[h5py.File], None]") -> bytes:
    """The bytes of an HDF5 file that `fill` fills, with checksums; equal content gives equal bytes.

    The file is made in memory, because HDF5 fails badly on a full disk: it neither says what is wrong nor closes the
    file.
    """
    import h5py

    image = io.BytesIO()
    with h5py.File(image, "w", **_FIXED) as file:
        fill(file)
    _add_checksums(image)
    return image.getvalue()


def put_text(group: "h5py.Group", name: str, text: str) -> None:
    """Give a group an attribute that `Contents.text` reads: of fixed length, in UTF-8.

    HDF5 keeps texts of any length in a heap without checksums, and loops for ever on one that is all zeros.
    """
    import h5py

    content = text.encode()
    group.attrs.create(name, content, dtype=h5py.string_dtype("utf-8", max(1, len(content))))


@contextmanager
def open_new_hdf5(path: Path, most: int) -> "Iterator[h5py.File]":
    """A new HDF5 file that may be too large for `hdf5_image`, with the same bytes.

    Its space on the disk is reserved first, because HDF5 fails badly on a full disk. What is left over is given back.

    Args:
        path: the file, which may be there.
        most: bytes that it takes at most, without its checksums.

    Raises:
        OSError: there is not enough room, or the file cannot be written.
    """
    import h5py

    with path.open("w+b") as content:
        with h5py.File(content, "w", **_FIXED) as file:
            _take_room(content.fileno(), most)
            yield file
        _add_checksums(content)


def _add_checksums(file: BinaryIO) -> None:
    """Put the checksums behind the content of a file."""
    file.seek(0)
    table, length = b"", 0
    while piece := file.read(PIECE):
        table += hashlib.sha256(piece).digest()
        length += len(piece)
    file.write(table + _LINE.format(length, _of_table(length, table)).encode())


def _of_table(length: int, table: bytes) -> str:
    """Hexadecimal SHA-256 of a content's length and its checksums."""
    return hashlib.sha256(f"{length} ".encode() + table).hexdigest()


def _take_room(descriptor: int, size: int) -> None:
    """Reserve space for a file, whose content stays; an `OSError` if the disk has too little."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(descriptor, 0, size)
        return
    zeros, end = bytes(2**20), os.fstat(descriptor).st_size  # macOS
    while end < size:
        end += os.pwrite(descriptor, zeros[: size - end], end)


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """A file, open for reading; opening a pipe or a device does not wait, and is refused.

    Raises:
        OSError: it cannot be read; one line that names it.
        InputError: it is no regular file.
    """
    try:
        file = open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder, not a file; give another path") from None
    except OSError as error:
        problem = type(error)(f"{path}: cannot be read ({reason(error)}); give the path of a readable file")
        problem.errno = error.errno
        raise problem from error
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise InputError(f"{path}: a pipe or a device, not a file; give another path")
    return file


class CheckedFile(io.RawIOBase):
    """The HDF5 content of a file, of which each piece is checked before it is handed out.

    Attributes:
        size: bytes of content.
        problem: the error that ended the last call, which HDF5 would hide.
    """

    def __init__(self, file: BinaryIO) -> None:
        """Check that the file has its checksums.

        Raises:
            OSError: it cannot be read.
            ContentError: it is not an HDF5 file, has no checksums, or wrong ones.
        """
        whole = os.fstat(file.fileno()).st_size
        is_hdf5 = file.read(len(SIGNATURE)) == SIGNATURE
        file.seek(max(0, whole - _LINE_LENGTH))
        found = _FOUND.fullmatch(file.read())
        if found is None and not is_hdf5:
            raise ForeignContentError("not an HDF5 file")
        if found is None:
            raise ContentError("no checksums at its end; older versions wrote none")
        self.size = int(found[1])
        table_size = 32 * -(-self.size // PIECE)
        if self.size + table_size + _LINE_LENGTH != whole:
            raise ContentError(f"it has {whole} bytes, but checksums for {self.size}")
        file.seek(self.size)
        self._table = file.read(table_size)
        if _of_table(self.size, self._table) != found[2].decode():
            raise ContentError("its checksums are wrong")
        self.problem: Exception | None = None
        self._file, self._at = file, 0
        self._kept = lru_cache(_PIECES_KEPT)(self._piece)

    def readable(self) -> bool:
        """It is."""
        return True

    def seekable(self) -> bool:
        """It is."""
        return True

    def tell(self) -> int:
        """Place of the next byte."""
        return self._at

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place."""
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self.size}[whence]
        return self._at

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer; a `ContentError` if that goes beyond the end or a piece is damaged."""
        view = memoryview(buffer).cast("B")
        try:
            if not 0 <= self._at <= self.size - len(view):
                raise ContentError(f"it points to byte {self._at + len(view)} of {self.size}")
            done = 0
            while done < len(view):
                number, start = divmod(self._at + done, PIECE)
                part = self._kept(number)[start : start + len(view) - done]
                view[done : done + len(part)] = part
                done += len(part)
        except (OSError, ContentError) as error:
            self.problem = type(error)(*error.args)  # without what led there, which `reading_hdf5` clears
            raise
        self._at += done
        return done

    def check(self) -> None:
        """Check all pieces; errors as of `readinto`."""
        for number in range(-(-self.size // PIECE)):
            self._piece(number)

    def _piece(self, number: int) -> bytes:
        """The bytes of a piece, checked."""
        self._file.seek(number * PIECE)
        piece = self._file.read(min(PIECE, self.size - number * PIECE))
        if hashlib.sha256(piece).digest() != self._table[32 * number : 32 * number + 32]:
            raise ContentError(f"somewhere in its bytes {number * PIECE} to {number * PIECE + len(piece)}")
        return piece


@dataclass(frozen=True)
class Contents:
    """A group of an HDF5 file, of which only what is asked for is opened.

    Attributes:
        group: the group.
        room: bytes of the file's content; nothing in it can be larger.
    """

    group: "h5py.Group"
    room: int

    def has(self, path: str) -> bool:
        """Whether there is something; a `ContentError` if the way there leads out of the file."""
        try:
            self._opened(path)
        except KeyError:
            return False
        return True

    def part(self, path: str) -> "Contents":
        """A group in it; errors as of `array`."""
        import h5py

        found = self._opened(path)
        if not isinstance(found, h5py.h5g.GroupID):
            raise ContentError(f"{path} is no group")
        return Contents(h5py.Group(found), self.room)

    def array(
        self, path: str, kind: DTypeLike, shape: tuple[int | None, ...], rows: slice | None = None
    ) -> NDArray[Any]:
        """An array in it, or some of its rows.

        Args:
            path: names from this group on, with slashes.
            kind: its type.
            shape: its shape; None for an axis of any length.
            rows: which of it along the first axis; None: all.

        Raises:
            KeyError: there is none.
            ContentError: it is of another type or shape, or does not lie in the file itself as it is.
        """
        import h5py

        found = self._opened(path)
        if not isinstance(found, h5py.h5d.DatasetID):
            raise ContentError(f"{path} is no dataset")
        stored = found.get_create_plist()
        layouts = (h5py.h5d.CONTIGUOUS, h5py.h5d.COMPACT)
        if stored.get_layout() not in layouts or stored.get_external_count() or stored.get_nfilters():
            raise ContentError(f"{path} does not lie in the file as it is (filtered, in chunks, virtual or external)")
        dataset = h5py.Dataset(found)
        if dataset.dtype != np.dtype(kind):
            raise ContentError(f"{path} is of another type")
        if len(dataset.shape or ()) != len(shape) or any(
            size not in (None, given) for size, given in zip(shape, dataset.shape, strict=True)
        ):
            raise ContentError(f"{path} has the shape {dataset.shape}")
        if dataset.nbytes > self.room:
            raise ContentError(f"{path} declares {dataset.nbytes} bytes, but the file has {self.room}")
        if found.get_storage_size() != dataset.nbytes:
            raise ContentError(f"{path} declares {dataset.nbytes} bytes, but stores {found.get_storage_size()}")
        values: NDArray[Any] = dataset[() if rows is None else rows]
        return values

    def text(self, name: str) -> str:
        """A text among its attributes, as `put_text` writes it; errors as of `array`."""
        return bytes(self._attribute(name, bytes)).decode()

    def whole(self, name: str) -> int:
        """A whole number among its attributes; errors as of `array`."""
        return int(self._attribute(name, np.integer))

    def json(self, name: str) -> Any:
        """What a text in JSON among its attributes says; errors as of `array`."""
        return json.loads(self.text(name))

    def attributes(self) -> list[str]:
        """Names of its attributes, in order."""
        return list(self.group.attrs)

    def _attribute(self, name: str, kind: type) -> Any:
        import h5py

        if not h5py.h5a.exists(self.group.id, name.encode()):
            raise KeyError(name)
        found = h5py.h5a.open(self.group.id, name.encode())
        stored = found.get_type()
        is_text = isinstance(stored, h5py.h5t.TypeStringID) and not stored.is_variable_str()
        is_known = is_text or isinstance(stored, h5py.h5t.TypeIntegerID)
        if not is_known or found.shape != () or found.get_storage_size() > self.room:
            raise ContentError(f"attribute {name} is no text or number")
        value = self.group.attrs[name]
        if not isinstance(value, kind):
            raise ContentError(f"attribute {name} is of another type")
        return value

    def _opened(self, path: str) -> Any:
        """The object behind a path of which every step is an object of its own, not a pointer to somewhere."""
        import h5py

        at = self.group.id
        for step in path.split("/"):
            name = step.encode()
            if not isinstance(at, h5py.h5g.GroupID) or not at.links.exists(name):
                raise KeyError(path)
            if at.links.get_info(name).type != h5py.h5l.TYPE_HARD:
                raise ContentError(f"{path} is a link to another place")
            at = h5py.h5o.open(at, name)
        return at


@contextmanager
def reading_hdf5(path: str | os.PathLike[str], remedy: str, wanted: str | None = None) -> Iterator[Contents]:
    """The content of a file that `hdf5_image` or `open_new_hdf5` wrote; an error while it is read means damage.

    Args:
        path: the file.
        remedy: what to do about a damaged file.
        wanted: which file to give instead of one that is not HDF5 at all; None: such a file is damaged.

    Raises:
        OSError: it cannot be read.
        InputError: it is no regular file, or not HDF5 and `wanted` is given.
        DamagedFileError: it is damaged, or has other content than is asked for.
    """
    import h5py

    with open_regular(path) as file:
        checked = None
        try:
            checked = CheckedFile(file)
            with h5py.File(checked, "r") as opened:
                yield Contents(opened["/"], checked.size)
        except InputError:
            raise
        except (OSError, RuntimeError, LookupError, TypeError, ValueError, AttributeError) as error:
            # Whoever keeps the error would keep h5py's frames, and with them the settings of the file. When HDF5 frees
            # those after the end of Python, the process crashes.
            traceback.clear_frames(error.__traceback__)
            problem = checked.problem if checked is not None and checked.problem else error
            if isinstance(problem, OSError) and problem.errno:
                raise OSError(f"{path}: cannot be read ({reason(problem)}); see to the disk") from error
            if wanted and isinstance(problem, ForeignContentError):
                raise InputError(f"{path}: {problem}; {wanted}") from None
            raise _damaged(path, problem, remedy) from None


def check_hdf5(path: str | os.PathLike[str], remedy: str, wanted: str) -> None:
    """Check every byte of a file that `hdf5_image` or `open_new_hdf5` wrote; errors as of `reading_hdf5`."""
    with open_regular(path) as file:
        try:
            CheckedFile(file).check()
        except ForeignContentError as error:
            raise InputError(f"{path}: {error}; {wanted}") from None
        except ContentError as error:
            raise _damaged(path, error, remedy) from None


def _damaged(path: str | os.PathLike[str], problem: Exception, remedy: str) -> DamagedFileError:
    """One line for a file whose content is not right; what HDF5 and others say of it helps nobody."""
    why = f" ({problem})" if isinstance(problem, ContentError) else ""
    return DamagedFileError(f"{path}: damaged or cut short{why}; {remedy}")
