"""The kink of the loop over a sweep: how sharp it is and where it stands, by links and frequency."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

from warpchain.loop.stationary_loop import Kink, average_loop, find_kink
from warpchain.pictures.walk_figures import LINE_COLORS, _tidy
from warpchain.reports.statistics import NothingToShow
from warpchain.sweeps.recording import Recording

if TYPE_CHECKING:
    from warpchain.store.sweep_result import BlockResult, SweepResult

MARKERS: Final = "os^vDPX"


def sweep_kink(result: "SweepResult") -> tuple[Figure, str]:
    """Curvature and place of the kink against the frequency, a line for each number of links, and what stands below it.

    Raises:
        NothingToShow: the sweep has no walks whose last moments on the sprocket were kept.
    """
    frames = Recording.of(result.sweep.get("record", {})).frames
    if frames is None or frames.before == 0:
        raise NothingToShow("the kink takes walks with frames before their release (record: {frames: {before: 0.5}})")
    kinks: dict[int, dict[float, list[Kink]]] = {}
    for block in result.blocks.values():
        for links, frequency, kink in _kinks(block):
            kinks.setdefault(links, {}).setdefault(frequency, []).append(kink)
    if not kinks:
        raise NothingToShow("no walk that was released from a sprocket has frames of the time before")
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    panels = figure.subplots(1, 3)
    names = {"peak": "greatest curvature / m$^{-1}$", "dip": "curvature of the kink / m$^{-1}$"}
    names["dip_at"] = "kink from the lowest point / cm"
    for axes, (name, label) in zip(panels, names.items(), strict=True):
        scale = 100.0 if name == "dip_at" else 1.0
        for number, (links, cells) in enumerate(sorted(kinks.items())):
            frequencies = sorted(cells)
            means = [scale * np.mean([getattr(kink, name) for kink in cells[key]]) for key in frequencies]
            style = {"color": LINE_COLORS[number % len(LINE_COLORS)], "marker": MARKERS[number % len(MARKERS)]}
            axes.plot(frequencies, means, linewidth=1.2, markersize=4.0, label=f"$n$ = {links}", **style)
        axes.set(xlabel="frequency of the sprocket $ν$ / Hz", ylabel=label)
        axes.grid(color="#E6E6E6", linewidth=0.6)
        axes.set_axisbelow(True)
        _tidy(axes)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
    count = sum(len(found) for cells in kinks.values() for found in cells.values())
    text = f"The kink of the mean loop before the release, {count} walks: greatest curvature near the lowest point, "
    text += "least curvature beside it, negative where the loop bulges, and where that is along the arc, after the "
    text += "lowest point along the motion if positive."
    return figure, text


def _kinks(block: "BlockResult") -> Iterator[tuple[int, float, Kink]]:
    """Links, frequency and kink of every walk of a block that has a mean loop."""
    for place in np.argwhere(block.kept):
        walk = block.walk_motion(tuple(int(index) for index in place))
        if walk.before_release is None:
            continue
        yield walk.setup.scene.links, walk.setup.scene.frequency, find_kink(average_loop(walk))
