"""Draws the maps and the master curves of the phase diagram."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator
from numpy.typing import NDArray

from studies.common import FAINT, GROUND, INK, RED, save_figure, tidy
from studies.phase_diagram import laws
from studies.phase_diagram.endings import Ending

Array = NDArray[Any]

COLORS: Final = {
    Ending.KEPT: "#999999",
    Ending.IN_FLIGHT: "#CC79A7",
    Ending.FIRST: "#000000",
    Ending.SECOND: "#0072B2",
    Ending.LATER: "#56B4E9",
}
"""Of the ways of ending; those of Okabe and Ito."""


class Grid:
    """Cells as tables of frequency × links.

    Attributes:
        links: in order, shape (n,).
        frequency: in order [Hz], shape (f,).
    """

    def __init__(self, cells: Mapping[str, Array]) -> None:
        """Find the grid of the cells; it may have gaps."""
        self._cells = cells
        self.links, self._column = np.unique(cells["links"], return_inverse=True)
        self.frequency, self._row = np.unique(cells["frequency"], return_inverse=True)

    def table(self, values: Array) -> Array:
        """Values of the cells as a table (f, n); NaN in gaps."""
        table = np.full((len(self.frequency), len(self.links)), np.nan)
        table[self._row, self._column] = values
        return table

    def map(self, axes: Axes, values: Array, title: str, **colors: Any) -> Any:
        """Draw values of the cells; returns the image."""
        image = axes.imshow(self.table(values), origin="lower", aspect="auto", interpolation="nearest", **colors)
        for axis, numbers, most in ((axes.xaxis, self.links, 8), (axes.yaxis, self.frequency, 20)):
            every = max(1, -(-len(numbers) // most))
            axis.set_ticks(range(len(numbers))[::every], [f"{number:g}" for number in numbers[::every]])
        axes.tick_params(axis="y", labelsize="small")
        axes.set_facecolor(GROUND)
        axes.spines[:].set_visible(False)
        axes.tick_params(color=FAINT)
        axes.set_title(title, loc="left", color=INK, fontsize="medium")
        axes.set_xlabel("links")
        axes.set_ylabel("frequency / Hz")
        return image


def draw_maps(cells: Mapping[str, Array], path: Path) -> None:
    """Mean of Δx, its spread, bounces, and ways of ending with their shares; dots: share of walks that failed."""
    grid = Grid(cells)
    walks = np.maximum(cells["walks"], 1)
    failed = np.where(cells["walks"] > 0, 1 - cells["at_rest"] / walks, 0.0)
    figure = Figure(figsize=(11, 8.6), layout="constrained")
    (upper_left, upper_right), (lower_left, lower_right) = figure.subplots(2, 2)
    shown: list[tuple[Axes, Array, str, dict[str, Any]]] = [
        (upper_left, cells["dx_mean"], "mean Δx / m", {"norm": LogNorm(), "cmap": "viridis"}),
        (
            upper_right,
            100 * cells["dx_sd"] / cells["dx_mean"],
            "standard deviation of Δx over its mean / %",
            {"norm": LogNorm(), "cmap": "magma"},
        ),
        (lower_left, cells["bounces_mean"], "mean number of bounces", {"norm": LogNorm(), "cmap": "viridis"}),
    ]
    for axes, values, title, colors in shown:
        if np.isfinite(values).any():
            bar = figure.colorbar(grid.map(axes, values, title, **colors), ax=axes, pad=0.02)
            bar.ax.yaxis.set_major_formatter("{x:g}")
            bar.ax.yaxis.set_minor_locator(LogLocator(subs=(2, 3, 5)))
            bar.ax.yaxis.set_minor_formatter("{x:g}")
        else:
            grid.map(axes, values, f"{title}: too few walks")
        draw_failed(axes, np.nan_to_num(grid.table(failed)))
    draw_endings(lower_right, grid, cells)
    draw_failed(lower_right, np.nan_to_num(grid.table(failed)), color="white", rim=INK)  # red is one of its colours
    save_figure(figure, path)


def draw_failed(axes: Axes, share: Array, color: str = RED, rim: str = "white") -> None:
    """Mark cells of a map in which walks failed by a dot, whose area is proportional to the share that failed."""
    rows, columns = np.nonzero(share > 0)
    sizes = 0.75 * np.sqrt(share[rows, columns])
    dots = EllipseCollection(
        sizes,
        sizes,
        np.zeros(len(sizes)),
        units="xy",
        offsets=np.stack([columns, rows], axis=1),
        offset_transform=axes.transData,
        facecolor=color,
        edgecolor=rim,
        linewidth=0.5,
    )
    axes.add_collection(dots, autolim=False)


def draw_endings(axes: Axes, grid: Grid, cells: Mapping[str, Array]) -> None:
    """The most frequent ending of each cell; the paler, the smaller its share. The legend is below."""
    ways = list(COLORS)
    counts = np.stack([cells[way.label] for way in ways], axis=1)
    total = counts.sum(axis=1)
    most = counts.argmax(axis=1)
    share = counts.max(axis=1) / np.maximum(total, 1)
    colors = 1 - share[:, None] * (1 - np.array([to_rgb(COLORS[ways[index]]) for index in most]))
    colors[total == 0] = np.nan
    grid.map(axes, np.full(len(total), np.nan), "how the loop was lost; paler: a smaller share", vmin=0)
    image = np.ma.masked_invalid(np.stack([grid.table(channel) for channel in colors.T], axis=2))
    opaque = (~np.isnan(image.filled(np.nan)).any(axis=2)).astype(float)
    axes.imshow(np.dstack([image.filled(0.0), opaque]), origin="lower", aspect="auto", interpolation="nearest")
    seen = [way for number, way in enumerate(ways) if np.any((most == number) & (total > 0))]
    handles = [Patch(color=COLORS[way], label=way.meaning) for way in seen]
    if handles:
        axes.legend(handles=handles, fontsize="x-small", loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)


def draw_laws(cells: Mapping[str, Array], path: Path) -> None:
    """Laws of Δx/(nℓ): cells coloured by links, and master curves; where the last one fails."""
    points = laws.points_of(cells)
    if len(points.links) < laws.FEWEST:
        print(f"{path.name}: not drawn, {len(points.links)} cells are too few")
        return
    figure = Figure(figsize=(11, 8.2), layout="constrained")
    grid, y = list(figure.subplots(2, 2).flat), points.distance / points.length
    variables = {
        "ν²ℓ/g": points.frequency**2 * laws.LINK_LENGTH / laws.GRAVITY,
        "v²/(g nℓ)": points.speed**2 / (laws.GRAVITY * points.length),
        "v/(nℓ), turns of the loop / s⁻¹": points.speed / points.length,
    }
    for axes, (name, x) in zip(grid, variables.items(), strict=False):
        image = draw_law(axes, points.links, x, y, laws.master_curve(x, y))
        axes.set(xlabel=name, ylabel="Δx/(nℓ)")
        axes.set_title(f"residual {laws.rms_residual(x, y):.1f} %", loc="left", color=INK, fontsize="medium")
    figure.colorbar(image, ax=grid[:2], label="links", pad=0.02)
    left = 100 * np.expm1(laws.residuals(x, y))
    used = Grid({"links": points.links, "frequency": points.frequency})
    limit = float(np.quantile(np.abs(left), 0.98))
    title = "Δx over its curve in v/(nℓ), less 1 / %"
    shades = used.map(grid[3], left, title, cmap="RdBu_r", vmin=-limit, vmax=limit)
    figure.colorbar(shades, ax=grid[3], pad=0.02, extend="both")
    save_figure(figure, path)


def draw_law(axes: Axes, links: Array, x: Array, y: Array, curve: Callable[[Array], Array]) -> Any:
    """Cells and master curve on logarithmic axes; returns the coloured points."""
    image = axes.scatter(x, y, c=links, s=12, cmap="viridis")
    fine = np.geomspace(x.min(), x.max(), 200)
    axes.plot(fine, np.exp(curve(fine)), color=INK, linewidth=1)
    axes.set_xscale("log")
    axes.set_yscale("log")
    tidy(axes, grid="both")
    return image
