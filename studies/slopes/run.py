"""Draws the figure of README.md and writes its tables, from the folder of the sweep."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import warpchain
from studies import common
from studies.common import LINE_COLORS, Array, Block

FOLDER = Path(__file__).parent
LIMIT = 20.0  # `distance_limit` of the sweep [m]


def share_without_end(block: Block) -> Array:
    """Share of the walks that ended by their distance, in each cell."""
    return (block.columns["status"] == warpchain.Status.DISTANCE_LIMIT).mean(axis=-1)


def rows(block: Block) -> str:
    """Of each cell Δx, share and speed along the floor of walks without end, and when it collapsed, if it did.

    A mean of survivors has a star, and beside it stands a lower bound of the mean of all walks.
    """
    cells, share, collapsed = block.statistics(), share_without_end(block), common.mean(block.columns["collapsed_at"])
    endless = block.columns["status"] == warpchain.Status.DISTANCE_LIMIT
    speed = common.mean(np.where(endless, LIMIT / block.columns["walk_time"], np.nan))
    lines = []
    for place, at in common.of_cells(block):
        mean = f"{cells.mean[place]:.3f}{'*' * bool(cells.of_survivors[place])}".replace("nan", "–")
        numbers = cells.standard_error[place], cells.at_least[place], share[place], speed[place], collapsed[place]
        lines.append([*at.values(), mean, *("–" if np.isnan(number) else number for number in numbers)])
    heads = *block.axes, "Δx / m", "±", "at least / m", "without end", "their speed / (m/s)", "collapse / s"
    return common.table(heads, lines, len(at) * "g " + "s .3f .2f .0% .2f .2f")


def draw(block: Block) -> Figure:
    """Mean Δx with its standard error, and the share of walks without end, against the slope."""
    cells, slope = block.statistics(), block.axes["slope"]
    figure = Figure(figsize=(6.8, 5.6), layout="constrained")
    distance, share = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    for (row, links), dashes in zip(enumerate(block.axes["links"]), ("-", "--"), strict=False):
        for column, frequency in enumerate(block.axes["frequency"]):
            style = {"color": LINE_COLORS[column], "linestyle": dashes, "linewidth": 1.2}
            label = f"$n$ = {links:g}, $ν$ = {frequency:g} Hz"
            common.error_line(distance, slope, cells, (row, column), label=label, **style)
            share.plot(slope, share_without_end(block)[row, column], **style)
    distance.set(yscale="log", ylabel="distance walked $Δx$ = $x$ / cos $α$ / m")
    distance.legend(frameon=False, fontsize="small")
    share.set(ylabel="share\nwithout end", xlabel="slope / °, positive downhill")
    for panel in (distance, share):
        common.tidy(panel, grid="both")
    return figure


def main(folder: str) -> None:
    """Write the tables of all blocks into the page and draw the slopes."""
    blocks = warpchain.load(folder).blocks
    common.publish(FOLDER, {name: rows(block) for name, block in blocks.items()}, {"slopes": draw(blocks["slope"])})


if __name__ == "__main__":
    common.run_study(main)
