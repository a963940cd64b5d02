"""A chain in free flight in plain NumPy, integrated by SciPy: what steps and errors of the methods are compared with.

A chain has `position` (n, 3), x, y [m] and angle [rad] of each link's centre, and `velocity` (n, 3), their rates. It
shares no code with the kernels.
"""

import time

import numpy as np

from warpchain.inputs.arrays import Array
from warpchain.inputs.parameters import Parameters

STAGES = 12
"""Evaluations of the equations in an attempted step of DOP853."""


def acceleration(position: Array, velocity: Array, parameters: Parameters) -> Array:
    """Second derivatives of a chain's positions without contacts, (n, 3) [m/s², m/s², rad/s²].

    A joint pulls on the right end of link i with F_i = k C_i + b Ċ_i, where C_i is how far the left end of link i + 1
    lies from it, and on link i + 1 with −F_i. Links rub on their neighbours with β w + τ_c tanh(w/ω_c), w their
    relative angular velocity.
    """

    def following(values: Array) -> Array:
        return np.roll(values, -1, axis=0)

    links = len(position)
    mass = np.resize([parameters.inner_mass, parameters.outer_mass], links)
    inertia = np.resize([parameters.inner_inertia, parameters.outer_inertia], links)
    angle, spin = position[:, 2], velocity[:, 2]
    along = parameters.link_length / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    turning = spin[:, None] * across
    opening = following(position[:, :2] - along) - position[:, :2] - along
    opening_rate = following(velocity[:, :2] - turning) - velocity[:, :2] - turning
    pull = parameters.joint_stiffness * opening + parameters.joint_damping * opening_rate
    slip = spin - following(spin)
    sticking = parameters.coulomb_friction * np.tanh(slip / parameters.friction_smoothing)
    friction = parameters.viscous_friction * slip + sticking
    before = np.roll(pull, 1, axis=0)
    torque = (across * (pull + before)).sum(axis=1) - friction + np.roll(friction, 1)
    result = np.column_stack([(pull - before) / mass[:, None], torque / inertia])
    result[:, 1] -= parameters.gravity
    return result


def fly(
    position: Array, velocity: Array, duration: float, parameters: Parameters, tolerance: float
) -> tuple[tuple[Array, Array], float, float]:
    """Integrate a chain in flight by SciPy's DOP853, at a tolerance that is absolute (SI units) and relative.

    Position and velocity after the duration [s], wall time [s], and attempted steps, accepted or not.
    """
    from scipy.integrate import solve_ivp

    start = np.stack([position, velocity])

    def rates(_: float, state: Array) -> Array:
        place, rate = state.reshape(start.shape)
        return np.concatenate([rate, acceleration(place, rate, parameters)]).ravel()

    began = time.perf_counter()
    done = solve_ivp(rates, (0.0, duration), start.ravel(), "DOP853", [duration], rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    if not done.success:
        raise RuntimeError(f"DOP853 failed: {done.message}")
    end = done.y[:, -1].reshape(start.shape)
    return (end[0], end[1]), seconds, done.nfev / STAGES
