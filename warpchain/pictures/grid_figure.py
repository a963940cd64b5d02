"""A quantity over a grid of any number of axes: lines with error bands, or maps; cells without walks are gaps."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator, PercentFormatter
from numpy.typing import NDArray

from warpchain.pictures.grid_panels import MOST_LINES, Axis, Kind, Panel, grid_panels, line_values
from warpchain.pictures.inline import InlineFigure
from warpchain.pictures.labels import (
    COUNTS,
    lost_note,
    math_symbol,
    quantity_label,
    quantity_text,
    short_texts,
    unit_text,
    with_unit,
)
from warpchain.pictures.style import BLUE, FAINT, GROUND, INK, LINE_COLORS, RED, label_room, panel_grid, tidy

if TYPE_CHECKING:
    from warpchain.store.cell_statistics import CellStatistics

Array = NDArray[Any]

_MOST_NUMBERS: Final = 60
"""Greatest number of cells of a single map with numbers in them."""

_MOST_TICKS: Final = 8
"""Up to so many values have a tick each, as far as there is room."""

_MOST_ROWS: Final = 16
"""Greatest number of labelled rows or columns of a map."""

_LARGEST_DOT: Final = 0.75
"""Diameter of the dot of a cell whose walks all failed, relative to the cell."""

_DECADES: Final = 30
"""From such a ratio of the greatest value to the least on, an axis is logarithmic if its values are more even so."""

_DEEP, _LIGHT = 0.35, 0.13
"""Opacity of the bands of one standard error and one standard deviation."""

_PANEL_SIZES: Final = {1: (5.2, 3.6), 2: (3.6, 2.9), 3: (3.0, 2.6), 4: (2.6, 2.4)}
"""Number of columns → width and height of a panel [inches]."""


def draw_grid(
    blocks: "Mapping[str, CellStatistics]",
    quantity: str = "dx",
    kind: Kind | None = None,
    *,
    x: str | None = None,
    ax: Axes | None = None,
    figure: Figure | SubFigure | None = None,
) -> Figure | SubFigure:
    """Draw a quantity over the grids of one block or several.

    Lines have a band of one standard error; a single line has a lighter one of one standard deviation, too. Names on
    the x axis have bars instead. Where walks failed, a strip above the lines shows which share of them, in a map a dot.

    Args:
        blocks: name of each block → the statistics of its cells.
        quantity: name of the quantity, for labels.
        kind: as `x`, `ax`, `figure`, what is returned and errors, see `SweepResult.plot`.
        x: see there.
        ax: see there.
        figure: see there.

    Raises:
        NothingToShow: no block has an axis of several values, or two for a map, or there is no mean.
    """
    if kind not in (None, "lines", "map"):
        raise ValueError(f"kind: {kind!r} is unknown; give 'lines', 'map' or None")
    if ax is not None and figure is not None:
        raise ValueError("ax: given together with figure; leave one out")
    panels, left_out = grid_panels(blocks, kind, x)
    label = with_unit(quantity_text(quantity), next(iter(blocks.values())).unit)
    if ax is not None and len(panels) > 1:
        raise ValueError(f"ax: this figure has {len(panels)} panels; leave ax out, or give figure")
    alike = len({panel.signature for panel in panels}) == 1
    are_lines = all(panel.kind == "lines" for panel in panels)
    columns = len(panels) if len(panels) <= 3 else min(4, math.ceil(len(panels) ** 0.5))
    if ax is None:
        figure = InlineFigure(figsize=_size(panels, columns), layout="constrained") if figure is None else figure
        areas, _ = panel_grid(figure, len(panels), columns, sharex=alike, sharey=alike or are_lines)
    else:
        areas, figure = [ax], None
    plotted = list(zip(areas, panels, strict=True))
    values = line_values(panels)
    for axes, panel in plotted:
        axes.set_title(panel.title, fontsize="medium", loc="left")
        if panel.kind == "lines":
            colors = _colors(panel, values)
            _draw_lines(axes, panel, colors)
            _set_ticks(axes, panel.across, panels)
            if panel.cells.failed.any():
                _draw_failed_strip(axes, panel, colors, max(float(each.failed_share.max()) for each in panels))
    _draw_maps([each for each in plotted if each[1].kind == "map"], label)
    _begin_at_zero([axes for axes, panel in plotted if panel.kind == "lines"])
    _label(figure, plotted, label, alike=alike)
    if figure is None:
        _draw_legends(areas[0], plotted)
        return areas[0].figure
    if left_out:
        note = f"{len(panels)} of {len(panels) + left_out} panels, chosen evenly"
        figure.suptitle(note, fontsize="medium", color=RED)
    beside = any(panel.along for panel in panels if panel.kind == "lines")
    place = "outside right upper" if beside else "outside upper right"
    _draw_legends(figure, plotted, loc=place, ncols=1 if beside else 2)
    return figure


def _size(panels: Sequence[Panel], columns: int) -> tuple[float, float]:
    """Width and height of a figure [inches]."""
    width, height = _PANEL_SIZES[columns]
    beside = 1.3 if any(panel.along for panel in panels) else 0.0
    above = 0.0 if beside else 0.3
    return max(4.2, beside + width * columns), above + 0.3 + height * -(-len(panels) // columns)


def _palette(values: Array) -> dict[Any, str]:
    """Value of an axis → its colour, from dark to light if there are more than can be told apart otherwise."""
    colors = list(LINE_COLORS)
    if len(values) > MOST_LINES:
        colors = [to_hex(color) for color in colormaps["viridis"](np.linspace(0.0, 0.95, len(values)))]
    return dict(zip(values.tolist(), colors, strict=False))


def _colors(panel: Panel, values: Mapping[str, Array]) -> list[str]:
    """Colour of each line of a panel, given the values of all panels: each has the same colour everywhere."""
    if panel.along is None:
        return [BLUE]
    palette = _palette(values[panel.along.name])
    return [palette[value] for value in panel.along.values.tolist()]


def _places(panel: Panel) -> list[Array]:
    """Places along x of each line; names have the points of several lines side by side."""
    count = len(panel.cells.mean)
    shifts = np.zeros(count) if panel.across.is_numeric else (np.arange(count) - (count - 1) / 2) * 0.7 / count
    return [panel.across.places + shift for shift in shifts]


def _draw_lines(axes: Axes, panel: Panel, colors: Sequence[str]) -> None:
    """The lines of a panel with their bands, or points with bars where x has names."""
    is_numeric = panel.across.is_numeric
    for places, color, mean, sd, error in zip(
        _places(panel), colors, panel.cells.mean, panel.cells.sd, panel.cells.standard_error, strict=True
    ):
        bands = [(error, _DEEP, 3.5)] if panel.along else [(sd, _LIGHT, 7.0), (error, _DEEP, 3.5)]
        for half, opacity, width in bands:
            style: dict[str, Any] = {"color": color, "alpha": opacity}
            barred = np.isfinite(half)
            if is_numeric:
                axes.fill_between(places, mean - half, mean + half, linewidth=0, **style)
                # A band between gaps has no width: such a point has a bar.
                beside = np.pad(barred, 1)
                barred &= ~beside[:-2] & ~beside[2:]
            low, high = (mean - half)[barred], (mean + half)[barred]
            axes.vlines(places[barred], low, high, linewidth=width, **style)
        axes.plot(places, mean, "o-" if is_numeric else "o", markersize=3.5, linewidth=1.2, color=color)
    tidy(axes, grid="y")


def _set_ticks(axes: Axes, across: Axis, panels: Sequence[Panel]) -> None:
    """Scale and ticks of the x axis, for the values that all panels have on this axis."""
    if not across.is_numeric:
        axes.set_xticks(across.places, across.texts)
        axes.set_xlim(-0.6, len(across.values) - 0.4)
        if len(across.values) > label_room(axes, across.texts)[0]:
            axes.tick_params(axis="x", rotation=30)
        return
    named = [panel.across for panel in panels if panel.across.name == across.name and panel.across.is_numeric]
    values = np.unique(np.concatenate([axis.values for axis in named]))
    placed = values.astype(float)
    if values[0] > 0 and values[-1] >= _DECADES * values[0] and _unevenness(np.log(placed)) <= _unevenness(placed):
        axes.set_xscale("log")
        placed = np.log(placed)
    if len(values) <= _MOST_TICKS:
        texts = short_texts(values)
        needed = float(np.ptp(placed)) / label_room(axes, texts)[0]
        shown = [0, len(values) - 1]
        for number in range(1, len(values) - 1):
            if placed[number] - placed[shown[-2]] >= needed <= placed[-1] - placed[number]:
                shown.insert(-1, number)
        axes.set_xticks(values[shown], [texts[number] for number in shown])
        axes.xaxis.set_minor_locator(NullLocator())
    elif axes.get_xscale() == "linear":
        axes.ticklabel_format(axis="x", scilimits=(-3, 4))


def _unevenness(places: Array) -> float:
    """Coefficient of variation of the gaps."""
    gaps = np.diff(places)
    return float(gaps.std() / gaps.mean())


def _draw_failed_strip(axes: Axes, panel: Panel, colors: Sequence[str], most: float) -> None:
    """A strip above a panel with the share of the walks that failed, up to the greatest of all panels."""
    strip = axes.inset_axes((0.0, 1.04, 1.0, 0.16), sharex=axes)
    line = "o-" if panel.across.is_numeric else "o"
    for places, color, share in zip(_places(panel), colors, panel.failed_share, strict=True):
        strip.plot(places, share, line, color=color if panel.along else RED, linewidth=0.8, markersize=2.5)
    strip.set_ylim(-0.1 * most, 1.1 * most)
    strip.set_yticks([0.0, most])
    strip.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=None if most < 0.01 else 0))
    strip.set_ylabel("failed", fontsize="small", color=RED)
    strip.tick_params(labelbottom=False, labelsize="x-small")
    tidy(strip)


def _has_numbers(maps: Sequence[Panel]) -> bool:
    """Whether there is room for numbers in maps."""
    return sum(panel.cells.mean.size for panel in maps) <= _MOST_NUMBERS


def _draw_maps(maps: Sequence[tuple[Axes, Panel]], label: str) -> None:
    """Maps in common colours, whose meaning is the label; cells that are NaN stay empty."""
    if not maps:
        return
    means = np.concatenate([panel.cells.mean.ravel() for _, panel in maps])
    colors = {"vmin": np.nanmin(means), "vmax": np.nanmax(means)} if np.isfinite(means).any() else {}
    with_numbers = _has_numbers([panel for _, panel in maps])
    for axes, panel in maps:
        assert panel.along is not None
        image = axes.imshow(panel.cells.mean, origin="lower", aspect="auto", cmap="viridis", **colors)
        columns, rows = panel.across.texts, panel.along.texts
        for axis, texts, room in zip((axes.xaxis, axes.yaxis), (columns, rows), label_room(axes, columns), strict=True):
            every = slice(None, None, math.ceil(len(texts) / max(1, min(_MOST_ROWS, int(room)))))
            axis.set_ticks(range(len(texts))[every], list(texts[every]))
        axes.set_facecolor(GROUND)
        axes.spines[:].set_visible(False)
        axes.tick_params(color=FAINT)
        if with_numbers:
            _write_values(axes, image, panel.cells.mean, panel.counts)
        else:
            _draw_failed(axes, panel.failed_share)
    areas = [axes for axes, _ in maps]
    areas[0].figure.colorbar(image, ax=areas, label=label).outline.set_visible(False)


def _write_values(axes: Axes, image: Any, table: Array, cells: Mapping[str, Array]) -> None:
    """Write into each cell of a map its value, and how many of its walks failed or have not been run.

    Args:
        axes: where the map is.
        image: the map.
        table: its values; a dash stands for NaN, unless the cell has no walks at all.
        cells: numbers of walks: name of `COUNTS` → table.
    """
    for place, value in np.ndenumerate(table):
        rested, absent, lost, waiting = (cells[name][place] for name in COUNTS)
        if not (rested or absent or lost or waiting):
            continue
        text = f"{value:.3g}" if np.isfinite(value) else "–"
        text += f"\n{lost:.0f} failed" * bool(lost) + f"\n{waiting:.0f} to run" * bool(waiting)
        red, green, blue, _ = image.to_rgba(value) if np.isfinite(value) else (1.0, 1.0, 1.0, 1.0)
        color = INK if 0.3 * red + 0.59 * green + 0.11 * blue > 0.5 else "white"
        axes.text(place[1], place[0], text, ha="center", va="center", color=color, fontsize="small")


def _draw_failed(axes: Axes, share: Array) -> None:
    """Mark cells of a map in which walks failed by a dot, whose area is proportional to the share that failed."""
    rows, columns = np.nonzero(share > 0)
    sizes = _LARGEST_DOT * np.sqrt(share[rows, columns])
    places: dict[str, Any] = {"offsets": np.stack([columns, rows], axis=1), "offset_transform": axes.transData}
    style: dict[str, Any] = {"facecolor": RED, "edgecolor": "white", "linewidth": 0.5}
    dots = EllipseCollection(sizes, sizes, np.zeros(len(sizes)), units="xy", **places, **style)
    axes.add_collection(dots, autolim=False)


def _begin_at_zero(panels: Sequence[Axes]) -> None:
    """Let the common y axis of lines begin at zero if all is positive and takes more than half of it."""
    if panels:
        low, high = (f(getattr(axes.dataLim, end) for axes in panels) for f, end in ((min, "y0"), (max, "y1")))
        if 0 <= low < 0.5 * high:
            panels[0].set_ylim(0.0, 1.05 * high)


def _label(
    figure: Figure | SubFigure | None, plotted: Sequence[tuple[Axes, Panel]], label: str, *, alike: bool
) -> None:
    """Label axes: common ones once for the figure, if there is one, others at each panel; say which walks are lost."""
    common_x = figure is not None and alike
    common_y = common_x or (figure is not None and all(panel.kind == "lines" for _, panel in plotted))
    for axes, panel in plotted:
        across, note = quantity_label(panel.across.name), lost_note([panel.counts])
        rows = quantity_label(panel.along.name) if panel.kind == "map" and panel.along else label
        if common_x:
            axes.set_xlabel(note, color=RED, fontsize="small")
        else:
            axes.set_xlabel(f"{across}\n{note}" if note else across)
        if not common_y:
            axes.set_ylabel(rows)
    if figure is not None and common_x:
        figure.supxlabel(across, fontsize="medium")
    if figure is not None and common_y:
        figure.supylabel(rows, fontsize="medium")


def _draw_legends(owner: Axes | Figure | SubFigure, plotted: Sequence[tuple[Axes, Panel]], **place: Any) -> None:
    """One legend of all panels; if their lines are of several axes, each panel has one of its own, too."""
    panels = [panel for _, panel in plotted]
    values = line_values(panels)
    style: dict[str, Any] = {"frameon": False, "fontsize": "small"}
    title, handles = _line_handles(*next(iter(values.items()))) if len(values) == 1 else (None, [])
    for axes, panel in plotted:
        if len(values) > 1 and panel.kind == "lines" and panel.along:
            own, lines = _line_handles(panel.along.name, values[panel.along.name])
            axes.legend(handles=lines, title=own, **style)
    if any(panel.kind == "lines" for panel in panels):
        handles.append(Patch(color=(FAINT, _DEEP), linewidth=0, label="± standard error"))
    if any(panel.along is None for panel in panels):
        handles.append(Patch(color=(FAINT, _LIGHT), linewidth=0, label="± standard deviation"))
    maps = [panel for panel in panels if panel.kind == "map"]
    if not _has_numbers(maps) and any(panel.cells.failed.any() for panel in maps):
        handles.append(Line2D([], [], color=RED, marker="o", linestyle="", label="share of walks failed"))
    if handles:
        owner.legend(handles=handles, title=title, **style, **place)


def _line_handles(name: str, values: Array) -> tuple[str, list[Line2D | Patch]]:
    """Title and entries of the legend of lines."""
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=color, marker="o", markersize=3.5, label=text)
        for color, text in zip(_palette(values).values(), short_texts(values), strict=True)
    ]
    return with_unit(math_symbol(name), unit_text(name)), handles
