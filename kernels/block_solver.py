"""Linear systems of a loop in the block form: one thread per row, cyclic and parallel cyclic reduction.

Row i of the system is L_i x_{i−1} + D_i x_i + U_i x_{i+1} = r_i with B × B blocks and indices modulo the number of
links. Each *reduction* eliminates every other row (cyclic reduction: R. W. Hockney, J. ACM 12 (1965) 95) until what is
left fits into one hardware warp. There parallel cyclic reduction (R. W. Hockney, C. R. Jesshope, Parallel Computers,
1981) doubles the distance between coupled rows until none is left, with no barrier of the block. The loop is cut at
its last link, the *border*, which is never eliminated; a row that has lost its neighbour on one side is coupled to the
border in that neighbour's place. So no more numbers have to be carried than for a chain with free ends.

Factors stay in the memory that the block shares, S below being its address. Then a solution costs an exchange of B
numbers and two products of a block with a vector a level. Blocks are inverted whole by cofactors, which is as good as
any elimination while they are well conditioned. They are not when a step is long for the springs, because links then
seem rigid: of the solution 1e-13 is lost at h = 1e-4 s and k = 1e9 N/m, 1e-9 at 1e-3 s.

Rows are numbered anew on each level: row q of level l is link (q + 1)·2^l − 1, the border last.
"""

import functools
from dataclasses import dataclass

import warp as wp

from .block_memory import barrier, read, write
from .cyclic_solver import block_inverse, block_type
from .elementary import ONE, quotient

wp.set_module_options({"enable_backward": False})

vec3d = wp.types.vector(length=3, dtype=wp.float64)
mat33d = block_type(3)

LAST_ROWS = 24
"""Rows of the last level: no more than a hardware warp has threads; fewer take less memory."""
LEAST_REDUCTIONS = 2
"""With one, residuals are up to 1e5 times as large: parallel cyclic reduction suffers where links seem rigid."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    __syncwarp();
#else
    WP_TILE_SYNC();
#endif
""")
def warp_barrier():
    """Wait until all threads of a hardware warp are here; on fibers all of the block."""
    ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return lane < 32;
#else
    return true;
#endif
""")
def is_in_first_warp(lane: int) -> bool:
    """Whether a thread belongs to the hardware warp that carries the last level; fibers all wait with it."""
    ...


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


@wp.func
def columns_scaled(m: mat33d, scale: vec3d):
    """m diag(scale)."""
    block = mat33d()
    for i in range(3):
        for j in range(3):
            block[i, j] = m[i, j] * scale[j]
    return block


@functools.cache
def block_solver(memory: FactorLayout, couplings_of, diagonal_of=None):
    """Warp functions (factor, solve) for one loop a block. n is even.

    Args:
        memory: Where the factors lie.
        couplings_of: Warp function ``(S, n, link, constant)`` → (L, U) of a link from the numbers that all links have
            left in memory and one for all.
        diagonal_of: Warp function with the same arguments → D, unless D is diagonal.

    Returns:
        For diagonal D ``factor(S, n, lane, own, constant)`` → inverse of the thread's own D, given as a vector, and
        ``solve(S, n, lane, constant, pivot, right)`` → solution of the thread's row, given that inverse and its
        right-hand side. Otherwise ``factor(S, n, lane, constant)``, after a barrier behind the numbers of links, and
        ``solve(S, n, lane, constant, right)``. They leave no barrier behind them.
    """
    order, entries = memory.order, memory.block
    Block, Vector = block_type(order), wp.types.vector(length=order, dtype=wp.float64)
    threads = memory.block_dim
    reductions = memory.reductions
    first_width, last_width = memory.width(1), memory.last_width
    pivots, vectors, hands, rounds = memory.pivots, memory.vectors, memory.hands, memory.rounds
    inverse, border = memory.inverse, memory.border
    forward = [memory.forward(level) for level in range(reductions + 1)]
    backward = [memory.backward(level) for level in range(reductions + 1)]
    widths = [memory.width(level) for level in range(reductions + 1)]
    load_block, store_block, load_vector, store_vector = block_access(order)
    inverse_block = block_inverse(order)

    @wp.func
    def rows_at(n: int, level: int):
        return (n + (1 << level) - 1) >> level

    @wp.func
    def publish_row(S: wp.uint64, start: int, width: int, row: int, middle: Block, lower: Block, upper: Block):
        store_block(S, start, width, row, middle)
        store_block(S, start + wp.static(entries) * width, width, row, lower)
        store_block(S, start + wp.static(2 * entries) * width, width, row, upper)

    @wp.func
    def couple(S: wp.uint64, block: Block, start: int, width: int, other: int, is_there: bool):
        """What a row with this coupling takes of another one, and that times the other's two couplings.

        Rows are published from ``start`` on, ``width`` side by side; an eliminated one has its inverse pivot there.
        """
        take = Block()
        if is_there:
            take = block * load_block(S, start, width, other)
        lower = load_block(S, start + wp.static(entries) * width, width, other)
        upper = load_block(S, start + wp.static(2 * entries) * width, width, other)
        return take, take * lower, take * upper

    @wp.func
    def neighbours(rows: int, row: int):
        """Row of the level below, the rows eliminated beside it, and whether there are such.

        Args:
            rows: Of the level below, the border included.
            row: Of the level above.
        """
        is_border = row == (rows + 1) // 2 - 1
        here = wp.where(is_border, rows - 1, 2 * row + 1)
        low = here - 1
        up = wp.where(is_border, 0, here + 1)
        has_low = rows > 1 and (not is_border or rows % 2 == 0)
        has_up = rows > 1 and (is_border or up < rows - 1)
        return here, wp.where(has_low, low, here), wp.where(has_up, up, here), has_low, has_up

    @wp.func
    def factor_last_level(S: wp.uint64, n: int, lane: int, own: Block, below: Block, above: Block):
        """Parallel cyclic reduction in one warp, then the border."""
        middle = own
        lower = below
        upper = above
        last = rows_at(n, wp.static(reductions)) - 1
        stride = int(1)
        start = int(wp.static(rounds))
        warp_barrier()
        while stride < last:
            if lane < last:
                publish_row(S, wp.static(vectors), wp.static(last_width), lane, inverse_block(middle), lower, upper)
            warp_barrier()
            if lane < last:
                has_low = lane >= stride
                has_up = lane + stride < last
                low = wp.where(has_low, lane - stride, lane)
                up = wp.where(has_up, lane + stride, lane)
                take_low, low_lower, low_upper = couple(
                    S, lower, wp.static(vectors), wp.static(last_width), low, has_low
                )
                take_up, up_lower, up_upper = couple(S, upper, wp.static(vectors), wp.static(last_width), up, has_up)
                store_block(S, start, wp.static(last_width), lane, take_low)
                store_block(S, start + wp.static(entries * last_width), wp.static(last_width), lane, take_up)
                middle = middle - low_upper - up_lower
                if has_low:
                    lower = -low_lower
                if has_up:
                    upper = -up_upper
            warp_barrier()
            start += wp.static(2 * entries * last_width)
            stride = 2 * stride
        if lane < last:
            middle = inverse_block(middle)
            store_block(S, wp.static(inverse), wp.static(last_width), lane, middle)
            store_block(
                S, wp.static(inverse + entries * last_width), wp.static(last_width), lane, middle * (lower + upper)
            )
        warp_barrier()
        if lane == last:
            if last > 0:
                first = load_block(S, wp.static(inverse + entries * last_width), wp.static(last_width), 0)
                middle = middle - upper * first
                middle = middle - lower * load_block(
                    S, wp.static(inverse + entries * last_width), wp.static(last_width), last - 1
                )
            else:
                middle = middle + lower + upper
                lower = Block()
                upper = Block()
            middle = inverse_block(middle)
            store_block(S, wp.static(border), 1, 0, middle)
            store_block(S, wp.static(border + entries), 1, 0, middle * lower)
            store_block(S, wp.static(border + 2 * entries), 1, 0, middle * upper)

    @wp.func
    def factor_levels(S: wp.uint64, n: int, lane: int, own: Block, below: Block, above: Block):
        """From level 1 on."""
        middle = own
        lower = below
        upper = above
        for level in range(1, wp.static(reductions)):
            rows = rows_at(n, level)
            if lane < rows:
                if lane % 2 == 0 and lane < rows - 1:
                    middle = inverse_block(middle)
                    start = wp.static(backward[level])
                    width = wp.static(widths[level + 1])
                    publish_row(S, start, width, lane // 2, middle, middle * lower, middle * upper)
                publish_row(S, wp.static(rounds), wp.static(first_width), lane, middle, lower, upper)
            barrier()
            if lane < rows_at(n, level + 1):
                here, low, up, has_low, has_up = neighbours(rows, lane)
                middle = load_block(S, wp.static(rounds), wp.static(first_width), here)
                lower = load_block(S, wp.static(rounds + entries * first_width), wp.static(first_width), here)
                upper = load_block(S, wp.static(rounds + 2 * entries * first_width), wp.static(first_width), here)
                take_low, low_lower, low_upper = couple(
                    S, lower, wp.static(rounds), wp.static(first_width), low, has_low
                )
                take_up, up_lower, up_upper = couple(S, upper, wp.static(rounds), wp.static(first_width), up, has_up)
                start = wp.static(forward[level + 1])
                width = wp.static(widths[level + 1])
                store_block(S, start, width, lane, take_low)
                store_block(S, start + wp.static(entries) * width, width, lane, take_up)
                middle = middle - low_upper - up_lower
                if has_low:
                    lower = -low_lower
                if has_up:
                    upper = -up_upper
            barrier()
        if is_in_first_warp(lane):
            factor_last_level(S, n, lane, middle, lower, upper)

    @wp.func
    def at_link(S: wp.uint64, link: int):
        return load_vector(S, wp.static(vectors), wp.static(threads), link)

    @wp.func
    def to_link(S: wp.uint64, link: int, value: Vector):
        store_vector(S, wp.static(vectors), wp.static(threads), link, value)

    @wp.func
    def solve_last_level(S: wp.uint64, n: int, lane: int, given: Vector):
        """Parallel cyclic reduction in one warp; leaves the solutions of the last level's rows with their links."""
        value = given
        last = rows_at(n, wp.static(reductions)) - 1
        row = wp.min(lane, wp.static(last_width - 1))
        stride = int(1)
        start = int(wp.static(rounds))
        hand = int(wp.static(hands))
        while stride < last:
            if lane < last:
                store_vector(S, hand, wp.static(last_width), lane, value)
            take_low = load_block(S, start, wp.static(last_width), row)
            take_up = load_block(S, start + wp.static(entries * last_width), wp.static(last_width), row)
            warp_barrier()
            # where there is no such row, nothing is taken of another one
            low = wp.clamp(row - stride, 0, last - 1)
            up = wp.min(row + stride, last - 1)
            value = value - take_low * load_vector(S, hand, wp.static(last_width), low)
            value = value - take_up * load_vector(S, hand, wp.static(last_width), up)
            start += wp.static(2 * entries * last_width)
            hand = wp.static(2 * hands + order * last_width) - hand
            stride = 2 * stride
        if lane < last:
            value = load_block(S, wp.static(inverse), wp.static(last_width), row) * value
            store_vector(S, hand, wp.static(last_width), lane, value)
        if lane == last:
            store_vector(S, hand, wp.static(last_width), lane, given)
        warp_barrier()
        cut = load_block(S, wp.static(border), 1, 0) * load_vector(S, hand, wp.static(last_width), last)
        before = wp.max(last - 1, 0)
        cut = cut - load_block(S, wp.static(border + entries), 1, 0) * load_vector(
            S, hand, wp.static(last_width), before
        )
        cut = cut - load_block(S, wp.static(border + 2 * entries), 1, 0) * load_vector(
            S, hand, wp.static(last_width), 0
        )
        if lane < last:
            value = value - load_block(S, wp.static(inverse + entries * last_width), wp.static(last_width), row) * cut
            to_link(S, ((lane + 1) << wp.static(reductions)) - 1, value)
        if lane == last:
            to_link(S, n - 1, cut)

    @wp.func
    def solve_levels(S: wp.uint64, n: int, lane: int, constant: wp.float64, own: Vector):
        """Leaves the solutions of odd links with them, given for even ones pivot times right-hand side; no barrier."""
        if lane < n:
            to_link(S, lane, own)
        value = Vector()
        lower, upper = couplings_of(S, n, wp.min(2 * lane + 1, n - 1), constant)
        barrier()
        if lane < n // 2:
            link = 2 * lane + 1
            up = wp.where(link == n - 1, 0, link + 1)
            value = at_link(S, link) - lower * at_link(S, link - 1) - upper * at_link(S, up)
            to_link(S, link, value)
        for level in range(2, wp.static(reductions + 1)):
            # factors are fetched while others are still to come
            width = wp.static(widths[level])
            row = wp.min(lane, width - 1)
            take_low = load_block(S, wp.static(forward[level]), width, row)
            take_up = load_block(S, wp.static(forward[level]) + wp.static(entries) * width, width, row)
            barrier()
            if lane < rows_at(n, level):
                # where nothing was eliminated on a side, nothing is taken of another row
                half = wp.static(2 ** (level - 1))
                is_border = lane == rows_at(n, level) - 1
                link = wp.where(is_border, n - 1, ((lane + 1) << level) - 1)
                below = wp.max((rows_at(n, level - 1) - 1) * half - 1, 0)
                low = wp.where(is_border, below, link - half)
                up = wp.where(is_border, wp.min(half, n) - 1, wp.min(link + half, n - 1))
                value = at_link(S, link) - take_low * at_link(S, low) - take_up * at_link(S, up)
                if wp.static(level < reductions):
                    to_link(S, link, value)
        if is_in_first_warp(lane):
            solve_last_level(S, n, lane, value)
        for step in range(1, wp.static(reductions)):
            level = wp.static(reductions - step)
            half = wp.static(2 ** (reductions - step))
            width = wp.static(widths[reductions - step + 1])
            start = wp.static(backward[reductions - step])
            row = wp.min(lane, width - 1)
            link = wp.min((2 * lane + 1) * half, n) - 1
            inverse_pivot = load_block(S, start, width, row)
            take_low = load_block(S, start + wp.static(entries) * width, width, row)
            take_up = load_block(S, start + wp.static(2 * entries) * width, width, row)
            eliminated = inverse_pivot * at_link(S, link)
            barrier()
            if 2 * lane < rows_at(n, level) - 1:
                low = wp.where(lane == 0, n - 1, link - half)
                up = wp.where(2 * lane + 2 == rows_at(n, level), n - 1, link + half)
                to_link(S, link, eliminated - take_low * at_link(S, low) - take_up * at_link(S, up))

    if diagonal_of is None:

        @wp.func
        def reduce_diagonal(S: wp.uint64, n: int, row: int, constant: wp.float64):
            """(D, L, U) of a row of level 1: an odd link, the links beside it eliminated."""
            link = 2 * row + 1
            up = wp.where(link == n - 1, 0, link + 1)
            lower, upper = couplings_of(S, n, link, constant)
            low_lower, low_upper = couplings_of(S, n, link - 1, constant)
            up_lower, up_upper = couplings_of(S, n, up, constant)
            take_low = columns_scaled(lower, load_vector(S, wp.static(vectors), wp.static(threads), link - 1))
            take_up = columns_scaled(upper, load_vector(S, wp.static(vectors), wp.static(threads), up))
            middle = wp.diag(load_vector(S, wp.static(vectors), wp.static(threads), link))
            middle = middle - take_low * low_upper - take_up * up_lower
            return middle, -(take_low * low_lower), -(take_up * up_upper)

        @wp.func
        def factor_diagonal(S: wp.uint64, n: int, lane: int, own: Vector, constant: wp.float64):
            pivot = Vector(quotient(ONE, own[0]), quotient(ONE, own[1]), quotient(ONE, own[2]))
            if lane < n:
                store_vector(S, wp.static(vectors), wp.static(threads), lane, wp.where(lane % 2 == 0, pivot, own))
            barrier()
            middle = Block()
            lower = Block()
            upper = Block()
            if lane < n // 2:
                middle, lower, upper = reduce_diagonal(S, n, lane, constant)
            factor_levels(S, n, lane, middle, lower, upper)
            return pivot

        @wp.func
        def solve_diagonal(S: wp.uint64, n: int, lane: int, constant: wp.float64, pivot: Vector, right: Vector):
            own = right
            if lane % 2 == 0:
                own = wp.cw_mul(pivot, right)
            solve_levels(S, n, lane, constant, own)
            lower, upper = couplings_of(S, n, wp.min(lane, n - 1), constant)
            solution = Vector()
            barrier()
            if lane < n:
                if lane % 2 == 0:
                    low = wp.where(lane == 0, n - 1, lane - 1)
                    remainder = lower * at_link(S, low) + upper * at_link(S, lane + 1)
                    solution = own - wp.cw_mul(pivot, remainder)
                else:
                    solution = at_link(S, lane)
            return solution

        return factor_diagonal, solve_diagonal

    @wp.func
    def reduce_links(S: wp.uint64, n: int, row: int, constant: wp.float64):
        """(D, L, U) of a row of level 1: an odd link, the links beside it eliminated."""
        link = 2 * row + 1
        up = wp.where(link == n - 1, 0, link + 1)
        lower, upper = couplings_of(S, n, link, constant)
        low_lower, low_upper = couplings_of(S, n, link - 1, constant)
        up_lower, up_upper = couplings_of(S, n, up, constant)
        take_low = lower * load_block(S, wp.static(pivots), wp.static(first_width), row)
        take_up = upper * load_block(S, wp.static(pivots), wp.static(first_width), up // 2)
        middle = diagonal_of(S, n, link, constant) - take_low * low_upper - take_up * up_lower
        return middle, -(take_low * low_lower), -(take_up * up_upper)

    @wp.func
    def factor(S: wp.uint64, n: int, lane: int, constant: wp.float64):
        if lane < n // 2:
            pivot = inverse_block(diagonal_of(S, n, 2 * lane, constant))
            store_block(S, wp.static(pivots), wp.static(first_width), lane, pivot)
        barrier()
        middle = Block()
        lower = Block()
        upper = Block()
        if lane < n // 2:
            middle, lower, upper = reduce_links(S, n, lane, constant)
        factor_levels(S, n, lane, middle, lower, upper)

    @wp.func
    def solve(S: wp.uint64, n: int, lane: int, constant: wp.float64, right: Vector):
        row = wp.min(lane, n - 1) // 2
        pivot = load_block(S, wp.static(pivots), wp.static(first_width), row)
        own = right
        if lane % 2 == 0:
            own = pivot * right
        solve_levels(S, n, lane, constant, own)
        lower, upper = couplings_of(S, n, wp.min(lane, n - 1), constant)
        solution = Vector()
        barrier()
        if lane < n:
            if lane % 2 == 0:
                low = wp.where(lane == 0, n - 1, lane - 1)
                solution = own - pivot * (lower * at_link(S, low) + upper * at_link(S, lane + 1))
            else:
                solution = at_link(S, lane)
        return solution

    return factor, solve
