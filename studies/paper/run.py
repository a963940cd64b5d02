"""Makes studies/paper/README.md with its figures, from the folders of the sweeps that test what the paper says.

    for each in claims joints tolerance shapes; do
        warpchain sweep studies/paper/sweeps/paper_$each.yaml -o paper_$each
    done
    python -m studies.paper.run paper_claims paper_joints paper_tolerance paper_shapes

The numbers go to results/paper_claims.json, and the page is rendered from that file: without a folder only page and
figures are made anew. Sweeps whose folder is not given keep their numbers.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any, Final

import warpchain
from studies.common import save_figure, write_text
from studies.paper.drawing import figures
from studies.paper.page import page
from studies.paper.reduction import SWEEPS, reduced, text_of

FOLDER: Final = Path(__file__).parent
RESULTS: Final = Path("results/paper_claims.json")
"""Where the numbers are, in the folder of the page."""
PAGE: Final = Path("README.md")
FIGURES: Final = Path("figures")


def make(folders: list[Path], out: Path) -> None:
    """Reduce sweeps, draw their figures and write the page.

    Args:
        folders: of sweeps; may be empty.
        out: folder of the page.

    Raises:
        InputError: a folder has no sweep of the page, or one that is not complete, or numbers of a sweep are missing.
        OSError: a folder cannot be read, or a file not be written.
    """
    results = out / RESULTS
    known: dict[str, Any] = json.loads(results.read_text(encoding="utf-8")) if results.exists() else {}
    sweeps: dict[str, warpchain.SweepResult] = {}
    for folder in folders:
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


def main(arguments: list[str] | None = None) -> int:
    """The command; its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="*", type=Path, metavar="FOLDER", help="results of a sweep")
    parser.add_argument("-o", "--out", type=Path, default=FOLDER, help="folder of the page; default: studies/paper/")
    given = parser.parse_args(arguments)
    try:
        make(given.folders, given.out)
    except (warpchain.InputError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
