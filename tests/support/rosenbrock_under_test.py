"""The implicit step and its linear solver, called from NumPy one by one, on scratch memory poisoned with NaN."""

import functools

import numpy as np
import warp as wp
from numpy.typing import NDArray

from tests.support.kernels_under_test import chain_on_cpu
from warpchain.engine.devices import start_device
from warpchain.inputs.parameters import Parameters
from warpchain.kernels import layout
from warpchain.kernels.cpu.explicit import place_ends
from warpchain.kernels.cpu.functions import cpu_method
from warpchain.kernels.cpu.implicit.solver import SegmentLayout, cyclic_solver, segment_columns, segment_places
from warpchain.kernels.cpu.loop import load_state
from warpchain.kernels.cpu.rows import scratch_rows
from warpchain.kernels.features import COMPILER_FLAGS
from warpchain.kernels.types import Model, State, read_chain

Array = NDArray[np.float64]

DEVICE = start_device("cpu").warp
_compiled = functools.partial(
    wp.kernel, module="unique", enable_backward=False, module_options={"cpu_compiler_flags": COMPILER_FLAGS}
)


# --- the linear solver ---


def places_of(rows: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Which row of a loop lies where, (P, 8), and which places repeat the separator before them."""
    total = 2 * rows if rows < 8 else rows
    places = -(-total // 8)
    full = 8 - (8 * places - total)
    place, segment = np.mgrid[:places, :8]
    return (segment * places + place - np.maximum(segment + 1 - full, 0)) % rows, (place == 0) & (segment >= full)


@functools.cache
def _solver(size: int, columns: int) -> tuple[wp.Kernel, SegmentLayout]:
    segments = SegmentLayout(size=size, columns=columns, matrix=0, right=5 * size * size)
    factor, solve = cyclic_solver(segments)
    rows = segments.right + size
    separator_rows = segments.separator_rows

    @_compiled
    def solver(block: wp.array2d(dtype=wp.float64), separators: wp.array2d(dtype=wp.float64), links: int):
        rows_of_loop = wp.array(ptr=block.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        rows_of_separators = wp.array(ptr=separators.ptr, shape=(wp.static(separator_rows), 8), dtype=wp.float64)
        places, full, _ = segment_places(links)
        factor(rows_of_loop, rows_of_separators, places, full)
        solve(rows_of_loop, rows_of_separators, places)

    return solver, segments


def solve_loop(lower: Array, diagonal: Array, upper: Array, right: Array) -> Array:
    """Solution (n, B) of L x_{i−1} + D x_i + U x_{i+1} = r; blocks (n, B, B), right-hand side (n, B)."""
    rows, size = right.shape
    kernel, segments = _solver(size, segment_columns(max(rows, 2 * rows if rows < 8 else 0)))
    at, repeats = (values.ravel() for values in places_of(rows))
    used = slice(8, 8 + len(at))
    block = np.full((segments.right + size, segments.columns), np.nan)
    for index, (values, unit) in enumerate(((lower, -1.0), (diagonal, 1.0), (upper, 0.0))):
        placed = values[at]
        placed[repeats] = unit * np.eye(size)
        first = segments.submatrix(index)
        block[first : first + size * size, used] = placed.reshape(-1, size * size).T
    placed = right[at]
    placed[repeats] = 0.0
    block[segments.right : segments.right + size, used] = placed.T
    memory = wp.array(block, dtype=wp.float64, device=DEVICE)
    separators = wp.full((segments.separator_rows, 8), np.nan, dtype=wp.float64, device=DEVICE)
    wp.launch(kernel, dim=1, inputs=[memory, separators, rows], device=DEVICE)
    solution = memory.numpy()[segments.right : segments.right + size, used].T
    result = np.full((rows, size), np.nan)
    result[at] = solution
    np.testing.assert_allclose(solution, result[at], rtol=1e-9, atol=1e-12 * np.abs(solution).max())
    return result


# --- one step of a chain ---


@functools.cache
def _step(method: str, columns: int) -> wp.Kernel:
    functions = cpu_method(method, columns)
    first_stage, attempt, commit = functions.first_stage, functions.attempt, functions.commit
    rows = scratch_rows(method, columns)

    @_compiled
    def step(
        model: Model,
        state: State,
        scratch: wp.array3d(dtype=wp.float64),
        h: wp.float64,
        tolerance: wp.float64,
        error: wp.array(dtype=wp.float64),
    ):
        world = wp.tid()
        chain = read_chain(model, world)
        block = scratch[world]
        rows_of_chain = wp.array(ptr=block.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        load_state(rows_of_chain, state, chain, world)
        place_ends(rows_of_chain, chain)
        first_stage(rows_of_chain, chain)
        bits = attempt(rows_of_chain, chain, h, tolerance)
        error[world] = wp.cast(bits, wp.float64)
        commit(rows_of_chain, chain, h)

    return step


def one_step(
    method: str, position: Array, velocity: Array, parameters: Parameters, h: float, tolerance: float = 1.0
) -> tuple[Array, Array, float, Array]:
    """Position (n, 3) and velocity (n, 3) after one step, its error ratio, and what friction and damping took [J]."""
    links = len(position)
    columns = layout.padded_width(links)
    model, state = chain_on_cpu(position, velocity, parameters)
    scratch = wp.full((1, scratch_rows(method, columns), columns), np.nan, dtype=wp.float64, device=DEVICE)
    error = wp.full(1, np.nan, dtype=wp.float64, device=DEVICE)
    wp.launch(_step(method, columns), dim=1, inputs=[model, state, scratch, h, tolerance, error], device=DEVICE)
    rows = scratch.numpy()[0, :, :links]
    lost = rows[[layout.LOST_FRICTION, layout.LOST_DAMPING]].sum(axis=1)
    return rows[:3].T.copy(), rows[3:6].T.copy(), float(error.numpy()[0]), lost
