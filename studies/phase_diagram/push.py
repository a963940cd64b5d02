"""What changed the distance of slow long chains since the million walks: the push of floor and links in the pile.

    python -m studies.phase_diagram.push                            # prints the table of the page
    python -m studies.phase_diagram.push FOLDER [without=FOLDER]    # reduces sweeps of sweeps/push.yaml first

Each group is a block of the sweep; a folder with a name before it is of walks that differ in the engine.
"""

import csv
import sys
from pathlib import Path

import numpy as np

import warpchain
from studies.common import table as markdown
from studies.common import write_rows

RESULTS = Path(__file__).parent / "results"
GROUPS = {
    "today": "today",
    "spin_up": "after a spin-up of 2 s",
    "without": "without the push",
    "stiff_pile": "with joints of their own in the pile",
}
Cells = dict[tuple[str, str], tuple[float, float]]


def reduce(arguments: list[str]) -> None:
    """Write the mean, its standard error and the number of walks at rest of each cell of each group."""
    rows = []
    for argument in arguments:
        *given, folder = argument.split("=", 1)
        for name, block in warpchain.load(folder).blocks.items():
            if (group := given[0] if given else name) not in GROUPS:
                raise SystemExit(
                    f"{folder}: block {name} is no group; give one of {', '.join(GROUPS)} as NAME={folder}"
                )
            for i, links in enumerate(block.axes["links"]):
                for j, frequency in enumerate(block.axes["frequency"]):
                    dx = block.dx[i, j][block.status[i, j] == warpchain.Status.AT_REST]
                    error = dx.std(ddof=1) / np.sqrt(len(dx))
                    row = {"group": group, "links": links, "frequency": frequency, "walks": len(dx)}
                    rows.append(row | {"dx": float(dx.mean()), "se": float(error)})
    write_rows(RESULTS / "push.csv", rows)


def cells_of(path: Path, mean: str, error: str) -> dict[str, Cells]:
    """Mean and standard error of Δx [m] by group, links and frequency; where a file has no groups, that is ``""``."""
    found: dict[str, Cells] = {}
    with path.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["links"], f"{float(row['frequency']):g}"
            found.setdefault(row.get("group", ""), {})[key] = float(row[mean]), float(row[error])
    return found


def over(cells: Cells, others: Cells) -> str:
    """Mean over cells of the distance over that of others, less 1, with its error."""
    ratio, error = [], []
    for key, (dx, se) in cells.items():
        other, its = others[key]
        ratio.append(dx / other - 1)
        error.append(dx / other * np.hypot(se / dx, its / other))
    return f"{100 * np.mean(ratio):+.2f} ± {100 * np.linalg.norm(error) / len(error):.2f} %".replace("-", "−")


def table() -> str:
    """The table of the page."""
    groups = cells_of(RESULTS / "push.csv", "dx", "se")
    million = cells_of(RESULTS / "cells.csv", "dx_mean", "dx_se")[""]
    rows = []
    for name, title in GROUPS.items():
        beside = "" if name == "without" else over(groups[name], groups["without"])
        rows.append([title, over(groups[name], million), beside])
    return markdown("walks | over the million | over those without the push", rows)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        reduce(sys.argv[1:])
    print(table())
