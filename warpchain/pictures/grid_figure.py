"""Figures of a quantity over a grid with any number of axes: lines with error bars, or maps with gaps.

Along x runs the frequency if it has three values or more, else the longest axis of numbers. The next longest axis gives
the lines, or the rows of a map if both have many values; all other axes give panels.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from warpchain.inputs.arrays import AnyArray
from warpchain.inputs.validation import InputError, shown
from warpchain.pictures import labels, style
from warpchain.pictures.labels import math_symbol, short_texts, unit_text, with_unit
from warpchain.pictures.style import BLUE, FAINT, GROUND, LINE_COLORS, RED, AnyFigure, NothingToShow, panel_grid, tidy
from warpchain.walks.cell_statistics import CellStatistics

MOST_LINES: Final = len(LINE_COLORS)
"""Greatest number of lines in a panel, unless lines are asked for."""
MOST_PANELS: Final = 24
"""Greatest number of panels of a block; of more, the first are shown."""
_DEEP, _LIGHT = 0.45, 0.15
"""Opacity of the bars of one standard error and one standard deviation."""
_PANEL_SIZES: Final = {1: (5.2, 3.6), 2: (3.6, 2.9), 3: (3.0, 2.6), 4: (2.6, 2.4)}
"""Number of columns → width and height of a panel [inches]."""


class Axis(NamedTuple):
    """An axis of a grid: numbers in rising order, or names in the order given."""

    name: str
    values: tuple[Any, ...]
    is_numeric: bool


class Panel(NamedTuple):
    """One panel: whether it is a map, its x axis, the axis of its lines or the y axis of a map, and its cells.

    Arrays of the cells have shape (values of `along`, values of `across`), of one row if there is just one line; the
    title says what else they have in common.
    """

    is_map: bool
    across: Axis
    along: Axis | None
    title: str
    cells: "CellStatistics"


def draw_grid(
    blocks: "Mapping[str, CellStatistics]",
    quantity: str,
    x: str | None = None,
    figure: AnyFigure | None = None,
    title: str = "",
    width: float | None = None,
) -> AnyFigure:
    """Draw a quantity over the grids of one block or several.

    Lines have bars of one standard error; a single line has lighter ones of one standard deviation, too. Open symbols
    are means of survivors, with an upright triangle at the lower bound of the whole mean where there is one. A red
    cross on the x axis, or a dot in a map, says that walks failed there; a ring in a map is a mean of survivors.
    `blocks`: name of each → the statistics of its cells. The name of the quantity is for labels, the title says what
    all walks have in common, the width of a new figure is in inches, and all else is as of `SweepResult.plot`. A
    `NothingToShow` says that no block has an axis of several values, or that there is no mean.
    """
    if figure is not None:
        style.checked_figure(figure)
    panels, left_out = _all_panels(blocks, x)
    text = labels.quantity_text(quantity)
    if quantity == "dx" and any("slope" in cells.axes for cells in blocks.values()):
        text = f"{text} = $x$ / cos $α$"
    label = with_unit(text, next(iter(blocks.values())).unit)
    are_lines = not any(panel.is_map for panel in panels)
    alike = len({panel[:3] for panel in panels}) == 1
    columns = len(panels) if len(panels) <= 3 else min(4, math.ceil(len(panels) ** 0.5))
    columns = style.columns_on(width, columns)
    wide, height = _PANEL_SIZES[columns]
    beside = 1.3 if any(panel.along for panel in panels) and (width is None or width >= 4) else 0.0
    size = width or max(4.2, beside + wide * columns), 0.25 * bool(title) + (0.3 if beside else 0.6)
    size = size[0], size[1] + height * min(1.0, size[0] / (beside + wide * columns)) * -(-len(panels) // columns)
    owner = style.InlineFigure(figsize=size, layout="constrained") if figure is None else figure
    areas, _ = panel_grid(owner, len(panels), columns, sharex=alike, sharey=alike or are_lines)
    palettes = _palettes(panels)
    lines, maps = list[Axes](), list[Axes]()
    share = 0.95 * (1.0 - beside * owner.dpi / owner.bbox.width) / columns
    for axes, panel in zip(areas, panels, strict=True):
        axes.set_title(panel.title, fontsize="medium", loc="left")
        if panel.is_map:
            means = np.concatenate([each.cells.mean.ravel() for each in panels if each.is_map])
            image = _draw_map(axes, panel, (np.nanmin(means), np.nanmax(means)))
            maps.append(axes)
        else:
            _draw_lines(axes, panel, palettes[panel.along.name] if panel.along else {})
            lines.append(axes)
        note = labels.lost_note([vars(panel.cells)])
        name = labels.quantity_label(panel.across.name) if not alike or axes in areas[-columns:] else ""
        axes.set_xlabel("\n".join(style.wrapped(text, owner, share, " ") for text in (name, note) if text))
        if not (alike or are_lines) or axes in areas[::columns]:
            axes.set_ylabel(labels.quantity_label(panel.along.name) if panel.is_map and panel.along else label)
    if left_out:
        title = ", ".join([*[title] * bool(title), f"{len(panels)} of {len(panels) + left_out} panels"])
    title = style.head(owner, title, bool(beside))
    if maps:
        owner.colorbar(image, ax=maps, label=label).outline.set_visible(False)
    ends = [end for axes in lines for end in (axes.dataLim.y0, axes.dataLim.y1)]
    for axes in lines:  # zero is in all, as in the figure of the paper
        axes.set_ylim(1.05 * min(0.0, *ends), 1.05 * max(0.0, *ends))
    _draw_legends(owner, areas, panels, palettes, bool(beside), title)
    return owner


def _all_panels(blocks: "Mapping[str, CellStatistics]", x: str | None) -> tuple[list[Panel], int]:
    """The panels of all blocks, and the number of those that are left out because there are too many."""
    axes = {name: [name for name, values in cells.axes.items() if len(values) > 1] for name, cells in blocks.items()}
    if x is not None and not any(x in own for own in axes.values()):
        known = ", ".join(dict.fromkeys(name for own in axes.values() for name in own))
        raise InputError(f"x: {shown(x)} is not an axis with several values; use one of {known}")
    panels: list[Panel] = []
    left_out = 0
    for name, cells in blocks.items():
        if not axes[name] or (x is not None and x not in axes[name]):
            continue
        is_named = sum(set(own) == set(axes[name]) for own in axes.values()) > 1
        found = list(_panels(cells, x, name if is_named else ""))
        panels += found[:MOST_PANELS]
        left_out += len(found[MOST_PANELS:])
    if not panels:
        raise NothingToShow("expected an axis with several values; use a sweep that has one")
    if not any(np.isfinite(panel.cells.mean).any() for panel in panels):
        if any(panel.cells.absent.any() for panel in panels):
            raise NothingToShow("no walk has this quantity; use another, e.g. quantity='walk_time'")
        raise NothingToShow("no walk has come to rest; resume the sweep, or check the statuses in summary()")
    return [each for each in panels if np.isfinite(each.cells.mean).any() or each.cells.failed.any()], left_out


def _panels(cells: "CellStatistics", x: str | None, block: str) -> Iterator[Panel]:
    """The panels of a block; titles begin with `block`, if it is not empty."""
    numeric = {name: values.dtype.kind in "if" for name, values in cells.axes.items()}
    rising = [np.argsort(cells.axes[name]) if numeric[name] else np.arange(len(cells.axes[name])) for name in numeric]
    given = zip(cells.axes.items(), rising, strict=True)
    axes = [Axis(name, tuple(values[order].tolist()), numeric[name]) for (name, values), order in given]
    several = [axis for axis in axes if len(axis.values) > 1]

    def fit(axis: Axis) -> tuple[bool, bool, bool, int]:
        is_frequency = axis.name == "frequency" and len(axis.values) > 2
        return axis.name == x, axis.is_numeric, is_frequency, len(axis.values)

    across = max(reversed(several), key=fit)
    rest = [axis for axis in several if axis is not across]
    rest.sort(key=lambda axis: len(axis.values))
    along = rest.pop() if rest else None
    is_map = along is not None and min(len(along.values), len(across.values)) > MOST_LINES
    if along is not None and len(along.values) > MOST_LINES and not is_map and x is None:  # beside a short axis
        across, along = along, across
    others = [axis for axis in several if axis in rest]
    order = [several.index(axis) for axis in (*others, along, across) if axis is not None]

    def arranged(table: AnyArray) -> AnyArray:
        table = table[np.ix_(*rising)].reshape([len(axis.values) for axis in several]).transpose(order)
        return table[..., np.newaxis, :] if along is None else table

    tables = {name: arranged(getattr(cells, name)) for name in (*labels.SPREADS, "independent", *labels.COUNTS)}
    texts = [labels.named_values(axis.name, axis.values) for axis in others]
    for place in np.ndindex(*(len(axis.values) for axis in others)):
        title = ", ".join([*[block] * bool(block), *(own[number] for own, number in zip(texts, place, strict=True))])
        here: dict[str, Any] = {name: table[place] for name, table in tables.items()}
        yield Panel(is_map, across, along, title, replace(cells, **here))


def _palettes(panels: Sequence[Panel]) -> dict[str, dict[Any, str]]:
    """Each axis that gives lines → its values in all panels → their colours, from dark to light if they are many."""
    found: dict[str, list[Axis]] = {}
    for panel in panels:
        if panel.along and not panel.is_map:
            found.setdefault(panel.along.name, []).append(panel.along)
    palettes = {}
    for name, axes in found.items():
        values = list(dict.fromkeys(value for axis in axes for value in axis.values))
        values = sorted(values) if all(axis.is_numeric for axis in axes) else values
        colors = list(LINE_COLORS)
        if len(values) > MOST_LINES:
            colors = [to_hex(color) for color in colormaps["viridis"](np.linspace(0.0, 0.95, len(values)))]
        palettes[name] = dict(zip(values, colors, strict=False))
    return palettes


def _draw_lines(axes: Axes, panel: Panel, palette: Mapping[Any, str]) -> None:
    """The lines of a panel with their bars; names along x have the points of several lines side by side."""
    cells, values, is_numeric = panel.cells, np.array(panel.across.values), panel.across.is_numeric
    count = len(cells.mean)
    colors = [palette[value] for value in panel.along.values] if panel.along else [BLUE]
    shifts = np.zeros(count) if is_numeric else (np.arange(count) - (count - 1) / 2) * 0.7 / count
    places = values if is_numeric else np.arange(len(values))
    order = list(palette.values())
    for number, (shift, color) in enumerate(zip(shifts, colors, strict=True)):
        mean = cells.mean[number]
        if panel.along is None:
            axes.errorbar(places, mean, cells.sd[number], fmt="none", ecolor=(color, _LIGHT), elinewidth=8.0)
        error, look = cells.standard_error[number], _look(order.index(color) if order else 0, len(order))
        look |= {"color": color, "ecolor": (color, _DEEP)} | ({} if is_numeric else {"linestyle": ""})
        axes.errorbar(places + shift, mean, error, elinewidth=3.5, **look)
        partial, bounds = cells.of_survivors[number], cells.at_least[number]
        style.mark_survivors(axes, places + shift, mean, partial, bounds, color)
    failed = np.flatnonzero(cells.failed.any(axis=0))
    if failed.size:
        floor: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "clip_on": False, "in_layout": False}
        axes.plot(places[failed], 0.0 * failed, "x", color=RED, markersize=5.0, zorder=5, **floor)
    texts = short_texts(values)
    if not is_numeric:
        rotation = 30 if max(map(len, texts)) * len(texts) > 30 else 0
        axes.set_xticks(places, texts, rotation=rotation)
        axes.set_xlim(-0.6, len(values) - 0.4)
    else:
        placed = values.astype(float)
        if 0 < 10 * values[0] <= values[-1] and _unevenness(np.log(placed)) < _unevenness(placed):
            axes.set_xscale("log")
            placed = np.log(placed)
        if len(values) <= 8 and np.diff(placed).min() > 0.08 * np.ptp(placed):
            axes.set_xticks(values, texts)  # one for each number, if they are few and not too close
            axes.xaxis.set_minor_locator(NullLocator())
    tidy(axes, grid="y")


def _look(number: int, count: int) -> dict[str, Any]:
    """Symbol and line of a curve among some; of many, whose colours go from dark to light, all are alike."""
    place = number if count <= MOST_LINES else 0
    return {"marker": style.MARKERS[place], "linestyle": style.STROKES[place], "markersize": 3.5, "linewidth": 1.2}


def _unevenness(places: AnyArray) -> float:
    """Coefficient of variation of the gaps."""
    gaps = np.diff(places)
    return float(gaps.std() / gaps.mean())


def _draw_map(axes: Axes, panel: Panel, limits: tuple[float, float]) -> Any:
    """A map, in the colours of these limits; empty where there is no mean, with dots as large as the share failed."""
    assert panel.along is not None
    cells = panel.cells
    image = axes.imshow(cells.mean, origin="lower", aspect="auto", cmap="viridis", vmin=limits[0], vmax=limits[1])
    for axis, values in ((axes.xaxis, panel.across.values), (axes.yaxis, panel.along.values)):
        texts = short_texts(values)
        most = 16 if axis is axes.yaxis else max(2, 32 // max(map(len, texts)))  # labels
        every = slice(None, None, math.ceil(len(texts) / most))
        axis.set_ticks(range(len(texts))[every], texts[every])
    axes.set_facecolor(GROUND)
    axes.spines[:].set_visible(False)
    axes.tick_params(color=FAINT)
    share = cells.failed / np.maximum(cells.count + cells.absent + cells.failed, 1)
    rows, columns = np.nonzero(share)
    axes.scatter(columns, rows, 50 * share[rows, columns], color=RED, edgecolor="white", linewidth=0.5)
    rows, columns = np.nonzero(cells.of_survivors & (cells.failed == 0))
    if len(rows):
        axes.scatter(columns, rows, 14, facecolor="none", edgecolor="white", linewidth=1.0)
    return image


def _draw_legends(
    owner: AnyFigure,
    areas: Sequence[Axes],
    panels: Sequence[Panel],
    palettes: Mapping[str, Mapping[Any, str]],
    beside: bool,
    head: str,
) -> None:
    """One legend of all panels, with a text at its head; if lines are of several axes, each panel has one, too."""
    look: dict[str, Any] = {"frameon": False, "fontsize": "small"}
    handles: list[Line2D | Patch] = []
    title = None
    for name, palette in palettes.items():
        texts = zip(palette.values(), short_texts(list(palette)), strict=True)
        looks = [_look(number, len(palette)) for number in range(len(palette))]
        lines = [Line2D([], [], color=c, label=text, **own) for (c, text), own in zip(texts, looks, strict=True)]
        if len(palettes) == 1:
            handles, title = [*lines], with_unit(math_symbol(name), unit_text(name))
        for axes, panel in zip(areas, panels, strict=True):
            if len(palettes) > 1 and not panel.is_map and panel.along and panel.along.name == name:
                axes.legend(handles=lines, title=with_unit(math_symbol(name), unit_text(name)), **look)
    if not all(panel.is_map for panel in panels):
        known = any(np.isfinite(panel.cells.standard_error).any() for panel in panels)
        unknown = any(panel.cells.why_no_error for panel in panels)
        if known or not unknown:
            handles.append(Patch(color=(FAINT, _DEEP), linewidth=0, label="± standard error"))
        if unknown:
            handles.append(Line2D([], [], linestyle="", label="one randomisation: no standard error"))
    if any(panel.along is None for panel in panels):
        handles.append(Patch(color=(FAINT, _LIGHT), linewidth=0, label="± standard deviation"))
    if any(panel.cells.failed.any() for panel in panels):
        marker = "o" if panels[0].is_map else "x"
        handles.append(Line2D([], [], color=RED, marker=marker, linestyle="", label="walks failed"))
    handles += style.survivor_handles(
        any(panel.cells.of_survivors.any() for panel in panels),
        any(np.isfinite(panel.cells.at_least).any() for panel in panels if not panel.is_map),
    )
    place: Any = {"loc": "outside right upper", "ncols": 1} if beside else {"loc": "outside upper right", "ncols": 2}
    if handles:
        owner.legend(handles=handles, title="\n".join(filter(None, (head, title))) or None, **style.LEGEND, **place)
