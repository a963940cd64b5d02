"""The bench of one core: that what it measures is what it says."""

import math

import pytest

from warpchain.bench.cpu_steps import LONGEST_STRETCH, _Stepper, flying
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset

PAPER = preset("paper")


def test_a_chain_that_flies_never_lands() -> None:
    """On rigid joints it crosses half a second in some thousand attempts, then begins anew, and never meets springs.

    Its numbers are those of flights: an attempt carries it on by hundreds of joint periods.
    """
    stepper = _Stepper(PAPER, Options(method="hybrid"), *flying(30, PAPER))
    for _ in range(6):
        assert stepper.run(2000) > 0
        assert stepper.batch.time(0) < 1.5 * LONGEST_STRETCH
    cost = stepper.cost("flight", "hybrid", 30, 1e-5)
    assert stepper.counts["floor"] == stepper.counts["self"] == 0
    assert stepper.simulated > 2 * LONGEST_STRETCH
    assert cost.step > 1e-4
    assert cost.wall_per_simulated < 1e-5 / 1e-4
    assert math.isnan(cost.per_link_stage)


def test_first_steps_are_not_measured() -> None:
    """Attempts of a measurement are counted, those before it are not; the mean step is theirs."""
    stepper = _Stepper(PAPER, Options(method="dp5"), *flying(12, PAPER))
    assert stepper.counts["accepted"] == 0 and stepper.simulated == 0.0
    before = stepper.batch.time(0)
    stepper.run(300)
    stepper.run(200)
    assert stepper.counts["accepted"] + stepper.counts["rejected"] == 500
    assert stepper.simulated == stepper.batch.time(0) - before
    cost = stepper.cost("flight", "dp5", 12, 2e-6)
    assert cost.step == stepper.simulated / stepper.counts["accepted"]
    assert cost.rejected == pytest.approx(stepper.counts["rejected"] / 500)
