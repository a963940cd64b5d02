"""GPU kernels make the steps of CPU kernels.

They run on CPU fibers here. Both are compiled without fused products and sums, which compilers choose differently. Then
both do the same algebra on the same numbers, so that steps of the same size agree but for rounding, see :data:`NEARLY`,
including contacts resolved in parallel rounds: in every impulse, and in all that a run decides.
"""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from tests.support.blocks_under_test import (
    FIXED_STEP,
    HILLS,
    MIXED,
    NEARLY,
    SOFT,
    assert_close,
    assert_same,
    batch_of,
    floor_with,
    heap,
    launch_blocks,
    launch_chains,
)
from tests.support.unlike_links import unlike_links
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.engine.kernel_choice import most_registers
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.kernels.gpu import block_memory, increments
from warpchain.kernels.gpu.loop import make_advance_block
from warpchain.kernels.methods.method import find_method
from warpchain.status import Status

LINKS = 24
BLOCK = 32
"""Threads of a block. A kernel is compiled for their number, so tests share it."""
FAR = 1.0
"""Height [m] at which a flight meets no floor."""


pytestmark = pytest.mark.usefixtures("without_fused_operations")


@pytest.mark.parametrize(
    ("method", "fixed_body", "self_contact", "block_dim", "precision"),
    [
        ("bs32", "floor", False, BLOCK, "double"),
        pytest.param("rkf78", "floor", False, BLOCK, "double", marks=pytest.mark.thorough),
        ("os32", "sprocket", True, 2 * BLOCK, "double"),
        ("os32", "terrain", False, BLOCK, "mixed"),
        pytest.param("os32", "sprocket", True, 5 * LINKS, "mixed", marks=pytest.mark.thorough),
    ],
)
def test_fixed_steps_equal_a_cpu_kernel(
    method: str, fixed_body: str, self_contact: bool, block_dim: int, precision: str
) -> None:
    """Forty steps with dozens of impulses of every kind end in the same state, after the same impulses."""
    raised = 0.9 * SOFT.sprocket_radius if fixed_body == "sprocket" else 0.0
    chains = [heap(LINKS, 3, raised=raised), heap(min(40, block_dim), 18, tilt=np.pi, raised=raised)]
    ours, theirs = (batch_of(chains, method=method, self_contact=self_contact, precision=precision) for _ in range(2))
    for batch in (ours, theirs):
        for world in range(2):
            batch.worlds[world].set_floor(floor_with(HILLS, SOFT))
    features = ours.features(fixed_body=fixed_body)
    launch_blocks(ours, features, 40, block_dim=block_dim)
    launch_chains(theirs, features, 40)
    for counts in (world.counts for world in theirs.worlds):
        assert counts["accepted"] == 40
        assert counts["sprocket" if fixed_body == "sprocket" else "floor"] > 10
        assert (counts["self"] > 10) == self_contact
    assert (theirs.worlds[1].counts["strands"] > 0) == self_contact
    assert_same(ours, theirs, MIXED if precision == "mixed" else NEARLY)


@pytest.mark.parametrize("links", [LINKS, LINKS + 1])
def test_unlike_links_equal_a_cpu_kernel(links: int) -> None:
    """Forty steps of links and joints that all differ, in a heap on the floor, an odd number of them as well."""
    position, velocity = heap(links + links % 2)
    ours, theirs = (batch_of([(position[:links], velocity[:links])], method="os32") for _ in range(2))
    for batch in (ours, theirs):
        batch.worlds[0].set_chain(SOFT, links, own=unlike_links(links, SOFT).own)
    features = ours.features(fixed_body="floor")
    launch_blocks(ours, features, 40, block_dim=BLOCK)
    launch_chains(theirs, features, 40)
    assert theirs.worlds[0].counts["self"] > 10
    assert theirs.worlds[0].counts["floor"] > 10
    assert_same(ours, theirs)


@pytest.mark.parametrize("block_dim", [pytest.param(LINKS, marks=pytest.mark.thorough), 224])
def test_chains_too_long_for_shared_memory_equal_a_cpu_kernel(block_dim: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Long chains keep their board in the scratch, with the same result, even with more threads than columns."""
    monkeypatch.setattr(block_memory, "LARGEST_SHARED_BLOCK", LINKS - 1)
    make_advance_block.cache_clear()
    ours, theirs = (batch_of([heap(LINKS)], method="os32") for _ in range(2))
    features = ours.features(fixed_body="floor")
    launch_blocks(ours, features, 20, block_dim=block_dim)
    make_advance_block.cache_clear()
    launch_chains(theirs, features, 20)
    assert theirs.worlds[0].counts["self"] > 10
    assert theirs.worlds[0].counts["list_builds"] > 10
    assert_same(ours, theirs)


def test_free_flight_equals_a_cpu_kernel() -> None:
    """Adaptive steps of a chain that touches nothing: the same number of attempts, the same flight to the tolerance."""
    position, velocity = lay_chain(ellipse(1.5), LINKS, SOFT.link_length, 2.0, 0.1)
    position[:, 1] += FAR
    velocity[:, 2] += np.random.default_rng(1).normal(size=LINKS)
    ours, theirs = (batch_of([(position, velocity)], method="os32", fixed_step=False) for _ in range(2))
    features = ours.features(fixed_body="floor")
    launch_blocks(ours, features, 60, block_dim=BLOCK)
    launch_chains(theirs, features, 60)
    assert ours.worlds[0].counts == theirs.worlds[0].counts
    assert theirs.worlds[0].counts["rejected"] > 0
    assert ours.worlds[0].time == pytest.approx(theirs.worlds[0].time, rel=1e-5)
    assert np.allclose(ours.worlds[0].position, theirs.worlds[0].position, rtol=0, atol=1e-4)


def ends_of(batch: Batch) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities of the left and right ends of the first chain's links, (place or velocity, x or y, n)."""
    (x, y, theta), (u, v, omega) = batch.worlds[0].position.T, batch.worlds[0].velocity.T
    arm = SOFT.link_length / 2 * np.array([np.cos(theta), np.sin(theta)])
    centre, swing = np.array([[x, y], [u, v]]), np.array([arm, omega * np.array([-arm[1], arm[0]])])
    return centre - swing, centre + swing


def test_joints_carried_on_are_those_of_the_state() -> None:
    """Until joints are formed anew, in mixed precision, openings and their rates are those of the state to rounding.

    A step that changes the velocities of ends by Δv rounds rates of openings some four times, to 6e-8 Δv each.
    """
    position, velocity = lay_chain(ellipse(1.5), LINKS, SOFT.link_length, 2.0, 0.1)
    position[:, 1] += FAR
    batch = batch_of([(position, velocity)], method="os32", self_contact=False, fixed_step=False, precision="mixed")
    batch.worlds[0].set_floor(floor_with(HILLS, SOFT))
    features = batch.features(fixed_body="terrain")
    rounding = flown = 0.0
    while (steps := batch.worlds[0].counts["accepted"]) < increments.RENEWED - 1:
        before = ends_of(batch)
        launch_blocks(batch, features, 1, block_dim=BLOCK)
        left, right = ends_of(batch)
        if steps:
            rounding += 4 * 6e-8 * np.abs([left - before[0], right - before[1]])[:, 1].max()
            flown = batch.worlds[0].time
    kept = batch.scratch.numpy()[0, layout.MASS :].view(np.float32).reshape(-1)[: 4 * batch.columns]
    carried = kept.reshape(2, batch.columns, 2)[:, :LINKS].transpose(0, 2, 1)
    wrong = np.abs(carried - (np.roll(left, -1, axis=-1) - right)).max(axis=(1, 2))
    assert np.all(wrong > 0)
    assert wrong[1] < rounding
    assert wrong[0] < rounding * flown
    assert np.abs(carried[0]).max() > 1e4 * wrong[0]


def bounded_heaps(count: int) -> Batch:
    """Heaps on the floor, sampled often, their steps bounded by contacts; the first is not like the others."""
    chains = [heap(LINKS, 5)] + [heap(LINKS, 6)] * (count - 1)
    batch = batch_of(chains, method="os32", fixed_step=False, keeps=True, stop_time=40 * FIXED_STEP, tolerance=0.1)
    batch.control.contact_step = FIXED_STEP
    batch.control.sample_interval = 5 * FIXED_STEP
    batch.state.step.numpy()[:] = FIXED_STEP
    return batch


def test_samples_frames_and_rest_equal_a_cpu_kernel() -> None:
    """Time series, frames, loads, first and last sample are the CPU kernel's; rest is seen at the same one."""
    ours, theirs = bounded_heaps(2), bounded_heaps(2)
    for batch in (ours, theirs):
        batch.control.rest_speed, batch.control.rest_time = 100.0, 20 * FIXED_STEP
        batch.state.stop_status.numpy()[:] = int(Status.TIME_LIMIT)
    features = ours.features(fixed_body="floor")
    launch_blocks(ours, features, 100, block_dim=BLOCK)
    launch_chains(theirs, features, 100)
    assert theirs.worlds[0].status == Status.AT_REST
    assert_same(ours, theirs)
    for name in ("first_sample", "last_sample"):
        expected = getattr(theirs.state, name).numpy()
        assert_close(getattr(ours.state, name).numpy(), expected, NEARLY)
    recorded, expected = ours.worlds[1].drain(), theirs.worlds[1].drain()
    assert len(recorded.times) > 1 and recorded.loads.shape == (len(recorded.times), LINKS, 3)
    for our, their in zip(recorded, expected, strict=True):
        assert_close(our, their, NEARLY)


def test_frames_between_samples_equal_a_cpu_kernel() -> None:
    """Frames with marks of their own come at the same steps with the same loads as in a CPU kernel, however cut.

    The run is that without such marks, to the bit.
    """
    runs = []
    for launch, attempts in ((launch_blocks, 7), (launch_chains, 100), (launch_chains, 100)):
        batch = bounded_heaps(2)
        batch.control.frame_interval = 2.5 * FIXED_STEP
        batch.state.next_frame.numpy()[1] = 0 if len(runs) < 2 else -1
        features = batch.features(fixed_body="floor")
        while batch.worlds[1].status == Status.RUNNING:
            if launch is launch_blocks:
                launch_blocks(batch, features, attempts, block_dim=BLOCK)
            else:
                launch_chains(batch, features, attempts)
        runs.append(batch)
    ours, theirs, coarse = runs
    assert_same(ours, theirs)
    assert_same(theirs, coarse, 0.0)
    recorded, expected, few = (batch.worlds[1].drain() for batch in runs)
    assert np.array_equal(recorded.times, expected.times)
    assert_close(recorded.loads, expected.loads, NEARLY)
    assert_close(recorded.frames, expected.frames, NEARLY)
    marks = np.floor(recorded.times / (2.5 * FIXED_STEP) + 1e-9)
    assert len(few.times) < 6 and len(marks) > 12 and np.all(np.diff(marks) >= 1)


def test_failures_stop_one_chain_and_leave_the_others() -> None:
    """A chain with a NaN ends as not finite, one that may not shrink its step as too small; the others go on."""
    good = heap(LINKS, 5)
    broken = good[0], good[1].copy()
    broken[1][4, 2] = np.nan
    batch = batch_of([good, broken, good], method="os32", fixed_step=False)
    batch.control.contact_step = FIXED_STEP
    alone = batch_of([good], method="os32", fixed_step=False)
    alone.control.contact_step = FIXED_STEP
    features = batch.features(fixed_body="floor")
    for each in (batch, alone):
        launch_blocks(each, features, 10, block_dim=BLOCK)
    assert [batch.worlds[world].status for world in range(3)] == [Status.RUNNING, Status.NOT_FINITE, Status.RUNNING]
    for world in (0, 2):
        assert np.array_equal(batch.worlds[world].velocity, alone.worlds[0].velocity)

    limited = batch_of([good], method="os32", fixed_step=False)
    limited.control.step_limit = 4
    launch_blocks(limited, features, 10, block_dim=BLOCK)
    assert limited.worlds[0].status == Status.STEP_LIMIT
    counts = limited.worlds[0].counts
    assert counts["accepted"] + counts["rejected"] == 4

    stiff = batch_of([good], method="os32", fixed_step=False, tolerance=1e-13)
    stiff.control.smallest_step = 1e-8
    launch_blocks(stiff, features, 50, block_dim=BLOCK)
    assert stiff.worlds[0].status == Status.STEP_TOO_SMALL


def test_registers_of_every_block_fit_into_a_multiprocessor() -> None:
    """Warps of 32 threads go to four schedulers in turn, each of which has 16384 registers."""
    for warps in range(1, 33):
        busiest = len(range(0, warps, 4))
        registers = block_memory.available_registers(32 * warps)
        assert busiest * 32 * registers <= 16384 < busiest * 32 * (registers + 8)


SHARED_MEMORY = 163 * 1024
"""Bytes that a block can have on a GPU of the older generation."""


def compiles_for_gpus(folder: Path, features: Features, block_dim: int, *generations: int) -> None:
    """Compile a kernel to machine code of some GPU generations, which needs no GPU; the registers are the engine's."""
    module = make_advance_block(features, block_dim, most_registers(block_dim)).module
    module.options["block_dim"] = block_dim
    wp.compile_aot_module(module, arch=list(generations), module_dir=str(folder), use_ptx=False)
    assert len(list(folder.glob("*.cubin"))) == len(generations)
    assert 0 < shared_memory(folder) <= SHARED_MEMORY


def shared_memory(folder: Path) -> int:
    """Bytes of shared memory of a block of a compiled kernel."""
    sizes = [size for path in folder.glob("*.meta") for size in json.loads(path.read_text(encoding="utf-8")).values()]
    return int(max(sizes))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("fixed_body", "moves", "generations"),
    [("floor", False, (80, 90)), ("terrain", False, (80,)), ("floor", True, (90,))],
)
def test_a_kernel_compiles_for_gpus(tmp_path: Path, fixed_body: str, moves: bool, generations: tuple[int, ...]) -> None:
    """That of usual walks compiles for older and newer GPUs, and so do those of a profile and of a moving sprocket."""
    kind = {"moving_sprocket": moves, "has_drive": not moves, "is_mixed": moves}
    features = Features("os32", layout.padded_width(60), fixed_body, True, **kind)
    compiles_for_gpus(tmp_path, features, 64, *generations)


def attempt_loop(ptx: str) -> list[str]:
    """Instructions of the innermost loop with barriers: that over attempts.

    A loop ends in a branch to an earlier label.
    """
    lines = [line.strip() for line in ptx[ptx.index(".entry") :].splitlines()]
    labels = {line[:-1]: place for place, line in enumerate(lines) if line.endswith(":")}
    branches = [(place, re.match(r"(?:@!?%p\d+\s+)?bra(?:\.uni)?\s+(\S+);", line)) for place, line in enumerate(lines)]
    loops = [lines[labels[match[1]] : place + 1] for place, match in branches if match and labels[match[1]] < place]
    loop = min((loop for loop in loops if any(line.startswith("bar.sync") for line in loop)), key=len)
    instructions = [re.sub(r"^@!?%p\d+\s+", "", line) for line in loop]
    return [line for line in instructions if line.endswith(";") and not line.startswith("mov")]


def test_attempts_in_mixed_precision_hardly_use_double_precision(tmp_path: Path) -> None:
    """An attempt has a barrier a stage and one for the error; at most a twentieth of its work is in double precision.

    That is what the new state takes. Conversions between the state and its increments are counted apart. The kernel is
    that of usual walks, and its block fits into the shared memory of older GPUs.
    """
    features = Features("os32", layout.padded_width(60), "floor", True, has_drive=True, is_mixed=True)
    module = make_advance_block(features, 64, most_registers(64)).module
    module.options["block_dim"] = 64
    wp.compile_aot_module(module, arch=90, module_dir=str(tmp_path), use_ptx=True)
    assert 0 < shared_memory(tmp_path) <= SHARED_MEMORY
    (path,) = tmp_path.glob("*.ptx")
    loop = attempt_loop(path.read_text(encoding="utf-8", errors="replace"))
    assert sum(line.startswith("bar.sync") for line in loop) == len(find_method("os32").tableau.matrix)
    operations = [line.split()[0] for line in loop]
    double = [name for name in operations if ".f64" in name and not name.startswith(("ld.", "st.", "selp"))]
    conversions = [name for name in double if name.startswith("cvt")]
    assert len(double) - len(conversions) <= 0.05 * len(operations)
    assert len(conversions) <= 30
