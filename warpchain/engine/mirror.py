"""An array on a device and its copy on the host, brought up to date by the launches themselves.

A launch takes along what the host has changed and brings back what it may have changed itself, in the order of its
stream, so that the host waits for one thing only: the end of the launch.
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
        self._is_edited = False

    def view(self) -> NDArray[Any]:
        """The elements, to be read between launches."""
        return self._values

    def edit(self) -> NDArray[Any]:
        """The elements, to be changed between launches."""
        self._is_edited = True
        return self._values

    def upload(self) -> None:
        """Begin to bring the device up to date."""
        if self._is_edited:
            wp.copy(self.array, self._host, stream=self._stream)
            self._is_edited = False

    def download(self) -> None:
        """Begin to bring the host up to date."""
        wp.copy(self._host, self.array, stream=self._stream)
