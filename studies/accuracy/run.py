"""Compares the walks of two sweeps of the same samples, cell by cell; README.md has the commands.

It writes results/NEW-BASE.csv and prints the relative difference of the mean Δx of each cell with the standard error of
pairs of samples; over all cells their mean and χ², scatter and bounces; and how exact either is.
"""

from pathlib import Path

import numpy as np

import warpchain
from studies.common import Array, OverCells, of_cells, run_study, write_rows

FOLDER = Path(__file__).parent


def cells(sweep: warpchain.SweepResult, column: str) -> dict[str, Array]:
    """Values (samples,) of a column, by block and cell."""
    found = {}
    for name, block in sweep.blocks.items():
        for place, at in of_cells(block):
            cell = ", ".join([name, *(f"{axis} {value:g}" for axis, value in at.items())])
            found[cell] = block.columns[column][place].astype(float)
    return found


def together(sweep: warpchain.SweepResult, column: str) -> Array:
    """All values of a column."""
    return np.concatenate(list(cells(sweep, column).values()))


def describe(sweep: warpchain.SweepResult) -> None:
    """Print depths, openings, errors of the energy and steps of all walks of a sweep."""
    print(sweep.name)
    for column in ("penetration_floor", "penetration_self", "penetration_sprocket", "greatest_opening"):
        middle, high, greatest = 1e3 * np.nanpercentile(together(sweep, column), [50, 99, 100])
        print(f"  {column}: median {middle:.2f}, 99th percentile {high:.2f}, greatest {greatest:.2f} mm")
    high, higher = np.nanpercentile(np.abs(together(sweep, "energy_error")), [95, 99])
    steps = together(sweep, "steps_accepted") + together(sweep, "steps_rejected")
    print(f"  energy_error: 95th percentile {high:.1e}, 99th {higher:.1e}")
    print(f"  attempted steps: {steps.sum() / 1e6:.1f} million, in the longest walk {steps.max():.0f}")


def compare(new: warpchain.SweepResult, base: warpchain.SweepResult) -> None:
    """Write and print how the walks of one sweep differ from those of another."""
    distances, bounces = cells(new, "dx"), cells(new, "bounces")
    base_distances, base_bounces = cells(base, "dx"), cells(base, "bounces")
    if distances.keys() != base_distances.keys():
        raise warpchain.InputError(
            f"{new.name} and {base.name}: other cells; use sweeps with the same blocks and grids"
        )
    rows, cells_of_file = [], []
    for name, b in base_distances.items():
        a = distances[name][: len(b)]
        b = b[: len(a)]
        pairs = np.isfinite(a) & np.isfinite(b)
        a, b = a[pairs], b[pairs]
        difference, error = a.mean() / b.mean() - 1, np.std(a / a.mean() - b / b.mean(), ddof=1) / np.sqrt(len(a))
        rows.append((difference, error, a.std() / b.std(), bounces[name].mean() / base_bounces[name].mean()))
        cells_of_file.append({"cell": name, "pairs": len(a), "change_percent": 100 * difference, "error": 100 * error})
        print(f"{name}: {100 * difference:+.2f} ± {100 * error:.2f} % ({len(a)} pairs)")
    write_rows(FOLDER / "results" / f"{new.name}-{base.name}.csv", cells_of_file, new, base)
    differences, errors, scatter, bounced = np.array(rows).T
    over = OverCells(100 * differences, 100 * errors)
    print(f"mean of {len(rows)} cells {over.mean:+.3f} ± {over.error:.3f} %, χ² {over.chi2:.1f}")
    print(f"standard deviations {100 * scatter.mean() - 100:+.1f} %, bounces {100 * bounced.mean() - 100:+.1f} %")


def main(folder: str, base: str) -> None:
    """Compare two folders."""
    sweeps = warpchain.load(folder), warpchain.load(base)
    compare(*sweeps)
    for sweep in sweeps:
        describe(sweep)


if __name__ == "__main__":
    run_study(main)
