"""Multiplied loads: what they are made of, which waves they follow from, and that the loop is the same under them."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from tests.support.driven_loops import hold, released_loop
from warpchain import preset
from warpchain.engine.devices import start_device
from warpchain.kernels.physics.scaled_loads import crossing_time

Array = NDArray[np.float64]

PAPER, SOFT = preset("paper"), preset("soft")
CPU = start_device("cpu").warp


# --- the loop stays ---


def test_a_stationary_loop_stays_as_it_is_under_load() -> None:
    """Under loads that are 15 times as great, drag and all, it keeps height, width and curvature."""
    loop = released_loop(links=60, frequency=20.0, start="spinning")
    own, loaded = hold(loop, SOFT, 0.5), hold(loop, SOFT, 1.0, load_factor=15.0)
    height, width, curvature = own[[0, 1, 4]]
    change = np.abs(loaded - own) / [height, width, width, height, curvature]
    assert np.all(change < [0.002, 0.005, 0.003, 0.002, 0.01]), change


# --- drag ---


# --- how long slow waves take ---


def crossing_times(cases: Sequence[tuple[float, float, float, float]]) -> Array:
    """`crossing_time` of many loops: speed, gravity, sprocket's radius, height."""
    columns = [wp.array(column, dtype=wp.float64, device=CPU) for column in zip(*cases, strict=True)]
    return wp.map(crossing_time, *columns).numpy()


@pytest.mark.parametrize("speed", [0.0, 0.1, 2.0, 7.5, 30.0])
@pytest.mark.parametrize("gravity", [9.81, 490.0])
@pytest.mark.parametrize("height", [0.1, 1.1])
def test_crossing_time_is_the_integral_of_the_slow_waves_slowness(speed: float, gravity: float, height: float) -> None:
    """2 ∫ dy / (√(v² + g (y + ρ/2)) − v) over the loop's height, by Gauss and Legendre in 200 points."""
    radius = 0.06
    nodes, weights = np.polynomial.legendre.leggauss(200)
    y = height / 2 * (nodes + 1)
    pull = gravity * (y + radius / 2)
    slow = pull / (np.sqrt(speed**2 + pull) + speed)
    expected = 2 * height / 2 * float(weights @ (1 / slow))
    assert crossing_times([(speed, gravity, radius, height)])[0] == pytest.approx(expected, rel=1e-6)


def test_nothing_crosses_without_weight() -> None:
    """Slow waves stand still in a loop without weight, or on a sprocket that turns too fast for it to matter."""
    times = crossing_times([(7.5, 0.0, 0.06, 1.0), (0.0, 0.0, 0.06, 1.0), (1e6, 9.81, 0.06, 1.0)])
    assert np.all(times >= 1e9) and np.all(np.isfinite(times))
    assert math.isfinite(crossing_times([(100.0, 9.81, 0.06, 1.0)])[0])
