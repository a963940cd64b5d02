"""The solver of rigid joints' linear systems against NumPy, on memory poisoned with NaN."""

import numpy as np
import pytest
import warp as wp
from numpy.testing import assert_allclose

from tests.support.kernels_under_test import DEVICE, compiled, poisoned
from warpchain.kernels.cpu.implicit.solver import SegmentLayout, cyclic_solver, segment_columns, segment_places


def places_of(rows):
    """Which row of a loop lies where, (P, 8), and which places repeat the separator before them."""
    total = 2 * rows if rows < 8 else rows
    places = -(-total // 8)
    full = 8 - (8 * places - total)
    place, segment = np.mgrid[:places, :8]
    return (segment * places + place - np.maximum(segment + 1 - full, 0)) % rows, (place == 0) & (segment >= full)


def solver_of(size, columns):
    """The kernel that solves a system of submatrices of this size, and its layout."""
    segments = SegmentLayout(size=size, columns=columns, matrix=0, right=5 * size * size)
    factor, solve = cyclic_solver(segments)
    rows = segments.right + size
    separator_rows = segments.separator_rows

    @compiled
    def solver(block: wp.array2d(dtype=wp.float64), separators: wp.array2d(dtype=wp.float64), links: int):
        rows_of_loop = wp.array(ptr=block.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        rows_of_separators = wp.array(ptr=separators.ptr, shape=(wp.static(separator_rows), 8), dtype=wp.float64)
        places, full, _ = segment_places(links)
        factor(rows_of_loop, rows_of_separators, places, full)
        solve(rows_of_loop, rows_of_separators, places)

    return solver, segments


def solve_loop(kernel, segments, matrices, right):
    """Solution (n, B) of L x_{i−1} + D x_i + U x_{i+1} = r; matrices (3, n, B, B), right-hand side (n, B)."""
    rows, size = right.shape
    at, repeats = (values.ravel() for values in places_of(rows))
    used = slice(8, 8 + len(at))
    block = np.full((segments.right + size, segments.columns), np.nan)
    for index, (values, unit) in enumerate(zip(matrices, (-1.0, 1.0, 0.0), strict=True)):
        placed = values[at]
        placed[repeats] = unit * np.eye(size)
        first = segments.submatrix(index)
        block[first : first + size * size, used] = placed.reshape(-1, size * size).T
    placed = right[at]
    placed[repeats] = 0.0
    block[segments.right : segments.right + size, used] = placed.T
    memory = wp.array(block, dtype=wp.float64, device=DEVICE)
    separators = poisoned(segments.separator_rows, 8)
    wp.launch(kernel, dim=1, inputs=[memory, separators, rows], device=DEVICE)
    solution = memory.numpy()[segments.right : segments.right + size, used].T
    result = np.full((rows, size), np.nan)
    result[at] = solution
    assert_allclose(solution, result[at], rtol=1e-9, atol=1e-12 * np.abs(solution).max())
    return result


def dense(lower, diagonal, upper):
    """The cyclic block-tridiagonal matrix in full."""
    n, size, _ = diagonal.shape
    matrix = np.zeros((n, size, n, size))
    for i in range(n):
        matrix[i, :, (i - 1) % n] += lower[i]
        matrix[i, :, i] += diagonal[i]
        matrix[i, :, (i + 1) % n] += upper[i]
    return matrix.reshape(n * size, n * size)


@pytest.mark.parametrize(("size", "longest"), [(2, 198), (3, 1000)])
def test_solver_agrees_with_dense_elimination(size, longest):
    """For every kind of number of rows, the shortest loops included, the solution is NumPy's to rounding."""
    rng = np.random.default_rng(size)
    kernel, segments = solver_of(size, segment_columns(longest))
    for rows in (4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 60, 90, 150, longest):
        matrices = rng.normal(size=(3, rows, size, size))
        matrices[1] += 3 * size * np.eye(size)
        right = rng.normal(size=(rows, size))
        exact = np.linalg.solve(dense(*matrices), right.ravel()).reshape(rows, size)
        found = solve_loop(kernel, segments, matrices, right)
        assert_allclose(found, exact, rtol=0, atol=3e-15, err_msg=f"{rows} rows")
