"""Linear systems of a loop: cyclic block-tridiagonal matrices with small dense blocks, one CPU thread per loop.

Row i of the system is L_i x_{i−1} + D_i x_i + U_i x_{i+1} = r_i, indices modulo the number of rows n. Elimination
along the loop is one long chain of dependent operations, so the loop is cut into eight segments that are eliminated
side by side, one in each lane of a vector (H. H. Wang, ACM TOMS 7 (1981) 170). The last row of each segment is a
*separator*; once a segment's other rows are gone, the eight separators form a small cyclic system, which three rounds
of parallel cyclic reduction (R. W. Hockney, J. ACM 12 (1965) 95) solve, again in all lanes at once: after them each
equation holds one unknown.

Pivots are sought in no block but inverted whole by cofactors: the matrices that come here are a symmetric positive
definite one and a little more, for which block elimination is stable. Measured on matrices of
chains: errors as those of LAPACK up to a condition of 1e3 (scaled to a unit diagonal), ten times theirs at 1e5.
Inverting by elimination instead of cofactors halves that and costs 10 %.
"""

import functools
from dataclasses import dataclass

import warp as wp

from .elementary import ONE, ZERO, quotient

wp.set_module_options({"enable_backward": False})

LANES = 8
"""Segments of a loop: doubles in the widest vectors of a CPU."""
ROUNDS = 3
"""Rounds of cyclic reduction, after which each separator's equation holds that separator alone: log₂ of the lanes."""

GAP = 32
"""Rows of 16 columns between a round and the next: clang fears that a shifted load waits for a store less than 4 KiB
behind it, and makes shorter vectors."""


@dataclass(frozen=True)
class SegmentLayout:
    """Where the rows of a loop's system lie in a block of memory.

    Row i of the loop is place p of segment s, column ``LANES * (p + 1) + s``; one place before the first and one
    behind the last are for the neighbours. A loop of n rows has P = ⌈n / 8⌉ places a segment. If n is no multiple of
    eight, the last segments are *short*: their place 0 repeats the separator of the segment before, and their own rows
    begin at place 1. A B × B block of the matrix takes B² memory rows, one after the other.

    Attributes:
        size: Order B of the blocks.
        columns: Static width of a memory row, see :func:`segment_columns`.
        matrix: First memory row of the matrix: blocks L, D, U, then three that elimination adds.
        right: First of 3 B memory rows: the right-hand side, which the solution replaces, and what solving needs.
    """

    size: int
    columns: int
    matrix: int
    right: int

    def block(self, index: int) -> int:
        """First memory row of a block of the matrix."""
        return self.matrix + self.size**2 * index

    @property
    def matrix_rows(self) -> int:
        """Memory rows of the matrix."""
        return 6 * self.size**2

    @property
    def right_rows(self) -> int:
        """Memory rows of the right-hand side."""
        return 3 * self.size

    @property
    def separator_rows(self) -> int:
        """Rows of 16 columns for the system of the separators."""
        return self.round_rows * (ROUNDS + 1) + self.size**2 * (2 * ROUNDS + 1) + 3 * self.size

    @property
    def round_rows(self) -> int:
        """Such rows from one round of cyclic reduction to the next."""
        return 4 * self.size**2 + self.size + GAP


def segment_columns(links: int) -> int:
    """Static width of a memory row for loops of up to this many rows: an odd multiple of 8, for the cache's sake."""
    places = -(-links // LANES) + 2
    return LANES * max(places + 1 - places % 2, 5)


@wp.func
def segment_places(link_count: int):
    """(places P of a segment, number of segments that are not short, rows that are solved for).

    Fewer than eight rows would leave segments empty; they are gone through twice, which has the same solution twice.
    """
    total = wp.where(link_count < 8, 2 * link_count, link_count)
    places = (total + 7) // 8
    return places, 8 - (8 * places - total), total


@wp.func
def row_at(place: int, segment: int, places: int, full: int):
    """Row of the loop at this place, ``full`` being the number of segments that are not short."""
    return segment * places + place - wp.max(segment + 1 - full, 0)


@wp.func
def place_column(place_after: int):
    """First column of the place before this one, counted from 1; bounds tell the compiler that no sum overflows."""
    return wp.clamp(8 * place_after, 0, 16777216)


@functools.cache
def block_type(size: int):
    """Warp's type of a B × B block, B = 2 or 3."""
    if size not in (2, 3):
        raise ValueError(f"blocks are 2 × 2 or 3 × 3, not {size} × {size}")
    return wp.types.matrix(shape=(size, size), dtype=wp.float64)


@functools.cache
def block_algebra(size: int):
    """Warp functions on B × B blocks, B = 2 or 3: (load, store, load and store a vector, multiple of one, invert)."""
    Block = block_type(size)
    Vector = wp.types.vector(length=size, dtype=wp.float64)

    @wp.func
    def load(S: wp.array2d(dtype=wp.float64), row: int, column: int):
        block = Block()
        for i in range(wp.static(size)):
            for j in range(wp.static(size)):
                block[i, j] = S[row + wp.static(size * i + j), column]
        return block

    @wp.func
    def store(S: wp.array2d(dtype=wp.float64), row: int, column: int, block: Block):
        for i in range(wp.static(size)):
            for j in range(wp.static(size)):
                S[row + wp.static(size * i + j), column] = block[i, j]

    @wp.func
    def load_vector(S: wp.array2d(dtype=wp.float64), row: int, column: int):
        vector = Vector()
        for i in range(wp.static(size)):
            vector[i] = S[row + i, column]
        return vector

    @wp.func
    def store_vector(S: wp.array2d(dtype=wp.float64), row: int, column: int, vector: Vector):
        for i in range(wp.static(size)):
            S[row + i, column] = vector[i]

    @wp.func
    def scalar_block(value: wp.float64):
        block = Block()
        for i in range(wp.static(size)):
            for j in range(wp.static(size)):
                block[i, j] = ZERO
            block[i, i] = value
        return block

    if size == 2:

        @wp.func
        def inverse(m: Block):
            scale = quotient(ONE, m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
            return Block(m[1, 1] * scale, -m[0, 1] * scale, -m[1, 0] * scale, m[0, 0] * scale)

    else:

        @wp.func
        def inverse(m: Block):
            a = m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1]
            b = m[1, 2] * m[2, 0] - m[1, 0] * m[2, 2]
            c = m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0]
            scale = quotient(ONE, m[0, 0] * a + m[0, 1] * b + m[0, 2] * c)
            return Block(
                a * scale,
                (m[0, 2] * m[2, 1] - m[0, 1] * m[2, 2]) * scale,
                (m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]) * scale,
                b * scale,
                (m[0, 0] * m[2, 2] - m[0, 2] * m[2, 0]) * scale,
                (m[0, 2] * m[1, 0] - m[0, 0] * m[1, 2]) * scale,
                c * scale,
                (m[0, 1] * m[2, 0] - m[0, 0] * m[2, 1]) * scale,
                (m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]) * scale,
            )

    return load, store, load_vector, store_vector, scalar_block, inverse


@functools.cache
def cyclic_solver(layout: SegmentLayout):
    """Warp functions (factor, solve) for systems that lie as this layout says.

    Returns:
        ``factor(S, R, places, full, lanes)`` and ``solve(S, R, places, lanes)``. S is the block of memory, R one of
        ``separator_rows`` × 16; ``lanes`` is 8, but unknown to the compiler, which would otherwise unroll loops over
        lanes instead of making vectors of them. The matrix at a repeated separator must be L = −1, D = 1, U = 0, the
        right-hand side 0. After solving, the place before the first holds the separators before the segments.
    """
    size = layout.size
    Block = block_type(size)
    square = size * size
    load, store, load_vector, store_vector, scalar_block, inverse = block_algebra(size)
    lower, diagonal, upper, fill, head, first_sum = (layout.block(k) for k in range(6))
    right, partial, before_segment = (layout.right + size * k for k in range(3))
    # rows of R: a round after the other, what rows take from one another, and what leads there and back
    per_round = layout.round_rows
    below, centre, above, pivots, values = (
        tuple(per_round * r + square * k for r in range(ROUNDS + 1)) for k in range(5)
    )
    taken = per_round * (ROUNDS + 1)
    take_before, take_after = (tuple(taken + square * (2 * r + k) for r in range(ROUNDS)) for k in range(2))
    coupling = taken + square * 2 * ROUNDS
    first_parts = coupling + square
    own_parts = first_parts + size
    separators = own_parts + size

    @wp.func
    def copy_twice(
        S: wp.array2d(dtype=wp.float64), row: int, column: int, R: wp.array2d(dtype=wp.float64), to: int, lanes: int
    ):
        s = int(0)
        while s < lanes:
            R[to, s] = S[row, column + s]
            s += 1
        s = int(0)
        while s < lanes:
            R[to, s + 8] = R[to, s]
            s += 1

    @wp.func
    def store_twice(R: wp.array2d(dtype=wp.float64), row: int, s: int, block: Block):
        store(R, row, s, block)
        store(R, row, s + 8, block)

    @wp.func
    def eliminate_segments(S: wp.array2d(dtype=wp.float64), places: int, full: int, lanes: int):
        """Row p becomes x_p = D r'_p − U x_{p+1} + fill e with r'_p = r_p − L r'_{p−1}, all four of them new.

        e is the separator before the segment. The first unknown that the segment owns is Σ head r' + first_sum e plus
        the segment's separator times the head that is left over, one place further.
        """
        s = int(0)
        while s < lanes:
            store(S, wp.static(diagonal), s, scalar_block(ZERO))
            store(S, wp.static(upper), s, scalar_block(ZERO))
            store(S, wp.static(fill), s, scalar_block(ONE))
            store(S, wp.static(head), 8 + s, scalar_block(wp.where(s < full, ONE, ZERO)))
            store(S, wp.static(first_sum), s, scalar_block(ZERO))
            s += 1
        p = int(1)
        while p < places:
            c = place_column(p)
            s = int(0)
            while s < lanes:
                here = c + s
                before = here - 8
                low = load(S, wp.static(lower), here)
                pivot = inverse(load(S, wp.static(diagonal), here) - low * load(S, wp.static(upper), before))
                up = pivot * load(S, wp.static(upper), here)
                across = -(pivot * (low * load(S, wp.static(fill), before)))
                first = load(S, wp.static(head), here)
                begins = wp.where(p == 1 and s >= full, ONE, ZERO)
                store(S, wp.static(head), here + 8, scalar_block(begins) - first * up)
                store(S, wp.static(first_sum), here, load(S, wp.static(first_sum), before) + first * across)
                store(S, wp.static(head), here, first * pivot)
                store(S, wp.static(lower), here, low * load(S, wp.static(diagonal), before))
                store(S, wp.static(diagonal), here, pivot)
                store(S, wp.static(upper), here, up)
                store(S, wp.static(fill), here, across)
                s += 1
            p += 1

    @wp.func
    def factor(S: wp.array2d(dtype=wp.float64), R: wp.array2d(dtype=wp.float64), places: int, full: int, lanes: int):
        eliminate_segments(S, places, full, lanes)
        # what the first unknown of the next segment depends on, beside its separator
        last = place_column(places)
        k = int(0)
        while k < wp.static(square):
            copy_twice(S, wp.static(head) + k, last, R, wp.static(above[0]) + k, lanes)
            copy_twice(S, wp.static(first_sum) + k, place_column(places - 1), R, wp.static(centre[0]) + k, lanes)
            s = int(0)
            while s < lanes:
                S[wp.static(head) + k, last + s] = R[wp.static(above[0]) + k, s + 1]
                S[wp.static(first_sum) + k, last + s] = R[wp.static(centre[0]) + k, s + 1]
                s += 1
            k += 1
        here = int(last)
        while here < last + lanes:
            before = here - 8
            low = load(S, wp.static(lower), here)
            up = load(S, wp.static(upper), here)
            middle = load(S, wp.static(diagonal), here) - low * load(S, wp.static(upper), before)
            store(S, wp.static(fill), here, low * load(S, wp.static(fill), before))
            store(S, wp.static(first_sum), here, middle + up * load(S, wp.static(first_sum), here))
            store(S, wp.static(head), here, up * load(S, wp.static(head), here))
            store(S, wp.static(lower), here, low * load(S, wp.static(diagonal), before))
            here += 1
        k = int(0)
        while k < wp.static(square):
            copy_twice(S, wp.static(fill) + k, last, R, wp.static(below[0]) + k, lanes)
            copy_twice(S, wp.static(first_sum) + k, last, R, wp.static(centre[0]) + k, lanes)
            copy_twice(S, wp.static(head) + k, last, R, wp.static(above[0]) + k, lanes)
            copy_twice(S, wp.static(upper) + k, last, R, wp.static(coupling) + k, lanes)
            k += 1
        for r in range(wp.static(ROUNDS)):
            s = int(0)
            while s < lanes:
                store_twice(R, wp.static(pivots[r]), s, inverse(load(R, wp.static(centre[r]), s)))
                s += 1
            s = int(0)
            while s < lanes:
                before = s + wp.static(8 - 2**r)
                after = s + wp.static(2**r)
                from_before = load(R, wp.static(below[r]), s) * load(R, wp.static(pivots[r]), before)
                from_after = load(R, wp.static(above[r]), s) * load(R, wp.static(pivots[r]), after)
                middle = load(R, wp.static(centre[r]), s) - from_before * load(R, wp.static(above[r]), before)
                store(R, wp.static(centre[r + 1]), s, middle - from_after * load(R, wp.static(below[r]), after))
                store_twice(R, wp.static(below[r + 1]), s, -(from_before * load(R, wp.static(below[r]), before)))
                store_twice(R, wp.static(above[r + 1]), s, -(from_after * load(R, wp.static(above[r]), after)))
                store(R, wp.static(take_before[r]), s, from_before)
                store(R, wp.static(take_after[r]), s, from_after)
                s += 1
        s = int(0)
        while s < lanes:
            middle = load(R, wp.static(centre[ROUNDS]), s) + load(R, wp.static(below[ROUNDS]), s)
            store(R, wp.static(pivots[ROUNDS]), s, inverse(middle + load(R, wp.static(above[ROUNDS]), s)))
            s += 1

    @wp.func
    def solve(S: wp.array2d(dtype=wp.float64), R: wp.array2d(dtype=wp.float64), places: int, lanes: int):
        last = place_column(places)
        s = int(0)
        while s < lanes:
            for k in range(wp.static(size)):
                S[wp.static(right + k), s] = ZERO
                S[wp.static(partial + k), s] = ZERO
            s += 1
        p = int(1)
        while p < places + 1:
            c = place_column(p)
            s = int(0)
            while s < lanes:
                here = c + s
                value = load_vector(S, wp.static(right), here)
                value -= load(S, wp.static(lower), here) * load_vector(S, wp.static(right), here - 8)
                first = load_vector(S, wp.static(partial), here - 8) + load(S, wp.static(head), here) * value
                store_vector(S, wp.static(right), here, value)
                store_vector(S, wp.static(partial), here, first)
                s += 1
            p += 1
        for k in range(wp.static(size)):
            copy_twice(S, wp.static(partial + k), place_column(places - 1), R, wp.static(first_parts + k), lanes)
            copy_twice(S, wp.static(right + k), last, R, wp.static(own_parts + k), lanes)
        s = int(0)
        while s < lanes:
            value = load_vector(R, wp.static(own_parts), s)
            value -= load(R, wp.static(coupling), s) * load_vector(R, wp.static(first_parts), s + 1)
            store_vector(R, wp.static(values[0]), s, value)
            store_vector(R, wp.static(values[0]), s + 8, value)
            s += 1
        for r in range(wp.static(ROUNDS)):
            s = int(0)
            while s < lanes:
                value = load_vector(R, wp.static(values[r]), s)
                value -= load(R, wp.static(take_before[r]), s) * load_vector(
                    R, wp.static(values[r]), s + wp.static(8 - 2**r)
                )
                value -= load(R, wp.static(take_after[r]), s) * load_vector(
                    R, wp.static(values[r]), s + wp.static(2**r)
                )
                store_vector(R, wp.static(values[r + 1]), s, value)
                store_vector(R, wp.static(values[r + 1]), s + 8, value)
                s += 1
        s = int(0)
        while s < lanes:
            value = load(R, wp.static(pivots[ROUNDS]), s) * load_vector(R, wp.static(values[ROUNDS]), s)
            store_vector(R, wp.static(separators), s, value)
            store_vector(R, wp.static(separators), s + 8, value)
            s += 1
        for k in range(wp.static(size)):
            s = int(0)
            while s < lanes:
                S[wp.static(right + k), last + s] = R[wp.static(separators + k), s]
                S[wp.static(before_segment + k), last + s] = R[wp.static(separators + k), s + 7]
                s += 1
        p = places - 1
        while p > 0:
            c = place_column(p)
            s = int(0)
            while s < lanes:
                here = c + s
                across = load_vector(S, wp.static(before_segment), here + 8)
                value = load(S, wp.static(diagonal), here) * load_vector(S, wp.static(right), here)
                value += load(S, wp.static(fill), here) * across
                value -= load(S, wp.static(upper), here) * load_vector(S, wp.static(right), here + 8)
                store_vector(S, wp.static(right), here, value)
                store_vector(S, wp.static(before_segment), here, across)
                s += 1
            p -= 1

    return factor, solve
