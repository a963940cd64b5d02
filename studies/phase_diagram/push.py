"""What the push of floor and links in the pile does to the distance of slow long chains.

    python -m studies.phase_diagram.push                    # prints the table of the page
    python -m studies.phase_diagram.push FOLDER FAST WITHOUT    # first reduces sweeps of sweeps/push.yaml

FAST is of an engine that pushes ten times as fast, WITHOUT of one that does not push. Walks are compared one by one
with those of joints that do not soften.
"""

import csv
import sys
from pathlib import Path

import numpy as np

import warpchain
from studies.common import at_rest, mean, standard_error, write_rows
from studies.common import table as markdown

RESULTS = Path(__file__).parent / "results"
GROUPS = {
    "today": "today",
    "fast": "with ten times the push",
    "without": "without the push",
    "stiff": "with joints of their own in the pile",
}
BANDS = (("100 to 160 links", 100, 160), ("220 and 240 links", 220, 240))
Cells = dict[tuple[str, str], tuple[float, float]]


def reduce(*folders: str) -> None:
    """Write Δx of each cell of each group, and how much further its walks go than the same with stiff joints."""
    sweeps = [at_rest(next(iter(warpchain.load(folder).blocks.values()))) for folder in folders]
    stiff = sweeps[0].sel(soften_pile=False)
    rows = []
    for group, dx in zip(GROUPS, [*(sweep.sel(soften_pile=True) for sweep in sweeps), stiff], strict=True):
        for i, links in enumerate(dx.links.values.tolist()):
            for j, frequency in enumerate(dx.frequency.values.tolist()):
                row = {"group": group, "links": links, "frequency": frequency}
                for name, values in (("dx", dx[i, j]), ("more", dx[i, j] - stiff[i, j])):
                    row |= {name: float(mean(values)), f"{name}_se": float(standard_error(values))}
                rows.append(row)
    write_rows(RESULTS / "push.csv", rows)


def cells_of(path: Path, group: str | None, mean: str, error: str) -> Cells:
    """Mean and standard error of a column [m] by links and frequency, in a group if the file has groups."""
    with path.open(encoding="utf-8") as file:
        return {
            (row["links"], f"{float(row['frequency']):g}"): (float(row[mean]), float(row[error]))
            for row in csv.DictReader(file)
            if row.get("group") == group
        }


def over(cells: Cells, others: Cells) -> str:
    """Mean over cells of the distance over that of others, less 1, with its error."""
    ratio, error = [], []
    for key, (dx, se) in cells.items():
        other, its = others[key]
        ratio.append(dx / other - 1)
        error.append(dx / other * np.hypot(se / dx, its / other))
    return _shown(ratio, error)


def further(more: Cells, stiff: Cells) -> str:
    """Mean over cells of what walks go further than the same walks on stiff joints, as a share of those."""
    return _shown(
        *zip(*((value / stiff[key][0], se / stiff[key][0]) for key, (value, se) in more.items()), strict=True)
    )


def _shown(shares: list[float], errors: list[float]) -> str:
    """Mean of shares in per cent, with its standard error."""
    return f"{100 * np.mean(shares):+.2f} ± {100 * np.linalg.norm(errors) / len(errors):.2f} %".replace("-", "−")


def table() -> str:
    """The table of the page."""
    own = RESULTS / "push.csv"
    million = cells_of(RESULTS / "cells.csv", None, "dx_mean", "dx_se")
    stiff = cells_of(own, "stiff", "dx", "dx_se")
    rows = []
    for group, title in GROUPS.items():
        beside = "" if group == "stiff" else further(cells_of(own, group, "more", "more_se"), stiff)
        rows.append([title, over(cells_of(own, group, "dx", "dx_se"), million), beside])
    for group in ("today", "fast"):
        more = cells_of(own, group, "more", "more_se")
        for name, fewest, most in BANDS:
            band = {key: value for key, value in more.items() if fewest <= int(key[0]) <= most}
            rows.append([f"{GROUPS[group]}, {name}", "", further(band, stiff)])
    return markdown("walks | over the million | over the same walks with joints of their own", rows)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        reduce(*sys.argv[1:])
    print(table())
