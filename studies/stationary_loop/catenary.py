"""The catenary: the curve in which a chain hangs that neither runs nor resists bending."""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.stationary_loop.theory import MeanLoop

Array = NDArray[np.float64]

POINTS: Final = 801
"""Number of points of a catenary."""


class Catenary(NamedTuple):
    """A hanging chain, as functions of the arc length at g points; signs as of `walk.mean_loop()`.

    Attributes:
        s: arc length from the lowest point [m], shape (g,).
        position: x, y [m], shape (g, 2).
        angle: φ [rad], shape (g,).
        curvature: κ [1/m], shape (g,).
        effective_tension: T_e [N], shape (g,).
    """

    s: Array
    position: Array
    angle: Array
    curvature: Array
    effective_tension: Array


def catenary_of(loop: MeanLoop) -> Catenary:
    """The catenary between the ends of the free part of a mean loop and as long as it; errors as below."""
    first, last = (np.array([np.interp(s, loop.s, column) for column in loop.position.T]) for s in loop.free)
    weight = loop.parameters.density * loop.parameters.gravity
    return catenary_between(first, last, loop.free[1] - loop.free[0], weight)


def catenary_between(first: Array, last: Array, length: float, weight: float) -> Catenary:
    """The catenary of a given length between two ends.

    With the width w and the height difference h, a curve y = c cosh((x − x₀)/c) has 2 c sinh(w/2c) = √(L² − h²).

    Args:
        first: x, y [m] of the first end.
        last: of the other one, which is farther left.
        length: L [m].
        weight: per length [N/m].

    Raises:
        ValueError: the length is not greater than the distance of the ends.
    """
    width, rise = float(first[0] - last[0]), float(last[1] - first[1])
    square = length**2 - rise**2
    if width <= 0 or square <= width**2:
        raise ValueError("a catenary of this length does not reach from one end to the other; check both")
    ratio = math.sqrt(square) / width  # of sinh(z) to z, z = w/2c
    z = math.sqrt(6 * (ratio - 1)) if ratio < 2 else math.log(2 * ratio) + math.log(math.log(2 * ratio))
    for _ in range(100):
        z -= (math.sinh(z) - ratio * z) / (math.cosh(z) - ratio)
    c = width / (2 * z)
    from_lowest = width / 2 - c * math.atanh(rise / length)  # x of the first end, from the lowest point
    s = -c * math.sinh(from_lowest / c) + np.linspace(0.0, length, POINTS)
    lowest = first[0] - from_lowest, first[1] - c * (math.cosh(from_lowest / c) - 1)
    return Catenary(
        s=s,
        position=np.stack([lowest[0] - c * np.arcsinh(s / c), lowest[1] + np.hypot(s, c) - c], axis=1),
        angle=np.arctan(s / c),
        curvature=c / (s**2 + c**2),
        effective_tension=weight * np.hypot(s, c),
    )
