"""Kernels that do the same operations on a GPU and on a CPU."""

from collections.abc import Iterator

import pytest

from tests.support.kernels_compiled_otherwise import PLAIN, compiled_with


@pytest.fixture(scope="module")
def without_fused_operations() -> Iterator[None]:
    """Step kernels without fused operations, for all tests of a module."""
    with compiled_with(PLAIN):
        yield
