"""What a block keeps in the memory that its threads share, and what in the chain's scratch block."""

from warpchain.kernels import layout

LARGEST_SHARED_BLOCK = 512
"""Longer chains keep their board in the scratch block: it would not fit into the memory that a block shares."""


def shares_board(block_dim: int) -> bool:
    """Whether the board lies in the memory that a block of so many threads shares, or else in the scratch block."""
    return block_dim <= LARGEST_SHARED_BLOCK


def board_rows(block_dim: int, columns: int) -> int:
    """Rows of this width for what a chain keeps of its board between launches, or for all of a board not shared."""
    if shares_board(block_dim):
        return layout.BOARD_VALUES
    return -(-layout.board_size(block_dim) // columns)
