"""A chain in free flight in plain NumPy, integrated by SciPy: what steps and errors of the methods are compared with.

A chain has `position` (n, 3), x, y [m] and angle [rad] of each link's centre, and `velocity` (n, 3), their rates. It
shares no code with the kernels.
"""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.parameters import Parameters

Array = NDArray[np.float64]

STAGES = 12
"""Evaluations of the equations in an attempted step of DOP853."""


@dataclass(frozen=True)
class ScipyFlight:
    """A flight by SciPy's DOP853.

    Attributes:
        position: At the end, (n, 3).
        velocity: At the end, (n, 3).
        seconds: Wall time [s].
        attempts: Attempted steps, accepted or not: evaluations by `STAGES`.
    """

    position: Array
    velocity: Array
    seconds: float
    attempts: float


def acceleration(position: Array, velocity: Array, parameters: Parameters) -> Array:
    """Second derivatives of a chain's positions without contacts, (n, 3) [m/s², m/s², rad/s²].

    A joint pulls on the right end of link i with F_i = k C_i + b Ċ_i, where C_i is how far the left end of link i + 1
    lies from it, and on link i + 1 with −F_i. Links rub on their neighbours with β w + τ_c tanh(w/ω_c), w their
    relative angular velocity.
    """
    turns = len(position) // 2
    mass = np.tile([parameters.inner_mass, parameters.outer_mass], turns)
    inertia = np.tile([parameters.inner_inertia, parameters.outer_inertia], turns)
    angle, spin = position[:, 2], velocity[:, 2]
    half = parameters.link_length / 2
    along = half * np.column_stack([np.cos(angle), np.sin(angle)])
    across = half * np.column_stack([-np.sin(angle), np.cos(angle)])
    opening = _next(position[:, :2] - along) - position[:, :2] - along
    opening_rate = _next(velocity[:, :2] - spin[:, None] * across) - velocity[:, :2] - spin[:, None] * across
    pull = parameters.joint_stiffness * opening + parameters.joint_damping * opening_rate
    slip = spin - _next(spin)
    sticking = parameters.coulomb_friction * np.tanh(slip / parameters.friction_smoothing)
    friction = parameters.viscous_friction * slip + sticking
    force = pull - _previous(pull)
    torque = (across * (pull + _previous(pull))).sum(axis=1) - friction + _previous(friction)
    result = np.column_stack([force / mass[:, None], torque / inertia])
    result[:, 1] -= parameters.gravity
    return result


def fly(position: Array, velocity: Array, duration: float, parameters: Parameters, tolerance: float) -> ScipyFlight:
    """Integrate a chain in flight by SciPy's DOP853.

    Args:
        position: At the start, (n, 3).
        velocity: At the start, (n, 3).
        duration: Simulated time [s].
        parameters: Of the chain.
        tolerance: Absolute (SI units) and relative.

    Raises:
        RuntimeError: SciPy failed.
    """
    from scipy.integrate import solve_ivp

    shape = (2, len(position), 3)

    def rates(_: float, state: Array) -> Array:
        place, rate = state.reshape(shape)
        return np.concatenate([rate, acceleration(place, rate, parameters)]).ravel()

    start = np.stack([position, velocity]).ravel()
    began = time.perf_counter()
    done = solve_ivp(rates, (0.0, duration), start, "DOP853", [duration], rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    if not done.success:
        raise RuntimeError(f"DOP853 failed: {done.message}")
    end = done.y[:, -1].reshape(shape)
    return ScipyFlight(end[0], end[1], seconds, done.nfev / STAGES)


def _next(values: Array) -> Array:
    """Values of the next link at the place of each."""
    return np.roll(values, -1, axis=0)


def _previous(values: Array) -> Array:
    """Values of the link before at the place of each."""
    return np.roll(values, 1, axis=0)
