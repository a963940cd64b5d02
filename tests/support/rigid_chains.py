"""Rigid joints: their chains, the truth by dense algebra and SciPy, and the kernels' functions called from NumPy."""

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.oracle_model import motion_equations
from tests.support.kernels_under_test import DEVICE, chain_on_cpu, compiled, poisoned
from warpchain import preset
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels import layout
from warpchain.kernels.cpu.functions import rigid_flight
from warpchain.kernels.cpu.loop import load_state
from warpchain.kernels.cpu.rows import scratch_rows
from warpchain.kernels.types import Model, State

Array = NDArray[np.float64]

PAPER = preset("paper")


# --- by dense algebra ---


def constraint_matrix(position: Array, parameters: Parameters) -> Array:
    """G = ∂C/∂q of all joints, (2n, 3n)."""
    n = len(position)
    a = parameters.link_length / 2
    turned = np.column_stack([-np.sin(position[:, 2]), np.cos(position[:, 2])])
    matrix = np.zeros((n, 2, n, 3))
    for left in range(n):
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
    position: Array, velocity: Array, parameters: Parameters, duration: float
) -> tuple[Array, Array]:
    """The state after a flight on rigid joints, by SciPy's DOP853 on the dense equations at 1e-12."""
    n = len(position)

    def rates(_: float, state: Array) -> Array:
        place, speed = state.reshape(2, n, 3)
        return np.concatenate([speed.ravel(), rigid_motion(place, speed, parameters)[0].ravel()])

    start = np.concatenate([position.ravel(), velocity.ravel()])
    end = solve_ivp(rates, (0, duration), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return tuple(end.reshape(2, n, 3))


# --- chains ---


def loop(links: int, parameters: Parameters = PAPER, speed: float = 2.0) -> tuple[Array, Array]:
    """A circulating ellipse in the air with joints that are closed and stay so, in NumPy to rounding.

    Args:
        links: n.
        parameters: Of the chain.
        speed: Along the loop [m/s].
    """
    position, velocity = lay_chain(ellipse(1.3), links, parameters.link_length, speed, 0.1)
    position[:, 1] += 0.3
    velocity[:, 2] += 0.5 * np.sin(7.0 * np.arange(links))
    return projected(position, velocity, parameters)


def falling(
    links: int, parameters: Parameters, phase: float, speed: float = 2.0, fall: float = 2.0
) -> tuple[Array, Array]:
    """A circulating ellipse 0.1 mm above the floor, falling: position and velocity (n, 3).

    Args:
        links: n.
        parameters: Of the chain.
        phase: Place of the first joint as a fraction of the ellipse.
        speed: Along the loop [m/s].
        fall: Downwards [m/s].
    """
    position, velocity = lay_chain(ellipse(1.3), links, parameters.link_length, speed, phase)
    ends = np.concatenate(motion_equations.link_ends(position, parameters))
    position[:, 1] += parameters.circle_radius + 1e-4 - ends[:, 1].min()
    return position, velocity - [0.0, fall, 0.0]


# --- by the kernels ---


@dataclass(frozen=True)
class Outcome:
    """What a visit to rigid joints leaves.

    Attributes:
        closed: Whether the joints were closed.
        closing: Energy booked there [J].
        opening: Energy booked on the way back [J]; NaN if there was none.
        position: (n, 3).
        velocity: (n, 3).
        acceleration: (n, 3) on rigid joints.
        friction: Energy lost to friction [J].
    """

    closed: bool
    closing: float
    opening: float
    position: Array
    velocity: Array
    acceleration: Array
    friction: float


@functools.cache
def _visit(columns: int) -> wp.Kernel:
    flight = rigid_flight("hybrid", columns)
    attempt, commit = flight.attempt, flight.commit
    close_joints, open_joints = flight.close_joints, flight.open_joints
    rows = scratch_rows("hybrid", columns)

    @compiled
    def visit(
        model: Model,
        state: State,
        scratch: wp.array3d(dtype=wp.float64),
        h: wp.float64,
        steps: int,
        opens: int,
        results: wp.array(dtype=wp.float64),
    ):
        chain = model.chains[0]
        block = scratch[0]
        rows_of_chain = wp.array(ptr=block.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        load_state(rows_of_chain, model, state, chain, 0)
        closed, lost = close_joints(rows_of_chain, chain)
        results[0] = wp.where(closed, wp.float64(1.0), wp.float64(0.0))
        results[1] = lost
        for _ in range(steps):
            attempt(rows_of_chain, chain, h, wp.float64(1.0))
            commit(rows_of_chain, chain, h)
        if opens != 0:
            results[2] = open_joints(rows_of_chain, chain)

    return visit


def visit(
    position: Array, velocity: Array, parameters: Parameters, *, h: float = 1.0, steps: int = 0, opens: bool = False
) -> Outcome:
    """Close the joints of a chain, make a number of steps of h [s] each, and open the joints again if wished."""
    links = len(position)
    columns = layout.padded_width(links)
    model, state = chain_on_cpu(position, velocity, parameters)
    scratch = poisoned(1, scratch_rows("hybrid", columns), columns)
    results = poisoned(3)
    wp.launch(_visit(columns), dim=1, inputs=[model, state, scratch, h, steps, int(opens), results], device=DEVICE)
    rows = scratch.numpy()[0, :, :links]
    return Outcome(
        closed=bool(results.numpy()[0]),
        closing=float(results.numpy()[1]),
        opening=float(results.numpy()[2]),
        position=rows[:3].T.copy(),
        velocity=rows[3:6].T.copy(),
        acceleration=rows[layout.STAGES : layout.STAGES + 3].T.copy(),
        friction=float(rows[layout.LOST_FRICTION].sum()),
    )
