"""Figures of a walk: film strip, height and speed, as in the paper's Figure 5, energies, loop, angles of a plane.

Figures are made without pyplot: nothing is global, no display is needed, the caller owns what is returned.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.inputs.arrays import Array
from warpchain.inputs.figure_kinds import KINDS, FigureWord
from warpchain.inputs.validation import InputError, shown
from warpchain.loop.stationary_loop import StationaryLoop
from warpchain.pictures.film_strip import film_strip
from warpchain.pictures.labels import math_symbol, setting
from warpchain.pictures.places import stretches
from warpchain.pictures.style import (
    BLUE,
    DASHES,
    DOTS,
    FAINT,
    GREEN,
    GROUND,
    INK,
    NARROW,
    RED,
    STROKES,
    InlineFigure,
    checked_figure,
    tidy,
    wrapped,
)
from warpchain.walks.walk_numbers import WalkNumbers as Walk

FALLEN: Final = 45.0
"""Tilt beyond which a chain has fallen over [degrees]."""
SIMULATED: Final[dict[str, Any]] = {"color": BLUE, "linewidth": 2.2}
IN_LINKS: Final = 2.0
"""The tension is shown this many links away from the sprocket: averages near it include links that touch it."""


def draw(
    walk: Walk, kind: FigureWord, *, figure: Figure | None = None, ax: Axes | None = None, width: float | None = None
) -> Figure:
    """Draw a walk; arguments and errors as of `WalkResult.plot`, but for the width of a new figure [inches]."""
    if kind not in KINDS:
        raise ValueError(f"kind: unknown kind {kind!r}; use {', '.join(map(repr, KINDS))}")
    if KINDS[kind].needs_series and len(walk.time) == 0:
        raise ValueError(f"walk: it has no time series. {walk.status.sentence}")
    if ax is not None and kind != "energy":
        raise ValueError(f"ax: {kind} has several axes; use figure= with an empty Figure or SubFigure")
    if ax is not None and figure is not None:
        raise ValueError("ax: not possible with figure; remove one")
    if figure is not None:
        checked_figure(figure)
    if ax is not None and not isinstance(ax, Axes):
        raise InputError(f"ax: expected matplotlib Axes, got {shown(ax)}")
    if ax is not None:
        _energy(walk, ax)
        return ax.figure.figure if isinstance(ax.figure, SubFigure) else ax.figure
    if kind == "film_strip":
        return film_strip(walk, figure, width)
    draw_into, size = _DRAWN_BY[kind]
    figure = size.paper(width) if figure is None else figure
    draw_into(walk, figure)
    return figure


def kinds_of(walk: Walk) -> tuple[FigureWord, ...]:
    """The figures that a walk has, if it was recorded."""
    return tuple(word for word, kind in KINDS.items() if not kind.needs_tilt or walk.joints_lab is not None)


class _Size(NamedTuple):
    """Width and height of a figure [inches], and its height before it is scaled to narrow paper."""

    width: float
    height: float
    narrow_height: float

    def paper(self, width: float | None) -> Figure:
        """A new figure of this size, or of a given width [inches] and a height that suits it."""
        if width is None:
            return InlineFigure(figsize=(self.width, self.height), layout="constrained")
        height = self.narrow_height if width < NARROW else self.height
        return InlineFigure((width, height * max(0.62, min(1.2, width / self.width))), layout="constrained")


def _height_and_speed(walk: Walk, figure: Figure) -> None:
    """Height and horizontal speed of the centre of mass against time since the release, as in Figure 5.

    A thin line is the height of a floor that is not flat, below the centre of mass; it is thick and has a label where
    the floor has coefficients of its own.
    """
    height, speed = figure.subplots(2, 1, sharex=True)
    height.plot(walk.time, walk.center[:, 1], color=BLUE, linewidth=1.4)
    speed.plot(walk.time, walk.center_velocity[:, 0], color=BLUE, linewidth=1.4)
    height.set_ylabel("height $y^\\mathrm{cm}$ / m")
    speed.set_ylabel("speed $v_x^\\mathrm{cm}$ / (m/s)")
    if walk.setup.scene.is_level:
        height.set_ylim(bottom=0.0)
    else:
        x, floor = walk.center[:, 0], walk.setup.floor.heights(walk.center[:, 0])
        height.plot(walk.time, floor, color=FAINT, linewidth=0.8)
        for color, label, faces in stretches(walk, x.min(), x.max()):
            is_above = ((faces[:, 0, 0, None] <= x) & (x < faces[:, 1, 0, None])).any(axis=0)
            height.plot(walk.time, np.where(is_above, floor, np.nan), color=color, linewidth=3.5, label=label)
            height.legend(frameon=False)
    _finish(walk, height, speed)


def _energy(walk: Walk, ax: Axes) -> None:
    """Energies of a walk against time, and what was lost by then.

    Lost is the energy at the release less that of the moment. The dot at the end is the sum of the ledger's losses,
    which counts each cause by itself: it lies on the line if the integration conserved energy.
    """
    released, whole = walk.energy_at_release, walk.kinetic_energy + walk.gravitational_energy + walk.spring_energy
    for name, values, color, line in (
        ("kinetic", walk.kinetic_energy, BLUE, "-"),
        ("gravitational", walk.gravitational_energy, GREEN, STROKES[3]),
        ("joint springs", walk.spring_energy, RED, DOTS),
        ("lost since the release", released - whole, INK, DASHES),
    ):
        ax.plot(walk.time, values, label=name, color=color, linewidth=1.4, linestyle=line)
    lost = released - walk.energy_at_end - walk.energy["residual"]
    ax.plot(walk.time[-1:], [lost], "o", color=INK, clip_on=False, label="sum of all losses", zorder=4)
    ax.set_ylabel("energy / J")
    ax.legend(frameon=False)
    _finish(walk, ax)


def _tilt(walk: Walk, figure: Figure) -> None:
    """Tilt and yaw of the plane, and lateral drift of the centre of mass, against time.

    Marked are the moments at which the chain was first tilted by 45°, beyond which it has fallen over, and at which
    its loop collapsed, if they came. A `ValueError` says that the plane of the walk is fixed.
    """
    if walk.joints_lab is None:
        raise ValueError("walk: its plane is fixed, so it has no tilt; run it with plane: tilting")
    angles, drift = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for limit in (-FALLEN, FALLEN):
        angles.axhline(limit, color=FAINT, linewidth=0.8, linestyle=DOTS)
    angles.plot(walk.time, np.degrees(walk.tilt), color=BLUE, linewidth=1.4, label="tilt, to the left")
    angles.plot(walk.time, np.degrees(walk.yaw), color=GREEN, linewidth=1.4, label="yaw, to the left", linestyle=DASHES)
    drift.plot(walk.time, walk.center_z, color=INK, linewidth=1.4)
    events = ((walk.fell_at, "fell over (45°)", "-"), (walk.collapsed_at, "loop collapsed", DASHES))
    for axes in (angles, drift):
        axes.axhline(0.0, color=FAINT, linewidth=0.8)
        for moment, label, dashes in events:
            if np.isfinite(moment):
                text = f"{label}, {moment:.3f} s"
                axes.axvline(moment, color=RED, linewidth=1.0, linestyle=dashes, label=text, zorder=1.5)
    angles.set_ylabel("angle / degrees")
    drift.set_ylabel("drift to the right $z^\\mathrm{cm}$ / m")
    angles.legend(frameon=False, fontsize="small")
    figure.align_ylabels()
    _finish(walk, angles, drift)


def _finish(walk: Walk, *panels: Axes) -> None:
    """Title, grids, and the common axis of time up to the end of the walk."""
    for axes in panels:
        tidy(axes, grid="both")
    title = wrapped(setting(walk, math_symbol), panels[0].figure, 0.8)
    panels[0].set_title(title, fontsize="medium", loc="left")
    panels[-1].set(xlabel="time since release $t$ / s", xlim=(0.0, float(walk.time[-1]) or None))


def _loop(walk: Walk, figure: Figure) -> None:
    """The mean loop of a walk before its release, to scale, and its curvature and tension along the arc.

    A `ValueError` says that the time before the release was not kept, or is not enough for a mean loop.
    """
    loop = walk.mean_loop()
    kink = loop.kink()
    broad, high = np.ptp(loop.position, axis=0)
    share = float(np.clip(0.56 * (broad + 0.08) / (high + 0.08), 0.23, 0.42))
    figure.suptitle(wrapped(setting(walk, math_symbol), figure), fontsize="medium", x=0.01, ha="left")
    if figure.get_figwidth() < NARROW:
        left, right = np.asarray(figure.subfigures(2, 1, height_ratios=[2, 3]))
    else:
        left, right = np.asarray(figure.subfigures(1, 2, width_ratios=[share, 1 - share]))
    shape = left.subplots()
    bend, pull = right.subplots(2, 1)

    _draw_shape(shape, loop, walk.sprocket_radius)
    x, y = (float(np.interp(kink.dip_at, loop.s, values)) for values in (loop.position - loop.center).T)
    _mark(shape, x, y, "kink")
    spread = 1e3 * float(loop.spread[loop.is_free].max())
    shape.set_title(f"blue band: joints\n± {spread:.2g} mm (s.d.)", fontsize="small", loc="left")
    tidy(shape)
    if figure.get_figwidth() < NARROW:
        shape.set_xticks([0.0])

    low, high = loop.free[0] - 0.03, loop.free[1] + 0.03
    _draw_line(bend, loop.curvature, loop, (loop.s >= low) & (loop.s <= high))
    _mark(bend, kink.dip_at, kink.dip, "kink")
    at_kink = f"kink: ${kink.dip:.1f}$ m$^{{-1}}$ at ${100 * kink.dip_at:.1f}$ cm"
    bend.set_title(f"grey: on the sprocket; {at_kink}", fontsize="small", loc="left")
    bend.set(xlim=(low, high), ylabel="curvature $\\kappa$ / m$^{-1}$")

    inset = IN_LINKS * loop.parameters.link_length
    inside = (loop.s > loop.free[0] + inset) & (loop.s < loop.free[1] - inset)
    _draw_line(pull, loop.effective_tension, loop, inside)
    carried = loop.density * loop.speed**2
    pull.set_title(f"$\\rho v^2$ = {carried:.2f} N", fontsize="small", loc="left")
    pull.set(xlim=(low, high), ylabel="tension $T - \\rho v^2$ / N")
    pull.set_xlabel("arc length $s$ from the lowest point / m")
    if figure.get_figwidth() < NARROW:
        for axes in (bend, pull):
            axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    pull.set_ylim(bottom=min(0.0, 1.1 * float(loop.effective_tension[inside].min())))


def _draw_shape(axes: Axes, loop: StationaryLoop, sprocket_radius: float) -> None:
    """The loop to scale, its joints' standard deviation on either side; the origin is the sprocket's centre."""
    place = loop.position - loop.center
    normal = np.stack([np.sin(loop.angle), np.cos(loop.angle)], axis=1)
    closed = np.append(np.arange(len(place)), 0)
    band = loop.spread[:, None] * normal
    edges = np.concatenate([(place - band)[closed], (place + band)[closed][::-1]])
    axes.add_patch(Circle((0.0, 0.0), sprocket_radius, facecolor=GROUND, edgecolor=FAINT, linewidth=0.8))
    axes.fill(*edges.T, color=BLUE, alpha=0.25, linewidth=0.0, zorder=2)
    axes.plot(*place[closed].T, zorder=3, **SIMULATED)
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": FAINT, "connectionstyle": "arc3,rad=-0.4"}
    ends = 0.45 * sprocket_radius
    axes.annotate("", (ends, ends), (-ends, ends), arrowprops=arrow)  # it runs clockwise
    axes.set(xlabel="$x$ / m", ylabel="$y$ / m", aspect="equal")
    axes.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    axes.margins(0.12, 0.03)


def _draw_line(axes: Axes, values: Array, loop: StationaryLoop, shown: NDArray[np.bool_]) -> None:
    """A function of the arc length where it is to be shown; the sprocket is shaded."""
    for first, last in ((-loop.length, loop.free[0]), (loop.free[1], loop.length)):
        axes.axvspan(first, last, color=GROUND, linewidth=0.0)
    axes.plot(loop.s[shown], values[shown], label="simulation, mean", **SIMULATED)
    room = 0.2 * float(np.ptp(values[shown]))
    axes.set_ylim(values[shown].min() - room, values[shown].max() + room)
    tidy(axes, grid="both")


def _mark(axes: Axes, x: float, y: float, text: str) -> None:
    """A small circle with a text to the right of it and below."""
    axes.plot([x], [y], marker="o", markersize=7.0, markerfacecolor="none", markeredgecolor=INK, zorder=5)
    axes.annotate(text, (x, y), (8, -4), textcoords="offset points", va="top", color=INK, fontsize="small")


_DRAWN_BY: Final[Mapping[str, tuple[Callable[[Walk, Figure], None], _Size]]] = {
    "height_and_speed": (_height_and_speed, _Size(6.4, 5.0, 5.0)),
    "loop": (_loop, _Size(10.0, 6.4, 8.0)),
    "energy": (lambda walk, figure: _energy(walk, figure.subplots()), _Size(6.4, 4.0, 4.0)),
    "tilt": (_tilt, _Size(6.4, 5.0, 5.0)),
}
"""Each figure of `KINDS` but the film strip, which has a size of its own: what draws it, and its size."""
