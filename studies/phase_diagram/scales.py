"""Holds the sweep ``scaling`` against the curve of the phase diagram: what is the time that Δx scales with?

In the phase diagram Δx/(nℓ) is a curve over v/(nℓ), turns of the loop per second. This sweep varies gravity, sprocket
and links, and shows with which time τ all of its cells are on that very curve, now over v τ/(nℓ).
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import least_squares

from studies import common
from studies.common import FAINT, INK, LINE_COLORS, Array
from studies.phase_diagram import laws
from warpchain import InputError, Status, SweepResult, preset

Curve = Callable[[Array], Array]  # Turns per second → ln Δx/(nℓ), beyond its ends as there

CSV = Path(__file__).parent / "results" / "scaling.csv"
TIMES = {"a constant": (0, 0, 0), "∝ g^-½": (-0.5, 0, 0), "(ℓ/g)^½": (-0.5, 0, 0.5), "(R/g)^½": (-0.5, 0.5, 0)}
"""Times that are tried, by name: exponents of gravity, of the radius at which joints ride, of the length of a link."""
NORMAL = (laws.GRAVITY, laws.RADIUS, laws.LINK_LENGTH)  # The three quantities in the phase diagram [SI units]
NORMAL_TIME = (laws.RADIUS / laws.GRAVITY) ** 0.5  # (R/g)^½ there [s]
ROUNDS = 100  # Samples of the bootstrap over cells
BLOCKS = {"sprocket_radius": "radius of the sprocket", "gravity": "gravity", "links": "length of links"}
"""What is varied: first word of the names of the blocks → name."""


def reduced(result: SweepResult) -> Iterator[dict[str, float | str]]:
    """Statistics of the cells of the sweep: rows of the file."""
    for content in result.sweep["blocks"]:
        name, block = content["name"], result.blocks[content["name"]]
        if not {"links", "frequency"} <= block.axes.keys():
            raise InputError(f"block {name}: expected axes links and frequency; use a folder of the sweep scaling")
        if np.any(block.columns["status"] < 0):
            raise InputError(f"block {name}: walks are missing; run the sweep to its end")
        for place, at in common.of_cells(block):
            links, frequency = int(at.pop("links")), float(at.pop("frequency"))
            chain = preset("soft").with_values(content["parameters"] | {key: float(value) for key, value in at.items()})
            status = block.columns["status"][place]
            dx = block.columns["dx"][place][status == Status.AT_REST]
            yield {
                "block": name,
                "links": links,
                "frequency": frequency,
                "gravity": chain.gravity,
                "radius": chain.sprocket_radius + chain.circle_radius,
                "link_length": chain.link_length,
                "walks": len(status),
                "at_rest": len(dx),
                "dx_mean": float(common.mean(dx)),
                "dx_se": float(common.standard_error(dx)),
            }


class Cells:
    """Cells of the file with few failures, shape (cells,) each."""

    def __init__(self) -> None:
        """Read the file."""
        rows = common.read_columns(CSV)
        used = rows["at_rest"] >= (1 - laws.MOST_FAILED) * rows["walks"]
        rows = {name: values[used] for name, values in rows.items()}
        self.names, self.links, self.frequency = rows["block"], rows["links"], rows["frequency"]
        length = self.links * rows["link_length"]
        self.turns = 2 * np.pi * rows["radius"] * self.frequency / length  # Of the loop per second, v/(nℓ) [1/s]
        self.lengths = rows["dx_mean"] / length  # Δx/(nℓ)
        self.scales = np.stack([rows["gravity"], rows["radius"], rows["link_length"]]) / np.array(NORMAL)[:, None]

    def varied(self, word: str) -> Array:
        """Which cells are of blocks whose names begin so, shape (cells,)."""
        return np.char.startswith(self.names, word)

    def scaled_turns(self, exponents: Sequence[float]) -> Array:
        """Turns per second, times the time with these exponents over what it is in the phase diagram."""
        return self.turns * np.prod(self.scales ** np.asarray(exponents)[:, None], axis=0)


def left_of(cells: Cells, curve: Curve, exponents: Sequence[float]) -> Array:
    """What cells leave of the curve of the phase diagram, ln Δx less that, shape (cells,)."""
    return np.log(cells.lengths) - curve(cells.scaled_turns(exponents))


def best_exponents(cells: Cells, curve: Curve, chosen: Array) -> Array:
    """Exponents with the least residuals of some cells; nothing of the curve is fitted to them."""
    return least_squares(lambda numbers: left_of(cells, curve, numbers)[chosen], (-0.5, 0.25, 0.25)).x


def table(cells: Cells, points: laws.Points) -> str:
    """Markdown: residuals of the cells with each time, and the best exponents."""
    count, rows, curve = len(cells.names), [], laws.master_curve(points.turns, points.lengths)[0]
    groups = {name: cells.varied(word) for word, name in BLOCKS.items()} | {"all": np.arange(count)}
    for name, exponents in TIMES.items():
        left = left_of(cells, curve, exponents)
        rows.append([name, *(f"{laws.root_mean_square(left[chosen]):.0f} %" for chosen in groups.values())])
    best, rng = best_exponents(cells, curve, groups["all"]), np.random.default_rng(1)
    samples = [best_exponents(cells, curve, rng.integers(0, count, count)) for _ in range(ROUNDS)]
    errors = np.std(samples, axis=0, ddof=1)
    shares = [f"{value:.2f} ± {error:.2f}" for value, error in zip(best, errors, strict=True)]
    residual = laws.root_mean_square(left_of(cells, curve, best), 3)
    left = left_of(cells, curve, TIMES["(R/g)^½"])
    order = np.argsort(-np.abs(left))[:4]
    farthest = "; ".join(f"{_cell(cells, i)} {100 * np.expm1(left[i]):+.0f} %" for i in order)
    g, r, link, lengths = (f"{each.min():.2g} to {each.max():.2g}" for each in (*cells.scales, cells.lengths))
    return common.minus(
        f"{common.table(('time τ', *groups), rows)}\n\n"
        f"In these {count} cells g, R and ℓ are {g}, {r} and {link} times those of the phase diagram, and Δx "
        f"is {lengths} chain lengths. The best exponents of g, R and ℓ are {', '.join(shares)} "
        f"(RMS {residual:.0f} %). With (R/g)^½ the largest deviations are {farthest}."
    )


def _cell(cells: Cells, number: int) -> str:
    """What is varied in a cell, over its value in the phase diagram, and its links and frequency."""
    scale = cells.scales[:, number]
    which = int(np.argmax(np.abs(np.log(scale))))
    return f"{scale[which]:.2g} {'gRℓ'[which]}, {cells.links[number]:g} × {cells.frequency[number]:g} Hz"


def draw(cells: Cells, points: laws.Points) -> Figure:
    """Δx/(nℓ) over turns per second, and over turns in the time (R/g)^½; the phase diagram in grey."""
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    panels = (
        ("v/(nℓ), turns of the loop / s⁻¹", TIMES["a constant"], 1.0),
        ("v √(R/g)/(nℓ), turns of the loop in the time √(R/g)", TIMES["(R/g)^½"], NORMAL_TIME),
    )
    curve = laws.master_curve(points.turns, points.lengths)[0]
    fine = np.geomspace(points.turns.min(), points.turns.max(), 200)
    for axes, (label, exponents, unit) in zip(figure.subplots(1, 2, sharey=True), panels, strict=True):
        axes.scatter(points.turns * unit, points.lengths, s=8, color=FAINT, label="phase diagram")
        for (word, name), color in zip(BLOCKS.items(), LINE_COLORS, strict=False):
            chosen = cells.varied(word)
            x = cells.scaled_turns(exponents)[chosen] * unit
            axes.scatter(x, cells.lengths[chosen], s=16, color=color, label=name)
        axes.plot(fine * unit, np.exp(curve(fine)), color=INK, linewidth=1)
        title = f"residual of the coloured cells {laws.root_mean_square(left_of(cells, curve, exponents)):.0f} %"
        common.tidy(axes, title, grid="both", xscale="log", yscale="log", xlabel=label)
    figure.axes[0].set_ylabel("Δx/(nℓ)")
    figure.axes[0].legend(frameon=False, title="varied")
    return figure
