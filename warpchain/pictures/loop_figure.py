"""The figure of a stationary loop: its mean shape, curvature and tension."""

from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.loop.stationary_loop import StationaryLoop
from warpchain.pictures.style import BLUE, FAINT, GROUND, INK, tidy
from warpchain.pictures.walk_shape import setting

if TYPE_CHECKING:
    from warpchain.walks.walk_result import WalkResult

SIMULATED: Final[dict[str, Any]] = {"color": BLUE, "linewidth": 2.2}
BOTTOM: Final = 0.25
"""The curvature is shown this far [m] from the lowest point, or as far as the loop is free."""
IN_LINKS: Final = 2.0
"""The tension is shown this many links away from the sprocket: averages near it include links that touch it."""


def draw_loop(walk: "WalkResult", figure: Figure) -> None:
    """The mean loop of a walk before its release, to scale, and its curvature and tension along the arc.

    Raises:
        ValueError: the time before the release was not kept, or is not enough for a mean loop.
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
    _draw_line(bend, "curvature", loop, (loop.s >= low) & (loop.s <= high))
    _mark(bend, kink.dip_at, kink.dip, f"kink: ${kink.dip:.1f}$ m$^{{-1}}$ at ${100 * kink.dip_at:.1f}$ cm")
    bend.set(xlim=(low, high), ylabel="curvature $\\kappa$ / m$^{-1}$")

    inset = IN_LINKS * loop.parameters.link_length
    inside = (loop.s > loop.free[0] + inset) & (loop.s < loop.free[1] - inset)
    _draw_line(pull, "effective_tension", loop, inside)
    carried = loop.parameters.density * loop.speed**2
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


def _draw_line(
    axes: Axes, name: Literal["curvature", "effective_tension"], loop: StationaryLoop, shown: NDArray[np.bool_]
) -> None:
    """A function of the arc length where it is to be shown; the sprocket is shaded."""
    for first, last in ((-loop.length, loop.free[0]), (loop.free[1], loop.length)):
        axes.axvspan(first, last, color=GROUND, linewidth=0.0)
    values = getattr(loop, name)[shown]
    axes.plot(loop.s[shown], values, label="simulation, mean", **SIMULATED)
    room = 0.2 * float(np.ptp(values))
    axes.set_ylim(values.min() - room, values.max() + room)
    tidy(axes, grid="both")


def _mark(axes: Axes, x: float, y: float, text: str) -> None:
    """A small circle with a text to the right of it and below."""
    axes.plot([x], [y], marker="o", markersize=7.0, markerfacecolor="none", markeredgecolor=INK, zorder=5)
    axes.annotate(text, (x, y), (8, -4), textcoords="offset points", va="top", color=INK, fontsize="small")
