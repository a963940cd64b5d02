"""GPU kernels soften, stiffen and load a chain in the same steps as CPU kernels, and end in the same states."""

import numpy as np
import pytest

from tests.support.blocks_under_test import (
    FIXED_STEP,
    NEARLY,
    assert_close,
    assert_same,
    batch_of,
    heap,
    launch_blocks,
    launch_chains,
)
from tests.support.presets import SOFT
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.kernels import layout
from warpchain.status import Status

LINKS, BLOCK = 12, 32


pytestmark = pytest.mark.usefixtures("without_fused_operations")


def soften_much(batch: Batch) -> Batch:
    """A batch of soft chains with soft and softest joints that are softer still, and steps to tell them apart by."""
    control = batch.control
    control.soft_stiffness, control.soft_damping, control.soft_smoothing = 1e6, 10.0, 1.0
    control.softest_stiffness, control.softest_damping = 1e5, 3.0
    control.soft_contact_step = 2 * FIXED_STEP
    return batch


def heaps(area: float) -> Batch:
    """Heaps on the floor that soften below a fraction of their first area, in fixed steps with frequent samples."""
    batch = batch_of([heap(LINKS, 5, tilt=2.0), heap(LINKS, 10, tilt=2.0)], method="os32", keeps=True)
    batch.control.sample_interval = 5 * FIXED_STEP
    batch.control.soften_area = area
    return soften_much(batch)


def released() -> Batch:
    """A ring above the floor, just released with soft joints."""
    batch = batch_of([lay_chain(ellipse(1.0), LINKS, SOFT.link_length, 2.0)], method="os32", keeps=True)
    batch.control.sample_interval = 4 * FIXED_STEP
    batch.control.stiffening_time = 40 * FIXED_STEP
    batch.control.soften_area = -np.inf
    batch.worlds[0].set_drive(hold_softness=1.25)
    batch.state.softness.numpy()[0] = 1.25
    return soften_much(batch)


def driven(load_factor: float) -> Batch:
    """A heap on a sprocket that begins to turn after 12 steps; the hold begins after 70, loads fall from step 90 on.

    Without multiplied loads windows of 12 steps end; it may be released at the end of the second, and is then held on.
    """
    raised = 0.9 * SOFT.sprocket_radius
    batch = batch_of([heap(LINKS, 3, raised=raised)], method="os32", keeps=True)
    batch.control.sample_interval = 4 * FIXED_STEP
    batch.control.stiffening_time = 30 * FIXED_STEP
    times = {"spin_up_start": 12 * FIXED_STEP, "spin_up_time": 58 * FIXED_STEP, "hold_start": 70 * FIXED_STEP}
    batch.worlds[0].set_drive(
        **times, loop_speed=3.0, loop_period=12 * FIXED_STEP, load_factor=load_factor, push_rate=1e4
    )
    batch.worlds[0].set_drive(steady_window=12 * FIXED_STEP, steady_time=-1.0, steady_tolerance=1.0, extra_hold=1.0)
    batch.worlds[0].set_drive(hold_softness=1.25, loaded_softness=1.1)
    if load_factor > 1:
        batch.state.watch.numpy()[0, layout.UNLOADED_SINCE] = 90 * FIXED_STEP
    batch.state.softness.numpy()[0] = 1.25
    batch.state.stop_status.numpy()[0] = Status.NOT_STEADY
    return soften_much(batch)


def assert_same_samples(ours: Batch, theirs: Batch) -> None:
    """States, moments and samples agree."""
    assert_same(ours, theirs)
    for world in range(len(ours.worlds)):
        assert_close(ours.worlds[world].drain().samples, theirs.worlds[world].drain().samples, NEARLY)


def launch_both(ours: Batch, theirs: Batch, fixed_body: str, launches: int, block_dim: int = BLOCK) -> None:
    """Make seven attempts a launch in the GPU kernel, and as many all at once in the CPU kernel."""
    features = ours.features(fixed_body=fixed_body)
    for _ in range(launches):
        launch_blocks(ours, features, 7, block_dim=block_dim)
    launch_chains(theirs, features, 7 * launches)


@pytest.mark.parametrize(("area", "softness"), [(0.9975, 1.0), (1.995, 2.0)])
def test_a_gpu_kernel_softens_a_pile_as_a_cpu_kernel_does(area: float, softness: float) -> None:
    """The GPU kernel softens at the same samples, frees the same energy, and ends in the same state, however cut."""
    ours, theirs = heaps(area), heaps(area)
    launch_both(ours, theirs, "floor", 9)
    first, second = (theirs.worlds[world].watched(layout.SOFTENED_AT) for world in range(2))
    assert 0 < first <= second < theirs.worlds[0].time
    assert theirs.state.softness.numpy().tolist() == [softness, softness]
    assert np.all(theirs.state.losses.numpy()[:, layout.LOSS_SOFTENING] > 0)
    assert all(
        theirs.worlds[world].watched(layout.SELF_CONTACT_AT) > 0 for world in range(2)
    )  # its bits are compared, too
    assert_same_samples(ours, theirs)


def test_a_gpu_kernel_stiffens_as_a_cpu_kernel_does() -> None:
    """The GPU kernel returns joints to their own values in the same steps, however cut into launches."""
    ours, theirs = released(), released()
    launch_both(ours, theirs, "floor", 9)
    assert theirs.state.softness.numpy()[0] == 0.0
    assert theirs.state.losses.numpy()[0, layout.LOSS_SOFTENING] < 0
    assert_same_samples(ours, theirs)


@pytest.mark.parametrize("load_factor", [15.0, 1.0])
def test_a_gpu_kernel_drives_under_load_as_a_cpu_kernel_does(load_factor: float) -> None:
    """In the GPU kernel loads and softness change in the same steps of the drive, however cut: on, falling, off."""
    ours, theirs = driven(load_factor), driven(load_factor)
    launch_both(ours, theirs, "sprocket", 12, block_dim=2 * BLOCK)
    assert theirs.worlds[0].counts["sprocket"] > 10
    load, softness = theirs.state.load_factor.numpy()[0], theirs.state.softness.numpy()[0]
    if load_factor > 1:
        assert 1 < load < 15 and 1.1 < softness < 1.25
    else:
        assert load == 1 and softness == 1.25
        assert theirs.state.watch.numpy()[0, layout.DRIFT] > 0  # a window of the free loop has ended
    assert theirs.worlds[0].counts["accepted"] < theirs.worlds[0].time / (1.1 * FIXED_STEP)
    assert_same_samples(ours, theirs)
