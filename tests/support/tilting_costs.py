"""How long an attempted step takes on a tilting plane, as a multiple of one in a fixed plane.

    python -m tests.support.tilting_costs [seeds [device]]

Ellipses walk for the first moments with `explicit`, in turn in both planes. On a CPU times are those of the
processor, for one walk; on a GPU (`cuda`) those of the clock, for sweeps of 1,600 walks. The host's part is included.
Kernels are compiled before.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import warpchain

PLANES: dict[str, dict[str, Any]] = {"fixed": {}, "tilting": {"plane": "tilting", "tilt": 0.1}}
STOPS = {60: 0.5, 150: 0.35, 180: 0.3}
"""Links, and the simulated time [s] after which a walk stops."""
SAMPLES = 1600


def cost(links: int, seed: int, plane: str) -> float:
    """Processor time of an attempted step [µs]."""
    began = time.process_time()
    walk = warpchain.walk(
        links=links, start="ellipse", method="explicit", stop_time=STOPS[links], seed=seed, **PLANES[plane]
    )
    return 1e6 * (time.process_time() - began) / (walk.steps_accepted + walk.steps_rejected)


def cost_on_gpu(links: int, seed: int, plane: str) -> float:
    """Time of an attempted step [µs] among those of many chains at once."""
    scene = {"links": links, "start": "ellipse", "stop_time": STOPS[links], **PLANES[plane]}
    content = {"version": 1, "name": plane, "seed": seed, "preset": "paper", "samples": SAMPLES, "scene": scene}
    content["options"] = {"method": "explicit"}
    with tempfile.TemporaryDirectory() as folder:
        began = time.monotonic()
        columns = warpchain.sweep(content, Path(folder, "sweep"), device="cuda").blocks["main"].columns
        elapsed = time.monotonic() - began
    return float(1e6 * elapsed / (columns["steps_accepted"] + columns["steps_rejected"]).sum())


def main(seeds: int = 7, device: str = "cpu") -> None:
    """Print a line for each number of links."""
    measured = cost if device == "cpu" else cost_on_gpu
    for links in STOPS:
        for plane in PLANES:
            measured(links, 0, plane)
        pairs = [[measured(links, seed, plane) for plane in PLANES] for seed in range(seeds)]
        fixed, tilting = (statistics.median(each) for each in zip(*pairs, strict=True))
        ratio = statistics.median(after / before for before, after in pairs)
        print(f"{links} links: {fixed:.3g} and {tilting:.3g} µs, median ratio {ratio:.2f}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]), *sys.argv[2:])
