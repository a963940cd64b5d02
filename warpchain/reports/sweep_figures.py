"""Figures of sweeps: the paper's Figure 6, maps, tolerances compared, sensitivity, how walks ended.

Means and standard deviations are those of the walks that came to rest. The number of walks that failed, or have not
been run yet, is on the figure.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.inputs.validation import short
from warpchain.pictures.labels import (
    COUNTS,
    DISTANCE,
    FREQUENCY,
    cell_values,
    lost_note,
    quantity_text,
)
from warpchain.pictures.style import (
    BLUE,
    FAINT,
    GREEN,
    GROUND,
    INK,
    LINE_COLORS,
    RED,
    NothingToShow,
    Picture,
    panel_grid,
    tidy,
)
from warpchain.reports.grids import grid_pictures, has_series
from warpchain.reports.statistics import CONFIDENCE, sensitivities, tolerance_agreement
from warpchain.status import Status
from warpchain.store.sweep_result import SweepResult

Array = NDArray[np.float64]

_STARTS: Final = {
    "rest": ("started at rest", RED, "o"),
    "ellipse": ("started as an ellipse", GREEN, "D"),
    "spinning": ("started spinning", BLUE, "s"),
}
"""How the chain started → legend, colour, marker."""
_OTHER_COLORS: Final = (BLUE, *LINE_COLORS[3:6], INK)
_OTHER_MARKERS: Final = "s^vP*X"
"""For further blocks of the same start."""


def figures(result: SweepResult, quantity: str = "dx") -> Iterator[Picture]:
    """Every figure that the sweep has the walks for, the paper's Figure 6 first.

    Args:
        result: a sweep.
        quantity: a column of numbers; for any other than ``dx`` there are just its figures over grids.

    Raises:
        InputError: there is no such column.
    """
    result.cell_statistics(quantity)
    for draw in (figure6, tolerance, sensitivity) if quantity == "dx" else ():
        with suppress(NothingToShow):
            yield draw(result)
    yield from grid_pictures(result, quantity)
    if quantity == "dx" and len([count for count in result.summary().values() if count]) > 1:
        yield status_counts(result)


def figure6(result: SweepResult) -> Picture:
    """Distance walked against frequency with a panel for each number of links, as in Figure 6.

    A dot is the mean, a box the range of one standard deviation, a bar the range of two. Walks that start at rest are
    red, ellipses green. Blocks with other axes than links, frequency and start are left out.

    Raises:
        NothingToShow: no walk of such a block has come to rest, or none of the blocks has several cells.
    """
    series = _all_series(result)
    rows = [row for item in series for row in item.cells.values()]
    numbers = sorted({links for item in series for links in item.cells})
    frequencies = sorted({frequency for row in rows for frequency in row})
    lows = [mean - 2 * np.nan_to_num(sd) for row in rows for mean, sd, _ in row.values() if np.isfinite(mean)]
    if not lows or len(numbers) == len(frequencies) == 1:
        raise NothingToShow("Figure 6 takes walks at rest in a block with nothing but links and frequency as axes")
    gap = float(np.diff(frequencies).min()) if len(frequencies) > 1 else 1.0
    columns = {1: 1, 2: 2, 4: 2}.get(len(numbers), 3)
    figure, used, empty = _grid(len(numbers), columns, (3.1, 2.6), (0.0, 1.0))
    for links, axes in zip(numbers, used, strict=True):
        here = [item for item in series if links in item.cells]
        for number, item in enumerate(here):
            # Boxes of several series stand side by side about their frequency.
            shift = gap * (number - (len(here) - 1) / 2) * 0.7 / len(here)
            _draw_boxes(axes, item, links, shift, gap * min(0.36, 0.6 / len(here)))
        axes.set_title(f"$n$ = {links}", fontsize="medium", loc="left")
        lost = [counts for item in here for _, _, counts in item.cells[links].values()]
        axes.set_xlabel(lost_note(lost), color=RED, fontsize="small")
        tidy(axes, grid="y")
    first = used[0]
    if len(frequencies) <= 8:
        first.set_xticks(frequencies, [f"{frequency:g}" for frequency in frequencies])
    first.set_xlim(frequencies[0] - 0.6 * gap, frequencies[-1] + 0.6 * gap)
    first.set_ylim(bottom=min(0.0, 1.05 * min(lows)))
    figure.supxlabel(FREQUENCY, fontsize="medium")
    figure.supylabel(DISTANCE, fontsize="medium")
    _draw_legend(figure, empty[-1] if empty else None, series)
    caption = "Distance walked against the frequency of the sprocket, as in the paper's Figure 6: mean, box of one and "
    return Picture("distance", caption + "bar of two standard deviations.", figure)


def tolerance(result: SweepResult) -> Picture:
    """The same walks at the loosest and the tightest tolerance of a sweep.

    The left panel shows the distances of single walks against each other, the right one relative differences of single
    walks and of the means of each cell.

    Raises:
        NothingToShow: see `tolerance_agreement`.
    """
    agreement = tolerance_agreement(result)
    cells, loose, tight = agreement.cells, short(agreement.loose), short(agreement.tight)
    figure = Figure(figsize=(9.4, max(4.6, 1.8 + 0.34 * len(cells))), layout="constrained")
    left, right = figure.subplots(1, 2)
    distances = np.concatenate([cell.distances for cell in cells], axis=1)
    margin = 0.06 * (float(np.ptp(distances)) or float(np.abs(distances).max()))
    ends = np.array([distances.min() - margin, distances.max() + margin])
    left.fill_between(ends, 0.9 * ends, 1.1 * ends, color=GROUND, linewidth=0, label="within 10 %")
    left.plot(ends, ends, color=FAINT, linewidth=1.0)
    dots: dict[str, Any] = {"color": BLUE, "linewidth": 0, "zorder": 3}
    left.scatter(distances[1], distances[0], s=16, alpha=0.65, **dots)
    left.set(xlim=ends, ylim=ends, aspect="equal")
    left.set_xlabel(f"$Δx$ at tolerance {tight} / m")
    left.set_ylabel(f"$Δx$ at tolerance {loose} / m")
    left.legend(frameon=False, loc="upper left")
    right.axvspan(-10, 10, color=GROUND, linewidth=0)
    right.axvline(0.0, color=FAINT, linewidth=1.0)
    for row, cell in enumerate(cells):
        labels = ("_", "_") if row else ("one walk", "means ± 2 standard errors")
        single = 100 * cell.differences
        right.scatter(single, np.full(len(single), row - 0.14), s=12, alpha=0.5, label=labels[0], **dots)
        error = 200 * np.nan_to_num(cell.standard_error)
        style: dict[str, Any] = {"fmt": "D", "color": RED, "markersize": 5, "linewidth": 1.4, "zorder": 4}
        right.errorbar(100 * cell.difference, row + 0.16, xerr=error, label=labels[1], **style)
    right.set_yticks(range(len(cells)), [cell.cell for cell in cells])
    right.set_ylim(len(cells) - 0.5, -0.5)
    widest = 110 * max(0.1, float(np.abs(agreement.differences).max()))
    right.set_xlim(-widest, widest)
    lost = f"\n{agreement.lost} pairs are not complete" if agreement.lost else ""
    right.set_xlabel(f"difference of $Δx$ ({loose} less {tight}) / %{lost}")
    right.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, columnspacing=1.0)
    tidy(left)
    tidy(right)
    return Picture("tolerance", str(agreement), figure)


def sensitivity(result: SweepResult) -> Picture:
    """Sobol' indices of the distance with a panel for each cell.

    All panels have the quantities in the same order, by the mean of their total indices, the greatest at the top.

    Raises:
        NothingToShow: see `sensitivities`.
    """
    cells = sensitivities(result)
    totals: dict[str, list[float]] = {}
    for cell in cells:
        for name, total in zip(cell.names, cell.total_order, strict=True):
            totals.setdefault(name, []).append(total)
    names = sorted(totals, key=lambda name: -float(np.mean(totals[name])))
    figure, used, _ = _grid(len(cells), 3, (3.2, 0.6 + 0.36 * len(names)), (2.4, 0.9))
    for axes, cell in zip(used, cells, strict=True):
        places = np.array([names.index(name) for name in cell.names])
        for shift, color, label, values, interval in (
            (-0.2, BLUE, "total", cell.total_order, cell.total_order_interval),
            (0.2, LINE_COLORS[5], "first order", cell.first_order, cell.first_order_interval),
        ):
            axes.barh(places + shift, values, height=0.38, color=color, label=label)
            axes.hlines(places + shift, interval[:, 0], interval[:, 1], color=INK, linewidth=1.2)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_title(cell.cell, fontsize="medium", loc="left")
        if cell.lost:
            note = f"{cell.lost} of {cell.samples + cell.lost} samples are not complete"
            axes.set_xlabel(note, color=RED, fontsize="small")
        tidy(axes, grid="x")
    used[0].set_yticks(range(len(names)), [quantity_text(name) for name in names])
    used[0].set_ylim(len(names) - 0.4, -0.6)
    figure.supxlabel(f"share of the variance of $Δx$, with {CONFIDENCE:.0%} intervals", fontsize="medium")
    figure.legend(*used[0].get_legend_handles_labels(), loc="outside upper right", frameon=False, ncols=2)
    caption = (
        "Sobol indices: the share of the variance of the distance walked that a quantity causes by itself (first "
        f"order) and takes part in (total); lines are {CONFIDENCE:.0%} bootstrap intervals. Walks are chaotic: "
        "changing anything a little scatters them, which all total indices contain alike. "
        f"Samples: {', '.join(f'{cell.samples}' for cell in cells)}."
    )
    return Picture("sensitivity", caption, figure)


def status_counts(result: SweepResult) -> Picture:
    """Number of walks by status, missing ones included."""
    counts = {label: count for label, count in result.summary().items() if count}
    figure = Figure(figsize=(7.0, 0.9 + 0.32 * len(counts)), layout="constrained")
    axes = figure.subplots()
    texts = ["not run yet" if label == "missing" else label.replace("_", " ") for label in counts]
    colors = [{Status.AT_REST.label: BLUE, "missing": FAINT}.get(label, RED) for label in counts]
    bars = axes.barh(texts, list(counts.values()), 0.7, color=colors)
    axes.bar_label(bars, [f" {count:,} ({count / result.walk_count:.2%})" for count in counts.values()], color=INK)
    axes.invert_yaxis()
    axes.margins(x=0.22)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlabel("walks")
    tidy(axes)
    return Picture("status_counts", "How the walks ended.", figure)


def _grid(
    count: int, most: int, panel: tuple[float, float], margin: tuple[float, float]
) -> tuple[Figure, list[Axes], list[Axes]]:
    """A figure with `count` panels in at most `most` columns, with common axes.

    Args:
        count: number of panels.
        most: greatest number of columns.
        panel: width and height that each panel adds to the figure [inches].
        margin: width and height beside the panels [inches].

    Returns:
        The figure, its panels by rows, and the axes that stay empty, which show nothing.
    """
    columns = min(count, most)
    size = max(4.2, margin[0] + panel[0] * columns), margin[1] + panel[1] * -(-count // columns)
    figure = Figure(figsize=size, layout="constrained")
    return figure, *panel_grid(figure, count, columns, sharex=True)


class _Series(NamedTuple):
    """Label, colour and marker of one block and start in Figure 6; links → frequency → mean, s.d., counts."""

    label: str
    color: str
    marker: str
    cells: dict[int, dict[float, tuple[float, float, dict[str, int]]]]


def _all_series(result: SweepResult) -> list[_Series]:
    """The series of every block in which nothing but links, frequency and start varies."""
    series: list[_Series] = []
    for block, given in zip(result.blocks.values(), result.sweep["blocks"], strict=True):
        found, starts = block.statistics("dx"), dict[str, Any]()
        for place in np.ndindex(*block.shape[:-1]) if has_series(block) else ():
            values = {**given["scene"], **cell_values(block.axes, place)}
            counts = {name: int(getattr(found, name)[place]) for name in COUNTS}
            cell = float(found.mean[place]), float(found.sd[place]), counts
            starts.setdefault(str(values["start"]), {}).setdefault(values["links"], {})[values["frequency"]] = cell
        for start, cells in starts.items():
            label, color, marker = _STARTS[start]
            if any(item.color == color for item in series):
                # Another block has this start: this one gets its name in the legend, another colour and marker.
                label, marker = f"{block.name}, {label}", _OTHER_MARKERS[len(series) % len(_OTHER_MARKERS)]
                color = next((other for other in _OTHER_COLORS if all(other != item.color for item in series)), INK)
            series.append(_Series(label, color, marker, cells))
    return series


def _draw_boxes(axes: Axes, series: _Series, links: int, shift: float, width: float) -> None:
    """Mean, box and bar at each frequency of one number of links."""
    color = series.color
    for frequency, (mean, sd, _) in series.cells[links].items():
        x = frequency + shift
        if np.isfinite(sd):
            axes.plot([x, x], [mean - 2 * sd, mean + 2 * sd], color=color, linewidth=1.2)
            box = (x - width / 2, mean - sd), width, 2 * sd
            axes.add_patch(Rectangle(*box, facecolor="white", zorder=2.1))
            axes.add_patch(Rectangle(*box, facecolor=(color, 0.2), edgecolor=color, zorder=2.2))
        if np.isfinite(mean):
            axes.plot([x], [mean], series.marker, color=color, markersize=4.5, zorder=3)


def _draw_legend(figure: Figure, empty: Axes | None, series: Sequence[_Series]) -> None:
    """Explain colours and markers, in the place of an empty panel or else above the panels."""
    handles: list[Any] = [
        Line2D([], [], color=item.color, marker=item.marker, linestyle="", label=item.label) for item in series
    ]
    handles += [
        Patch(facecolor=(FAINT, 0.2), edgecolor=FAINT, label="± 1 standard deviation"),
        Line2D([], [], color=FAINT, linestyle="", marker="|", markersize=13, label="± 2 standard deviations"),
    ]
    if empty is None:
        columns = 2 if figure.get_figwidth() < 8 else 4
        figure.legend(handles=handles, loc="outside upper center", ncols=columns, frameon=False, fontsize="small")
        return
    empty.legend(handles=handles, loc="center", frameon=False)
