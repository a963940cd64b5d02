"""What the free part of a stationary loop should look like: its balances as a boundary value problem.

With the signs and symbols of `warpchain.loop.stationary_loop`, p = κ' and M = f(ℓ v p), where f(w) = β w + τ_c
tanh(w/ω_c):

    x' = −cos φ    y' = sin φ    φ' = κ    κ' = p    T_e' = N κ + ρ g sin φ    N' = ρ g cos φ − T_e κ
    p' = (j v² p − N) / (ℓ v f'(ℓ v p))

Seven functions, and seven conditions: x, y, φ, κ at the lift-off and x, y, φ at the touch-down, for what the sprocket
does to the chain there is not a matter of this theory. κ is given at the lift-off because waves that stand still are
carried along by the motion: they come from there, and not from the touch-down. The length of the free part is given as
well: it follows from the number of links. (Tried: the length unknown and κ given at both ends. The sides of a loop
point almost straight up whatever their length, so that this has no hold of it: 1 % too long with 60 links, 40 % with
120.)
Without friction p = N / (j v²), and φ at the touch-down is not given either. Without friction and inertia
T_e κ = ρ g cos φ: the catenary, which has only its ends and its length given.

A small ω_c makes the moment a step wherever a joint changes its sense: it is approached from large ones, down to
`LEAST_SMOOTHING`. Joints turn at 60 rad/s where the loop bends; from there to 0.1 rad/s loops of 60 to 180 links at 10
to 30 Hz change by at most 0.1 mm and 0.05 1/m.

SciPy is an optional dependency; what needs it says so.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.loop.stationary_loop import LoopParameters, StationaryLoop

if TYPE_CHECKING:
    from types import ModuleType

Array = NDArray[np.float64]

SMOOTHINGS: Final = (300.0, 100.0, 30.0, 10.0, 3.0, 1.0)
"""Smoothings ω_c [rad/s] on the way to a chain's own."""
LEAST_SMOOTHING: Final = 0.3
"""Least smoothing ω_c [rad/s]; see above for what less would change."""
TOLERANCE: Final = 1e-4
MOST_NODES: Final = 20_000
POINTS: Final = 801
"""Points of a theoretical loop."""
IN_LINKS: Final = 1.0
"""The theory begins and ends this many links inside of the free part: averages mix in what touches the sprocket."""


class NoSolutionError(ValueError):
    """The boundary value problem was not solved."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TheoreticalLoop:
    """A free part as theory has it, as functions of the arc length at g points; signs as of a `StationaryLoop`.

    Attributes:
        s: arc length from the lowest point along the motion [m], shape (g,).
        position: x, y [m], shape (g, 2).
        angle: φ [rad], shape (g,).
        curvature: κ [1/m], shape (g,).
        effective_tension: T_e [N], shape (g,).
        shear: N [N], shape (g,).
        moment: M [N m], shape (g,).
        residual: greatest relative residual of the solver; 0 for a catenary in closed form.
    """

    s: Array
    position: Array
    angle: Array
    curvature: Array
    effective_tension: Array
    shear: Array
    moment: Array
    residual: float

    @property
    def length(self) -> float:
        """Of the free part [m]."""
        return float(self.s[-1] - self.s[0])


@dataclass(frozen=True)
class End:
    """One end of a free part: x, y [m], φ [rad], κ [1/m]."""

    x: float
    y: float
    angle: float
    curvature: float

    @classmethod
    def of(cls, loop: StationaryLoop, s: float) -> "End":
        """Where the mean loop is at some s [m]."""
        x, y, angle, curvature = (
            float(np.interp(s, loop.s, values))
            for values in (loop.position[:, 0], loop.position[:, 1], loop.angle, loop.curvature)
        )
        return cls(x, y, angle, curvature)


def predict(loop: StationaryLoop, parameters: LoopParameters | None = None) -> TheoreticalLoop:
    """The free part between the ends of a mean loop's, with its speed.

    Args:
        loop: a mean loop: its ends are what is given, the rest of it is the first guess.
        parameters: of another chain; None: of the loop's own.

    Raises:
        NoSolutionError: the solver has not found one.
        ModuleNotFoundError: SciPy is not installed.
    """
    parameters = parameters or loop.parameters
    inset = IN_LINKS * loop.parameters.link_length
    first, last = loop.free[0] + inset, loop.free[1] - inset
    ends = End.of(loop, first), End.of(loop, last)
    s = np.linspace(first, last, 401)
    columns = (
        *loop.position.T,
        *(loop.angle, loop.curvature, loop.bending, loop.effective_tension, loop.shear),
    )
    guess = np.stack([np.interp(s, loop.s, values) for values in columns])
    return solve(ends, guess, last - first, parameters, loop.speed)


def solve(
    ends: tuple[End, End], guess: Array, length: float, parameters: LoopParameters, speed: float
) -> TheoreticalLoop:
    """The free part between two ends.

    Args:
        ends: lift-off and touch-down; without friction not all of their values are used, see above.
        guess: x, y, φ, κ, κ', T_e, N at points evenly along the arc, shape (7, g).
        length: of the free part [m].
        parameters: of the chain.
        speed: v along the loop [m/s].

    Raises:
        NoSolutionError: the solver has not found one.
        ModuleNotFoundError: SciPy is not installed.
    """
    if parameters.viscous_friction == 0 and parameters.coulomb_friction == 0:
        return _without_friction(ends, guess, length, parameters, speed)
    least = max(parameters.friction_smoothing, LEAST_SMOOTHING)
    smoothings = [value for value in SMOOTHINGS if value > least] if parameters.coulomb_friction > 0 else []
    share, unknowns = np.linspace(0.0, 1.0, guess.shape[1]), guess
    found: Any = None
    for smoothing in (*smoothings, least):
        found = _solve_bvp(_with_friction(parameters, length, speed, smoothing), _ends_meet(ends), share, unknowns)
        share, unknowns = found.x, found.y
    values = found.sol(np.linspace(0.0, 1.0, POINTS))
    moment = replace(parameters, friction_smoothing=least).moment(parameters.link_length * speed * values[4])
    return _made(length, values[[0, 1, 2, 3, 5, 6]], moment, found)


def catenary(loop: StationaryLoop) -> TheoreticalLoop:
    """The catenary between the ends of a mean loop's free part and of the same length; T_e is its tension.

    Raises:
        NoSolutionError: its length is not greater than the distance of its ends.
    """
    first, last = loop.free
    ends = End.of(loop, first), End.of(loop, last)
    return catenary_between(ends, last - first, loop.parameters)


def catenary_between(ends: tuple[End, End], length: float, parameters: LoopParameters) -> TheoreticalLoop:
    """The catenary of some length [m] between two ends, of which the second is farther left.

    With the width w and the height difference h, a curve y = c cosh((x − x₀)/c) has 2 c sinh(w/2c) = √(L² − h²).

    Raises:
        NoSolutionError: it cannot reach from one end to the other.
    """
    width, rise = ends[0].x - ends[1].x, ends[1].y - ends[0].y
    square = length**2 - rise**2
    if width <= 0 or square <= width**2:
        raise NoSolutionError("a catenary of this length does not reach from one end to the other; check both")
    ratio = math.sqrt(square) / width  # of sinh(z) to z, z = w/2c
    z = math.sqrt(6 * (ratio - 1)) if ratio < 2 else math.log(2 * ratio) + math.log(math.log(2 * ratio))
    for _ in range(100):
        z -= (math.sinh(z) - ratio * z) / (math.cosh(z) - ratio)
    c = width / (2 * z)
    middle = c * math.atanh(rise / length)  # how far the lowest point is right of the middle of the ends
    from_lowest = width / 2 - middle  # of the first end
    start = -c * math.sinh(from_lowest / c)
    s = start + np.linspace(0.0, length, POINTS)
    lowest_y = ends[0].y - c * (math.cosh(from_lowest / c) - 1)
    position = np.stack([ends[0].x - from_lowest - c * np.arcsinh(s / c), lowest_y + np.hypot(s, c) - c], axis=1)
    nothing = np.zeros(POINTS)
    return TheoreticalLoop(
        s=s,
        position=position,
        angle=np.arctan(s / c),
        curvature=c / (s**2 + c**2),
        effective_tension=parameters.density * parameters.gravity * np.hypot(s, c),
        shear=nothing,
        moment=nothing,
        residual=0.0,
    )


def _with_friction(parameters: LoopParameters, length: float, speed: float, smoothing: float) -> Callable[..., Array]:
    """Right-hand side, per share of the length, of x, y, φ, κ, p, T_e, N."""
    spin, weight = parameters.link_length * speed, parameters.density * parameters.gravity
    turning = parameters.inertia * speed**2

    def slope(share: Array, values: Array) -> Array:
        _, _, angle, curvature, bending, tension, shear = values
        tanh = np.tanh(spin * bending / smoothing)
        friction = parameters.viscous_friction + parameters.coulomb_friction / smoothing * (1 - tanh**2)
        cosine, sine = np.cos(angle), np.sin(angle)
        rates = (
            *(-cosine, sine, curvature, bending),
            (turning * bending - shear) / (spin * friction),
            shear * curvature + weight * sine,
            weight * cosine - tension * curvature,
        )
        return length * np.stack(rates)

    return slope


def _ends_meet(ends: tuple[End, End]) -> Callable[..., Array]:
    """Boundary conditions: x, y, φ, κ at the first end, x, y, φ at the second."""
    first, last = (np.array([end.x, end.y, end.angle, end.curvature]) for end in ends)

    def conditions(start: Array, end: Array) -> Array:
        return np.concatenate([start[:4] - first, end[:3] - last[:3]])

    return conditions


def _without_friction(
    ends: tuple[End, End], guess: Array, length: float, parameters: LoopParameters, speed: float
) -> TheoreticalLoop:
    """The free part of a chain whose joints turn freely: of x, y, φ, T_e, and κ and N if links resist being turned."""
    weight, turning = parameters.density * parameters.gravity, parameters.inertia * speed**2
    share = np.linspace(0.0, 1.0, guess.shape[1])
    first, last = ends

    if turning == 0:

        def bare(share: Array, values: Array) -> Array:
            _, _, angle, tension = values
            cosine, sine = np.cos(angle), np.sin(angle)
            return length * np.stack([-cosine, sine, weight * cosine / tension, weight * sine])

        def ends_meet(start: Array, end: Array) -> Array:
            return np.array([start[0] - first.x, start[1] - first.y, end[0] - last.x, end[1] - last.y])

        found = _solve_bvp(bare, ends_meet, share, guess[[0, 1, 2, 5]])
        x, y, angle, tension = found.sol(np.linspace(0.0, 1.0, POINTS))
        curvature, shear = weight * np.cos(angle) / tension, np.zeros(POINTS)
        return _made(length, np.stack([x, y, angle, curvature, tension, shear]), shear, found)

    def waving(share: Array, values: Array) -> Array:
        _, _, angle, curvature, tension, shear = values
        cosine, sine = np.cos(angle), np.sin(angle)
        rates = (
            *(-cosine, sine, curvature, shear / turning),
            shear * curvature + weight * sine,
            weight * cosine - tension * curvature,
        )
        return length * np.stack(rates)

    def given(start: Array, end: Array) -> Array:
        lift_off = (start[0] - first.x, start[1] - first.y, start[2] - first.angle, start[3] - first.curvature)
        return np.array([*lift_off, end[0] - last.x, end[1] - last.y])

    found = _solve_bvp(waving, given, share, guess[[0, 1, 2, 3, 5, 6]])
    return _made(length, found.sol(np.linspace(0.0, 1.0, POINTS)), np.zeros(POINTS), found)


def _solve_bvp(slope: Any, conditions: Any, share: Array, guess: Array) -> Any:
    """What SciPy finds.

    Raises:
        NoSolutionError: nothing.
        ModuleNotFoundError: SciPy is not installed.
    """
    solve_bvp = _scipy_integrate().solve_bvp
    found = solve_bvp(slope, conditions, share, guess, tol=TOLERANCE, max_nodes=MOST_NODES)
    if not found.success:
        raise NoSolutionError(f"the boundary value problem was not solved ({found.message.lower().rstrip('.')})")
    return found


def _scipy_integrate() -> "ModuleType":
    """SciPy's integrators.

    Raises:
        ModuleNotFoundError: SciPy is not installed; one line with the remedy.
    """
    try:
        import scipy.integrate
    except ModuleNotFoundError:
        raise ModuleNotFoundError("the theory of the loop needs SciPy: pip install 'warpchain[scipy]'") from None
    module: ModuleType = scipy.integrate
    return module


def _made(length: float, values: Array, moment: Array, found: Any) -> TheoreticalLoop:
    """A loop of x, y, φ, κ, T_e, N at evenly spaced points; s counts from where φ passes 0."""
    s = length * np.linspace(0.0, 1.0, values.shape[1])
    x, y, angle, curvature, tension, shear = values
    lowest = int(np.argmin(y))
    around = slice(max(lowest - 2, 0), lowest + 3)
    bottom = float(np.interp(0.0, angle[around], s[around]))
    return TheoreticalLoop(
        s=s - bottom,
        position=np.stack([x, y], axis=1),
        angle=angle,
        curvature=curvature,
        effective_tension=tension,
        shear=shear,
        moment=moment,
        residual=float(found.rms_residuals.max()),
    )
