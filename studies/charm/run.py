"""Writes the tables of README.md; from a folder of the sweep, if one is given, results/charm.csv and the figure.

The three loops of the figure walk anew.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import warpchain
from studies import common
from studies.common import DISTANCE, LINE_COLORS, RED, Array, Block, Columns

FOLDER = Path(__file__).parent
RESULTS = "results/charm.csv"  # In the folder of the page
AXES = ("links", "frequency", "charm_mass")
ON_SPROCKET = 15.0  # Frequency of the sprocket in its block of the sweep [Hz]
TIMES = (0.0, 0.04, 0.08, 0.16, 0.32)  # Moments of the loops [s] since the release
DRAWN = (0.0, 0.02, 0.1)  # Masses of their charms [kg]


def reduced(blocks: Mapping[str, Block]) -> Iterator[dict[str, Any]]:
    """Rows of the file: Δx of each cell [m] with its errors, duration [s], bounces and share at rest."""
    for name, block in blocks.items():
        cells, time, bounces = (block.statistics(column) for column in ("dx", "walk_time", "bounces"))
        for place, at in common.of_cells(block):
            yield {
                "block": name,
                **{axis: at.get(axis, ON_SPROCKET) for axis in AXES},
                "dx": cells.mean[place],
                "standard_error": cells.standard_error[place],
                "sd": cells.sd[place],
                "walk_time": time.mean[place],
                "bounces": bounces.mean[place],
                "at_rest": cells.count[place] / block.shape[-1],
            }


def distances(rows: Columns) -> str:
    """Δx and (standard deviation of a walk) of each cell, a row for each mass, in Markdown."""
    cells: dict[str, dict[str, str]] = {}
    for row in zip(*rows.values(), strict=True):
        at = dict(zip(rows, row, strict=True))
        text = "{dx:.3f} ({sd:.3f})".format(**at) if at["at_rest"] else "–"
        share = "" if at["at_rest"] in (0, 1) else f", {100 * at['at_rest']:.0f} %"
        chain = "{links:g} links, {frequency:g} Hz".format(**at)
        cells.setdefault(f"{1e3 * at['charm_mass']:g}", {})[chain] = text + share
    heads = ("added mass / g", *next(iter(cells.values())))
    return common.table(heads, ((mass, *texts.values()) for mass, texts in cells.items()))


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


def main(folder: Annotated[str | None, typer.Argument()] = None) -> None:
    """Reduce a folder and draw its distances beside loops if it is given; write the tables."""
    if folder is not None:
        result = warpchain.load(folder)
        blocks = result.blocks
        common.write_rows(FOLDER / RESULTS, reduced(blocks), result)
        figure = Figure(figsize=(9.2, 4.2), layout="constrained")
        left, right = figure.subfigures(1, 2, width_ratios=(1, 1.25))
        draw_distances(left.subplots(), blocks["ellipse"])
        draw_loops(right.subplots(len(DRAWN), 1))
        common.publish(FOLDER, {}, {"charm": figure})
    columns, tables = common.read_columns(FOLDER / RESULTS), {}
    for name in dict.fromkeys(columns["block"].tolist()):
        chosen = columns["block"] == name
        tables[name] = distances({key: values[chosen] for key, values in columns.items()})
    common.publish(FOLDER, tables)


if __name__ == "__main__":
    common.run_study(main)
