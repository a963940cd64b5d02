"""Tables of the dose and response of a drag on short waves, from what `studies.waves.drag` wrote.

python -m studies.waves.doses drag60.npz drag90.npz …   # → results/doses.csv, tables of the page
python -m studies.waves.doses                           # that file → tables of the page
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import typer

from studies.common import read_rows, run_study, table, write_rows, write_tables
from studies.waves.drag import CELLS, HALVES, RATES, SAMPLES, SEEDS, VARIANTS

FOLDER: Final = Path(__file__).parent
RESULTS: Final = FOLDER / "results" / "doses.csv"
Row = Mapping[str, str]


def reduced(files: Sequence[Path]) -> Iterator[dict[str, object]]:
    """Rows: of each cell, variant and set of seeds the mean Δx, its change in pairs and the standard errors."""
    arrays = {name: values for file in files for name, values in np.load(file).items()}
    for cell, (links, frequency) in enumerate(CELLS):
        if f"dx{cell}" not in arrays:
            continue
        dx = arrays[f"dx{cell}"]
        for k, variant in enumerate(VARIANTS):
            for number, seed in enumerate(("both", *SEEDS)):
                chosen = slice(None) if number == 0 else slice((number - 1) * SAMPLES, number * SAMPLES)
                walks, plain = dx[k, chosen], dx[0, chosen]
                both = np.isfinite(walks) & np.isfinite(plain)
                change, mean = (walks - plain)[both], plain[both].mean()
                yield {
                    "links": links,
                    "frequency": frequency,
                    "when": variant.when,
                    "rate": f"{variant.rate:g}",
                    "seeds": seed,
                    "pairs": int(both.sum()),
                    "dx": f"{walks[both].mean():.5g}",
                    "change_percent": f"{100 * change.mean() / mean:.4g}",
                    "error_percent": f"{100 * change.std(ddof=1) / np.sqrt(both.sum()) / mean:.3g}",
                }


def changes(rows: Sequence[Row], when: str, rate: float, seeds: str = "both") -> tuple[np.ndarray, np.ndarray]:
    """Changes of Δx in per cent and their standard errors, (cells,)."""
    found = [
        (float(row["change_percent"]), float(row["error_percent"]))
        for row in rows
        if (row["when"], float(row["rate"]), row["seeds"]) == (when, rate, seeds)
    ]
    values, errors = np.array(found).T
    return values, errors


def _changes_table(rows: Sequence[Row], columns: Sequence[tuple[str, float]]) -> str:
    cells = [(row["links"], row["frequency"]) for row in rows if row["seeds"] == "both" and row["rate"] == "0"]
    known = [changes(rows, *column) for column in columns]
    lines = [
        [
            f"{links}, {float(frequency):g}",
            *(f"{values[i]:+.1f} ± {errors[i]:.1f}".replace("-", "−") for values, errors in known),
        ]
        for i, (links, frequency) in enumerate(cells)
    ]
    return table(["links, Hz", *(f"{rate:g}/s {when}" for when, rate in columns)], lines)


def summary_table(rows: Sequence[Row]) -> str:
    """Each drag over the cells: mean, root mean square less errors, significant cells, agreement of the two seeds."""
    lines = []
    known = [("always", 1e-9), *(("always", rate) for rate in RATES)]
    known += [(when, rate) for when in ("in flight", "in impacts") for rate in HALVES]
    for when, rate in known:
        values, errors = changes(rows, when, rate)
        sets = [changes(rows, when, rate, str(seed)) for seed in SEEDS]
        chi2 = float(np.sum((sets[0][0] - sets[1][0]) ** 2 / (sets[0][1] ** 2 + sets[1][1] ** 2)))
        scatter = np.sqrt(max(0.0, float(np.mean(values**2 - errors**2))))
        rises, falls = (int(np.sum(sign * values > 1.96 * errors)) for sign in (1, -1))
        texts = f"{values.mean():+.1f} ± {np.sqrt(np.sum(errors**2)) / len(values):.1f} %", f"{scatter:.1f} %"
        ends = f"{values.min():+.0f} to {values.max():+.0f} %"
        lines.append([f"{rate:g}/s", when, *texts, ends, f"{rises}, {falls}", f"{chi2:.0f} of {len(values)}"])
    head = ["drag", "acts", "mean of cells", "typical", "least to greatest", "rise, fall", "χ² between seeds"]
    return table(head, lines).replace("-", "−").replace("−−−", "---")


def tables(rows: Sequence[Row]) -> dict[str, str]:
    """The tables of the page by their markers."""
    halves = [(when, rate) for when in ("in flight", "in impacts") for rate in HALVES]
    return {
        "doses": _changes_table(rows, [("always", rate) for rate in RATES]),
        "halves": _changes_table(rows, halves),
        "all doses": summary_table(rows),
    }


def main(files: Annotated[list[Path] | None, typer.Argument()] = None) -> None:
    """Reduce files that are given, and write the tables."""
    if files:
        write_rows(RESULTS, list(reduced(files)))
    write_tables(FOLDER / "README.md", tables(read_rows(RESULTS)))


if __name__ == "__main__":
    run_study(main)
