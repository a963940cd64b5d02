"""Whether Figure 5 has the same shape for other numbers of links and frequencies, from a walk in each cell.

It writes results/figure5.csv, which the page's statement on Figure 5 is made of.
"""

from pathlib import Path

import warpchain
from studies.common import Array, read_columns, run_study, write_rows

CSV = Path(__file__).parent / "results" / "figure5.csv"
LINKS, FREQUENCIES = (60, 90, 120, 150, 180), (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)


def row(links: int, frequency: float) -> dict[str, float]:
    """Bounces of a walk, and the least horizontal velocity over the greatest."""
    walk = warpchain.walk(preset="paper", start="spinning", links=links, frequency=frequency)
    speed = walk.center_velocity[:, 0]
    least = float(speed.min() / speed.max())
    return {"links": links, "frequency": frequency, "bounces": walk.bounces, "least_speed": least}


def shapes() -> tuple[Array, Array]:
    """Whether the chain of each cell bounces again, and whether it hardly ever moves backwards."""
    rows = read_columns(CSV)
    return rows["bounces"] >= 2, rows["least_speed"] > -0.05


def main() -> None:
    """Walk, and write the file."""
    write_rows(CSV, [row(links, frequency) for links in LINKS for frequency in FREQUENCIES])


if __name__ == "__main__":
    run_study(main)
