"""Searches for a law Δx/(nℓ) = F(x) with one variable x that puts all cells of the phase diagram on one curve.

Only the number of links n and the frequency ν vary in the sweep, so that x is a power law ν n^c but for constants; its
own power is a part of F. F is a cubic spline, fitted to ln Δx/(nℓ) by least squares. What the spline leaves is the
residual of the law, in per cent of Δx.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.optimize import minimize, minimize_scalar

from warpchain import preset

Array = NDArray[Any]

PARAMETERS: Final = preset("soft")
LINK_LENGTH: Final = PARAMETERS.link_length
GRAVITY: Final = PARAMETERS.gravity
RADIUS: Final = PARAMETERS.sprocket_radius + PARAMETERS.circle_radius
"""At which joints ride on the sprocket [m]."""

PIECES: Final = 6
"""Of the spline."""
NUMBERS: Final = PIECES + 3
"""That a spline has."""
FEWEST: Final = 3 * NUMBERS
"""Cells that are enough for one."""
MOST_FAILED: Final = 0.05
"""Cells of which more walks failed are left out: those at rest may be another kind of walks than the rest."""
FAST: Final = 12.0
"""Frequency [Hz] from which most chains survive their second bounce."""
PLACES: Final = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Turns of the loop per second at which a curve is described."""


def in_papers_range(links: Array, frequency: Array) -> Array:
    """Whether cells lie within 60 to 180 links and 5 to 30 Hz."""
    return (links >= 60) & (links <= 180) & (frequency >= 5) & (frequency <= 30)


@dataclass(frozen=True)
class Points:
    """Cells as the laws take them, shape (cells,) each: links, speed of the loop [m/s], mean Δx [m]."""

    links: Array
    frequency: Array
    speed: Array
    distance: Array

    def __getitem__(self, chosen: Array) -> "Points":
        """Some of the cells."""
        return Points(self.links[chosen], self.frequency[chosen], self.speed[chosen], self.distance[chosen])

    @property
    def length(self) -> Array:
        """Length of the chain nℓ [m]."""
        return self.links * LINK_LENGTH

    @property
    def hanging(self) -> Array:
        """Height of the loop that hangs on the sprocket [m]: straight sides and two half circles."""
        return 2 * RADIUS + np.maximum(self.length / 2 - np.pi * RADIUS, 0.0)


def points_of(cells: Mapping[str, Array]) -> Points:
    """The cells that have a mean, and few enough failures."""
    failed = cells["walks"] - cells["at_rest"]
    used = (cells["at_rest"] > 0) & (failed <= MOST_FAILED * cells["walks"]) & (cells["dx_mean"] > 0)
    frequency = cells["frequency"][used]
    return Points(cells["links"][used], frequency, 2 * np.pi * RADIUS * frequency, cells["dx_mean"][used])


def master_curve(x: Array, y: Array) -> Callable[[Array], Array]:
    """ln y as a cubic spline of ln x, by least squares; knots at equal shares of the points."""
    abscissa = np.log(x)
    inner = np.unique(np.quantile(abscissa, np.linspace(0, 1, PIECES + 1)[1:-1]))
    low, high = abscissa.min(), abscissa.max()
    inner = inner[(inner > low) & (inner < high)]
    knots = np.r_[[low] * 4, inner, [high] * 4]

    def design(values: Array) -> Array:
        clipped = np.clip(np.log(values), low, high)
        return BSpline.design_matrix(clipped, knots, 3).toarray()

    weights, *_ = np.linalg.lstsq(design(x), np.log(y), rcond=None)
    return lambda values: design(values) @ weights


def residuals(x: Array, y: Array) -> Array:
    """ln y less the master curve, shape (cells,)."""
    return np.log(y) - master_curve(x, y)(x)


def rms_residual(x: Array, y: Array) -> float:
    """Residual of a law, root mean square in per cent."""
    return root_mean_square(residuals(x, y), NUMBERS)


def best_variable(points: Points, power: float = 1.0) -> float:
    """Exponent c of x = ν n^c with the least residual of Δx/n^power."""
    y = points.distance / points.links**power

    def cost(c: float) -> float:
        return rms_residual(points.frequency * points.links**c, y)

    starts = np.linspace(-1.5, 1.0, 26)
    first = starts[int(np.argmin([cost(c) for c in starts]))]
    return float(minimize_scalar(cost, bounds=(first - 0.1, first + 0.1), method="bounded", options={"xatol": 1e-4}).x)


def best_powers(points: Points, start: tuple[float, float] | None = None) -> tuple[float, float]:
    """Exponents (c, d) of Δx/n^d over ν n^c with the least residual."""
    if start is None:
        powers = np.linspace(-1.0, 2.0, 13)
        variables = [best_variable(points, power) for power in powers]
        costs = [
            rms_residual(points.frequency * points.links**c, points.distance / points.links**d)
            for c, d in zip(variables, powers, strict=True)
        ]
        at = int(np.argmin(costs))
        start = variables[at], float(powers[at])

    def cost(exponents: Array) -> float:
        c, d = exponents
        return rms_residual(points.frequency * points.links**c, points.distance / points.links**d)

    found = minimize(cost, start, method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 1e-5})
    return float(found.x[0]), float(found.x[1])


def power_law(points: Points) -> tuple[float, float]:
    """Exponents (p, q) of Δx ∝ ν^p n^q."""
    _, p, q = np.linalg.lstsq(_logarithms(points), np.log(points.distance), rcond=None)[0]
    return float(p), float(q)


def _logarithms(points: Points) -> Array:
    return np.stack([np.ones(len(points.links)), np.log(points.frequency), np.log(points.links)], axis=1)


def root_mean_square(left: Array, numbers: int) -> float:
    """Root mean square in per cent of residuals that a fit of so many numbers leaves."""
    return float(100 * np.sqrt(np.sum(left**2) / max(len(left) - numbers, 1)))


def slopes(points: Points) -> str:
    """Steepness of the curve of Δx/(nℓ) over v/(nℓ) at some places, in words."""
    x, y = points.speed / points.length, points.distance / points.length
    curve, width = master_curve(x, y), 1.05
    places = np.array([place for place in PLACES if x.min() * width < place < x.max() / width])
    rise = (curve(places * width) - curve(places / width)) / (2 * np.log(width))
    texts = [
        f"{np.exp(value):.2g} at {place:g}/s (slope {slope:.1f})"
        for place, value, slope in zip(places, curve(places), rise, strict=True)
    ]
    return f"Δx/(nℓ) over v/(nℓ) is {', '.join(texts)}."


def drift(points: Points) -> str:
    """Exponent c of Δx/(nℓ) over ν n^c for the slower and the faster half of the frequencies, in words."""
    frequencies = np.unique(points.frequency)
    half = len(frequencies) // 2
    if not half:
        return ""
    slow, fast = points.frequency <= frequencies[half - 1], points.frequency >= frequencies[-half]
    if min(slow.sum(), fast.sum()) < FEWEST:
        return ""
    (low, high), (until, since) = (best_variable(points[part]) for part in (slow, fast)), frequencies[[half - 1, -half]]
    return f"With d = 1 given, c is {low:.2f} up to {until:g} Hz and {high:.2f} from {since:g} Hz on."
