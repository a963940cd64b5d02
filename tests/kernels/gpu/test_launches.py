"""The results of a GPU kernel depend neither on how a run is cut into launches nor on the order of threads.

Fibers take their turns in the order of their numbers, from barrier to barrier, so that what the first notes for all is
there for the others even where a barrier is missing. With the links given to them the other way round it is not.
"""

import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from tests.support.blocks_under_test import FIXED_STEP, SOFT, batch_of, heap, launch_kernel, listed_pairs
from warpchain.engine.batch import Batch
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.kernels.gpu import loop
from warpchain.kernels.gpu.loop import make_advance_block
from warpchain.kernels.types import State
from warpchain.status import Status

LINKS, BLOCK = 24, 32

pytestmark = pytest.mark.usefixtures("without_fused_operations")  # whose kernels other tests share


def piles() -> Batch:
    """Two heaps on the floor whose joints soften half-way; the first has longer links than the second."""
    chains = [heap(LINKS, seed, tilt=2.0) for seed in (5, 9)]
    batch = batch_of(chains, method="os32", fixed_step=False, keeps=True, stop_time=100 * FIXED_STEP)
    batch.control.contact_step = FIXED_STEP
    batch.control.sample_interval = 5 * FIXED_STEP
    batch.control.skin = 1e-4
    batch.control.soften_area = 0.998
    batch.control.soft_stiffness, batch.control.soft_damping, batch.control.soft_smoothing = 1e6, 10.0, 1.0
    batch.control.pile_push = 20.0  # circles of these heaps overlap by millimetres
    batch.worlds[0].set_chain(SOFT.with_values({"link_length": SOFT.link_length * (1 + 1e-4)}), LINKS)
    batch.state.step.numpy()[:] = FIXED_STEP
    return batch


def everything(batch: Batch, world: int) -> dict[str, NDArray[np.generic]]:
    """All that is kept of a world: its state, what its board leaves, its list and its time series."""
    found = {name: getattr(batch.state, name).numpy()[world].copy() for name in State.vars}
    found["board"] = batch.scratch.numpy()[world, layout.BOARD_LOST_SELF : layout.BOARD_VALUES, :LINKS].copy()
    found["pairs"] = np.array(sorted(listed_pairs(batch, world)))
    found["samples"] = batch.worlds[world].drain().samples
    return found


def run(factory: Callable[[Features, int], wp.Kernel], attempts: int) -> list[dict[str, NDArray[np.generic]]]:
    """Both piles to their end, in launches of so many attempts."""
    batch = piles()
    kernel = factory(batch.features(fixed_body="floor"), BLOCK)
    while batch.worlds[0].status == Status.RUNNING or batch.worlds[1].status == Status.RUNNING:
        launch_kernel(batch, kernel, [0, 1], attempts, block_dim=BLOCK)
    return [everything(batch, world) for world in (0, 1)]


def assert_same(ours: list[dict[str, NDArray[np.generic]]], theirs: list[dict[str, NDArray[np.generic]]]) -> None:
    """All numbers agree to the bit."""
    for our, their in zip(ours, theirs, strict=True):
        assert our.keys() == their.keys()
        for name in our:
            assert np.array_equal(our[name], their[name]), name


def test_cuts_change_no_number() -> None:
    """Launches of one, seven or all attempts end in the same numbers, every counter, list and clock included."""
    whole = run(make_advance_block, 10**6)
    for world in whole:
        assert world["status"] == Status.FINISHED
        assert world["counts"][layout.SELF_IMPULSES] > 10
        assert 3 < world["counts"][layout.LIST_BUILDS] < world["counts"][layout.ACCEPTED] / 3
        assert 0 < world["watch"][layout.SOFTENED_AT] < world["time"]
    for attempts in (1, 7):
        assert_same(run(make_advance_block, attempts), whole)
    alone = piles()
    launch_kernel(alone, make_advance_block(alone.features(fixed_body="floor"), BLOCK), [1], 10**6, block_dim=BLOCK)
    assert_same([everything(alone, 1)], whole[1:])


@pytest.fixture
def reversed_factory(tmp_path: Path) -> Iterator[Callable[[Features, int], wp.Kernel]]:
    """The GPU kernel with the last link in the first thread."""
    source = Path(loop.__file__).read_text(encoding="utf-8")
    numbered = "        block, lane = wp.tid()\n"
    assert source.count(numbered) == 1
    turned = "        block, thread = wp.tid()\n        lane = wp.static(block_dim - 1) - thread\n"
    path = tmp_path / "loop_reversed.py"
    path.write_text(source.replace(numbered, turned), encoding="utf-8")
    name = "warpchain.kernels.gpu.loop_reversed"
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    module.COMPILER_FLAGS = loop.COMPILER_FLAGS
    yield module.make_advance_block
    del sys.modules[name]


def test_the_order_of_threads_changes_no_number(reversed_factory: Callable[[Features, int], wp.Kernel]) -> None:
    """No thread reads what another writes for it before a barrier has passed."""
    assert_same(run(reversed_factory, 25), run(make_advance_block, 25))
