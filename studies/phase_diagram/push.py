"""What the push of floor and links in the pile does to the distance of slow long chains: prints the table of the page.

Folders are reduced first: of the sweep push by the engine of today, by one that pushes ten times as fast, and by one
that does not. Walks are compared one by one with those of joints that do not soften.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import warpchain
from studies import common
from studies.common import Array, at_rest
from studies.phase_diagram import cells

CSV = Path(__file__).parent / "results" / "push.csv"
GROUPS = {
    "today": "today",
    "fast": "with ten times the push",
    "without": "without the push",
    "stiff": "with joints of their own in the pile",
}
BANDS = (("100 to 160 links", 100, 160), ("220 and 240 links", 220, 240))


def reduce(folders: list[str]) -> None:
    """Write Δx of each cell of each group, and how much further its walks go than the same with stiff joints."""
    sweeps = [at_rest(next(iter(warpchain.load(folder).blocks.values()))) for folder in folders]
    stiff = sweeps[0].sel(soften_pile=False)
    rows = []
    for group, dx in zip(GROUPS, [*(sweep.sel(soften_pile=True) for sweep in sweeps), stiff], strict=True):
        for i, j in np.ndindex(dx.shape[:2]):
            row = {"group": group, "links": int(dx.links[i]), "frequency": float(dx.frequency[j])}
            for name, values in (("dx", dx[i, j]), ("more", dx[i, j] - stiff[i, j])):
                row |= {name: float(common.mean(values)), f"{name}_se": float(common.standard_error(values))}
            rows.append(row)
    common.write_rows(CSV, rows)


def over(dx: Array, error: Array, other: Array, its_error: Array) -> str:
    """Mean over cells of the distance over that of others, less 1, with its error."""
    ratio = dx / other
    return shown(ratio - 1, ratio * np.hypot(error / dx, its_error / other))


def shown(shares: Array, errors: Array) -> str:
    """Mean of shares in per cent, with its standard error."""
    return common.minus(common.OverCells(100 * shares, 100 * errors).text(2))


def table() -> str:
    """The table of the page."""
    columns, million = common.read_columns(CSV), common.read_columns(cells.CSV)
    own = {name: {key: values[columns["group"] == name] for key, values in columns.items()} for name in GROUPS}
    links, stiff, at = own["stiff"]["links"], own["stiff"]["dx"], cells.places_in(own["stiff"], million)

    def further(group: str, chosen: Array) -> str:
        return shown(*(own[group][name][chosen] / stiff[chosen] for name in ("more", "more_se")))

    rows = []
    for group, title in GROUPS.items():
        ratio = over(own[group]["dx"], own[group]["dx_se"], million["dx_mean"][at], million["dx_se"][at])
        rows.append([title, ratio, "" if group == "stiff" else further(group, links > 0)])
    for group in ("today", "fast"):
        for name, fewest, most in BANDS:
            text = further(group, (links >= fewest) & (links <= most))
            rows.append([f"{GROUPS[group]}, {name}", "", text])
    return common.table("walks | over the million | over the same walks with joints of their own", rows)


def main(folders: Annotated[list[str] | None, typer.Argument()] = None) -> None:
    """Reduce sweeps that are given; print the table."""
    if folders:
        reduce(folders)
    print(table())


if __name__ == "__main__":
    common.run_study(main)
