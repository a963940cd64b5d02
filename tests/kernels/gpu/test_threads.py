"""Maxima over the threads of a block, and what the scratch keeps of a board; on CPU fibers."""

import numpy as np
import pytest
import warp as wp

from tests.support.blocks_under_test import fibers
from warpchain.engine.devices import start_device
from warpchain.kernels import layout
from warpchain.kernels.gpu.functions import board_rows, shares_board
from warpchain.kernels.gpu.threads import barrier, block_maxima, tile_address, vec4i
from warpchain.kernels.physics.elementary import order_bits_single

DEVICE = start_device("cpu").warp
THREADS = 24
GREATEST, WRITE_MAXIMA, READ_MAXIMA = block_maxima(THREADS)
ADDRESS = tile_address(vec4i, THREADS)


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


@wp.kernel(module="unique", enable_backward=False)
def greatest_of_four(numbers: wp.array(dtype=vec4i), found: wp.array(dtype=vec4i)):
    """What each thread finds to be the greatest of each of four."""
    _block, lane = wp.tid()
    tile = wp.tile_empty(shape=(wp.static(THREADS),), dtype=vec4i, storage="shared")
    memory = ADDRESS(tile)
    WRITE_MAXIMA(memory, lane, numbers[lane])
    barrier()
    found[lane] = READ_MAXIMA(memory)


def test_all_threads_find_the_greatest_of_each_of_four() -> None:
    """Negative numbers, as keys of negative gaps are, among them."""
    numbers = np.random.default_rng(1).integers(-(2**31), 2**31, (THREADS, 4)).astype(np.int32)
    numbers[:, 1] = -np.abs(numbers[:, 1] // 2) - 1
    found = wp.zeros(THREADS, dtype=vec4i, device=DEVICE)
    with fibers():
        given = wp.array(numbers, dtype=vec4i, device=DEVICE)
        wp.launch_tiled(greatest_of_four, dim=[1], inputs=[given, found], block_dim=THREADS, device=DEVICE)
    np.testing.assert_array_equal(found.numpy(), np.tile(numbers.max(axis=0), (THREADS, 1)))


@pytest.mark.parametrize(("threads", "links"), [(32, 8), (64, 60), (192, 180), (1024, 1000)])
def test_scratch_holds_what_a_board_leaves_there(threads: int, links: int) -> None:
    """Between launches the scratch holds what a shared board cannot keep, or all of a board not shared."""
    columns = layout.padded_width(links)
    rows = board_rows(threads, columns)
    if shares_board(threads):
        assert rows == layout.BOARD_VALUES > layout.BOARD_LOST_SELF
    else:
        assert (rows - 1) * columns < layout.board_size(threads) <= rows * columns
