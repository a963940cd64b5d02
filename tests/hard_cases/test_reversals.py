"""Joints that reverse within a step: what Fehlberg's error estimate does not see, and those of others do.

Joint friction τ_c tanh(w/ω_c) jumps, at Table 1's ω_c, within a small fraction of a step when springs that ring after
an impact reverse a joint.
"""

from collections.abc import Callable

import numpy as np
import pytest

import warpchain
from tests.hard_cases.starts import PAPER, State, reversing_loop, struck_loop
from tests.oracle_model import motion_equations
from warpchain import Parameters, Status
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS, Tableau

DURATION = 1e-3
SMOOTH = PAPER.with_values({"friction_smoothing": 1.0})
STARTS = {
    "struck": lambda part: struck_loop(2 * np.pi * part / 40),
    "reversing": lambda part: reversing_loop(2 * np.pi * part),
}
"""Name → start, of a number from 0 to 1: how large an error is depends on where in a step the joints reverse."""
each_kind = pytest.mark.parametrize("start", STARTS.values(), ids=list(STARTS))


def spins_after(parameters: Parameters, starts: list[State], method: str, tolerance: float) -> np.ndarray:
    """Angular velocities (starts, n) [rad/s] at the end of flights without a floor."""
    flights = [
        warpchain.simulate(
            parameters, *start, DURATION, times=[DURATION], floor=False, method=method, tolerance=tolerance
        )
        for start in starts
    ]
    assert {flight.status for flight in flights} == {Status.FINISHED}
    return np.array([flight.velocity[-1][:, 2] for flight in flights])


def median_error(spins: np.ndarray, true: np.ndarray) -> float:
    """Greatest error of a link, median over the starts [rad/s]."""
    return float(np.median(np.abs(spins - true).max(axis=1)))


@pytest.mark.parametrize("tableau", TABLEAUS.values(), ids=list(TABLEAUS))
def test_only_fehlbergs_estimate_is_blind_to_time(tableau: Tableau) -> None:
    """Its error weights cancel at every time of the step; those of the others do not, also within the step."""
    sums: dict[object, object] = {}
    for row, weight, embedded in zip(tableau.matrix, tableau.weights, tableau.embedded, strict=True):
        sums[sum(row)] = sums.get(sum(row), 0) + weight - embedded
    seen = [time for time, total in sums.items() if total]
    assert (seen == []) == (tableau.name == "rkf78")
    assert tableau.name == "rkf78" or any(0 < time < 1 for time in seen)


@each_kind
def test_fehlberg_at_1e_11_errs_far_more_than_others(start: Callable[[float], State]) -> None:
    """Where joints reverse at Table 1's ω_c a thousandth and a hundredth of the tolerance help `rkf78` little.

    SciPy on the NumPy model agrees with `dp5`.
    """
    starts = [start(number / 8) for number in range(8)]
    true = spins_after(PAPER, starts, "dp5", 1e-13)
    scipy = motion_equations.solve_flight(*starts[1], np.array([0.0, DURATION]), PAPER, rtol=1e-11, atol=1e-11)
    assert np.abs(scipy[1][-1][:, 2] - true[1]).max() < 1e-7
    fehlberg = {tol: median_error(spins_after(PAPER, starts, "rkf78", tol), true) for tol in (1e-6, 1e-9, 1e-11)}
    assert fehlberg[1e-6] < 20 * fehlberg[1e-9] and fehlberg[1e-9] < 10 * fehlberg[1e-11]
    other = {tol: median_error(spins_after(PAPER, starts, "dp5", tol), true) for tol in (1e-9, 1e-11)}
    assert other[1e-9] > 50 * other[1e-11] and other[1e-11] < 2e-8
    assert fehlberg[1e-9] > 3 * other[1e-9] and fehlberg[1e-11] > 100 * other[1e-11]


@each_kind
def test_where_kinks_take_many_steps_fehlberg_is_as_good(start: Callable[[float], State]) -> None:
    """At ω_c = 1 rad/s `rkf78` at 1e-9 errs no more than `dp5`, up to where the references part."""
    starts = [start(number / 8) for number in range(8)]
    true = spins_after(SMOOTH, starts, "dp5", 1e-13)
    ours, theirs = (median_error(spins_after(SMOOTH, starts, method, 1e-9), true) for method in ("rkf78", "dp5"))
    assert ours < 2 * theirs and ours < 2e-8
