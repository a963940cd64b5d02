"""How exact methods are where joints reverse, as the study of accuracy says in its table.

    python -m tests.support.reversals

It writes studies/accuracy/results/reversals.csv and prints the table. A loop that has just hit the floor flies for a
millisecond; its truth is `dp5` at 1e-13, as tests/hard_cases/test_reversals.py shows with SciPy.
"""

from pathlib import Path

import numpy as np

import warpchain
from studies.common import table, write_rows
from tests.hard_cases.starts import PAPER, struck_loop

DURATION, METHODS, TOLERANCES = 1e-3, ("rkf78", "dp5", "os32"), (1e-6, 1e-9, 1e-11)
STARTS = [struck_loop(2 * np.pi * number / 320) for number in range(8)]
RESULTS = Path(__file__).parents[2] / "studies" / "accuracy" / "results" / "reversals.csv"


def flights(method: str, tolerance: float) -> tuple[np.ndarray, float]:
    """Angular velocities (starts, n) [rad/s] at the ends of the flights, and the median number of attempted steps."""
    spins, attempts = [], []
    for position, velocity in STARTS:
        high, settings = position + np.array([0.0, 0.01, 0.0]), {"method": method, "tolerance": tolerance}
        flight = warpchain.simulate(PAPER, high, velocity, times=[DURATION], **settings)
        if flight.status != warpchain.Status.FINISHED:
            raise RuntimeError(f"{method} at {tolerance:g}: {flight.status.sentence}")
        spins.append(flight.velocity[-1][:, 2])
        attempts.append(flight.steps_accepted + flight.steps_rejected)
    return np.array(spins), float(np.median(attempts))


def main() -> None:
    """Fly with all methods and tolerances; write the rows and print the table."""
    (true, _), rows = flights("dp5", 1e-13), []
    for method in METHODS:
        for tolerance in TOLERANCES:
            spins, attempts = flights(method, tolerance)
            error = float(np.median(np.abs(spins - true).max(axis=1)))
            rows.append({"method": method, "tolerance": tolerance, "error": error, "attempts": attempts})
    write_rows(RESULTS, rows)
    print(
        table("method | tolerance | error / (rad/s) | attempted steps", (row.values() for row in rows), "s g .1e .0f")
    )


if __name__ == "__main__":
    main()
