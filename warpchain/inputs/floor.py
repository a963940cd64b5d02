"""The floor of a scene: flat, an endless slope, or a profile of heights given by points.

Points are joined by straight lines; beyond the first and the last point these go on. Nothing hangs over.
"""

import itertools
import math
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, Strict

from warpchain.inputs.validation import InputError

Array = NDArray[np.float64]

MOST_POINTS: Final = 256
"""Most points of a profile; each takes time where a chain is near it."""
SHORTEST: Final = 1e-5
"""Least length of a face [m], a thousandth of a link of Table 1."""
FARTHEST: Final = 1e4
"""Greatest coordinate of a point, where numbers still tell a thousandth of a nanometre [m]."""
EXACT: Final = 1e-11
"""Clearances are met to this [m]."""


def _without_overhang(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """The points of a profile, if they make a floor."""
    if len(points) < 2:
        raise ValueError("a profile has 2 points at least; give more, such as [[0, 0], [1, 0], [1, -0.1], [2, -0.1]]")
    for number, ((x, y), (next_x, next_y)) in enumerate(itertools.pairwise(points), start=1):
        if next_x < x:
            raise ValueError(f"point {number} lies behind the one before it; let x rise from point to point")
        if math.hypot(next_x - x, next_y - y) < SHORTEST:
            raise ValueError(f"point {number} is less than {SHORTEST} m from the one before it; leave one out")
        if next_x == x and number in (1, len(points) - 1):
            raise ValueError("the first and the last face go on without end; let x rise along them")
        if number > 1 and points[number - 2][0] == next_x:
            raise ValueError(f"point {number} is the third above one another; leave the middle one out")
    return points


_Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
_Point = Annotated[tuple[_Coordinate, _Coordinate], Strict(False)]
Points = Annotated[
    tuple[_Point, ...],
    Strict(False),
    Field(max_length=MOST_POINTS),
    AfterValidator(_without_overhang),
]
"""A profile: points x, y [m]."""


def slope_points(degrees: float) -> Array:
    """Two points of a slope through the origin that falls towards +x."""
    angle = math.radians(degrees)
    return np.array([[0.0, 0.0], [math.cos(angle), -math.sin(angle)]])


def heights(points: Array, x: Array) -> Array:
    """Height [m] of the floor at x; at an upright face that of one of its ends."""
    left, right = points[0, 0], points[-1, 0]
    rise = [float(step[1] / step[0]) for step in (points[1] - points[0], points[-1] - points[-2])]
    beyond = rise[0] * np.minimum(x - left, 0.0) + rise[1] * np.maximum(x - right, 0.0)
    height: Array = np.interp(x, points[:, 0], points[:, 1]) + beyond
    return height


def distances(points: Array, places: Array) -> Array:
    """Distance [m] of places (p, 2) from the floor, negative below it."""
    begin, step = points[:-1], np.diff(points, axis=0)
    low, high = np.zeros(len(step)), np.ones(len(step))
    low[0], high[-1] = -np.inf, np.inf
    to = places[:, None] - begin
    share = np.clip((to * step).sum(axis=2) / (step**2).sum(axis=1), low, high)
    least: Array = np.linalg.norm(to - share[..., None] * step, axis=2).min(axis=1)
    return np.where(places[:, 1] >= heights(points, places[:, 0]), least, -least)


def circles_of(position: Array, link_length: float) -> Array:
    """Centres of the circles of links (n, 3), (2 n, 2): the left ones, then the right ones."""
    arms = link_length / 2 * np.stack([np.cos(position[:, 2]), np.sin(position[:, 2])], axis=1)
    return np.concatenate([position[:, :2] - arms, position[:, :2] + arms])


def check_above(points: Array | None, position: Array, link_length: float, path: str) -> None:
    """Check that the middle of no circle of links (n, 3) is below the floor, where it would never come out.

    Raises:
        InputError: one is; the message begins with `path`.
    """
    circles = circles_of(position, link_length)
    depth = -(circles[:, 1] if points is None else distances(points, circles))
    if depth.max() > 0:
        raise InputError(
            f"{path}: link {int(depth.argmax()) % len(position)} starts {depth.max():.3g} m inside the floor; "
            "raise the chain, or lower the floor"
        )


def raised_by(points: Array, circles: Array, radius: float, clearance: float) -> float:
    """How far circles about these places (p, 2) must be raised for the nearest to be so far from the floor [m]."""
    wanted, (left, bottom), (right, _) = clearance + radius, circles.min(axis=0), circles.max(axis=0)
    beside = points[(points[:, 0] >= left - wanted) & (points[:, 0] <= right + wanted), 1]
    high = max([*beside, *heights(points, np.array([left - wanted, right + wanted]))]) + wanted - bottom
    while (excess := distances(points, circles + np.array([0.0, high])).min() - wanted) > EXACT:
        high -= excess  # which brings nothing nearer to the floor than that
    return float(high)
