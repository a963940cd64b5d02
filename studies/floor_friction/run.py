"""Draws the figure of README.md and prints its numbers, from the folder of the sweep."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import warpchain
from studies.common import DISTANCE, LINE_COLORS, Array, Block, error_line, publish, run_study, table, tidy

FOLDER = Path(__file__).parent


def furthest(block: Block) -> Array:
    """The friction with which mean Δx is greatest, (links, frequencies)."""
    return block.axes["floor_friction"][np.argmax(block.statistics().mean, axis=-1)]


def ledger(block: Block, links: int, frequency: float) -> str:
    """Mean Δx, speed, duration and energy lost in self-contacts by friction of a cell, in Markdown."""
    cell = tuple(list(block.axes[name]).index(value) for name, value in (("links", links), ("frequency", frequency)))
    dx, time, lost = (block.statistics(name).mean[cell] for name in ("dx", "walk_time", "loss_self_contact"))
    rows = zip(block.axes["floor_friction"], dx, dx / time, time, lost, strict=True)
    return table("μ_fc | Δx / m | Δx / t / (m/s) | t / s | lost to self-contacts / J", rows, "g .3f .2f .2f .2f")


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
    """Print the numbers of all blocks and draw them."""
    blocks = warpchain.load(folder).blocks
    for name, block in blocks.items():
        print(f"\n{name}: friction with the greatest mean Δx, rows links {block.axes['links'].tolist()}")
        print(furthest(block))
        print(ledger(block, int(block.axes["links"].max() * 2 // 3), float(block.axes["frequency"].max())))
    publish(FOLDER, {}, {"distances": draw(blocks)})


if __name__ == "__main__":
    run_study(main)
