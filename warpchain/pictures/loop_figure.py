"""The figure of a stationary loop: its mean shape, curvature and tension, beside theory and the plain catenary."""

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.loop.stationary_loop import Kink, StationaryLoop, average_loop, find_kink
from warpchain.loop.theory import NoSolutionError, TheoreticalLoop, catenary, predict
from warpchain.pictures.walk_figures import FAINT, GROUND, INK, LINE_COLORS, _tidy

if TYPE_CHECKING:
    from warpchain.store.walk_motion import WalkMotion
    from warpchain.walks.walk_result import WalkResult

Array = NDArray[np.float64]

SIMULATED, PREDICTED, HANGING = LINE_COLORS[0], LINE_COLORS[1], LINE_COLORS[2]
"""Colours of simulation, theory and catenary."""
BOTTOM: Final = 0.25
"""The curvature is shown this far [m] from the lowest point, or as far as the loop is free."""
WITHOUT_SCIPY: Final = "without theory: SciPy is not installed"
SLIM: Final = 4.0
"""From so many times as high as wide a loop has little room for numbers below it."""
IN_LINKS: Final = 2.0
"""The tension is shown from this many links inside of the free part: averages mix in what touches the sprocket."""


def loop_figure(walk: "WalkResult | WalkMotion", *, figure: Figure | None = None) -> Figure:
    """The mean loop of a walk before its release, to scale, and its curvature and tension along the arc.

    Args:
        walk: one whose last moments on the sprocket were kept.
        figure: an empty figure to draw into; by default a new one.

    Raises:
        ValueError: nothing was kept of that time, or there is no mean loop in it.
    """
    loop = average_loop(walk)
    theory, note = _theory(loop)
    hanging = _hanging(loop)
    kink = find_kink(loop)
    figure = Figure(figsize=(10.0, 6.4), layout="constrained") if figure is None else figure
    height, width = np.ptp(loop.position[:, 1]), np.ptp(loop.position[:, 0])
    share = float(np.clip(5.6 * (width + 0.08) / (height + 0.08), 2.3, 4.2)) / 10.0
    left, right = np.asarray(figure.subfigures(1, 2, width_ratios=[share, 1 - share]))
    shape = left.subplots()
    bend, pull = right.subplots(2, 1)
    scene = walk.setup.scene
    _draw_shape(shape, walk, loop, theory, hanging, kink)
    spread = 1e3 * float(loop.spread[loop.is_free].max())
    title = f"{scene.links} links, {scene.frequency:g} Hz\njoints within {spread:.2g} mm (s.d.)"
    shape.set_title(title, fontsize="small", loc="left")
    _draw_curvature(bend, loop, theory, hanging, kink, note)
    _draw_tension(pull, loop, theory, hanging)
    for axes in (shape, bend, pull):
        _tidy(axes)
    for axes in (bend, pull):
        axes.grid(color="#E6E6E6", linewidth=0.6)
        axes.set_axisbelow(True)
    return figure


def _theory(loop: StationaryLoop) -> tuple[TheoreticalLoop | None, str]:
    """The theoretical loop, and what the figure says about it."""
    if find_spec("scipy") is None:
        return None, WITHOUT_SCIPY
    try:
        return predict(loop), ""
    except NoSolutionError:
        return None, "without theory: no solution was found"


def _hanging(loop: StationaryLoop) -> TheoreticalLoop | None:
    """The catenary as long as the loop's free part; None if that is too short for one."""
    try:
        return catenary(loop)
    except NoSolutionError:
        return None


def _draw_shape(
    axes: Axes,
    walk: "WalkResult | WalkMotion",
    loop: StationaryLoop,
    theory: TheoreticalLoop | None,
    hanging: TheoreticalLoop | None,
    kink: Kink,
) -> None:
    """The loop to scale, one standard deviation of its joints on either side; the sprocket's centre is the origin."""
    place = loop.position - loop.center
    slim = np.ptp(place[:, 1]) > SLIM * np.ptp(place[:, 0])
    normal = np.stack([np.sin(loop.angle), np.cos(loop.angle)], axis=1)
    closed = np.append(np.arange(len(place)), 0)
    band = loop.spread[:, None] * normal
    outer, inner = (place - band)[closed], (place + band)[closed]
    axes.add_patch(Circle((0.0, 0.0), walk.sprocket_radius, facecolor=GROUND, edgecolor=FAINT, linewidth=0.8))
    axes.fill(*np.concatenate([outer, inner[::-1]]).T, color=SIMULATED, alpha=0.25, linewidth=0.0, zorder=2)
    if hanging is not None:
        axes.plot(*(hanging.position - loop.center).T, color=HANGING, linewidth=1.0, zorder=2.5)
    axes.plot(*place[closed].T, color=SIMULATED, linewidth=2.2, zorder=3)
    if theory is not None:
        dashes: Any = (0, (4, 3))
        axes.plot(*(theory.position - loop.center).T, color=PREDICTED, linewidth=1.3, linestyle=dashes, zorder=4)
    _mark(axes, _at(loop, kink.dip_at, place[:, 0]), _at(loop, kink.dip_at, place[:, 1]), "kink", -8 if slim else 8)
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


def _draw_curvature(
    axes: Axes,
    loop: StationaryLoop,
    theory: TheoreticalLoop | None,
    hanging: TheoreticalLoop | None,
    kink: Kink,
    note: str,
) -> None:
    """Curvature round the lowest point. The catenary's is cut off where it leaves what the others need."""
    reach = 1.6 * max(BOTTOM, abs(kink.dip_at))
    low, high = max(-reach, loop.free[0] - 0.03), min(reach, loop.free[1] + 0.03)
    shown = (loop.s >= low) & (loop.s <= high)
    _mark_sprocket(axes, loop)
    if hanging is not None:
        axes.plot(hanging.s, hanging.curvature, color=HANGING, linewidth=1.2, label="catenary, as long")
    axes.plot(loop.s, loop.curvature, color=SIMULATED, linewidth=2.2, label="simulation, mean")
    if theory is not None:
        dashes: Any = (0, (4, 3))
        axes.plot(theory.s, theory.curvature, color=PREDICTED, linewidth=1.3, linestyle=dashes, label="theory")
    _mark(axes, kink.dip_at, kink.dip, f"kink: ${kink.dip:.1f}$ m$^{{-1}}$ at ${100 * kink.dip_at:.1f}$ cm", 0)
    least, greatest = float(loop.curvature[shown].min()), float(loop.curvature[shown].max())
    room = greatest - least
    axes.set(xlim=(low, high), ylim=(least - 0.2 * room, greatest + 0.18 * room))
    axes.set_ylabel("curvature $\\kappa$ / m$^{-1}$")
    top = 0.0 if hanging is None else float(hanging.curvature.max())
    if top > greatest + 0.18 * room:
        side: dict[str, Any] = {"xy": (0.0, greatest + 0.16 * room), "xytext": (-8, 0), "textcoords": "offset points"}
        axes.annotate(f"{top:.0f} m$^{{-1}}$", ha="right", va="top", color=HANGING, fontsize="small", **side)
    axes.legend(frameon=False, loc="upper left", title=note or None, title_fontsize="small", alignment="left")


def _draw_tension(
    axes: Axes, loop: StationaryLoop, theory: TheoreticalLoop | None, hanging: TheoreticalLoop | None
) -> None:
    """Tension beyond what bends the loop's momentum round, along the free part."""
    inset = IN_LINKS * loop.parameters.link_length
    inside = (loop.s > loop.free[0] + inset) & (loop.s < loop.free[1] - inset)
    _mark_sprocket(axes, loop)
    if hanging is not None:
        axes.plot(hanging.s, hanging.effective_tension, color=HANGING, linewidth=1.2)
    axes.plot(loop.s[inside], loop.effective_tension[inside], color=SIMULATED, linewidth=2.2)
    if theory is not None:
        dashes: Any = (0, (4, 3))
        axes.plot(theory.s, theory.effective_tension, color=PREDICTED, linewidth=1.3, linestyle=dashes)
    carried = loop.parameters.density * loop.speed**2
    text = f"$\\rho v^2$ = {carried:.2f} N"
    axes.text(0.5, 0.95, text, transform=axes.transAxes, ha="center", va="top", color=INK)
    axes.set(
        xlim=(loop.free[0] - 0.03, loop.free[1] + 0.03),
        xlabel="arc length $s$ from the lowest point, along the motion / m",
        ylabel="tension $T - \\rho v^2$ / N",
    )
    axes.set_ylim(bottom=min(0.0, 1.1 * float(loop.effective_tension[inside].min())))


def _mark_sprocket(axes: Axes, loop: StationaryLoop) -> None:
    """Shade where the chain lies on the sprocket."""
    for first, last in ((-loop.length, loop.free[0]), (loop.free[1], loop.length)):
        axes.axvspan(first, last, color=GROUND, linewidth=0.0)


def _mark(axes: Axes, x: float, y: float, text: str, offset: float) -> None:
    """A small open circle with a few words so many points right of it, left of it if negative, below it if 0."""
    axes.plot([x], [y], marker="o", markersize=7.0, markerfacecolor="none", markeredgecolor=INK, zorder=5)
    side, height = ("left" if offset > 0 else "right", "center") if offset else ("center", "top")
    place: dict[str, Any] = {
        "xytext": (offset, 0 if offset else -8),
        "textcoords": "offset points",
        "ha": side,
        "va": height,
    }
    axes.annotate(text, (x, y), color=INK, fontsize="small", **place)


def _at(loop: StationaryLoop, s: float, values: Array) -> float:
    return float(np.interp(s, loop.s, values))
