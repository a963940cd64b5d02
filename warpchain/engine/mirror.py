"""Arrays on a device and their copies on the host, in one block of memory each: one copy brings all up to date.

A launch uploads the block before and downloads it behind, in the order of its stream. So the host waits for one thing
only, the end of the launch. On a CPU both are the same memory.
"""

import math
from collections.abc import Mapping
from itertools import accumulate
from typing import Any

import warp as wp
from numpy.typing import NDArray

from warpchain.engine.devices import Device, Gpu

ALIGNMENT = 64
"""Bytes at whose multiples arrays begin."""


class Mirror:
    """Arrays by name on the device, their copies on the host, and the bytes of memory that they take on the device."""

    def __init__(self, fields: Mapping[str, tuple[tuple[int, ...], Any]], device: Device, stream: Any) -> None:
        """Begin with zeros; `fields`: name → shape, and type of Warp's or struct of them. A CPU has no stream."""
        sizes = [math.prod(shape) * wp.types.type_size_in_bytes(dtype) for shape, dtype in fields.values()]
        firsts = list(accumulate((-(-size // ALIGNMENT) * ALIGNMENT for size in sizes), initial=0))
        self.bytes = max(ALIGNMENT, firsts[-1])
        self._stream, self._gpu = stream, device if isinstance(device, Gpu) else None
        self._block = wp.zeros(self.bytes, dtype=wp.uint8, device=device.warp)
        self._copy = self._block
        if self._gpu:
            self._copy = wp.zeros(self.bytes, dtype=wp.uint8, device="cpu", pinned=self._gpu.pins_memory)
        self.arrays: dict[str, wp.array] = {}
        self.host: dict[str, NDArray[Any]] = {}
        memory = self._copy.numpy()
        for (name, (shape, dtype)), first, size in zip(fields.items(), firsts, sizes, strict=False):
            array: Any = wp.array(ptr=self._block.ptr + first, dtype=dtype, shape=shape, device=device.warp)
            array.block = self._block  # which an array at a given place does not keep
            kind = wp.zeros(1, dtype=dtype, device="cpu").numpy().dtype
            self.arrays[name], self.host[name] = array, memory[first : first + size].view(kind).reshape(shape)

    def upload(self) -> None:
        """Begin a copy to the device, if there is another."""
        if self._gpu:
            self._gpu.copy(self._block, self._copy, self._stream)

    def download(self) -> None:
        """Begin a copy to the host."""
        if self._gpu:
            self._gpu.copy(self._copy, self._block, self._stream)
