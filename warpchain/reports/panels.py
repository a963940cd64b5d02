"""Distance walked against a third quantity: a panel for each frequency, a line for each number of links."""

from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from warpchain.pictures.walk_figures import FAINT, LINE_COLORS, _tidy
from warpchain.reports.statistics import NothingToShow
from warpchain.reports.sweep_series import Cell, lost_note

if TYPE_CHECKING:
    from warpchain.store.sweep_result import BlockResult, SweepResult

_AXES: Final = {"links", "frequency"}
_SHOWN_ELSEWHERE: Final = {"tolerance"}
_STYLES: Final[tuple[Literal["-", "--", ":", "-."], ...]] = ("-", "--", ":", "-.")
"""Of the lines of each block."""


def third_axis(block: "BlockResult") -> str | None:
    """The numeric axis that a block has beside links and frequency, if it has just one, of several values."""
    others = [name for name in block.axes if name not in _AXES]
    if len(others) != 1 or others[0] in _SHOWN_ELSEWHERE or not set(block.axes) >= _AXES:
        return None
    values = block.axes[others[0]]
    return others[0] if values.dtype.kind in "if" and len(values) > 1 else None


def sweep_panels(result: "SweepResult", label_of: dict[str, str]) -> list[tuple[str, Figure]]:
    """One figure for each third quantity: its name and the figure; bars are two standard errors.

    Args:
        result: a sweep.
        label_of: third quantity → label of its axis.

    Raises:
        NothingToShow: no block has links, frequency and one more number as axes, with walks at rest.
    """
    names = {name: third_axis(block) for name, block in result.blocks.items()}
    quantities = list(dict.fromkeys(name for name in names.values() if name is not None))
    if not quantities:
        raise NothingToShow("panels take blocks with links, frequency and one more number as axes")
    return [
        (
            quantity,
            _panels(
                [result.blocks[name] for name, third in names.items() if third == quantity],
                quantity,
                label_of.get(quantity, quantity),
            ),
        )
        for quantity in quantities
    ]


def _panels(blocks: "list[BlockResult]", quantity: str, label: str) -> Figure:
    links = sorted({int(n) for block in blocks for n in block.axes["links"]})
    frequencies = sorted({float(f) for block in blocks for f in block.axes["frequency"]})
    figure = Figure(figsize=(1.2 + 3.0 * len(frequencies), 3.6), layout="constrained")
    grid = figure.subplots(1, len(frequencies), squeeze=False)[0]
    cells: list[Cell] = []
    for block, style in zip(blocks, _STYLES * len(blocks), strict=False):
        found = block.statistics()
        order = [list(block.axes).index(name) for name in ("links", "frequency", quantity)]
        mean, error = (table.transpose(order) for table in (found.mean, found.standard_error))
        cells.append(Cell(np.nan, np.nan, *(int(table.sum()) for table in (found.count, found.failed, found.missing))))
        values = np.asarray(block.axes[quantity], dtype=float)
        for row, number in enumerate(block.axes["links"]):
            for column, frequency in enumerate(block.axes["frequency"]):
                axes = grid[frequencies.index(float(frequency))]
                color = LINE_COLORS[links.index(int(number)) % len(LINE_COLORS)]
                look = {"color": color, "linestyle": style, "linewidth": 1.2, "marker": "o", "markersize": 3}
                axes.errorbar(values, mean[row, column], 2 * error[row, column], elinewidth=0.8, **look)
    for axes, frequency in zip(grid, frequencies, strict=True):
        axes.set_title(f"$ν$ = {frequency:g} Hz", fontsize="medium", loc="left")
        axes.set_ylim(bottom=0.0)
        axes.grid(color="#E6E6E6", linewidth=0.6)
        _tidy(axes)
    handles = [
        Line2D([], [], color=LINE_COLORS[place % len(LINE_COLORS)], marker="o", markersize=3, label=f"$n$ = {number}")
        for place, number in enumerate(links)
    ]
    if len(blocks) > 1:
        handles += [
            Line2D([], [], color=FAINT, linestyle=style, label=block.name)
            for block, style in zip(blocks, _STYLES * len(blocks), strict=False)
        ]
    figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize="small")
    note = lost_note(cells)
    figure.supxlabel(label + (f"\n{note}" if note else ""), fontsize="medium")
    figure.supylabel("distance walked $Δx$ / m", fontsize="medium")
    return figure
