"""Batches side by side, their memory, and the copies of their arrays on the host; what of it needs no GPU."""

from collections.abc import Sequence

import pytest
import warp as wp

from tests.run.test_sweep_run import brief_setup, outcomes
from warpchain.engine.batch import Batch
from warpchain.engine.devices import start_device
from warpchain.engine.memory import CAPACITY_FRAMES, CAPACITY_SAMPLES, world_bytes
from warpchain.inputs.options import Options
from warpchain.walks import scheduler


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
