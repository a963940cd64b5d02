"""Writes the tables of README.md; from a folder of the sweep, if one is given, results/slopes.csv and the figure."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from matplotlib.figure import Figure

import warpchain
from studies import common
from studies.common import LINE_COLORS, Array, Block, Columns

FOLDER = Path(__file__).parent
RESULTS = "results/slopes.csv"  # In the folder of the page
LIMIT = 20.0  # `distance_limit` of the sweep [m]
AXES = {"links": "{:g} links", "frequency": "{:g} Hz", "floor_friction": "μ_fc = {:g}", "slope": "{:g}°"}
TABLES = {
    "slope": (("slope",), ("links", "frequency")),
    "friction": (("slope",), ("floor_friction",)),
    "stairs": (("links",), ("frequency",)),
}
"""Block of the sweep → axes down its table, and across it."""
SHOWN = (-10, -5, 0, 5, 10, 12.5, 15, 17.5, 25, 30)  # Slopes of the tables [°]


def is_endless(block: Block) -> Array:
    """Which walks ended by their distance."""
    return np.asarray(block.columns["status"] == warpchain.Status.DISTANCE_LIMIT)


def reduced(blocks: Mapping[str, Block]) -> Iterator[dict[str, Any]]:
    """Rows of the file: of each cell Δx of the walks at rest [m]; share and speed [m/s] of those without end."""
    for name, block in blocks.items():
        cells, endless = block.statistics(), is_endless(block)
        speed = common.mean(np.where(endless, LIMIT / block.columns["walk_time"], np.nan))
        collapsed = common.mean(block.columns["collapsed_at"])
        for place, at in common.of_cells(block):
            yield {
                "block": name,
                **{axis: at.get(axis, np.nan) for axis in AXES},
                "dx": cells.mean[place],
                "standard_error": cells.standard_error[place],
                "endless": endless.mean(axis=-1)[place],
                "endless_speed": speed[place],
                "collapsed_at": collapsed[place],
            }


def text_of(dx: float, error: float, endless: float) -> str:
    """Δx of a cell; with its error and the share of the walks that are not in it, if there are any."""
    if not endless:
        return f"{dx:#.3g}"
    both = "–" if np.isnan(dx) else f"{dx:#.3g}" if np.isnan(error) else f"{dx:#.3g} ± {error:#.2g}"
    return f"{both} ({100 * endless:.0f} %)"


def distances(rows: Columns, down: Sequence[str], across: Sequence[str]) -> str:
    """Mean Δx of the walks at rest, in Markdown."""

    def name_of(axes: Sequence[str], place: int) -> str:
        return ", ".join(AXES[axis].format(rows[axis][place]) for axis in axes)

    cells: dict[str, dict[str, str]] = {}
    for place, numbers in enumerate(zip(rows["dx"], rows["standard_error"], rows["endless"], strict=True)):
        cells.setdefault(name_of(down, place), {})[name_of(across, place)] = text_of(*numbers)
    heads = ("", *next(iter(cells.values())))
    return common.minus(common.table(heads, ((name, *texts.values()) for name, texts in cells.items())))


def draw(block: Block) -> Figure:
    """Mean Δx with its standard error, and the share of walks without end, against the slope."""
    cells, slope, endless = block.statistics(), block.axes["slope"], is_endless(block).mean(axis=-1)
    figure = Figure(figsize=(6.8, 5.6), layout="constrained")
    distance, share = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    for (row, links), dashes in zip(enumerate(block.axes["links"]), ("-", "--"), strict=False):
        for column, frequency in enumerate(block.axes["frequency"]):
            style = {"color": LINE_COLORS[column], "linestyle": dashes, "linewidth": 1.2}
            label = f"$n$ = {links:g}, $ν$ = {frequency:g} Hz"
            common.error_line(distance, slope, cells, (row, column), label=label, **style)
            share.plot(slope, endless[row, column], **style)
    distance.set(yscale="log", ylabel="distance walked $Δx$ = $x$ / cos $α$ / m")
    distance.legend(frameon=False, fontsize="small")
    share.set(ylabel="share\nwithout end", xlabel="slope / °, positive downhill")
    for panel in (distance, share):
        common.tidy(panel, grid="both")
    return figure


def main(folder: Annotated[str | None, typer.Argument()] = None) -> None:
    """Reduce a folder and draw its slopes if it is given; write the tables of all blocks."""
    if folder is not None:
        result = warpchain.load(folder)
        blocks = result.blocks
        common.write_rows(FOLDER / RESULTS, reduced(blocks), result)
        common.publish(FOLDER, {}, {"slopes": draw(blocks["slope"])})
    columns, tables = common.read_columns(FOLDER / RESULTS), {}
    for name, axes in TABLES.items():
        chosen = (columns["block"] == name) & (np.isin(columns["slope"], SHOWN) | np.isnan(columns["slope"]))
        tables[name] = distances({key: values[chosen] for key, values in columns.items()}, *axes)
    common.publish(FOLDER, tables)


if __name__ == "__main__":
    common.run_study(main)
