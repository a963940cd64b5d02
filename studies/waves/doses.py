"""Tables of the dose and response of a drag on short waves; files of `studies.waves.drag` are reduced first."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from studies import common
from studies.common import Array
from studies.waves.drag import CELLS, HALVES, SAMPLES, SEEDS, VARIANTS

FOLDER = Path(__file__).parent
RESULTS = FOLDER / "results" / "doses.csv"
SHOWN = (1e-9, *HALVES)  # Rates of the table [1/s]


def reduced(files: Sequence[Path]) -> Iterator[dict[str, object]]:
    """Rows: of each cell, variant and set of seeds the mean Δx, its change in pairs and the standard errors."""
    arrays = {name: values for file in files for name, values in np.load(file).items()}
    parts = {"both": slice(None)} | {seed: slice(k * SAMPLES, (k + 1) * SAMPLES) for k, seed in enumerate(SEEDS)}
    for cell, (links, frequency) in enumerate(CELLS):
        dx = arrays[f"dx{cell}"]
        for walks, (when, rate) in zip(dx, VARIANTS, strict=True):
            for seed, chosen in parts.items():
                change = walks[chosen] - dx[0, chosen]
                both = np.isfinite(change)
                mean, plain = (common.mean(np.where(both, each[chosen], np.nan)) for each in (walks, dx[0]))
                yield {
                    "links": links,
                    "frequency": frequency,
                    "when": when,
                    "rate": f"{rate:g}",
                    "seeds": seed,
                    "pairs": int(both.sum()),
                    "dx": f"{mean:.5g}",
                    "change_percent": f"{100 * common.mean(change) / plain:.4g}",
                    "error_percent": f"{100 * common.standard_error(change) / plain:.3g}",
                }


def changes(when: str, rate: float, seeds: str = "both") -> tuple[Array, Array]:
    """Changes of Δx in per cent and their standard errors, (cells,), from the file."""
    rows = common.read_columns(RESULTS)
    chosen = (rows["when"] == when) & (rows["rate"] == rate) & (rows["seeds"] == seeds)
    return rows["change_percent"][chosen], rows["error_percent"][chosen]


def changes_table(drags: Sequence[tuple[str, float]]) -> str:
    """What some drags change in each cell."""
    known = [[f"{value:+.1f} ± {error:.1f}" for value, error in zip(*changes(*drag), strict=True)] for drag in drags]
    lines = zip((f"{links}, {frequency:g}" for links, frequency in CELLS), *known, strict=True)
    return common.minus(common.table(["links, Hz", *(f"{rate:g}/s {when}" for when, rate in drags)], lines))


def summary_table() -> str:
    """Each drag over the cells: mean, root mean square less errors, range, significant cells."""
    lines = []
    for when, rate in (each for each in VARIANTS[1:] if each[1] in SHOWN):
        values, errors = changes(when, rate)
        over, ends = common.OverCells(values, errors), f"{values.min():+.0f} to {values.max():+.0f}"
        texts = over.text().removesuffix(" %"), f"{over.typical:.1f}", ends, f"{over.rises}, {over.falls}"
        lines.append([f"{rate:g}/s", when, *texts])
    return common.minus(common.table("drag | acts | mean / % | typical / % | range / % | longer, shorter", lines))


def between_seeds() -> str:
    """χ² of each drag between the two sets of seeds, over the cells."""
    texts = []
    for when, rate in VARIANTS[1:]:
        (one, one_error), (two, two_error) = (changes(when, rate, str(seed)) for seed in SEEDS)
        over = common.OverCells(one - two, np.hypot(one_error, two_error))
        texts.append(f"{rate:g}/s {when} {over.chi2:.0f} of {len(over)}")
    return ", ".join(texts)


def tables() -> dict[str, str]:
    """The table of the page by its marker."""
    return {"all doses": summary_table()}


def main(files: Annotated[list[Path] | None, typer.Argument()] = None) -> None:
    """Reduce files that are given, and write the tables."""
    if files:
        common.write_rows(RESULTS, reduced(files), *SEEDS)
    common.show({"doses": changes_table(VARIANTS[2:]), "χ² between seeds": between_seeds()})
    common.publish(FOLDER, tables())


if __name__ == "__main__":
    common.run_study(main)
