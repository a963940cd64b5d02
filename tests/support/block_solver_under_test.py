"""The linear solvers of the block form on CPU fibers, called from NumPy, on shared memory poisoned with NaN."""

import functools

import numpy as np
import warp as wp
from numpy.typing import NDArray

from tests.support.blocks_under_test import fibers
from warpchain.engine.devices import start_device
from warpchain.kernels.gpu.factors import FactorLayout, block_access, reductions_for
from warpchain.kernels.gpu.solver import block_solver
from warpchain.kernels.gpu.threads import barrier, tile_address, write
from warpchain.kernels.physics.elementary import ONE

Array = NDArray[np.float64]

DEVICE = start_device("cpu")
RIGHT_SIDES = 2


@functools.cache
def _solver(block_dim: int, reductions: int, order: int, has_diagonals: bool) -> wp.Kernel:
    """A link's numbers are its blocks themselves: L, U, and D unless that is diagonal."""
    entries = order**2
    places = FactorLayout(block_dim, reductions, 3 * entries, order=order, has_diagonals=has_diagonals)
    size = places.size
    address = tile_address(wp.float64, size)
    load_block, *_ = block_access(order)
    vector = wp.types.vector(length=order, dtype=wp.float64)

    @wp.func
    def couplings_of(memory: wp.uint64, n: int, link: int, constant: wp.float64):
        lower = load_block(memory, 0, wp.static(block_dim), link)
        return lower, load_block(memory, wp.static(entries * block_dim), wp.static(block_dim), link)

    @wp.func
    def diagonal_of(memory: wp.uint64, n: int, link: int, constant: wp.float64):
        return constant * load_block(memory, wp.static(2 * entries * block_dim), wp.static(block_dim), link)

    factor, solve = block_solver(places, couplings_of, None if has_diagonals else diagonal_of)

    @wp.kernel(module="unique", enable_backward=False)
    def solver(
        blocks: wp.array2d(dtype=wp.float64),
        right: wp.array3d(dtype=wp.float64),
        solution: wp.array3d(dtype=wp.float64),
        n: int,
    ):
        _block, lane = wp.tid()
        tile = wp.tile_empty(shape=(wp.static(size),), dtype=wp.float64, storage="shared")
        shared = address(tile)
        k = int(lane)
        while k < wp.static(size):
            write(shared, k, wp.float64(wp.nan))
            k += wp.static(block_dim)
        barrier()
        own = vector(ONE)
        if lane < n:
            for entry in range(wp.static((2 if has_diagonals else 3) * entries)):
                write(shared, entry * wp.static(block_dim) + lane, blocks[entry, lane])
            for entry in range(wp.static(order)):
                own[entry] = blocks[wp.static(2 * entries + (order + 1) * entry), lane]
        if wp.static(has_diagonals):
            pivot = factor(shared, n, lane, own, ONE)
        else:
            barrier()
            factor(shared, n, lane, ONE)
        barrier()
        for k in range(wp.static(RIGHT_SIDES)):
            side = vector()
            if lane < n:
                for entry in range(wp.static(order)):
                    side[entry] = right[k, lane, entry]
            if wp.static(has_diagonals):
                found = solve(shared, n, lane, ONE, pivot, side)
            else:
                found = solve(shared, n, lane, ONE, side)
            barrier()
            if lane < n:
                for entry in range(wp.static(order)):
                    solution[k, lane, entry] = found[entry]

    return solver


def solve_loops(
    lower: Array, diagonal: Array, upper: Array, right: Array, block_dim: int, reductions: int | None = None
) -> Array:
    """Solutions (RIGHT_SIDES, n, B) of L x_{i−1} + D x_i + U x_{i+1} = r_i, factored once.

    Args:
        lower: L (n, B, B).
        diagonal: D (n, B, B), or (n, B) for the solver of diagonal D.
        upper: U (n, B, B).
        right: (RIGHT_SIDES, n, B).
        block_dim: Threads of the block.
        reductions: Levels of cyclic reduction; None: as many as the block form takes.
    """
    links, order = diagonal.shape[:2]
    has_diagonals = diagonal.ndim == 2
    if has_diagonals:
        diagonal = diagonal[:, :, None] * np.eye(order)
    blocks = np.concatenate([block.reshape(links, -1) for block in (lower, upper, diagonal)], axis=1).T
    solution = wp.full((RIGHT_SIDES, links, order), np.nan, dtype=wp.float64, device=DEVICE)
    inputs = [
        wp.array(np.ascontiguousarray(blocks), dtype=wp.float64, device=DEVICE),
        wp.array(right, dtype=wp.float64, device=DEVICE),
        solution,
        links,
    ]
    levels = reductions_for(block_dim) if reductions is None else reductions
    kernel = _solver(block_dim, levels, order, has_diagonals)
    with fibers():
        wp.launch_tiled(kernel, dim=[1], inputs=inputs, block_dim=block_dim, device=DEVICE)
    return solution.numpy()
