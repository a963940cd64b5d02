"""Joints that reverse within a step: what Fehlberg's error estimate does not see, and those of others do.

Joint friction τ_c tanh(w/ω_c) jumps, at Table 1's ω_c, within a small fraction of a step when springs that ring after
an impact reverse a joint.
"""

import numpy as np
import pytest

import warpchain
from tests.hard_cases.starts import PAPER, struck_loop
from tests.oracle_model import motion_equations
from warpchain import Status

DURATION = 1e-3
STARTS = [struck_loop(2 * np.pi * number / 320) for number in range(4)]
"""How large an error is depends on where in a step the joints reverse."""


def spins_after(method: str, tolerance: float) -> np.ndarray:
    """Angular velocities (starts, n) [rad/s] at the end of flights above the floor."""
    found = []
    for position, velocity in STARTS:
        high = position + np.array([0.0, 0.01, 0.0])
        flight = warpchain.simulate(
            PAPER, high, velocity, DURATION, times=[DURATION], method=method, tolerance=tolerance
        )
        assert flight.status == Status.FINISHED
        found.append(flight.velocity[-1][:, 2])
    return np.array(found)


@pytest.mark.thorough
def test_fehlberg_errs_far_more_than_others_where_joints_reverse() -> None:
    """Smaller tolerances help `rkf78` little and `dp5` much, with which SciPy on the NumPy model agrees."""
    true = spins_after("dp5", 1e-13)
    _, scipy = motion_equations.solve_flight(*STARTS[1], DURATION, PAPER, rtol=2e-12, atol=2e-12)
    assert np.abs(scipy[:, 2] - true[1]).max() < 2e-7

    def median_error(method: str, tolerance: float) -> float:
        return float(np.median(np.abs(spins_after(method, tolerance) - true).max(axis=1)))

    fehlberg = {tolerance: median_error("rkf78", tolerance) for tolerance in (1e-6, 1e-9, 1e-11)}
    other = {tolerance: median_error("dp5", tolerance) for tolerance in (1e-9, 1e-11)}
    assert fehlberg[1e-6] < 20 * fehlberg[1e-9] and fehlberg[1e-9] < 10 * fehlberg[1e-11]
    assert other[1e-9] > 50 * other[1e-11] and other[1e-11] < 2e-8
    assert fehlberg[1e-9] > 3 * other[1e-9] and fehlberg[1e-11] > 100 * other[1e-11]
