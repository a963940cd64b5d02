"""Compares the walks of two sweeps of the same samples, cell by cell; README.md has the commands.

It writes results/NEW-BASE.csv and prints the relative difference of the mean Δx of each cell with the standard error of
pairs of samples; over all cells their mean and χ², scatter and bounces; and how exact either is. Of one sweep with
points it compares each point with the last, writes results/NAME.csv, and puts the table NAME into README.md.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import warpchain
from studies.common import Array, OverCells, of_cells, publish, run_study, table, write_rows

FOLDER = Path(__file__).parent
STEPS = ("steps_accepted", "steps_rejected")


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
    steps = sum(together(sweep, name) for name in STEPS)
    print(f"  energy_error: 95th percentile {high:.1e}, 99th {higher:.1e}")
    print(f"  attempted steps: {steps.sum() / 1e6:.1f} million, in the longest walk {steps.max():.0f}")


def change(new: Array, base: Array) -> dict[str, float]:
    """Pairs of samples that both walked, relative change of the mean and its standard error, both in per cent."""
    pairs = np.isfinite(new) & np.isfinite(base)
    a, b = new[pairs] / new[pairs].mean(), base[pairs] / base[pairs].mean()
    error = np.std(a - b, ddof=1) / np.sqrt(len(a))
    return {
        "pairs": len(a),
        "change_percent": 100 * float(new[pairs].mean() / base[pairs].mean() - 1),
        "error": 100 * float(error),
    }


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
        found = change(a, b)
        pairs = np.isfinite(a) & np.isfinite(b)
        spread = a[pairs].std() / b[pairs].std(), bounces[name].mean() / base_bounces[name].mean()
        rows.append((found["change_percent"], found["error"], *spread))
        cells_of_file.append({"cell": name, **found})
        print(f"{name}: {found['change_percent']:+.2f} ± {found['error']:.2f} % ({found['pairs']} pairs)")
    write_rows(FOLDER / "results" / f"{new.name}-{base.name}.csv", cells_of_file, new, base)
    differences, errors, scatter, bounced = np.array(rows).T
    over = OverCells(differences, errors)
    print(f"mean of {len(rows)} cells {over.mean:+.3f} ± {over.error:.3f} %, χ² {over.chi2:.1f}")
    print(f"standard deviations {100 * scatter.mean() - 100:+.1f} %, bounces {100 * bounced.mean() - 100:+.1f} %")


def compare_points(sweep: warpchain.SweepResult) -> None:
    """Write how Δx at each point of a sweep differs from that at the last, to a file and to the page."""
    settings = [block["points"] for block in sweep.sweep["blocks"] if block.get("points")]
    if len(settings) != 1 or len(sweep.blocks) != 1:
        raise warpchain.InputError(f"{sweep.name}: not one block with points; pass a second folder to compare it with")
    (block,), (fields,) = sweep.blocks.values(), settings
    points = list(zip(*fields.values(), strict=True))
    walks = {name: block.columns[name].reshape(len(points), -1).astype(float) for name in ("dx", *STEPS)}
    steps = sum(walks[name] for name in STEPS).mean(axis=1)
    rows, lines = [], []
    for point, dx, count in zip(points[:-1], walks["dx"][:-1], steps[:-1], strict=True):
        found = change(dx, walks["dx"][-1])
        rows.append({**dict(zip(fields, point, strict=True)), **found, "steps": round(count)})
        by = "{change_percent:+.2f} ± {error:.2f}".format(**found).replace("-", "−")
        lines.append([*map(_of_point, point), f"{count:,.0f}", by])
    write_rows(FOLDER / "results" / f"{sweep.name}.csv", rows, sweep)
    head = [*(f"`{name}`" for name in fields), "attempted steps", "change of Δx / %"]
    publish(FOLDER, {sweep.name: table(head, lines)})


def _of_point(value: object) -> str:
    """A value of a point, for a table."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else f"`{value}`"


def main(folder: str, base: Annotated[str | None, typer.Argument()] = None) -> None:
    """Compare two folders, or the points of one."""
    if base is None:
        return compare_points(warpchain.load(folder))
    sweeps = warpchain.load(folder), warpchain.load(base)
    compare(*sweeps)
    for sweep in sweeps:
        describe(sweep)


if __name__ == "__main__":
    run_study(main)
