"""Distance walked against a third quantity: a panel for each frequency, a line for each number of links."""

from typing import Final, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from warpchain.pictures.labels import DISTANCE, lost_note, quantity_label
from warpchain.pictures.style import FAINT, LINE_COLORS, Picture, tidy
from warpchain.store.sweep_result import BlockResult, SweepResult

_AXES: Final = {"links", "frequency"}
_SHOWN_ELSEWHERE: Final = {"tolerance"}
_STYLES: Final[tuple[Literal["-", "--", ":", "-."], ...]] = ("-", "--", ":", "-.")
"""Styles of the lines, by block."""


def third_axis(block: BlockResult) -> str | None:
    """The numeric axis that a block has beside links and frequency, if it has just one, of several values."""
    others = [name for name in block.axes if name not in _AXES]
    if len(others) != 1 or others[0] in _SHOWN_ELSEWHERE or not set(block.axes) >= _AXES:
        return None
    values = block.axes[others[0]]
    return others[0] if values.dtype.kind in "if" and len(values) > 1 else None


def third_quantities(result: SweepResult) -> list[str]:
    """The third axes of all blocks, each once."""
    return list(dict.fromkeys(name for block in result.blocks.values() if (name := third_axis(block))))


def panels(result: SweepResult, quantity: str) -> Picture:
    """Distance against one of the sweep's third quantities; bars are two standard errors."""
    blocks = [block for block in result.blocks.values() if third_axis(block) == quantity]
    styles = [_STYLES[number % len(_STYLES)] for number in range(len(blocks))]
    links = sorted({int(n) for block in blocks for n in block.axes["links"]})
    color_of = {number: LINE_COLORS[place % len(LINE_COLORS)] for place, number in enumerate(links)}
    frequencies = sorted({float(f) for block in blocks for f in block.axes["frequency"]})
    figure = Figure(figsize=(1.2 + 3.0 * len(frequencies), 3.6), layout="constrained")
    axes_at = dict(zip(frequencies, figure.subplots(1, len(frequencies), squeeze=False)[0], strict=True))
    statistics = [block.statistics() for block in blocks]
    for block, found, style in zip(blocks, statistics, styles, strict=True):
        order = [list(block.axes).index(name) for name in ("links", "frequency", quantity)]
        mean, error = (table.transpose(order) for table in (found.mean, found.standard_error))
        values = np.asarray(block.axes[quantity], dtype=float)
        for row, number in enumerate(block.axes["links"]):
            line = {"color": color_of[int(number)], "linestyle": style, "linewidth": 1.2}
            for column, frequency in enumerate(block.axes["frequency"]):
                axes_at[float(frequency)].errorbar(
                    values, mean[row, column], 2 * error[row, column], elinewidth=0.8, marker="o", markersize=3, **line
                )
    for frequency, axes in axes_at.items():
        axes.set_title(f"$ν$ = {frequency:g} Hz", fontsize="medium", loc="left")
        axes.set_ylim(bottom=0.0)
        tidy(axes, grid="both")
    handles = [
        Line2D([], [], color=color, marker="o", markersize=3, label=f"$n$ = {number}")
        for number, color in color_of.items()
    ]
    if len(blocks) > 1:
        handles += [
            Line2D([], [], color=FAINT, linestyle=style, label=block.name)
            for block, style in zip(blocks, styles, strict=True)
        ]
    figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize="small")
    note = lost_note(statistics)
    figure.supxlabel(quantity_label(quantity) + (f"\n{note}" if note else ""), fontsize="medium")
    figure.supylabel(DISTANCE, fontsize="medium")
    name = quantity.replace("_", " ")
    caption = f"Distance walked against {name}, by links and frequency: means with two standard errors."
    return Picture(f"against_{quantity}", caption, figure)
