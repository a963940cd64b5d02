"""The figure of a stationary loop: its mean shape, curvature and tension, beside a catenary."""

from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from warpchain.loop.catenary import Catenary
from warpchain.loop.stationary_loop import Kink, StationaryLoop, average_loop
from warpchain.pictures.inline import InlineFigure
from warpchain.pictures.style import BLUE, FAINT, GREEN, GROUND, INK, tidy
from warpchain.pictures.walk_shape import Walk, setting

SIMULATED: Final[dict[str, Any]] = {"color": BLUE, "linewidth": 2.2}
HANGING: Final[dict[str, Any]] = {"color": GREEN, "linewidth": 1.2}
"""Lines of simulation and catenary."""
BOTTOM: Final = 0.25
"""The curvature is shown this far [m] from the lowest point, or as far as the loop is free."""
SLIM: Final = 4.0
"""A loop whose height is at least so many times its width has little room for numbers below it."""
IN_LINKS: Final = 2.0
"""The tension is shown this many links away from the sprocket: averages near it include links that touch it."""


def loop_figure(walk: Walk, *, figure: Figure | None = None) -> Figure:
    """The mean loop of a walk before its release, to scale, and its curvature and tension along the arc.

    Args:
        walk: a walk with `before_release`.
        figure: an empty figure to draw into; by default a new one.

    Raises:
        ValueError: the time before the release was not kept, or is not enough for a mean loop.
    """
    loop = average_loop(walk)
    hanging, kink = loop.catenary(), loop.kink()
    figure = InlineFigure(figsize=(10.0, 6.4), layout="constrained") if figure is None else figure
    height, width = np.ptp(loop.position[:, 1]), np.ptp(loop.position[:, 0])
    share = float(np.clip(5.6 * (width + 0.08) / (height + 0.08), 2.3, 4.2)) / 10.0
    left, right = np.asarray(figure.subfigures(1, 2, width_ratios=[share, 1 - share]))
    shape = left.subplots()
    bend, pull = right.subplots(2, 1)
    _draw_shape(shape, walk, loop, hanging, kink)
    spread = 1e3 * float(loop.spread[loop.is_free].max())
    shape.set_title(f"{setting(walk)}\njoints within {spread:.2g} mm (s.d.)", fontsize="small", loc="left")
    _draw_curvature(bend, loop, hanging, kink)
    _draw_tension(pull, loop, hanging)
    tidy(shape)
    tidy(bend, grid="both")
    tidy(pull, grid="both")
    return figure


def _draw_shape(axes: Axes, walk: Walk, loop: StationaryLoop, hanging: Catenary, kink: Kink) -> None:
    """The loop to scale, its joints' standard deviation on either side; the origin is the sprocket's centre."""
    place = loop.position - loop.center
    slim = np.ptp(place[:, 1]) > SLIM * np.ptp(place[:, 0])
    normal = np.stack([np.sin(loop.angle), np.cos(loop.angle)], axis=1)
    closed = np.append(np.arange(len(place)), 0)
    band = loop.spread[:, None] * normal
    outer, inner = (place - band)[closed], (place + band)[closed]
    axes.add_patch(Circle((0.0, 0.0), walk.sprocket_radius, facecolor=GROUND, edgecolor=FAINT, linewidth=0.8))
    axes.fill(*np.concatenate([outer, inner[::-1]]).T, color=BLUE, alpha=0.25, linewidth=0.0, zorder=2)
    axes.plot(*(hanging.position - loop.center).T, zorder=2.5, **HANGING | {"linewidth": 1.0})
    axes.plot(*place[closed].T, zorder=3, **SIMULATED)
    x, y = (float(np.interp(kink.dip_at, loop.s, values)) for values in place.T)
    _mark(axes, x, y, "kink", -8 if slim else 8)
    radius = 0.6 * walk.sprocket_radius
    turn = np.deg2rad(np.linspace(140.0, 40.0, 30))
    axes.plot(radius * np.cos(turn), radius * np.sin(turn), color=FAINT, linewidth=1.0)
    tip, back = ((float(radius * np.cos(turn[i])), float(radius * np.sin(turn[i]))) for i in (-1, -3))
    axes.annotate("", tip, back, arrowprops={"arrowstyle": "-|>", "color": FAINT, "shrinkA": 0, "shrinkB": 0})
    axes.set(xlabel="$x$ / m", ylabel="$y$ / m", aspect="equal")
    if slim:
        axes.set_xticks([-0.05, 0.05])
    else:
        axes.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    axes.margins(0.4 if slim else 0.12, 0.03)


def _draw_curvature(axes: Axes, loop: StationaryLoop, hanging: Catenary, kink: Kink) -> None:
    """Curvature near the lowest point. The axis fits the simulation; the catenary's peak may be a number."""
    reach = 1.6 * max(BOTTOM, abs(kink.dip_at))
    low, high = max(-reach, loop.free[0] - 0.03), min(reach, loop.free[1] + 0.03)
    shown = (loop.s >= low) & (loop.s <= high)
    _draw_lines(axes, "curvature", loop, hanging)
    _mark(axes, kink.dip_at, kink.dip, f"kink: ${kink.dip:.1f}$ m$^{{-1}}$ at ${100 * kink.dip_at:.1f}$ cm", 0)
    least, greatest = float(loop.curvature[shown].min()), float(loop.curvature[shown].max())
    room = greatest - least
    axes.set(xlim=(low, high), ylim=(least - 0.2 * room, greatest + 0.18 * room))
    axes.set_ylabel("curvature $\\kappa$ / m$^{-1}$")
    top = float(hanging.curvature.max())
    if top > greatest + 0.18 * room:
        side: dict[str, Any] = {"xy": (0.0, greatest + 0.16 * room), "xytext": (-8, 0), "textcoords": "offset points"}
        axes.annotate(f"{top:.0f} m$^{{-1}}$", ha="right", va="top", color=GREEN, fontsize="small", **side)
    axes.legend(frameon=False, loc="upper left")


def _draw_tension(axes: Axes, loop: StationaryLoop, hanging: Catenary) -> None:
    """Tension along the free part, less ρ v², which bends the path of the moving chain."""
    inset = IN_LINKS * loop.parameters.link_length
    inside = (loop.s > loop.free[0] + inset) & (loop.s < loop.free[1] - inset)
    _draw_lines(axes, "effective_tension", loop, hanging, inside)
    carried = loop.parameters.density * loop.speed**2
    text = f"$\\rho v^2$ = {carried:.2f} N"
    axes.text(0.5, 0.95, text, transform=axes.transAxes, ha="center", va="top", color=INK)
    axes.set(
        xlim=(loop.free[0] - 0.03, loop.free[1] + 0.03),
        xlabel="arc length $s$ from the lowest point, along the motion / m",
        ylabel="tension $T - \\rho v^2$ / N",
    )
    axes.set_ylim(bottom=min(0.0, 1.1 * float(loop.effective_tension[inside].min())))


def _draw_lines(
    axes: Axes,
    name: Literal["curvature", "effective_tension"],
    loop: StationaryLoop,
    hanging: Catenary,
    shown: Any = slice(None),
) -> None:
    """A function of the arc length of both loops, of the mean loop only where `shown`; the sprocket is shaded."""
    for first, last in ((-loop.length, loop.free[0]), (loop.free[1], loop.length)):
        axes.axvspan(first, last, color=GROUND, linewidth=0.0)
    axes.plot(hanging.s, getattr(hanging, name), label="catenary, as long", **HANGING)
    axes.plot(loop.s[shown], getattr(loop, name)[shown], label="simulation, mean", **SIMULATED)


def _mark(axes: Axes, x: float, y: float, text: str, offset: float) -> None:
    """A small circle with a text `offset` points to the right of it, to the left if negative, below it if 0."""
    axes.plot([x], [y], marker="o", markersize=7.0, markerfacecolor="none", markeredgecolor=INK, zorder=5)
    side, height = ("left" if offset > 0 else "right", "center") if offset else ("center", "top")
    place: dict[str, Any] = {"xytext": (offset, 0 if offset else -8), "textcoords": "offset points"}
    axes.annotate(text, (x, y), color=INK, fontsize="small", ha=side, va=height, **place)
