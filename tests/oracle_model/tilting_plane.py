"""A chain whose plane tilts: equations of motion, energy and momenta in the room, and flight by SciPy.

The chain stays planar, but its plane moves: the extension that the paper's discussion proposes.

Conventions of all functions, beside those of :mod:`tests.oracle_model.motion_equations`:

- Room axes: X̂ forward, Ŷ up, Ẑ = X̂ × Ŷ; the floor is at height 0. Plane axes: e1 and e2 in the plane, e3 = e1 × e2 its
  normal. A link's `position` and `velocity` (n, 3) are x, y (m), θ (rad) and their rates within the plane; the point
  (x, y, ζ) of the plane is at O + x e1 + y e2 + ζ e3 in the room.
- What moves within the plane belongs to the links, so the plane itself has three speeds ν = (u, ω1, ω2): its origin
  moves with Ȯ = u e3, and it turns with ω = ω1 e1 + ω2 e2, never about its normal.
- A link is a rod along d = (cos θ, sin θ) of the width 2h: with I its moment of inertia in the plane and
  S = m (2h)²/12, the moments are I about e3, I + S about p = e3 × d, and S about d.
- Lateral speed of a link's centre: w = u + ω1 y − ω2 x.

Source: "A walking roller chain", section 4, names the six degrees of freedom of a moving plane; three of them, those
within the plane, are the links' own. The equations follow from Newton's and Euler's for each link, with the forces that
hold links in their plane doing no work.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.oracle_model.motion_equations import (
    acceleration,
    direction,
    integrated,
    link_ends,
    link_inertias,
    link_masses,
    spring_energy,
    turned,
)
from tests.support.arrays import Array
from warpchain.inputs.parameters import Parameters


@dataclass(frozen=True, eq=False)
class Plane:
    """Where the plane of a chain is and how it moves.

    Attributes:
        speed: u, m/s, of the origin along the plane's normal.
        turn: (ω1, ω2), rad/s, angular velocity of the plane along e1 and e2; it has none along e3.
        x: (X̂·e1, X̂·e2, X̂·e3), the room's forward axis in plane axes.
        y: (Ŷ·e1, Ŷ·e2, Ŷ·e3), the room's upward axis in plane axes.
        origin: (O·X̂, O·Ŷ, O·Ẑ), m, origin of the plane's coordinates in room axes.
    """

    speed: float
    turn: Array
    x: Array
    y: Array
    origin: Array

    @property
    def rates(self) -> Array:
        """ν = (u, ω1, ω2), (3,): m/s and rad/s."""
        return np.array([self.speed, *self.turn])


def tilted_plane(
    tilt: float = 0.0,
    yaw: float = 0.0,
    *,
    speed: float = 0.0,
    turn: Sequence[float] | Array = (0.0, 0.0),
    origin: Sequence[float] | Array = (0.0, 0.0, 0.0),
) -> Plane:
    """An upright plane, first tilted about its e1, then turned about the room's Ŷ.

    The tilt is asin(Ŷ·e3) in [−π/2, π/2]; with yaw 0 its rate is −ω1. Yaw is the heading of e1, anticlockwise from X̂
    seen from above. Speed is u [m/s], `turn` (ω1, ω2) [rad/s], and the origin in room axes [m].
    """
    (cos_tilt, sin_tilt), (cos_yaw, sin_yaw) = direction(np.array([tilt, yaw]))
    return Plane(
        speed,
        np.array(turn, dtype=np.float64),
        np.array([cos_yaw, -sin_tilt * sin_yaw, cos_tilt * sin_yaw]),
        np.array([0.0, cos_tilt, sin_tilt]),
        np.array(origin, dtype=np.float64),
    )


def axes(plane: Plane) -> Array:
    """The matrix (3, 3) whose rows are X̂, Ŷ, Ẑ in plane axes and whose columns are e1, e2, e3 in room axes.

    It takes components in plane axes to room axes.
    """
    return np.stack([plane.x, plane.y, np.cross(plane.x, plane.y)])


def tilt_of(plane: Plane) -> float:
    """asin(Ŷ·e3), rad: 0 upright, ±π/2 fallen flat."""
    return float(np.arcsin(np.clip(plane.y[2], -1.0, 1.0)))


def lateral_speed(position: Array, plane: Plane) -> Array:
    """w = u + ω1 y − ω2 x of each link's centre along the plane's normal, (n,), m/s."""
    return np.asarray(plane.speed + plane.turn[0] * position[:, 1] - plane.turn[1] * position[:, 0])


def room_position(position: Array, plane: Plane) -> Array:
    """Each link's centre in room axes, (n, 3), m."""
    return np.asarray(plane.origin + position[:, :2] @ axes(plane)[:, :2].T)


def room_velocity(position: Array, velocity: Array, plane: Plane) -> Array:
    """Velocity of each link's centre in room axes, (n, 3), m/s."""
    in_plane_axes = np.column_stack([velocity[:, :2], lateral_speed(position, plane)])
    return np.asarray(in_plane_axes @ axes(plane).T)


def floor_gap(position: Array, plane: Plane, parameters: Parameters, *, half_width: float) -> float:
    """Height of the lowest point of all rollers over the floor, m; negative if it is below.

    A roller is a cylinder of radius r about the e3 through a link's end, from −h to h.
    """
    ends = np.concatenate(link_ends(position, parameters))
    reach = parameters.circle_radius * np.hypot(plane.y[0], plane.y[1]) + half_width * abs(plane.y[2])
    return float(plane.origin[1] + (ends @ plane.y[:2]).min() - reach)


# --- equations of motion ---


def width_inertias(n: int, parameters: Parameters, *, half_width: float) -> Array:
    """S = m (2h)²/12 of each link, (n,), kg m². Raises ValueError as `link_masses`."""
    return link_masses(n, parameters) * (2 * half_width) ** 2 / 12


def plane_mass_matrix(position: Array, parameters: Parameters, *, half_width: float) -> Array:
    """Mass matrix A (3, 3) of the plane's speeds ν = (u, ω1, ω2): they carry the energy ½ νᵀ A ν.

    With a = (1, y, −x) of a link, so that w = a·ν, and b = (0, −sin θ, cos θ), so that its spin about p is b·ν,

        A = Σ m a aᵀ + I b bᵀ + S diag(0, 1, 1).
    """
    n = len(position)
    at_centre, across = _shares(position)
    matrix: Array = (at_centre.T * link_masses(n, parameters)) @ at_centre
    matrix += (across.T * link_inertias(n, parameters)) @ across
    matrix += width_inertias(n, parameters, half_width=half_width).sum() * np.diag([0.0, 1.0, 1.0])
    return matrix


def plane_force(position: Array, velocity: Array, plane: Plane, parameters: Parameters) -> Array:
    """Right-hand side B (3,) of the plane's equation of motion A ν̇ = B: N and N m.

        B = −Σ a m (2 (ω1 ẏ − ω2 ẋ) + g Ŷ·e3) + (0, −ω2, ω1) Σ I θ̇ + (0, Σ I θ̇ [d (p·ω) + p (d·ω)])

    with a as in `plane_mass_matrix`: Coriolis forces and the weight, the links' spin as that of a wheel, and the change
    of the inertia about p as p turns with the link.
    """
    n = len(position)
    at_centre, _ = _shares(position)
    along = direction(position[:, 2])
    across = turned(along)
    spin = link_inertias(n, parameters) * velocity[:, 2]
    lateral = 2 * (plane.turn[0] * velocity[:, 1] - plane.turn[1] * velocity[:, 0]) + parameters.gravity * plane.y[2]
    force: Array = -(link_masses(n, parameters) * lateral) @ at_centre
    force[1:] += spin.sum() * turned(plane.turn)
    force[1:] += spin @ (along * (across @ plane.turn)[:, None] + across * (along @ plane.turn)[:, None])
    return force


def tilting_acceleration(
    position: Array, velocity: Array, plane: Plane, parameters: Parameters, *, half_width: float
) -> tuple[Array, Array]:
    """Equations of motion of the free chain and its plane, not split.

        m ẍ = F_x − m g Ŷ·e1 − m ω2 w,   m ÿ = F_y − m g Ŷ·e2 + m ω1 w,   I θ̈ = τ − I (p·ω)(d·ω),   A ν̇ = B

    with the forces F and torques τ of joints as in `motion_equations.acceleration`, A as in `plane_mass_matrix` and B
    as in `plane_force`.

    Args:
        position: (n, 3).
        velocity: (n, 3).
        plane: its position and motion.
        parameters: the chain.
        half_width: h, m.

    Returns:
        ẍ, ÿ (m/s²), θ̈ (rad/s²) of the links within the plane, (n, 3), and u̇ (m/s²), ω̇1, ω̇2 (rad/s²), (3,).
    """
    result = acceleration(position, velocity, parameters, gravity=False)
    result[:, :2] -= parameters.gravity * plane.y[:2]
    result[:, :2] += lateral_speed(position, plane)[:, None] * [-plane.turn[1], plane.turn[0]]
    along = direction(position[:, 2])
    result[:, 2] -= (turned(along) @ plane.turn) * (along @ plane.turn)
    matrix = plane_mass_matrix(position, parameters, half_width=half_width)
    force = plane_force(position, velocity, plane, parameters)
    return result, np.asarray(np.linalg.solve(matrix, force), dtype=np.float64)


def frame_rates(plane: Plane) -> tuple[Array, Array, Array]:
    """Time derivatives of `Plane.x`, `Plane.y` (3,), 1/s, and `Plane.origin` (3,), m/s.

    A fixed vector A has Ȧ = −ω × A in plane axes: (−ω2 A3, ω1 A3, ω2 A1 − ω1 A2).
    """
    turn = np.array([*plane.turn, 0.0])
    return np.cross(plane.x, turn), np.cross(plane.y, turn), plane.speed * axes(plane)[:, 2]


def _shares(position: Array) -> tuple[Array, Array]:
    """(1, y, −x) and (0, −sin θ, cos θ) of each link, (n, 3) each."""
    one, zero = np.ones(len(position)), np.zeros(len(position))
    at_centre = np.column_stack([one, position[:, 1], -position[:, 0]])
    return at_centre, np.column_stack([zero, turned(direction(position[:, 2]))])


# --- energy and momenta of links as rigid bodies in the room ---


def link_turning(
    position: Array, velocity: Array, plane: Plane, parameters: Parameters, *, half_width: float
) -> tuple[Array, Array]:
    """Angular velocity (n, 3), rad/s, and angular momentum about its centre (n, 3), kg m²/s, of each link in room axes.

    The angular velocity is ω + θ̇ e3, the angular momentum the tensor of inertia times that.
    """
    n = len(position)
    frame = axes(plane)
    along = direction(position[:, 2]) @ frame[:, :2].T
    normal = np.tile(frame[:, 2], (n, 1))
    across = np.cross(normal, along)
    in_plane = link_inertias(n, parameters)
    width = width_inertias(n, parameters, half_width=half_width)
    spin = plane.turn @ frame[:, :2].T + velocity[:, 2:] * normal
    moments = ((in_plane, normal), (in_plane + width, across), (width, along))
    own = sum(moment[:, None] * axis * np.sum(axis * spin, axis=1, keepdims=True) for moment, axis in moments)
    return spin, np.asarray(own)


def tilting_kinetic_energy(
    position: Array, velocity: Array, plane: Plane, parameters: Parameters, *, half_width: float
) -> float:
    """Σ ½ m |V|² + ½ (angular velocity · angular momentum), J, of the links as rigid bodies in the room."""
    spin, own = link_turning(position, velocity, plane, parameters, half_width=half_width)
    speeds = np.sum(room_velocity(position, velocity, plane) ** 2, axis=1)
    return float(link_masses(len(position), parameters) @ speeds + np.sum(spin * own)) / 2


def tilting_energy(
    position: Array, velocity: Array, plane: Plane, parameters: Parameters, *, half_width: float
) -> float:
    """Kinetic, spring and gravitational energy (zero on the floor), J."""
    energy = tilting_kinetic_energy(position, velocity, plane, parameters, half_width=half_width)
    energy += spring_energy(position, parameters)
    heights = room_position(position, plane)[:, 1]
    return energy + float(parameters.gravity * (link_masses(len(position), parameters) @ heights))


def room_momentum(position: Array, velocity: Array, plane: Plane, parameters: Parameters) -> Array:
    """Σ m V in room axes, (3,), kg m/s."""
    return link_masses(len(position), parameters) @ room_velocity(position, velocity, plane)


def room_angular_momentum(
    position: Array, velocity: Array, plane: Plane, parameters: Parameters, *, half_width: float
) -> Array:
    """Σ m X × V and each link's own, about the room's origin, in room axes, (3,), kg m²/s.

    As in the plane, free flight without weight keeps it if b = 0; with dampers each joint adds −b C × Ċ along e3.
    """
    _, own = link_turning(position, velocity, plane, parameters, half_width=half_width)
    orbital = np.cross(room_position(position, plane), room_velocity(position, velocity, plane))
    total: Array = link_masses(len(position), parameters) @ orbital + own.sum(axis=0)
    return total


# --- flight ---


def solve_tilting_flight(
    position: Array,
    velocity: Array,
    plane: Plane,
    duration: float,
    parameters: Parameters,
    *,
    half_width: float,
    rtol: float,
    atol: float,
) -> tuple[Array, Array, Plane]:
    """Position and velocity (n, 3) of the free chain, and its plane, after a time [s], not split, by SciPy's DOP853.

    The solver leaves the rows `Plane.x` and `Plane.y` orthonormal to its tolerance; they are made so to rounding.
    """
    n = len(position)

    def unpacked(state: Array) -> tuple[Array, Array, Plane]:
        x, v = state[: 6 * n].reshape(2, n, 3)
        rates, forward, upward, origin = state[6 * n :].reshape(4, 3)
        return x, v, Plane(float(rates[0]), rates[1:], forward, upward, origin)

    def derivative(_: float, state: Array) -> Array:
        x, v, now = unpacked(state)
        links, rates = tilting_acceleration(x, v, now, parameters, half_width=half_width)
        return np.concatenate([v.ravel(), links.ravel(), rates, *frame_rates(now)])

    start = np.concatenate([position.ravel(), velocity.ravel(), plane.rates, plane.x, plane.y, plane.origin])
    x, v, moved = unpacked(integrated(derivative, start, duration, rtol, atol))
    return x, v, _orthonormal(moved)


def _orthonormal(plane: Plane) -> Plane:
    """The plane with `x` of length 1, and `y` too and at right angles to it."""
    x = plane.x / np.linalg.norm(plane.x)
    y = plane.y - (x @ plane.y) * x
    return Plane(plane.speed, plane.turn, x, y / np.linalg.norm(y), plane.origin)
