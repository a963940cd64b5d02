"""What a block of threads has: its registers, and where its board lies, in shared memory or in the chain's scratch."""

from warpchain.kernels import layout
from warpchain.kernels.types import CHAIN_DOUBLES

LARGEST_SHARED_BLOCK = 448
"""Most threads of a block whose board fits into its shared memory."""
STARTS = 14
"""Numbers of a thread that describe the start of a step, see :mod:`gpu.increments`."""


def shares_board(block_dim: int) -> bool:
    """Whether the board of a block of this many threads lies in its shared memory, or else in the scratch."""
    return block_dim <= LARGEST_SHARED_BLOCK


def available_registers(threads: int) -> int:
    """Registers that a thread of a block can have: each of four schedulers has 16384 for its warps of 32 threads."""
    return 16384 // (-(-threads // 128) * 32) // 8 * 8


def board_size(threads: int) -> int:
    """Doubles of a board: a column per thread of the block and one more; the chain's values and constants."""
    return layout.BOARD_VALUES * (threads + 1) + max(threads + 1, layout.VALUES + CHAIN_DOUBLES)


def starts_offset(threads: int) -> int:
    """Doubles of a chain's scratch before the starts, behind board and plane; an even number."""
    return (board_size(threads) + layout.PLANE_ROWS + 1) // 2 * 2


def board_rows(block_dim: int, columns: int) -> int:
    """Rows of a chain's scratch of this width: for what is kept between launches, or all of the board and a plane."""
    if shares_board(block_dim):
        return layout.BOARD_VALUES
    return -(-(starts_offset(block_dim) + STARTS * block_dim) // columns)
