"""Rest needs the floor: a chain that is slow in mid-air goes on."""

import math

import pytest

import warpchain
from warpchain import Status


@pytest.mark.filterwarnings("ignore::warpchain.inputs.validation.InputWarning")
@pytest.mark.parametrize("method", ["standard", "explicit"])
def test_a_slow_chain_in_mid_air_is_not_at_rest(method: str) -> None:
    """Under a hundredth of Earth's gravity a loop falls 5 mm before it is fast; it rests on the floor, not above it."""
    walk = warpchain.walk(
        links=20, preset="soft", start="ellipse", method=method, frequency=0.01, gravity=0.1, clearance=5e-3
    )
    assert walk.status == Status.AT_REST
    assert walk.bounces > 0 and walk.lowest[-1] < 1e-4
    assert walk.walk_time > math.sqrt(2 * 5e-3 / 0.1)


def test_a_chain_that_nothing_pulls_down_ends_at_the_time_limit() -> None:
    """Without gravity a slow loop never touches anything: it is still in the air when its time is over."""
    walk = warpchain.walk(
        links=20, preset="soft", start="ellipse", method="dp5", frequency=0.0, gravity=0.0, walk_limit=0.2
    )
    assert walk.status == Status.TIME_LIMIT and walk.walk_time == 0.2
    assert walk.bounces == 0 and math.isnan(walk.dx)
