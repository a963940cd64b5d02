"""The linear solvers of the block form on CPU fibers, called from NumPy, on shared memory poisoned with NaN."""

import functools

import numpy as np
import warp as wp
from numpy.typing import NDArray

from tests.blocks_under_test import fibers
from warpchain.devices import start_device
from warpchain.kernels.block_memory import barrier, tile_address, write
from warpchain.kernels.block_solver import FactorLayout, block_access, block_solver, reductions_for, vec3d
from warpchain.kernels.elementary import ONE, ZERO

Array = NDArray[np.float64]

DEVICE = start_device("cpu")
RIGHT_SIDES = 2


@functools.cache
def _solver(block_dim: int, reductions: int) -> wp.Kernel:
    """Here a link's numbers are its couplings themselves."""
    places = FactorLayout(block_dim=block_dim, reductions=reductions, link_numbers=18)
    size = places.size
    address = tile_address(wp.float64, size)

    load_block, *_ = block_access(3)

    @wp.func
    def couplings_of(memory: wp.uint64, n: int, link: int, constant: wp.float64):
        lower = load_block(memory, 0, wp.static(block_dim), link)
        return lower, load_block(memory, wp.static(9 * block_dim), wp.static(block_dim), link)

    factor, solve = block_solver(places, couplings_of)

    @wp.kernel(module="unique", enable_backward=False)
    def solver(
        couplings: wp.array2d(dtype=wp.float64),
        diagonal: wp.array(dtype=vec3d),
        right: wp.array2d(dtype=vec3d),
        solution: wp.array2d(dtype=vec3d),
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
        own = vec3d(ONE, ONE, ONE)
        if lane < n:
            own = diagonal[lane]
            for entry in range(18):
                write(shared, entry * wp.static(block_dim) + lane, couplings[entry, lane])
        pivot = factor(shared, n, lane, own, ZERO)
        barrier()
        for k in range(wp.static(RIGHT_SIDES)):
            side = vec3d()
            if lane < n:
                side = right[k, lane]
            found = solve(shared, n, lane, ZERO, pivot, side)
            barrier()
            if lane < n:
                solution[k, lane] = found

    return solver


def solve_loops(
    lower: Array, diagonal: Array, upper: Array, right: Array, block_dim: int, reductions: int | None = None
) -> Array:
    """Solutions (RIGHT_SIDES, n, 3) of L x_{i−1} + diag(D) x_i + U x_{i+1} = r, factored once.

    Args:
        lower: L (n, 3, 3).
        diagonal: D (n, 3).
        upper: U (n, 3, 3).
        right: (RIGHT_SIDES, n, 3).
        block_dim: Threads of the block.
        reductions: Levels of cyclic reduction; None: as many as the block form takes.
    """
    links = len(diagonal)
    couplings = np.concatenate([lower.reshape(links, 9), upper.reshape(links, 9)], axis=1).T
    solution = wp.full((RIGHT_SIDES, links), vec3d(np.nan, np.nan, np.nan), dtype=vec3d, device=DEVICE)
    inputs = [
        wp.array(np.ascontiguousarray(couplings), dtype=wp.float64, device=DEVICE),
        wp.array(diagonal, dtype=vec3d, device=DEVICE),
        wp.array(right, dtype=vec3d, device=DEVICE),
        solution,
        links,
    ]
    kernel = _solver(block_dim, reductions_for(block_dim) if reductions is None else reductions)
    with fibers():
        wp.launch_tiled(kernel, dim=[1], inputs=inputs, block_dim=block_dim, device=DEVICE)
    return solution.numpy()


@functools.cache
def _dense_solver(block_dim: int, order: int) -> wp.Kernel:
    """The same for any D of this order; a link's numbers are its three blocks."""
    entries = order**2
    places = FactorLayout(
        block_dim=block_dim,
        reductions=reductions_for(block_dim),
        link_numbers=3 * entries,
        order=order,
        has_diagonals=False,
    )
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

    factor, solve = block_solver(places, couplings_of, diagonal_of)

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
        if lane < n:
            for entry in range(wp.static(3 * entries)):
                write(shared, entry * wp.static(block_dim) + lane, blocks[entry, lane])
        barrier()
        factor(shared, n, lane, ONE)
        barrier()
        for k in range(wp.static(RIGHT_SIDES)):
            side = vector()
            if lane < n:
                for entry in range(wp.static(order)):
                    side[entry] = right[k, lane, entry]
            found = solve(shared, n, lane, ONE, side)
            barrier()
            if lane < n:
                for entry in range(wp.static(order)):
                    solution[k, lane, entry] = found[entry]

    return solver


def solve_dense_loops(lower: Array, diagonal: Array, upper: Array, right: Array, block_dim: int) -> Array:
    """Solutions (RIGHT_SIDES, n, B) of L x_{i−1} + D x_i + U x_{i+1} = r_i, factored once; blocks (n, B, B)."""
    links, order = diagonal.shape[:2]
    blocks = np.concatenate([block.reshape(links, -1) for block in (lower, upper, diagonal)], axis=1).T
    solution = wp.full((RIGHT_SIDES, links, order), np.nan, dtype=wp.float64, device=DEVICE)
    inputs = [
        wp.array(np.ascontiguousarray(blocks), dtype=wp.float64, device=DEVICE),
        wp.array(right, dtype=wp.float64, device=DEVICE),
        solution,
        links,
    ]
    with fibers():
        kernel = _dense_solver(block_dim, order)
        wp.launch_tiled(kernel, dim=[1], inputs=inputs, block_dim=block_dim, device=DEVICE)
    return solution.numpy()
