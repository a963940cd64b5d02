"""Maxima over the threads of a block, on CPU fibers."""

import numpy as np
import pytest
import warp as wp

from tests.support.blocks_under_test import fibers
from warpchain.engine.devices import start_device
from warpchain.kernels.gpu.threads import block_maxima
from warpchain.kernels.physics.elementary import order_bits_single

DEVICE = start_device("cpu").warp
THREADS = 24
GREATEST, *_ = block_maxima(THREADS)


@wp.kernel(module="unique", enable_backward=False)
def greatest_of(numbers: wp.array(dtype=wp.float32), found: wp.array(dtype=wp.float32)):
    """What each thread finds to be the greatest of the numbers."""
    _block, lane = wp.tid()
    tile = wp.tile_empty(shape=(wp.static(THREADS),), dtype=wp.int32, storage="shared")
    found[lane] = wp.cast(GREATEST(tile, lane, order_bits_single(numbers[lane])), wp.float32)


@pytest.mark.parametrize("odd", [0.5, 3e38, np.inf, np.nan, -np.nan], ids=str)
@pytest.mark.parametrize("thread", [0, 13, THREADS - 1])
def test_all_threads_find_the_greatest_number_and_miss_no_nan(odd: float, thread: int) -> None:
    """The greatest of numbers from 0 on is the same for all threads; a NaN of either sign is above infinity."""
    numbers = np.linspace(0, 1, THREADS, dtype=np.float32)[::-1].copy()
    numbers[(thread + 1) % THREADS] = np.inf if np.isnan(odd) else 0.0
    numbers[thread] = odd
    expected = np.float32(np.nan) if np.isnan(odd) else numbers.max()
    found = wp.zeros(THREADS, dtype=wp.float32, device=DEVICE)
    with fibers():
        given = wp.array(numbers, dtype=wp.float32, device=DEVICE)
        wp.launch_tiled(greatest_of, dim=[1], inputs=[given, found], block_dim=THREADS, device=DEVICE)
    np.testing.assert_array_equal(found.numpy(), np.full(THREADS, expected))
