"""The floor of a walk: flat, an infinite slope, or a profile given by points.

No other module knows the kinds. A new one is a branch of `FloorField` in `warpchain.inputs.compound_fields`, a subclass
of `Floor`, a line of `floor_from`.
"""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError
from warpchain.kernels import layout

EXACT: Final = 1e-11
"""Clearances are met to this [m]."""
STEPS: Final = 200
"""Most steps, each by the room that is left, to a clearance; Table 1's chain takes 114 on the steepest slope."""
ENDLESS: Final = 1e9
"""How far the first and the last cell of a profile reach [m]."""


class Floor:
    """A floor: points joined by straight lines, of which the first and the last extend to infinity.

    Nothing hangs over. Another kind of floor is a subclass with a body of its own and all that asks for the points. The
    body is a name among the `BODIES` of `warpchain.kernels.contacts.fixed_body`, of two points a slope; points are x
    and y [m], (f + 1, 2), laws coefficients of restitution and friction of the f faces, (f, 2).
    """

    def __init__(self, points: ArrayLike, laws: ArrayLike) -> None:
        """Begin a floor of these points and coefficients."""
        self.points, self.laws = np.array(points, np.float64), np.array(laws, np.float64)
        self.body = "slope" if len(self.points) == 2 else "terrain"

    def faces(self) -> Array:
        """What kernels read of its faces, (f, FACE_VALUES), see `warpchain.kernels.contacts.terrain`."""
        step = np.diff(self.points, axis=0)
        length = np.hypot(*step.T)
        along = step / length[:, None]
        turn = along[:-1, 0] * along[1:, 1] - along[:-1, 1] * along[1:, 0]
        before = np.zeros_like(along)
        before[1:] = np.where((turn < 0)[:, None], along[:-1], 0.0)
        begin, end = np.zeros(len(along)), length
        begin[0], end[-1] = -np.inf, np.inf
        return np.column_stack([self.points[:-1], along, before, begin, end, self.laws])

    def cells(self, link_length: float, circle_radius: float) -> Array:
        """Cells that tell which of several faces are near links of one size, (GROUND_CELLS + 1, CELL_VALUES)."""
        points, (left, right) = self.points, self.points[[0, -1], 0]
        if len(points) == 2:
            return np.empty((0, layout.CELL_VALUES))
        width = (right - left) / layout.GROUND_CELLS
        margin = link_length
        reach = margin + 1.01 * (link_length / 2 + circle_radius)
        lows = left + width * np.arange(layout.GROUND_CELLS) - reach
        highs = lows + width + 2 * reach
        lows[0], highs[-1] = -ENDLESS, ENDLESS
        first = np.searchsorted(points[1:-1, 0], lows, side="left")
        last = np.searchsorted(points[1:-1, 0], highs, side="right")
        x, y = points.T
        inside = np.where((x >= lows[:, None]) & (x <= highs[:, None]), y, -np.inf).max(axis=1)
        top = np.maximum(inside, self.heights(np.stack([lows, highs])).max(axis=0))
        return np.vstack([np.column_stack([first, last, top]), [left, 1 / width, margin]])

    def heights(self, x: Any) -> Any:
        """Height [m] of the floor at x; at an upright face that of one of its ends."""
        points, (left, right) = self.points, self.points[[0, -1], 0]
        rise = [float(step[1] / step[0]) for step in (points[1] - points[0], points[-1] - points[-2])]
        beyond = rise[0] * np.minimum(x - left, 0.0) + rise[1] * np.maximum(x - right, 0.0)
        return np.interp(x, points[:, 0], points[:, 1]) + beyond

    def distances(self, places: Array) -> Array:
        """Distance [m] of places (p, 2) from the floor, negative below it."""
        begin, step = self.points[:-1], np.diff(self.points, axis=0)
        low, high = np.zeros(len(step)), np.ones(len(step))
        low[0], high[-1] = -np.inf, np.inf
        to = places[:, None] - begin
        share = np.clip((to * step).sum(axis=2) / (step**2).sum(axis=1), low, high)
        least: Array = np.linalg.norm(to - share[..., None] * step, axis=2).min(axis=1)
        return np.where(places[:, 1] >= self.heights(places[:, 0]), least, -least)

    def line(self, left: float, right: float) -> Array:
        """Points (p, 2) that straight lines join to the floor from one x to another, or to what is hardly above it."""
        ends, x = np.array([left, right]), self.points[:, 0]
        first, last = np.column_stack([ends, self.heights(ends)])
        return np.vstack([first, self.points[(x > left) & (x < right)], last])

    def check_above(self, position: Array, link_length: float, path: str) -> None:
        """Refuse links (n, 3) with the middle of a circle below the floor; an `InputError` that begins with `path`."""
        depth = -self.distances(circles_of(position, link_length))
        if depth.max() > 0:
            link = int(depth.argmax()) % len(position)
            raise InputError(f"{path}: link {link} starts {depth.max():.3g} m inside the floor; raise the chain")

    def raised_by(self, circles: Array, radius: Array, clearance: float) -> float:
        """How far links must be raised for the nearest to have a clearance from the floor [m].

        Given are their left circles, then their right ones, (2 n, 2), and their radii, (2 n,); between them links are
        as broad. Above a corner the clearance may be less by 3 % of a link's length.
        """
        begin, end = np.split(circles, 2)
        circles = np.concatenate([circles, *(begin + share * (end - begin) for share in (0.25, 0.5, 0.75))])
        radius = np.tile(radius[: len(begin)], 5)
        wanted, (left, bottom), (right, _) = clearance + radius.max(), circles.min(axis=0), circles.max(axis=0)
        high = self.line(left - wanted, right + wanted)[:, 1].max() + wanted - bottom
        low = float((self.heights(circles[:, 0]) - circles[:, 1]).max())  # the middle of a circle is on the floor

        def room(height: float) -> float:
            return float((self.distances(circles + np.array([0.0, height])) - (clearance + radius)).min())

        for _ in range(STEPS):
            if (excess := room(high)) <= EXACT:
                return float(high)
            high -= excess  # which brings nothing nearer to the floor than that
        for _ in range(60):  # such steps are short beside a steep face; 60 halves of a kilometre are below EXACT
            middle = (low + high) / 2
            low, high = (middle, high) if room(middle) < 0 else (low, middle)
        return float(high)


class Flat(Floor):
    """The floor y = 0, for which kernels need no faces."""

    def __init__(self, laws: ArrayLike) -> None:
        """Begin a floor with these coefficients, (1, 2)."""
        self.points, self.laws, self.body = _LEVEL, np.array(laws, np.float64), "floor"

    def faces(self) -> Array:
        """See `Floor`."""
        return np.empty((0, layout.FACE_VALUES))

    def heights(self, x: Any) -> Any:
        """See `Floor`."""
        return np.zeros(np.shape(x))


def raised_by(
    floors: Sequence[Floor | None], position: Array, link_length: Array, radius: Array, clearance: Array
) -> Array:
    """How far each of w chains of n links must be raised to its clearance from its floor [m], (w,); None: y = 0.

    Given are positions, (w, n, 3), radii of the links' circles, (w, n), lengths of links and clearances, (w,).
    """
    middle, arm = position[..., 1], link_length[:, np.newaxis] / 2 * np.sin(position[..., 2])
    raised: Array = clearance - np.minimum(middle - arm - radius, middle + arm - radius).min(-1)
    for place, floor in enumerate(floors):
        if floor is not None:
            circles = circles_of(position[place], link_length[place])
            raised[place] = floor.raised_by(circles, np.tile(radius[place], 2), float(clearance[place]))
    return raised


def floor_from(given: Any, slope: float, law: tuple[float, float]) -> Floor:
    """The floor of a scene: from its checked field `floor`, its slope [°], and e and μ where it gives none."""
    if given == "flat":
        return Flat([law]) if slope == 0 else Floor(slope_points(slope), [law])
    return Floor([point[:2] for point in given], [point[2:] or law for point in given[:-1]])


def slope_points(degrees: float) -> Array:
    """Two points of a slope through the origin that falls towards +x."""
    angle = math.radians(degrees)
    return np.array([[0.0, 0.0], [math.cos(angle), -math.sin(angle)]])


_LEVEL: Final = slope_points(0.0)


def circles_of(position: Array, link_length: ArrayLike) -> Array:
    """Centres of the circles of links (…, n, 3), (…, 2 n, 2): the left ones, then the right ones.

    Each chain has a length of its links [m], (…).
    """
    half, angle = np.asarray(link_length)[..., np.newaxis, np.newaxis] / 2, position[..., 2]
    arms = half * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.concatenate([position[..., :2] - arms, position[..., :2] + arms], axis=-2)
