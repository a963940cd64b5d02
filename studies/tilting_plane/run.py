"""Writes the table of tilts and draws the figure of studies/tilting_plane/README.md, from the folder of the sweep.

warpchain sweep tilt -o tilt --device cuda
python -m studies.tilting_plane.run tilt      # → results/tilt.csv
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import warpchain
from studies import common
from studies.tilting_plane import taps

FOLDER: Final = Path(__file__).parent


def table(rows: Sequence[Mapping[str, object]]) -> str:
    """What a tilt at the release does, in Markdown: means over the cells, ± standard error; r.m.s. drift and yaw."""
    head = ("tilt / rad", "fell over", "before the loop collapsed", "Δx, tilting over fixed", "least and greatest cell")
    return common.table(
        (*head, "drift / m", "yaw / °"),
        (
            (
                *(str(row["tap"]).split()[1], f"{row['fell']} %", f"{row['early']} %"),
                *(f"{row['ratio']} ± {row['error']}", f"{row['least']}, {row['greatest']}", str(row["drift"])),
                str(row["yaw"]),
            )
            for row in rows
            if row["links"] == "all"
        ),
    )


def main(folder: str) -> None:
    """Write the table and draw the fraction of walks that fell over."""
    result = warpchain.load(folder)
    if not {"fixed", "tilted"} <= result.blocks.keys():
        raise warpchain.InputError(f"{folder}: no blocks fixed and tilted; give a folder of the sweep tilt")
    rows = list(taps.reduced(result))
    common.write_rows(FOLDER / "results" / "tilt.csv", rows)
    common.write_tables(FOLDER / "README.md", {"tilt": table(rows)})
    common.save_figure(result.plot(quantity="fell_over"), FOLDER / "figures" / "falls.png")


if __name__ == "__main__":
    common.run_study(main)
