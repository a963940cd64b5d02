"""Chains whose plane tilts, in the CPU kernels: runs through `Batch`, and single passes over the floor's contacts."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import warp as wp

from tests.oracle_model.tilting_plane import Plane
from tests.support.arrays import Array
from tests.support.kernels_under_test import DEVICE, chain_on_cpu, compiled, poisoned
from warpchain.chain.keep import NOTHING, Keep
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.kernels import layout
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.cpu.loop import load_state
from warpchain.kernels.cpu.placing import place_ends
from warpchain.kernels.cpu.tilting import resolve_tilting_floor, tilting_gap, write_plane_sums
from warpchain.kernels.physics.plane import on_plane
from warpchain.kernels.types import Ground, Worlds
from warpchain.status import Status

Start = tuple[Array, Array, Plane]
"""Position (n, 3), velocity (n, 3) and plane."""


def row_of(plane: Plane) -> Array:
    """A plane as `World.set_plane` takes it, (12,)."""
    return np.array([plane.speed, *plane.turn, *plane.x, *plane.y, *plane.origin])


def plane_of(row: Array) -> Plane:
    """A plane from what `World.plane` gives, (12,)."""
    return Plane(float(row[0]), row[1:3].copy(), row[3:6].copy(), row[6:9].copy(), row[9:12].copy())


def tilting_batch(
    starts: Sequence[Start],
    parameters: Sequence[Parameters],
    options: Options,
    stop_time: float,
    *,
    longest_step: float | None = None,
    stop_status: Status = Status.FINISHED,
    keep: Keep = NOTHING,
) -> Batch:
    """A batch of chains of equal length, about to start.

    No step is longer than `longest_step` [s]; all are that long if the tolerance allows more. It needs contacts, among
    links or with the floor, in the kernel's features. A run that stops as `FINISHED` does not end at rest before.
    """
    links = len(starts[0][0])
    batch = Batch(len(starts), links, options, keep, tilts=True)
    if longest_step is not None:
        batch.control.skin, batch.control.contact_step = 1e-9, longest_step
    for world, ((position, velocity, plane), chain) in enumerate(zip(starts, parameters, strict=True)):
        batch.worlds[world].set_chain(chain, links)
        batch.worlds[world].load(position, velocity, stop_time=stop_time, stop_status=stop_status)
        if longest_step is not None:
            batch.state.step.numpy()[world] = longest_step
        batch.worlds[world].set_plane(row_of(plane))
    return batch


def end_of(batch: Batch, world: int = 0) -> Start:
    """Where a run has left a chain."""
    return batch.worlds[world].position, batch.worlds[world].velocity, plane_of(batch.worlds[world].plane)


def fly(
    start: Start,
    parameters: Parameters,
    duration: float,
    *,
    method: str = "dp5",
    tolerance: float = 1e-9,
    longest_step: float | None = None,
) -> Batch:
    """A flight [s], in double precision, that must reach its end without contacts; the batch afterwards.

    Steps are as in `tilting_batch`.
    """
    options = Options(method=method, tolerance=tolerance, precision="double")
    batch = tilting_batch([start], [parameters], options, duration, longest_step=longest_step)
    batch.run([0], batch.features(fixed_body="floor", tilts=True))
    assert batch.worlds[0].status == Status.FINISHED
    assert batch.worlds[0].counts["self"] == batch.worlds[0].counts["floor"] == 0
    return batch


class FloorOutcome(NamedTuple):
    """Velocity (n, 3), the plane's rates (3,), energy booked [J], number of impulses, height of the lowest rim [m]."""

    velocity: Array
    rates: Array
    loss: float
    impulses: int
    gap: float


@functools.cache
def _floor_pass(columns: int) -> wp.Kernel:
    @compiled
    def floor_pass(
        worlds: Worlds,
        scratch: wp.array3d(dtype=wp.float64),
        planes: wp.array2d(dtype=wp.float64),
        push_rate: wp.float64,
        results: wp.array(dtype=wp.float64),
    ):
        chain = worlds.model.chains[0]
        chain.push_rate = push_rate
        block = scratch[0]
        row = planes[0]
        load_state(block, chain, worlds, 0)
        place_ends(block, chain)
        write_plane_sums(block, row, chain)
        results[0] = tilting_gap(block, on_plane(chain, row, 0), Ground(), Face())
        results[1] = wp.float64(resolve_tilting_floor(block, row, chain, Ground(), Face()))

    return floor_pass


def floor_pass(
    position: Array, velocity: Array, plane: Plane, parameters: Parameters, push_rate: float = 0.0
) -> FloorOutcome:
    """One pass over all rollers at the floor, in memory poisoned with NaN; the plane's width is that of parameters."""
    links = len(position)
    columns = layout.padded_width(links)
    worlds = chain_on_cpu(position, velocity, parameters)
    scratch = poisoned(1, layout.SCRATCH_ROWS, columns)
    values = np.full((1, layout.PLANE_ROWS), np.nan)
    values[0, : layout.PLANE_VALUES] = row_of(plane)
    planes = wp.array(values, dtype=wp.float64, device=DEVICE)
    results = poisoned(2)
    wp.launch(_floor_pass(columns), dim=1, inputs=[worlds, scratch, planes, push_rate, results], device=DEVICE)
    rows = scratch.numpy()[0, :, :links]
    return FloorOutcome(
        velocity=rows[[layout.U, layout.V, layout.OMEGA]].T.copy(),
        rates=planes.numpy()[0, :3].copy(),
        loss=float(rows[layout.LOST_FIXED].sum()),
        impulses=int(results.numpy()[1]),
        gap=float(results.numpy()[0]),
    )
