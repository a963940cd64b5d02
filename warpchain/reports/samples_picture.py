"""The picture of many samples of one walk: the film strip of the median one, and below it the distances of all."""

import numpy as np
from matplotlib.figure import Figure

from warpchain.pictures.labels import with_error
from warpchain.pictures.style import BLUE, FAINT, INK, tidy
from warpchain.results.sweep_result import SweepResult

_ROOM = 1.7
"""Height of the panel of distances with its labels [inches]."""


def samples_picture(result: SweepResult) -> Figure:
    """The picture of the samples of one cell, some at rest; the median one, of two the upper, is run again."""
    dx, cells = result.dx.ravel(), result.statistics()
    rested = np.sort(dx[np.isfinite(dx)])
    median = result.walk(sample=int(np.flatnonzero(dx == rested[len(rested) // 2])[0]))
    figure = median.plot("film_strip")
    width, height = figure.get_size_inches()
    whole = height + _ROOM
    figure.set_size_inches(width, whole)
    for axes in figure.axes:  # keep their size and their distance from the top
        left, bottom, across, up = axes.get_position().bounds
        axes.set_position((left, (bottom * height + _ROOM) / whole, across, up * height / whole))
    mean, sd, error = cells.mean.item(), cells.sd.item(), cells.standard_error.item()
    below = figure.add_axes((0.09, 0.5 / whole, 0.885, (_ROOM - 0.9) / whole))
    below.axvspan(mean - sd, mean + sd, color=FAINT, alpha=0.25, linewidth=0, label="± standard deviation")
    below.plot(rested, np.zeros(len(rested)), "|", color=BLUE, markersize=16, label="walks")
    below.errorbar(mean, 0.0, xerr=error, fmt="o", color=INK, capsize=4, label="mean ± its error")
    below.set(xlim=(1.05 * min(0.0, rested[0]), 1.05 * max(0.0, rested[-1])), yticks=[], xlabel="Δx / m")
    text = f"Δx of {len(rested)} walks: {with_error(mean, error)} m; above, the median one"
    below.set_title(text, fontsize="medium", loc="left")
    below.legend(frameon=False, fontsize="small", ncols=3, loc="lower left", bbox_to_anchor=(0.0, -0.02))
    tidy(below)
    return figure
