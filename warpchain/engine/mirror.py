"""An array on a device and its copy on the host, which launches bring up to date.

A launch uploads what the host has changed and downloads what the kernel may have changed, in the order of its stream.
So the host waits for one thing only, the end of the launch.
"""

from typing import Any

import warp as wp
from numpy.typing import NDArray

from warpchain.engine.devices import Gpu


class Mirror:
    """One array, which the host reads and edits through its copy between launches.

    Attributes:
        array: The array on the device.
    """

    def __init__(self, shape: tuple[int, ...], dtype: Any, device: Gpu, stream: Any) -> None:
        """Begin with zeros, of a type of Warp's or structs of them; copies wait in this stream."""
        self.array = wp.zeros(shape, dtype=dtype, device=device.warp)
        self._host = device.host_array(shape, dtype)
        self._values: NDArray[Any] = self._host.numpy()
        self._device = device
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
            self._device.copy(self.array, self._host, self._stream)
            self._is_edited = False

    def download(self) -> None:
        """Begin a copy to the host."""
        self._device.copy(self._host, self.array, self._stream)
