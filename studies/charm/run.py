"""Draws the figure of README.md, whose three loops walk anew, and writes its tables, from the folder of the sweep."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import warpchain
from studies import common
from studies.common import DISTANCE, LINE_COLORS, RED, Array, Block

FOLDER = Path(__file__).parent
TIMES = (0.0, 0.04, 0.08, 0.16, 0.32)  # Moments of the loops [s] since the release
DRAWN = (0.0, 0.02, 0.1)  # Masses of their charms [kg]


def distances(block: Block) -> str:
    """Δx with its errors, duration, bounces and share at rest of each cell, in Markdown."""
    cells, time, bounces = (block.statistics(name) for name in ("dx", "walk_time", "bounces"))
    rows = []
    for place, at in common.of_cells(block):
        *values, mass = at.values()
        share = cells.count[place] / block.shape[-1]
        text = f"{cells.mean[place]:.3f} ± {cells.standard_error[place]:.3f}"
        numbers = text, cells.sd[place], time.mean[place], bounces.mean[place]
        rows.append((*values, 1e3 * mass, *(numbers if share else ("–",) * 4), share))
    names = [name.replace("frequency", "ν / Hz") for name in block.axes][:-1]
    heads = (*names, "charm / g", "Δx / m", "σ / m", "t / s", "bounces", "at rest")
    return common.table(heads, rows, len(at) * "g " + "s .3f .2f .1f .0%")


def draw_distances(panel: Axes, block: Block) -> None:
    """Mean Δx with standard errors against the mass of the charm, a line for each chain and frequency."""
    cells, masses = block.statistics(), 1e3 * block.axes["charm_mass"]
    for number, place in enumerate(np.ndindex(cells.mean.shape[:-1])):
        values = [block.axes[name][index] for name, index in zip(("links", "frequency"), place, strict=True)]
        label = "$n$ = {:g}, {:g} Hz".format(*values)
        common.error_line(panel, masses, cells, place, color=LINE_COLORS[number], label=label)
    panel.legend(frameon=False, fontsize="small")
    top = 1.3 * panel.get_ylim()[1]
    common.tidy(panel, grid="both", xlabel="mass of the charm / g", ylabel=DISTANCE, ylim=(0, top))


def draw_loops(panels: Array, links: int = 60, frequency: float = 15.0) -> None:
    """The loop with three charms at the same moments, a panel for each charm, which is a dot."""
    for panel, mass in zip(panels, DRAWN, strict=True):
        scene = {"start": "ellipse", "links": links, "frequency": frequency, "charm_mass": mass}
        times = {"frame_interval": 0.01, "walk_limit": TIMES[-1] + 0.02}
        walk = warpchain.walk(preset="soft", method="explicit", **scene, **times)
        for number, moment in enumerate(TIMES):
            joints = walk.frame_joints[int(np.argmin(np.abs(walk.frame_time - moment)))]
            closed = np.vstack([joints[-1], joints]) + np.array([0.3 * number - joints[:, 0].mean(), 0.0])
            panel.plot(*closed.T, color=LINE_COLORS[0], linewidth=1.0)
            panel.plot(*closed[:2].mean(axis=0), "o", color=RED, markersize=4 if mass else 2)
            panel.annotate(f"{moment:g} s", (0.3 * number, -0.06), ha="center", fontsize="x-small")
        panel.axhline(0.0, color="black", linewidth=0.8)
        limits = {"xlim": (-0.2, 0.3 * len(TIMES) - 0.1), "ylim": (-0.07, 0.5)}
        common.tidy(panel, f"charm of {1e3 * mass:g} g", aspect="equal", **limits)
        panel.set_axis_off()


def main(folder: str) -> None:
    """Write the tables into the page and draw the figure: distances on the left, loops on the right."""
    blocks = warpchain.load(folder).blocks
    figure = Figure(figsize=(9.2, 4.2), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1, 1.25))
    draw_distances(left.subplots(), blocks["ellipse"])
    draw_loops(right.subplots(len(DRAWN), 1))
    common.publish(FOLDER, {name: distances(block) for name, block in blocks.items()}, {"charm": figure})


if __name__ == "__main__":
    common.run_study(main)
