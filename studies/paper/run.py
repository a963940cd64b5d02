"""Makes README.md with its figures, from the folders of the sweeps that test what the paper says.

The numbers go to results/paper_claims.json, and the page is rendered from that file: without a folder only page and
figures are made anew. Sweeps whose folder is not given keep their numbers.
"""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

import warpchain
from studies.common import publish, run_study
from studies.numerics import with_line
from studies.paper.drawing import figures
from studies.paper.reduction import SWEEPS, read, reduced, text_of
from studies.paper.tables import page

FOLDER = Path(__file__).parent
RESULTS = Path("results/paper_claims.json")  # Where the numbers are, in the folder of the page


def make(folders: Annotated[list[Path] | None, typer.Argument()] = None, out: Path = FOLDER) -> None:
    """Reduce the sweeps of these folders, draw the figures and write the page; without folders from known numbers."""
    known: dict[str, Any] = json.loads((out / RESULTS).read_text(encoding="utf-8"))
    sweeps = {sweep.name: sweep for sweep in map(warpchain.load, folders or ())}
    known |= {name: reduced(sweep) for name, sweep in sweeps.items()}
    if missing := [name for name in SWEEPS if name not in known]:
        raise warpchain.InputError(f"{missing[0]}: no numbers of this sweep; pass its folder")
    text = text_of({name: known[name] for name in SWEEPS})
    if folders:
        (out / RESULTS).write_text(text, encoding="utf-8")
    numbers = read(text)
    (out / "README.md").write_text(with_line("paper", page(numbers)), encoding="utf-8")
    publish(out, {}, figures(numbers, sweeps))


if __name__ == "__main__":
    run_study(make)
