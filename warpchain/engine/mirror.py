"""An array on a device and its copy on the host, which launches bring up to date.

A launch uploads what the host has changed and downloads what the kernel may have changed, in the order of its stream.
So the host waits for one thing only, the end of the launch.
"""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray


class Mirror:
    """One array, which the host reads and edits through its copy between launches.

    Attributes:
        array: The array on the device.
    """

    def __init__(self, values: NDArray[np.generic], device: wp.Device, stream: wp.Stream | None) -> None:
        """Copy values to a device; later copies use this stream, on a GPU from and to pinned memory."""
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
        """Begin a copy to the device if the host has edited the elements."""
        if self._is_edited:
            wp.copy(self.array, self._host, stream=self._stream)
            self._is_edited = False

    def download(self) -> None:
        """Begin a copy to the host."""
        wp.copy(self._host, self.array, stream=self._stream)
