"""Chains that are timed: that they do what is measured, and nothing else is measured."""

from dataclasses import replace

import numpy as np
import pytest

from warpchain.bench.chain_timer import LONGEST_STRETCH, SETTLING_ATTEMPTS, ChainTimer, Stretch, together
from warpchain.bench.cpu_steps import step_cost
from warpchain.bench.starts import flying
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset

PAPER = preset("paper")
AS_ON_A_GPU = {"chains": 5, "watch": "rest", "launches": 2, "settling_runs": 2}


@pytest.mark.parametrize("settings", [{}, AS_ON_A_GPU], ids=["one chain", "batches"])
@pytest.mark.parametrize("method", ["hybrid", "dp5"])
def test_chains_that_fly_never_land(method: str, settings: dict[str, object]) -> None:
    """On rigid joints they cross half a second in some thousand attempts, then begin anew, and never meet springs.

    An attempt of such a flight carries them on by hundreds of joint periods, and all chains do the same.
    """
    timer = ChainTimer(PAPER, Options(method=method), flying(30, PAPER), **settings)
    stretches = []
    for _ in range(6):
        stretches.append(timer.measure(2000))
        assert max(batch.time(0) for batch in timer.batches) < 1.5 * LONGEST_STRETCH
    assert all(stretch.floor == 0 and stretch.attempts > 0 and stretch.seconds > 0 for stretch in stretches)
    assert timer.batches[0].counts(0)["self"] == 0
    steps = [stretch.simulated / stretch.accepted for stretch in stretches]
    assert (min(steps) > 1e-4) == (method == "hybrid")
    assert (sum(stretch.simulated for stretch in stretches) > LONGEST_STRETCH) == (method == "hybrid")
    first, *others = (batch.position(world) for batch in timer.batches for world in range(len(batch.links)))
    assert len(others) == timer.chains - 1 and all(np.array_equal(first, other) for other in others)


def test_first_steps_are_not_measured() -> None:
    """Attempts of a measurement are counted, those before it are not."""
    timer = ChainTimer(PAPER, Options(method="dp5"), flying(12, PAPER))
    assert timer.settled.attempts == SETTLING_ATTEMPTS
    before = timer.batches[0].time(0)
    stretches = [timer.measure(300), timer.measure(200)]
    assert [stretch.attempts for stretch in stretches] == [300, 200]
    assert sum(stretch.simulated for stretch in stretches) == pytest.approx(timer.batches[0].time(0) - before)


def test_stretches_are_added_up() -> None:
    """Wall times give their median, counts and simulated times their sums; none is given of a landing."""
    stretches = [Stretch(seconds, 1e-3, 90, 10, 0) for seconds in (1e-6, 5e-6, 2e-6)]
    whole = together("flight", stretches)
    assert whole == Stretch(2e-6, pytest.approx(3e-3), 270, 30, 0)
    cost = step_cost("flight", "dp5", 12, whole, stages=7)
    assert cost.microseconds == pytest.approx(2.0) and cost.step_microseconds == pytest.approx(1e6 * 3e-3 / 270)
    assert cost.rejected == pytest.approx(0.1) and cost.wall_per_simulated == pytest.approx(2e-6 * 300 / 3e-3)
    assert cost.per_link_stage == pytest.approx(2e3 / 12 / 7)
    landed = [*stretches, replace(stretches[0], floor=1)]
    assert together("pile", landed).floor == 1
    with pytest.raises(RuntimeError, match="came down"):
        together("flight", landed)
