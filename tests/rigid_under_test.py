"""Rigid joints from NumPy: the kernels' functions on scratch memory poisoned with NaN, and the dense truth."""

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from warpchain import reference
from warpchain.engine import start_device
from warpchain.kernels import layout
from warpchain.kernels.driver import COMPILER_FLAGS, load_state
from warpchain.kernels.methods import METHODS
from warpchain.kernels.types import Model, State, read_chain
from warpchain.parameters import Parameters

Array = NDArray[np.float64]

DEVICE = start_device("cpu")


# --- the dense truth ---


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
    mass = reference.link_masses(n, parameters)
    return np.column_stack([mass, mass, reference.link_inertias(n, parameters)]).ravel()


def rigid_motion(position: Array, velocity: Array, parameters: Parameters) -> tuple[Array, Array]:
    """Accelerations (n, 3) and joint forces (n, 2) on rigid joints: M v̇ + Gᵀ F = Q and C̈ = 0, solved as one matrix.

    G v̇ = −Ġ v, and C̈ = G v̇ + a (u ω² + u' ω'²); −F acts along ∂C/∂q because F pulls the left link forwards.
    """
    n = len(position)
    a = parameters.link_length / 2
    inertia = masses(n, parameters)
    forces = np.zeros((n, 3))
    forces[:, 1] = -parameters.gravity * reference.link_masses(n, parameters)
    torque = reference.friction_torque(velocity[:, 2] - np.roll(velocity[:, 2], -1), parameters)
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
        pull = np.linalg.solve((matrix * inverse) @ matrix.T, reference.joint_opening(position, parameters).ravel())
        position = position - (inverse * (matrix.T @ pull)).reshape(n, 3)
    matrix = constraint_matrix(position, parameters)
    pull = np.linalg.solve((matrix * inverse) @ matrix.T, matrix @ velocity.ravel())
    return position, velocity - (inverse * (matrix.T @ pull)).reshape(n, 3)


def exact_flight(position: Array, velocity: Array, parameters: Parameters, duration: float) -> tuple[Array, Array]:
    """The state after a flight on rigid joints, by SciPy's DOP853 on the dense equations at 1e-12."""
    n = len(position)

    def rates(_: float, state: Array) -> Array:
        place, speed = state.reshape(2, n, 3)
        return np.concatenate([speed.ravel(), rigid_motion(place, speed, parameters)[0].ravel()])

    start = np.concatenate([position.ravel(), velocity.ravel()])
    end = solve_ivp(rates, (0, duration), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return tuple(end.reshape(2, n, 3))


# --- the kernels ---


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
    attempt, commit, close_joints, open_joints = METHODS["hybrid"].flight.functions(columns)
    rows = METHODS["hybrid"].scratch_rows(columns)

    @wp.kernel(module="unique", enable_backward=False, module_options={"cpu_compiler_flags": COMPILER_FLAGS})
    def visit(
        model: Model,
        state: State,
        scratch: wp.array3d(dtype=wp.float64),
        h: wp.float64,
        steps: int,
        opens: int,
        results: wp.array(dtype=wp.float64),
    ):
        chain = read_chain(model, 0)
        block = scratch[0]
        rows_of_chain = wp.array(ptr=block.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        load_state(rows_of_chain, state, chain, 0)
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
    model = Model()
    model.link_count = wp.array([links], dtype=wp.int32, device=DEVICE)
    for name, value in parameters:
        setattr(model, name, wp.array([value], dtype=wp.float64, device=DEVICE))
    state = State()
    state.links = wp.array(np.hstack([position, velocity]).T[None], dtype=wp.float64, device=DEVICE)
    scratch = wp.full((1, METHODS["hybrid"].scratch_rows(columns), columns), np.nan, dtype=wp.float64, device=DEVICE)
    results = wp.full(3, np.nan, dtype=wp.float64, device=DEVICE)
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
