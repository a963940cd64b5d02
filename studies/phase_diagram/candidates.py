"""Candidates for the law of Δx, judged by what they predict of numbers of links, or frequencies, left out.

Errors come from blocks: all cells of a number of links, or of a frequency, are drawn together, because neighbours in
the diagram share their deviations. Everything is of ln Δx, every cell counts alike, and per cent are root mean squares.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from studies.common import Array, Columns
from studies.common import table as markdown
from studies.phase_diagram import laws, scales
from studies.phase_diagram.laws import Points

Prediction = Callable[[Points], Array]  # ln Δx of cells
Fit = Callable[[Points], tuple[Array, Prediction]]  # Cells → the numbers of a law, and what it predicts

TIME = scales.NORMAL_TIME  # τ = (R/g)^½ [s]
BLOCKS = ("links", "frequency")
SHOWN = ("all", "the paper's range")  # Ranges of cells whose laws stand on the page
ROUNDS = 40  # Samples of blocks


class Candidate(NamedTuple):
    """A law: its name in the table, how many numbers are fitted, and its fit to cells."""

    name: str
    numbers: int
    fit: Fit


def sum_of_powers(power: float | None) -> Fit:
    """Fits Δx = a vτ + b nℓ (vτ/nℓ)^p, with p given or fitted; its numbers are a, b and p."""

    def distance(numbers: Array, points: Points) -> Array:
        turns, exponent = points.speed * TIME / points.length, numbers[2] if power is None else power
        return np.log(points.length * (np.exp(numbers[0]) * turns + np.exp(numbers[1]) * turns**exponent))

    def fit(points: Points) -> tuple[Array, Prediction]:
        start = (-1.0, 0.5, 2.0) if power is None else (-1.0, 0.5)
        found = least_squares(lambda numbers: np.log(points.distance) - distance(numbers, points), start).x
        shown = np.array([*np.exp(found[:2]), found[2] if power is None else power])
        return shown, lambda others: distance(found, others)

    return fit


def spline(c: float, d: float) -> Fit:
    """Fits the spline of Δx/n^d over ν n^c; no further numbers."""

    def fit(points: Points) -> tuple[Array, Prediction]:
        curve, _ = laws.master_curve(points.frequency * points.links**c, points.distance / points.links**d)
        return np.array([]), lambda others: curve(others.frequency * others.links**c) + d * np.log(others.links)

    return fit


def fitted_spline(points: Points, *powers: float) -> tuple[Array, Prediction]:
    """Fits that spline with c and d that were found; its numbers are these."""
    return np.array(powers), spline(*powers)(points)[1]


def power_law(points: Points) -> tuple[Array, Prediction]:
    """Fits Δx ∝ ν^p n^q; its numbers are p and q."""

    def design(cells: Points) -> Array:
        return np.log(np.stack([cells.frequency, cells.links, np.full(len(cells), np.e)], axis=1))

    weights = np.linalg.lstsq(design(points), np.log(points.distance), rcond=None)[0]
    return weights[:2], lambda others: design(others) @ weights


def residual(points: Points, candidate: Candidate) -> Array:
    """ln Δx of cells less what a law says that is fitted to them."""
    return np.log(points.distance) - candidate.fit(points)[1](points)


NUMBERS = laws.NUMBERS
CANDIDATES = (
    Candidate("a vτ + b (vτ)²/(nℓ)", 2, sum_of_powers(2.0)),
    Candidate("a vτ + b nℓ (vτ/nℓ)^p", 3, sum_of_powers(None)),
    Candidate("spline of Δx/(nℓ) over v/(nℓ)", NUMBERS, spline(-1.0, 1.0)),
    Candidate("spline, c fitted", NUMBERS + 1, lambda cells: fitted_spline(cells, laws.best_variable(cells), 1.0)),
    Candidate("spline, c and d fitted", NUMBERS + 2, lambda cells: fitted_spline(cells, *laws.best_powers(cells))),
    Candidate("Δx ∝ ν^p n^q", 3, power_law),
    Candidate("spline of Δx/(nℓ) over v²/(g nℓ)", NUMBERS, spline(-0.5, 1.0)),
    Candidate("spline of Δx/(nℓ) over ν²ℓ/g", NUMBERS, spline(0.0, 1.0)),
    Candidate("spline of Δx/ℓ over v²/(g nℓ)", NUMBERS, spline(-0.5, 0.0)),
    Candidate("spline of Δx/ℓ over ν²ℓ/g", NUMBERS, spline(0.0, 0.0)),
)
"""With a fixed drop h, its Froude number v²/(g h) is ν²ℓ/g but for a constant, and so is v²/(g R)."""


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


def ranges(cells: Columns) -> dict[str, Points]:
    """The cells whose law is asked for, by name."""
    points = laws.points_of(cells)
    return {
        "all": points,
        "40 links and more": points[points.links > 30],
        "the paper's range": points[laws.in_papers_range(points.links, points.frequency)],
        f"from {laws.FAST:g} Hz on": points[points.frequency >= laws.FAST],
    }


def table(known: Mapping[str, Points]) -> str:
    """Markdown: what each law leaves of cells, and what it leaves of blocks that it has not seen."""
    rows = []
    for candidate in CANDIDATES:
        row = [candidate.name, str(candidate.numbers)]
        for points in known.values():
            left = [residual(points, candidate), *(left_out(points, candidate, block) for block in BLOCKS)]
            row.append("/".join(f"{laws.root_mean_square(each):.1f}" for each in left))
        rows.append(row)
    heads = (f"{name} ({len(points.links)} cells)" for name, points in known.items())
    return markdown(("law of Δx", "numbers", *heads), rows)


def details(known: Mapping[str, Points]) -> dict[str, str]:
    """What is printed only: laws of the ranges that are not `SHOWN`, places on curves, and numbers with errors."""
    curves = "\n".join(f"- {name}: {laws.slopes(points)}" for name, points in known.items())
    others = {name: points for name, points in known.items() if name not in SHOWN}
    return {"laws of other ranges": table(others), "curves": curves, "numbers of laws": errors(known)}


def errors(known: Mapping[str, Points]) -> str:
    """Markdown: numbers of laws with errors from blocks of links and of frequencies; what is given has none."""
    rows = []
    for candidate in (CANDIDATES[0], CANDIDATES[1], *CANDIDATES[3:6]):
        for name, points in known.items():
            numbers = candidate.fit(points)[0]
            of_blocks = (block_errors(points, candidate, block) for block in BLOCKS)
            texts = [
                f"{value:.2f} ± {one:.2f} ± {two:.2f}" if one > 0 else f"{value:g}"
                for value, one, two in zip(numbers, *of_blocks, strict=True)
            ]
            rows.append((candidate.name, name, ", ".join(texts)))
    return markdown("law of Δx | cells | a, b, p or c, d or p, q ± over links ± over frequencies", rows)
