"""Writes the table and draws the figure of studies/tilting_plane/README.md, from the folder of the sweep.

    warpchain sweep tilt -o tilt --device cuda
    python -m studies.tilting_plane.run tilt

The table is also printed.
"""

from pathlib import Path
from typing import Final

import numpy as np

import warpchain
from studies import common

FOLDER: Final = Path(__file__).parent


def table(result: warpchain.SweepResult) -> str:
    """What a tilt at the release does, in Markdown: means over the cells, ± standard error; r.m.s. drift and yaw."""
    fixed, tilted = (result.blocks[name] for name in ("fixed", "tilted"))
    columns, reference = tilted.columns, fixed.statistics()
    cells = tilted.statistics()
    head = ("tilt / rad", "fell over", "before the loop collapsed", "Δx, tilting over fixed", "least and greatest cell")
    rows = []
    for size, tilt in enumerate(tilted.axes["tilt"]):
        ratio = cells.mean[:, :, size] / reference.mean
        errors = np.hypot(
            cells.standard_error[:, :, size] / cells.mean[:, :, size], reference.standard_error / reference.mean
        )
        error = np.sqrt(np.sum((ratio * errors) ** 2)) / ratio.size
        fell, early = (columns[name][:, :, size].mean() for name in ("fell_over", "fell_before_collapse"))
        drift, yaw = (
            np.sqrt(np.nanmean(columns[name][:, :, size].astype(float) ** 2)) for name in ("lateral_drift", "final_yaw")
        )
        rows.append(
            (
                *(f"{tilt:g}", f"{100 * fell:.3g} %", f"{100 * early:.2g} %", f"{ratio.mean():.3f} ± {error:.3f}"),
                *(f"{ratio.min():.2f}, {ratio.max():.2f}", f"{drift:.3f}", f"{np.degrees(yaw):.2g}"),
            )
        )
    return common.table((*head, "drift / m", "yaw / °"), rows)


def main(folder: str) -> None:
    """Write the table and draw the fraction of walks that fell over."""
    result = warpchain.load(folder)
    if not {"fixed", "tilted"} <= result.blocks.keys():
        raise warpchain.InputError(f"{folder}: no blocks fixed and tilted; give a folder of the sweep tilt")
    common.write_tables(FOLDER / "README.md", {"tilt": table(result)})
    common.save_figure(result.plot(quantity="fell_over"), FOLDER / "figures" / "falls.png")


if __name__ == "__main__":
    common.run_study(main)
