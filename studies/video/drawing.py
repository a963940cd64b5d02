"""Figures of the study of videos."""

from collections.abc import Mapping
from statistics import NormalDist

import numpy as np
from matplotlib.figure import Figure

from studies.common import BLUE, DASHES, FAINT, LINE_COLORS, RED, tidy
from studies.video.calibration import Calibration
from warpchain import video

SYMBOLS = {
    "floor_friction": "μ",
    "viscous_friction": "β",
    "coulomb_friction": "τ_c",
    "sprocket_radius": "R",
    "circle_radius": "r",
    "floor_restitution": "e_fc",
}
"""Of parameters that a posterior may have."""


def _unit(value: float) -> tuple[float, str]:
    """A power of ten that leaves one digit before the point, and its text; none for numbers about 1."""
    power = int(np.floor(np.log10(value)))
    return (1.0, "") if power >= -1 else (10.0**power, f" / $10^{{{power}}}$")


def corner(answer: video.Posterior) -> Figure:
    """Ellipses of 68 and 95 % for each pair of parameters, and the Gaussians on the diagonal."""
    count, mean, sigma = len(answer.names), answer.mean, answer.sigma
    figure = Figure(figsize=(1.5 * count, 1.5 * count), layout="constrained")
    panels = figure.subplots(count, count, squeeze=False)
    turn = np.linspace(0, 2 * np.pi, 100)
    for row, column in np.ndindex(count, count):
        panel = panels[row, column]
        if column > row:
            panel.set_axis_off()
            continue
        (unit, across), (other, up) = _unit(mean[column]), _unit(mean[row])
        values = mean[column] + sigma[column] * np.linspace(-3, 3, 100)
        if row == column:
            panel.plot(values / unit, np.exp(-(((values - mean[column]) / sigma[column]) ** 2) / 2), color=BLUE)
            panel.set_yticks([])
        else:
            pair = [column, row]
            root = np.linalg.cholesky(answer.covariance[np.ix_(pair, pair)])
            for size in (1.515, 2.448):  # within these, 68 and 95 % of a Gaussian in two dimensions
                x, y = mean[pair, None] + size * root @ np.array([np.cos(turn), np.sin(turn)])
                panel.plot(x / unit, y / other, color=BLUE, linewidth=1)
            panel.set_ylim((mean[row] - 3 * sigma[row]) / other, (mean[row] + 3 * sigma[row]) / other)
        panel.set_xlim(values[0] / unit, values[-1] / unit)
        below = f"{SYMBOLS[answer.names[column]]}{across}" if row == count - 1 else ""
        beside = f"{SYMBOLS[answer.names[row]]}{up}" if column == 0 and row else ""
        panel.locator_params(axis="x", nbins=3)
        panel.tick_params(labelsize="x-small", labelleft=column == 0 and row > 0, labelbottom=row == count - 1)
        tidy(panel, xlabel=below, ylabel=beside)
    return figure


def line_figure(line: video.FrictionLine) -> Figure:
    """Displacement against height gain, with the friction line; crosses were not fitted."""
    figure, used = Figure(figsize=(5.2, 3.4), layout="constrained"), line.time <= line.end
    axes = figure.subplots()
    for chosen, style in ((used, "o"), (~used, "x")):
        axes.plot(1e3 * line.height_gain[chosen], 1e3 * line.displacement[chosen], style, color=BLUE, markersize=3.5)
    ends = 1e3 * np.array([0, line.height_gain[used].max()])
    axes.plot(ends, line.friction * ends, color=RED, label=f"$μ$ = {line.friction:.4f} ± {line.error:.4f}")
    axes.legend(frameon=False)
    tidy(axes, grid="both", xlabel="height gain $y - y_0 + g t^2/2$ / mm", ylabel="displacement $x - x_0$ / mm")
    return figure


def coverage_figure(found: Mapping[str, Calibration]) -> Figure:
    """Share of hidden chains within a number of standard deviations, against that of a Gaussian."""
    figure = Figure(figsize=(9.2, 3.4), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(found), sharey=True))
    sizes = np.linspace(0, 3, 61)
    expected = np.array([2 * NormalDist().cdf(size) - 1 for size in sizes])
    for panel, (name, each) in zip(panels, found.items(), strict=True):
        panel.plot(100 * expected, 100 * expected, color=FAINT, linestyle=DASHES, linewidth=1)
        for k, parameter in enumerate(each.names):
            inside = [100 * each.coverage(size)[k] for size in sizes]
            panel.plot(100 * expected, inside, color=LINE_COLORS[k], linewidth=1.2, label=SYMBOLS[parameter])
        tidy(panel, name, grid="both", xlabel="interval / %")
    panels[0].set_ylabel("hidden chains inside / %")
    panels[-1].legend(frameon=False, fontsize="small", loc="lower right")
    return figure
