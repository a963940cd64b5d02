"""HDF5 files of warpchain with other content and right checksums: the work of a hostile author."""

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from warpchain.hdf5_files import CheckedFile, _add_checksums, open_regular


@contextmanager
def forged(path: Path) -> Iterator[h5py.File]:
    """The file, open to be changed; its checksums are right again in the end."""
    with open_regular(path) as file:
        size = CheckedFile(file).size
    image = io.BytesIO(path.read_bytes()[:size])
    with h5py.File(image, "a") as opened:
        yield opened
    _add_checksums(image)
    path.write_bytes(image.getvalue())


def with_byte(content: bytes, place: int, change: Callable[[int], int]) -> bytes:
    """A copy with one other byte."""
    return content[:place] + bytes([change(content[place])]) + content[place + 1 :]
