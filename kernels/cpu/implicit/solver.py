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


_INVERSES = {
    2: """
        const lanes scale = 1.0 / (m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0));
        to(0, 0) = m(1, 1) * scale;
        to(0, 1) = -m(0, 1) * scale;
        to(1, 0) = -m(1, 0) * scale;
        to(1, 1) = m(0, 0) * scale;
    """,
    3: """
        const lanes a = m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1);
        const lanes b = m(1, 2) * m(2, 0) - m(1, 0) * m(2, 2);
        const lanes c = m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0);
        const lanes scale = 1.0 / (m(0, 0) * a + m(0, 1) * b + m(0, 2) * c);
        to(0, 0) = a * scale;
        to(0, 1) = (m(0, 2) * m(2, 1) - m(0, 1) * m(2, 2)) * scale;
        to(0, 2) = (m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1)) * scale;
        to(1, 0) = b * scale;
        to(1, 1) = (m(0, 0) * m(2, 2) - m(0, 2) * m(2, 0)) * scale;
        to(1, 2) = (m(0, 2) * m(1, 0) - m(0, 0) * m(1, 2)) * scale;
        to(2, 0) = c * scale;
        to(2, 1) = (m(0, 1) * m(2, 0) - m(0, 0) * m(2, 1)) * scale;
        to(2, 2) = (m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0)) * scale;
    """,
}


def _vectors(layout: SegmentLayout) -> str:
    """C++ types and functions for all segments at once: a vector has a lane per segment."""
    size = layout.size
    return f"""
        typedef double lanes __attribute__((vector_size({8 * LANES}), aligned(8), may_alias));
        struct column {{
            enum {{ width = 1 }};
            lanes m[{size}];
        }};
        struct submatrix {{
            enum {{ width = {size} }};
            lanes m[{size * size}];
            lanes& operator()(int i, int j) {{ return m[{size} * i + j]; }}
            const lanes& operator()(int i, int j) const {{ return m[{size} * i + j]; }}
        }};
        lanes* const first = reinterpret_cast<lanes*>(S.data);
        const long next_row = S.shape[1] / {LANES};
        const auto at_place = [=](int row, int p) {{ return first + next_row * row + p; }};
        const auto at_separators = [=](int number) {{ return at_place({layout.separators}, number); }};
        const auto load = [](auto& to, const lanes* from, long stride) {{
            for (auto& number : to.m) {{
                number = *from;
                from += stride;
            }}
        }};
        const auto store = [](const auto& from, lanes* to, long stride) {{
            for (const auto& number : from.m) {{
                *to = number;
                to += stride;
            }}
        }};
        // to += sign a b; the sign is known when this is compiled
        const auto add = [](auto& to, const submatrix& a, const auto& b, double sign) {{
            const int width = b.width;
            for (int i = 0; i < {size}; i++)
                for (int j = 0; j < width; j++)
                    for (int k = 0; k < {size}; k++)
                        to.m[width * i + j] += sign * a(i, k) * b.m[width * k + j];
        }};
        // to += sign a b for the a that is stored from this number on
        const auto add_stored = [=](auto& to, const lanes* stored, long stride, const auto& b, double sign) {{
            submatrix a;
            load(a, stored, stride);
            add(to, a, b, sign);
        }};
        const auto invert = [](const submatrix& m) {{
            submatrix to;
            {_INVERSES[size]}
            return to;
        }};
        const auto multiple_of_one = [](lanes value) {{
            submatrix to = {{}};
            for (int i = 0; i < {size}; i++) to(i, i) = value;
            return to;
        }};
        // lane s is lane s + by of the other one; that, too, is known when this is compiled
        const auto turned = [](const auto& from, int by) {{
            auto to = from;
            for (int k = 0; k < {size} * from.width; k++)
                for (int s = 0; s < {LANES}; s++) to.m[k][s] = from.m[k][(s + by) % {LANES}];
            return to;
        }};
        // places that repeat a separator
        lanes begins = {{}};
        for (int s = full; s < {LANES}; s++) begins[s] = 1.0;
        const auto where_repeated = [=](lanes value, lanes other) {{ return begins != 0.0 ? value : other; }};
        """


@functools.cache
def cyclic_solver(layout: SegmentLayout):
    """Warp functions (factor, solve) for systems that lie as this layout says.

    They are native code on vectors of all segments, which keeps the results of the previous place in registers. Warp
    loops over lanes passed them through memory, and the processor waited for its stores. Whatever S holds at a repeated
    separator, its matrix is taken to be L = −1, D = 1, U = 0, its right-hand side 0.
    """
    size = layout.size
    square = size * size
    lower, diagonal, upper, fill, head = (layout.submatrix(k) for k in range(5))
    # submatrices of the separators: coupling of sums to them, the last pivots, what each round subtracts of other rows
    coupling, last_pivot, rounds = 0, square, 2 * square
    vectors = _vectors(layout)

    # Row p becomes x_p = y_p − U x_{p+1} + fill e, y_p = D (r_p − L y_{p−1}), with new D, U and fill; e is the
    # separator before the segment. The first unknown that the segment owns is Σ head y + sum e plus the segment's
    # separator times the head that is left over.
    @wp.func_native(f"""
        {vectors}
        for (int k = 0; k < {square}; k++) {{
            const double one = k % {size + 1} == 0;
            lanes &low = *at_place({lower} + k, 1), &centre = *at_place({diagonal} + k, 1);
            lanes& up = *at_place({upper} + k, 1);
            low = where_repeated(lanes{{}} - one, low);
            centre = where_repeated(lanes{{}} + one, centre);
            up = where_repeated(lanes{{}}, up);
        }}
        submatrix ahead = {{}}, sum = {{}}, across = multiple_of_one(lanes{{}} + 1.0);
        submatrix head = multiple_of_one(lanes{{}} + 1.0 - begins), low, up;
        for (int p = 1; p < places; p++) {{
            submatrix pivot, product = {{}};
            load(low, at_place({lower}, p), next_row);
            load(up, at_place({upper}, p), next_row);
            load(pivot, at_place({diagonal}, p), next_row);
            add(pivot, low, ahead, -1.0);
            pivot = invert(pivot);
            add(product, low, across, 1.0);
            ahead = submatrix{{}};
            across = submatrix{{}};
            add(ahead, pivot, up, 1.0);
            add(across, pivot, product, -1.0);
            add(sum, head, across, 1.0);
            store(pivot, at_place({diagonal}, p), next_row);
            store(ahead, at_place({upper}, p), next_row);
            store(across, at_place({fill}, p), next_row);
            store(head, at_place({head}, p), next_row);
            submatrix left_over = multiple_of_one(p == 1 ? begins : lanes{{}});
            add(left_over, head, ahead, -1.0);
            head = left_over;
        }}
        submatrix below = {{}}, centre, above = {{}};
        load(low, at_place({lower}, places), next_row);
        load(up, at_place({upper}, places), next_row);
        load(centre, at_place({diagonal}, places), next_row);
        add(below, low, across, 1.0);
        add(centre, low, ahead, -1.0);
        add(centre, up, turned(sum, 1), 1.0);
        add(above, up, turned(head, 1), 1.0);
        store(up, at_separators({coupling}), 1);
        #pragma unroll
        for (int r = 0; r < {ROUNDS}; r++) {{
            const int after = 1 << r, before = {LANES} - after;
            const submatrix pivot = invert(centre);
            submatrix from_before = {{}}, from_after = {{}}, next_below = {{}}, next_above = {{}};
            add(from_before, below, turned(pivot, before), 1.0);
            add(from_after, above, turned(pivot, after), 1.0);
            store(from_before, at_separators({rounds} + {2 * square} * r), 1);
            store(from_after, at_separators({rounds + square} + {2 * square} * r), 1);
            add(centre, from_before, turned(above, before), -1.0);
            add(centre, from_after, turned(below, after), -1.0);
            add(next_below, from_before, turned(below, before), -1.0);
            add(next_above, from_after, turned(above, after), -1.0);
            below = next_below;
            above = next_above;
        }}
        for (int k = 0; k < {square}; k++) centre.m[k] += below.m[k] + above.m[k];
        store(invert(centre), at_separators({last_pivot}), 1);
    """)
    def factor(S: Rows, places: int, full: int): ...

    @wp.func_native(f"""
        {vectors}
        column value = {{}}, own = {{}}, next;
        for (int p = 1; p < places; p++) {{
            load(next, at_place({layout.right}, p), next_row);
            if (p == 1)
                for (auto& number : next.m) number = where_repeated(lanes{{}}, number);
            add_stored(next, at_place({lower}, p), next_row, value, -1.0);
            value = column{{}};
            add_stored(value, at_place({diagonal}, p), next_row, next, 1.0);
            add_stored(own, at_place({head}, p), next_row, value, 1.0);
            store(value, at_place({layout.right}, p), next_row);
        }}
        load(next, at_place({layout.right}, places), next_row);
        add_stored(next, at_place({lower}, places), next_row, value, -1.0);
        value = next;
        add_stored(value, at_separators({coupling}), 1, turned(own, 1), -1.0);
        #pragma unroll
        for (int r = 0; r < {ROUNDS}; r++) {{
            const column from_before = turned(value, {LANES} - (1 << r)), from_after = turned(value, 1 << r);
            add_stored(value, at_separators({rounds} + {2 * square} * r), 1, from_before, -1.0);
            add_stored(value, at_separators({rounds + square} + {2 * square} * r), 1, from_after, -1.0);
        }}
        next = column{{}};
        add_stored(next, at_separators({last_pivot}), 1, value, 1.0);
        store(next, at_place({layout.right}, places), next_row);
        const column before = turned(next, {LANES - 1});
        for (int p = places - 1; p > 0; p--) {{
            load(value, at_place({layout.right}, p), next_row);
            add_stored(value, at_place({fill}, p), next_row, before, 1.0);
            add_stored(value, at_place({upper}, p), next_row, next, -1.0);
            store(value, at_place({layout.right}, p), next_row);
            next = value;
        }}
    """)
    def solve(S: Rows, places: int, full: int): ...

    return factor, solve
