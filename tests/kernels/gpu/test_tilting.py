"""A chain whose plane tilts: GPU kernels against CPU kernels, and in any cut."""

from pathlib import Path

import numpy as np
import pytest

from tests.kernels.gpu.test_same_as_cpu import compiles_for_gpus
from tests.support.blocks_under_test import FIXED_STEP, SOFT, launch_blocks, launch_chains
from warpchain.chain.keep import Keep
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.status import Status

LINKS = (20, 38)


pytestmark = pytest.mark.usefixtures("without_fused_operations")


def falling_batch(fixed_step: float | None = None) -> Batch:
    """Two circulating loops in planes that lean and turn, which have sunk into the floor a little."""
    tolerance = 1e-5 if fixed_step is None else 0.1
    options = Options(method="os32", tolerance=tolerance, precision="double")
    batch = Batch(2, max(LINKS), options, keep=Keep(series_every=1, frame_every=1), tilts=True)
    batch.control.launch_time = 1e9
    if fixed_step is not None:
        batch.control.skin, batch.control.contact_step = 1e-9, fixed_step
    for world, links in enumerate(LINKS):
        position, velocity = lay_chain(ellipse(1.0), links, SOFT.link_length, 3.0)
        position[:, 1] += links * SOFT.link_length / (2 * np.pi) + SOFT.circle_radius - 0.004
        batch.worlds[world].set_chain(SOFT, links)
        batch.worlds[world].load(position, velocity, stop_time=0.05, stop_status=Status.TIME_LIMIT)
        tilt = 0.05 * (1 + world)
        if fixed_step is not None:
            batch.state.step.numpy()[world] = fixed_step
        batch.worlds[world].set_plane(
            np.array([0.2, -1.0, 0.5, 1, 0, 0, 0, np.cos(tilt), np.sin(tilt), 0, 0.001 + SOFT.half_width * tilt, 0]),
        )
    return batch


def features_of(batch: Batch) -> Features:
    """Those of a walk whose plane tilts."""
    return batch.features(fixed_body="floor", tilts=True)


def test_a_gpu_kernel_tilts_as_a_cpu_kernel_does() -> None:
    """Through first impulses both find the same links and planes, but for the order in which sums are added up."""
    one, other = (falling_batch(FIXED_STEP) for _ in range(2))
    launch_chains(one, features_of(one), 60)
    launch_blocks(other, features_of(other), 60, block_dim=64)
    for world in range(2):
        assert one.worlds[world].counts == other.worlds[world].counts
        assert one.worlds[world].counts["floor"] > 0
        assert one.worlds[world].time == pytest.approx(other.worlds[world].time, rel=1e-12)
        np.testing.assert_allclose(one.worlds[world].position, other.worlds[world].position, rtol=0, atol=1e-11)
        np.testing.assert_allclose(one.worlds[world].velocity, other.worlds[world].velocity, rtol=0, atol=1e-7)
        np.testing.assert_allclose(one.worlds[world].plane, other.worlds[world].plane, rtol=0, atol=1e-10)
        np.testing.assert_allclose(
            one.worlds[world].drain().samples, other.worlds[world].drain().samples, rtol=1e-8, atol=1e-9
        )
        losses = (list(batch.worlds[world].losses.values()) for batch in (one, other))
        np.testing.assert_allclose(*losses, rtol=1e-7, atol=1e-12)


def test_cuts_change_no_bit() -> None:
    """A run of a tilting chain does not depend on how it is cut into launches."""
    results = []
    for attempts in (90, 7):
        batch = falling_batch()
        while left := min(attempts, 90 - sum(map(batch.worlds[1].counts.get, ("accepted", "rejected")))):
            launch_blocks(batch, features_of(batch), left, block_dim=64)
        results.append(
            (batch.worlds[1].position, batch.worlds[1].velocity, batch.worlds[1].plane, batch.worlds[1].drain().samples)
        )
    for one, other in zip(*results, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.thorough
def test_it_compiles_for_gpus(tmp_path: Path) -> None:
    """The kernel of a tilting walk compiles for the newer GPUs."""
    compiles_for_gpus(
        tmp_path, Features("os32", layout.padded_width(60), "floor", True, tilts=True, is_mixed=True), 64, 90
    )
