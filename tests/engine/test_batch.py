"""Batches side by side, their memory, and the copies of their arrays on the host; what of it needs no GPU."""

import pytest

from tests.run.test_sweep_run import brief_setup, outcomes
from warpchain.chain.keep import Keep
from warpchain.engine.batch import Batch
from warpchain.engine.devices import Fibers
from warpchain.inputs.options import Options
from warpchain.walks import scheduler


def test_walks_do_not_depend_on_the_batches_they_are_spread_over() -> None:
    """Several batches, whose launches are over at later questions, give every walk as it is alone, to the bit."""
    brief: dict[str, object] = {"links": 12, "start": "ellipse", "device": "fibers", "walk_limit": 2e-3}
    setups = [brief_setup(seed, **brief) for seed in range(9)]
    setups += [brief_setup(seed, **brief | {"links": 20, "walk_limit": 1e-3}) for seed in range(2)]
    assert outcomes(setups, slots=6) == outcomes(setups, slots=1)


@pytest.mark.parametrize("keep", [Keep(), Keep(series_every=1, frame_every=2, loads=True)])
def test_a_gpu_carries_as_many_chains_as_fit(keep: Keep) -> None:
    """A batch knows what its arrays take, in proportion to its worlds; half of the free memory is enough for all."""
    taken = [Batch(worlds, 60, Options(method="dp5"), keep).bytes for worlds in (40, 80)]
    assert taken[1] == pytest.approx(2 * taken[0], rel=0.01)
    options = Options(method="dp5", device="fibers")
    worlds = scheduler.most_worlds(Batch(1, 60, options, keep))
    free = Fibers.free_memory
    assert 1 <= worlds and Batch(worlds, 60, options, keep).bytes <= free / 2


def test_a_gpu_that_is_nearly_full_carries_one_chain_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """However little memory is free, a walk is begun; twice the memory carries twice the chains."""
    options = Options(method="dp5", device="fibers")
    one = Batch(1, 60, options).bytes
    for free, worlds in ((0, 1), (7 * one, 3), (15 * one, 7)):
        monkeypatch.setattr(Fibers, "free_memory", free)
        assert scheduler.most_worlds(Batch(1, 60, options)) == worlds
