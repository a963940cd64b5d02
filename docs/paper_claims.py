"""Makes docs/paper.md with its figures, from the folders of the sweeps that test what the paper says.

    warpchain sweep paper_claims -o paper_claims --device cuda
    warpchain sweep paper_joints -o paper_joints --device cuda
    warpchain sweep paper_tolerance -o paper_tolerance --device cuda
    warpchain sweep paper_shapes -o paper_shapes
    python docs/paper_claims.py paper_claims paper_joints paper_tolerance paper_shapes

The numbers go to docs/results/paper_claims.json, and the page is rendered from that file: without a folder only page
and figures are made anew. Sweeps whose folder is not given keep their numbers. It needs warpchain[scipy].
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any, Final

from paper_page.figures import figures
from paper_page.page import page
from paper_page.reduction import SWEEPS, reduced, text_of

from warpchain.files import write_whole
from warpchain.inputs.validation import InputError
from warpchain.pictures.style import save_figure
from warpchain.store.sweep_result import SweepResult, load

DOCS: Final = Path(__file__).parent
RESULTS: Final = Path("results/paper_claims.json")
"""Where the numbers are, in the folder of the page."""
PAGE: Final = Path("paper.md")
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
    sweeps: dict[str, SweepResult] = {}
    for folder in folders:
        sweep = load(folder)
        known[sweep.name] = reduced(sweep)
        sweeps[sweep.name] = sweep
    if missing := [name for name in SWEEPS if name not in known]:
        raise InputError(f"{missing[0]}: no numbers of this sweep; give its folder")
    numbers = {name: known[name] for name in SWEEPS}
    for path in (results, out / FIGURES / "figure.png"):
        path.parent.mkdir(parents=True, exist_ok=True)
    if folders:
        write_whole(results, text_of(numbers))
    for name, figure in figures(numbers, sweeps):
        save_figure(figure, out / FIGURES / f"{name}.png")
    write_whole(out / PAGE, page(json.loads(text_of(numbers))))


def main(arguments: list[str] | None = None) -> int:
    """The command; its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="*", type=Path, metavar="FOLDER", help="results of a sweep")
    parser.add_argument("-o", "--out", type=Path, default=DOCS, help="folder of the page; default: docs/")
    given = parser.parse_args(arguments)
    try:
        make(given.folders, given.out)
    except (InputError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
