"""Draws the maps and the master curves of the phase diagram."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator

from studies.common import GROUND, INK, RED, Array, Columns, tidy
from studies.phase_diagram import laws
from studies.phase_diagram.cells import WAYS

COLORS = dict(zip(WAYS, ("#999999", "#CC79A7", "#000000", "#0072B2", "#56B4E9"), strict=True))  # Of Okabe and Ito


class Grid:
    """Cells as tables of frequency × links; there may be gaps."""

    def __init__(self, links: Array, frequency: Array) -> None:
        """Find the grid of cells with these links and frequencies [Hz]."""
        self._links, self._column = np.unique(links, return_inverse=True)
        self._frequency, self._row = np.unique(frequency, return_inverse=True)

    def table(self, values: Array) -> Array:
        """Values of the cells as a table (f, n, …); NaN in gaps."""
        table = np.full((len(self._frequency), len(self._links), *values.shape[1:]), np.nan)
        table[self._row, self._column] = values
        return table

    def map(self, axes: Axes, values: Array, title: str, **colors: Any) -> Any:
        """Draw values of the cells, or their colours; returns the image."""
        image = axes.imshow(self.table(values), origin="lower", aspect="auto", interpolation="nearest", **colors)
        for axis, numbers, most in ((axes.xaxis, self._links, 8), (axes.yaxis, self._frequency, 20)):
            every = max(1, -(-len(numbers) // most))
            axis.set_ticks(range(len(numbers))[::every], [f"{number:g}" for number in numbers[::every]])
        axes.tick_params(axis="y", labelsize="small")
        axes.set_facecolor(GROUND)
        tidy(axes, title, xlabel="links", ylabel="frequency / Hz")
        axes.spines[:].set_visible(False)
        return image


def draw_maps(cells: Columns) -> Figure:
    """Mean of Δx, its spread, bounces, and ways of ending with their shares; dots: share of walks that failed."""
    grid = Grid(cells["links"], cells["frequency"])
    failed = np.nan_to_num(grid.table(1 - cells["at_rest"] / cells["walks"]))
    figure = Figure(figsize=(11, 8.6), layout="constrained")
    panels = figure.subplots(2, 2).flat
    spread = 100 * cells["dx_sd"] / cells["dx_mean"]
    for axes, values, title, cmap in (
        (panels[0], cells["dx_mean"], "mean Δx / m", "viridis"),
        (panels[1], spread, "standard deviation of Δx over its mean / %", "magma"),
        (panels[2], cells["bounces_mean"], "mean number of bounces", "viridis"),
    ):
        bar = figure.colorbar(grid.map(axes, values, title, norm=LogNorm(), cmap=cmap), ax=axes, pad=0.02)
        bar.ax.yaxis.set_major_formatter("{x:g}")
        bar.ax.yaxis.set_minor_locator(LogLocator(subs=(2, 3, 5)))
        bar.ax.yaxis.set_minor_formatter("{x:g}")
        draw_failed(axes, failed)
    draw_endings(panels[3], grid, cells)
    draw_failed(panels[3], failed, color="white", rim=INK)  # red is one of its colours
    return figure


def draw_failed(axes: Axes, share: Array, color: str = RED, rim: str = "white") -> None:
    """Mark cells of a map in which walks failed by a dot, whose area is proportional to the share that failed."""
    rows, columns = np.nonzero(share > 0)
    sizes = 0.75 * np.sqrt(share[rows, columns])
    places = {"offsets": np.stack([columns, rows], axis=1), "offset_transform": axes.transData, "units": "xy"}
    style = {"facecolor": color, "edgecolor": rim, "linewidth": 0.5}
    axes.add_collection(EllipseCollection(sizes, sizes, np.zeros(len(sizes)), **places, **style), autolim=False)


def draw_endings(axes: Axes, grid: Grid, cells: Columns) -> None:
    """The most frequent ending of each cell; the paler, the smaller its share. The legend is below."""
    counts = np.stack([cells[way.label] for way in WAYS], axis=1)
    total, most = counts.sum(axis=1), counts.argmax(axis=1)
    share = counts.max(axis=1) / np.maximum(total, 1)
    colors = 1 - share[:, None] * (1 - np.array([to_rgb(COLORS[WAYS[index]]) for index in most]))
    grid.map(axes, np.column_stack([colors, total > 0]), "how the loop was lost; paler: a smaller share")
    handles = [Patch(color=COLORS[WAYS[k]], label=WAYS[k].meaning) for k in np.unique(most[total > 0])]
    axes.legend(handles=handles, fontsize="x-small", loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)


def draw_laws(points: laws.Points) -> Figure:
    """Laws of Δx/(nℓ): cells coloured by links, and master curves; where the last one fails."""
    figure = Figure(figsize=(11, 8.2), layout="constrained")
    grid, y = list(figure.subplots(2, 2).flat), points.lengths
    variables = {
        "ν²ℓ/g": points.frequency**2 * laws.LINK_LENGTH / laws.GRAVITY,
        "v²/(g nℓ)": points.speed**2 / (laws.GRAVITY * points.length),
        "v/(nℓ), turns of the loop / s⁻¹": points.turns,
    }
    for axes, (name, x) in zip(grid, variables.items(), strict=False):
        image = axes.scatter(x, y, c=points.links, s=12, cmap="viridis")
        fine, curve = np.geomspace(x.min(), x.max(), 200), laws.master_curve(x, y)[0]
        axes.plot(fine, np.exp(curve(fine)), color=INK, linewidth=1)
        title = f"residual {laws.rms_residual(x, y):.1f} %"
        tidy(axes, title, grid="both", xscale="log", yscale="log", xlabel=name, ylabel="Δx/(nℓ)")
    figure.colorbar(image, ax=grid[:2], label="links", pad=0.02)
    left = 100 * np.expm1(np.log(y) - curve(x))
    limit = float(np.quantile(np.abs(left), 0.98))
    title = "Δx over its curve in v/(nℓ), less 1 / %"
    used = Grid(points.links, points.frequency)
    shades = used.map(grid[3], left, title, cmap="RdBu_r", vmin=-limit, vmax=limit)
    figure.colorbar(shades, ax=grid[3], pad=0.02, extend="both")
    return figure
