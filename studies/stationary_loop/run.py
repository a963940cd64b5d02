"""Makes the tables of README.md but those of starts, and its figures, in minutes; that of kinks from a folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from matplotlib.figure import Figure

import warpchain
from studies.common import (
    DASHES,
    FREQUENCY,
    GREEN,
    LINE_COLORS,
    RED,
    minus,
    publish,
    run_study,
    show,
    table,
    tidy,
    write_rows,
)
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
UNDAMPED = {"load_factor": 1.0, "steady_time": 0.0, "steady_tolerance": 1.0, "extra_hold": 40.0}


def held(links: int, frequency: float, values: Mapping[str, float]) -> warpchain.WalkResult:
    """A walk of Table 1's chain with softened joints, whose last half second on the sprocket is kept."""
    settings = {"extra_hold": 0.5, "hold_limit": 60.0, "walk_limit": 1e-3} | dict(values)
    return warpchain.walk(links=links, frequency=frequency, preset="soft", start="spinning", **settings)


def shape_row(title: str, loop: Any) -> tuple[str, ...]:
    """Curvature at the bottom and in the kink [1/m] in simulation and theory; how far theory and a catenary are off."""
    kink, curve = loop.kink(), theory.places(loop, np.linspace(loop.s[0], loop.s[-1], 20_000))
    predicted, catenary = theory.predict(loop), theory.catenary_of(loop)
    near = np.abs(predicted.s) < 0.35 * (loop.free[1] - loop.free[0])
    s, curvature = predicted.s[near], predicted.curvature[near]
    dip = int(np.argmin(curvature))
    apart = [
        1e3 * np.array([np.hypot(*(curve - point).T).min() for point in found.position])
        for found in (predicted, catenary)
    ]
    bottoms = [loop.bottom_curvature, *(np.interp(0, found.s, found.curvature) for found in (predicted, catenary))]
    kinks = [
        f"{value:.1f} at {100 * place:.1f}" for value, place in ((kink.dip, kink.dip_at), (curvature[dip], s[dip]))
    ]
    off = ", ".join(f"{theory.rms(each):.2f}" for each in apart)
    return title, ", ".join(f"{value:.1f}" for value in bottoms), *kinks, off


def same_row(title: str, ours: Any, theirs: Any) -> tuple[str, ...]:
    """How far two mean loops are apart: height and width, places, curvature, tension."""
    s = ours.s[np.abs(ours.s) < 0.45 * (ours.free[1] - ours.free[0])]
    apart = 1e3 * np.hypot(*(theory.places(ours, s) - theory.places(theirs, s)).T)
    width, height = 100 * (np.ptp(ours.position, axis=0) / np.ptp(theirs.position, axis=0) - 1)
    tension, curvature = (
        np.interp(s, ours.s, getattr(ours, name)) - np.interp(s, theirs.s, getattr(theirs, name))
        for name in ("effective_tension", "curvature")
    )
    bend = f"{theory.rms(curvature):.2f} ({theirs.curvature.max():.1f})"
    pull = f"{theory.rms(tension):.3f} ({theirs.effective_tension.max():.1f})"
    return title, f"{height:.2f}", f"{width:.2f}", f"{theory.rms(apart):.2f}", bend, pull


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
        raise warpchain.InputError(f"{result.name}: no frames before a release; use a folder of the sweep kink")
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
    """Write all tables and draw the figures."""
    if kinks is not None:
        publish(FOLDER, {}, {"kink": draw_kinks(warpchain.load(kinks))}, dpi=100)
    chains = {f"{links}, {frequency:g}": ((links, frequency), {}) for links, frequency in CELLS}
    shapes, balances, same = [], [], []
    for title, (cell, values) in {**chains, **{text: (SHOWN, values) for text, values in OTHERS.items()}}.items():
        walk = held(*cell, values)
        loop = walk.mean_loop()
        shapes.append(shape_row(title, loop))
        balances.append((title, *(f"{100 * error:.1f} %" for error, _ in theory.imbalances(loop).values())))
        if not values:
            same.append(same_row(title, loop, held(*cell, UNDAMPED).mean_loop()))
            if cell == SHOWN:
                figure = draw(walk)
    shape_head = "links, Hz | bottom: simulation, theory, catenary | kink | kink in theory | off: theory, catenary / mm"
    printed = {
        "balances": table("links, Hz | force | normal force | moment | friction", balances),
        "same loop": table("links, Hz | height / % | width / % | position / mm | curvature / (1/m) | T_e / N", same),
    }
    show({name: minus(text) for name, text in printed.items()})
    names = ("chain", "bottom: simulation, theory, catenary", "kink", "kink in theory", "off: theory, catenary")
    write_rows(FOLDER / "results" / "shapes.csv", (dict(zip(names, row, strict=True)) for row in shapes))
    publish(FOLDER, {"shapes": minus(table(shape_head, shapes))}, {"loop": figure}, dpi=100)


if __name__ == "__main__":
    run_study(main)
