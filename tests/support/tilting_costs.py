"""How long an attempted step takes on a tilting plane, as a multiple of one in a fixed plane.

    python -m tests.support.tilting_costs [seeds]

Ellipses walk for the first moments with `explicit`, in turn in both planes on one core. Times are those of the
processor, the host's part included. Kernels are compiled before.
"""

import statistics
import sys
import time
from typing import Any

import warpchain

PLANES: dict[str, dict[str, Any]] = {"fixed": {}, "tilting": {"plane": "tilting", "tilt": 0.1}}
STOPS = {60: 0.5, 150: 0.35, 180: 0.3}
"""Links, and the simulated time [s] after which a walk stops."""


def cost(links: int, seed: int, plane: str) -> float:
    """Processor time of an attempted step [µs]."""
    began = time.process_time()
    walk = warpchain.walk(
        links=links, start="ellipse", method="explicit", stop_time=STOPS[links], seed=seed, **PLANES[plane]
    )
    return 1e6 * (time.process_time() - began) / (walk.steps_accepted + walk.steps_rejected)


def main(seeds: int = 7) -> None:
    """Print a line for each number of links."""
    for links in STOPS:
        for plane in PLANES:
            cost(links, 0, plane)
        pairs = [[cost(links, seed, plane) for plane in PLANES] for seed in range(seeds)]
        fixed, tilting = (statistics.median(each) for each in zip(*pairs, strict=True))
        ratio = statistics.median(after / before for before, after in pairs)
        print(f"{links} links: {fixed:.2f} and {tilting:.2f} µs, median ratio {ratio:.2f}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
