"""Tables of the dose and response of a drag on short waves, from what `studies.waves.drag` wrote.

python -m studies.waves.doses drag60.npz drag90.npz …   # → results/doses.csv, tables of the page
python -m studies.waves.doses                           # that file → tables of the page
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import typer

from studies.common import Array, minus, over_cells, publish, read_columns, run_study, table, write_rows
from studies.waves.drag import CELLS, RATES, SAMPLES, SEEDS, VARIANTS

FOLDER: Final = Path(__file__).parent
RESULTS: Final = FOLDER / "results" / "doses.csv"


def reduced(files: Sequence[Path]) -> Iterator[dict[str, object]]:
    """Rows: of each cell, variant and set of seeds the mean Δx, its change in pairs and the standard errors."""
    arrays = {name: values for file in files for name, values in np.load(file).items()}
    for cell, (links, frequency) in enumerate(CELLS):
        if f"dx{cell}" not in arrays:
            continue
        dx = arrays[f"dx{cell}"]
        for k, (when, rate) in enumerate(VARIANTS):
            for number, seed in enumerate(("both", *SEEDS)):
                chosen = slice(None) if number == 0 else slice((number - 1) * SAMPLES, number * SAMPLES)
                walks, plain = dx[k, chosen], dx[0, chosen]
                both = np.isfinite(walks) & np.isfinite(plain)
                change, mean = (walks - plain)[both], plain[both].mean()
                yield {
                    "links": links,
                    "frequency": frequency,
                    "when": when,
                    "rate": f"{rate:g}",
                    "seeds": seed,
                    "pairs": int(both.sum()),
                    "dx": f"{walks[both].mean():.5g}",
                    "change_percent": f"{100 * change.mean() / mean:.4g}",
                    "error_percent": f"{100 * change.std(ddof=1) / np.sqrt(both.sum()) / mean:.3g}",
                }


def changes(when: str, rate: float, seeds: str = "both") -> tuple[Array, Array]:
    """Changes of Δx in per cent and their standard errors, (cells,), from the file."""
    rows = read_columns(RESULTS)
    chosen = (rows["when"] == when) & (rows["rate"] == rate) & (rows["seeds"] == seeds)
    return rows["change_percent"][chosen], rows["error_percent"][chosen]


def _changes_table(drags: Sequence[tuple[str, float]]) -> str:
    known = [changes(*drag) for drag in drags]
    lines = []
    for i, (links, frequency) in enumerate(CELLS):
        texts = (minus(f"{values[i]:+.1f} ± {errors[i]:.1f}") for values, errors in known)
        lines.append([f"{links}, {frequency:g}", *texts])
    return table(["links, Hz", *(f"{rate:g}/s {when}" for when, rate in drags)], lines)


ALWAYS, PARTLY = VARIANTS[2 : 2 + len(RATES)], VARIANTS[2 + len(RATES) :]


def summary_table() -> str:
    """Each drag over the cells: mean, root mean square less errors, significant cells, agreement of the two seeds."""
    lines = []
    for when, rate in VARIANTS[1:]:
        values, errors = changes(when, rate)
        (one, one_error), (two, two_error) = (changes(when, rate, str(seed)) for seed in SEEDS)
        chi2 = over_cells(one - two, np.hypot(one_error, two_error)).chi2
        over, ends = over_cells(values, errors), f"{values.min():+.0f} to {values.max():+.0f} %"
        texts = over.text(), f"{over.typical:.1f} %", ends, f"{over.rises}, {over.falls}"
        lines.append([f"{rate:g}/s", when, *texts, f"{chi2:.0f} of {len(over)}"])
    head = ["drag", "acts", "mean of cells", "typical", "least to greatest", "rise, fall", "χ² between seeds"]
    return minus(table(head, lines))


def tables() -> dict[str, str]:
    """The tables of the page by their markers."""
    return {"doses": _changes_table(ALWAYS), "halves": _changes_table(PARTLY), "all doses": summary_table()}


def main(files: Annotated[list[Path] | None, typer.Argument()] = None) -> None:
    """Reduce files that are given, and write the tables."""
    if files:
        write_rows(RESULTS, reduced(files))
    publish(FOLDER, tables())


if __name__ == "__main__":
    run_study(main)
