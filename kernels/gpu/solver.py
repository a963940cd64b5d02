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

import warp as wp

from warpchain.kernels.cpu.implicit.solver import block_inverse, block_type
from warpchain.kernels.gpu.factors import FactorLayout, block_access
from warpchain.kernels.gpu.threads import barrier, is_in_first_warp, warp_barrier
from warpchain.kernels.physics.elementary import ONE, quotient

wp.set_module_options({"enable_backward": False})


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

    # An even link's inverse D is given by its pivot: a vector if D is diagonal, which it is for all links or none.
    if diagonal_of is None:
        Pivot = Vector

        @wp.func
        def times(pivot: Vector, vector: Vector):
            return wp.cw_mul(pivot, vector)

        @wp.func
        def over_pivot(S: wp.uint64, block: Block, link: int):
            pivot = at_link(S, link)
            product = Block()
            for i in range(wp.static(order)):
                for j in range(wp.static(order)):
                    product[i, j] = block[i, j] * pivot[j]
            return product

        @wp.func
        def middle_of(S: wp.uint64, n: int, link: int, constant: wp.float64):
            return wp.diag(at_link(S, link))

    else:
        Pivot = Block
        middle_of = diagonal_of

        @wp.func
        def times(pivot: Block, vector: Vector):
            return pivot * vector

        @wp.func
        def over_pivot(S: wp.uint64, block: Block, link: int):
            return block * load_block(S, wp.static(pivots), wp.static(first_width), link // 2)

    @wp.func
    def reduce(S: wp.uint64, n: int, row: int, constant: wp.float64):
        """(D, L, U) of a row of level 1: an odd link, the links beside it eliminated."""
        link = 2 * row + 1
        up = wp.where(link == n - 1, 0, link + 1)
        lower, upper = couplings_of(S, n, link, constant)
        low_lower, low_upper = couplings_of(S, n, link - 1, constant)
        up_lower, up_upper = couplings_of(S, n, up, constant)
        take_low = over_pivot(S, lower, link - 1)
        take_up = over_pivot(S, upper, up)
        middle = middle_of(S, n, link, constant) - take_low * low_upper - take_up * up_lower
        return middle, -(take_low * low_lower), -(take_up * up_upper)

    @wp.func
    def factor_behind_pivots(S: wp.uint64, n: int, lane: int, constant: wp.float64):
        """The rest, given what even links have left of their own D."""
        barrier()
        middle = Block()
        lower = Block()
        upper = Block()
        if lane < n // 2:
            middle, lower, upper = reduce(S, n, lane, constant)
        factor_levels(S, n, lane, middle, lower, upper)

    @wp.func
    def solve_given_pivot(S: wp.uint64, n: int, lane: int, constant: wp.float64, pivot: Pivot, right: Vector):
        own = right
        if lane % 2 == 0:
            own = times(pivot, right)
        solve_levels(S, n, lane, constant, own)
        lower, upper = couplings_of(S, n, wp.min(lane, n - 1), constant)
        solution = Vector()
        barrier()
        if lane < n:
            if lane % 2 == 0:
                low = wp.where(lane == 0, n - 1, lane - 1)
                solution = own - times(pivot, lower * at_link(S, low) + upper * at_link(S, lane + 1))
            else:
                solution = at_link(S, lane)
        return solution

    if diagonal_of is None:

        @wp.func
        def factor_diagonal(S: wp.uint64, n: int, lane: int, own: Vector, constant: wp.float64):
            pivot = Vector()
            for i in range(wp.static(order)):
                pivot[i] = quotient(ONE, own[i])
            if lane < n:
                to_link(S, lane, wp.where(lane % 2 == 0, pivot, own))
            factor_behind_pivots(S, n, lane, constant)
            return pivot

        return factor_diagonal, solve_given_pivot

    @wp.func
    def factor(S: wp.uint64, n: int, lane: int, constant: wp.float64):
        if lane < n // 2:
            pivot = inverse_block(diagonal_of(S, n, 2 * lane, constant))
            store_block(S, wp.static(pivots), wp.static(first_width), lane, pivot)
        factor_behind_pivots(S, n, lane, constant)

    @wp.func
    def solve(S: wp.uint64, n: int, lane: int, constant: wp.float64, right: Vector):
        pivot = load_block(S, wp.static(pivots), wp.static(first_width), wp.min(lane, n - 1) // 2)
        return solve_given_pivot(S, n, lane, constant, pivot, right)

    return factor, solve
