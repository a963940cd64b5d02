"""Processor time and energy error of whole walks with each method.

    python -m tests.support.walk_times

Ellipses of 60 links at 15 Hz and of 150 links at 20 Hz walk with Table 1's joints; numbers are medians of three
samples, on one core, with kernels compiled before. `reference` takes most of the five minutes.
"""

import statistics
import time

import warpchain

WALKS = ((60, 15.0), (150, 20.0))
METHODS = ("reference", "dp5", "standard", "explicit")
SEEDS = (1, 2, 3)


def main() -> None:
    """Print a line for each method and length, and how much longer the first method takes."""
    for links, frequency in WALKS:
        walk = {"preset": "paper", "start": "ellipse", "links": links, "frequency": frequency}
        times = dict[str, float]()
        for method in METHODS:
            warpchain.walk(**walk, method=method, stop_time=1e-3)  # compiles
            seconds, errors = [], []
            for seed in SEEDS:
                began = time.process_time()
                errors.append(warpchain.walk(**walk, method=method, seed=seed).energy_error)
                seconds.append(time.process_time() - began)
            times[method] = statistics.median(seconds)
            faster = times[METHODS[0]] / times[method]
            text = f"{links} links, {method}: {times[method]:.2f} s, {faster:.2f} times faster"
            print(f"{text}, energy error {statistics.median(errors):.0e}", flush=True)


if __name__ == "__main__":
    main()
