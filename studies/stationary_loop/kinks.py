"""The kink of the loop over a sweep: how sharp it is and where it is, by links and frequency."""

from typing import Final

import numpy as np
from matplotlib.figure import Figure

from studies.common import FREQUENCY, LINE_COLORS, tidy
from warpchain import InputError, SweepResult

MARKERS: Final = "os^vDPX"


def draw_kinks(result: SweepResult) -> Figure:
    """Curvature and place of the kink against the frequency, a line for each number of links.

    Raises:
        InputError: no walk has frames of the time before its release.
    """
    kinks: dict[int, dict[float, list[object]]] = {}
    for block in result.blocks.values():
        for place in np.argwhere(block.kept):
            walk = block.walk_motion(tuple(int(index) for index in place))
            if walk.before_release is not None:
                scene = walk.setup.scene
                kinks.setdefault(scene.links, {}).setdefault(scene.frequency, []).append(walk.mean_loop().kink())
    if not kinks:
        raise InputError(f"{result.name}: no walk has frames before its release; give a folder of the sweep kink")
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, name, label, scale in (
        (panels[0], "peak", "greatest curvature / m$^{-1}$", 1.0),
        (panels[1], "dip", "curvature of the kink / m$^{-1}$", 1.0),
        (panels[2], "dip_at", "kink from the lowest point / cm", 100.0),
    ):
        for number, (links, cells) in enumerate(sorted(kinks.items())):
            frequencies = sorted(cells)
            means = [scale * np.mean([getattr(kink, name) for kink in cells[key]]) for key in frequencies]
            style = {"color": LINE_COLORS[number % len(LINE_COLORS)], "marker": MARKERS[number % len(MARKERS)]}
            axes.plot(frequencies, means, linewidth=1.2, markersize=4.0, label=f"$n$ = {links}", **style)
        axes.set(xlabel=FREQUENCY, ylabel=label)
        tidy(axes, grid="both")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
    return figure
