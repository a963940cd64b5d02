"""Holds the sweep ``scaling`` against the curve of the phase diagram: what is the time that Δx scales with?

In the phase diagram Δx/(nℓ) is a curve over v/(nℓ), turns of the loop per second. This sweep varies gravity, sprocket
and links, and shows with which time τ all of its cells are on that very curve, now over v τ/(nℓ).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import least_squares

from studies.common import FAINT, INK, save_figure, tidy
from studies.common import table as markdown
from studies.phase_diagram import laws
from warpchain import InputError, Status, SweepResult, preset

Array = NDArray[Any]
Exponents = tuple[float, float, float]
"""Of gravity, of the radius at which joints ride on the sprocket, of the length of a link."""

CSV: Final = Path(__file__).parent / "results" / "scaling.csv"

TIMES: Final[Mapping[str, Exponents]] = {
    "a constant": (0, 0, 0),
    "∝ g^-½": (-0.5, 0, 0),
    "(ℓ/g)^½": (-0.5, 0, 0.5),
    "(R/g)^½": (-0.5, 0.5, 0),
}
"""Times that are tried, by name."""
NORMAL: Final = (laws.GRAVITY, laws.RADIUS, laws.LINK_LENGTH)
"""The three quantities in the phase diagram [SI units]."""
NORMAL_TIME: Final = (laws.RADIUS / laws.GRAVITY) ** 0.5
"""(R/g)^½ there [s]."""
PLACES: Final = (0.1, 0.3, 1.0, 3.0)
"""Turns in this time at which the curve is described."""
ROUNDS: Final = 100
"""Samples of the bootstrap over cells."""
BLOCKS: Final = {
    "sprocket_radius": ("radius of the sprocket", "#0072B2"),
    "gravity": ("gravity", "#D55E00"),
    "links": ("length of links", "#009E73"),
}
"""What is varied: first word of the names of the blocks → name and colour."""


def reduced(result: SweepResult) -> list[dict[str, float | str]]:
    """Statistics of the cells of the sweep: rows of the file.

    Raises:
        InputError: it has other axes, or a cell is unfinished.
    """
    rows: list[dict[str, float | str]] = []
    for content in result.sweep["blocks"]:
        block = result.blocks[content["name"]]
        if not {"links", "frequency"} <= block.axes.keys():
            raise InputError(
                f"block {content['name']}: no axes links and frequency; give a folder of the sweep scaling"
            )
        for place in np.ndindex(block.columns["dx"].shape[:-1]):
            at = {name: float(values[i]) for (name, values), i in zip(block.axes.items(), place, strict=True)}
            given = {name: at.get(name) for name in ("gravity", "sprocket_radius", "link_length")}
            known = {name: content["parameters"].get(name) if value is None else value for name, value in given.items()}
            parameters = preset("soft").with_values({name: value for name, value in known.items() if value is not None})
            status = block.columns["status"][place]
            dx = block.columns["dx"][place][status == Status.AT_REST]
            if np.any(status < 0):
                raise InputError(f"block {content['name']}: walks are missing; run the sweep to its end")
            rows.append(
                {
                    "block": content["name"],
                    "links": int(at["links"]),
                    "frequency": at["frequency"],
                    "gravity": parameters.gravity,
                    "radius": parameters.sprocket_radius + parameters.circle_radius,
                    "link_length": parameters.link_length,
                    "walks": len(status),
                    "at_rest": len(dx),
                    "dx_mean": float(dx.mean()) if len(dx) else float("nan"),
                    "dx_se": float(dx.std(ddof=1) / np.sqrt(len(dx))) if len(dx) > 1 else float("nan"),
                }
            )
    return rows


class Cells:
    """Cells with few failures, shape (cells,) each.

    Attributes:
        names: of their blocks.
        links, frequency: of the cells [Hz].
        turns: of the loop per second, v/(nℓ) [1/s].
        lengths: Δx/(nℓ).
        scales: (3, cells), gravity, radius and length of links over those of the phase diagram.
    """

    def __init__(self, rows: Sequence[Mapping[str, str]]) -> None:
        """Take the rows of the file."""
        used = [row for row in rows if int(row["at_rest"]) >= (1 - laws.MOST_FAILED) * int(row["walks"])]
        self.names = np.array([row["block"] for row in used])
        columns = ("links", "frequency", "gravity", "radius", "link_length", "dx_mean")
        self.links, self.frequency, gravity, radius, link, distance = (
            np.array([float(row[name]) for row in used]) for name in columns
        )
        self.turns = 2 * np.pi * radius * self.frequency / (self.links * link)
        self.lengths = distance / (self.links * link)
        self.scales = np.stack([gravity, radius, link]) / np.array(NORMAL)[:, None]

    def varied(self, word: str) -> Array:
        """Which cells are of blocks whose names begin so, shape (cells,)."""
        return np.array([name.startswith(word) for name in self.names])

    def scaled_turns(self, exponents: Sequence[float] | Array) -> Array:
        """Turns per second, times the time with these exponents over what it is in the phase diagram."""
        times: Array = np.prod(self.scales ** np.asarray(exponents)[:, None], axis=0)
        return self.turns * times


class Curve:
    """The curve of the phase diagram; what cells leave of it, ln Δx less the curve."""

    def __init__(self, cells: Mapping[str, Array]) -> None:
        """Fit it to the cells of the phase diagram."""
        points = laws.points_of(cells)
        self.turns, self.lengths = points.speed / points.length, points.distance / points.length
        self._curve = laws.master_curve(self.turns, self.lengths)

    def __call__(self, turns: Array) -> Array:
        """Δx/(nℓ) on the curve; beyond its ends it keeps the value there."""
        return np.exp(self._curve(turns))

    def left(self, cells: Cells, exponents: Sequence[float] | Array) -> Array:
        """Residuals of cells, shape (cells,)."""
        return np.log(cells.lengths) - self._curve(cells.scaled_turns(exponents))

    def best_exponents(self, cells: Cells, chosen: Array) -> Array:
        """Exponents with the least residuals of some cells; nothing of the curve is fitted to them."""

        def left(numbers: Array) -> Array:
            return self.left(cells, numbers)[chosen]

        return np.asarray(least_squares(left, (-0.5, 0.25, 0.25)).x)


def table(cells: Cells, curve: Curve) -> str:
    """Markdown: residuals of the cells with each time, and the best exponents."""
    groups = {name: cells.varied(word) for word, (name, _) in BLOCKS.items()}
    groups["all"] = np.ones(len(cells.names), dtype=bool)
    rows = []
    for name, exponents in TIMES.items():
        left = curve.left(cells, exponents)
        rows.append([name, *(f"{laws.root_mean_square(left[chosen], 0):.0f} %" for chosen in groups.values())])
    count = len(cells.names)
    a, b, c = curve.best_exponents(cells, groups["all"])
    rng = np.random.default_rng(1)
    samples = [curve.best_exponents(cells, rng.integers(0, count, count)) for _ in range(ROUNDS)]
    errors = np.std(samples, axis=0, ddof=1)
    shares = [f"{value:.2f} ± {error:.2f}" for value, error in zip((a, b, c), errors, strict=True)]
    residual = laws.root_mean_square(curve.left(cells, (a, b, c)), 3)
    left = curve.left(cells, TIMES["(R/g)^½"])
    order = np.argsort(-np.abs(left))[:4]
    farthest = ", ".join(f"{_cell(cells, i)} {100 * np.expm1(left[i]):+.0f} %" for i in order)
    spans = [_span(scale) for scale in cells.scales]
    described = [f"{curve(np.array([place / NORMAL_TIME]))[0]:.2g} at {place:g}" for place in PLACES]
    return "\n".join(
        [
            markdown(("time τ", *groups), rows),
            "",
            f"{count} cells; g, R and ℓ are {spans[0]}, {spans[1]} and {spans[2]} times those of the phase diagram, Δx "
            f"is {_span(cells.lengths)} lengths of the chain. The best exponents of g, R and ℓ are {', '.join(shares)} "
            f"and leave {residual:.0f} %. With (R/g)^½ the farthest cells are {farthest}.",
            "",
            f"Δx/(nℓ) is {', '.join(described)} turns in the time (R/g)^½.",
        ]
    )


def _cell(cells: Cells, number: int) -> str:
    """What is varied in a cell, over its value in the phase diagram, and its links and frequency."""
    scale = cells.scales[:, number]
    which = int(np.argmax(np.abs(np.log(scale))))
    return f"{scale[which]:.2g} {'gRℓ'[which]}, {cells.links[number]:g} × {cells.frequency[number]:g} Hz"


def _span(values: Array) -> str:
    """The least and the greatest."""
    return f"{values.min():.2g} to {values.max():.2g}"


def draw(cells: Cells, curve: Curve, path: Path) -> None:
    """Δx/(nℓ) over turns per second, and over turns in the time (R/g)^½; the phase diagram in grey."""
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    panels = (
        ("v/(nℓ), turns of the loop / s⁻¹", TIMES["a constant"], 1.0),
        ("v √(R/g)/(nℓ), turns of the loop in the time √(R/g)", TIMES["(R/g)^½"], NORMAL_TIME),
    )
    axes: Axes
    for axes, (label, exponents, unit) in zip(figure.subplots(1, 2, sharey=True), panels, strict=True):
        axes.scatter(curve.turns * unit, curve.lengths, s=8, color=FAINT, label="phase diagram")
        for word, (name, color) in BLOCKS.items():
            chosen = cells.varied(word)
            x = cells.scaled_turns(exponents)[chosen] * unit
            axes.scatter(x, cells.lengths[chosen], s=16, color=color, label=name)
        fine = np.geomspace(curve.turns.min(), curve.turns.max(), 200)
        axes.plot(fine * unit, curve(fine), color=INK, linewidth=1)
        left = laws.root_mean_square(curve.left(cells, exponents), 0)
        axes.set_title(f"residual of the coloured cells {left:.0f} %", loc="left", color=INK, fontsize="medium")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(label)
        tidy(axes, grid="both")
    figure.axes[0].set_ylabel("Δx/(nℓ)")
    figure.axes[0].legend(frameon=False, title="varied")
    save_figure(figure, path)
