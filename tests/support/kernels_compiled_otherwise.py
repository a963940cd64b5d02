"""Step kernels that are compiled with other flags than those of users, for tests that do not ask for their bits."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from warpchain.engine import kernel_choice, kernel_entries
from warpchain.kernels.cpu import loop as cpu_loop
from warpchain.kernels.gpu import loop as gpu_loop

PLAIN = "-ffp-contract=off -O0"
"""Flags without fused products and without optimisation, with which kernels compile faster and run more slowly.

Without fused products the compiler keeps the arithmetic of the source, optimised or not. So these flags give the same
numbers to the bit as `-ffp-contract=off` alone.
"""


@contextmanager
def compiled_with(flags: str) -> Iterator[None]:
    """Compile step kernels of this process with other flags; what was loaded before is put aside."""
    factories = (cpu_loop.make_advance, gpu_loop.make_advance_block, kernel_entries.kernel_entry)
    with pytest.MonkeyPatch.context() as patch:
        for module in (cpu_loop, gpu_loop, kernel_entries):
            patch.setattr(module, "COMPILER_FLAGS", flags)
        patch.setattr(kernel_choice, "_loaded", {})
        for factory in factories:
            factory.cache_clear()
        yield
    for factory in factories:
        factory.cache_clear()
