"""What a block keeps in the memory that its threads share, and what in the chain's scratch block."""

from warpchain.kernels import layout
from warpchain.kernels.methods.method import METHODS

LARGEST_SHARED_BLOCK = 512
"""Longer chains keep their board in the scratch block: it would not fit into the memory that a block shares."""
LARGEST_SHARED_MEMORY = 192
"""The same for what a method keeps, if anything."""
LARGEST_SHARED_FLIGHT = 64
"""The same for flights, which are rare: chains of more links would have to share a multiprocessor with fewer others."""


def shares_board(block_dim: int) -> bool:
    """Whether the board lies in the memory that a block of so many threads shares, or else in the scratch block."""
    return block_dim <= LARGEST_SHARED_BLOCK


def block_rows(method: str, block_dim: int, columns: int) -> int:
    """Rows of a chain's scratch block of this width that the block form needs: for the board and the method."""
    rows = board_rows(block_dim, columns)
    if not shares_memory(method, block_dim):
        rows += -(-METHODS[method].block_memory(block_dim) // columns)
    return rows


def shares_memory(method: str, block_dim: int) -> bool:
    """Whether what a method keeps lies in the memory that a block shares, or else in the scratch block."""
    return block_dim <= (LARGEST_SHARED_FLIGHT if METHODS[method].flight else LARGEST_SHARED_MEMORY)


def board_rows(block_dim: int, columns: int) -> int:
    """Rows of this width for what a chain keeps of its board between launches, or for all of a board not shared."""
    if shares_board(block_dim):
        return layout.BOARD_NOTES
    return -(-layout.board_size(block_dim) // columns)
