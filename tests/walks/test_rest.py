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
