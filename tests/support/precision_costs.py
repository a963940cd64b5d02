"""Error against cost of steps in mixed and in double precision.

    python -m tests.support.precision_costs [os32 dp5 bs32]

A chain of 60 links circulates in flight for a millisecond; errors are those beside SciPy's DOP853 at 1e-12 on the NumPy
model, which takes a minute. Cost is the number of attempted steps, and processor time of a flight ten times as long.
"""

import statistics
import sys
import time

import numpy as np

from tests.oracle_model import motion_equations
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.status import Status

LINKS, DURATION, PARAMETERS = 60, 1e-3, preset("paper")
TOLERANCES = (1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


def main(methods: list[str]) -> None:
    """Print a line for each method, precision and tolerance; also where mixed precision is refused to users."""
    start = lay_chain(ellipse(1.5), LINKS, PARAMETERS.link_length, 5.0, 0.1)
    position, velocity = motion_equations.solve_flight(*start, DURATION, PARAMETERS)
    for method in methods:
        for is_mixed in (True, False):
            for tolerance in TOLERANCES:
                options = {"method": method, "tolerance": tolerance, "precision": "double", "controller": "pi"}
                batch = Batch(1, LINKS, Options(self_contact=False, **options))
                batch.worlds[0].set_chain(PARAMETERS, LINKS)
                features = batch.features(fixed_body="none", is_mixed=is_mixed)

                def fly(duration: float, batch: Batch = batch, features: object = features) -> float:
                    batch.worlds[0].load(*start, stop_time=duration, stop_status=Status.FINISHED)
                    began = time.process_time()
                    batch.run([0], features)
                    return time.process_time() - began

                fly(DURATION / 10)  # compiles
                fly(DURATION)
                errors = [
                    np.abs(batch.worlds[0].position - position).max(),
                    np.abs(batch.worlds[0].velocity - velocity).max(),
                ]
                attempts = batch.worlds[0].counts["accepted"] + batch.worlds[0].counts["rejected"]
                seconds = statistics.median(fly(10 * DURATION) for _ in range(3))
                word = "mixed" if is_mixed else "double"
                line = f"{method} {word:6} {tolerance:.0e}: {attempts:5} attempts, {1e3 * seconds:6.1f} ms, "
                print(line + f"errors {errors[0]:.1e} m, {errors[1]:.1e} m/s or rad/s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ["os32", "dp5", "bs32"])
