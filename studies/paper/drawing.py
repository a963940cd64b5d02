"""Figures of the page."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from studies.common import BLUE, DASHES, DISTANCE, FAINT, FREQUENCY, GREEN, INK, LINE_COLORS, RED, tidy
from studies.paper.findings import changes
from studies.paper.impacts import impacts
from studies.paper.statistics import summary
from warpchain import Parameters, SweepResult

Numbers = Mapping[str, Any]

PALE: Final = "#BBBBBB"
"""Dots of cells in which nothing is significant."""

REACH: Final = 1.0
"""Greatest relative effect on the axis of the figure; greater ones stand at its edge."""

_CONTACT: Final = ("before the 1st bounce", "after the 1st", "after the 2nd", "after the 3rd", "later", "never")
_SHADES: Final = LinearSegmentedColormap.from_list("contact", ["#053061", "#4393C3", "#D55E00", "#F4A582", "#E3E3E3"])
_OUTLINES: Final = (60, 120, 180)
"""Numbers of links whose outlines are drawn."""
_OUTLINE_FREQUENCIES: Final = (10.0, 20.0, 30.0)


def figures(numbers: Numbers, sweeps: Mapping[str, SweepResult]) -> Iterator[tuple[str, Figure]]:
    """Name and figure, each in turn; outlines of loops only if the sweep that has them is given."""
    yield "distances", distances(numbers)
    yield "effects", effects(numbers)
    yield "friction", friction(numbers)
    yield "strands", strands(numbers)
    if "paper_shapes" in sweeps:
        yield "impacts", outlines(sweeps["paper_shapes"])


def distances(numbers: Numbers) -> Figure:
    """Figure 6 with both starts at all lengths: means, boxes of one and bars of two standard deviations."""
    content = numbers["paper_claims"]
    links, frequencies = content["cells"]["links"], content["cells"]["frequency"]
    figure = Figure(figsize=(10, 3.1), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(links), sharey=True))
    for place, axes in enumerate(panels):
        for start, color, shift in (("rest", RED, -0.7), ("ellipse", GREEN, 0.7)):
            mean, sd = (np.array(content["starts"][start][name][place], np.float64) for name in ("mean", "sd"))
            x = np.array(frequencies) + shift
            axes.vlines(x, mean - 2 * sd, mean + 2 * sd, color=color, linewidth=1)
            axes.bar(x, 2 * sd, 1.2, mean - sd, color=color, alpha=0.3, linewidth=0)
            axes.plot(x, mean, ".", color=color, label=f"started {'at rest' if start == 'rest' else 'as an ellipse'}")
        axes.set_title(f"$n$ = {links[place]}", fontsize="medium", loc="left")
        axes.set_xticks(frequencies, [f"{each:g}" for each in frequencies])
        tidy(axes, grid="y")
    panels[-1].legend(frameon=False, fontsize="small", loc="upper left")
    panels[0].set_ylim(bottom=0)
    figure.supxlabel(f"{FREQUENCY}; boxes: one standard deviation of a walk, bars: two", fontsize="medium")
    panels[0].set_ylabel(DISTANCE)
    return figure


def effects(numbers: Numbers) -> Figure:
    """What each value of each quantity does to Δx: a dot for every cell, the mean over the cells with its interval."""
    names = [
        name
        for sweep in ("paper_claims", "paper_joints")
        for name in numbers[sweep]["effects"]
        if name not in ("start", "tolerance")
    ]
    lines = {name: len(changes(numbers, name)) + 0.5 for name in names}
    half = next(place for place in range(len(names)) if sum(lines[name] for name in names[: place + 1]) > _half(lines))
    columns = (names[: half + 1], names[half + 1 :])
    longest = max(sum(lines[name] for name in column) for column in columns)
    figure = Figure(figsize=(10, 0.9 + 0.21 * longest), layout="constrained")
    for axes, column in zip(figure.subplots(1, 2), columns, strict=True):
        _draw_effects(axes, numbers, column)
        axes.set_ylim(longest - 0.25, -0.75)
    for text, color in (("rises", BLUE), ("falls", RED), ("neither at 95 %", PALE)):
        axes.plot([], [], ".", color=color, label=text)
    axes.legend(frameon=False, fontsize="x-small", loc="lower right", title="a cell", title_fontsize="x-small")
    figure.supxlabel("change of the mean distance walked against Table 1's value", fontsize="medium")
    return figure


def symbol_of(name: str) -> str:
    r"""The paper's symbol of a quantity, as ``$μ_\mathrm{fc}$``; the name of what is not in Table 1."""
    if name not in Parameters.model_fields:
        return name
    base, _, index = Parameters.quantities()[name].symbol.partition("_")
    return f"${base}" + (f"_\\mathrm{{{index}}}$" if index else "$")


def number_text(value: float) -> str:
    """A number in its shortest form, 1e-6 and not 1e-06."""
    return re.sub(r"e\+?(-?)0*(?=\d)", r"e\1", f"{value:.6g}")


def _half(lines: Mapping[str, float]) -> float:
    """Half of the height of all lines."""
    return sum(lines.values()) / 2 - 1.5


def _draw_effects(axes: Axes, numbers: Numbers, names: Sequence[str]) -> None:
    """The effects of some quantities, one line for each value."""
    rng = np.random.default_rng(0)
    y, places, texts = 0.0, [], []
    for number, name in enumerate(names):
        top = y - 0.5
        for value, effect in changes(numbers, name):
            found, sign = summary(effect), effect.sign[effect.known]
            relative = np.clip(effect.relative[effect.known], -REACH, REACH)
            height = y + rng.uniform(-0.25, 0.25, len(relative))
            for chosen, color in ((sign == 0, PALE), (sign > 0, BLUE), (sign < 0, RED)):
                axes.plot(relative[chosen], height[chosen], ".", color=color, markersize=4, alpha=0.6, linewidth=0)
            if found.cells:
                mean = float(np.clip(found.mean, -REACH, REACH))
                axes.errorbar(mean, y, xerr=found.half_width, fmt="|", color=INK, markersize=9)
            places.append(y)
            texts.append(f"{symbol_of(name)} = {number_text(value)}")
            y += 1.0
        if number % 2:
            axes.axhspan(top, y - 0.5, color="#F4F4F4", zorder=-2)
        y += 0.5
    axes.axvline(0, color=FAINT, linewidth=0.8, linestyle=DASHES, zorder=-1)
    axes.set_yticks(places, texts, fontsize="x-small")
    axes.set_xlim(-1.03 * REACH, 1.03 * REACH)
    axes.set_xticks(np.arange(-1.0, 1.01, 0.25))
    axes.tick_params(axis="x", labelsize="x-small")
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, 0))
    tidy(axes, grid="x")


def friction(numbers: Numbers) -> Figure:
    """Distance walked against the friction of the floor, over that at the paper's value."""
    content = numbers["paper_claims"]
    found, cells = content["friction"], content["cells"]
    values, mean = np.array(found["values"]), np.array(found["mean"], np.float64)
    reference = content["effects"]["floor_friction"]["reference"]
    ratio = mean / mean[:, :, [found["values"].index(reference)]]
    figure = Figure(figsize=(10, 3.1), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(cells["links"]), sharey=True))
    for place, axes in enumerate(panels):
        for number, frequency in enumerate(cells["frequency"]):
            color = LINE_COLORS[number % len(LINE_COLORS)]
            axes.plot(values, ratio[place, number], ".-", color=color, linewidth=1, label=f"{frequency:g} Hz")
        axes.axvline(reference, color=FAINT, linestyle=DASHES, linewidth=0.8)
        axes.set_title(f"$n$ = {cells['links'][place]}", fontsize="medium", loc="left")
        tidy(axes, grid="y")
    panels[-1].legend(frameon=False, fontsize="x-small")
    panels[0].set_ylabel("Δx over that at Table 1's friction")
    figure.supxlabel(f"friction of the floor {symbol_of('floor_friction')}", fontsize="medium")
    return figure


def strands(numbers: Numbers) -> Figure:
    """Shares of walks by the bounce after which strands of the loop first meet."""
    content = numbers["paper_strands"]
    links = content["cells"]["links"]
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, start, title in zip(panels, ("rest", "ellipse"), ("from rest", "as an ellipse"), strict=True):
        counts = np.array([each["strands"] for each in content["strands"]["starts"][start]], np.float64)
        shares = counts / counts.sum(axis=1, keepdims=True)
        bottom = np.zeros(len(links))
        for number, label in enumerate(_CONTACT):
            color = _SHADES(number / (len(_CONTACT) - 1))
            axes.bar(range(len(links)), shares[:, number], 0.75, bottom, color=color, label=label)
            bottom += shares[:, number]
        axes.set_xticks(range(len(links)), [str(each) for each in links])
        axes.set_title(title, fontsize="medium", loc="left")
        axes.set_xlabel("number of links $n$")
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, 0))
        tidy(axes)
    panels[0].set_ylabel("walks whose strands first meet")
    handles, labels = panels[1].get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], frameon=False, fontsize="small", loc="outside right center")
    return figure


def outlines(result: SweepResult) -> Figure:
    """Loops just before their first impact, and when they have left the floor again, about their centroids."""
    block = result.blocks["main"]
    found, _ = impacts(block)
    rows = [place for place, links in enumerate(block.axes["links"].tolist()) if links in _OUTLINES]
    columns = [place for place, each in enumerate(block.axes["frequency"].tolist()) if each in _OUTLINE_FREQUENCIES]
    figure = Figure(figsize=(2.1 * max(1, len(columns)), 2.3 * max(1, len(rows))), layout="constrained")
    grid = figure.subplots(max(1, len(rows)), max(1, len(columns)), squeeze=False)
    for line, row in zip(grid, rows, strict=False):
        for axes, column in zip(line, columns, strict=False):
            axes.set_aspect("equal")
            axes.set_axis_off()
            axes.set_title(
                f"{block.axes['links'][row]} links, {block.axes['frequency'][column]:g} Hz",
                fontsize="small",
                loc="left",
            )
            if (row, column) not in found:
                axes.text(0.5, 0.5, "does not\nrise again", ha="center", va="center", transform=axes.transAxes)
            else:
                impact = found[row, column][0]
                for outline, color, style, label in (
                    (impact.before, FAINT, "-", "before"),
                    (impact.after, BLUE, "-", "after"),
                ):
                    closed = np.vstack([outline, outline[:1]])
                    axes.plot(*(100 * closed.T), style, color=color, linewidth=1.3, label=label)
    handles = [part for axes in grid.flat for part in axes.get_lines()][:2]
    if handles:
        figure.legend(handles=handles, frameon=False, fontsize="small", loc="outside lower center", ncols=2)
    return figure
