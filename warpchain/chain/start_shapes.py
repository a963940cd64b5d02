"""Closed chains of rigid links laid along a curve, at rest or circulating.

Joints must close the loop to rounding: at k = 1e9 N/m an opening of 0.1 mm holds 5 J. So Newton's method solves for the
joints' places on the curve together with the curve's size. The circulating velocities are the exact rigid motion along
the curve: the derivative of that solution with respect to the first joint's place.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from warpchain.inputs.arrays import Array


@dataclass(frozen=True)
class Curve:
    """A family of closed curves P(s, size), clockwise in s.

    `points` maps s, (m,), and a size to P [m], ∂P/∂s, and ∂P/∂size at fixed s, (2, m) each; `period` a size to the
    period of s and its derivative; `first_size` the length of a chain [m] to a size for Newton's method to start from.
    """

    points: Callable[[Array, float], tuple[Array, Array, Array]]
    period: Callable[[float], tuple[float, float]]
    first_size: Callable[[float], float]


def stadium(radius: float) -> Curve:
    """Upper half circle about the origin, two vertical straights, lower half circle: a chain hung on a sprocket.

    Its size is the length of a straight [m], s the arc length from the top [m], `radius` that of the half circles [m].
    """
    quarter = np.pi * radius / 2

    def points(s: Array, size: float) -> tuple[Array, Array, Array]:
        turn = 4 * quarter + 2 * size
        laps, s = np.divmod(s, turn)
        down = np.minimum(np.maximum(s - quarter, 0.0), size)  # distances along the two straights
        up = np.minimum(np.maximum(s - 3 * quarter - size, 0.0), size)
        angle = (s - down - up) / radius
        sine, cosine = np.sin(angle), np.cos(angle)
        along = np.array([cosine, -sine])
        # A longer straight moves points at the same s: past its end on the right, past its start and end on the left.
        down_growth = (s > quarter + size) * 1.0
        up_growth = (s > turn - quarter) * 2.0 - (s > 3 * quarter + size)
        growth = -(down_growth + up_growth + 2 * laps) * along  # every lap before grows as well
        growth[1] += up_growth - down_growth
        point = np.array([radius * sine, radius * cosine - down + up])
        return point, along, growth

    return Curve(
        points=points,
        period=lambda size: (4 * quarter + 2 * size, 2.0),
        first_size=lambda length: max((length - 4 * quarter) / 2, 0.0),
    )


@functools.lru_cache
def ellipse(aspect: float) -> Curve:
    """An ellipse about the origin; `aspect` is its height over its width.

    Its size is the geometric mean of the semi-axes [m], s the angle of the parametric form from the top [rad].
    """
    wide, high = 1 / np.sqrt(aspect), np.sqrt(aspect)

    def points(s: Array, size: float) -> tuple[Array, Array, Array]:
        sine, cosine = np.sin(s), np.cos(s)
        unit = np.array([wide * sine, high * cosine])
        along = np.array([wide * cosine, -high * sine])
        return size * unit, size * along, unit

    angles = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    unit_length = float(np.mean(np.hypot(wide * np.cos(angles), high * np.sin(angles))) * 2 * np.pi)
    return Curve(points=points, period=lambda size: (2 * np.pi, 0.0), first_size=lambda length: length / unit_length)


def lay_chain(
    curve: Curve, links: int, link_length: float, speed: float = 0.0, phase: float = 0.0
) -> tuple[Array, Array]:
    """Lay the joints of a closed chain along a curve, the first at a phase, a fraction of the curve's period.

    They move clockwise at a mean speed [m/s]. A `ValueError` says that no closed chain of these links fits the curve.

    Returns:
        position (n, 3): x, y [m], θ [rad] of the links, numbered clockwise, and velocity (n, 3), their rates.
    """
    size = curve.first_size(links * link_length)
    s = curve.period(size)[0] * (phase + np.arange(links) / links)
    if curve.period(size)[1] == 0.0:  # s is no arc length: even the chords out first
        fine = s[0] + np.linspace(0.0, curve.period(size)[0], 1024)
        pace = np.sqrt(np.sum(curve.points(fine, size)[1] ** 2, axis=0))
        arc = np.concatenate([[0.0], np.cumsum((pace[1:] + pace[:-1]) / 2 * np.diff(fine))])
        s = np.interp(arc[-1] * np.arange(links) / links, arc, fine)
    worst = np.inf
    for _ in range(50):
        period, period_growth = curve.period(size)
        s[0] = phase * period
        ends, along, growth = curve.points(np.concatenate([s, [s[0] + period]]), size)
        chord = ends[:, 1:] - ends[:, :-1]
        residual = (chord * chord).sum(0) - link_length**2
        to_here = -2 * (chord * along[:, :-1]).sum(0)
        to_following = 2 * (chord * along[:, 1:]).sum(0)
        to_size = 2 * (chord * (growth[:, 1:] - growth[:, :-1])).sum(0)
        # The first joint moves with the period; the last chord ends on it one period later.
        to_size[0] += to_here[0] * phase * period_growth
        to_size[-1] += to_following[-1] * (1 + phase) * period_growth
        last, worst = worst, float(np.abs(residual).max())
        if last < 1e-9 * link_length**2 and worst > last / 2:  # rounding is reached
            break
        change = _solve_loop(to_here, to_following, to_size, -residual)
        if not np.isfinite(change).all():
            break
        s[1:] += change[:-1]
        size = max(size + float(change[-1]), 0.0)
    joints, along, growth = ends[:, :-1], along[:, :-1], growth[:, :-1]
    if not (np.abs(np.hypot(*chord) - link_length) <= 1e-9 * link_length).all():
        raise ValueError(f"a closed chain of {links} links of {link_length} m does not fit this curve")
    # Rigid motion along the curve: s[0] moves at unit rate, the chords keep their lengths.
    drive = np.zeros(links)
    drive[0] = -to_here[0]
    drive[-1] -= to_following[-1]
    rates = _solve_loop(to_here, to_following, to_size, drive)
    first_rate = 1.0 + phase * period_growth * rates[-1]
    joint_rate = np.concatenate([[first_rate], rates[:-1]]) * along + rates[-1] * growth
    joint_rate *= speed / np.sqrt((joint_rate * joint_rate).sum(0)).mean()
    return links_between(joints.T, joint_rate.T)


def _solve_loop(to_here: Array, to_following: Array, to_size: Array, right: Array) -> Array:
    """Solve the n equations of a loop's chords for the changes of s[1:] and of the size, all shapes (n,).

    Chord i: to_here[i] δs[i] + to_following[i] δs[i + 1] + to_size[i] δsize = right[i], with δs[0] = δs[n] = 0.
    From the first chord on, each gives the next δs as a + b δsize; the last one then gives δsize.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a singular loop gives no finite change
        scale = (-to_here[:-1] / to_following[:-1]).cumprod()  # of each δs per first δs
        divisor = to_following[:-1] * scale
        constant, slope = (scale * (side[:-1] / divisor).cumsum() for side in (right, -to_size))
        size = (right[-1] - to_here[-1] * constant[-1]) / (to_size[-1] + to_here[-1] * slope[-1])
        return np.concatenate([constant + slope * size, [size]])


def links_between(joints: Array, joint_rate: Array) -> tuple[Array, Array]:
    """Links that span the joints, (n, 2) [m], link i from joint i − 1 to joint i: positions and velocities, (n, 3).

    The rates of the joints, (n, 2) [m/s], keep all distances of neighbours.
    """
    order = np.arange(len(joints)) - 1
    before, before_rate = joints[order], joint_rate[order]
    span, span_rate = joints - before, joint_rate - before_rate
    angle = np.unwrap(np.arctan2(span[:, 1], span[:, 0]))
    spin = (span[:, 0] * span_rate[:, 1] - span[:, 1] * span_rate[:, 0]) / np.sum(span**2, axis=1)
    position = np.column_stack([(joints + before) / 2, angle])
    velocity = np.column_stack([(joint_rate + before_rate) / 2, spin])
    return position, velocity
