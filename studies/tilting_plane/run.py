"""Writes the table and draws the figure of studies/tilting_plane/README.md, from the folder of the sweep.

    warpchain sweep tilt -o tilt --device cuda
    python -m studies.tilting_plane.run tilt

The table is also printed.
"""

import argparse
import sys
from pathlib import Path
from typing import Final

import numpy as np

import warpchain
from studies.common import save_figure, write_tables

FOLDER: Final = Path(__file__).parent


def table(result: warpchain.SweepResult) -> str:
    """What a tilt at the release does, in Markdown: means over the cells, ± standard error; r.m.s. drift and yaw."""
    fixed, tilted = (result.blocks[name] for name in ("fixed", "tilted"))
    columns, reference = tilted.columns, fixed.statistics()
    cells = tilted.statistics()
    lines = [
        "| tilt / rad | fell over | before the loop collapsed | Δx, tilting over fixed | least and greatest cell "
        "| drift / m | yaw / ° |",
        "|---|---|---|---|---|---|---|",
    ]
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
        lines.append(
            f"| {tilt:g} | {100 * fell:.3g} % | {100 * early:.2g} % | {ratio.mean():.3f} ± {error:.3f} "
            f"| {ratio.min():.2f}, {ratio.max():.2f} | {drift:.3f} | {np.degrees(yaw):.2g} |"
        )
    return "\n".join(lines)


def main(folder: str) -> None:
    """Write the table and draw the fraction of walks that fell over."""
    result = warpchain.load(folder)
    if not {"fixed", "tilted"} <= result.blocks.keys():
        raise warpchain.InputError(f"{folder}: no blocks fixed and tilted; give a folder of the sweep tilt")
    write_tables(FOLDER / "README.md", {"tilt": table(result)})
    save_figure(result.plot(quantity="fell_over"), FOLDER / "figures" / "falls.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", metavar="FOLDER", help="results of the sweep")
    try:
        main(parser.parse_args().folder)
    except (warpchain.InputError, OSError) as error:
        sys.exit(str(error))
