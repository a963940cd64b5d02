"""Whether the walks of two sweeps of the same samples end elsewhere, cell by cell.

``python studies/accuracy/compare.py FOLDER BASE`` prints the relative difference of the mean Δx of each cell, that of
FOLDER less that of BASE, with the standard error of pairs of samples; over all cells their mean and χ², scatter and
bounces; and how exact both are.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import warpchain

MILLIMETRES = ("penetration_floor", "penetration_self", "penetration_sprocket", "greatest_opening")


def cells(sweep: Any, column: str) -> dict[tuple[str, ...], NDArray[np.float64]]:
    """Values (samples,) of a column, by block and cell."""
    found = {}
    for block in sweep.blocks.values():
        values = np.asarray(block.columns[column], dtype=np.float64)
        axes = list(block.axes.items())
        for index in np.ndindex(values.shape[:-1]):
            name = tuple(f"{axis}={points[k]}" for (axis, points), k in zip(axes, index, strict=True))
            found[(block.name, *name)] = values[index]
    return found


def describe(sweep: Any) -> str:
    """Depths, openings and errors of all walks of a sweep: median, 99th percentile and greatest."""
    lines = []
    for name in MILLIMETRES:
        values = 1e3 * np.concatenate(list(cells(sweep, name).values()))
        lines.append(
            f"{name} {np.nanmedian(values):.2f}, {np.nanpercentile(values, 99):.2f}, {np.nanmax(values):.2f} mm"
        )
    errors = np.abs(np.concatenate(list(cells(sweep, "energy_error").values())))
    lines.append(f"energy_error 95 % {np.nanpercentile(errors, 95):.1e}, 99 % {np.nanpercentile(errors, 99):.1e}")
    steps = [np.concatenate(list(cells(sweep, f"steps_{kind}").values())) for kind in ("accepted", "rejected")]
    lines.append(
        f"attempted steps {np.sum(steps) / 1e6:.1f} million, in the longest walk {np.max(np.sum(steps, axis=0)):.0f}"
    )
    return "\n  ".join(lines)


def compare(folder: Path, base: Path) -> None:
    """Prints the comparison."""
    new, old = warpchain.load(folder), warpchain.load(base)
    distances, before = cells(new, "dx"), cells(old, "dx")
    bounces, bounces_before = cells(new, "bounces"), cells(old, "bounces")
    differences, errors, scatters, counts = [], [], [], []
    for name in before:
        count = min(len(distances[name]), len(before[name]))
        a, b = distances[name][:count], before[name][:count]
        both = np.isfinite(a) & np.isfinite(b)
        a, b = a[both], b[both]
        differences.append(a.mean() / b.mean() - 1)
        errors.append(np.std(a / a.mean() - b / b.mean(), ddof=1) / np.sqrt(len(a)))
        scatters.append(a.std() / b.std())
        counts.append(bounces[name].mean() / bounces_before[name].mean())
        print(f"{', '.join(name)}: {100 * differences[-1]:+.2f} ± {100 * errors[-1]:.2f} % ({len(a)} pairs)")
    mean, error = np.mean(differences), np.sqrt(np.sum(np.square(errors))) / len(errors)
    chi = np.sum(np.square(np.divide(differences, errors)))
    print(f"mean of {len(errors)} cells {100 * mean:+.3f} ± {100 * error:.3f} %, χ² {chi:.1f}")
    print(f"standard deviations {100 * np.mean(scatters) - 100:+.1f} %, bounces {100 * np.mean(counts) - 100:+.1f} %")
    print(f"{folder}\n  {describe(new)}\n{base}\n  {describe(old)}")


if __name__ == "__main__":
    compare(Path(sys.argv[1]), Path(sys.argv[2]))
