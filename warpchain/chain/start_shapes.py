"""Lays closed chains of rigid links along a curve, at rest or circulating, as initial states of walks.

Joints must close the loop to rounding: at k = 1e9 N/m an opening of 0.1 mm holds 5 J. So Newton's method solves for the
joints' places on the curve together with the curve's size. The circulating velocities are the exact rigid motion along
the curve: the derivative of that solution with respect to the first joint's place.

Many chains are laid at once, as arrays with one column for each chain. No number of a chain depends on the others.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpchain.inputs.arrays import Array

MOST_ITERATIONS: Final = 50
"""Newton's method takes five to ten for chains that fit their curves."""
MISFIT: Final = 1e-9
"""Greatest relative error of a link's length in a chain that is laid."""


CACHED: Final = 16
"""Chains whose curves are divided finely at the same time: such arrays stay in a core's cache."""


@dataclass(frozen=True)
class Curve:
    """A family of closed curves P(s, size), clockwise in s, for w chains at once.

    `points` maps s, (m, w), and sizes, (w,), to P [m], ∂P/∂s, and ∂P/∂size at fixed s, (2, m, w) each; `period` sizes
    to the periods of s, and `period_growth` is their derivative; `first_size` maps lengths of chains [m] to sizes for
    Newton's method to start from. `pace` maps s, (m, k), all sizes, and numbers of k chains to |∂P/∂s|, (m, k), where s
    is an angle, of period 2π; if s is a length along the curve, it is None.
    """

    points: Callable[[Array, Array], tuple[Array, Array, Array]]
    period: Callable[[Array], Array]
    period_growth: float
    first_size: Callable[[Array], Array]
    pace: Callable[[Array, Array, NDArray[np.intp]], Array] | None = None


def stadium(radius: ArrayLike) -> Curve:
    """Upper half circle about the origin, two vertical straights, lower half circle: a chain hung on a sprocket.

    Its size is the length of a straight [m], s the arc length from the top [m], `radius` that of the half circles [m],
    one for all chains or one for each, (w,).
    """
    radii = np.atleast_1d(np.asarray(radius, dtype=float))
    quarter = np.pi * radii / 2

    def points(s: Array, straight: Array) -> tuple[Array, Array, Array]:
        turn, s = 4 * quarter + 2 * straight, s.copy()
        beyond = np.flatnonzero((s < 0) | (s >= turn))  # the first lap, in which most places lie
        laps, s.flat[beyond] = np.divmod(s.flat[beyond], turn[beyond % len(turn)])
        down, up = s - quarter, s - 3 * quarter - straight  # distances along the two straights
        for way in (down, up):
            np.minimum(np.maximum(way, 0.0, out=way), straight, out=way)
        angle = (s - down - up) / radii
        along = np.empty((2, *s.shape))
        np.cos(angle, out=along[0])
        np.sin(angle, out=along[1])
        ends = radii * along[::-1]
        ends[1] -= down
        ends[1] += up
        np.negative(along[1], out=along[1])
        # A longer straight moves points at the same s: past its end on the right, past its start and end on the left.
        down_growth = (s > quarter + straight).view(np.int8)
        up_growth = 2 * (s > turn - quarter).view(np.int8) - (s > 3 * quarter + straight)
        onward = (down_growth + up_growth).astype(float)
        onward.flat[beyond] += 2 * laps  # every lap before grows as well
        growth = -onward * along
        growth[1] += up_growth - down_growth
        return ends, along, growth

    return Curve(
        points=points,
        period=lambda size: 4 * quarter + 2 * size,
        period_growth=2.0,
        first_size=lambda length: np.maximum((length - 4 * quarter) / 2, 0.0),
    )


def ellipse(aspect: ArrayLike) -> Curve:
    """An ellipse about the origin; `aspect` is its height over its width, one for all chains or one for each, (w,).

    Its size is the geometric mean of the semi-axes [m], s the angle of the parametric form from the top [rad].
    """
    aspects = np.atleast_1d(np.asarray(aspect, dtype=float))
    wide, high = 1 / np.sqrt(aspects), np.sqrt(aspects)

    def points(s: Array, scale: Array) -> tuple[Array, Array, Array]:
        sine, cosine = np.sin(s), np.cos(s)
        unit = np.stack([wide * sine, high * cosine])
        along = np.stack([wide * cosine, -high * sine])
        return scale * unit, scale * along, unit

    def pace(s: Array, scale: Array, at: NDArray[np.intp]) -> Array:
        across, up = np.cos(s), np.sin(s)
        for way, half in ((across, wide), (up, high)):
            way *= np.broadcast_to(half, len(scale))[at]
            way *= scale[at]
            way *= way
        across += up
        return np.sqrt(across, out=across)

    return Curve(
        points=points,
        period=lambda size: np.full_like(size, 2 * np.pi),
        period_growth=0.0,
        first_size=lambda length: length / np.array([_circumference(each) for each in aspects.tolist()]),
        pace=pace,
    )


@functools.lru_cache
def _circumference(aspect: float) -> float:
    """Circumference of an ellipse whose semi-axes have the geometric mean 1."""
    angles = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    pace = np.hypot(1 / np.sqrt(aspect) * np.cos(angles), np.sqrt(aspect) * np.sin(angles))
    return float(np.mean(pace) * 2 * np.pi)


def lay_chain(
    curve: Curve, links: int, link_length: float, speed: float = 0.0, phase: float = 0.0
) -> tuple[Array, Array]:
    """Lay the joints of one closed chain along a curve, see `lay_chains`; a `ValueError` says that it does not fit.

    Returns:
        position (n, 3): x, y [m], θ [rad] of the links, numbered clockwise, and velocity (n, 3), their rates.
    """
    position, velocity, fits = lay_chains(curve, links, *(np.array([value]) for value in (link_length, speed, phase)))
    if not fits[0]:
        raise ValueError(f"a closed chain of {links} links of {link_length} m does not fit this curve")
    return position[0], velocity[0]


def lay_chains(
    curve: Curve, links: int, link_length: Array, speed: Array, phase: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Lay the joints of w closed chains of n links along curves of one family.

    Args:
        curve: The family, of one shape for all chains or of one for each.
        links: Number n of links of each chain.
        link_length: Length of the links of each chain [m], (w,).
        speed: Mean speed with which the joints move clockwise [m/s], (w,).
        phase: Place of the first joint, as a fraction of the curve's period, (w,).

    Returns:
        position (w, n, 3): x, y [m], θ [rad] of the links, numbered clockwise; velocity (w, n, 3), their rates; and
        whether each chain fits its curve, (w,). Rows of chains that do not are no chains.
    """
    size = curve.first_size(links * link_length)
    s = curve.period(size) * (phase + np.arange(links + 1)[:, np.newaxis] / links)
    if curve.pace is not None:
        s[:-1] = _evenly_spaced(curve.pace, links, s[0], size)
    worst, is_done = np.full(len(size), np.inf), np.zeros(len(size), dtype=bool)
    for _ in range(MOST_ITERATIONS):
        period = curve.period(size)
        s[0] = phase * period
        s[-1] = s[0] + period
        ends, along, growth = curve.points(s, size)
        chord = ends[:, 1:] - ends[:, :-1]
        missing = link_length**2 - _dot(chord, chord)
        here, following = _dot(chord, along[:, :-1]), _dot(chord, along[:, 1:])
        to_size = _dot(chord, growth[:, 1:] - growth[:, :-1])
        # The first joint moves with the period; the last chord ends on it one period later.
        to_size[0] -= here[0] * phase * curve.period_growth
        to_size[-1] += following[-1] * (1 + phase) * curve.period_growth
        last, worst = worst, np.abs(missing).max(0)
        is_done |= (last < MISFIT * link_length**2) & (worst > last / 2)  # rounding is reached
        if is_done.all():
            break
        missing /= 2
        change = _solve_loop(here, following, to_size, missing)
        is_done |= ~np.isfinite(change).all(0)
        change[:, is_done] = 0.0
        s[1:-1] += change[:-1]
        size = np.maximum(size + change[-1], 0.0)
    along, growth = along[:, :-1], growth[:, :-1]
    # Rigid motion along the curve: s[0] moves at unit rate, the chords keep their lengths.
    drive = np.zeros_like(here)
    drive[0] = here[0]
    drive[-1] -= following[-1]
    rates = _solve_loop(here, following, to_size, drive)
    size_rate = rates[-1]
    along_rates = np.concatenate([(1.0 + phase * curve.period_growth * size_rate)[np.newaxis], rates[:-1]])
    joint_rate = along_rates * along + size_rate * growth
    joint_rate *= speed / np.sqrt(_dot(joint_rate, joint_rate).T.copy()).mean(-1)
    fits = worst <= 2 * MISFIT * link_length**2
    return *links_between(ends[:, :-1].T, joint_rate.T), fits


def _dot(first: Array, second: Array) -> Array:
    """Scalar products of vectors (2, …)."""
    products: Array = first[0] * second[0]
    products += first[1] * second[1]
    return products


def _evenly_spaced(
    pace: Callable[[Array, Array, NDArray[np.intp]], Array], links: int, first: Array, size: Array
) -> Array:
    """Places s, (n, w), of joints that divide each curve into about equal arcs from a first place on, (w,)."""
    places = np.empty((links, len(size)))
    for at in np.split(np.arange(len(size)), range(CACHED, len(size), CACHED)):
        fine = first[at, np.newaxis] + np.linspace(0.0, 2 * np.pi, 1024)
        paces, arc = pace(fine.T, size, at).T, np.zeros_like(fine)
        np.cumsum((paces[:, 1:] + paces[:, :-1]) / 2 * (fine[:, 1:] - fine[:, :-1]), axis=1, out=arc[:, 1:])
        marks = arc[:, -1:] * np.arange(links) / links
        places[:, at] = np.transpose([np.interp(*each) for each in zip(marks, arc, fine, strict=True)])
    return places


def _solve_loop(here: Array, following: Array, to_size: Array, right: Array) -> Array:
    """Solve the n equations of each loop's chords for the changes of s[1:] and of the size, all shapes (n, w).

    Chord i: following[i] δs[i + 1] − here[i] δs[i] + to_size[i] δsize = right[i], with δs[0] = δs[n] = 0.
    From the first chord on, each gives the next δs as a − b δsize; the last one then gives δsize.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a singular loop gives no finite change
        scale = (here[:-1] / following[:-1]).cumprod(0)  # of each δs per first δs
        divisor = following[:-1] * scale
        constant, slope = (scale * (side[:-1] / divisor).cumsum(0) for side in (right, to_size))
        size = (right[-1] + here[-1] * constant[-1]) / (to_size[-1] + here[-1] * slope[-1])
        return np.concatenate([constant - slope * size, size[np.newaxis]])


def links_between(joints: Array, joint_rate: Array) -> tuple[Array, Array]:
    """Links that span the joints, (…, n, 2) [m], link i from joint i − 1 to joint i: positions, velocities (…, n, 3).

    The rates of the joints, (…, n, 2) [m/s], keep all distances of neighbours.
    """
    before, before_rate = np.roll(joints, 1, axis=-2), np.roll(joint_rate, 1, axis=-2)
    x, y = np.moveaxis(joints - before, -1, 0)
    x_rate, y_rate = np.moveaxis(joint_rate - before_rate, -1, 0)
    position, velocity = np.empty((2, *x.shape, 3))
    position[..., :2] = (joints + before) / 2
    position[..., 2] = np.unwrap(np.arctan2(y, x))
    velocity[..., :2] = (joint_rate + before_rate) / 2
    velocity[..., 2] = (x * y_rate - y * x_rate) / (x * x + y * y)
    return position, velocity
