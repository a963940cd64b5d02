"""The theory of the free part of a stationary loop: its balances as a boundary value problem.

With the signs of `walk.mean_loop()`, p = κ' and M = f(ℓ v p), where f(w) = β w + τ_c
tanh(w/ω_c):

    x' = −cos φ    y' = sin φ    φ' = κ    κ' = p    T_e' = N κ + ρ g sin φ    N' = ρ g cos φ − T_e κ
    p' = (j v² p − N) / (ℓ v f'(ℓ v p))

These are seven functions with seven conditions: x, y, φ, κ at the lift-off and x, y, φ at the touch-down, because the
theory does not include the sprocket. κ is given at the lift-off because the motion carries standing waves along: they
start there, and not at the touch-down. The length of the free part is given, too: it follows from the number of links.
Without friction p = N / (j v²), and φ at the touch-down is not given either. Without friction and inertia
T_e κ = ρ g cos φ: the catenary, for which only its ends and its length are given.

With a small ω_c the moment is almost a step wherever a joint changes its sense of rotation. The solver therefore starts
with large ω_c and ends at `LEAST_SMOOTHING`. Joints turn at 60 rad/s where the loop bends; from there to 0.1 rad/s
loops of 60 to 180 links at 10 to 30 Hz change by at most 0.1 mm and 0.05 1/m.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

Array = NDArray[np.float64]
MeanLoop = Any
"""What `walk.mean_loop()` returns."""
LoopParameters = Any
"""Its `parameters`, a data class."""

SMOOTHINGS: Final = (300.0, 100.0, 30.0, 10.0, 3.0, 1.0)
"""Smoothings ω_c [rad/s] for which the problem is solved before that of the chain."""
LEAST_SMOOTHING: Final = 0.3
"""Least smoothing ω_c [rad/s]."""
TOLERANCE: Final = 1e-4
"""Relative tolerance of the solver."""
MOST_NODES: Final = 20_000
"""Greatest number of nodes of the solver."""
POINTS: Final = 801
"""Number of points of a theoretical loop."""
IN_LINKS: Final = 1.0
"""The theory begins and ends this many links inside of the free part: averages near it include links that touch."""


class NoSolutionError(ValueError):
    """The boundary value problem was not solved."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TheoreticalLoop:
    """The free part in theory, as functions of the arc length at g points; signs as of the mean loop.

    Attributes:
        s: arc length from the lowest point along the motion [m], shape (g,).
        position: x, y [m], shape (g, 2).
        angle: φ [rad], shape (g,).
        curvature: κ [1/m], shape (g,).
        effective_tension: T_e [N], shape (g,).
        shear: N [N], shape (g,).
        moment: M [N m], shape (g,).
    """

    s: Array
    position: Array
    angle: Array
    curvature: Array
    effective_tension: Array
    shear: Array
    moment: Array

    @property
    def length(self) -> float:
        """Length of the free part [m]."""
        return float(self.s[-1] - self.s[0])


@dataclass(frozen=True)
class End:
    """One end of a free part: x, y [m], φ [rad], κ [1/m]."""

    x: float
    y: float
    angle: float
    curvature: float

    @classmethod
    def of(cls, loop: MeanLoop, s: float) -> "End":
        """The mean loop at the arc length s [m]."""
        columns = (*loop.position.T, loop.angle, loop.curvature)
        return cls(*(float(np.interp(s, loop.s, values)) for values in columns))


def predict(loop: MeanLoop, parameters: LoopParameters | None = None) -> TheoreticalLoop:
    """The free part in theory, with the ends and the speed of a mean loop.

    Args:
        loop: the mean loop, which is also the first guess.
        parameters: parameters of the chain; by default those of the loop.

    Raises:
        NoSolutionError: the solver has found no solution.
    """
    inset = IN_LINKS * loop.parameters.link_length
    first, last = loop.free[0] + inset, loop.free[1] - inset
    s = np.linspace(first, last, 401)
    columns = (loop.angle, loop.curvature, loop.bending, loop.effective_tension, loop.shear)
    guess = np.stack([np.interp(s, loop.s, values) for values in (*loop.position.T, *columns)])
    ends = End.of(loop, first), End.of(loop, last)
    return solve(ends, guess, last - first, parameters or loop.parameters, loop.speed)


def solve(
    ends: tuple[End, End], guess: Array, length: float, parameters: LoopParameters, speed: float
) -> TheoreticalLoop:
    """The free part in theory between two ends.

    Args:
        ends: lift-off and touch-down; without friction not all of their values are used.
        guess: x, y, φ, κ, κ', T_e, N at points evenly along the arc, shape (7, g).
        length: length of the free part [m].
        parameters: parameters of the chain.
        speed: v along the loop [m/s].

    Raises:
        NoSolutionError: the solver has found no solution.
    """
    weight, turning = parameters.density * parameters.gravity, parameters.inertia * speed**2
    points, nothing = np.linspace(0.0, 1.0, POINTS), np.zeros(POINTS)
    share: Array = np.linspace(0.0, 1.0, guess.shape[1])
    if parameters.viscous_friction > 0 or parameters.coulomb_friction > 0:
        least = max(parameters.friction_smoothing, LEAST_SMOOTHING)
        smoothings = [value for value in SMOOTHINGS if value > least] if parameters.coulomb_friction > 0 else []
        for smoothing in (*smoothings, least):
            smoothed = replace(parameters, friction_smoothing=smoothing)
            found = _solve_bvp(_with_friction(smoothed, length, speed), _ends_meet(ends, 4, 3), share, guess)
            share, guess = found.x, found.y
        x, y, angle, curvature, bending, tension, shear = found.sol(points)
        moment = smoothed.moment(parameters.link_length * speed * bending)
        return _made(length, x, y, angle, curvature, tension, shear, moment)

    def waving(share: Array, values: Array) -> Array:
        _, _, angle, curvature, tension, shear = values
        dx, dy, turn, *loads = _rates(angle, curvature, tension, shear, weight)
        return length * np.stack((dx, dy, turn, shear / turning, *loads))

    def hanging(share: Array, values: Array) -> Array:
        _, _, angle, tension = values
        dx, dy, turn, pull, _ = _rates(angle, weight * np.cos(angle) / tension, tension, 0.0 * angle, weight)
        return length * np.stack((dx, dy, turn, pull))

    if turning != 0:
        found = _solve_bvp(waving, _ends_meet(ends, 4, 2), share, guess[[0, 1, 2, 3, 5, 6]])
        x, y, angle, curvature, tension, shear = found.sol(points)
        return _made(length, x, y, angle, curvature, tension, shear, nothing)
    found = _solve_bvp(hanging, _ends_meet(ends, 2, 2), share, guess[[0, 1, 2, 5]])
    x, y, angle, tension = found.sol(points)
    return _made(length, x, y, angle, weight * np.cos(angle) / tension, tension, nothing, nothing)


def _rates(angle: Array, curvature: Array, tension: Array, shear: Array, weight: float) -> tuple[Array, ...]:
    """Derivatives of x, y, φ, T_e, N with respect to s."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return -cosine, sine, curvature, shear * curvature + weight * sine, weight * cosine - tension * curvature


def _with_friction(parameters: LoopParameters, length: float, speed: float) -> Callable[..., Array]:
    """Derivatives of x, y, φ, κ, p, T_e, N with respect to the share of the length."""
    spin, weight = parameters.link_length * speed, parameters.density * parameters.gravity
    turning, smoothing = parameters.inertia * speed**2, parameters.friction_smoothing

    def slope(share: Array, values: Array) -> Array:
        _, _, angle, curvature, bending, tension, shear = values
        tanh = np.tanh(spin * bending / smoothing)
        friction = parameters.viscous_friction + parameters.coulomb_friction / smoothing * (1 - tanh**2)
        dx, dy, turn, *loads = _rates(angle, curvature, tension, shear, weight)
        return length * np.stack((dx, dy, turn, bending, (turning * bending - shear) / (spin * friction), *loads))

    return slope


def _ends_meet(ends: tuple[End, End], at_first: int, at_last: int) -> Callable[..., Array]:
    """Boundary conditions: so many of x, y, φ, κ at the first end and at the last."""
    first, last = (np.array([end.x, end.y, end.angle, end.curvature]) for end in ends)

    def conditions(start: Array, end: Array) -> Array:
        return np.concatenate([start[:at_first] - first[:at_first], end[:at_last] - last[:at_last]])

    return conditions


def _solve_bvp(slope: Callable[..., Array], conditions: Callable[..., Array], share: Array, guess: Array) -> Any:
    """Solve a boundary value problem by SciPy.

    Raises:
        NoSolutionError: SciPy has found no solution.
    """
    found = solve_bvp(slope, conditions, share, guess, tol=TOLERANCE, max_nodes=MOST_NODES)
    if not found.success:
        raise NoSolutionError(f"the boundary value problem was not solved ({found.message.lower().rstrip('.')})")
    return found


def _made(
    length: float, x: Array, y: Array, angle: Array, curvature: Array, tension: Array, shear: Array, moment: Array
) -> TheoreticalLoop:
    """A loop from its values at evenly spaced points; s counts from where φ passes 0."""
    s = length * np.linspace(0.0, 1.0, POINTS)
    lowest = int(np.argmin(y))
    around = slice(max(lowest - 2, 0), lowest + 3)
    return TheoreticalLoop(
        s=s - float(np.interp(0.0, angle[around], s[around])),
        position=np.stack([x, y], axis=1),
        angle=angle,
        curvature=curvature,
        effective_tension=tension,
        shear=shear,
        moment=moment,
    )
