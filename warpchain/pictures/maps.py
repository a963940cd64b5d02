"""Maps: a table of numbers as coloured cells, with the walks that are not part of them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from warpchain.pictures.labels import COUNTS
from warpchain.pictures.style import FAINT, GROUND, INK, RED, label_room

Array = NDArray[Any]

_MOST_TICKS: Final = 16
"""Greatest number of labelled rows or columns."""

_LARGEST_DOT: Final = 0.75
"""Diameter of the dot of a cell whose walks all failed, relative to the cell."""


def draw_map(axes: Axes, table: Array, columns: Sequence[str], rows: Sequence[str], **colors: Any) -> AxesImage:
    """Draw a table from the bottom row up; cells that are NaN stay empty.

    Args:
        axes: where to draw.
        table: values, shape (rows, columns).
        columns: label of each column.
        rows: label of each row.
        colors: `cmap`, `vmin` and `vmax`, as of matplotlib's `imshow`.
    """
    image = axes.imshow(table, origin="lower", aspect="auto", **colors)
    for axis, texts, room in zip((axes.xaxis, axes.yaxis), (columns, rows), label_room(axes, columns), strict=True):
        every = slice(None, None, math.ceil(len(texts) / max(1, min(_MOST_TICKS, int(room)))))
        axis.set_ticks(range(len(texts))[every], list(texts[every]))
    axes.set_facecolor(GROUND)
    axes.spines[:].set_visible(False)
    axes.tick_params(color=FAINT)
    return image


def write_values(axes: Axes, image: AxesImage, table: Array, cells: Mapping[str, Array]) -> None:
    """Write into each cell of a map its value, and how many of its walks failed or have not been run.

    Args:
        axes: where the map is.
        image: the map.
        table: its values; a dash stands for NaN, unless the cell has no walks at all.
        cells: numbers of walks: name of `COUNTS` → table.
    """
    for (row, column), value in np.ndenumerate(table):
        rested, absent, lost, waiting = (cells[name][row, column] for name in COUNTS)
        if not (rested or absent or lost or waiting):
            continue
        text = f"{value:.3g}" if np.isfinite(value) else "–"
        parts = [f"{lost:.0f} failed"] * bool(lost) + [f"{waiting:.0f} to run"] * bool(waiting)
        red, green, blue, _ = image.to_rgba(value) if np.isfinite(value) else (1.0, 1.0, 1.0, 1.0)
        color = INK if 0.3 * red + 0.59 * green + 0.11 * blue > 0.5 else "white"
        axes.text(column, row, text, ha="center", va="bottom" if parts else "center", color=color, fontsize="small")
        if parts:
            axes.text(column, row, "\n".join(parts), ha="center", va="top", color=color, fontsize="xx-small")


def draw_failed(axes: Axes, share: Array) -> None:
    """Mark cells of a map in which walks failed by a dot, whose area is proportional to the share that failed."""
    rows, columns = np.nonzero(share > 0)
    sizes = _LARGEST_DOT * np.sqrt(share[rows, columns])
    places: dict[str, Any] = {"offsets": np.stack([columns, rows], axis=1), "offset_transform": axes.transData}
    style: dict[str, Any] = {"facecolor": RED, "edgecolor": "white", "linewidth": 0.5}
    dots = EllipseCollection(sizes, sizes, np.zeros(len(sizes)), units="xy", **places, **style)
    axes.add_collection(dots, autolim=False)
