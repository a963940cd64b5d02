"""Linear systems of a loop in the block form: one thread per row, cyclic and parallel cyclic reduction.

Row i of the system is L_i x_{i−1} + D_i x_i + U_i x_{i+1} = r_i with 3 × 3 blocks and indices modulo the number of
links. Each *reduction* eliminates every other row (cyclic reduction: R. W. Hockney, J. ACM 12 (1965) 95) until what is
left fits into one hardware warp. There parallel cyclic reduction (R. W. Hockney, C. R. Jesshope, Parallel Computers,
1981) doubles the distance between coupled rows until none is left, with no barrier of the block. The loop is cut at
its last link, the *border*, which is never eliminated; a row that has lost its neighbour on one side is coupled to the
border in that neighbour's place. So no more numbers have to be carried than for a chain with free ends.

Factors stay in the memory that the block shares, S below being its address. Then a solution costs an exchange of three
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
        link_numbers: Numbers a link from which its couplings are made; they lie at the beginning.
    """

    block_dim: int
    reductions: int
    link_numbers: int

    def width(self, level: int) -> int:
        """Greatest number of rows of a level."""
        return -(-self.block_dim // 2**level)

    @property
    def last_width(self) -> int:
        """Greatest number of rows of the last level."""
        return self.width(self.reductions)

    @property
    def vectors(self) -> int:
        """Right-hand sides, then solutions, by link."""
        return self.link_numbers * self.block_dim

    @property
    def hands(self) -> int:
        """Two vectors a row of the last level, which are written in turn."""
        return self.vectors + 3 * self.block_dim

    def forward(self, level: int) -> int:
        """Two blocks a row of a level from 2 on: what it takes of the two rows that were eliminated beside it."""
        start = self.vectors + max(3 * self.block_dim + 6 * self.last_width, 27 * self.last_width)
        return start + 18 * sum(map(self.width, range(2, level)))

    def backward(self, level: int) -> int:
        """Three blocks a row eliminated on a level from 1 on: inverse pivot, that times its two couplings."""
        return self.forward(self.reductions + 1) + 27 * sum(map(self.width, range(2, level + 1)))

    @property
    def rounds(self) -> int:
        """Two blocks a row and round: what it takes of the rows coupled to it."""
        return self.backward(self.reductions)

    @property
    def inverse(self) -> int:
        """Two blocks a row of the last level: inverse pivot, that times the coupling to the border."""
        return self.rounds + 18 * self.last_width * max(self.last_width - 2, 0).bit_length()

    @property
    def border(self) -> int:
        """Three blocks: inverse pivot of the border, that times its two couplings."""
        return self.inverse + 18 * self.last_width

    @property
    def size(self) -> int:
        """Doubles in all."""
        return max(self.border + 27, self.rounds + 27 * self.width(1))


def reductions_for(block_dim: int) -> int:
    """Least number of reductions, at least LEAST_REDUCTIONS, that leaves no more rows than LAST_ROWS."""
    return max(LEAST_REDUCTIONS, (-(-block_dim // LAST_ROWS) - 1).bit_length())


@wp.func
def load_block(S: wp.uint64, start: int, width: int, column: int):
    """A block from memory: entry by entry, ``width`` apart."""
    block = mat33d()
    for i in range(3):
        for j in range(3):
            block[i, j] = read(S, start + (3 * i + j) * width + column)
    return block


@wp.func
def store_block(S: wp.uint64, start: int, width: int, column: int, block: mat33d):
    """Inverse of :func:`load_block`."""
    for i in range(3):
        for j in range(3):
            write(S, start + (3 * i + j) * width + column, block[i, j])


@wp.func
def load_vector(S: wp.uint64, start: int, width: int, column: int):
    """A vector from memory."""
    return vec3d(read(S, start + column), read(S, start + width + column), read(S, start + 2 * width + column))


@wp.func
def store_vector(S: wp.uint64, start: int, width: int, column: int, vector: vec3d):
    """Inverse of :func:`load_vector`."""
    write(S, start + column, vector[0])
    write(S, start + width + column, vector[1])
    write(S, start + 2 * width + column, vector[2])


@wp.func
def columns_scaled(m: mat33d, scale: vec3d):
    """m diag(scale)."""
    block = mat33d()
    for i in range(3):
        for j in range(3):
            block[i, j] = m[i, j] * scale[j]
    return block


@functools.cache
def block_solver(memory: FactorLayout, couplings_of):
    """Warp functions (factor, solve) for one loop a block.

    Args:
        memory: Where the factors lie.
        couplings_of: Warp function ``(S, n, link, constant)`` → (L, U) of a link from the numbers that all links have
            left in memory and one for all.

    Returns:
        ``factor(S, n, lane, own, constant)`` → inverse of the thread's own D, which is diagonal and given as a vector;
        ``solve(S, n, lane, constant, pivot, right)`` → solution of the thread's row, given that inverse and its
        right-hand side. Both leave no barrier behind them. n is even.
    """
    threads = memory.block_dim
    reductions = memory.reductions
    first_width, last_width = memory.width(1), memory.last_width
    vectors, hands, rounds = memory.vectors, memory.hands, memory.rounds
    inverse, border = memory.inverse, memory.border
    forward = [memory.forward(level) for level in range(reductions + 1)]
    backward = [memory.backward(level) for level in range(reductions + 1)]
    widths = [memory.width(level) for level in range(reductions + 1)]
    inverse_block = block_inverse(3)

    @wp.func
    def rows_at(n: int, level: int):
        return (n + (1 << level) - 1) >> level

    @wp.func
    def reduce_links(S: wp.uint64, n: int, row: int, constant: wp.float64):
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
    def publish_row(S: wp.uint64, start: int, width: int, row: int, middle: mat33d, lower: mat33d, upper: mat33d):
        store_block(S, start, width, row, middle)
        store_block(S, start + 9 * width, width, row, lower)
        store_block(S, start + 18 * width, width, row, upper)

    @wp.func
    def couple(S: wp.uint64, block: mat33d, start: int, width: int, other: int, is_there: bool):
        """What a row with this coupling takes of another one, and that times the other's two couplings.

        Rows are published from ``start`` on, ``width`` side by side; an eliminated one has its inverse pivot there.
        """
        take = mat33d()
        if is_there:
            take = block * load_block(S, start, width, other)
        lower = load_block(S, start + 9 * width, width, other)
        upper = load_block(S, start + 18 * width, width, other)
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
    def factor_last_level(S: wp.uint64, n: int, lane: int, own: mat33d, below: mat33d, above: mat33d):
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
                store_block(S, start + wp.static(9 * last_width), wp.static(last_width), lane, take_up)
                middle = middle - low_upper - up_lower
                if has_low:
                    lower = -low_lower
                if has_up:
                    upper = -up_upper
            warp_barrier()
            start += wp.static(18 * last_width)
            stride = 2 * stride
        if lane < last:
            middle = inverse_block(middle)
            store_block(S, wp.static(inverse), wp.static(last_width), lane, middle)
            store_block(S, wp.static(inverse + 9 * last_width), wp.static(last_width), lane, middle * (lower + upper))
        warp_barrier()
        if lane == last:
            if last > 0:
                first = load_block(S, wp.static(inverse + 9 * last_width), wp.static(last_width), 0)
                middle = middle - upper * first
                middle = middle - lower * load_block(
                    S, wp.static(inverse + 9 * last_width), wp.static(last_width), last - 1
                )
            else:
                middle = middle + lower + upper
                lower = mat33d()
                upper = mat33d()
            middle = inverse_block(middle)
            store_block(S, wp.static(border), 1, 0, middle)
            store_block(S, wp.static(border + 9), 1, 0, middle * lower)
            store_block(S, wp.static(border + 18), 1, 0, middle * upper)

    @wp.func
    def factor(S: wp.uint64, n: int, lane: int, own: vec3d, constant: wp.float64):
        pivot = vec3d(quotient(ONE, own[0]), quotient(ONE, own[1]), quotient(ONE, own[2]))
        if lane < n:
            store_vector(S, wp.static(vectors), wp.static(threads), lane, wp.where(lane % 2 == 0, pivot, own))
        barrier()
        middle = mat33d()
        lower = mat33d()
        upper = mat33d()
        if lane < n // 2:
            middle, lower, upper = reduce_links(S, n, lane, constant)
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
                lower = load_block(S, wp.static(rounds + 9 * first_width), wp.static(first_width), here)
                upper = load_block(S, wp.static(rounds + 18 * first_width), wp.static(first_width), here)
                take_low, low_lower, low_upper = couple(
                    S, lower, wp.static(rounds), wp.static(first_width), low, has_low
                )
                take_up, up_lower, up_upper = couple(S, upper, wp.static(rounds), wp.static(first_width), up, has_up)
                start = wp.static(forward[level + 1])
                width = wp.static(widths[level + 1])
                store_block(S, start, width, lane, take_low)
                store_block(S, start + 9 * width, width, lane, take_up)
                middle = middle - low_upper - up_lower
                if has_low:
                    lower = -low_lower
                if has_up:
                    upper = -up_upper
            barrier()
        if is_in_first_warp(lane):
            factor_last_level(S, n, lane, middle, lower, upper)
        return pivot

    @wp.func
    def at_link(S: wp.uint64, link: int):
        return load_vector(S, wp.static(vectors), wp.static(threads), link)

    @wp.func
    def to_link(S: wp.uint64, link: int, value: vec3d):
        store_vector(S, wp.static(vectors), wp.static(threads), link, value)

    @wp.func
    def solve_last_level(S: wp.uint64, n: int, lane: int, given: vec3d):
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
            take_up = load_block(S, start + wp.static(9 * last_width), wp.static(last_width), row)
            warp_barrier()
            # where there is no such row, nothing is taken of another one
            low = wp.clamp(row - stride, 0, last - 1)
            up = wp.min(row + stride, last - 1)
            value = value - take_low * load_vector(S, hand, wp.static(last_width), low)
            value = value - take_up * load_vector(S, hand, wp.static(last_width), up)
            start += wp.static(18 * last_width)
            hand = wp.static(2 * hands + 3 * last_width) - hand
            stride = 2 * stride
        if lane < last:
            value = load_block(S, wp.static(inverse), wp.static(last_width), row) * value
            store_vector(S, hand, wp.static(last_width), lane, value)
        if lane == last:
            store_vector(S, hand, wp.static(last_width), lane, given)
        warp_barrier()
        cut = load_block(S, wp.static(border), 1, 0) * load_vector(S, hand, wp.static(last_width), last)
        before = wp.max(last - 1, 0)
        cut = cut - load_block(S, wp.static(border + 9), 1, 0) * load_vector(S, hand, wp.static(last_width), before)
        cut = cut - load_block(S, wp.static(border + 18), 1, 0) * load_vector(S, hand, wp.static(last_width), 0)
        if lane < last:
            value = value - load_block(S, wp.static(inverse + 9 * last_width), wp.static(last_width), row) * cut
            to_link(S, ((lane + 1) << wp.static(reductions)) - 1, value)
        if lane == last:
            to_link(S, n - 1, cut)

    @wp.func
    def solve(S: wp.uint64, n: int, lane: int, constant: wp.float64, pivot: vec3d, right: vec3d):
        own = right
        if lane % 2 == 0:
            own = wp.cw_mul(pivot, right)
        if lane < n:
            to_link(S, lane, own)
        value = vec3d()
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
            take_up = load_block(S, wp.static(forward[level]) + 9 * width, width, row)
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
            take_low = load_block(S, start + 9 * width, width, row)
            take_up = load_block(S, start + 18 * width, width, row)
            eliminated = inverse_pivot * at_link(S, link)
            barrier()
            if 2 * lane < rows_at(n, level) - 1:
                low = wp.where(lane == 0, n - 1, link - half)
                up = wp.where(2 * lane + 2 == rows_at(n, level), n - 1, link + half)
                to_link(S, link, eliminated - take_low * at_link(S, low) - take_up * at_link(S, up))
        lower, upper = couplings_of(S, n, wp.min(lane, n - 1), constant)
        solution = vec3d()
        barrier()
        if lane < n:
            if lane % 2 == 0:
                low = wp.where(lane == 0, n - 1, lane - 1)
                remainder = lower * at_link(S, low) + upper * at_link(S, lane + 1)
                solution = own - wp.cw_mul(pivot, remainder)
            else:
                solution = at_link(S, lane)
        return solution

    return factor, solve
