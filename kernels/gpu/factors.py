"""Where the factors of a loop's linear system lie in the memory that a block shares, for :mod:`gpu.solver`."""

import functools
from dataclasses import dataclass

import warp as wp

from warpchain.kernels.cpu.implicit.solver import block_type
from warpchain.kernels.gpu.threads import read, write

wp.set_module_options({"enable_backward": False})

LAST_ROWS = 24
"""Rows of the last level: no more than a hardware warp has threads; fewer take less memory."""
LEAST_REDUCTIONS = 2
"""With one, residuals are up to 1e5 times as large: parallel cyclic reduction suffers where links seem rigid."""


@dataclass(frozen=True)
class FactorLayout:
    """Where the factors of a block's system lie in shared memory, in doubles; numbers of one kind side by side.

    While a system is factored, its rows are handed about where vectors and later factors will lie.

    Attributes:
        block_dim: Threads in a block, at least the number of links.
        reductions: Levels of cyclic reduction, at least one.
        link_numbers: Numbers a link from which its blocks are made; they lie at the beginning.
        order: Order B of the blocks, 2 or 3.
        has_diagonals: Whether the blocks D are diagonal matrices; others have their inverses kept.
    """

    block_dim: int
    reductions: int
    link_numbers: int
    order: int = 3
    has_diagonals: bool = True

    def width(self, level: int) -> int:
        """Greatest number of rows of a level."""
        return -(-self.block_dim // 2**level)

    @property
    def block(self) -> int:
        """Entries of a block."""
        return self.order**2

    @property
    def last_width(self) -> int:
        """Greatest number of rows of the last level."""
        return self.width(self.reductions)

    @property
    def pivots(self) -> int:
        """Unless D is diagonal, a block for every other link: inverse of its D."""
        return self.link_numbers * self.block_dim

    @property
    def vectors(self) -> int:
        """Right-hand sides, then solutions, by link."""
        return self.pivots + (0 if self.has_diagonals else self.block * self.width(1))

    @property
    def hands(self) -> int:
        """Two vectors a row of the last level, which are written in turn."""
        return self.vectors + self.order * self.block_dim

    def forward(self, level: int) -> int:
        """Two blocks a row of a level from 2 on: what it takes of the two rows that were eliminated beside it."""
        handed = max(self.order * (self.block_dim + 2 * self.last_width), 3 * self.block * self.last_width)
        return self.vectors + handed + 2 * self.block * sum(map(self.width, range(2, level)))

    def backward(self, level: int) -> int:
        """Three blocks a row eliminated on a level from 1 on: inverse pivot, that times its two couplings."""
        return self.forward(self.reductions + 1) + 3 * self.block * sum(map(self.width, range(2, level + 1)))

    @property
    def rounds(self) -> int:
        """Two blocks a row and round: what it takes of the rows coupled to it."""
        return self.backward(self.reductions)

    @property
    def inverse(self) -> int:
        """Two blocks a row of the last level: inverse pivot, that times the coupling to the border."""
        return self.rounds + 2 * self.block * self.last_width * max(self.last_width - 2, 0).bit_length()

    @property
    def border(self) -> int:
        """Three blocks: inverse pivot of the border, that times its two couplings."""
        return self.inverse + 2 * self.block * self.last_width

    @property
    def size(self) -> int:
        """Doubles in all."""
        return max(self.border + 3 * self.block, self.rounds + 3 * self.block * self.width(1))


def reductions_for(block_dim: int) -> int:
    """Least number of reductions, at least LEAST_REDUCTIONS, that leaves no more rows than LAST_ROWS."""
    return max(LEAST_REDUCTIONS, (-(-block_dim // LAST_ROWS) - 1).bit_length())


@functools.cache
def block_access(order: int):
    """Warp functions on memory at an address: (load, store, load and store a vector) of blocks of this order.

    Entries of a block or vector lie ``width`` apart.
    """
    Block = block_type(order)
    Vector = wp.types.vector(length=order, dtype=wp.float64)

    @wp.func
    def load(S: wp.uint64, start: int, width: int, column: int):
        block = Block()
        for i in range(wp.static(order)):
            for j in range(wp.static(order)):
                block[i, j] = read(S, start + wp.static(order * i + j) * width + column)
        return block

    @wp.func
    def store(S: wp.uint64, start: int, width: int, column: int, block: Block):
        for i in range(wp.static(order)):
            for j in range(wp.static(order)):
                write(S, start + wp.static(order * i + j) * width + column, block[i, j])

    @wp.func
    def load_vector(S: wp.uint64, start: int, width: int, column: int):
        vector = Vector()
        for i in range(wp.static(order)):
            vector[i] = read(S, start + wp.static(i) * width + column)
        return vector

    @wp.func
    def store_vector(S: wp.uint64, start: int, width: int, column: int, vector: Vector):
        for i in range(wp.static(order)):
            write(S, start + wp.static(i) * width + column, vector[i])

    return load, store, load_vector, store_vector
