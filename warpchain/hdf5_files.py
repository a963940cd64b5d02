"""HDF5 files that are written from memory or into reserved room, so that a full disk does no harm."""

import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    import h5py

_FIXED: Final[dict[str, Any]] = {"libver": ("v108", "v108"), "track_order": True}
"""Version bounds without which equal content would not give equal bytes; they also leave out times."""


def hdf5_image(fill: "Callable[[h5py.File], None]") -> bytes:
    """The bytes of an HDF5 file that `fill` fills; equal content gives equal bytes.

    The file is made in memory, because HDF5 fails badly on a full disk: it neither says what is wrong nor closes the
    file, and may end the process.
    """
    import h5py

    image = io.BytesIO()
    with h5py.File(image, "w", **_FIXED) as file:
        fill(file)
    return image.getvalue()


@contextmanager
def open_new_hdf5(path: Path, most: int) -> "Iterator[h5py.File]":
    """A new HDF5 file that may be too large for `hdf5_image`, with the same bytes.

    Its space on the disk is reserved first, because HDF5 fails badly on a full disk. What is left over is given back.

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
    """Reserve space for a file, whose content stays; an `OSError` if the disk has too little."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(descriptor, 0, size)
        return
    zeros, end = bytes(2**20), os.fstat(descriptor).st_size  # macOS
    while end < size:
        end += os.pwrite(descriptor, zeros[: size - end], end)
