"""Does Δx depend on how the loop came to spin, and how long it was held? A table of README.md, and further ones."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import warpchain
from studies import common
from studies.common import DRAWN, Array

Key = tuple[str, int, float, float]  # Block, links, frequency [Hz], time for which loops were held on [s]
Cells = Mapping[Key, Mapping[str, float]]

CSV = Path(__file__).parent / "results" / "starts.csv"
PAGE = Path(__file__).parent / "README.md"
QUANTITIES = ("dx", "release_center_x", "release_width", "release_height")
"""Distance of the walk; place of the centre of mass, width and height of the loop at the release [m]."""
STARTS = ("spinning", "rest", "undamped")
LOOPS = {
    "`rest`": (("rest", 0.0),),
    "`spinning`": (("spinning", 0.0), ("held_on", 0.0)),
    "held 30 s": (("undamped", 0.0), ("swing", 30.0)),
    "released at once": (("rest", 0.0), ("spinning", 0.0), ("held_on", 0.0)),
    "held on": tuple(("held_on", time) for time in (5.0, 10.0, 20.0)),
}
"""Loops of one kind: name → blocks, and times for which they held their loops on, of the same scene."""
OURS = ("`spinning`", "`rest`")
COMPARED = (
    ("`rest`", "`spinning`"),
    ("`spinning`", "held 30 s"),
    ("`rest`", "held 30 s"),
    ("released at once", "held on"),
    ("held 30 s", "held on"),
)
SLOW = 10.0  # Frequency [Hz] at which loops hardly swing
LONG = 150  # Links from which loops are called long


def reduced(results: list[warpchain.SweepResult]) -> Iterator[dict[str, Any]]:
    """Mean and standard error of each quantity by cell; blocks of the same name are put together."""
    found: dict[Key, list[dict[str, Array]]] = {}
    for result in results:
        for name, block in result.blocks.items():
            names = [name for name in block.columns if name in QUANTITIES or name.endswith(DRAWN)]
            for place, at in common.of_cells(block):
                key = name, int(at["links"]), float(at["frequency"]), float(at.get("extra_hold", 0))
                found.setdefault(key, []).append({each: block.columns[each][place].astype(float) for each in names})
    cells = {}
    for key, parts in sorted(found.items()):
        walks = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        cells[key] = {name: values[np.isfinite(walks["dx"])] for name, values in walks.items()}
    held = with_draws_held(cells)
    for key, walks in cells.items():
        row: dict[str, Any] = dict(zip(("block", "links", "frequency", "held_on"), key, strict=True))
        row["walks"] = len(walks["dx"])
        for quantity, each in ({name: walks[name] for name in QUANTITIES} | {"held": held[key]}).items():
            row |= {quantity: float(common.mean(each)), f"{quantity}_se": float(common.standard_error(each))}
        yield row


def with_draws_held(cells: Mapping[Key, Mapping[str, Array]]) -> dict[Key, Array]:
    """Δx of all walks less what is due to their draws: one linear function for all blocks of a preset and a cell.

    Blocks draw their samples apart, so this takes scatter from their differences and no part of these.
    """
    groups: dict[tuple[Any, ...], list[Key]] = {}
    for key in cells:
        groups.setdefault((key[0].startswith("paper"), *key[1:3]), []).append(key)
    held = {}
    for keys in groups.values():
        walks = {name: np.concatenate([cells[key][name] for key in keys]) for name in cells[keys[0]]}
        ends = np.cumsum([len(cells[key]["dx"]) for key in keys])
        own = np.repeat(np.eye(len(keys)), np.diff(ends, prepend=0), axis=0)
        terms = np.stack(common.drawn_terms(walks), axis=1)
        weights = np.linalg.lstsq(np.hstack([terms, own]), walks["dx"], rcond=None)[0][: terms.shape[1]]
        held |= dict(zip(keys, np.split(walks["dx"] - terms @ weights, ends[:-1]), strict=True))
    return held


def read() -> dict[Key, dict[str, float]]:
    """The rows of the file by cell."""
    names, columns = zip(*common.read_columns(CSV).items(), strict=True)
    rows = (dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True))
    return {(str(row["block"]), int(row["links"]), row["frequency"], row["held_on"]): row for row in rows}


def _ratio(one: Mapping[str, float], other: Mapping[str, float]) -> tuple[float, float]:
    """Δx of one cell over that of the other, less 1, in per cent, with its standard error; what is drawn is held."""
    size = one["held"] / other["held"]
    error = size * float(np.hypot(one["held_se"] / one["held"], other["held_se"] / other["held"]))
    return 100 * (size - 1), 100 * error


def _together(cells: Cells, loops: str, cell: tuple[int, float]) -> dict[str, float]:
    """Δx with what is drawn held, of all `LOOPS` of this name in a cell, weighted by their walks; empty without any."""
    parts = [cells[block, *cell, time] for block, time in LOOPS[loops] if (block, *cell, time) in cells]
    if not parts:
        return {}
    size, value, error = np.array([[part[name] for name in ("walks", "held", "held_se")] for part in parts]).T
    return {"held": np.average(value, weights=size), "held_se": np.linalg.norm(size * error) / size.sum()}


def starts(cells: Cells) -> str:
    """Δx of each start, and how far each is from the loops held for 30 s, in Δx and at the release."""
    rows = []
    for _, links, frequency, _ in sorted(key for key in cells if key[0] == "rest"):
        own = {start: cells[start, links, frequency, 0.0] for start in STARTS}
        held = own["undamped"]
        texts = [f"{each['dx']:.4f} ± {each['dx_se']:.4f}" for each in own.values()]
        for start in OURS:
            size, error = _ratio(*(_together(cells, name, (links, frequency)) for name in (start, "held 30 s")))
            texts.append(f"{size:+.2f} ± {error:.2f}")
        for quantity in ("release_center_x", "release_width"):
            each = (f"{1e3 * (own[start][quantity] - held[quantity]):+.2f}" for start in STARTS[:2])
            error = np.hypot(own["rest"][f"{quantity}_se"], held[f"{quantity}_se"])
            texts.append(f"{', '.join(each)} ± {1e3 * error:.2f}")
        rows.append((links, f"{frequency:g}", *texts))
    head = "links | Hz | `spinning` / m | `rest` / m | held 30 s / m | `spinning` − held / % | `rest` − held / %"
    return common.table(f"{head} | place / mm | width / mm", rows)


def means(cells: Cells) -> str:
    """Means over the cells of the differences between starts, and of these from loops that were held on."""
    every = sorted(key[1:3] for key in cells if key[0] == "rest")
    long = [cell for cell in every if cell[0] >= LONG]
    columns = every, [cell for cell in every if cell[0] < LONG], [cell for cell in long if cell[1] > SLOW]
    rows = []
    for one, other in COMPARED:
        texts = []
        for chosen in columns:
            pairs = [(_together(cells, one, cell), _together(cells, other, cell)) for cell in chosen]
            found = common.OverCells(*zip(*(_ratio(*pair) for pair in pairs if all(pair)), strict=True))
            texts.append(f"{found.text(2).removesuffix(' %')} ({found.chi2:.1f}/{len(found)})")
        rows.append((f"{one} over {other}", *texts))
    head = f"change of Δx / % (χ²/d.o.f.) | all cells | below {LONG} links | {LONG} links or more, 20 and 30 Hz"
    return common.table(head, rows)


def over_time(cells: Cells, block: str, quantity: str, scale: float = 1, digits: int = 4) -> str:
    """A quantity by the time for which loops were held on, of a block; of Δx χ² of one value for all times, too."""
    times, tests = sorted({key[3] for key in cells if key[0] == block}), quantity == "held"
    rows = []
    for links, frequency in sorted({key[1:3] for key in cells if key[0] == block}):
        own = [cells[block, links, frequency, time] for time in times]
        values, errors = (scale * np.array([cell[name] for cell in own]) for name in (quantity, f"{quantity}_se"))
        chi2 = [f"{common.OverCells(values, errors).chi2_of_one:.1f}"] if tests else []
        texts = (f"{value:.{digits}f}" for value in (*values, errors.mean()))
        rows.append((links, f"{frequency:g}", *texts, *chi2))
    return common.table(("links", "Hz", *(f"{time:g} s" for time in times), "s.e.", *["χ²"] * tests), rows)


def tables(cells: Cells) -> dict[str, str]:
    """The table of the page by its marker."""
    return {"means of starts": common.minus(means(cells))}


def details(cells: Cells) -> dict[str, str]:
    """What is printed only: Δx and positions of each cell, by start and by the time for which loops were held on."""
    texts = {
        "starts": starts(cells),
        "held on": over_time(cells, "held_on", "held"),
        "place held on": over_time(cells, "held_on", "release_center_x", 1e3, 2),
        "swing": over_time(cells, "swing", "release_center_x", 1e3, 2),
        "swing in distance": over_time(cells, "swing", "dx"),
    }
    return {name: common.minus(text) for name, text in texts.items()}


def make(folders: Annotated[list[str] | None, typer.Argument()] = None) -> None:
    """Reduce the sweeps that are given into the committed file; then write all tables that are in it."""
    if folders:
        results = [warpchain.load(folder) for folder in folders]
        common.write_rows(CSV, reduced(results), *results)
    cells = read()
    common.show(details(cells))
    common.publish(PAGE.parent, tables(cells))


if __name__ == "__main__":
    common.run_study(make)
