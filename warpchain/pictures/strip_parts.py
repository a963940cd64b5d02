"""What all film strips have: colours of time, the instants that are shown, floor, sprocket, path and distance."""

from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from warpchain.pictures.style import DASHES, FAINT, GROUND, INK
from warpchain.pictures.walk_shape import Walk

Array = NDArray[np.float64]

DOTS: Final[Any] = (0, (1, 1.5))
"""A dotted line, as matplotlib takes it."""


def time_colors(walk: Walk) -> ScalarMappable:
    """Colours of the times of the frames: viridis without its palest end, which can hardly be seen on white paper."""
    colors = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)), name="time")
    return ScalarMappable(Normalize(float(walk.frame_time[0]), float(walk.frame_time[-1])), colors)


def link_colors(color_of: ScalarMappable, moment: float) -> tuple[Array, Array, Array]:
    """Colours of inner links, of outer links and of edges at a time [s], shape (3,) each."""
    color = color_of.to_rgba(np.array([moment]))[0, :3]
    return 1 - 0.45 * (1 - color), color, 0.6 * color


def center_at(walk: Walk, times: Array) -> Array:
    """Centre of mass x, y [m] at t times [s], shape (t, 2)."""
    return np.stack([np.interp(times, walk.time, walk.center[:, axis]) for axis in (0, 1)], axis=1)


def instants(path: Array, width: float, count: int | None) -> list[int]:
    """Frames between which the centre of mass moves equally far, the first and the last among them.

    Args:
        path: centre of mass in each frame [m], shape (f, d).
        width: width of the chain in the first frame [m].
        count: number of frames; None: 6 to 12, as many as stay legible.
    """
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    if count is None:
        count = int(np.clip(1 + way[-1] / (0.6 * width), 6, 12))
    marks = np.linspace(0.0, way[-1], count)[1:-1]
    return sorted({0, *(int(np.argmin(np.abs(way - mark))) for mark in marks), len(way) - 1})


def draw_ground(axes: Axes, left: float, right: float, bottom: float) -> None:
    """The floor at height 0, from the side, down to `bottom` [m]."""
    axes.add_patch(Rectangle((left, bottom), right - left, -bottom, facecolor=GROUND, zorder=3))
    axes.plot([left, right], [0.0, 0.0], color=INK, linewidth=1.0, zorder=3)


def draw_way(axes: Axes, walk: Walk) -> None:
    """The sprocket and the path of the centre of mass, from the side."""
    if walk.sprocket_center is not None:
        x, y = walk.sprocket_center
        angle = np.linspace(0.0, 2 * np.pi, 100)
        style: dict[str, Any] = {"color": FAINT, "linewidth": 1.0, "linestyle": DASHES, "zorder": 1.5}
        circle = walk.sprocket_radius * np.array([np.cos(angle), np.sin(angle)])
        axes.plot(x + circle[0], y + circle[1], label="sprocket until release", **style)
        axes.plot([x, x], [0.0, y], **style)
    axes.plot(*walk.center.T, color=INK, linewidth=1.4, linestyle=DOTS, label="centre of mass", zorder=4)


def draw_distance(axes: Axes, walk: Walk, depth: float) -> None:
    """The distance walked, if there is one, at height `depth` [m]."""
    if not np.isfinite(walk.dx):
        return
    end = float(walk.center[-1, 0])
    start = end - walk.dx
    arrow = {"arrowstyle": "<|-|>", "color": INK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (end, depth), (start, depth), arrowprops=arrow, zorder=4)
    for x in (start, end):
        axes.plot([x, x], [0.0, 1.6 * depth], color=INK, linewidth=0.8, zorder=4)
    box = {"facecolor": GROUND, "edgecolor": "none", "pad": 2.0}
    text = f"$\\Delta x$ = {walk.dx:.3f} m"
    axes.text((start + end) / 2, depth, text, ha="center", va="center", bbox=box, zorder=4)
