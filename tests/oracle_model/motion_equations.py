"""Equations of motion, energies and momenta of a chain, and its flight by SciPy.

Conventions of all functions:

- A chain of n links (n even, at least 4) has `position` (n, 3): x, y (m) and angle θ (rad) of each link's centre
  of mass, and `velocity` (n, 3): their time derivatives (m/s, rad/s). Even indices are inner links.
- u_i = (cos θ_i, sin θ_i) points from the left to the right end of link i, t_i = ẑ × u_i, a = ℓ/2. Joint i joins
  the right end of link i to the left end of link i+1 (mod n).
- `parameters` gives the values by the names of `warpchain.inputs.parameters.Parameters`. SI units, y upwards. If it
  has `masses` and `inertias`, (n,), these are the links' own, whose number may be odd; the friction of joint i is then
  element i of its `viscous_friction` and `coulomb_friction`, see `tests.support.unlike_links`.

Source: "A walking roller chain", section 2.1.
"""

import functools
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from tests.support.arrays import Array
from warpchain.inputs.parameters import Parameters


def link_masses(n: int, parameters: Parameters) -> Array:
    """Mass of each link, (n,), kg. Raises ValueError for two kinds of links unless n is even and at least 4."""
    own: Array | None = getattr(parameters, "masses", None)
    return own if own is not None else _alternating(n, parameters.inner_mass, parameters.outer_mass)


def link_inertias(n: int, parameters: Parameters) -> Array:
    """Moment of inertia of each link about its centre, (n,), kg m². Raises ValueError as `link_masses`."""
    own: Array | None = getattr(parameters, "inertias", None)
    return own if own is not None else _alternating(n, parameters.inner_inertia, parameters.outer_inertia)


def link_ends(position: Array, parameters: Parameters) -> tuple[Array, Array]:
    """Left and right end of each link, X ∓ a u, (n, 2) each, m."""
    offset = parameters.link_length / 2 * direction(position[:, 2])
    return position[:, :2] - offset, position[:, :2] + offset


def joint_opening(position: Array, parameters: Parameters) -> Array:
    """C_i = left end of link i+1 − right end of link i, (n, 2), m; zero when the joint is closed."""
    left, right = link_ends(position, parameters)
    return following(left) - right


def joint_opening_rate(position: Array, velocity: Array, parameters: Parameters) -> Array:
    """Time derivative of `joint_opening`, (n, 2), m/s."""
    offset_rate = parameters.link_length / 2 * velocity[:, 2:] * turned(direction(position[:, 2]))
    return following(velocity[:, :2] - offset_rate) - (velocity[:, :2] + offset_rate)


def joint_force(position: Array, velocity: Array, parameters: Parameters) -> Array:
    """F_i = k C_i + b Ċ_i, (n, 2), N: on link i at its right end; −F_i acts on link i+1 at its left end."""
    spring = parameters.joint_stiffness * joint_opening(position, parameters)
    return spring + parameters.joint_damping * joint_opening_rate(position, velocity, parameters)


def friction_torque(spin: Array, parameters: Parameters) -> Array:
    """f(w) = β w + τ_c tanh(w/ω_c), N m, of a joint's relative angular velocity w (rad/s, any shape)."""
    coulomb = parameters.coulomb_friction * np.tanh(spin / parameters.friction_smoothing)
    return parameters.viscous_friction * spin + coulomb


def acceleration(position: Array, velocity: Array, parameters: Parameters, *, gravity: bool = True) -> Array:
    """Equations of motion of the free chain, (n, 3): ẍ, ÿ (m/s²), θ̈ (rad/s²).

        m_i Ẍ_i = F_i − F_{i−1} − m_i g ŷ
        I_i θ̈_i = a t_i·(F_i + F_{i−1}) − f(ω_i − ω_{i−1}) − f(ω_i − ω_{i+1})

    These are the paper's equations in components. (Its matrix form needs J_ij = ∂C_i/∂q_j; the index order it
    prints, ∂C_j/∂q_i, is transposed.) `gravity=False` leaves g out.
    """
    n = len(position)
    here = joint_force(position, velocity, parameters)
    before = preceding(here)
    spin = velocity[:, 2]
    lever = parameters.link_length / 2 * turned(direction(position[:, 2]))
    torque = np.sum(lever * (here + before), axis=1)
    friction = friction_torque(spin - following(spin), parameters)
    torque += preceding(friction) - friction
    result = np.empty((n, 3), dtype=torque.dtype)  # complex steps differentiate these equations
    result[:, :2] = (here - before) / link_masses(n, parameters)[:, None]
    result[:, 2] = torque / link_inertias(n, parameters)
    if gravity:
        result[:, 1] -= parameters.gravity
    return result


def kinetic_energy(velocity: Array, parameters: Parameters) -> float:
    """Σ ½ m |Ẋ|² + ½ I θ̇², J."""
    n = len(velocity)
    translation = link_masses(n, parameters) @ np.sum(velocity[:, :2] ** 2, axis=1)
    return float(translation + link_inertias(n, parameters) @ velocity[:, 2] ** 2) / 2


def gravitational_energy(position: Array, parameters: Parameters) -> float:
    """Σ m g y, J; zero at y = 0."""
    return float(parameters.gravity * (link_masses(len(position), parameters) @ position[:, 1]))


def spring_energy(position: Array, parameters: Parameters) -> float:
    """Σ ½ k |C|², J."""
    return float(parameters.joint_stiffness / 2 * np.sum(joint_opening(position, parameters) ** 2))


def total_energy(position: Array, velocity: Array, parameters: Parameters, *, gravity: bool = True) -> float:
    """Kinetic and spring energy and, unless `gravity=False`, gravitational energy, J."""
    energy = kinetic_energy(velocity, parameters) + spring_energy(position, parameters)
    return energy + gravitational_energy(position, parameters) if gravity else energy


def linear_momentum(velocity: Array, parameters: Parameters) -> Array:
    """Σ m Ẋ, (2,), kg m/s."""
    return link_masses(len(velocity), parameters) @ velocity[:, :2]


def angular_momentum(position: Array, velocity: Array, parameters: Parameters) -> float:
    """Σ m (X − X_cm) × (Ẋ − Ẋ_cm) + I θ̇, about the chain's centre of mass, kg m²/s, anticlockwise > 0.

    Free flight keeps it for b = 0. A damper acts across an open joint, so each joint adds the torque −b C × Ċ.
    """
    n = len(position)
    mass = link_masses(n, parameters)
    arm = position[:, :2] - mass @ position[:, :2] / mass.sum()
    drift = velocity[:, :2] - mass @ velocity[:, :2] / mass.sum()
    return float(mass @ cross(arm, drift) + link_inertias(n, parameters) @ velocity[:, 2])


def solve_flight(
    position: Array,
    velocity: Array,
    duration: float,
    parameters: Parameters,
    *,
    rtol: float = 1e-12,
    atol: float = 1e-12,
) -> tuple[Array, Array]:
    """Position and velocity (n, 3) of the free chain after a time [s], by SciPy's DOP853; tolerances in SI units."""
    n = len(position)

    def derivative(_: float, state: Array) -> Array:
        x, v = state.reshape(2, n, 3)
        return np.concatenate([v, acceleration(x, v, parameters)]).ravel()

    end = integrated(derivative, np.stack([position, velocity]).ravel(), duration, rtol, atol).reshape(2, n, 3)
    return end[0], end[1]


def integrated(
    derivative: Callable[[float, Array], Array], start: Array, duration: float, rtol: float, atol: float
) -> Array:
    """The state (d,) that first-order equations lead to from another one after a time [s]."""
    solution = solve_ivp(derivative, (0.0, duration), start, method="DOP853", rtol=rtol, atol=atol)
    assert solution.success and np.all(np.isfinite(solution.y)), solution.message
    return np.asarray(solution.y[:, -1])


@functools.cache
def _alternating(n: int, inner: float, outer: float) -> Array:
    if n < 4 or n % 2:
        raise ValueError(f"a chain has an even number of links, at least 4; got {n}")
    values = np.tile([inner, outer], n // 2)
    values.setflags(write=False)  # all who ask for it get the same array
    return values


def following(values: Array) -> Array:
    """Of each link or joint what the next one has; `np.roll` takes six times as long."""
    return np.concatenate([values[1:], values[:1]])


def preceding(values: Array) -> Array:
    """Of each link or joint what the one before has."""
    return np.concatenate([values[-1:], values[:-1]])


def direction(angle: Array) -> Array:
    """(cos, sin) of angles [rad], shape (…, 2)."""
    return _paired(np.cos(angle), np.sin(angle))


def turned(vector: Array) -> Array:
    """ẑ × vector, for vectors of shape (…, 2)."""
    return _paired(-vector[..., 1], vector[..., 0])


def cross(first: Array, second: Array) -> Array:
    """The z component of first × second."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


def _paired(x: Array, y: Array) -> Array:
    """Vectors (…, 2) of these components; `np.stack` takes three times as long."""
    vectors = np.empty((*np.shape(x), 2), dtype=np.asarray(x).dtype)
    vectors[..., 0], vectors[..., 1] = x, y
    return vectors
