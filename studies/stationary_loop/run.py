"""Prints the tables of README.md and draws its figures, in a few minutes; that of the kinks from a folder."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from matplotlib.figure import Figure

import warpchain
from studies.common import DASHES, FREQUENCY, GREEN, LINE_COLORS, RED, publish, run_study, tidy
from studies.stationary_loop import theory

FOLDER = Path(__file__).parent
SHOWN = (120, 20.0)
CELLS = ((60, 20.0), (120, 20.0), (120, 10.0), (180, 30.0), (60, 30.0))
OTHERS = {
    "half of the inertia": {"inner_inertia": 8.45e-8, "outer_inertia": 6.46e-8},
    "a tenth of the inertia": {"inner_inertia": 1.69e-8, "outer_inertia": 1.292e-8},
    "three times the inertia": {"inner_inertia": 5.07e-7, "outer_inertia": 3.876e-7},
    "a third of the viscous friction": {"viscous_friction": 3e-5},
    "hardly any Coulomb friction": {"coulomb_friction": 1e-6},
}
"""Changes of the chain whose loop is shown."""
LESS = {"theory": (), "without Coulomb": ("coulomb_friction",), "without friction": ("viscous_friction",)}
"""Frictions that theories leave out, one after the other."""
UNDAMPED = {"load_factor": 1.0, "steady_time": 0.0, "steady_tolerance": 1.0, "further_hold": 40.0}


def held(links: int, frequency: float, values: Mapping[str, float]) -> warpchain.WalkResult:
    """A walk of Table 1's chain with softened joints, whose last half second on the sprocket is kept."""
    settings = {"further_hold": 0.5, "hold_limit": 60.0, "walk_limit": 1e-3} | dict(values)
    return warpchain.walk(links=links, frequency=frequency, preset="soft", start="spinning", **settings)


def compare(name: str, ours: Any, theirs: Any) -> None:
    """Prints how far two mean loops are apart."""
    middle = np.abs(ours.s) < 0.45 * (ours.free[1] - ours.free[0])
    s = ours.s[middle]
    apart = np.hypot(*(ours.position[middle] - theory.places(theirs, s)).T)
    tension = ours.effective_tension[middle] - np.interp(s, theirs.s, theirs.effective_tension)
    curvature = ours.curvature[middle] - np.interp(s, theirs.s, theirs.curvature)
    width, height = np.ptp(ours.position, axis=0) / np.ptp(theirs.position, axis=0) - 1
    print(
        f"{name}: held under multiplied loads against 40 s under its own: height {100 * height:+.2f} %, "
        f"width {100 * width:+.2f} %, places {1e3 * theory.rms(apart):.2f} mm rms, curvature "
        f"{theory.rms(curvature):.2f} of {theirs.curvature.max():.1f} 1/m, tension "
        f"{theory.rms(tension):.4f} of {theirs.effective_tension.max():.2f} N"
    )


def row(name: str, bottom: float, kink: Sequence[float], rest: str) -> None:
    """Prints curvatures of a loop: at the lowest point, the greatest and the least with their places."""
    peak, peak_at, dip, dip_at = kink
    print(
        f"  {name:22} bottom {bottom:6.2f} 1/m, greatest {peak:6.2f} at {100 * peak_at:5.1f} cm, "
        f"least {dip:6.2f} at {100 * dip_at:5.1f} cm; {rest}"
    )


def show_theory(name: str, loop: Any, found: theory.TheoreticalLoop) -> None:
    """Prints bottom curvature, peak and dip of a predicted curve, and how far it is from the simulated one."""
    near = np.abs(found.s) < 0.35 * (loop.free[1] - loop.free[0])
    peak = int(np.argmax(np.where(near, found.curvature, -np.inf)))
    dip = int(np.argmin(np.where(near, found.curvature, np.inf)))
    curve = theory.places(loop, np.linspace(loop.s[0], loop.s[-1], 20_000))
    apart = np.array([np.hypot(*(curve - point).T).min() for point in found.position])
    tension = found.effective_tension - np.interp(found.s, loop.s, loop.effective_tension)
    kink = found.curvature[peak], found.s[peak], found.curvature[dip], found.s[dip]
    distances = f"shape {1e3 * theory.rms(apart):.2f} mm rms, {1e3 * apart.max():.2f} at most"
    row(name, np.interp(0, found.s, found.curvature), kink, f"{distances}; tension {theory.rms(tension):.4f} N rms")


def show(name: str, walk: warpchain.WalkResult) -> None:
    """Prints what is known of one loop."""
    if walk.before_release is None:
        print(f"{name}: {walk.status.label}")
        return
    loop, chain = walk.mean_loop(), {}
    print(f"{name}: v = {loop.speed:.3f} m/s, held for {walk.hold_time:.2f} s, drift {100 * walk.drift:.2f} %")
    row("simulation", loop.bottom_curvature, loop.kink(), f"joints within {1e3 * loop.spread.max():.3f} mm")
    for which, less in LESS.items():
        chain |= {name: 0.0 for name in less}
        try:
            show_theory(which, loop, theory.predict(loop, chain))
        except ArithmeticError as error:
            print(f"  {which:22} {error}")
    show_theory("catenary", loop, theory.catenary_of(loop))
    balances = theory.imbalances(loop).items()
    texts = (f"{key} {100 * mean:.1f} % ({100 * greatest:.1f} %)" for key, (mean, greatest) in balances)
    print("  balances, rms (greatest):", ", ".join(texts))


def draw(walk: warpchain.WalkResult) -> Figure:
    """The figure of a walk's loop with theory and a catenary in it."""
    figure, loop = walk.plot("loop"), walk.mean_loop()
    shape, bend, pull = figure.axes
    for name, curve, style in (
        ("theory", theory.predict(loop), {"color": RED, "linewidth": 1.3, "linestyle": DASHES, "zorder": 4}),
        ("catenary, as long", theory.catenary_of(loop), {"color": GREEN, "linewidth": 1.2}),
    ):
        shape.plot(*(curve.position - loop.center).T, **style)
        bend.plot(curve.s, curve.curvature, label=name, **style)
        pull.plot(curve.s, curve.effective_tension, **style)
    bend.legend(frameon=False, loc="upper left")
    return figure


def draw_kinks(result: warpchain.SweepResult) -> Figure:
    """Curvature and place of the kink against the frequency, a line for each number of links."""
    kinks: dict[int, dict[float, list[Any]]] = {}
    for block in result.blocks.values():
        for place in np.argwhere(block.kept).tolist():
            walk = block.walk_motion(tuple(place))
            if walk.before_release is not None:
                scene = walk.setup.scene
                kinks.setdefault(scene.links, {}).setdefault(scene.frequency, []).append(walk.mean_loop().kink())
    if not kinks:
        raise warpchain.InputError(f"{result.name}: no frames before a release; give a folder of the sweep kink")
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, name, label, scale in (
        (panels[0], "peak", "greatest curvature / m$^{-1}$", 1.0),
        (panels[1], "dip", "curvature of the kink / m$^{-1}$", 1.0),
        (panels[2], "dip_at", "kink from the lowest point / cm", 100.0),
    ):
        for (links, cells), color, marker in zip(sorted(kinks.items()), LINE_COLORS, "os^vDPX", strict=False):
            means = [scale * np.mean([getattr(kink, name) for kink in cells[key]]) for key in sorted(cells)]
            style = {"color": color, "marker": marker, "linewidth": 1.2, "markersize": 4.0}
            axes.plot(sorted(cells), means, label=f"$n$ = {links}", **style)
        tidy(axes, grid="both", xlabel=FREQUENCY, ylabel=label)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
    return figure


def main(kinks: Annotated[str | None, typer.Argument()] = None) -> None:
    """Print all tables and draw the figures."""
    if kinks is not None:
        publish(FOLDER, {}, {"kink": draw_kinks(warpchain.load(kinks))}, dpi=100)
    for links, frequency in CELLS:
        title, walk = f"{links} links, {frequency:g} Hz", held(links, frequency, {})
        show(title, walk)
        compare(title, walk.mean_loop(), held(links, frequency, UNDAMPED).mean_loop())
        if (links, frequency) == SHOWN:
            publish(FOLDER, {}, {"loop": draw(walk)}, dpi=100)
    for text, values in OTHERS.items():
        show(f"{SHOWN[0]} links, {SHOWN[1]:g} Hz, {text}", held(*SHOWN, values))


if __name__ == "__main__":
    run_study(main)
