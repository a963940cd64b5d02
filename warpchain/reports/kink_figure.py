"""The kink of the loop over a sweep: how sharp it is and where it is, by links and frequency."""

from typing import Final

import numpy as np
from matplotlib.figure import Figure

from warpchain.loop.stationary_loop import Kink, average_loop, find_kink
from warpchain.pictures.labels import FREQUENCY
from warpchain.pictures.style import LINE_COLORS, NothingToShow, Picture, tidy
from warpchain.store.sweep_result import SweepResult
from warpchain.sweeps.recording import Recording

MARKERS: Final = "os^vDPX"


def sweep_kink(result: SweepResult) -> Picture:
    """Curvature and place of the kink against the frequency, a line for each number of links.

    Raises:
        NothingToShow: the sweep has no walks whose last moments on the sprocket were kept.
    """
    frames = Recording.of(result.sweep.get("record", {})).frames
    if frames is None or frames.before == 0:
        raise NothingToShow("the kink takes walks with frames before their release (record: {frames: {before: 0.5}})")
    kinks: dict[int, dict[float, list[Kink]]] = {}
    for block in result.blocks.values():
        for place in np.argwhere(block.kept):
            walk = block.walk_motion(tuple(int(index) for index in place))
            if walk.before_release is not None:
                scene, kink = walk.setup.scene, find_kink(average_loop(walk))
                kinks.setdefault(scene.links, {}).setdefault(scene.frequency, []).append(kink)
    if not kinks:
        raise NothingToShow("no walk that was released from a sprocket has frames of the time before")
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
    count = sum(len(found) for cells in kinks.values() for found in cells.values())
    caption = f"The kink of the mean loop before the release, {count} walks: greatest curvature near the lowest point, "
    caption += "least curvature beside it, negative where the loop bulges, and where that is along the arc, after the "
    caption += "lowest point along the motion if positive."
    return Picture("kink", caption, figure)
