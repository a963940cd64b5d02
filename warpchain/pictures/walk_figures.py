"""Figures of walks: the paper's Figure 5, energies, and a film strip of the chain.

Figures are made without pyplot: nothing is global, no display is needed, the caller owns what is returned.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, cast, get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from warpchain.pictures.inline import InlineFigure
from warpchain.pictures.loop_figure import loop_figure
from warpchain.pictures.room import link_outlines
from warpchain.pictures.room_figures import film_strip_in_room, tilt_figure
from warpchain.pictures.strip_parts import (
    center_at,
    draw_distance,
    draw_ground,
    draw_way,
    instants,
    link_colors,
    time_colors,
)
from warpchain.pictures.style import BLUE, DASHES, GREEN, INK, LINE_COLORS, RED, tidy
from warpchain.pictures.walk_shape import EnergyWalk, Kind, Walk, check_frames, setting, tilting
from warpchain.status import Status

Array = NDArray[np.float64]

# A film strip: width and greatest height [inches], width of a close-up [links] and its ratio of width to height.
_WIDTH: Final = 10.0
_TALLEST_STRIP: Final = 4.6
_CLOSE_UP_LINKS: Final = 9
_CLOSE_UP_ASPECT: Final = 1.5


def draw(
    walk: Walk,
    kind: Kind,
    *,
    figure: Figure | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw a walk.

    Args:
        walk: what to draw.
        kind: `figure5` for height and speed of the centre of mass, `film_strip` for the chain itself, `loop` for its
            loop on the sprocket just before the release, `energy` for its energies, `tilt` for tilt, yaw and
            lateral drift of a plane that tilts.
        figure: an empty figure to draw into; by default a new one.
        ax: where to draw `energy`, the only figure with one pair of axes, instead of a figure of its own.

    Raises:
        ValueError: the kind is unknown, the walk does not have what it shows, or `ax` does not suit the kind.
    """
    if kind == "energy":
        return energy_figure(walk, figure=figure, ax=ax)
    draws = {"figure5": lambda: figure5([walk], figure=figure), "film_strip": lambda: film_strip(walk, figure=figure)}
    draws["loop"] = lambda: loop_figure(walk, figure=figure)
    draws["tilt"] = lambda: tilt_figure(walk, figure=figure)
    if kind not in draws:
        raise ValueError(f"kind: {kind!r} is unknown; give {', '.join(map(repr, get_args(Kind)))}")
    if ax is not None:
        raise ValueError(f"ax: {kind} has several axes; give an empty figure=, or a SubFigure of yours")
    return draws[kind]()


def figure5(walks: Sequence[Walk], *, labels: Sequence[str] | None = None, figure: Figure | None = None) -> Figure:
    """Height and horizontal speed of the centre of mass against time since the release, as in Figure 5.

    Args:
        walks: the walks, one line for each in both panels.
        labels: legend entries, one for each walk; walks of one label have the same colour. By default links and
            frequency, without a legend if they are the same for all walks.
        figure: an empty figure to draw into; by default a new one.

    Raises:
        ValueError: no walk is given, one has no time series, or there are not as many labels as walks.
    """
    if not walks:
        raise ValueError("walks: empty; give at least one walk")
    if labels is not None and len(labels) != len(walks):
        raise ValueError(f"labels: {len(labels)} for {len(walks)} walks; give one for each walk")
    for index, walk in enumerate(walks):
        if len(walk.time) == 0:
            raise ValueError(f"walks[{index}]: it has no time series. {walk.status.sentence}")
    figure = InlineFigure(figsize=(6.4, 5.0), layout="constrained") if figure is None else figure
    height, speed = figure.subplots(2, 1, sharex=True)
    settings = [f"n = {walk.setup.scene.links}, ν = {walk.setup.scene.frequency:g} Hz" for walk in walks]
    names = list(labels or settings)
    groups = list(dict.fromkeys(names))
    for index, (walk, name) in enumerate(zip(walks, names, strict=True)):
        order = index if len(groups) == 1 else groups.index(name)
        style = {"color": LINE_COLORS[order % len(LINE_COLORS)], "linewidth": 1.4}
        height.plot(walk.time, walk.center[:, 1], label="_" if name in names[:index] else name, **style)
        speed.plot(walk.time, walk.center_velocity[:, 0], **style)
    height.set_ylabel("height $y^\\mathrm{cm}$ / m")
    speed.set(xlabel="time since release $t$ / s", ylabel="speed $v_x^\\mathrm{cm}$ / (m/s)")
    height.set_ylim(bottom=0.0)
    speed.set_xlim(0.0, max(float(walk.time[-1]) for walk in walks))
    for axes in (height, speed):
        tidy(axes, grid="both")
    if len(groups) > 1 or labels is not None:
        height.legend(frameon=False)
    else:
        height.set_title(groups[0], fontsize="medium", loc="left")
    return figure


def energy_figure(walk: Walk, *, figure: Figure | None = None, ax: Axes | None = None) -> Figure:
    """Energies of a walk against time, and what was lost by then.

    Lost is the energy at the release less that of the moment. The dot at the end is the sum of the ledger's losses,
    which counts each cause by itself: it lies on the line if the integration conserved energy.

    Args:
        walk: a walk with energies.
        figure: an empty figure to draw into; by default a new one.
        ax: axes to draw into instead.

    Returns:
        The figure, that of `ax` if it is given.

    Raises:
        ValueError: figure and axes are given, the walk has no time series, or its energies were not kept.
    """
    if figure is not None and ax is not None:
        raise ValueError("ax: given together with figure; leave one out")
    if not hasattr(walk, "kinetic_energy"):
        raise ValueError("walk: a sweep does not keep its energies; run it by itself, warpchain.walk(setup=….setup)")
    if len(walk.time) == 0:
        raise ValueError(f"walk: it has no time series. {walk.status.sentence}")
    walk = cast(EnergyWalk, walk)
    if ax is None:
        figure = InlineFigure(figsize=(6.4, 4.0), layout="constrained") if figure is None else figure
        ax = figure.subplots()
    ledger, whole = walk.energy, walk.kinetic_energy + walk.gravitational_energy + walk.spring_energy
    released = ledger["kinetic_at_release"] + ledger["potential_at_release"]
    for name, values, color in (
        ("kinetic", walk.kinetic_energy, BLUE),
        ("gravitational", walk.gravitational_energy, GREEN),
        ("joint springs", walk.spring_energy, RED),
        ("lost since the release", released - whole, INK),
    ):
        ax.plot(walk.time, values, label=name, color=color, linewidth=1.4, linestyle=DASHES if color == INK else "-")
    lost = released - ledger["kinetic_at_end"] - ledger["potential_at_end"] - ledger["residual"]
    ax.plot(walk.time[-1:], [lost], "o", color=INK, clip_on=False, label="sum of all losses", zorder=4)
    ax.set(xlabel="time since release $t$ / s", ylabel="energy / J", xlim=(0.0, float(walk.time[-1])))
    ax.set_title(setting(walk), fontsize="medium", loc="left")
    ax.legend(frameon=False)
    tidy(ax, grid="both")
    return ax.figure.figure if isinstance(ax.figure, SubFigure) else ax.figure


def film_strip(walk: Walk, *, count: int | None = None, figure: Figure | None = None) -> Figure:
    """The chain along its walk, drawn to scale, and close-ups of up to four moments.

    In the strip the centre of mass moves equally far from each instant to the next. Colour is time; outer links are
    darker than inner ones. The close-ups show the first touch of the floor, the first self-contact, the collapse and
    the end. A chain whose plane tilts is seen from the side, from above and from the front instead.

    Args:
        walk: a walk with frames.
        count: number of instants in the strip, at least 2; by default 6 to 12, as many as stay legible.
        figure: an empty figure to draw into; by default a new one that suits the walk.

    Raises:
        ValueError: the walk has no frames or broken ones, or fewer than 2 instants are asked for.
    """
    check_frames(walk)
    if count is not None and count < 2:
        raise ValueError(f"count: {count} is too few; give 2 or more")
    if (in_room := tilting(walk)) is not None:
        return film_strip_in_room(in_room, count=count, figure=figure)
    close_ups = _close_ups(walk)
    size = np.array([1.0, 1.0 / _CLOSE_UP_ASPECT]) * _CLOSE_UP_LINKS * walk.setup.parameters.link_length
    corners = [close_up.spot - size / 2 for close_up in close_ups]
    for corner in corners:
        corner[1] = max(corner[1], -0.1 * size[1])
    left, right, top = extent(walk, *(corner[0] + offset for corner in corners for offset in (0.0, size[0])))
    # The layout is computed in inches: constrained layout clips labels of axes with a fixed aspect.
    inner_width = _WIDTH - 1.6
    scale = min(inner_width / (right - left), _TALLEST_STRIP / top)
    depth = 0.4 / scale
    strip_width, strip_height = scale * (right - left), scale * (top + depth)
    close_up_width = min((_WIDTH - 0.3) / len(close_ups), _WIDTH / 3)
    close_up_height = (close_up_width - 0.1) / _CLOSE_UP_ASPECT
    paper = np.array([_WIDTH, strip_height + close_up_height + 1.1])
    figure = InlineFigure(tuple(paper)) if figure is None else figure
    color_of = time_colors(walk)

    def shares(left: float, bottom: float, width: float, height: float) -> tuple[float, float, float, float]:
        return left / paper[0], bottom / paper[1], width / paper[0], height / paper[1]

    strip_left = 0.65 + (inner_width - strip_width) / 2
    strip = figure.add_axes(shares(strip_left, close_up_height + 0.95, strip_width, strip_height))
    draw_ground(strip, left, right, -depth)
    for frame in instants(center_at(walk, walk.frame_time), float(np.ptp(walk.frame_joints[0, :, 0])), count):
        _draw_chain(strip, walk, frame, color_of, edge=0.25)
    draw_way(strip, walk)
    strip.legend(loc="upper right", frameon=False, title=setting(walk), alignment="left")
    draw_distance(strip, walk, -0.5 * depth)
    strip.set(xlim=(left, right), ylim=(-depth, top), aspect="equal", xlabel="$x$ / m", ylabel="$y$ / m")
    tidy(strip)
    bar_axes = strip.inset_axes((1.0 + 0.12 / strip_width, 0.0, 0.14 / strip_width, 1.0))
    figure.colorbar(color_of, cax=bar_axes, label="time since release / s").outline.set_visible(False)

    for column, (close_up, corner) in enumerate(zip(close_ups, corners, strict=True)):
        letter = f"$\\mathbf{{{'abcd'[column]}}}$"
        axes = figure.add_axes(shares(0.2 + column * close_up_width, 0.1, close_up_width - 0.1, close_up_height))
        (x, y), (width, height) = corner, size
        draw_ground(axes, x, x + width, min(y, 0.0))
        _draw_chain(axes, walk, close_up.frame, color_of, edge=0.6)
        axes.set(xlim=(x, x + width), ylim=(y, y + height), aspect="equal", xticks=[], yticks=[])
        title = f"{letter}  {close_up.title}, {walk.frame_time[close_up.frame]:.3f} s"
        axes.set_title(title, fontsize="medium", loc="left")
        strip.add_patch(Rectangle((x, y), width, height, fill=False, edgecolor=INK, linewidth=0.8, zorder=5))
        # Neighbouring boxes often overlap, so their letters are at alternate corners.
        side = {"ha": "right", "x": x + width} if column % 2 else {"ha": "left", "x": x}
        halo = [withStroke(linewidth=3.0, foreground="white")]
        strip.text(y=y + height, s=letter, va="bottom", zorder=5, path_effects=halo, **side)
    return figure


@dataclass(frozen=True)
class _CloseUp:
    """Title, number of the frame, and middle of the picture [m], shape (2,)."""

    title: str
    frame: int
    spot: Array


def _close_ups(walk: Walk) -> list[_CloseUp]:
    """At most four moments in order of time, no frame twice.

    They are the first touch of the floor, the first self-contact, the collapse and the end, as far as they happen. The
    collapse is the last time at which the top of the chain is half as high as at the release.
    """
    joints, radius = walk.frame_joints, walk.setup.parameters.circle_radius
    height, last = joints[:, :, 1].max(axis=1), len(joints) - 1
    found = []
    touching = np.flatnonzero(joints[:, :, 1].min(axis=1) < 1.02 * radius)
    if touching.size:
        frame = int(touching[0])
        found.append(_CloseUp("first touch", frame, joints[frame, np.argmin(joints[frame, :, 1])]))
    meeting = _first_meeting(joints, 2.02 * radius)
    if meeting is not None:
        found.append(_CloseUp("first self-contact", *meeting))
    frame = int(np.flatnonzero(height >= 0.5 * height[0])[-1])
    found.append(_CloseUp("collapse", frame, joints[frame, _sharpest_bend(joints[frame])]))
    pile = np.array([np.median(joints[last, :, 0]), 0.0])
    found.append(_CloseUp("rest" if walk.status is Status.AT_REST else "end", last, pile))
    by_frame = {close_up.frame: close_up for close_up in found}
    return [by_frame[frame] for frame in sorted(by_frame)]


def _first_meeting(joints: Array, distance: float) -> tuple[int, Array] | None:
    """First frame in which two joints at least 3 links apart are closer than `distance`, and where."""
    count = joints.shape[1]
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    excluded = np.minimum(apart, count - apart) < 3
    for frame, (x, y) in enumerate(joints.transpose(0, 2, 1)):
        squares = np.subtract.outer(x, x) ** 2 + np.subtract.outer(y, y) ** 2
        squares[excluded] = np.inf
        nearest = np.unravel_index(np.argmin(squares), squares.shape)
        if squares[nearest] < distance**2:
            return frame, joints[frame, list(nearest)].mean(axis=0)
    return None


def _sharpest_bend(joints: Array) -> int:
    """Number of the joint at which the chain turns most over three links."""
    step = joints - np.roll(joints, 1, axis=0)
    direction = np.arctan2(step[:, 1], step[:, 0])
    turn = np.angle(np.exp(1j * (np.roll(direction, -2) - np.roll(direction, 1))))
    return int(np.argmax(np.abs(turn)))


def extent(walk: Walk, *others: float) -> tuple[float, float, float]:
    """Left and right end and top of the whole walk, with a margin [m]; `others` are x of what else is to be seen."""
    x, y = walk.frame_joints[:, :, 0], walk.frame_joints[:, :, 1]
    margin = 3 * walk.setup.parameters.circle_radius
    left, right = min([float(x.min()), *others]), max([float(x.max()), *others])
    return left - margin, right + margin, float(y.max()) + margin


def _draw_chain(axes: Axes, walk: Walk, frame: int, color_of: ScalarMappable, edge: float) -> None:
    """One chain: a white halo over the chains behind it, then inner links, then outer links."""
    outlines = link_outlines(walk.frame_joints[frame], walk.setup.parameters.circle_radius)
    pale, color, dark = link_colors(color_of, walk.frame_time[frame])
    axes.add_collection(
        PolyCollection(list(outlines), facecolors="white", edgecolors="white", linewidths=4 * edge + 0.8, zorder=2)
    )
    for links, fill in ((outlines[0::2], pale), (outlines[1::2], color)):
        axes.add_collection(
            PolyCollection(list(links), facecolors=[fill], edgecolors=[dark], linewidths=edge, zorder=2)
        )
