"""Kernels that do the same operations on a GPU and on a CPU.

They are compiled without optimisation, which takes a quarter of the time. Without fused products, and with none of the
liberties that a compiler can be given, optimisation changes no bit: all of both kernels is IEEE arithmetic in the order
of the source.
"""

from collections.abc import Iterator

import pytest

from warpchain.kernels.cpu import loop as cpu_loop
from warpchain.kernels.gpu import loop as gpu_loop


@pytest.fixture(scope="module")
def without_fused_operations() -> Iterator[None]:
    """Step kernels without fused operations, for all tests of a module."""
    factories = (cpu_loop.make_advance, gpu_loop.make_advance_block)
    with pytest.MonkeyPatch.context() as patch:
        for module in (cpu_loop, gpu_loop):
            patch.setattr(module, "COMPILER_FLAGS", "-ffp-contract=off -O0")
        for factory in factories:
            factory.cache_clear()
        yield
    for factory in factories:
        factory.cache_clear()
