"""Candidates for the law of Δx, judged by what they predict of numbers of links, or frequencies, left out.

Errors come from blocks: all cells of a number of links, or of a frequency, are drawn together, because neighbours in
the diagram share their deviations. Everything is of ln Δx, every cell counts alike, and per cent are root mean squares.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from studies.common import table as markdown
from studies.phase_diagram import laws, scales
from studies.phase_diagram.laws import Points

Array = NDArray[Any]
Prediction = Callable[[Points], Array]
"""ln Δx of cells."""

TIME: Final = scales.NORMAL_TIME
"""τ = (R/g)^½ [s]."""
BLOCKS: Final = ("links", "frequency")
ROUNDS: Final = 40
"""Samples of blocks."""


@dataclass(frozen=True)
class Candidate:
    """A law.

    Attributes:
        name: in the table.
        numbers: how many are fitted.
        fit: cells → its numbers, and what it predicts.
    """

    name: str
    numbers: int
    fit: Callable[[Points], tuple[Array, Prediction]]


def sum_of_powers(power: float | None) -> Callable[[Points], tuple[Array, Prediction]]:
    """Fits Δx = a vτ + b nℓ (vτ/nℓ)^p, with p given or fitted; its numbers are a, b and p."""

    def distance(numbers: Array, speed: Array, length: Array) -> Array:
        exponent = numbers[2] if power is None else power
        turns = speed * TIME / length
        return np.log(length * (np.exp(numbers[0]) * turns + np.exp(numbers[1]) * turns**exponent))

    def fit(points: Points) -> tuple[Array, Prediction]:
        def left(numbers: Array) -> Array:
            return np.log(points.distance) - distance(numbers, points.speed, points.length)

        found = least_squares(left, (-1.0, 0.5, 2.0) if power is None else (-1.0, 0.5)).x
        shown = np.array([*np.exp(found[:2]), found[2] if power is None else power])
        return shown, lambda others: distance(found, others.speed, others.length)

    return fit


def spline(variable: float | None, power: float | None) -> Callable[[Points], tuple[Array, Prediction]]:
    """Fits the spline of Δx/n^d over ν n^c; c and d given or fitted; its numbers are c and d."""

    def fit(points: Points) -> tuple[Array, Prediction]:
        c, d = variable, power
        if c is None and d is None:
            c, d = laws.best_powers(points, (-1.1, 1.1))
        elif c is None:
            c = laws.best_variable(points)
        assert c is not None and d is not None
        curve = laws.master_curve(points.frequency * points.links**c, points.distance / points.links**d)
        return np.array([c, d]), lambda others: curve(others.frequency * others.links**c) + d * np.log(others.links)

    return fit


def hanging_loop(points: Points) -> tuple[Array, Prediction]:
    """Fits the spline of Δx/H over v²/(g H), H the height of the hanging loop; no further numbers."""
    curve = laws.master_curve(points.speed**2 / points.hanging, points.distance / points.hanging)
    return np.array([]), lambda others: curve(others.speed**2 / others.hanging) + np.log(others.hanging)


def power_law(points: Points) -> tuple[Array, Prediction]:
    """Fits Δx ∝ ν^p n^q; its numbers are p and q."""
    p, q = laws.power_law(points)
    shift = float(np.mean(np.log(points.distance) - p * np.log(points.frequency) - q * np.log(points.links)))
    return np.array([p, q]), lambda others: shift + p * np.log(others.frequency) + q * np.log(others.links)


SQUARE, FREE = "a vτ + b (vτ)²/(nℓ)", "a vτ + b nℓ (vτ/nℓ)^p"
TURNS = "spline of Δx/(nℓ) over v/(nℓ)"
CANDIDATES: Final = (
    Candidate(SQUARE, 2, sum_of_powers(2.0)),
    Candidate(FREE, 3, sum_of_powers(None)),
    Candidate(TURNS, laws.NUMBERS, spline(-1.0, 1.0)),
    Candidate("spline, c fitted", laws.NUMBERS + 1, spline(None, 1.0)),
    Candidate("spline, c and d fitted", laws.NUMBERS + 2, spline(None, None)),
    Candidate("Δx ∝ ν^p n^q", 3, power_law),
    Candidate("spline of Δx/(nℓ) over v²/(g nℓ)", laws.NUMBERS, spline(-0.5, 1.0)),
    Candidate("spline of Δx/(nℓ) over ν²ℓ/g", laws.NUMBERS, spline(0.0, 1.0)),
    Candidate("spline of Δx/H over v²/(g H)", laws.NUMBERS, hanging_loop),
    Candidate("spline of Δx/ℓ over v²/(g nℓ)", laws.NUMBERS, spline(-0.5, 0.0)),
    Candidate("spline of Δx/ℓ over ν²ℓ/g", laws.NUMBERS, spline(0.0, 0.0)),
)
"""With a fixed drop h, its Froude number v²/(g h) is ν²ℓ/g but for a constant, and so is v²/(g R)."""


def root_mean_square(left: Array) -> float:
    """In per cent."""
    return float(100 * np.sqrt(np.mean(left**2)))


def left_out(points: Points, candidate: Candidate, block: str) -> Array:
    """ln Δx of each cell less what the law says that was fitted without the cells of its block, shape (cells,)."""
    of, left = getattr(points, block), np.zeros(len(points.links))
    for value in np.unique(of):
        out = of == value
        left[out] = np.log(points.distance[out]) - candidate.fit(points[~out])[1](points[out])
    return left


def block_errors(points: Points, candidate: Candidate, block: str) -> Array:
    """Standard errors of a law's numbers, from samples of blocks with replacement."""
    rng, of = np.random.default_rng(1), getattr(points, block)
    places = [np.flatnonzero(of == value) for value in np.unique(of)]
    found = []
    for _ in range(ROUNDS):
        drawn = np.concatenate([places[k] for k in rng.integers(0, len(places), len(places))])
        found.append(candidate.fit(points[drawn])[0])
    return np.std(found, axis=0, ddof=1)


def ranges(cells: Mapping[str, Array]) -> dict[str, Points]:
    """The cells whose law is asked for, by name."""
    points = laws.points_of(cells)
    return {
        "all": points,
        "40 links and more": points[points.links > 30],
        "the paper's range": points[laws.in_papers_range(points.links, points.frequency)],
        f"from {laws.FAST:g} Hz on": points[points.frequency >= laws.FAST],
    }


def table(cells: Mapping[str, Array], varied: scales.Cells) -> str:
    """Markdown: what each law leaves, and what it leaves of blocks that it has not seen; then numbers with errors."""
    known = ranges(cells)
    rows = []
    for candidate in CANDIDATES:
        row = [candidate.name, str(candidate.numbers)]
        for points in known.values():
            own = root_mean_square(np.log(points.distance) - candidate.fit(points)[1](points))
            others = [root_mean_square(left_out(points, candidate, block)) for block in BLOCKS]
            row.append(f"{own:.1f} / {others[0]:.1f} / {others[1]:.1f}")
        rows.append(row)
    heads = (f"{name} ({len(points.links)} cells)" for name, points in known.items())
    curves = "\n".join(f"- {name}: {laws.slopes(points)} {laws.drift(points)}" for name, points in known.items())
    lines = [markdown(("law of Δx", "numbers", *heads), rows), curves, *errors(known), beyond(known["all"], varied)]
    return "\n\n".join(lines)


def errors(known: Mapping[str, Points]) -> list[str]:
    """Markdown: numbers of laws with errors from blocks of links and of frequencies."""
    rows = []
    for candidate in (CANDIDATES[0], CANDIDATES[1], *CANDIDATES[3:6]):
        for name, points in known.items():
            numbers = candidate.fit(points)[0]
            of_blocks = [block_errors(points, candidate, block) for block in BLOCKS]
            texts = [
                f"{value:.2f} ± {one:.2f} ± {two:.2f}" for value, one, two in zip(numbers, *of_blocks, strict=True)
            ]
            if candidate is CANDIDATES[0]:
                texts[2] = "2"
            if candidate is CANDIDATES[3]:
                texts[1] = "1"
            rows.append((candidate.name, name, ", ".join(texts)))
    return [markdown(("law of Δx", "cells", "a, b, p or c, d or p, q ± over links ± over frequencies"), rows)]


def beyond(points: Points, varied: scales.Cells) -> str:
    """What two laws of the phase diagram leave of the cells of the sweep `scaling`, to which nothing is fitted."""
    gravity, radius, link = varied.scales * np.array(scales.NORMAL)[:, None]
    length = varied.links * link
    reach = 2 * np.pi * radius * varied.frequency * np.sqrt(radius / gravity)
    parts = []
    for candidate in CANDIDATES[:2]:
        a, b, p = candidate.fit(points)[0]
        left = np.log(varied.lengths) - np.log(a * reach / length + b * (reach / length) ** p)
        groups = ", ".join(
            f"{root_mean_square(left[varied.varied(word)]):.0f} % ({name})" for word, (name, _) in scales.BLOCKS.items()
        )
        parts.append(f"{candidate.name} leaves {root_mean_square(left):.0f} %: {groups}")
    return f"Of the {len(length)} cells with other g, R and ℓ, to which nothing is fitted, {'; '.join(parts)}."


def walking_time(cells: Mapping[str, Array]) -> str:
    """Markdown: walking time and mean speed as powers of v and L = nℓ, with what they leave."""
    used = (cells["at_rest"] > 0) & (cells["walks"] - cells["at_rest"] <= laws.MOST_FAILED * cells["walks"])
    points = laws.points_of(cells)
    duration = cells["walk_time_mean"][used & (cells["dx_mean"] > 0)]
    rows = []
    papers = laws.in_papers_range(points.links, points.frequency)
    for name, chosen in (("all", points.links > 0), ("the paper's range", papers)):
        design = np.stack([np.ones(chosen.sum()), np.log(points.speed[chosen]), np.log(points.length[chosen])], axis=1)
        mean_speed = points.distance[chosen] / duration[chosen] / points.speed[chosen]
        for quantity, values in (("walking time", duration[chosen]), ("mean speed over v", mean_speed)):
            weights = np.linalg.lstsq(design, np.log(values), rcond=None)[0]
            left = root_mean_square(np.log(values) - design @ weights)
            rows.append((quantity, name, f"v^{weights[1]:.2f} L^{weights[2]:.2f}", f"{left:.1f} %"))
    return markdown(("quantity", "cells", "∝", "leaves"), rows)
