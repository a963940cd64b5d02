"""The film strip of a walk: the chain at several instants, drawn to scale, and close-ups of what happens.

Sizes on paper are in inches: constrained layout clips labels of axes with a fixed aspect. Texts are plain where they
can be: formulas would take a third of the time that this figure takes, and every walk has one.
"""

from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from warpchain.inputs.arrays import Array
from warpchain.pictures import chain
from warpchain.pictures.labels import math_symbol, setting
from warpchain.pictures.places import center_in_room, checked_joints, circle_radii, walk_box
from warpchain.pictures.style import DOTS, GROUND, INK, NARROW, InlineFigure, text_scale, tidy, wrapped
from warpchain.status import Status
from warpchain.walks.walk_numbers import WalkNumbers as Walk

_WIDTH: Final = 10.0
_HIGHEST: Final = 4.6
_DEEPEST: Final = 8.0
"""Width of the paper, greatest height of the side view, and of it and the view from above together."""
_LEFT, _RIGHT, _TOP, _BELOW, _FOOT = 0.9, 0.25, 0.6, 0.85, 0.1
"""Room for labels: beside the views, for legend and titles above them, below each row, at the foot."""
_CLOCK: Final = 0.2
"""Room for the times above the chains."""
_FLOOR: Final = 0.4
"""Height of the floor in the side view."""
_CLOSE_UP_LINKS, _CLOSE_UP_ASPECT = 9, 1.5
"""Width of a close-up [links], and its width over its height."""


def film_strip(walk: Walk, figure: Figure | None = None, width: float | None = None) -> Figure:
    """The chain along a walk with frames, drawn to scale, and close-ups of up to four moments.

    In the strip the centre of mass moves equally far from each instant to the next. Above each chain stands its time;
    outer links are darker than inner ones. The close-ups show the first touch of the floor, the first self-contact, the
    collapse and the end, if they happen. A sprocket that goes on after the release is a circle in the chain's colour;
    stretches of the floor with coefficients of their own are thick and have labels. A chain whose plane tilts is seen
    from above instead, to the same scale: z grows downwards. A figure to draw into is empty; by default a new one suits
    the walk. A `ValueError` says that the walk has no frames or broken ones.
    """
    joints = checked_joints(walk)
    tilts = walk.joints_lab is not None
    low, high = walk_box(walk, joints)
    moments = [] if tilts else _moments(walk)
    size = high - low
    broad = max(size[2], 0.15 * size[0]) if tilts else 0.0
    whole, text = _WIDTH if width is None else width, text_scale()
    is_narrow = whole < NARROW
    left, top, below, foot = _LEFT * text, (_TOP + 0.35 * is_narrow) * text, _BELOW * text, (_FOOT + 0.5) * text
    across = whole - left - _RIGHT * text
    scale = min(across / size[0], _HIGHEST / size[1], (_DEEPEST - _FLOOR) / (size[1] + broad))
    in_row = min(max(1, len(moments)), max(1, int(across / (1.7 * text))))
    close_up_width = min((across + 0.1) / in_row, _WIDTH / 3)
    rows, close_up_height = -(-len(moments) // in_row), (close_up_width - 0.1) / _CLOSE_UP_ASPECT
    pitch = close_up_height + 1.05 * text
    lower = scale * broad if tilts else close_up_height + (rows - 1) * pitch
    wide, high_up, depth = scale * size[0], scale * size[1] + (_FLOOR + _CLOCK) * text, _FLOOR * text / scale
    paper = np.array([whole, top + high_up + below + lower + foot])
    figure = InlineFigure(tuple(paper)) if figure is None else figure

    def panel(left: float, bottom: float, width: float, height: float) -> Axes:
        return figure.add_axes((left / paper[0], bottom / paper[1], width / paper[0], height / paper[1]))

    middle = left + (across - wide) / 2
    side = panel(middle, foot + lower + below, wide, high_up)
    side.set(
        xlim=(low[0], high[0]), ylim=(low[1] - depth, high[1] + _CLOCK * text / scale), xlabel="x / m", ylabel="y / m"
    )
    views = [(setting(walk, math_symbol), side, chain.SIDE)]
    chain.draw_ground(side, walk, walk.setup.floor.line(low[0], high[0]), low[1] - depth)
    _draw_distance(side, walk, low[1], 0.5 * depth)
    if tilts:
        z = (low[2] + high[2]) / 2 + np.array([0.5, -0.5]) * broad
        above = panel(middle, foot, wide, scale * broad)
        above.set(xlim=(low[0], high[0]), ylim=z, xlabel="x / m", ylabel="z / m", facecolor=GROUND)
        above.yaxis.set_major_locator(MaxNLocator(5))
        views.append(("from above", above, chain.ABOVE))
    # viridis without its palest end, which can hardly be seen on white paper
    colors = colormaps["viridis"](0.9 * walk.frame_time / (walk.frame_time[-1] or 1.0))[:, :3]
    center = center_in_room(walk)
    path = np.stack([np.interp(walk.frame_time, walk.time, row) for row in center.T], axis=1)
    radius = circle_radii(walk)
    shown = _instants(path, float(np.ptp(joints[0, :, 0])), (4, 6) if is_narrow else (6, 12))
    for title, axes, view in views:
        for frame in shown:
            chain.draw_chain(axes, joints[frame], radius, view, _link_colors(colors[frame]), edge=0.25)
            chain.draw_sprocket(axes, walk, walk.frame_time[frame], facecolor="none", edgecolor=colors[frame])
        chain.draw_release(axes, walk, view)
        axes.plot(*(view @ center.T)[:2], color=INK, linewidth=1.4, linestyle=DOTS, label="centre of mass", zorder=4)
        tidy(axes)
        axes.set_title(wrapped(title, figure, 0.8), fontsize="medium", loc="left")
    for number, (frame, title, spot) in enumerate(moments):
        row, column = divmod(number, in_row)
        place = left + column * close_up_width, foot + (rows - 1 - row) * pitch
        axes = panel(*place, close_up_width - 0.1, close_up_height)
        half = 0.5 * _CLOSE_UP_LINKS * walk.setup.parameters.link_length
        line = walk.setup.floor.line(spot[0] - half, spot[0] + half)
        half_height = half / _CLOSE_UP_ASPECT
        bottom = max(spot[1] - half_height, line[:, 1].min() - 0.2 * half_height)
        chain.draw_chain(axes, joints[frame], radius, chain.SIDE, _link_colors(colors[frame]), edge=0.6)
        chain.draw_sprocket(axes, walk, walk.frame_time[frame], facecolor="none", edgecolor=colors[frame])
        chain.draw_ground(axes, walk, line, min(bottom, line[:, 1].min()))
        axes.set(xlim=line[[0, -1], 0], ylim=(bottom, bottom + 2 * half_height), yticks=[], xlabel="x / m")
        ticks = MaxNLocator(2 if is_narrow else 4).tick_values(*line[[0, -1], 0])
        axes.set_xticks(ticks[np.abs(ticks - spot[0]) < 0.8 * half])
        axes.tick_params(labelsize=10.0 * text)
        title = f"{title},{chr(10) if is_narrow else ' '}{walk.frame_time[frame]:.3f} s"
        axes.set_title(title, fontsize="small" if is_narrow else "medium", loc="left")
    _write_times(side, walk.frame_time[shown], joints[shown, :, :2], colors[shown], 1.2 * radius.max(), text / scale)
    style: dict[str, Any] = {"frameon": False, "ncols": 2, "borderaxespad": 0.0, "fontsize": "small"}
    place = (1 - _RIGHT * text / paper[0], 1 - 0.08 / paper[1])
    figure.legend(*side.get_legend_handles_labels(), loc="upper right", bbox_to_anchor=place, **style)
    return figure


def _link_colors(color: Array) -> tuple[Array, Array, Array]:
    """Colours of inner links, of outer links and of edges, shape (3,) each."""
    return 1 - 0.45 * (1 - color), color, 0.6 * color


def _instants(path: Array, width: float, bounds: tuple[int, int]) -> list[int]:
    """Frames between which the centre of mass moves equally far along its path, the first and last among them.

    Within some bounds they are as many as stay legible with chains of this width [m] in the first frame.
    """
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    marks = np.linspace(0.0, way[-1], int(np.clip(1 + way[-1] / (0.6 * width), *bounds)))[1:-1]
    return sorted({0, *(int(np.argmin(np.abs(way - mark))) for mark in marks), len(way) - 1})


def _write_times(axes: Axes, times: Array, joints: Array, colors: Array, gap: float, inch: float) -> None:
    """Write times [s] above the highest joints of k chains, (k, n, 2), by a gap [m], higher where texts would touch."""
    taken = np.array([text.get_position() for text in axes.texts]).reshape(-1, 2)
    for moment, its_joints, color in zip(times, joints, colors, strict=True):
        place = its_joints[np.argmax(its_joints[:, 1])] + (0.0, gap)
        room = np.array([0.07 * len(f"{moment:.2f} s") + 0.06, 0.17]) * inch  # of the text, and a gap
        place[0] = np.clip(place[0], *(np.array(axes.get_xlim()) + room[0] * np.array([0.5, -0.5])))
        while np.any(np.all(np.abs(taken - place) < room, axis=1)):
            place[1] += 0.02 * inch
        taken = np.append(taken, [place], axis=0)
        halo = [withStroke(linewidth=2.5, foreground="white")]
        style: dict[str, Any] = {"color": 0.7 * color, "fontsize": "small", "path_effects": halo}
        axes.text(place[0], place[1], f"{moment:.2f} s", ha="center", va="bottom", zorder=6, **style)


def _draw_distance(axes: Axes, walk: Walk, low: float, depth: float) -> None:
    """The distance walked, if there is one, so far [m] below a slope, or below the lowest place of another floor."""
    if not np.isfinite(walk.dx):
        return
    slope = walk.setup.scene.slope
    x = walk.center[-1, 0] - np.array([walk.dx * np.cos(np.radians(slope)), 0.0])
    floor = walk.setup.floor.heights(x)
    y = (floor if slope != 0 else low) - depth + 0 * x
    arrow = {"arrowstyle": "<|-|>", "color": INK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops=arrow, zorder=4)
    axes.plot([x, x], [floor, y - 0.6 * depth], color=INK, linewidth=0.8, zorder=4)
    box = {"facecolor": GROUND, "edgecolor": "none", "pad": 2.0}
    text = f"Δx = {'x / cos α = ' * (slope != 0)}{walk.dx:.3f} m"
    axes.text(x.mean(), y.mean(), text, rotation=-slope, ha="center", va="center", bbox=box, zorder=6)


def _moments(walk: Walk) -> list[tuple[int, str, Array]]:
    """At most four frames in order of time, no frame twice, with what happens there and where, (2,)."""
    joints, radius = walk.frame_joints, circle_radii(walk).max()
    above = walk.setup.floor.distances(joints.reshape(-1, 2)).reshape(joints.shape[:-1])
    last = len(joints) - 1
    found: dict[int, tuple[str, Array]] = {}
    touching = np.flatnonzero(above.min(axis=1) < 1.02 * radius)
    if touching.size:
        frame = int(touching[0])
        found[frame] = "first touch", joints[frame, np.argmin(above[frame])]
    for title, moment, spot_of in (
        ("first self-contact", walk.self_contact_at, _meeting),
        ("collapse", walk.collapsed_at, _sharpest_bend),
    ):
        if not np.isnan(moment):
            frame = min(int(np.searchsorted(walk.frame_time, moment)), last)
            found[frame] = title, spot_of(joints[frame])
    middle = np.median(joints[last, :, 0])
    spot = np.array([middle, walk.setup.floor.heights(middle)])
    half = _CLOSE_UP_LINKS * walk.setup.parameters.link_length / 2
    if (np.abs(joints[last] - spot) < half).all(axis=1).sum() < _CLOSE_UP_LINKS / 2:  # it is in the air, or in a pit
        spot = joints[last, np.argmin(above[last])]
    found[last] = "rest" if walk.status is Status.AT_REST else "end", spot
    return [(frame, *found[frame]) for frame in sorted(found)]


def _meeting(joints: Array) -> Array:
    """Where two joints at least 3 links apart are closest, (2,)."""
    count = len(joints)
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    distances = np.linalg.norm(joints[:, None] - joints, axis=-1)
    distances[np.minimum(apart, count - apart) < 3] = np.inf
    return np.asarray(joints[[*np.unravel_index(np.argmin(distances), distances.shape)]].mean(axis=0))


def _sharpest_bend(joints: Array) -> Array:
    """The joint at which the chain turns most over three links, (2,)."""
    step = joints - np.roll(joints, 1, axis=0)
    direction = np.arctan2(step[:, 1], step[:, 0])
    turn = np.angle(np.exp(1j * (np.roll(direction, -2) - np.roll(direction, 1))))
    return np.asarray(joints[np.argmax(np.abs(turn))])
