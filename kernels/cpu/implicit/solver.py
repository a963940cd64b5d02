"""Linear systems of a loop: cyclic block-tridiagonal matrices with small dense submatrices, one CPU thread per loop.

Row i of the system is L_i x_{i−1} + D_i x_i + U_i x_{i+1} = r_i, indices modulo the number of rows n. Elimination along
the loop is one long sequence of dependent operations. So the loop is cut into eight segments that are eliminated side
by side, one in each lane of a vector (H. H. Wang, ACM TOMS 7 (1981) 170). The last row of each segment is a
*separator*. Once the other rows are eliminated, the eight separators form a small cyclic system. Three rounds of
parallel cyclic reduction (R. W. Hockney, J. ACM 12 (1965) 95), again in all lanes, leave one unknown in each equation.

Submatrices are inverted by cofactors, without pivoting: the matrices are close to symmetric positive definite ones, for
which this elimination is stable. On matrices of chains errors are as large as LAPACK's up to a condition number of 1e3
(scaled to a unit diagonal), and ten times as large at 1e5. Inverting by elimination halves them and costs 10 %.
"""

import functools
from dataclasses import dataclass
from pathlib import Path

import warp as wp

from warpchain.kernels.layout import LANES, padded_width
from warpchain.kernels.types import Chain, Rows

ROUNDS = 3
"""Rounds of cyclic reduction until each equation has one unknown: log₂ of the lanes."""


def segment_columns(links: int) -> int:
    """Static width of a memory row for this many links; odd multiples of 8 spread rows over the cache's sets."""
    places = -(-links // LANES) + 2
    return LANES * (places + 1 - places % 2)


@dataclass(frozen=True)
class SegmentLayout:
    """Where a loop's system lies in memory, from one row on; its lanes are the segments of the loop.

    Row i of the loop is place p of segment s, column ``LANES * (p + 1) + s``; one place before the first and one
    after the last hold copies of neighbours. A loop of n rows has P = ⌈n / 8⌉ places a segment. If n is no multiple of
    eight, the last segments are *short*: their place 0 repeats the separator of the segment before, and their own rows
    begin at place 1. A B × B submatrix takes B² memory rows, one after the other.
    """

    size: int  # order B of the submatrices
    matrix: int  # first memory row of the matrix: submatrices L, D, U, then two that elimination adds

    def submatrix(self, index: int) -> int:
        """First memory row of one of the five submatrices, see ``matrix``."""
        return self.matrix + self.size**2 * index

    @property
    def right(self) -> int:
        """First of B memory rows of the right-hand side, which the solution replaces."""
        return self.submatrix(5)

    @property
    def separators(self) -> int:
        """First of the memory rows in which the system of the separators lies, eight numbers after eight others."""
        return self.right + self.size

    @property
    def end(self) -> int:
        """The row behind the last."""
        doubles = LANES * (2 * ROUNDS + 2) * self.size**2
        return self.separators + -(-doubles // segment_columns(padded_width(1)))


@wp.func
def segment_places(link_count: int):
    """(places P of a segment, number of segments that are not short).

    Fewer than eight rows would leave segments empty; such loops are solved for twice their rows, which repeats them.
    """
    total = wp.where(link_count < 8, 2 * link_count, link_count)
    places = (total + 7) // 8
    return places, 8 - (8 * places - total)


@wp.func
def end_column(chain: Chain):
    """The column behind the last place; the bounds tell the compiler that no sum overflows."""
    places, _full = segment_places(chain.link_count)
    return wp.clamp(8 * (places + 1), 0, 16777216)


@wp.func
def link_at(column: int, link_count: int):
    """Link that lies in this column, and whether another column has it, too, and counts."""
    places, full = segment_places(link_count)
    segment = column & 7
    row = segment * places + (column >> 3) - 1 - wp.max(segment + 1 - full, 0)
    is_copy = (column < 16 and segment >= full) or row >= link_count
    return wp.where(row >= link_count, row - link_count, row), is_copy


def _source(layout: SegmentLayout, name: str) -> str:
    """C++ of a native function: its constants, the vectors that all of them use, and the body in a file beside this."""
    square = layout.size**2
    constants = {
        "SIZE": layout.size,
        "SQUARE": square,
        "LANES": LANES,
        "ROUNDS": ROUNDS,
        # first memory rows: submatrices L, D, U, and two that elimination adds; right-hand side; separators
        **{word: layout.submatrix(k) for k, word in enumerate(("LOWER", "DIAGONAL", "UPPER", "FILL", "HEAD"))},
        "RIGHT": layout.right,
        "SEPARATORS": layout.separators,
        # submatrices of the separators: coupling of sums to them, the last pivots, what each round subtracts of others
        "COUPLING": 0,
        "LAST_PIVOT": square,
        "ROUND_PARTS": 2 * square,
    }
    given = ", ".join(f"{word} = {value}" for word, value in constants.items())
    parts = (Path(__file__).with_name(file).read_text(encoding="utf-8") for file in ("segment_vectors.cpp", name))
    return f"\nconstexpr int {given};\n{''.join(parts)}"


@functools.cache
def cyclic_solver(layout: SegmentLayout):
    """Warp functions (factor, solve) for systems that lie as this layout says.

    They are native code on vectors of all segments, which keeps the results of the previous place in registers. Warp
    loops over lanes passed them through memory, and the processor waited for its stores. Whatever S holds at a repeated
    separator, its matrix is taken to be L = −1, D = 1, U = 0, its right-hand side 0.
    """

    @wp.func_native(_source(layout, "cyclic_factor.cpp"))
    def factor(S: Rows, places: int, full: int): ...

    @wp.func_native(_source(layout, "cyclic_solve.cpp"))
    def solve(S: Rows, places: int, full: int): ...

    return factor, solve
