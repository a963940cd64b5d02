"""How far the numbers of the studies have moved since another revision, in units of their standard errors.

`python -m studies.changes REVISION` prints, of each file in results/ that both have, χ² over the cells and the farthest
cells, and writes the table of README.md. Blocks that walk the same samples again differ by less than their errors say.
"""

import io
import json
import subprocess
from collections.abc import Iterator
from typing import Annotated, Any

import numpy as np
import pandas
import typer
from scipy import stats

from studies import numerics
from studies.all import read_times
from studies.common import minus, run_study, show, table, with_tables

FOLDER = numerics.TABLE.parent
SHOWN = 12  # Cells of a file that are printed, the farthest first
KEYS = (
    *("block", "links", "frequency", "gravity", "radius", "link_length", "charm_mass", "floor_friction", "slope"),
    *("held_on", "tap", "when", "rate", "wave", "size"),
    *("cell", "method", "tolerance", "contact_step", "soften_pile"),
)
"""Columns that tell cells apart."""
VALUES = (
    ("dx_mean", "dx_se"),
    ("held", "held_se"),
    ("dx", "standard_error"),
    ("ratio", "error"),
    ("change_percent", "error_percent"),
    ("change_percent", "error"),
    ("change", "error"),
)
"""Columns of a value and its standard error; the first pair that a file has is compared."""


def cells_of(path: str, text: str) -> pandas.DataFrame:
    """Value and standard error of each cell of a file."""
    if path.endswith(".json"):
        rows = {name: row for name, content in json.loads(text).items() for name, row in _of_json(name, content)}
        return pandas.DataFrame.from_dict(rows, orient="index", columns=["value", "error"])
    rows = pandas.read_csv(io.StringIO(text), comment="#")
    value, error = next((pair for pair in VALUES if {*pair} <= {*rows.columns}), (None, None))
    if value is None:
        return pandas.DataFrame(columns=["value", "error"])
    if "seeds" in rows:
        rows = rows[rows["seeds"] == "both"]
    keys = [rows[key].map(lambda each: each if isinstance(each, str) else f"{each:g}") for key in KEYS if key in rows]
    names = [", ".join(each) for each in zip(*keys, strict=True)]
    return pandas.DataFrame({"value": rows[value].to_numpy(), "error": rows[error].to_numpy()}, index=names)


def _of_json(name: str, content: Any) -> Iterator[tuple[str, tuple[float, float]]]:
    """Means of Δx and relative effects in the numbers of one sweep of the paper, each with its standard error."""
    if isinstance(content, list) and content and isinstance(content[0], dict):
        for number, each in enumerate(content):
            yield from _of_json(f"{name} {each.get('value', number)}", each)
    elif isinstance(content, dict) and isinstance(content.get("half_width"), list):
        columns = (np.array(content[key], float).ravel() for key in ("relative", "half_width", "pairs"))
        for cell, (value, width, pairs) in enumerate(zip(*columns, strict=True)):
            if pairs > 1:
                yield f"{name} {cell}", (value, width / stats.t.ppf(0.975, pairs - 1))
    elif isinstance(content, dict):
        for key, each in content.items():
            yield from _of_json(f"{name} {key}", each)


def moved(path: str, revision: str) -> tuple[str, pandas.Series] | None:
    """Numerics of a file before, and by cell the difference over its standard error; None if it was not there."""
    found = subprocess.run(["git", "show", f"{revision}:studies/{path}"], cwd=FOLDER, capture_output=True, text=True)
    if found.returncode:
        return None
    before, now = cells_of(path, found.stdout), cells_of(path, (FOLDER / path).read_text(encoding="utf-8"))
    both = before.join(now.rename(columns="{}_now".format), how="inner", validate="one_to_one")
    error = np.hypot(both["error"], both["error_now"])
    sizes = ((both["value_now"] - both["value"]) / error)[error > 0].dropna()
    return ", ".join(map(str, sorted(_numerics(path, found.stdout)))), sizes


def _numerics(path: str, text: str) -> set[int]:
    """Versions that such a text was computed with."""
    if path.endswith(".json"):
        return {each["numerics_version"] for each in json.loads(text).values()}
    return {int(each) for each in text.split(";")[0].removeprefix("# numerics ").split(" and ")}


def main(revision: Annotated[str, typer.Argument(help="A commit with earlier results.")]) -> None:
    """Compare all files of results with those of a revision."""
    times, rows = read_times(), []
    for path in sorted(FOLDER.glob("*/results/*")):
        name = path.relative_to(FOLDER).as_posix()
        if (found := moved(name, revision)) is None or not len(found[1]):
            continue
        before, sizes = found
        of_study = times[(times["study"] == path.parts[-3]) & (times["device"] != "CPU")]
        spent = f"{of_study['walks'].sum():,}", f"{(of_study['seconds'] * of_study['devices']).sum():.0f}"
        beyond = sizes[sizes.abs() > 3]
        rows.append((name.replace("results/", ""), *spent, before, len(sizes), sizes.pow(2).sum(), len(beyond)))
        print(f"{name}: mean {sizes.mean():+.2f}")
        for cell in sizes.abs().nlargest(SHOWN).index:
            print(f"  {cell}: {sizes[cell]:+.1f}")
    head = "numbers | walks of the study | H200 s | numerics before | cells | χ² | beyond 3 σ"
    tables = {"changes": minus(table(head, rows, "s s s s d .0f d"))}
    show(tables)
    page = FOLDER / "README.md"
    page.write_text(with_tables(page.read_text(encoding="utf-8"), tables), encoding="utf-8")


if __name__ == "__main__":
    run_study(main)
