"""Rigid joints called from NumPy: the kernels' functions on scratch memory poisoned with NaN."""

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from tests.support.kernels_under_test import chain_on_cpu
from warpchain.engine.devices import start_device
from warpchain.inputs.parameters import Parameters
from warpchain.kernels import layout
from warpchain.kernels.cpu.functions import rigid_flight
from warpchain.kernels.cpu.loop import load_state
from warpchain.kernels.cpu.rows import scratch_rows
from warpchain.kernels.features import COMPILER_FLAGS
from warpchain.kernels.types import Model, State, read_chain

Array = NDArray[np.float64]

DEVICE = start_device("cpu").warp


@dataclass(frozen=True)
class Outcome:
    """What a visit to rigid joints leaves.

    Attributes:
        closed: Whether the joints were closed.
        closing: Energy booked there [J].
        opening: Energy booked on the way back [J]; NaN if there was none.
        position: (n, 3).
        velocity: (n, 3).
        acceleration: (n, 3) on rigid joints.
        friction: Energy lost to friction [J].
    """

    closed: bool
    closing: float
    opening: float
    position: Array
    velocity: Array
    acceleration: Array
    friction: float


@functools.cache
def _visit(columns: int) -> wp.Kernel:
    flight = rigid_flight("hybrid", columns)
    attempt, commit = flight.attempt, flight.commit
    close_joints, open_joints = flight.close_joints, flight.open_joints
    rows = scratch_rows("hybrid", columns)

    @wp.kernel(module="unique", enable_backward=False, module_options={"cpu_compiler_flags": COMPILER_FLAGS})
    def visit(
        model: Model,
        state: State,
        scratch: wp.array3d(dtype=wp.float64),
        h: wp.float64,
        steps: int,
        opens: int,
        results: wp.array(dtype=wp.float64),
    ):
        chain = read_chain(model, 0)
        block = scratch[0]
        rows_of_chain = wp.array(ptr=block.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        load_state(rows_of_chain, state, chain, 0)
        closed, lost = close_joints(rows_of_chain, chain)
        results[0] = wp.where(closed, wp.float64(1.0), wp.float64(0.0))
        results[1] = lost
        for _ in range(steps):
            attempt(rows_of_chain, chain, h, wp.float64(1.0))
            commit(rows_of_chain, chain, h)
        if opens != 0:
            results[2] = open_joints(rows_of_chain, chain)

    return visit


def visit(
    position: Array, velocity: Array, parameters: Parameters, *, h: float = 1.0, steps: int = 0, opens: bool = False
) -> Outcome:
    """Close the joints of a chain, make a number of steps of h [s] each, and open the joints again if wished."""
    links = len(position)
    columns = layout.padded_width(links)
    model, state = chain_on_cpu(position, velocity, parameters)
    scratch = wp.full((1, scratch_rows("hybrid", columns), columns), np.nan, dtype=wp.float64, device=DEVICE)
    results = wp.full(3, np.nan, dtype=wp.float64, device=DEVICE)
    wp.launch(_visit(columns), dim=1, inputs=[model, state, scratch, h, steps, int(opens), results], device=DEVICE)
    rows = scratch.numpy()[0, :, :links]
    return Outcome(
        closed=bool(results.numpy()[0]),
        closing=float(results.numpy()[1]),
        opening=float(results.numpy()[2]),
        position=rows[:3].T.copy(),
        velocity=rows[3:6].T.copy(),
        acceleration=rows[layout.STAGES : layout.STAGES + 3].T.copy(),
        friction=float(rows[layout.LOST_FRICTION].sum()),
    )
