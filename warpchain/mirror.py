"""An array on a device and its copy on the host, of which each is brought up to date only when it is needed.

A launch waits for nothing but what the host has changed, and the host fetches nothing but what it looks at: of the
arrays of thousands of chains, a few numbers each unless a chain ends.
"""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray


class Mirror:
    """One array; between launches the host reads and edits it through its copy.

    Attributes:
        array: On the device.
    """

    def __init__(self, values: NDArray[np.generic], device: wp.Device, stream: wp.Stream | None) -> None:
        """Put values on a device; copies go over this stream, on a GPU from and to pinned memory."""
        dtype = wp.dtype_from_numpy(values.dtype)
        self.array = wp.array(values, dtype=dtype, device=device)
        self._host = wp.array(values, dtype=dtype, device="cpu", pinned=device.is_cuda)
        self._values: NDArray[Any] = self._host.numpy()
        self._stream = stream
        self._is_edited = self._is_stale = False

    def view(self) -> NDArray[Any]:
        """The elements, to be read."""
        if self._is_stale:
            wp.copy(self._host, self.array, stream=self._stream)
            if self._stream is not None:
                wp.synchronize_stream(self._stream)
            self._is_stale = False
        return self._values

    def edit(self) -> NDArray[Any]:
        """The elements, to be changed before the next launch."""
        values = self.view()
        self._is_edited = True
        return values

    def upload(self) -> None:
        """Bring the device up to date, in the order of the stream."""
        if self._is_edited:
            wp.copy(self.array, self._host, stream=self._stream)
            self._is_edited = False

    def forget(self) -> None:
        """A launch may change the array: the copy on the host is out of date."""
        self._is_stale = True
