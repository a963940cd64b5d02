"""Figures of a walk: height and speed, as in the paper's Figure 5, energies, and the angles of a plane that tilts.

Figures are made without pyplot: nothing is global, no display is needed, the caller owns what is returned.
"""

from typing import TYPE_CHECKING, Final, get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from warpchain.inputs.scene import floor_points
from warpchain.pictures.chain import floor_height
from warpchain.pictures.film_strip import film_strip
from warpchain.pictures.inline import InlineFigure
from warpchain.pictures.loop_figure import draw_loop
from warpchain.pictures.style import BLUE, DASHES, DOTS, FAINT, GREEN, INK, RED, tidy
from warpchain.pictures.walk_shape import Kind, setting

if TYPE_CHECKING:
    from warpchain.walks.walk_result import WalkResult

FALLEN: Final = 45.0
"""Tilt beyond which a chain has fallen over [degrees]."""


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
    draws = {"height_and_speed": _height_and_speed, "loop": draw_loop, "tilt": _tilt}
    if kind == "energy":
        _energy(walk, figure.subplots())
    else:
        draws[kind](walk, figure)
    return figure


def _height_and_speed(walk: "WalkResult", figure: Figure) -> None:
    """Height and horizontal speed of the centre of mass against time since the release, as in Figure 5.

    A thin line is the height of a floor that is not flat, below the centre of mass.
    """
    height, speed = figure.subplots(2, 1, sharex=True)
    height.plot(walk.time, walk.center[:, 1], color=BLUE, linewidth=1.4)
    speed.plot(walk.time, walk.center_velocity[:, 0], color=BLUE, linewidth=1.4)
    height.set_ylabel("height $y^\\mathrm{cm}$ / m")
    speed.set_ylabel("speed $v_x^\\mathrm{cm}$ / (m/s)")
    if floor_points(walk.setup.scene) is None:
        height.set_ylim(bottom=0.0)
    else:
        height.plot(walk.time, floor_height(walk, walk.center[:, 0]), color=FAINT, linewidth=0.8)
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
    its loop collapsed, if they came.

    Raises:
        ValueError: the plane of the walk is fixed.
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
