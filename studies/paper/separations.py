"""How far apart along the chain links are that touch, in walks of five minutes → results/separations.csv.

Walks from the sprocket, frames 0.5 ms apart; touches before the collapse, of joints at least 2 links apart, that are no
growth of an older one: no joint within 4 links of either has touched one within 4 of the other in a frame before.
"""

from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
from scipy.ndimage import maximum_filter
from scipy.spatial.distance import cdist

import warpchain
from studies.common import Array, read_columns, table, write_rows

RESULTS = Path(__file__).parent / "results" / "separations.csv"
LINKS = (60, 90, 120, 150, 180)
FREQUENCIES = (10.0, 15.0, 20.0, 25.0, 30.0)
RELEASES = ((0.0, 0.008), (0.4, 0.0096))  # Phase and clearance [m]
HIGH = 0.04  # Height above the lowest joint [m] from which a touch is not one on the floor
BINS = ((2, 3), (4, 8), (9, 12), (13, 16), (17, 21), (22, 28), (29, 35), (36, 90))
LEAST = (2, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 30, 40)  # Values of m


def touches(walk: warpchain.WalkResult) -> Iterator[tuple[float, int, float]]:
    """Time [s] over that of the collapse, links apart, and height [m] of each new touch."""
    links, reach = walk.setup.scene.links, 2 * walk.setup.parameters.circle_radius
    apart = np.abs(np.subtract.outer(np.arange(links), np.arange(links)))
    apart = np.minimum(apart, links - apart)
    end = walk.collapsed_at if np.isfinite(walk.collapsed_at) else walk.walk_time
    old: Array = np.zeros((links, links), dtype=bool)
    for time, joints in zip(walk.frame_time, walk.frame_joints, strict=True):
        if time > end:
            return
        y = joints[:, 1]
        now = (cdist(joints, joints, "sqeuclidean") < reach**2) & (apart >= 2)
        for i, j in zip(*np.nonzero(np.triu(now & ~old)), strict=True):
            yield float(time / end), int(apart[i, j]), float(max(y[i], y[j]) - y.min())
        old |= maximum_filter(now, 9, mode="wrap")  # 4 links around


def main() -> None:
    """Let all chains walk, and write each new touch."""
    rows = []
    for links, frequency, (phase, clearance) in product(LINKS, FREQUENCIES, RELEASES):
        scene = {"links": links, "frequency": frequency, "phase": phase, "clearance": clearance, "start": "spinning"}
        walk = warpchain.walk(preset="soft", **scene, frame_interval=5e-4, walk_limit=2.5)
        cell = {"links": links, "frequency": f"{frequency:g}", "phase": f"{phase:g}"}
        rows += [cell | {"time": f"{t:.4f}", "apart": a, "height": f"{h:.3f}"} for t, a, h in touches(walk)]
    write_rows(RESULTS, rows)


def separations_tables() -> str:
    """New touches by links apart and height; and when links at least m apart first touch."""
    links, *walk, time, apart, height = read_columns(RESULTS).values()
    groups = {
        f"at most {100 * HIGH:g} cm high": height <= HIGH,
        "higher, 60 and 90 links": (height > HIGH) & (links < 120),
        "higher, 120 to 180 links": (height > HIGH) & (links >= 120),
    }
    lines = []
    for name, chosen in groups.items():
        counts = (np.sum(chosen & (apart >= low) & (apart <= high)) / (high - low + 1) for low, high in BINS)
        lines.append((name, *(f"{count:.1f}" for count in counts)))
    first = table(["new touches per link apart", *(f"{low} to {high}" for low, high in BINS)], lines)
    lines = []
    for number in LINKS:
        texts = []
        for least in LEAST:
            chosen = (links == number) & (apart >= least)
            walks = zip(*(each[chosen] for each in walk), strict=True)
            # touches of a walk are in order of time, so that the first of each walk is kept
            firsts = list(dict(zip(list(walks)[::-1], time[chosen][::-1], strict=True)).values())
            most = len(firsts) > len(FREQUENCIES) * len(RELEASES) / 2
            texts.append(f"{np.median(firsts):.2f} ({len(firsts)})" if most else f"({len(firsts)})")
        lines.append((f"{number} links", *texts))
    second = table(["first touch at least m apart", *(f"m = {least}" for least in LEAST)], lines)
    return f"{first}\n\n{second}"


if __name__ == "__main__":
    main()
