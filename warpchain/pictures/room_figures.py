"""Figures of a walk whose plane tilts: film strips from three sides, and tilt, yaw and drift against time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.pictures.inline import InlineFigure
from warpchain.pictures.room import (
    ABOVE,
    FRONT,
    SIDE,
    Solids,
    View,
    center_in_room,
    check_room,
    link_solids,
    room_box,
    sprocket_circle,
)
from warpchain.pictures.strip_parts import (
    DOTS,
    draw_distance,
    draw_ground,
    draw_way,
    instants,
    link_colors,
    time_colors,
)
from warpchain.pictures.style import BLUE, DASHES, FAINT, GREEN, GROUND, INK, RED, tidy
from warpchain.pictures.walk_shape import TiltingWalk, Walk, setting, tilting

Array = NDArray[np.float64]

_WIDTH: Final = 10.0
_HIGHEST: Final = 4.6
_DEEPEST: Final = 8.0
"""Width of a film strip, greatest height of its side view, and of both views below one another [inches]."""
_LEFT, _BETWEEN, _RIGHT, _TOP, _BELOW, _FOOT = 0.75, 0.7, 0.25, 0.35, 0.85, 1.3
"""Room for labels [inches]: beside, between and above the views, between the rows, and for the legend at the foot."""
_NARROWEST: Final = 1.3
"""Least width of the view from the front [inches]."""
_FLOOR: Final = 0.4
"""Height of the floor in the side view [inches]."""

FALLEN: Final = 45.0
"""Tilt beyond which a chain has fallen over [degrees]."""


@dataclass(frozen=True, eq=False)
class _Panel:
    """A view of the room along an axis.

    Attributes:
        title: from where.
        view: the viewer.
        axes: numbers of the room's axes to the right or left, and up or down.
    """

    title: str
    view: View
    axes: tuple[int, int]


_PANELS: Final = (
    _Panel("from the side", SIDE, (0, 1)),
    _Panel("from the front", FRONT, (2, 1)),
    _Panel("from above", ABOVE, (0, 2)),
)


def film_strip_in_room(walk: TiltingWalk, *, count: int | None = None, figure: Figure | None = None) -> Figure:
    """The chain along its walk from the side, from the front and from above, all drawn to the same scale.

    From each instant to the next the centre of mass moves equally far. Colour is time; outer links are darker than
    inner ones. From the front z grows to the left, and from above downwards, as such a viewer sees it.

    Args:
        walk: a walk with frames whose plane tilts.
        count: number of instants, at least 2; by default 6 to 12, as many as stay legible.
        figure: an empty figure to draw into; by default a new one that suits the walk.

    Raises:
        ValueError: joints in the room are missing for some frames, or broken.
    """
    joints = check_room(walk)
    low, high = room_box(walk, joints)
    size = high - low
    # A chain that stays upright is thin from above and from the front: room for the numbers on the axes.
    broad, across = max(size[1], size[2]), _WIDTH - _LEFT - _BETWEEN - _RIGHT
    scale = min(across / (size[0] + broad), _HIGHEST / size[1], (_DEEPEST - _FLOOR) / (size[1] + broad))
    if scale * broad < _NARROWEST:
        scale = (across - _NARROWEST) / size[0]
        broad = _NARROWEST / scale
    middle = (low[2] + high[2]) / 2
    low[2], high[2] = middle - broad / 2, middle + broad / 2
    size = high - low
    depth = _FLOOR / scale
    width, height, breadth = scale * size[0], scale * size[1] + _FLOOR, scale * size[2]
    paper = np.array([_WIDTH, _TOP + height + _BELOW + breadth + _FOOT])
    left = _LEFT + (_WIDTH - _LEFT - _BETWEEN - _RIGHT - width - breadth) / 2
    bottom = _FOOT + breadth + _BELOW
    figure = InlineFigure(tuple(paper)) if figure is None else figure
    boxes = [
        (left, bottom, width, height),
        (left + width + _BETWEEN, bottom, breadth, height),
        (left, _FOOT, width, breadth),
    ]
    shares = [np.array(box) / (*paper, *paper) for box in boxes]
    side, front, above = (figure.add_axes((*share,)) for share in shares)
    side.set(xlim=(low[0], high[0]), ylim=(-depth, high[1]), xlabel="$x$ / m", ylabel="$y$ / m")
    front.set(xlim=(high[2], low[2]), ylim=(-depth, high[1]), xlabel="$z$ / m", ylabel="$y$ / m")
    above.set(xlim=(low[0], high[0]), ylim=(high[2], low[2]), xlabel="$x$ / m", ylabel="$z$ / m")
    draw_ground(side, low[0], high[0], -depth)
    draw_ground(front, low[2], high[2], -depth)
    above.set_facecolor(GROUND)

    path = np.stack([np.interp(walk.frame_time, walk.time, row) for row in center_in_room(walk).T], axis=1)
    color_of, shown = time_colors(walk), instants(path, float(np.ptp(joints[0, :, 0])), count)
    for axes, panel in zip((side, front, above), _PANELS, strict=True):
        for frame in shown:
            _draw_chain(axes, walk, joints[frame], panel, link_colors(color_of, walk.frame_time[frame]))
        if panel.view is not SIDE:
            _draw_way(axes, walk, panel)
        axes.set_aspect("equal")
        axes.set_title(panel.title, fontsize="medium", loc="left")
        for axis, inches in ((axes.xaxis, axes.bbox.width), (axes.yaxis, axes.bbox.height)):
            locator = MaxNLocator(max(2, int(inches / figure.dpi / 0.55)), steps=[1, 2, 5, 10])
            first, last = sorted(axis.get_view_interval())
            least = 0.0 if axis is axes.yaxis and panel.axes[1] == 1 else first  # no heights on the ground below 0
            axis.set_ticks([tick for tick in locator.tick_values(least, last) if least <= tick <= last])
        tidy(axes)
    draw_way(side, walk)
    draw_distance(side, walk, -0.5 * depth)
    _draw_foot(figure, side, color_of, walk, paper)
    return figure


def _draw_foot(figure: Figure, side: Axes, color_of: ScalarMappable, walk: Walk, paper: Array) -> None:
    """What the colours and lines are, at the foot of the paper, whose size is in inches."""
    bar = np.array([_LEFT, 0.5, 4.4, 0.14]) / (*paper, *paper)
    colorbar = figure.colorbar(
        color_of, cax=figure.add_axes((*bar,)), orientation="horizontal", label="time since release / s"
    )
    colorbar.outline.set_visible(False)
    place = (1 - _RIGHT / paper[0], 0.05 / paper[1])
    style: dict[str, Any] = {"frameon": False, "title": setting(walk), "alignment": "left", "borderaxespad": 0.0}
    figure.legend(*side.get_legend_handles_labels(), loc="lower right", bbox_to_anchor=place, **style)


def _draw_chain(axes: Axes, walk: Walk, joints: Array, panel: _Panel, colors: tuple[Array, Array, Array]) -> None:
    """One chain: a white halo over the chains behind it, then its links from the rearmost to the foremost."""
    parameters = walk.setup.parameters
    solids = link_solids(joints, parameters.circle_radius, parameters.half_width, panel.view)
    walls, faces = link_paths(solids, lambda points: points[..., list(panel.axes)])
    pale, color, dark = colors
    axes.add_collection(
        PathCollection([*walls, *faces], facecolors="white", edgecolors="white", linewidths=1.8, zorder=2)
    )
    paths, fills, edges = [], [], []
    for link in solids.order:
        fill = color if link % 2 else pale
        paths += [walls[link], faces[link]]
        fills += [0.75 * fill, fill]
        edges += [dark, dark]
    axes.add_collection(PathCollection(paths, facecolors=fills, edgecolors=edges, linewidths=0.25, zorder=2))


def link_paths(solids: Solids, project: Callable[[Array], Array]) -> tuple[list[Path], list[Path]]:
    """Outlines of the visible walls and of the faces of all links.

    Args:
        solids: the links.
        project: where points x, y, z [m], shape (…, 3), are in the picture, shape (…, 2).
    """
    walls = []
    for pieces, seen in zip(project(solids.walls), solids.seen, strict=True):
        corners = pieces[seen]
        closed = np.concatenate([corners, corners[:, :1]], axis=1)
        codes = np.tile([Path.MOVETO, *3 * [Path.LINETO], Path.CLOSEPOLY], len(closed)).astype(Path.code_type)
        walls.append(Path(closed.reshape(-1, 2), codes))
    faces = [Path(np.concatenate([face, face[:1]]), closed=True) for face in project(solids.faces)]
    return walls, faces


def _draw_way(axes: Axes, walk: TiltingWalk, panel: _Panel) -> None:
    """The sprocket, which stands across the view, and the path of the centre of mass."""
    first, second = panel.axes
    circle, center = sprocket_circle(walk), center_in_room(walk)
    if circle is not None:
        ends = [circle.min(axis=0), circle.max(axis=0)]
        places = [[end[axis] for end in ends] for axis in (first, second)]
        axes.plot(*places, color=FAINT, linewidth=1.0, linestyle=DASHES, zorder=1.5)
    axes.plot(center[:, first], center[:, second], color=INK, linewidth=1.4, linestyle=DOTS, zorder=4)


def tilt_figure(walk: Walk, *, figure: Figure | None = None) -> Figure:
    """Tilt and yaw of the plane, and lateral drift of the centre of mass, against time.

    Marked are the moments at which the chain was first tilted by 45°, beyond which it has fallen over, and at which
    its loop collapsed, if the walk says when.

    Args:
        walk: a walk whose plane tilts.
        figure: an empty figure to draw into; by default a new one.

    Raises:
        ValueError: the plane of the walk is fixed, or it has no time series.
    """
    in_room = tilting(walk)
    if in_room is None:
        raise ValueError("walk: its plane is fixed, so it has no tilt; run it with plane: tilting")
    if len(walk.time) == 0:
        raise ValueError(f"walk: it has no time series. {walk.status.sentence}")
    figure = InlineFigure(figsize=(6.4, 5.0), layout="constrained") if figure is None else figure
    angles, drift = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    angles.axhline(0.0, color=FAINT, linewidth=0.8)
    for limit in (-FALLEN, FALLEN):
        angles.axhline(limit, color=FAINT, linewidth=0.8, linestyle=DOTS)
    angles.plot(walk.time, np.degrees(in_room.tilt), color=BLUE, linewidth=1.4, label="tilt, to the left")
    angles.plot(walk.time, np.degrees(in_room.yaw), color=GREEN, linewidth=1.4, label="yaw, to the left")
    drift.axhline(0.0, color=FAINT, linewidth=0.8)
    drift.plot(walk.time, in_room.center_z, color=INK, linewidth=1.4)
    for name, label, color, dashes in (
        ("fell_at", "fell over (45°)", RED, "-"),
        ("collapsed_at", "loop collapsed", RED, DASHES),
    ):
        moment = float(getattr(walk, name, np.nan))
        if np.isfinite(moment):
            text = f"{label}, {moment:.3f} s"
            for axes in (angles, drift):
                axes.axvline(moment, color=color, linewidth=1.0, linestyle=dashes, label=text, zorder=1.5)
    angles.set_ylabel("angle / degrees")
    drift.set(xlabel="time since release $t$ / s", ylabel="drift to the right $z^\\mathrm{cm}$ / m")
    drift.set_xlim(0.0, float(walk.time[-1]) or None)
    angles.set_title(setting(walk), fontsize="medium", loc="left")
    angles.legend(frameon=False, fontsize="small")
    figure.align_ylabels()
    for axes in (angles, drift):
        tidy(axes, grid="both")
    return figure
