"""Floor contacts of a chain whose plane tilts, with the conventions of :mod:`tests.oracle_model.tilting_plane`.

A roller is a cylinder of radius r and half width h about the e3 through a link's end. Vectors are in plane axes unless
they are said to be in room axes; the floor's normal is n̂ = `Plane.y`. Contacts between links stay within the plane:
`contact_equations.resolve_contacts(…, floor=False)`, after the floor's.

Source of the law: A. Chatterjee and A. Ruina, "A new algebraic rigid-body collision law based on impulse space
considerations", Journal of Applied Mechanics 65 (1998) 939-951, in its three dimensions.
"""

from dataclasses import dataclass, replace

import numpy as np

from tests.oracle_model.motion_equations import cross, link_ends, link_inertias, link_masses, turned
from tests.oracle_model.tilting_plane import Plane, plane_mass_matrix
from tests.support.arrays import Array
from warpchain.inputs.parameters import Parameters

LEAST_SLOPE = 1e-12
"""ε: with less than this of Ŷ within the plane, a roller's lowest points go to the middle of its face."""


@dataclass(frozen=True, eq=False)
class FloorImpulse:
    """One impulse of the floor on a roller.

    Attributes:
        link: index of the roller's link.
        point: (X, Y, ζ), m, where it acts.
        impulse: (3,), N s, on the link.
        loss: energy that this collision takes from the link and its copy of the plane, J; never negative.
    """

    link: int
    point: Array
    impulse: Array
    loss: float


@dataclass(frozen=True, eq=False)
class FloorPass:
    """What one pass over all floor contacts leaves.

    Attributes:
        velocity: (n, 3), of the links.
        plane: the plane with its new speeds, at the same place.
        impulses: in the order of links, left before right.
        merging_loss: energy lost when the copies of the plane meet, J; never negative.
    """

    velocity: Array
    plane: Plane
    impulses: tuple[FloorImpulse, ...]
    merging_loss: float


def tilting_collision_impulse(
    v: Array, normal: Array, w: Array, restitution: float, friction: float, tangential_restitution: float
) -> Array:
    """Chatterjee–Ruina law in three dimensions: the impulse P on the body that meets the floor.

        P_I = −(n̂·v / n̂·Wn̂) n̂   (stops the approach),   P_II = −W⁻¹ v   (stops all motion),   D = P_II − P_I
        P = (1+e) P_I + (1+e_t) D   if this has |P_t| ≤ μ P_n,
        P = (1+e) P_I + κ D         otherwise, with κ = μ (1+e) P_I,n / (|D_t| − μ D_n).

    As in `contact_equations.collision_impulse`, n̂·W D = 0, so the normal velocity becomes −e times what it was in both
    cases and the energy changes by −½ (1−e²) P_IᵀW P_I − ½ κ (2−κ) DᵀW D, with κ = 1+e_t in the first. That proof uses
    no number of dimensions.

    v (3,) [m/s] is the velocity of the touching point over the floor, n̂ points from the floor to the body, and an
    impulse P changes v by W P, W positive definite [1/kg]. P is zero unless the body approaches (n̂·v < 0).
    """
    approach = -float(normal @ v)
    if approach <= 0:
        return np.zeros(3)
    stop_approach = approach / (normal @ w @ normal) * normal
    stop_sliding = -np.linalg.solve(w, v) - stop_approach
    along_normal = float(normal @ stop_sliding)
    divisor = float(np.linalg.norm(stop_sliding - along_normal * normal)) - friction * along_normal
    limit = float(friction * (1 + restitution) * (normal @ stop_approach))
    kappa = 1 + tangential_restitution
    if kappa * divisor > limit:
        kappa = limit / divisor
    return (1 + restitution) * stop_approach + kappa * stop_sliding


def point_velocity(point: Array, position: Array, velocity: Array, rates: Array) -> Array:
    """Velocity (3,), m/s, over the floor of the point (X, Y, ζ) of a link at `position` (3,) with `velocity` (3,).

    `rates` are the plane's ν = (u, ω1, ω2). The result is
    (ẋ − θ̇ (Y − y) + ζ ω2, ẏ + θ̇ (X − x) − ζ ω1, u + ω1 Y − ω2 X).
    """
    in_plane = velocity[:2] + velocity[2] * turned(point[:2] - position[:2])
    return np.array([*in_plane, 0.0]) + plane_share(point).T @ rates


def plane_share(point: Array) -> Array:
    """G (3, 3): an impulse J at the point (X, Y, ζ) gives the plane the generalised impulse G J.

    Q_u = J3, Q_1 = Y J3 − ζ J2, Q_2 = −X J3 + ζ J1; and Gᵀ ν is the plane's part of the point's velocity.
    """
    x, y, zeta = point
    return np.array([[0.0, 0.0, 1.0], [0.0, -zeta, y], [zeta, 0.0, -x]])


def touching_point(
    centre: Array, position: Array, velocity: Array, plane: Plane, rates: Array, radius: float, half_width: float
) -> Array | None:
    """Where the floor pushes a roller, (X, Y, ζ) in m, or None if it doesn't touch.

    The lowest points of the roller's two rims are (x + r q1, y + r q2, ±h) with q = −(Ŷ1, Ŷ2)/max(ρ, ε),
    ρ = √(Ŷ1² + Ŷ2²), at heights O·Ŷ + x Ŷ1 + y Ŷ2 − r ρ ± h Ŷ3. With a± the speed at which they approach the floor, 0
    if they are above it or go up, the roller touches if a₊ + a₋ > 0, at ζ = h (a₊ − a₋)/(a₊ + a₋): midway if both rims
    fall alike, as an upright chain's do, and at the rim that falls if only one does. That point always approaches.

    The plane's speeds are `rates`, (u, ω1, ω2), whatever `plane` has.
    """
    slope = float(np.hypot(plane.y[0], plane.y[1]))
    lowest = centre - radius * plane.y[:2] / max(slope, LEAST_SLOPE)
    approach = []
    for zeta in (half_width, -half_width):
        height = plane.origin[1] + centre @ plane.y[:2] - radius * slope + zeta * plane.y[2]
        v = point_velocity(np.array([*lowest, zeta]), position, velocity, rates)
        approach.append(max(0.0, -float(plane.y @ v)) if height < 0 else 0.0)
    above, below = approach
    if above + below <= 0:
        return None
    return np.array([*lowest, half_width * (above - below) / (above + below)])


def resolve_tilting_floor(
    position: Array, velocity: Array, plane: Plane, parameters: Parameters, *, half_width: float
) -> FloorPass:
    """One pass over all rollers at the floor; positions never change.

    All links share the plane, so that a contact of one moves the others. In order that the pass depends neither on
    the order of links nor on mirror images, the plane's mass is split: let N links have a roller that touches
    (`touching_point`) at the start. Each of them gets a copy of the plane with the same speeds ν and the mass matrix
    A/N, and collides with the floor by itself: its left roller, then its right, which sees what the left one did
    to link and copy. Then ν becomes the mean over the copies. With Δ_k the change of ν of copy k, this

    - keeps momenta: the mean of Δ_k is A⁻¹ Σ G J;
    - never raises the energy: merging loses ½ [(1/N) Σ Δ_kᵀ A Δ_k − Δ̄ᵀ A Δ̄] ≥ 0, as a plastic collision does.

    A contact has W = (1/m) 1₂ + p pᵀ/I in the plane, p = e3 × lever, plus N Gᵀ A⁻¹ G of `plane_share`.

    The links' velocities are not changed; h [m] is `half_width`.
    """
    n = len(position)
    inv_mass, inv_inertia = 1 / link_masses(n, parameters), 1 / link_inertias(n, parameters)
    matrix = plane_mass_matrix(position, parameters, half_width=half_width)
    inverse = np.linalg.inv(matrix)
    ends = np.stack(link_ends(position, parameters), axis=1)
    law = (parameters.floor_restitution, parameters.floor_friction, parameters.tangential_restitution)
    velocity = velocity.copy()

    def touching(link: int, end: int, rates: Array) -> Array | None:
        sizes = (parameters.circle_radius, half_width)
        return touching_point(ends[link, end], position[link], velocity[link], plane, rates, *sizes)

    links = [link for link in range(n) if any(touching(link, end, plane.rates) is not None for end in (0, 1))]
    if not links:
        return FloorPass(velocity, plane, (), 0.0)
    impulses = []
    copies = []
    for link in links:
        rates = plane.rates
        for end in (0, 1):
            point = touching(link, end, rates)
            if point is None:
                continue
            lever = point[:2] - position[link, :2]
            v = point_velocity(point, position[link], velocity[link], rates)
            share = plane_share(point)
            w = len(links) * share.T @ inverse @ share
            w[:2, :2] += inv_mass[link] * np.eye(2) + inv_inertia[link] * np.outer(turned(lever), turned(lever))
            impulse = tilting_collision_impulse(v, plane.y, w, *law)
            impulses.append(FloorImpulse(link, point, impulse, -float(impulse @ (v + w @ impulse / 2))))
            velocity[link, :2] += inv_mass[link] * impulse[:2]
            velocity[link, 2] += inv_inertia[link] * cross(lever, impulse[:2])
            rates = rates + len(links) * inverse @ share @ impulse
        copies.append(rates)
    change = np.array(copies) - plane.rates
    spread = change - change.mean(axis=0)
    merging_loss = float(np.mean(np.sum(spread @ matrix * spread, axis=1))) / 2
    speed, *turn = plane.rates + change.mean(axis=0)
    moved = replace(plane, speed=float(speed), turn=np.array(turn))
    return FloorPass(velocity, moved, tuple(impulses), merging_loss)
