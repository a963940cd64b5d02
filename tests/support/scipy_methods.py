"""What SciPy's explicit and implicit methods take for a flight, as the study of the paper compares them.

    python -m tests.support.scipy_methods

A chain of 60 links with Table 1's joints circulates in flight for a millisecond, on the NumPy model. Errors are those
beside DOP853 at 1e-10; times are those of the processor, on one core with OMP_NUM_THREADS=1.
"""

import time

import numpy as np
from scipy.integrate import solve_ivp

from tests.oracle_model import motion_equations
from tests.support.arrays import Array
from tests.support.presets import PAPER
from warpchain.chain.start_shapes import ellipse, lay_chain

LINKS, DURATION = 60, 1e-3
METHODS, TOLERANCES = ("DOP853", "RK45", "Radau", "BDF"), (1e-6, 1e-8)


def rates(_: float, state: Array) -> Array:
    """Derivatives of positions and velocities, all in a row."""
    position, velocity = state.reshape(2, LINKS, 3)
    return np.concatenate([velocity, motion_equations.acceleration(position, velocity, PAPER)]).ravel()


def main() -> None:
    """Print a line for each method and tolerance."""
    start = np.ravel(lay_chain(ellipse(1.5), LINKS, PAPER.link_length, 5.0, 0.1))
    true = solve_ivp(rates, (0.0, DURATION), start, "DOP853", rtol=1e-10, atol=1e-10).y[:, -1]
    for method in METHODS:
        for tolerance in TOLERANCES:
            began = time.process_time()
            done = solve_ivp(rates, (0.0, DURATION), start, method, rtol=tolerance, atol=tolerance)
            seconds, error = time.process_time() - began, np.abs(done.y[:, -1] - true)[3 * LINKS :].max()
            print(f"{method} at {tolerance:g}: {seconds:.2f} s, velocities to {error:.1e} m/s or rad/s", flush=True)


if __name__ == "__main__":
    main()
