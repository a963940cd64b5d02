"""Makes the numbers, figures and tables of studies/phase_diagram/README.md.

    python -m studies.phase_diagram.run                    # results/*.csv → figures and tables of the page
    python -m studies.phase_diagram.run FOLDER…            # parts of the sweep phase_diagram → results/cells.csv, first
    python -m studies.phase_diagram.run --scaling FOLDER   # the sweep scaling → results/scaling.csv, first
    python -m studies.phase_diagram.run --meetings FOLDER…  # parts of the sweep strands → results/strands.csv, first

Parts are folders of ``warpchain sweep``. They have other seeds; they may be unfinished, and their grids may differ.
Without a folder it takes one to two minutes.
"""

from pathlib import Path
from typing import Annotated, Final

import typer

import warpchain
from studies.common import read_rows, run_study, write_rows, write_tables
from studies.phase_diagram import candidates, cells, drawing, scales, strands
from studies.phase_diagram.tables import TABLES

FOLDER: Final = Path(__file__).parent


def make(
    parts: Annotated[list[str] | None, typer.Argument()] = None,
    scaling: str | None = None,
    meetings: list[str] | None = None,
) -> None:
    """Reduce the sweeps that are given into the committed files; then draw and write all that is in them."""
    if parts:
        walks = cells.walks_by_cell([warpchain.load(path) for path in parts])
        write_rows(cells.CSV, [cells.reduced(*cell, columns) for cell, columns in walks.items()])
    if scaling is not None:
        write_rows(scales.CSV, scales.reduced(warpchain.load(scaling)))
    if meetings:
        write_rows(strands.CSV, list(strands.reduced([warpchain.load(path) for path in meetings])))
    found = cells.read_csv()
    varied, curve = scales.Cells(read_rows(scales.CSV)), scales.Curve(found)
    tables = (
        {name: render(found) for name, render in TABLES.items()}
        | {
            "scales": scales.table(varied, curve),
            "candidates": candidates.table(found, varied),
            "walking time": candidates.walking_time(found),
        }
        | strands.tables(cells.read_csv(strands.CSV), found)
    )
    write_tables(FOLDER / "README.md", tables)
    drawing.draw_maps(found, FOLDER / "figures" / "maps.png")
    drawing.draw_laws(found, FOLDER / "figures" / "laws.png")
    scales.draw(varied, curve, FOLDER / "figures" / "scales.png")


if __name__ == "__main__":
    run_study(make)
