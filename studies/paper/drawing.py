"""Figures of the page."""

import re
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from studies.common import BLUE, DASHES, DISTANCE, FAINT, FREQUENCY, GREEN, INK, LINE_COLORS, RED, tidy
from studies.paper import findings
from studies.paper.findings import Numbers
from studies.paper.impacts import impacts
from studies.paper.statistics import Effect
from warpchain import Parameters, SweepResult

PALE = "#BBBBBB"  # Dots of cells in which nothing is significant
REACH = 1.0  # Greatest relative effect on the axis of the figure; greater ones stand at its edge
_CONTACT = ("before the 1st bounce", "after the 1st", "after the 2nd", "after the 3rd", "later", "never")
_SHADES = LinearSegmentedColormap.from_list("contact", ["#053061", "#4393C3", "#D55E00", "#F4A582", "#E3E3E3"])


def figures(numbers: Numbers, sweeps: Mapping[str, SweepResult]) -> dict[str, Figure]:
    """All figures by name; outlines of loops only if the sweep that has them is given."""
    found = {draw.__name__: draw(numbers) for draw in (distances, effects, friction, strands)}
    if "paper_shapes" in sweeps:
        found["impacts"] = outlines(sweeps["paper_shapes"])
    return found


def panels_of_links(numbers: Numbers, x: str, y: str) -> tuple[Figure, Any]:
    """A figure with a panel for each number of links."""
    links = numbers["paper_claims"]["cells"]["links"]
    figure = Figure(figsize=(10, 3.1), layout="constrained")
    panels = figure.subplots(1, len(links), sharey=True)
    for axes, each in zip(panels, links, strict=True):
        tidy(axes, f"$n$ = {each}", grid="y")
    figure.supxlabel(x, fontsize="medium")
    panels[0].set_ylabel(y)
    return figure, panels


def distances(numbers: Numbers) -> Figure:
    """Figure 6 with both starts at all lengths: means, boxes of one and bars of two standard deviations."""
    frequencies = numbers["paper_claims"]["cells"]["frequency"]
    x = f"{FREQUENCY}; boxes: one standard deviation of a walk, bars: two"
    figure, panels = panels_of_links(numbers, x, DISTANCE)
    for start, color, shift, label in (("rest", RED, -0.7, "at rest"), ("ellipse", GREEN, 0.7, "as an ellipse")):
        x = np.array(frequencies) + shift
        tables = (findings.of_start(numbers, start, name) for name in ("mean", "sd"))
        for axes, mean, sd in zip(panels, *tables, strict=True):
            axes.vlines(x, mean - 2 * sd, mean + 2 * sd, color=color, linewidth=1)
            axes.bar(x, 2 * sd, 1.2, mean - sd, color=color, alpha=0.3, linewidth=0)
            axes.plot(x, mean, ".", color=color, label=f"started {label}")
            axes.set_xticks(frequencies, [f"{each:g}" for each in frequencies])
    panels[-1].legend(frameon=False, fontsize="small", loc="upper left")
    panels[0].set_ylim(bottom=0)
    return figure


def effects(numbers: Numbers) -> Figure:
    """What each value of each quantity does to Δx: a dot for every cell, the mean over the cells with its interval."""
    known = {name: found["values"] for name, found in findings.effects(numbers).items() if name != "start"}
    names, heights = list(known), np.cumsum([len(found) + 0.5 for found in known.values()])
    half = int(np.argmax(heights > heights[-1] / 2 - 1.5))
    columns, longest = (names[: half + 1], names[half + 1 :]), max(heights[half], heights[-1] - heights[half])
    figure = Figure(figsize=(10, 0.9 + 0.21 * longest), layout="constrained")
    for axes, column in zip(figure.subplots(1, 2), columns, strict=True):
        _draw_effects(axes, {name: known[name] for name in column})
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


def _draw_effects(axes: Axes, known: Mapping[str, Sequence[Effect]]) -> None:
    """The effects of some quantities, one line for each value."""
    rng = np.random.default_rng(0)
    y, places, texts = 0.0, [], []
    for number, (name, found) in enumerate(known.items()):
        top = y - 0.5
        for effect in found:
            sign = effect.sign[effect.known]
            relative = np.clip(effect.relative[effect.known], -REACH, REACH)
            height = y + rng.uniform(-0.25, 0.25, len(relative))
            for chosen, color in ((sign == 0, PALE), (sign > 0, BLUE), (sign < 0, RED)):
                axes.plot(relative[chosen], height[chosen], ".", color=color, markersize=4, alpha=0.6, linewidth=0)
            mean = float(np.clip(effect.cells.mean, -REACH, REACH))
            axes.errorbar(mean, y, xerr=1.96 * effect.cells.error, fmt="|", color=INK, markersize=9)
            places.append(y)
            shortest = re.sub(r"e\+?(-?)0*(?=\d)", r"e\1", f"{effect.notes['value']:.6g}")  # 1e-6 and not 1e-06
            texts.append(f"{symbol_of(name)} = {shortest}")
            y += 1.0
        if number % 2:
            axes.axhspan(top, y - 0.5, color="#F4F4F4", zorder=-2)
        y += 0.5
    axes.axvline(0, color=FAINT, linewidth=0.8, linestyle=DASHES, zorder=-1)
    axes.set_yticks(places, texts, fontsize="x-small")
    axes.tick_params(axis="x", labelsize="x-small")
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, 0))
    tidy(axes, grid="x", xlim=(-1.03 * REACH, 1.03 * REACH), xticks=np.arange(-1.0, 1.01, 0.25))


def friction(numbers: Numbers) -> Figure:
    """Distance walked against the friction of the floor, over that at the paper's value."""
    content = numbers["paper_claims"]
    found, frequencies = content["friction"], content["cells"]["frequency"]
    reference = content["effects"]["floor_friction"]["reference"]
    x, y = f"friction of the floor {symbol_of('floor_friction')}", "Δx over that at Table 1's friction"
    figure, panels = panels_of_links(numbers, x, y)
    for axes, of_links in zip(panels, found["mean"], strict=True):
        for frequency, color, line in zip(frequencies, LINE_COLORS, of_links, strict=False):
            ratio = line / line[found["values"].index(reference)]
            axes.plot(found["values"], ratio, ".-", color=color, linewidth=1, label=f"{frequency:g} Hz")
        axes.axvline(reference, color=FAINT, linestyle=DASHES, linewidth=0.8)
    panels[-1].legend(frameon=False, fontsize="x-small")
    return figure


def strands(numbers: Numbers) -> Figure:
    """Shares of walks by the bounce after which strands of the loop first meet."""
    content = numbers["paper_strands"]
    links = content["cells"]["links"]
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, start, title in zip(panels, ("rest", "ellipse"), ("from rest", "as an ellipse"), strict=True):
        counts = np.array([each["strands"] for each in content["strands"]["starts"][start]], float)
        shares = counts / counts.sum(axis=1, keepdims=True)
        bottom = np.cumsum(shares, axis=1) - shares
        for number, label in enumerate(_CONTACT):
            color = _SHADES(number / (len(_CONTACT) - 1))
            axes.bar(range(len(links)), shares[:, number], 0.75, bottom[:, number], color=color, label=label)
        axes.set_xticks(range(len(links)), [str(each) for each in links])
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, 0))
        tidy(axes, title, xlabel="number of links $n$")
    panels[0].set_ylabel("walks whose strands first meet")
    handles, labels = panels[1].get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], frameon=False, fontsize="small", loc="outside right center")
    return figure


def outlines(result: SweepResult) -> Figure:
    """Loops just before their first impact, and when they have left the floor again, about their centroids."""
    block = result.blocks["main"]
    links, frequencies = (block.axes[name].tolist() for name in ("links", "frequency"))
    found, _ = impacts(block)
    figure = Figure(figsize=(6.3, 6.9), layout="constrained")
    for axes, (n, frequency) in zip(figure.subplots(3, 3).flat, product((60, 120, 180), (10, 20, 30)), strict=True):
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(f"{n} links, {frequency:g} Hz", fontsize="small", loc="left")
        known = found.get((links.index(n), frequencies.index(frequency)))
        if known is None:
            axes.text(0.5, 0.5, "does not\nrise again", ha="center", va="center", transform=axes.transAxes)
            continue
        for outline, color, label in ((known[0].before, FAINT, "before"), (known[0].after, BLUE, "after")):
            axes.plot(*(100 * np.vstack([outline, outline[:1]]).T), color=color, linewidth=1.3, label=label)
        handles = axes.get_lines()
    figure.legend(handles=handles, frameon=False, fontsize="small", loc="outside lower center", ncols=2)
    return figure
