"""Rigid joints: their chains, and the truth by dense algebra and SciPy."""

import numpy as np
from scipy.integrate import solve_ivp

from tests.oracle_model import motion_equations
from tests.support.arrays import Array
from tests.support.presets import PAPER
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.inputs.parameters import Parameters

# --- by dense algebra ---


def constraint_matrix(position: Array, parameters: Parameters) -> Array:
    """G = ∂C/∂q of all joints, (2n, 3n)."""
    n = len(position)
    a = parameters.link_length / 2
    turned = np.column_stack([-np.sin(position[:, 2]), np.cos(position[:, 2])])
    matrix = np.zeros((n, 2, n, 3))
    left = np.arange(n)
    right = (left + 1) % n
    for d in range(2):
        matrix[left, d, right, d] += 1
        matrix[left, d, left, d] -= 1
    matrix[left, :, right, 2] -= a * turned[right]
    matrix[left, :, left, 2] -= a * turned[left]
    return matrix.reshape(2 * n, 3 * n)


def masses(n: int, parameters: Parameters) -> Array:
    """Diagonal of M, (3n,)."""
    mass = motion_equations.link_masses(n, parameters)
    return np.column_stack([mass, mass, motion_equations.link_inertias(n, parameters)]).ravel()


def rigid_motion(position: Array, velocity: Array, parameters: Parameters) -> tuple[Array, Array]:
    """Accelerations (n, 3) and joint forces (n, 2) on rigid joints: M v̇ + Gᵀ F = Q and C̈ = 0, solved as one matrix.

    G v̇ = −Ġ v, and C̈ = G v̇ + a (u ω² + u' ω'²); −F acts along ∂C/∂q because F pulls the left link forwards.
    """
    n = len(position)
    a = parameters.link_length / 2
    inertia = masses(n, parameters)
    forces = np.zeros((n, 3))
    forces[:, 1] = -parameters.gravity * motion_equations.link_masses(n, parameters)
    torque = motion_equations.friction_torque(velocity[:, 2] - np.roll(velocity[:, 2], -1), parameters)
    forces[:, 2] = np.roll(torque, 1) - torque
    inward = velocity[:, 2:] ** 2 * np.column_stack([np.cos(position[:, 2]), np.sin(position[:, 2])])
    bend = -a * (inward + np.roll(inward, -1, axis=0))
    matrix = constraint_matrix(position, parameters)
    whole = np.block([[np.diag(inertia), matrix.T], [matrix, np.zeros((2 * n, 2 * n))]])
    solution = np.linalg.solve(whole, np.concatenate([forces.ravel(), bend.ravel()]))
    return solution[: 3 * n].reshape(n, 3), solution[3 * n :].reshape(n, 2)


def projected(position: Array, velocity: Array, parameters: Parameters) -> tuple[Array, Array]:
    """The state with C = 0 and Ċ = 0 that is nearest in the metric of the masses, joint by joint to rounding."""
    n = len(position)
    inverse = 1 / masses(n, parameters)
    for _ in range(6):
        matrix = constraint_matrix(position, parameters)
        pull = np.linalg.solve(
            (matrix * inverse) @ matrix.T, motion_equations.joint_opening(position, parameters).ravel()
        )
        position = position - (inverse * (matrix.T @ pull)).reshape(n, 3)
    matrix = constraint_matrix(position, parameters)
    pull = np.linalg.solve((matrix * inverse) @ matrix.T, matrix @ velocity.ravel())
    return position, velocity - (inverse * (matrix.T @ pull)).reshape(n, 3)


def exact_rigid_flight(
    position: Array, velocity: Array, parameters: Parameters, duration: float, tolerance: float = 1e-12
) -> tuple[Array, Array]:
    """The state after a flight on rigid joints, by SciPy's DOP853 on the dense equations, in SI units."""
    n = len(position)

    def rates(_: float, state: Array) -> Array:
        place, speed = state.reshape(2, n, 3)
        return np.concatenate([speed.ravel(), rigid_motion(place, speed, parameters)[0].ravel()])

    start = np.concatenate([position.ravel(), velocity.ravel()])
    end = solve_ivp(rates, (0, duration), start, method="DOP853", rtol=tolerance, atol=tolerance).y[:, -1]
    return tuple(end.reshape(2, n, 3))


# --- chains ---


def loop(links: int, parameters: Parameters = PAPER, speed: float = 2.0) -> tuple[Array, Array]:
    """A circulating ellipse in the air with joints that are closed and stay so, in NumPy to rounding."""
    position, velocity = lay_chain(ellipse(1.3), links, parameters.link_length, speed, 0.1)
    position[:, 1] += 0.3
    velocity[:, 2] += 0.5 * np.sin(7.0 * np.arange(links))
    return projected(position, velocity, parameters)
