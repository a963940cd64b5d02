"""Figures of walks: the paper's Figure 5, energies, and the angles of a plane that tilts.

Figures are made without pyplot: nothing is global, no display is needed, the caller owns what is returned.
"""

from collections.abc import Sequence
from typing import Final, get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from warpchain.inputs.scene import floor_points
from warpchain.pictures.chain import floor_height
from warpchain.pictures.film_strip import film_strip
from warpchain.pictures.inline import InlineFigure
from warpchain.pictures.loop_figure import loop_figure
from warpchain.pictures.style import BLUE, DASHES, DOTS, FAINT, GREEN, INK, LINE_COLORS, RED, tidy
from warpchain.pictures.walk_shape import Kind, Walk, setting

FALLEN: Final = 45.0
"""Tilt beyond which a chain has fallen over [degrees]."""


def draw(walk: Walk, kind: Kind, *, figure: Figure | None = None, ax: Axes | None = None) -> Figure:
    """Draw a walk; arguments and errors as of `WalkResult.plot`."""
    if kind not in get_args(Kind):
        raise ValueError(f"kind: {kind!r} is unknown; give {', '.join(map(repr, get_args(Kind)))}")
    if kind == "energy":
        return energy_figure(walk, figure=figure, ax=ax)
    if ax is not None:
        raise ValueError(f"ax: {kind} has several axes; give an empty figure=, or a SubFigure of yours")
    if kind == "figure5":
        return figure5([walk], figure=figure)
    return {"film_strip": film_strip, "loop": loop_figure, "tilt": tilt_figure}[kind](walk, figure=figure)


def figure5(walks: Sequence[Walk], *, labels: Sequence[str] | None = None, figure: Figure | None = None) -> Figure:
    """Height and horizontal speed of the centre of mass against time since the release, as in Figure 5.

    A thin line is the height of a floor that is not flat, below the centre of mass.

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
        _check_series(walk, f"walks[{index}]")
    figure = InlineFigure(figsize=(6.4, 5.0), layout="constrained") if figure is None else figure
    height, speed = figure.subplots(2, 1, sharex=True)
    settings = [f"n = {walk.setup.scene.links}, ν = {walk.setup.scene.frequency:g} Hz" for walk in walks]
    names = list(labels or settings)
    groups = list(dict.fromkeys(names))
    for index, (walk, name) in enumerate(zip(walks, names, strict=True)):
        order = index if len(groups) == 1 else groups.index(name)
        style = {"color": LINE_COLORS[order % len(LINE_COLORS)], "linewidth": 1.4}
        height.plot(walk.time, walk.center[:, 1], label="_" if name in names[:index] else name, **style)
        if floor_points(walk.setup.scene) is not None:
            height.plot(walk.time, floor_height(walk, walk.center[:, 0]), color=FAINT, linewidth=0.8)
        speed.plot(walk.time, walk.center_velocity[:, 0], **style)
    height.set_ylabel("height $y^\\mathrm{cm}$ / m")
    speed.set_ylabel("speed $v_x^\\mathrm{cm}$ / (m/s)")
    if all(floor_points(walk.setup.scene) is None for walk in walks):
        height.set_ylim(bottom=0.0)
    _finish(height, speed, end=max(float(walk.time[-1]) for walk in walks))
    if len(groups) > 1 or labels is not None:
        height.legend(frameon=False)
    else:
        height.set_title(groups[0], fontsize="medium", loc="left")
    return figure


def energy_figure(walk: Walk, *, figure: Figure | None = None, ax: Axes | None = None) -> Figure:
    """Energies of a walk against time, and what was lost by then.

    Lost is the energy at the release less that of the moment. The dot at the end is the sum of the ledger's losses,
    which counts each cause by itself: it lies on the line if the integration conserved energy.

    Raises:
        ValueError: figure and axes are given, or the walk has no time series.
    """
    if figure is not None and ax is not None:
        raise ValueError("ax: given together with figure; leave one out")
    _check_series(walk)
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
    ax.set_ylabel("energy / J")
    ax.set_title(setting(walk), fontsize="medium", loc="left")
    ax.legend(frameon=False)
    _finish(ax, end=float(walk.time[-1]))
    return ax.figure.figure if isinstance(ax.figure, SubFigure) else ax.figure


def tilt_figure(walk: Walk, *, figure: Figure | None = None) -> Figure:
    """Tilt and yaw of the plane, and lateral drift of the centre of mass, against time.

    Marked are the moments at which the chain was first tilted by 45°, beyond which it has fallen over, and at which
    its loop collapsed, if they came.

    Raises:
        ValueError: the plane of the walk is fixed, or it has no time series.
    """
    if walk.joints_in_room is None:
        raise ValueError("walk: its plane is fixed, so it has no tilt; run it with plane: tilting")
    _check_series(walk)
    figure = InlineFigure(figsize=(6.4, 5.0), layout="constrained") if figure is None else figure
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
    angles.set_title(setting(walk), fontsize="medium", loc="left")
    angles.legend(frameon=False, fontsize="small")
    figure.align_ylabels()
    _finish(angles, drift, end=float(walk.time[-1]))
    return figure


def _check_series(walk: Walk, name: str = "walk") -> None:
    """Refuse a walk that was never released.

    Raises:
        ValueError: it has no time series.
    """
    if len(walk.time) == 0:
        raise ValueError(f"{name}: it has no time series. {walk.status.sentence}")


def _finish(*panels: Axes, end: float) -> None:
    """Grids, and the common axis of time up to its end [s]."""
    for axes in panels:
        tidy(axes, grid="both")
    panels[-1].set(xlabel="time since release $t$ / s", xlim=(0.0, end or None))
