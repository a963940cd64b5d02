"""Figures of walks: the paper's Figure 5, and a film strip of the chain.

Figures are made without pyplot: nothing is global, no display is needed, the caller owns what is returned.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

if TYPE_CHECKING:
    from warpchain.results import WalkResult

Array = NDArray[np.float64]

WIDTH: Final = 10.0
"""Width of a film strip [inch]."""

LINE_COLORS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that people with any kind of colour vision can tell apart (Okabe and Ito, 2008)."""

_INK: Final = "#222222"
_FLOOR: Final = "#D9D9D9"


def figure5(
    walks: "Sequence[WalkResult]", *, labels: Sequence[str] | None = None, figure: Figure | None = None
) -> Figure:
    """Height and horizontal speed of the centre of mass against time since the release, as in Figure 5.

    Args:
        walks: one line each in both panels.
        labels: a legend entry for each walk; by default links and frequency, if the walks differ in them.
        figure: an empty figure to draw into; by default a new one.

    Raises:
        ValueError: no walk is given, or not as many labels as walks.
    """
    if not walks:
        raise ValueError("walks: empty; give at least one walk")
    if labels is not None and len(labels) != len(walks):
        raise ValueError(f"labels: {len(labels)} for {len(walks)} walks; give one for each walk")
    figure = Figure(figsize=(6.4, 5.0), layout="constrained") if figure is None else figure
    height, speed = figure.subplots(2, 1, sharex=True)
    settings = [f"n = {walk.setup.scene.links}, ν = {walk.setup.scene.frequency:g} Hz" for walk in walks]
    groups = list(dict.fromkeys(labels or settings))
    seen = set()
    for index, (walk, name) in enumerate(zip(walks, labels or settings, strict=True)):
        order = index if len(groups) == 1 else groups.index(name)
        style = {"color": LINE_COLORS[order % len(LINE_COLORS)], "linewidth": 1.4}
        height.plot(walk.time, walk.center[:, 1], label="_" if name in seen else name, **style)
        speed.plot(walk.time, walk.center_velocity[:, 0], **style)
        seen.add(name)
    height.set_ylabel("height $y^\\mathrm{cm}$ / m")
    speed.set_ylabel("speed $v_x^\\mathrm{cm}$ / (m/s)")
    speed.set_xlabel("time since release $t$ / s")
    height.set_ylim(bottom=0.0)
    speed.set_xlim(0.0, max(float(walk.time[-1]) for walk in walks))
    for axes in (height, speed):
        _tidy(axes)
        axes.grid(color="#E6E6E6", linewidth=0.6)
    if len(groups) > 1 or labels is not None:
        height.legend(frameon=False)
    else:
        height.set_title(groups[0], fontsize="medium", loc="left")
    return figure


def film_strip(walk: "WalkResult", *, count: int = 12, figure: Figure | None = None) -> Figure:
    """The chain along its walk, drawn to scale, and four close-ups of it.

    The strip shows `count` instants, from the release to the end, between which the centre of mass moves
    equally far; colour is time. The close-ups are the lower end at the release, the first touch of the floor, the
    collapse (the first instant at which the chain is as high as three quarters of its height at release, for
    good) and the end.

    Args:
        walk: a walk with frames.
        count: how many instants the strip shows, at least 2.
        figure: an empty figure to draw into; by default a new one of suitable size.

    Raises:
        ValueError: the walk has no frames, or fewer than 2 instants are asked for.
    """
    if len(walk.frame_time) == 0:
        raise ValueError("walk: no frames; run the walk with frames recorded")
    if count < 2:
        raise ValueError(f"count: {count}; give 2 or more")
    radius = walk.setup.parameters.circle_radius
    left, right, top = _extent(walk, radius)
    tallest = 4.6
    strip_height = min((WIDTH - 1.2) * (top + 0.05 * top) / (right - left), tallest)
    close_height = (WIDTH - 1.0) / 4 / CLOSE_UP_ASPECT
    if figure is None:
        figure = Figure(figsize=(WIDTH, strip_height + close_height + 1.25), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.03, h_pad=0.05, wspace=0.02, hspace=0.03)
    grid = figure.add_gridspec(2, 4, height_ratios=[strip_height + 0.6, close_height + 0.3])
    strip = figure.add_subplot(grid[0, :])
    colors = _time_colors()
    span = Normalize(float(walk.frame_time[0]), float(walk.frame_time[-1]))
    _draw_ground(strip, left, right, -0.03 * top)
    if walk.sprocket_center is not None:
        strip.add_patch(
            Circle(tuple(walk.sprocket_center), walk.sprocket_radius, facecolor="none", edgecolor="#777777",
                   linewidth=1.0, linestyle=(0, (4, 3)), zorder=1.5))
        strip.plot(*walk.sprocket_center, marker="+", color="#777777", markersize=6, zorder=1.5)
    for frame in _instants(walk, count):
        _draw_chain(strip, walk.frame_joints[frame], radius, colors(span(walk.frame_time[frame])), 0.25)
    strip.plot(walk.center[:, 0], walk.center[:, 1], color=_INK, linewidth=1.3, linestyle=(0, (1, 1.6)), zorder=4, label="centre of mass")
    strip.set_xlim(left, right)
    strip.set_ylim(-0.03 * top, 1.05 * top)
    strip.set_aspect("equal")
    _tidy(strip)
    bar = figure.colorbar(ScalarMappable(span, colors), ax=strip, pad=0.01, fraction=0.03, aspect=25)
    bar.set_label("time since release / s")
    bar.outline.set_visible(False)
    for letter, (column, (title, frame, spot)) in zip("abcd", enumerate(_close_ups(walk)), strict=True):
        axes = figure.add_subplot(grid[1, column])
        _draw_chain(axes, walk.frame_joints[frame], radius, colors(span(walk.frame_time[frame])), 0.6)
        w = CLOSE_UP_LINKS * walk.setup.parameters.link_length
        h = w / CLOSE_UP_ASPECT
        x0 = spot[0] - w / 2
        y0 = max(spot[1] - h / 2, -0.08 * h)
        _draw_ground(axes, x0, x0 + w, y0)
        axes.set_xlim(x0, x0 + w)
        axes.set_ylim(y0, y0 + h)
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_title(f"({letter}) {title}, {walk.frame_time[frame]:.3f} s", fontsize="medium", loc="left")
        strip.add_patch(Rectangle((x0, y0), w, h, facecolor="none", edgecolor="#888888", linewidth=0.7, zorder=5))
        strip.text(x0, y0 + h, letter, va="bottom")
    return figure

CLOSE_UP_LINKS = 9
CLOSE_UP_ASPECT = 1.5

def _time_colors():
    return ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)), name="time")

def _extent(walk, radius):
    j = walk.frame_joints
    lo = j[..., 0].min() - 3 * radius
    hi = j[..., 0].max() + 3 * radius
    return lo, hi, j[..., 1].max() + radius

def _instants(walk, count):
    x = np.stack([np.interp(walk.frame_time, walk.time, walk.center[:, k]) for k in range(2)], 1)
    path = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(x, axis=0).T))])
    marks = np.linspace(0, path[-1], count)
    idx = np.unique(np.searchsorted(path, marks * (1 - 1e-12)))
    idx[-1] = len(walk.frame_time) - 1
    return idx

def _close_ups(walk):
    j = walk.frame_joints
    height = j[..., 1].max(1)
    t = walk.frame_time
    touch = int(np.argmax(j[..., 1].min(1) < walk.setup.parameters.circle_radius * 1.02))
    high = np.nonzero(height > 0.75 * height[0])[0][-1]
    out = []
    for title, f in (("release", 0), ("first touch", touch), ("collapse", int(high)), ("rest", len(t) - 1)):
        if f in (0, touch):
            spot = j[f, np.argmin(j[f, :, 1])]
        elif title == "rest":
            spot = np.array([np.median(j[f, :, 0]), 0])
        else:
            e = j[f] - np.roll(j[f], 1, 0)
            th = np.arctan2(e[:, 1], e[:, 0])
            bend = (np.roll(th, -2) - np.roll(th, 1) + np.pi) % (2 * np.pi) - np.pi
            spot = j[f, np.argmax(abs(bend))]
        out.append((title, f, spot))
    return out

def _draw_ground(axes, left, right, bottom):
    axes.add_patch(Rectangle((left, bottom), right - left, -bottom, facecolor=_FLOOR, edgecolor="none", zorder=0.5))
    axes.plot([left, right], [0, 0], color=_INK, linewidth=1, zorder=1)

def _draw_chain(axes, joints, radius, color, edge):
    shapes = link_outlines(joints, radius)
    rgb = np.asarray(color[:3])
    light = 1 - 0.45 * (1 - rgb)
    dark = 0.6 * rgb
    axes.add_collection(PolyCollection(shapes[0::2], facecolors=[light], edgecolors=[dark], linewidths=edge, zorder=2))
    axes.add_collection(PolyCollection(shapes[1::2], facecolors=[rgb], edgecolors=[dark], linewidths=edge, zorder=2.1))
    

def link_outlines(joints, radius):
    left = np.roll(joints, 1, axis=0)
    middle, half = (joints + left) / 2, (joints - left) / 2
    along = half / np.hypot(half[:, :1], half[:, 1:])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 9)
    ramp = np.linspace(1, -1, 7)[1:-1]
    # corner: position along in half lengths, offset along & across in radii
    cap = np.stack([np.ones(9), np.cos(angle), np.sin(angle)], 1)
    waist = np.stack([ramp, np.zeros(5), 0.62 + 0.38 * ramp**2], 1)
    corners = np.concatenate([cap, waist, -cap, -waist])
    return (middle[:, None] + corners[None, :, :1] * half[:, None] + radius * (corners[None, :, 1:2] * along[:, None] + corners[None, :, 2:] * across[:, None]))

def _tidy(axes):
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(direction="out", color="#888888")
