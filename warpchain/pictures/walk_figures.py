"""Figures of a walk: height and speed, as in the paper's Figure 5, energies, loop, angles of a plane that tilts.

Figures are made without pyplot: nothing is global, no display is needed, the caller owns what is returned.
"""

from typing import TYPE_CHECKING, Any, Final, get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.inputs.arrays import Array
from warpchain.loop.stationary_loop import StationaryLoop
from warpchain.pictures.chain import stretches
from warpchain.pictures.film_strip import film_strip
from warpchain.pictures.style import BLUE, DASHES, DOTS, FAINT, GREEN, GROUND, INK, RED, InlineFigure, tidy
from warpchain.pictures.walk_shape import Kind, setting

if TYPE_CHECKING:
    from warpchain.walks.walk_result import WalkResult

FALLEN: Final = 45.0
"""Tilt beyond which a chain has fallen over [degrees]."""
SIMULATED: Final[dict[str, Any]] = {"color": BLUE, "linewidth": 2.2}
BOTTOM: Final = 0.25
"""The curvature is shown this far [m] from the lowest point, or as far as the loop is free."""
IN_LINKS: Final = 2.0
"""The tension is shown this many links away from the sprocket: averages near it include links that touch it."""


def draw(walk: "WalkResult", kind: Kind, *, figure: Figure | None = None, ax: Axes | None = None) -> Figure:
    """Draw a walk; arguments and errors as of `WalkResult.plot`."""
    if kind not in get_args(Kind):
        raise ValueError(f"kind: {kind!r} is unknown; give {', '.join(map(repr, get_args(Kind)))}")
    if kind not in ("film_strip", "loop") and len(walk.time) == 0:
        raise ValueError(f"walk: it has no time series. {walk.status.sentence}")
    if ax is not None and kind != "energy":
        raise ValueError(f"ax: {kind} has several axes; give an empty figure=, or a SubFigure of yours")
    if ax is not None and figure is not None:
        raise ValueError("ax: given together with figure; leave one out")
    if kind == "film_strip":
        return film_strip(walk, figure)
    if ax is not None:
        _energy(walk, ax)
        return ax.figure.figure if isinstance(ax.figure, SubFigure) else ax.figure
    sizes = {"height_and_speed": (6.4, 5.0), "loop": (10.0, 6.4), "energy": (6.4, 4.0), "tilt": (6.4, 5.0)}
    figure = InlineFigure(figsize=sizes[kind], layout="constrained") if figure is None else figure
    draws = {"height_and_speed": _height_and_speed, "loop": _loop, "tilt": _tilt}
    if kind == "energy":
        _energy(walk, figure.subplots())
    else:
        draws[kind](walk, figure)
    return figure


def _height_and_speed(walk: "WalkResult", figure: Figure) -> None:
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


def _energy(walk: "WalkResult", ax: Axes) -> None:
    """Energies of a walk against time, and what was lost by then.

    Lost is the energy at the release less that of the moment. The dot at the end is the sum of the ledger's losses,
    which counts each cause by itself: it lies on the line if the integration conserved energy.
    """
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
    ax.set_ylabel("energy / J")
    ax.legend(frameon=False)
    _finish(walk, ax)


def _tilt(walk: "WalkResult", figure: Figure) -> None:
    """Tilt and yaw of the plane, and lateral drift of the centre of mass, against time.

    Marked are the moments at which the chain was first tilted by 45°, beyond which it has fallen over, and at which
    its loop collapsed, if they came. A `ValueError` says that the plane of the walk is fixed.
    """
    if walk.joints_in_room is None:
        raise ValueError("walk: its plane is fixed, so it has no tilt; run it with plane: tilting")
    angles, drift = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for limit in (-FALLEN, FALLEN):
        angles.axhline(limit, color=FAINT, linewidth=0.8, linestyle=DOTS)
    angles.plot(walk.time, np.degrees(walk.tilt), color=BLUE, linewidth=1.4, label="tilt, to the left")
    angles.plot(walk.time, np.degrees(walk.yaw), color=GREEN, linewidth=1.4, label="yaw, to the left")
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


def _finish(walk: "WalkResult", *panels: Axes) -> None:
    """Title, grids, and the common axis of time up to the end of the walk."""
    for axes in panels:
        tidy(axes, grid="both")
    panels[0].set_title(setting(walk), fontsize="medium", loc="left")
    panels[-1].set(xlabel="time since release $t$ / s", xlim=(0.0, float(walk.time[-1]) or None))


def _loop(walk: "WalkResult", figure: Figure) -> None:
    """The mean loop of a walk before its release, to scale, and its curvature and tension along the arc.

    A `ValueError` says that the time before the release was not kept, or is not enough for a mean loop.
    """
    loop = walk.mean_loop()
    kink = loop.kink()
    width, height = np.ptp(loop.position, axis=0)
    share = float(np.clip(0.56 * (width + 0.08) / (height + 0.08), 0.23, 0.42))
    left, right = np.asarray(figure.subfigures(1, 2, width_ratios=[share, 1 - share]))
    shape = left.subplots()
    bend, pull = right.subplots(2, 1)

    _draw_shape(shape, loop, walk.sprocket_radius)
    x, y = (float(np.interp(kink.dip_at, loop.s, values)) for values in (loop.position - loop.center).T)
    _mark(shape, x, y, "kink")
    spread = 1e3 * float(loop.spread[loop.is_free].max())
    shape.set_title(f"{setting(walk)}\njoints within {spread:.2g} mm (s.d.)", fontsize="small", loc="left")
    tidy(shape)

    reach = 1.6 * max(BOTTOM, abs(kink.dip_at))
    low, high = max(-reach, loop.free[0] - 0.03), min(reach, loop.free[1] + 0.03)
    _draw_line(bend, loop.curvature, loop, (loop.s >= low) & (loop.s <= high))
    _mark(bend, kink.dip_at, kink.dip, f"kink: ${kink.dip:.1f}$ m$^{{-1}}$ at ${100 * kink.dip_at:.1f}$ cm")
    bend.set(xlim=(low, high), ylabel="curvature $\\kappa$ / m$^{-1}$")

    inset = IN_LINKS * loop.parameters.link_length
    inside = (loop.s > loop.free[0] + inset) & (loop.s < loop.free[1] - inset)
    _draw_line(pull, loop.effective_tension, loop, inside)
    carried = loop.density * loop.speed**2
    pull.set_title(f"$\\rho v^2$ = {carried:.2f} N", fontsize="small", loc="left")
    pull.set(xlim=(loop.free[0] - 0.03, loop.free[1] + 0.03), ylabel="tension $T - \\rho v^2$ / N")
    pull.set_xlabel("arc length $s$ from the lowest point, along the motion / m")
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
