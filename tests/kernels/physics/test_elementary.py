"""Elementary functions against NumPy's, which are exact to rounding, on the CPU."""

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from warpchain.engine.devices import start_device
from warpchain.kernels.physics.elementary import LARGEST_TURN, cos_sin, small_turn, tanh

Array = NDArray[np.float64]

DEVICE = start_device("cpu").warp
ROUNDING = np.finfo(np.float64).eps


def evaluated(function: wp.Function, x: Array) -> Array:
    """Values of a function of the kernels, (x,), or (2, x) of one that gives two."""
    values = wp.map(function, wp.array(x, dtype=wp.float64, device=DEVICE))
    return np.array([each.numpy() for each in values] if isinstance(values, list) else values.numpy())


RANDOM = np.random.default_rng(5)


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 0.3, 1.0, 5.0, 25.0])
def test_tanh_is_exact_to_a_few_roundings_of_one(scale: float) -> None:
    """Where friction changes its sign, on the way to saturation and past it; it is odd to the bit."""
    x = scale * RANDOM.normal(size=200_000)
    found = evaluated(tanh, x)
    assert np.abs(found - np.tanh(x)).max() < 3 * ROUNDING
    assert np.abs(found).max() <= 1
    np.testing.assert_array_equal(evaluated(tanh, -x), -found)


def test_tanh_saturates_without_overflow() -> None:
    """At arguments whose exponential no number could hold."""
    found = evaluated(tanh, np.array([0.0, 20.5, -400.0, 1e300, np.inf, -np.inf]))
    np.testing.assert_array_equal(found, [0, 1, -1, 1, 1, -1])


@pytest.mark.parametrize("scale", [0.7, 10.0, 2e4])
def test_directions_are_exact_to_two_roundings(scale: float) -> None:
    """Of angles within one turn and after thousands of them."""
    x = scale * RANDOM.uniform(-1, 1, size=200_000)
    cosine, sine = evaluated(cos_sin, x)
    assert np.abs(cosine - np.cos(x)).max() < 2 * ROUNDING
    assert np.abs(sine - np.sin(x)).max() < 2 * ROUNDING


def test_small_turns_are_exact_to_their_own_rounding() -> None:
    """Relative to 1 − cos and sin themselves, which sums of many steps need."""
    x = float(LARGEST_TURN) * RANDOM.uniform(-1, 1, size=200_000)
    versine, sine = evaluated(small_turn, x)
    assert np.abs(versine / (2 * np.sin(x / 2) ** 2) - 1).max() < 4 * ROUNDING
    assert np.abs(sine / np.sin(x) - 1).max() < 4 * ROUNDING
