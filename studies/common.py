"""What all studies share: their commands, how their figures look, and how their tables get into their pages."""

import csv
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import typer
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from warpchain import InputError

LINE_COLORS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that people with any kind of colour vision can tell apart (Okabe and Ito, 2008)."""
BLUE, RED, GREEN = LINE_COLORS[:3]
INK: Final = "#222222"
FAINT: Final = "#777777"
GROUND: Final = "#E3E3E3"
DASHES: Final[Any] = (0, (4, 3))

DRAWN: Final = "_drawn"
"""End of the names of columns with what a sample has drawn."""
DISTANCE: Final = "distance walked $Δx$ / m"
FREQUENCY: Final = "frequency of the sprocket $ν$ / Hz"


def run_study(main: Callable[..., None]) -> None:
    """Run a study's command, whose arguments are those of the function; what is refused is one line."""
    try:
        typer.run(main)
    except (InputError, OSError) as error:
        sys.exit(str(error))


def drawn_terms(columns: Mapping[str, Any]) -> list[NDArray[np.float64]]:
    """What each walk has drawn, as terms of a linear fit: sine and cosine of the phase, and all else, standardised."""
    drawn = {name: np.asarray(values, float) for name, values in columns.items() if name.endswith(DRAWN)}
    plain = [values for name, values in drawn.items() if name != f"phase{DRAWN}" and values.std() > 0]
    turn = 2 * np.pi * drawn[f"phase{DRAWN}"]
    return [np.sin(turn), np.cos(turn), *((values - values.mean()) / values.std() for values in plain)]


def table(head: str | Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown; the head may be one text with strokes between its cells."""
    head = head.split(" | ") if isinstance(head, str) else list(head)
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in (head, ["---"] * len(head), *rows))


def save_figure(figure: Figure, path: Path, dpi: int = 200) -> None:
    """Write a figure; its folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=dpi)


def tidy(axes: Axes, *, grid: Literal["x", "y", "both"] | None = None) -> None:
    """Leave out the upper and right border; draw a faint grid across one axis or both."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(color=FAINT)
    if grid is not None:
        axes.grid(axis=grid, color="#E6E6E6", linewidth=0.6)
        axes.set_axisbelow(True)


def error_line(axes: Axes, x: Any, cells: Any, place: tuple[Any, ...], **style: Any) -> None:
    """Mean Δx with its standard error of some cells of a block's `statistics()`, as a thin line with dots."""
    style = {"linewidth": 1.2, "marker": "o", "markersize": 3} | style
    axes.errorbar(x, cells.mean[place], cells.standard_error[place], **style)


def write_text(path: Path, text: str) -> None:
    """Write a file; its folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a file of comma-separated values, as texts by column."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_rows(path: Path, rows: Sequence[Mapping[str, object]]) -> None:
    """Write them; numbers that are not whole have six digits."""
    lines = [[f"{value:.6g}" if isinstance(value, float) else value for value in row.values()] for row in rows]
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([list(rows[0]), *lines])


def with_tables(text: str, tables: Mapping[str, str]) -> str:
    """A page with these tables between its markers ``<!-- NAME -->`` and ``<!-- end of NAME -->``.

    Raises:
        ValueError: the page lacks a marker.
    """
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise ValueError(f"the page needs {begin} and {end} once each")
        before, rest = text.split(begin)
        text = f"{before}{begin}\n\n{table}\n\n{end}{rest.split(end)[1]}"
    return text


def write_tables(page: Path, tables: Mapping[str, str]) -> None:
    """Put tables between the markers of a page, and print them."""
    for name, table in tables.items():
        print(f"\n{name}\n{table}")
    write_text(page, with_tables(page.read_text(encoding="utf-8"), tables))
