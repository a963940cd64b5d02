"""The same chains in GPU kernels, on CPU fibers, and in CPU kernels."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import warp as wp
from numpy.testing import assert_allclose, assert_array_equal

from tests.support.arrays import Array
from tests.support.folded_chains import folded_chain
from tests.support.presets import SOFT
from tests.support.unlike_links import UnlikeLinks
from warpchain.chain.floor import Floor, floor_from
from warpchain.chain.keep import NOTHING, Keep
from warpchain.engine.batch import Batch
from warpchain.engine.world import Recorded
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.cpu import loop as cpu_loop
from warpchain.kernels.features import Features
from warpchain.kernels.gpu import loop as gpu_loop
from warpchain.status import Status

FIXED_STEP = 2.0**-19  # s, about 2 µs, exact in single precision
NEARLY = 1e-9
"""Share of the greatest value by which fibers may differ from a CPU after dozens of steps with impulses.

Both round the same algebra otherwise. A GPU carries openings C on from step to step, a CPU forms them anew as
differences of places x. In double precision that is 1e-16 x = 3e-18 m in these heaps, so a force k C of joints with
k = 1e7 N/m is known to 3e-11 N, and the velocity of a link of 10 g to h k δC / m = 6e-15 m/s in a step h of 2 µs.
Hundreds of impulses, which turn differences of places into others of velocities, multiply that.
"""
MIXED = 3e-6
"""Likewise in mixed precision, in which a force, of 1e3 N here, is known to 6e-8 of itself."""
HILLS = np.array([[-1.0, -0.002], [-0.02, 0.003], [0.0, -0.001], [0.015, 0.002], [0.03, -0.01], [1.0, -0.01]])
"""Points of a floor with corners of both kinds, which heaps cut."""


def floor_with(points: Array, parameters: Parameters | UnlikeLinks) -> Floor:
    """A profile all of whose faces have the coefficients of the parameters."""
    return floor_from(points.tolist(), 0.0, (parameters.floor_restitution, parameters.floor_friction))


def run_recorded(batch: Batch, features: Features) -> list[Recorded]:
    """Carry the first chain on until it stops: what each launch has recorded."""
    pieces = []
    while batch.worlds[0].status == Status.RUNNING:
        batch.launch([0], features)
        pieces.append(batch.worlds[0].drain())
    return pieces


@contextmanager
def fibers() -> Iterator[None]:
    """Blocks of more than one thread run as fibers on the CPU."""
    before = wp.config.enable_cpu_blocks
    wp.config.enable_cpu_blocks = True
    try:
        yield
    finally:
        wp.config.enable_cpu_blocks = before


def heap(links: int, seed: int = 3, *, tilt: float = 0.3, raised: float = 0.0) -> tuple[Array, Array]:
    """A folded chain in which many links touch one another, raised over the origin [m]; position and velocity (n, 3).

    In a flat heap, of a small `tilt` [rad], only joints an even number of links apart meet.
    """
    position, velocity = folded_chain(links, seed, SOFT.link_length, tilt=tilt, opening=1e-5)
    position[:, 1] += raised
    return position, velocity


def batch_of(
    chains: Sequence[tuple[Array, Array]],
    *,
    method: str,
    self_contact: bool = True,
    fixed_step: bool = True,
    stop_time: float = 1.0,
    tolerance: float = 1e-4,
    keeps: bool = False,
    precision: str = "double",
) -> Batch:
    """A batch with these chains (position, velocity), one a world, at soft parameters.

    With a fixed step all steps take FIXED_STEP: the tolerance refuses nothing and no skin lets a step be longer. It
    `keeps` samples, and a frame with loads at every second one.
    """
    longest = max(len(position) for position, _ in chains)
    tolerance = 0.1 if fixed_step else tolerance
    options = Options(method=method, tolerance=tolerance, self_contact=self_contact, precision=precision)
    keep = Keep(series_every=1, frame_every=2, loads=True) if keeps else NOTHING
    batch = Batch(len(chains), longest, options, keep, faces=len(HILLS) - 1)
    batch.control.launch_time = 1e9  # attempts alone end a launch, however busy the machine is
    if fixed_step:
        batch.control.skin = 1e-9
        batch.control.contact_step = FIXED_STEP
        batch.control.soft_contact_step = FIXED_STEP
    for world, (position, velocity) in enumerate(chains):
        batch.worlds[world].set_chain(SOFT, len(position))
        batch.worlds[world].load(position, velocity, stop_time=stop_time, stop_status=Status.FINISHED)
        batch.worlds[world].set_drive(sprocket_speed=-50.0)
        if fixed_step:
            batch.state.step.numpy()[world] = FIXED_STEP
    return batch


def launch_kernel(batch: Batch, kernel: wp.Kernel, worlds: Sequence[int], attempts: int, *, block_dim: int) -> None:
    """Carry worlds on by at most this many attempts each in a GPU kernel."""
    batch.control.attempts = attempts
    inputs = [wp.array(worlds, dtype=wp.int32, device="cpu"), batch.state]
    with fibers():
        wp.launch_tiled(kernel, dim=[len(worlds)], inputs=inputs, block_dim=block_dim, device="cpu")


def launch_blocks(batch: Batch, features: Features, attempts: int, *, block_dim: int) -> None:
    """Carry all worlds on in the GPU kernel that chains on a sprocket share with those on a floor."""
    worlds = range(len(batch.worlds))
    if features.fixed_body == "sprocket":
        features, worlds = replace(features, fixed_body="floor"), range(-1, -1 - len(batch.worlds), -1)
    shared = replace(features, has_drive=not features.tilts and features.fixed_body != "none")
    kernel = gpu_loop.make_advance_block(shared, block_dim)
    launch_kernel(batch, kernel, worlds, attempts, block_dim=block_dim)


def launch_chains(batch: Batch, features: Features, attempts: int) -> None:
    """Carry all worlds on in the CPU kernel for these features."""
    batch.control.attempts = attempts
    inputs = [wp.array(range(len(batch.worlds)), dtype=wp.int32, device="cpu"), batch.state]
    wp.launch(cpu_loop.make_advance(features), dim=(len(batch.worlds), 1), inputs=inputs, device="cpu")


def listed_pairs(batch: Batch, world: int = 0) -> set[tuple[int, int]]:
    """Pairs of joints in a world's neighbour list."""
    lists = list_layout(batch.columns)
    row = batch.lists.numpy()[world]
    count = int(row[lists.count])
    first, second = row[lists.first : lists.first + count], row[lists.second : lists.second + count]
    return set(zip(first.tolist(), second.tolist(), strict=True))


def assert_close(ours: Array, theirs: Array, share: float) -> None:
    """Numbers differ by at most a share of the greatest."""
    assert_allclose(ours, theirs, rtol=0, atol=share * np.abs(theirs).max(initial=0.0))


def assert_same(ours: Batch, theirs: Batch, share: float = NEARLY) -> None:
    """Clock, counters and all that a run decides agree exactly, states and energies to a share, extremes to 1e-6."""
    for name in ("time", "counts", "status", "softness", "load_factor", "stop_time"):
        assert_array_equal(getattr(ours.state, name).numpy(), getattr(theirs.state, name).numpy(), err_msg=name)
    for row in range(6):
        assert_close(ours.state.links.numpy()[:, row], theirs.state.links.numpy()[:, row], share)
    for name in ("watch", "first_area"):
        assert_close(getattr(ours.state, name).numpy(), getattr(theirs.state, name).numpy(), share)
    assert_allclose(ours.state.losses.numpy(), theirs.state.losses.numpy(), rtol=share, atol=1e-15)
    assert_allclose(ours.state.extremes.numpy(), theirs.state.extremes.numpy(), rtol=max(1e-6, share))
