"""What all studies share: their commands, statistics, how their figures look, and how tables get into their pages."""

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas
import typer
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from studies import numerics
from warpchain import InputError, Status, SweepResult

Array = NDArray[Any]
Block = Any  # A block of `warpchain.SweepResult.blocks`
Columns = Mapping[str, Array]  # Columns of a table by name

LINE_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that people with any kind of colour vision can tell apart (Okabe and Ito, 2008)."""
BLUE, RED, GREEN = LINE_COLORS[:3]
INK = "#222222"
FAINT = "#777777"
GROUND = "#E3E3E3"
DASHES = (0, (4, 3))

DRAWN = "_drawn"  # End of the names of columns with what a sample has drawn
DISTANCE = "distance walked $Δx$ / m"
FREQUENCY = "frequency of the sprocket $ν$ / Hz"


def run_study(*commands: Callable[..., None]) -> None:
    """Run a study's command, or one of several by its name, with the arguments of its function; errors are one line."""
    app = typer.Typer(pretty_exceptions_enable=False)
    for command in commands:
        app.command()(command)
    try:
        app()
    except (InputError, OSError) as error:
        sys.exit(str(error))


def at_rest(block: Block, quantity: str = "dx") -> xarray.DataArray:
    """A column of a block with named axes, links and frequency in front, samples last; NaN of walks not at rest."""
    values = np.where(block.columns["status"] == Status.AT_REST, block.columns[quantity], np.nan)
    axes = {name: points for name, points in block.axes.items() if name != "point"}
    return xarray.DataArray(values, axes, block.dims).transpose("links", "frequency", ..., missing_dims="ignore")


def of_cells(block: Block) -> Iterator[tuple[tuple[int, ...], dict[str, float]]]:
    """Place of each cell of a block, and the values of its axes there."""
    for place in np.ndindex(*map(len, block.axes.values())):
        yield place, {name: block.axes[name][number] for name, number in zip(block.axes, place, strict=True)}


def mean(values: ArrayLike) -> Any:
    """Mean over the samples, the last axis, of what is known; NaN of nothing."""
    return np.ma.filled(np.ma.masked_invalid(values).mean(axis=-1), np.nan)


def deviation(values: ArrayLike) -> Any:
    """Standard deviation of a sample, likewise; NaN of fewer than two."""
    return np.ma.filled(np.ma.masked_invalid(values).std(axis=-1, ddof=1), np.nan)


def standard_error(values: ArrayLike) -> Any:
    """Standard error of the mean, likewise."""
    return deviation(values) / np.sqrt(np.maximum(np.isfinite(values).sum(axis=-1), 1))


def area_of(outlines: Array) -> Array:
    """Area [m²] inside closed outlines of points x, y, (…, n, 2 or more)."""
    x, y = outlines[..., 0], outlines[..., 1]
    return np.abs(0.5 * np.sum(x * np.roll(y, -1, axis=-1) - y * np.roll(x, -1, axis=-1), axis=-1))


class OverCells:
    """Values of several cells, each with a standard error, taken together; those without both are left out."""

    def __init__(self, values: ArrayLike, errors: ArrayLike) -> None:
        """Take them together."""
        values, errors = (np.asarray(each, float).ravel() for each in (values, errors))
        known = np.isfinite(values) & np.isfinite(errors)
        self.values, self.errors = values, errors = values[known], errors[known]
        weights = np.divide(1, errors, out=np.zeros(len(values)), where=errors > 0)
        sizes = values * weights
        one = np.sum(values * weights**2) / max(np.sum(weights**2), np.finfo(float).tiny)
        self.mean = float(mean(values))
        self.error = float(np.sqrt(np.sum(errors**2)) / len(values)) if len(values) else np.nan
        # root mean square of the values without what their errors contribute
        self.typical = float(np.sqrt(max(0.0, mean(values**2 - errors**2))))
        # of no value in any cell, and of one value in all
        self.chi2, self.chi2_of_one = float(np.sum(sizes**2)), float(np.sum(((values - one) * weights) ** 2))
        # significant at 95 %
        self.rises, self.falls = int(np.sum(sizes > 1.96)), int(np.sum(sizes < -1.96))

    def __len__(self) -> int:
        """Number of the cells."""
        return len(self.values)

    def text(self, digits: int = 1) -> str:
        """Mean ± standard error of values in per cent."""
        return f"{self.mean:+.{digits}f} ± {self.error:.{digits}f} %"


def minus(text: str) -> str:
    """The text with signs for hyphens, but for the line under the head of a table."""
    return re.sub("(?<!-)-(?!-)", "−", text)


def drawn_terms(columns: Columns) -> list[Array]:
    """What each walk has drawn, as terms of a linear fit: sine and cosine of the phase, and all else, standardised."""
    drawn = {name: np.asarray(values, float) for name, values in columns.items() if name.endswith(DRAWN)}
    plain = [values for name, values in drawn.items() if name != f"phase{DRAWN}" and values.std() > 0]
    turn = 2 * np.pi * drawn[f"phase{DRAWN}"]
    return [np.sin(turn), np.cos(turn), *((values - values.mean()) / values.std() for values in plain)]


def table(head: str | Iterable[str], rows: Iterable[Iterable[object]], formats: str = "") -> str:
    """A table in Markdown; the head may be one text with strokes, formats are those of columns, for what is no text."""
    head = head.split(" | ") if isinstance(head, str) else list(head)
    kinds = formats.split() or [""] * len(head)
    texts = (
        [cell if isinstance(cell, str) else format(cell, kind) for cell, kind in zip(row, kinds, strict=True)]
        for row in rows
    )
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *texts))


def tidy(axes: Axes, title: str = "", grid: Literal["x", "y", "both"] | None = None, **settings: Any) -> None:
    """Leave out the upper and right border; set title, further settings, a faint grid across one axis or both."""
    axes.set(**settings)
    axes.set_title(title, fontsize="medium", loc="left")
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(color=FAINT)
    if grid is not None:
        axes.grid(axis=grid, color="#E6E6E6", linewidth=0.6)
        axes.set_axisbelow(True)


def error_line(axes: Axes, x: Any, cells: Any, place: tuple[Any, ...], **style: Any) -> None:
    """Mean Δx with its standard error of some cells of a block's `statistics()`, as a thin line with dots.

    Means of survivors have open dots, and triangles stand at lower bounds of the means of all walks.
    """
    style = {"linewidth": 1.2, "marker": "o", "markersize": 3} | style
    line = axes.errorbar(x, cells.mean[place], cells.standard_error[place], **style).lines[0]
    look: dict[str, Any] = {"linestyle": "", "color": line.get_color(), "markerfacecolor": "white", "zorder": 3}
    bounds = cells.at_least[place]
    for marker, y, chosen in (("o", cells.mean[place], cells.of_survivors[place]), ("^", bounds, np.isfinite(bounds))):
        axes.plot(np.asarray(x)[chosen], y[chosen], marker=marker, markersize=4, **look)


def read_columns(path: Path) -> dict[str, Array]:
    """The columns of a file of comma-separated values: texts where not all are numbers."""
    columns = pandas.read_csv(path, comment="#").items()
    return {name: each.to_numpy(float if pandas.api.types.is_numeric_dtype(each) else str) for name, each in columns}


def write_rows(path: Path, rows: Iterable[Mapping[str, object]], *sources: SweepResult | int) -> None:
    """Write rows with commas between values, and in the first line numerics, seeds and command.

    Sources are the sweeps that the rows are of, or seeds of walks that the command has simulated itself. Numbers that
    are not whole have six digits.
    """
    versions = {numerics.today()}
    if sweeps := [each for each in sources if isinstance(each, SweepResult)]:
        versions = {each.provenance["numerics_version"] for each in sweeps}
    seeds = {each.seed if isinstance(each, SweepResult) else each for each in sources}
    values = pandas.DataFrame(list(rows)).to_csv(index=False, float_format="%.6g", na_rep="nan")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(numerics.first_line(versions, seeds, numerics.this_command()) + values, encoding="utf-8")


def with_tables(text: str, tables: Mapping[str, str]) -> str:
    """A page with these tables between its markers ``<!-- NAME -->`` and ``<!-- end of NAME -->``."""
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        before, *rest = re.split(f"{re.escape(begin)}.*?{re.escape(end)}", text, flags=re.DOTALL)
        if len(rest) != 1:
            raise ValueError(f"the page needs {begin} and {end} once each")
        text = f"{before}{begin}\n\n{table}\n\n{end}{rest[0]}"
    return text


def show(tables: Mapping[str, str]) -> None:
    """Print tables by their names; those that stand on no page are shown only."""
    for name, text in tables.items():
        print(f"\n{name}\n{text}")


def publish(
    folder: Path, tables: Mapping[str, str], figures: Mapping[str, Figure] | None = None, dpi: int = 200
) -> None:
    """Put tables between the markers of a study's page, and print them; write its figures, figures/NAME.png."""
    show(tables)
    page = folder / "README.md"
    if tables:
        page.write_text(with_tables(page.read_text(encoding="utf-8"), tables), encoding="utf-8")
    for name, figure in (figures or {}).items():
        path = folder / "figures" / f"{name}.png"
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path, dpi=dpi)
