"""Searches for a law Δx/(nℓ) = F(x) with one variable x that puts all cells of the phase diagram on one curve.

Only the number of links n and the frequency ν vary in the sweep, so that x is a power law ν n^c but for constants; its
own power is a part of F. F is a cubic spline, fitted to ln Δx/(nℓ) by least squares. What the spline leaves is the
residual of the law, in per cent of Δx.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import minimize, minimize_scalar

from studies.common import Array, Columns
from warpchain import preset

Points = np.recarray

PARAMETERS = preset("soft")
LINK_LENGTH = PARAMETERS.link_length
GRAVITY = PARAMETERS.gravity
RADIUS = PARAMETERS.sprocket_radius + PARAMETERS.circle_radius  # At which joints ride on the sprocket [m]

PIECES = 6  # Of the spline
NUMBERS = PIECES + 3  # That a spline has
MOST_FAILED = 0.05  # Cells of which more failed are left out: walks at rest may be another kind than the rest
FAST = 12.0  # Frequency [Hz] from which most chains survive their second bounce
PLACES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # Turns of the loop per second at which a curve is described


def in_papers_range(links: Array, frequency: Array) -> Array:
    """Whether cells lie within 60 to 180 links and 5 to 30 Hz."""
    return (links >= 60) & (links <= 180) & (frequency >= 5) & (frequency <= 30)


def points_of(cells: Columns) -> Points:
    """The cells that have a mean, and few enough failures, as the laws take them, shape (cells,).

    Fields are links, frequency [Hz], the mean distance Δx [m] of walks; speed [m/s] of the loop,
    length nℓ [m] of the chain, turns of the loop per second v/(nℓ), and Δx/(nℓ) as lengths.
    """
    failed = cells["walks"] - cells["at_rest"]
    used = (cells["at_rest"] > 0) & (failed <= MOST_FAILED * cells["walks"]) & (cells["dx_mean"] > 0)
    links, frequency, distance = (cells[name][used] for name in ("links", "frequency", "dx_mean"))
    speed, length = 2 * np.pi * RADIUS * frequency, links * LINK_LENGTH
    columns = links, frequency, distance, speed, length, speed / length, distance / length
    return np.rec.fromarrays(columns, names="links,frequency,distance,speed,length,turns,lengths")


def master_curve(x: Array, y: Array) -> tuple[Callable[[Array], Array], Array]:
    """ln y as a cubic spline of ln x, by least squares, and what it leaves; knots at equal shares of the points."""
    abscissa = np.log(x)
    inner, low, high = np.quantile(abscissa, np.linspace(0, 1, PIECES + 1)[1:-1]), abscissa.min(), abscissa.max()
    knots = np.r_[[low] * 4, np.unique(inner[(inner > low) & (inner < high)]), [high] * 4]

    def design(values: Array) -> Array:
        clipped = np.clip(np.log(values), low, high)
        return BSpline.design_matrix(clipped, knots, 3).toarray()

    at_points = design(x)
    weights = np.linalg.lstsq(at_points, np.log(y), rcond=None)[0]
    return lambda values: design(values) @ weights, np.log(y) - at_points @ weights


def rms_residual(x: Array, y: Array) -> float:
    """What the master curve leaves of ln y, root mean square in per cent."""
    return root_mean_square(master_curve(x, y)[1], NUMBERS)


def residual_of(points: Points, c: float, d: float) -> float:
    """Residual of Δx/n^d over ν n^c."""
    return rms_residual(points.frequency * points.links**c, points.distance / points.links**d)


def best_variable(points: Points) -> float:
    """Exponent c of x = ν n^c with the least residual of Δx/n."""
    first = min(np.linspace(-1.5, 1.0, 26), key=lambda c: residual_of(points, c, 1.0))
    settings = {"bounds": (first - 0.1, first + 0.1), "method": "bounded", "options": {"xatol": 1e-4}}
    return float(minimize_scalar(lambda c: residual_of(points, c, 1.0), **settings).x)


def best_powers(points: Points) -> tuple[float, float]:
    """Exponents (c, d) of Δx/n^d over ν n^c with the least residual."""
    settings = {"method": "Nelder-Mead", "options": {"xatol": 1e-4, "fatol": 1e-5}}
    return tuple(minimize(lambda powers: residual_of(points, *powers), (-1.1, 1.1), **settings).x)


def root_mean_square(left: Array, numbers: int = 0) -> float:
    """Root mean square in per cent of residuals that a fit of so many numbers leaves."""
    return float(100 * np.sqrt(np.sum(left**2) / max(len(left) - numbers, 1)))


def slopes(points: Points) -> str:
    """Steepness of the curve of Δx/(nℓ) over v/(nℓ) at some places, in words."""
    x, curve, width = points.turns, master_curve(points.turns, points.lengths)[0], 1.05
    places = np.array([place for place in PLACES if x.min() * width < place < x.max() / width])
    rise = (curve(places * width) - curve(places / width)) / (2 * np.log(width))
    texts = [
        f"{np.exp(value):.2g} at {place:g}/s (slope {slope:.1f})"
        for place, value, slope in zip(places, curve(places), rise, strict=True)
    ]
    return f"Δx/(nℓ) over v/(nℓ) is {', '.join(texts)}."
