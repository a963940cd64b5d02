"""The theory of the free part of a stationary loop: its balances as a boundary value problem.

With the signs of `walk.mean_loop()`, p = κ' and M = f(ℓ v p), where f(w) = β w + τ_c tanh(w/ω_c):

    x' = −cos φ    y' = sin φ    φ' = κ    κ' = p    T_e' = N κ + ρ g sin φ    N' = ρ g cos φ − T_e κ
    p' = (j v² p − N) / (ℓ v f'(ℓ v p))

These are seven functions with seven conditions: x, y, φ, κ at the lift-off and x, y, φ at the touch-down, because the
theory does not include the sprocket. κ is given at the lift-off because the motion carries standing waves along: they
start there, and not at the touch-down. The length of the free part is given, too: it follows from the number of links.
Without friction and inertia T_e κ = ρ g cos φ: the catenary, for which only its ends and its length are given.

With a small ω_c the moment is almost a step wherever a joint changes its sense of rotation. The solver therefore starts
with large ω_c and ends at `LEAST_SMOOTHING`. Joints turn at 60 rad/s where the loop bends; from there to 0.1 rad/s
loops of 60 to 180 links at 10 to 30 Hz change by at most 0.1 mm and 0.05 1/m.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy import fftpack
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from studies.common import Array
from warpchain import Parameters

MeanLoop = Any  # What `walk.mean_loop()` returns

SMOOTHINGS = (300.0, 100.0, 30.0, 10.0, 3.0, 1.0)  # Smoothings ω_c [rad/s] before that of the chain
LEAST_SMOOTHING = 0.3  # Least smoothing ω_c [rad/s]
POINTS = 801  # Number of points of a theoretical loop
IN_LINKS = 1.0  # Theory ends this many links inside of the free part: averages near it include links that touch
EDGE = 4.0  # Links at either end of the free part that balances leave out: averages there include links on the sprocket


def bending_inertia(loop: MeanLoop) -> float:
    """j = (Ī − m̄ ℓ²/6)/ℓ of the chain of a loop [kg m]; may be negative."""
    p, length = loop.parameters, loop.parameters.link_length
    return float((p.inner_inertia + p.outer_inertia) / 2 / length - loop.density * length**2 / 6)


def moment(p: Parameters, spin: Array, smoothing: float) -> Array:
    """Friction moment f(w) = β w + τ_c tanh(w / ω_c) [N m] of a joint that turns at w [rad/s]."""
    return p.viscous_friction * spin + p.coulomb_friction * np.tanh(spin / smoothing)


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def places(loop: MeanLoop, s: Array) -> Array:
    """Points x, y of a loop at these arc lengths."""
    return np.stack([np.interp(s, loop.s, column) for column in loop.position.T], axis=-1)


@dataclass(frozen=True, eq=False, kw_only=True)
class TheoreticalLoop:
    """The free part in theory, at g points; all as `mean_loop()` has them, with its signs."""

    s: Array
    position: Array
    angle: Array
    curvature: Array
    effective_tension: Array
    shear: Array
    moment: Array


def predict(loop: MeanLoop, values: Mapping[str, float] | None = None) -> TheoreticalLoop:
    """The free part in theory, with the ends and the speed of a mean loop, the first guess, and other parameters.

    Joints have viscous friction, and may have Coulomb friction.
    """
    p = loop.parameters.with_values(values or {})
    inset = IN_LINKS * loop.parameters.link_length
    first, last = loop.free[0] + inset, loop.free[1] - inset
    s = np.linspace(first, last, 401)
    columns = (loop.angle, loop.curvature, loop.bending, loop.effective_tension, loop.shear)
    values = np.stack([np.interp(s, loop.s, values) for values in (*loop.position.T, *columns)])
    ends, share = values[:4, [0, -1]].T, np.linspace(0.0, 1.0, len(s))
    length, spin, weight = last - first, p.link_length * loop.speed, loop.density * p.gravity
    turning = bending_inertia(loop) * loop.speed**2

    def slope(smoothing: float, share: Array, values: Array) -> Array:
        _, _, angle, curvature, bend, tension, shear = values
        cosine, sine, tanh = np.cos(angle), np.sin(angle), np.tanh(spin * bend / smoothing)
        friction = p.viscous_friction + p.coulomb_friction / smoothing * (1 - tanh**2)
        rates = [-cosine, sine, curvature, bend, (turning * bend - shear) / (spin * friction)]
        return length * np.stack([*rates, shear * curvature + weight * sine, weight * cosine - tension * curvature])

    def conditions(start: Array, end: Array) -> Array:
        return np.concatenate([start[:4] - ends[0], end[:3] - ends[1, :3]])

    least = max(p.friction_smoothing, LEAST_SMOOTHING)
    for smoothing in (*(each for each in SMOOTHINGS if each > least and p.coulomb_friction > 0), least):
        found = solve_bvp(partial(slope, smoothing), conditions, share, values, tol=1e-4, max_nodes=20_000)
        if not found.success:
            reason = found.message.lower().rstrip(".")
            raise ArithmeticError(f"the boundary value problem was not solved ({reason})")
        share, values = found.x, found.y
    x, y, angle, curvature, bending, tension, shear = found.sol(np.linspace(0.0, 1.0, POINTS))
    s, lowest = length * np.linspace(0.0, 1.0, POINTS), int(np.argmin(y))
    around = slice(max(lowest - 2, 0), lowest + 3)
    return TheoreticalLoop(
        s=s - float(np.interp(0.0, angle[around], s[around])),
        position=np.stack([x, y], axis=1),
        angle=angle,
        curvature=curvature,
        effective_tension=tension,
        shear=shear,
        moment=moment(p, spin * bending, smoothing),
    )


def catenary_of(loop: MeanLoop) -> TheoreticalLoop:
    """The catenary between the ends of the free part of a mean loop and as long as it."""
    weight = loop.density * loop.parameters.gravity
    return catenary_between(*places(loop, np.array(loop.free)), loop.free[1] - loop.free[0], weight)


def catenary_between(first: Array, last: Array, length: float, weight: float) -> TheoreticalLoop:
    """The catenary of length L [m] and weight per length [N/m] between two ends x, y [m], the last one farther left.

    With the width w and the height difference h, a curve y = c cosh((x − x₀)/c) has 2 c sinh(w/2c) = √(L² − h²).
    """
    (width, _), rise = first - last, last[1] - first[1]
    square = length**2 - rise**2
    if width <= 0 or square <= width**2:
        raise ValueError("a catenary of this length does not reach from one end to the other; check both")
    ratio = np.sqrt(square) / width
    z = brentq(lambda z: np.sinh(z) / z - ratio, 1e-9, 2 + 2 * np.log(2 * ratio), xtol=1e-14)  # w/2c
    c = width / (2 * z)
    from_lowest = width / 2 - c * np.arctanh(rise / length)  # x of the first end, from the lowest point
    s = -c * np.sinh(from_lowest / c) + np.linspace(0.0, length, POINTS)
    lowest = first[0] - from_lowest, first[1] - c * (np.cosh(from_lowest / c) - 1)
    return TheoreticalLoop(
        s=s,
        position=np.stack([lowest[0] - c * np.arcsinh(s / c), lowest[1] + np.hypot(s, c) - c], axis=1),
        angle=np.arctan(s / c),
        curvature=c / (s**2 + c**2),
        effective_tension=weight * np.hypot(s, c),
        shear=0 * s,
        moment=0 * s,
    )


def imbalances(loop: MeanLoop) -> dict[str, tuple[float, float]]:
    """How well balances close on the free part of a mean loop, `EDGE` links at its ends left out.

    Of each balance the error relative to its greatest term, root mean square and greatest value:

    - `force`: (T_e t + N n)(s), less its value at the lowest point and the weight in between, ρ g ŷ s.
    - `normal`: N' + T_e κ − ρ g cos φ.
    - `moment`: M' + N − j v² κ'.
    - `friction`: M − f(ℓ v κ'), where f is the moment of joints that turn like the mean curve.
    """
    p, edge = loop.parameters, EDGE * loop.parameters.link_length
    weight = loop.density * p.gravity
    inside = (loop.s > loop.free[0] + edge) & (loop.s < loop.free[1] - edge)
    # Forces are complex numbers x + iy; the tangent is −exp(−iφ), the normal i exp(−iφ).
    force = (-loop.effective_tension + 1j * loop.shear) * np.exp(-1j * loop.angle)
    unbalanced = force - np.interp(0.0, loop.s, force) - 1j * weight * loop.s
    shear_slope, moment_slope = (fftpack.diff(values, period=loop.length) for values in (loop.shear, loop.moment))
    bend, across = loop.effective_tension * loop.curvature, weight * np.cos(loop.angle)
    turned = bending_inertia(loop) * loop.speed**2 * loop.bending
    expected = moment(p, p.link_length * loop.speed * loop.bending, p.friction_smoothing)
    terms = {
        "force": (unbalanced, [force]),
        "normal": (shear_slope + bend - across, [shear_slope, bend, across]),
        "moment": (moment_slope + loop.shear - turned, [moment_slope, loop.shear, turned]),
        "friction": (loop.moment - expected, [loop.moment]),
    }
    found = {}
    for name, (rest, parts) in terms.items():
        share = np.abs(rest[inside]) / max(np.max(np.abs(part[inside])) for part in parts)
        found[name] = rms(share), float(share.max())
    return found
