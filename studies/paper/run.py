"""Makes studies/paper/README.md with its figures, from the folders of the sweeps that test what the paper says.

    for each in claims joints tolerance shapes; do
        warpchain sweep studies/paper/sweeps/paper_$each.yaml -o paper_$each
    done
    python -m studies.paper.run paper_claims paper_joints paper_tolerance paper_shapes

The numbers go to results/paper_claims.json, and the page is rendered from that file: without a folder only page and
figures are made anew. Sweeps whose folder is not given keep their numbers.
"""

import json
from pathlib import Path
from typing import Annotated, Any, Final

import typer

import warpchain
from studies.common import run_study, save_figure, write_text
from studies.paper.drawing import figures
from studies.paper.page import page
from studies.paper.reduction import SWEEPS, reduced, text_of

FOLDER: Final = Path(__file__).parent
RESULTS: Final = Path("results/paper_claims.json")
"""Where the numbers are, in the folder of the page."""
PAGE: Final = Path("README.md")
FIGURES: Final = Path("figures")


def make(folders: Annotated[list[Path] | None, typer.Argument()] = None, out: Path = FOLDER) -> None:
    """Reduce the sweeps of these folders, draw the figures and write the page; without folders from known numbers."""
    results = out / RESULTS
    known: dict[str, Any] = json.loads(results.read_text(encoding="utf-8")) if results.exists() else {}
    sweeps: dict[str, warpchain.SweepResult] = {}
    for folder in folders or ():
        sweep = warpchain.load(folder)
        known[sweep.name] = reduced(sweep)
        sweeps[sweep.name] = sweep
    if missing := [name for name in SWEEPS if name not in known]:
        raise warpchain.InputError(f"{missing[0]}: no numbers of this sweep; give its folder")
    numbers = {name: known[name] for name in SWEEPS}
    if folders:
        write_text(results, text_of(numbers))
    for name, figure in figures(numbers, sweeps):
        save_figure(figure, out / FIGURES / f"{name}.png")
    write_text(out / PAGE, page(json.loads(text_of(numbers))))


if __name__ == "__main__":
    run_study(make)
