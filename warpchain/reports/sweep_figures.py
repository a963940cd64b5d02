"""Figures of sweeps: the paper's Figures 6 and 5, maps, tolerances compared, sensitivity, how walks ended.

Means and spreads are of the walks that came to rest. Walks that failed, or have not been run yet, are counted on the
figure.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import DIMENSIONLESS
from warpchain.pictures.walk_figures import FAINT, GROUND, INK, LINE_COLORS, _tidy
from warpchain.reports.figure5 import sweep_figure5
from warpchain.reports.kink_figure import sweep_kink
from warpchain.reports.panels import sweep_panels
from warpchain.reports.statistics import (
    CONFIDENCE,
    NothingToShow,
    Sensitivity,
    ToleranceAgreement,
    number_text,
    sensitivities,
    tolerance_agreement,
)
from warpchain.reports.sweep_series import BLUE, RED, Cell, Series, all_series, lost_note
from warpchain.status import Status

if TYPE_CHECKING:
    from warpchain.store.sweep_result import BlockResult, SweepResult

Array = NDArray[np.float64]

_GRID: Final = {"color": "#E6E6E6", "linewidth": 0.6}
_FREQUENCY: Final = "frequency of the sprocket $ν$ / Hz"

_EVENLY: Final = 6
"""Most values of a quantity that are set out evenly, whatever they are."""

_MOST_BLOCKS: Final = 6
"""Most blocks whose walks are counted one by one."""

_MOST_NUMBERS: Final = 120
"""Most cells of a map that numbers are written into."""


@dataclass(frozen=True)
class Picture:
    """A figure with what stands below it.

    Attributes:
        name: short name, good for a file.
        caption: one or two sentences.
        figure: the figure.
    """

    name: str
    caption: str
    figure: Figure


def figures(result: "SweepResult") -> Iterator[Picture]:
    """Every figure that a sweep has something for, the paper's Figures 6 and 5 first."""
    with suppress(NothingToShow):
        if any(len(item.cells) > 1 for item in all_series(result)):
            text = "Distance walked against the frequency of the sprocket, as in the paper's Figure 6: mean, "
            yield Picture("figure6", text + "box of one and bar of two standard deviations.", figure6(result))
    with suppress(NothingToShow):
        figure, text = sweep_figure5(result)
        yield Picture("figure5", text, figure)
    with suppress(NothingToShow):
        figure, text = sweep_kink(result)
        yield Picture("kink", text, figure)
    with suppress(NothingToShow):
        text = "Mean and standard deviation of the distance walked, over the walks at rest in each cell."
        yield Picture("heat_map", text, heat_map(result))
    with suppress(NothingToShow):
        labels = {name: _axis_label(block, name) for block in result.blocks.values() for name in block.axes}
        for quantity, figure in sweep_panels(result, labels):
            text = f"Distance walked against {quantity.replace('_', ' ')}, by links and frequency: means with two "
            yield Picture(f"against_{quantity}", text + "standard errors.", figure)
    with suppress(NothingToShow):
        figure, agreement = tolerance(result)
        yield Picture("tolerance", str(agreement), figure)
    with suppress(NothingToShow):
        figure, cells = sensitivity(result)
        text = "Sobol indices: the share of the variance of the distance walked that a quantity causes by itself "
        text += f"(first order) and takes part in (total); lines are {CONFIDENCE:.0%} bootstrap intervals. Walks are "
        text += "chaotic: changing anything a little scatters them, which all total indices contain alike. "
        yield Picture("sensitivity", f"{text}Samples: {', '.join(f'{cell.samples}' for cell in cells)}.", figure)
    with suppress(NothingToShow):
        text = "Distance walked in the blocks that vary one quantity: means with one standard deviation (bar) and two "
        yield Picture("responses", text + "standard errors of the mean (box).", responses(result))
    yield Picture("status_counts", "How the walks ended.", status_counts(result))


def figure6(result: "SweepResult") -> Figure:
    """Distance walked against frequency with a panel for each number of links, as in Figure 6.

    A dot is the mean, a box the range of one standard deviation, a bar that of two; red starts at rest, green as an
    ellipse. Blocks with other axes than links, frequency and start are left out.

    Raises:
        NothingToShow: no walk of such a block has come to rest.
    """
    series = all_series(result)
    drawn = [cell for item in series for cell in item.cells.values() if cell.count]
    if not drawn:
        raise NothingToShow("Figure 6 takes walks at rest in a block with nothing but links and frequency as axes")
    panels = sorted({links for item in series for links, _ in item.cells})
    frequencies = sorted({frequency for item in series for _, frequency in item.cells})
    gap = float(np.diff(frequencies).min()) if len(frequencies) > 1 else 1.0
    columns = {1: 1, 2: 2, 4: 2}.get(len(panels), 3)
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(max(3.1 * columns, 4.2), 2.6 * rows + 1.0), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, links in zip(grid.flat, panels, strict=False):
        here = [item for item in series if any(key[0] == links for key in item.cells)]
        for place, item in enumerate(here):
            # Boxes of several series stand side by side about their frequency.
            shift = gap * (place - (len(here) - 1) / 2) * 0.7 / len(here)
            _draw_boxes(axes, item, links, shift, gap * min(0.36, 0.6 / len(here)))
        axes.set_title(f"$n$ = {links}", fontsize="medium", loc="left")
        note = lost_note([cell for item in here for key, cell in item.cells.items() if key[0] == links])
        axes.set_xlabel(note, color=RED, fontsize="small")
        axes.grid(axis="y", **_GRID)
        _tidy(axes)
    first = grid.flat[0]
    if len(frequencies) <= 8:
        first.set_xticks(frequencies, [f"{frequency:g}" for frequency in frequencies])
    first.set_xlim(frequencies[0] - 0.6 * gap, frequencies[-1] + 0.6 * gap)
    first.set_ylim(bottom=min(0.0, *(1.05 * (cell.mean - 2 * np.nan_to_num(cell.sd)) for cell in drawn)))
    empty = grid.flat[len(panels) :]
    for axes in empty:
        axes.set_axis_off()
    for axes in grid.flat[len(panels) - columns : len(panels)]:
        axes.tick_params(labelbottom=True)
    figure.supxlabel(_FREQUENCY, fontsize="medium")
    figure.supylabel("distance walked $Δx$ / m", fontsize="medium")
    _draw_legend(figure, empty[-1] if len(empty) else None, series)
    return figure


def heat_map(result: "SweepResult", quantity: str = "dx") -> Figure:
    """Mean and standard deviation of a quantity over links and frequency, two maps for each block and start.

    Args:
        result: a sweep.
        quantity: a column, such as ``dx``, ``walk_time`` or ``bounces``.

    Raises:
        KeyError: there is no such column.
        NothingToShow: no walk has come to rest in a block that has several links and frequencies, and no other axes.
    """
    series = [item for item in all_series(result, quantity) if item.is_map]
    if not any(cell.count for item in series for cell in item.cells.values()):
        raise NothingToShow(
            "a map takes walks at rest in a block with several links and frequencies, and no other axes"
        )
    links = sorted({key[0] for item in series for key in item.cells})
    frequencies = sorted({key[1] for item in series for key in item.cells})
    unit = "" if series[0].unit == DIMENSIONLESS else f" / {series[0].unit}"
    name = "$Δx$" if quantity == "dx" else quantity.replace("_", " ")
    numbers = len(links) * len(frequencies) <= _MOST_NUMBERS
    width, height = (0.6, 0.42) if numbers else (0.24, 0.24)
    width, height = max(3.8, 1.5 + width * len(frequencies)), max(1.6, 0.4 + height * len(links))
    figure = Figure(figsize=(2 * width, 0.6 + (0.3 + height) * len(series)), layout="constrained")
    grid = figure.subplots(len(series), 2, sharex=True, sharey=True, squeeze=False)
    for column, (title, colors) in enumerate((("mean", "viridis"), ("standard deviation of", "cividis"))):
        tables = [item.table("sd" if column else "mean", links, frequencies) for item in series]
        known = np.concatenate([table[np.isfinite(table)] for table in tables])
        low, high = (known.min(), known.max()) if len(known) else (0.0, 1.0)
        for axes, item, table in zip(grid[:, column], series, tables, strict=True):
            image = axes.imshow(table, cmap=colors, vmin=low, vmax=high, origin="lower", aspect="auto")
            if len(series) > 1 and not column:
                axes.set_title(item.label, fontsize="medium", loc="left")
            every = slice(None, None, 1 + len(frequencies) // 16)
            axes.set_xticks(range(len(frequencies))[every], [f"{frequency:g}" for frequency in frequencies[every]])
            axes.set_yticks(range(len(links)), [f"{number}" for number in links])
            axes.set_facecolor(GROUND)
            axes.spines[:].set_visible(False)
            axes.tick_params(color=FAINT)
            if numbers:
                _write_numbers(axes, item, table, links, frequencies, image)
        figure.colorbar(image, ax=list(grid[:, column]), label=f"{title} {name}{unit}").outline.set_visible(False)
    figure.supxlabel(_FREQUENCY, fontsize="medium")
    figure.supylabel("number of links $n$", fontsize="medium")
    return figure


def tolerance(result: "SweepResult") -> tuple[Figure, ToleranceAgreement]:
    """The same walks at the loosest and the tightest tolerance of a sweep, and the numbers.

    On the left the distances of single walks against each other; on the right relative differences, of single walks
    and of the means of each cell.

    Raises:
        NothingToShow: see `tolerance_agreement`.
    """
    agreement = tolerance_agreement(result)
    cells, loose, tight = agreement.cells, number_text(agreement.loose), number_text(agreement.tight)
    figure = Figure(figsize=(9.4, max(4.6, 1.8 + 0.34 * len(cells))), layout="constrained")
    left, right = figure.subplots(1, 2)
    distances = np.concatenate([cell.distances for cell in cells], axis=1)
    margin = 0.06 * (float(np.ptp(distances)) or float(np.abs(distances).max()))
    ends = np.array([distances.min() - margin, distances.max() + margin])
    left.fill_between(ends, 0.9 * ends, 1.1 * ends, color=GROUND, linewidth=0, label="within 10 %")
    left.plot(ends, ends, color=FAINT, linewidth=1.0)
    dots: dict[str, Any] = {"color": BLUE, "linewidth": 0, "zorder": 3}
    left.scatter(distances[1], distances[0], s=16, alpha=0.65, label="one walk", **dots)
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
    widest = 110 * max(0.1, agreement.greatest)
    right.set_xlim(-widest, widest)
    lost = f"\n{agreement.lost} pairs are not complete" if agreement.lost else ""
    right.set_xlabel(f"difference of $Δx$ ({loose} less {tight}) / %{lost}")
    right.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, columnspacing=1.0)
    for axes in (left, right):
        _tidy(axes)
    return figure, agreement


def sensitivity(result: "SweepResult") -> tuple[Figure, tuple[Sensitivity, ...]]:
    """Sobol' indices of the distance with a panel for each cell, and the numbers.

    Panels share the order of the quantities: the greatest mean of the total indices is at the top.

    Raises:
        NothingToShow: see `sensitivities`.
    """
    cells = sensitivities(result)
    totals: dict[str, list[float]] = {}
    for cell in cells:
        for name, total in zip(cell.names, cell.total_order, strict=True):
            totals.setdefault(name, []).append(total)
    names = sorted(totals, key=lambda name: -float(np.mean(totals[name])))
    columns = min(len(cells), 3)
    rows = -(-len(cells) // columns)
    size = (2.4 + 3.2 * columns, 0.9 + rows * (0.6 + 0.36 * len(names)))
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, cell in zip(grid.flat, cells, strict=False):
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
        axes.grid(axis="x", **_GRID)
        axes.set_axisbelow(True)
        _tidy(axes)
    for axes in grid.flat[len(cells) :]:
        axes.set_visible(False)
    for axes in grid.flat[len(cells) - columns : len(cells)]:
        axes.tick_params(labelbottom=True)
    grid[0, 0].set_yticks(range(len(names)), [_quantity_text(name) for name in names])
    grid[0, 0].set_ylim(len(names) - 0.4, -0.6)
    figure.supxlabel(f"share of the variance of $Δx$, with {CONFIDENCE:.0%} intervals", fontsize="medium")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper right", frameon=False, ncols=2)
    return figure, cells


def responses(result: "SweepResult") -> Figure:
    """Distance against the one quantity that a block varies, with a panel for each such block.

    A dot is the mean, a box the range of two standard errors of the mean, a bar that of one standard deviation. Up to
    six values, which often span decades, stand evenly.

    Raises:
        NothingToShow: no walk has come to rest in a block that varies one quantity other than links and frequency.
    """
    panels = []
    for block in result.blocks.values():
        several = [name for name, values in block.axes.items() if len(values) > 1]
        if len(several) == 1 and several[0] not in ("links", "frequency", "tolerance"):
            found = block.statistics("dx")
            if found.count.any():
                panels.append((several[0], block, found))
    if not panels:
        raise NothingToShow("responses take walks at rest in a block that varies one quantity")
    columns = min(len(panels), 4)
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(max(4.2, 1.0 + 2.3 * columns), 0.4 + 2.4 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, (name, block, found) in zip(grid.flat, panels, strict=False):
        values = block.axes[name]
        evenly = values.dtype.kind in "Ub" or len(values) <= _EVENLY
        places = np.arange(len(values)) if evenly else values
        means, spread, error = (table.ravel() for table in (found.mean, found.sd, found.standard_error))
        axes.plot(places, means, color=FAINT, linewidth=0.8)
        axes.errorbar(places, means, spread, fmt="o", color=BLUE, markersize=4, linewidth=1.2, zorder=3)
        axes.errorbar(places, means, 2 * error, fmt="none", ecolor=(BLUE, 0.35), elinewidth=7, zorder=2)
        if evenly:
            texts = [number_text(value) if values.dtype.kind in "if" else str(value) for value in values]
            axes.set_xticks(places, texts)
        axes.margins(x=0.15)
        counts = Cell(np.nan, np.nan, *(int(table.sum()) for table in (found.count, found.failed, found.missing)))
        note = lost_note([counts])
        axes.set_xlabel(_axis_label(block, name) + (f"\n{note}" if note else ""), fontsize="small")
        axes.tick_params(axis="x", labelsize="small")
        axes.grid(axis="y", **_GRID)
        _tidy(axes)
    for axes in grid.flat[len(panels) :]:
        axes.set_axis_off()
    grid[0, 0].set_ylim(bottom=min(0.0, grid[0, 0].get_ylim()[0]))
    figure.supylabel("distance walked $Δx$ / m", fontsize="medium")
    return figure


def status_counts(result: "SweepResult") -> Figure:
    """How many walks of each block ended how, and how many have not been run yet; of all together if it has many."""
    summaries = {name: block.summary() for name, block in result.blocks.items()}
    if not 1 < len(summaries) <= _MOST_BLOCKS:
        summaries = {"": result.summary()}
    rows = [
        (name, label, count)
        for name, summary in summaries.items()
        for label, count in summary.items()
        if count or label == Status.AT_REST.label
    ]
    figure = Figure(figsize=(7.0, 0.9 + 0.32 * len(rows)), layout="constrained")
    axes = figure.subplots()
    texts = []
    for place, (name, label, count) in enumerate(rows):
        color = {Status.AT_REST.label: BLUE, "missing": FAINT}.get(label, RED)
        axes.barh(place, count, 0.7, color=color)
        whole = sum(summaries[name].values())
        share = "" if count in (0, whole) else f" ({count / whole:.2%})"
        axes.text(count, place, f" {count:,}{share}", va="center", color=INK)
        text = "not run yet" if label == "missing" else label.replace("_", " ")
        texts.append(f"{name}: {text}" if name else text)
    axes.set_yticks(range(len(rows)), texts)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(0, 1.22 * max(1, *(count for _, _, count in rows)))
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlabel("walks")
    _tidy(axes)
    return figure


def _draw_boxes(axes: Axes, series: Series, links: int, shift: float, width: float) -> None:
    """Mean, box and bar at each frequency of one number of links."""
    for (number, frequency), cell in series.cells.items():
        if number != links or not cell.count:
            continue
        x, color = frequency + shift, series.color
        if np.isfinite(cell.sd):
            axes.plot([x, x], [cell.mean - 2 * cell.sd, cell.mean + 2 * cell.sd], color=color, linewidth=1.2)
            corner = x - width / 2, cell.mean - cell.sd
            axes.add_patch(Rectangle(corner, width, 2 * cell.sd, facecolor="white", zorder=2.1))
            axes.add_patch(Rectangle(corner, width, 2 * cell.sd, facecolor=(color, 0.2), edgecolor=color, zorder=2.2))
        axes.plot([x], [cell.mean], series.marker, color=color, markersize=4.5, zorder=3)


def _draw_legend(figure: Figure, empty: Axes | None, series: Sequence[Series]) -> None:
    """What colours and signs mean, in the place of axes that stay empty, or else above."""
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


def _write_numbers(
    axes: Axes, series: Series, table: Array, links: Sequence[int], frequencies: Sequence[float], image: Any
) -> None:
    """The value in each cell of a map, and how many of its walks are not in it."""
    for (row, column), value in np.ndenumerate(table):
        cell = series.cells.get((links[row], frequencies[column]))
        if cell is None:
            continue
        text = f"{value:.3g}" if np.isfinite(value) else "–"
        parts = [f"{cell.failed} failed"] * (cell.failed > 0) + [f"{cell.missing} to run"] * (cell.missing > 0)
        red, green, blue, _ = image.to_rgba(value) if np.isfinite(value) else (1.0, 1.0, 1.0, 1.0)
        color = INK if 0.3 * red + 0.59 * green + 0.11 * blue > 0.5 else "white"
        axes.text(column, row, text, ha="center", va="bottom" if parts else "center", color=color, fontsize="small")
        if parts:
            axes.text(column, row, "\n".join(parts), ha="center", va="top", color=color, fontsize="xx-small")


def _axis_label(block: "BlockResult", name: str) -> str:
    """Name, symbol and unit of an axis of a grid."""
    unit = "" if block.unit(name) == DIMENSIONLESS else f" / {block.unit(name)}"
    return _quantity_text(name) + unit


def _quantity_text(name: str) -> str:
    """Name of a drawn quantity, with its symbol if it has one."""
    text = name.replace("_", " ").replace("coulomb", "Coulomb")
    if name not in Parameters.model_fields:
        return text
    base, _, index = Parameters.quantities()[name].symbol.partition("_")
    return f"{text} ${base}" + (f"_\\mathrm{{{index}}}$" if index else "$")
