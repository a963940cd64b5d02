"""Draws the figure of studies/slopes/README.md and writes its tables, from the folder of the sweep.

warpchain sweep studies/slopes/sweeps/slopes.yaml -o slopes --device cuda
python -m studies.slopes.run slopes
"""

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import warpchain
from studies.common import DISTANCE, LINE_COLORS, error_line, run_study, save_figure, table, tidy, write_tables

Array = NDArray[np.float64]
Block = Any
"""A block of `warpchain.SweepResult.blocks`."""

PAGE: Final = Path(__file__).with_name("README.md")
FIGURE: Final = Path(__file__).parent / "figures" / "slopes.png"
LIMIT: Final = 20.0
"""`distance_limit` of the sweep [m]."""


def share_without_end(block: Block) -> Array:
    """Share of the walks that ended by their distance, in each cell."""
    return (block.columns["status"] == warpchain.Status.DISTANCE_LIMIT).mean(axis=-1)


def speed_without_end(block: Block) -> Array:
    """Mean speed [m/s] along the floor of the walks that ended by their distance, in each cell; NaN without one."""
    endless = block.columns["status"] == warpchain.Status.DISTANCE_LIMIT
    speeds: Array = np.ma.masked_array(LIMIT / block.columns["walk_time"], ~endless).mean(axis=-1)
    return np.ma.filled(speeds, np.nan)


def mean_collapse(block: Block) -> Array:
    """Mean time [s] of the collapse of the loop, in each cell, over the walks in which it came."""
    times: Array = np.ma.masked_invalid(block.columns["collapsed_at"]).mean(axis=-1)
    return np.ma.filled(times, np.nan)


def rows(block: Block) -> str:
    """A line for each cell: its axes, Δx, the share and speed of walks without end, the collapse. In Markdown."""
    cells, parts = block.statistics(), (share_without_end(block), speed_without_end(block), mean_collapse(block))
    names = [*block.axes, "Δx / m", "±", "without end", "their speed / (m/s)", "collapse / s"]
    lines = []
    for place in np.ndindex(cells.mean.shape):
        here = [f"{values[number]:g}" for values, number in zip(block.axes.values(), place, strict=True)]
        share, speed, collapse = (part[place] for part in parts)
        numbers = (cells.mean[place], cells.standard_error[place])
        lines.append(
            [*here, *(f"{number:.3f}" for number in numbers), f"{share:.0%}", f"{speed:.2f}", f"{collapse:.2f}"]
        )
    return table(names, ((cell.replace("nan", "–") for cell in line) for line in lines))


def draw(block: Block) -> Figure:
    """Mean Δx with its standard error, and the share of walks without end, against the slope."""
    cells, slope = block.statistics(), block.axes["slope"]
    figure = Figure(figsize=(6.8, 5.6), layout="constrained")
    distance, share = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    for (row, links), dashes in zip(enumerate(block.axes["links"]), ("-", "--"), strict=False):
        for column, frequency in enumerate(block.axes["frequency"]):
            style = {"color": LINE_COLORS[column], "linestyle": dashes, "linewidth": 1.2}
            label = f"$n$ = {links:g}, $ν$ = {frequency:g} Hz"
            error_line(distance, slope, cells, (row, column), label=label, **style)
            share.plot(slope, share_without_end(block)[row, column], **style)
    distance.set(yscale="log", ylabel=DISTANCE)
    distance.legend(frameon=False, fontsize="small")
    share.set(ylabel="share\nwithout end", xlabel="slope / °, positive downhill")
    for panel in (distance, share):
        tidy(panel, grid="both")
    return figure


def main(folder: str) -> None:
    """Write the tables of all blocks into the page and draw the slopes."""
    blocks = warpchain.load(folder).blocks
    write_tables(PAGE, {name: rows(block) for name, block in blocks.items()})
    save_figure(draw(blocks["slope"]), FIGURE)


if __name__ == "__main__":
    run_study(main)
