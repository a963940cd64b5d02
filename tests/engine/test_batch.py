"""Batches side by side, their memory, and the copies of their arrays on the host; what of it needs no GPU."""

import itertools
import threading
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp

from tests.run.test_sweep_run import brief_setup, outcome, outcomes
from warpchain.cli.terminal import sweep_progress_text
from warpchain.engine.batch import Batch
from warpchain.engine.devices import Device, Fibers, start_device
from warpchain.engine.kernel_choice import (
    block_threads,
    most_registers,
    resident_blocks,
    shared_threads,
)
from warpchain.engine.memory import CAPACITY_FRAMES, CAPACITY_SAMPLES, world_bytes
from warpchain.engine.mirror import Mirror
from warpchain.inputs.options import Options
from warpchain.inputs.setup import Setup
from warpchain.kernels.features import Features
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.sweep_run import prepare, sweep
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.walks import scheduler
from warpchain.walks.motion import Keep
from warpchain.walks.walk_phases import WalkRun

FEW = {"version": 1, "name": "few", "seed": 1, "preset": "soft", "samples": 2, "grid": {"links": [60, 150]}}
"""Content of a sweep of two lengths."""


def test_a_mirror_carries_edits_and_changes() -> None:
    """Edits reach the device with the next upload, and changes made there the host with the next download."""
    device = start_device("fibers")
    assert isinstance(device, Fibers)
    stream = device.stream()
    mirror = Mirror(np.arange(4.0), device, stream)
    mirror.edit()[1] = 7.0
    mirror.upload()
    assert mirror.array.numpy().tolist() == [0.0, 1.0, 2.0, 3.0], "the copy waits in its stream"
    device.wait(stream.record_event())
    assert mirror.array.numpy().tolist() == [0.0, 7.0, 2.0, 3.0]
    mirror.array.fill_(5.0)
    mirror.upload()
    device.wait(stream.record_event())
    assert mirror.array.numpy().tolist() == [5.0] * 4, "nothing was edited since"
    mirror.download()
    assert mirror.view().tolist() == [0.0, 7.0, 2.0, 3.0]
    device.wait(stream.record_event())
    assert mirror.view().tolist() == [5.0] * 4


class SlowBatch(Batch):
    """A batch whose launches are over only when they have been asked for a while, as on a GPU."""

    asked = 0

    def is_done(self) -> bool:
        """At the third question."""
        self.asked += 1
        return self.asked % 3 == 0


def several_batches(options: Options, links: Sequence[int], *_: object) -> tuple[list[Batch], int]:
    """As many as a GPU gets, one larger than the others."""
    return [SlowBatch(worlds, max(links), options) for worlds in (1, 3, 1, 1)], 6


def test_walks_do_not_depend_on_the_batches_they_are_spread_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """With several batches, which end their launches in any order, every walk is what it is alone, to the bit."""
    setups = [brief_setup(seed) for seed in range(9)] + [
        brief_setup(seed, links=44, start="spinning", hold_limit=0.05) for seed in range(2)
    ]
    alone = outcomes(setups, slots=1)
    monkeypatch.setattr(scheduler, "_batches", several_batches)
    assert outcomes(setups) == alone


def test_groups_follow_one_another_without_a_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """The walks of the next group begin when the first of the last ones of a group is over, and not before."""
    tolerances = (1e-6, 2e-6, 5e-6)  # walks with other options are another group
    setups = [brief_setup(seed, tolerance=tolerance) for tolerance in tolerances for seed in range(7)]
    alone = outcomes(setups, slots=1)
    events: list[tuple[str, float]] = []

    class NotedRun(WalkRun):
        """A run that notes when it begins."""

        def __init__(self, batch: Batch, world: int, setup: Setup, keep: Keep) -> None:
            """As its parent does."""
            super().__init__(batch, world, setup, keep)
            events.append(("begins", setup.options.tolerance))

    monkeypatch.setattr(scheduler, "_batches", several_batches)  # six at a time
    monkeypatch.setattr(scheduler, "WalkRun", NotedRun)
    found = {}
    for place, run in scheduler.run_setups(setups):
        found[place] = outcome(run)
        events.append(("ends", run.setup.options.tolerance))
    assert [found[place] for place in range(len(setups))] == alone
    for group, following in itertools.pairwise(tolerances):
        before = events[: events.index(("begins", following))]
        assert before.count(("begins", group)) == 7, "none of the former group waits any more"
        assert 2 <= before.count(("ends", group)) < 7, "some of it are over, some are under way"


@pytest.mark.parametrize("threads", [32, 64, 96, 128, 160, 192, 224, 256, 512, 1024])
def test_resident_blocks_are_those_whose_registers_fit(threads: int) -> None:
    """A multiprocessor has 65,536 registers; one block more would not fit, and one always does."""
    blocks, registers = resident_blocks(threads), most_registers(threads) * threads
    assert blocks >= 1
    assert blocks == 1 or blocks * registers <= 65536
    assert (blocks + 1) * registers > 65536


def test_a_stop_ends_all_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once stopped, no further walk is begun, and every launch has been waited for."""
    made: list[Batch] = []
    finished: list[Batch] = []

    def noted_batches(*how: Any) -> tuple[list[Batch], int]:
        batches, capacity = several_batches(*how)
        made.extend(batches)
        return batches, capacity

    monkeypatch.setattr(scheduler, "_batches", noted_batches)
    monkeypatch.setattr(SlowBatch, "finish", lambda batch: finished.append(batch))
    stop = threading.Event()
    over = []
    for place, _ in scheduler.run_setups([brief_setup(seed) for seed in range(30)], stop=stop):
        over.append(place)
        stop.set()
    assert 0 < len(over) < 10
    assert len(made) == 4
    assert set(finished[-4:]) == set(made)


@pytest.mark.parametrize(("keeps_samples", "frame_every"), [(False, None), (True, 2)])
def test_memory_of_a_world_is_what_a_batch_takes(keeps_samples: bool, frame_every: int | None) -> None:
    """What is planned for a world is what the arrays of a batch take for it, and at most 1 % more."""
    options, device = Options(method="dp5"), start_device("cpu")

    def taken(worlds: int) -> int:
        batch = Batch(worlds, 60, options, keeps_samples=keeps_samples, frame_every=frame_every)
        parts = [batch.model, batch.drive, batch.state, batch.record]
        arrays = [getattr(part, name) for part in parts for name in part._cls.vars]
        return sum(array.capacity for array in [*arrays, batch.scratch, batch.lists] if isinstance(array, wp.array))

    samples, frames = CAPACITY_SAMPLES * keeps_samples, CAPACITY_FRAMES * (frame_every is not None)
    planned = world_bytes(60, options, samples, frames, device)
    assert 0.99 * planned <= (taken(80) - taken(40)) / 40 <= planned


def test_a_block_has_a_thread_for_each_link() -> None:
    """Threads come in whole warps of 32, and chains of equal blocks share a kernel."""
    assert [block_threads(n) for n in (4, 32, 60, 64, 66, 180)] == [32, 32, 64, 64, 96, 192]


def test_few_walks_of_several_lengths_share_a_kernel() -> None:
    """The longest chain's block serves all; many walks, and methods whose sums depend on the block, have their own."""
    assert shared_threads("os32", [60, 90, 180], 504) == 192
    assert shared_threads("os32", [60, 90], 504) == 96
    assert shared_threads("os32", [60, 64], 504) is None
    assert shared_threads("os32", [60, 90, 180], 20_000) is None
    assert shared_threads("os32", [60, 240], 504) is None
    assert shared_threads("hybrid", [60, 90, 180], 504) is None


def test_kernels_of_a_sweep_are_those_that_its_walks_ask_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is compiled beforehand for few walks on a GPU is one kernel for the drive and one for the walk."""
    loaded: set[tuple[str, str, int]] = set()

    def note(wanted: Iterable[tuple[Device, Features, int]]) -> None:
        loaded.update((features.method, features.fixed_body, threads) for _, features, threads in wanted)

    monkeypatch.setattr(scheduler, "load_kernels", note)
    monkeypatch.setattr(scheduler, "start_device", lambda _: None)
    prepare(load_sweep(FEW | {"options": {"device": "cuda"}}))
    assert loaded == {("os32", "floor", 160), ("os32", "sprocket", 160)}
    loaded.clear()
    prepare(load_sweep(FEW | {"samples": 2000, "options": {"device": "cuda"}}))
    assert loaded == {("os32", body, threads) for body in ("floor", "sprocket") for threads in (64, 160)}


def test_tasks_of_a_sweep_run_in_the_blocks_that_are_compiled(tmp_path: Path) -> None:
    """A task that has chains of one length only runs in blocks of the whole sweep; on a CPU there are none."""
    asked: list[tuple[set[int], int | None]] = []

    class Executor:
        """Notes the first task and does none."""

        def submit(
            self, function: object, planned: Sweep, digest: str, folder: str, shards: Sequence[range], *how: Any
        ) -> Any:
            asked.append(({planned.planned(index).setup.scene.links for shard in shards for index in shard}, how[0]))
            raise InterruptedError

    for device, samples in (("cuda", 2), ("cuda", 2000), ("cpu", 2)):
        content = FEW | {"samples": samples, "options": {"device": device, "method": "explicit"}}
        with pytest.raises(InterruptedError):
            sweep(content, tmp_path / f"{device}{samples}", executor=Executor(), workers=4)
    assert asked == [({60}, 160), ({60, 150}, None), ({60}, None)]


def test_progress_says_when_kernels_are_compiled() -> None:
    """The line on the terminal speaks of compiling, then of walks."""
    progress = SweepProgress(walks=10, done=0, before=0, compiling=True)
    assert "compiling" in sweep_progress_text(progress)
    progress.compiling = False
    assert "0 of 10 walks" in sweep_progress_text(progress)
