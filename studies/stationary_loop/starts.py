"""Does Δx depend on how the loop came to spin, and how long it was held? Tables of studies/stationary_loop/README.md.

python -m studies.stationary_loop.starts             # results/starts.csv → tables of the page
python -m studies.stationary_loop.starts FOLDER…     # sweeps steadiness, steadiness_long, swing → the file, first
"""

from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer
from numpy.typing import NDArray

import warpchain
from studies.common import minus, of_cells, over_cells, publish, read_rows, run_study, table, write_rows

Array = NDArray[np.float64]
Key = tuple[str, int, float, float]
"""Block, links, frequency [Hz], time for which the loop was held on [s], 0 where that is no axis."""

CSV: Final = Path(__file__).parent / "results" / "starts.csv"
QUANTITIES: Final = ("dx", "release_center_x", "release_width", "release_height")
"""Distance of the walk; place of the centre of mass, width and height of the loop at the release [m]."""
STARTS: Final = ("spinning", "rest", "undamped")
OURS: Final = STARTS[:2]
LONG: Final = 150
"""Links from which loops are called long."""


def reduced(paths: list[str]) -> list[dict[str, Any]]:
    """Mean and standard error of each quantity by cell; blocks of the same name are put together."""
    found: dict[Key, list[Array]] = {}
    for path in paths:
        for name, block in warpchain.load(path).blocks.items():
            values = np.stack([np.asarray(block.columns[quantity]) for quantity in QUANTITIES])
            for place, numbers in of_cells(block):
                at = dict(zip(block.axes, map(float, numbers), strict=True))
                key = name, int(at["links"]), at["frequency"], at.get("further_hold", 0.0)
                found.setdefault(key, []).append(values[(slice(None), *place)])
    rows = []
    for key, parts in sorted(found.items()):
        walks = np.concatenate(parts, axis=1)
        walks = walks[:, np.isfinite(walks[0])]
        row: dict[str, Any] = dict(zip(("block", "links", "frequency", "held_on"), key, strict=True))
        row["walks"] = walks.shape[1]
        for quantity, each in zip(QUANTITIES, walks, strict=True):
            row |= {quantity: float(each.mean()), f"{quantity}_se": float(each.std(ddof=1) / len(each) ** 0.5)}
        rows.append(row)
    return rows


def read() -> dict[Key, dict[str, float]]:
    """The rows of the file by cell."""
    return {
        (row.pop("block"), int(row.pop("links")), float(row.pop("frequency")), float(row.pop("held_on"))): {
            name: float(text) for name, text in row.items()
        }
        for row in read_rows(CSV)
    }


def _ratio(one: dict[str, float], other: dict[str, float]) -> tuple[float, float]:
    """Δx of one cell over that of the other, less 1, with its standard error."""
    size = one["dx"] / other["dx"]
    return size - 1, size * float(np.hypot(one["dx_se"] / one["dx"], other["dx_se"] / other["dx"]))


def _mean(ratios: list[tuple[float, float]]) -> str:
    """Mean over cells ± standard error, with χ² of none in any."""
    over = over_cells(*np.array(ratios).T)
    return f"{100 * over.mean:+.2f} ± {100 * over.error:.2f} % (χ² {over.chi2:.1f} of {len(over)})"


def _with_error(cell: dict[str, float], quantity: str, scale: float = 1.0, digits: int = 4) -> str:
    return f"{scale * cell[quantity]:.{digits}f} ± {scale * cell[f'{quantity}_se']:.{digits}f}"


def starts(cells: dict[Key, dict[str, float]]) -> str:
    """Δx of each start, and how far each is from the loops held for 30 s, in Δx and at the release."""
    rows = []
    for _, links, frequency, _ in sorted(key for key in cells if key[0] == "rest"):
        own = {start: cells[start, links, frequency, 0.0] for start in STARTS}
        held, texts = own["undamped"], [_with_error(own[start], "dx") for start in STARTS]
        for start in OURS:
            size, error = _ratio(own[start], held)
            texts.append(f"{100 * size:+.1f} ({size / error:+.1f})")
        for quantity in ("release_center_x", "release_width"):
            each = (f"{1e3 * (own[start][quantity] - held[quantity]):+.2f}" for start in OURS)
            error = np.hypot(own["rest"][f"{quantity}_se"], held[f"{quantity}_se"])
            texts.append(f"{', '.join(each)} ± {1e3 * error:.2f}")
        rows.append((links, f"{frequency:g}", *texts))
    head = "links | Hz | `spinning` / m | `rest` / m | held 30 s / m | `spinning` − held | `rest` − held"
    return table(f"{head} | place / mm | width / mm", rows)


def means(cells: dict[Key, dict[str, float]]) -> str:
    """Means over the cells of the differences between starts."""
    rows = []
    every = sorted(key[1:3] for key in cells if key[0] == "rest")
    for one, other in (("rest", "spinning"), ("spinning", "undamped"), ("rest", "undamped")):
        texts = []
        for chosen in (every, [c for c in every if c[0] < LONG], [c for c in every if c[0] >= LONG]):
            texts.append(_mean([_ratio(cells[one, *cell, 0.0], cells[other, *cell, 0.0]) for cell in chosen]))
        rows.append((f"`{one}` over `{other}`", *texts))
    return table(f"Δx | all cells | below {LONG} links | from {LONG} links on", rows).replace("`undamped`", "held 30 s")


def over_time(cells: dict[Key, dict[str, float]], block: str, quantity: str, scale: float = 1, digits: int = 4) -> str:
    """A quantity by the time for which loops were held on, of a block; of Δx χ² of one value for all times, too."""
    times, tests = sorted({key[3] for key in cells if key[0] == block}), block == "held_on" and quantity == "dx"
    rows = []
    for links, frequency in sorted({key[1:3] for key in cells if key[0] == block}):
        own = [cells[block, links, frequency, time] for time in times]
        values = np.array([scale * cell[quantity] for cell in own])
        errors = np.array([scale * cell[f"{quantity}_se"] for cell in own])
        weights = errors**-2
        chi2 = float(np.sum(weights * (values - np.sum(weights * values) / weights.sum()) ** 2))
        texts = (f"{value:.{digits}f}" for value in values)
        rows.append(
            (links, f"{frequency:g}", *texts, f"{errors.mean():.{digits}f}", f"{chi2:.1f}")[: None if tests else -1]
        )
    return table(("links", "Hz", *(f"{time:g} s" for time in times), "s.e.", *["χ²"] * tests), rows)


def make(folders: Annotated[list[str] | None, typer.Argument()] = None) -> None:
    """Reduce the sweeps that are given into the committed file; then write all tables that are in it."""
    if folders:
        write_rows(CSV, reduced(folders))
    cells = read()
    tables = {
        "starts": starts(cells),
        "means of starts": means(cells),
        "held on": over_time(cells, "held_on", "dx"),
        "place held on": over_time(cells, "held_on", "release_center_x", 1e3, 2),
        "swing": over_time(cells, "swing", "release_center_x", 1e3, 2),
        "swing in distance": over_time(cells, "swing", "dx"),
    }
    publish(Path(__file__).parent, {name: minus(text) for name, text in tables.items()}, {})


if __name__ == "__main__":
    run_study(make)
