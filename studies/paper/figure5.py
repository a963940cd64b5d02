"""Whether curves of other cells have the shape of the paper's Figure 5: walks of a minute → results/figure5.csv."""

from itertools import pairwise, product
from pathlib import Path

import numpy as np

import warpchain
from studies.common import read_columns, table, write_rows

RESULTS = Path(__file__).parent / "results" / "figure5.csv"
NEAR = 1e-3  # A chain whose lowest circle is nearer to the floor [m] is in an impact
APART = 0.01  # Impacts [s] less apart are one


def shape(links: int, frequency: float) -> dict[str, object]:
    """Numbers of one walk's curves.

    A curve has that shape if it rises between impacts, if nearly all changes of v_x are in impacts, and if v_x ends
    without turning back.
    """
    walk = warpchain.walk(links=links, frequency=frequency, start="spinning", preset="soft")
    near, height, speed = walk.lowest < NEAR, walk.center[:, 1], walk.center_velocity[:, 0]
    change = np.abs(np.diff(speed))
    impacts = near[1:] | near[:-1]
    begins = np.flatnonzero(impacts & ~np.r_[False, impacts[:-1]])
    begins = begins[np.r_[True, np.diff(walk.time[begins]) > APART]]
    maxima = [height[a : b + 1].max() > max(height[a], height[b]) + 1e-3 for a, b in pairwise(begins)]
    return {
        "links": links,
        "frequency": frequency,
        "bounces": walk.bounces,
        "rises": sum(maxima),
        "changes_in_impacts": f"{change[impacts].sum() / change.sum():.3f}",
        "fastest": f"{speed.max():.3g}",
        "backwards": f"{-speed.min() / speed.max():.3f}",
        "last_slide": f"{(walk.walk_time - walk.collapsed_at) / walk.walk_time:.2f}",
    }


def figure5_table() -> str:
    """The numbers of all walks, in Markdown."""
    head = "cell | bounces | times it rises between them | share of the changes of v_x in impacts"
    head += " | greatest v_x / m/s | greatest backward v_x over it | time from collapse to rest, over the walk's"
    walks = zip(*read_columns(RESULTS).values(), strict=True)
    rows = ((f"{links:g} × {frequency:g} Hz", *numbers) for links, frequency, *numbers in walks)
    return table(head, rows, "s g g .3f .3g .3f .2f")


if __name__ == "__main__":
    write_rows(RESULTS, [shape(*cell) for cell in product((60, 90, 120, 150, 180), (10.0, 15.0, 20.0, 30.0))])
