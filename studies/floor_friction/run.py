"""Draws the figure of README.md and prints its numbers, from the folder of the sweep."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import warpchain
from studies.common import (
    DISTANCE,
    LINE_COLORS,
    Array,
    Block,
    Columns,
    error_line,
    of_cells,
    publish,
    read_columns,
    run_study,
    table,
    tidy,
    write_rows,
)

FOLDER = Path(__file__).parent


def furthest(block: Block) -> Array:
    """The friction with which mean Δx is greatest, (links, frequencies)."""
    return block.axes["floor_friction"][np.argmax(block.statistics().mean, axis=-1)]


def reduced(blocks: Mapping[str, Block]) -> Iterator[dict[str, Any]]:
    """Rows of the file: Δx of each cell [m] with its error, duration [s] and energy lost in self-contacts [J]."""
    for name, block in blocks.items():
        cells = block.statistics()
        time, lost = (block.statistics(column).mean for column in ("walk_time", "loss_self_contact"))
        for place, at in of_cells(block):
            own = {"dx": cells.mean[place], "standard_error": cells.standard_error[place]}
            yield {"block": name, **at, **own, "walk_time": time[place], "loss_self_contact": lost[place]}


def ledger(rows: Columns, links: float, frequency: float) -> str:
    """Mean Δx, speed, duration and energy lost in self-contacts by friction of a cell, in Markdown."""
    chosen = (rows["block"] == "rest") & (rows["links"] == links) & (rows["frequency"] == frequency)
    friction, dx, time, lost = (
        rows[name][chosen] for name in ("floor_friction", "dx", "walk_time", "loss_self_contact")
    )
    cells = zip(friction, dx, dx / time, time, lost, strict=True)
    return table(
        "μ_fc | Δx / m | mean speed / (m/s) | duration / s | lost in self-contacts / J", cells, "g .3f .2f .2f .2f"
    )


def draw(blocks: dict[str, Block]) -> Figure:
    """Mean Δx with standard errors against the friction: a panel for each frequency, solid and dashed lines."""
    axes_of = next(iter(blocks.values())).axes
    figure = Figure(figsize=(9.2, 3.2), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(axes_of["frequency"])))
    for column, panel in enumerate(panels):
        for (name, block), style in zip(blocks.items(), ("-", "--"), strict=False):
            cells = block.statistics()
            for row, links in enumerate(axes_of["links"]):
                color, label = LINE_COLORS[row % len(LINE_COLORS)], f"$n$ = {links}" if style == "-" else None
                friction = axes_of["floor_friction"]
                error_line(panel, friction, cells, (row, column), color=color, linestyle=style, label=label)
            if column == len(panels) - 1:
                panel.plot([], [], style, color="black", linewidth=1, label=name)
        panel.set_ylim(bottom=0)
        tidy(panel, f"$ν$ = {axes_of['frequency'][column]:g} Hz", grid="both")
    panels[0].set_ylabel(DISTANCE)
    figure.supxlabel("friction of the floor $μ_\\mathrm{fc}$", fontsize="medium")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize="small")
    return figure


def main(folder: str) -> None:
    """Reduce the sweep, write the table of 120 links at 30 Hz, draw all blocks and print where walks are longest."""
    result = warpchain.load(folder)
    for name, block in result.blocks.items():
        print(f"\n{name}: friction with the greatest mean Δx, rows links {block.axes['links'].tolist()}")
        print(furthest(block))
    path = FOLDER / "results" / "floor_friction.csv"
    write_rows(path, reduced(result.blocks), result)
    publish(FOLDER, {"ledger": ledger(read_columns(path), 120, 30.0)}, {"distances": draw(result.blocks)})


if __name__ == "__main__":
    run_study(main)
