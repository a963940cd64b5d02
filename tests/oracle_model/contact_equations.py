"""Contacts of the model in plain NumPy, with the conventions of :mod:`tests.oracle_model.motion_equations`.

Sources: "A walking roller chain", section 2.2; A. Chatterjee and A. Ruina, "A new algebraic rigid-body collision law
based on impulse space considerations", Journal of Applied Mechanics 65 (1998) 939-951.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from tests.oracle_model.motion_equations import cross, link_ends, link_inertias, link_masses, turned
from tests.support.arrays import Array
from warpchain.inputs.parameters import Parameters

Sprocket = tuple[Array, float, float]
"""Centre (2,) in m, radius that the link circles touch in m, angular velocity in rad/s (anticlockwise > 0)."""


def link_radii(n: int, parameters: Parameters) -> Array:
    """Radius of the circles of each link, (n,), m; the links' own if parameters have `radii`."""
    return getattr(parameters, "radii", np.full(n, parameters.circle_radius))


def collision_impulse(
    v_rel: Array,
    normal: Array,
    lever_a: Array,
    lever_b: Array,
    inv_mass_a: float,
    inv_inertia_a: float,
    inv_mass_b: float,
    inv_inertia_b: float,
    restitution: float,
    friction: float,
    tangential_restitution: float,
) -> Array:
    """Chatterjee–Ruina law of one collision of bodies A and B at a point P: the impulse J on B; −J acts on A.

    With n̂ from A to B, t̂ = ẑ × n̂, v = v_A − v_B at P and W the matrix for which J changes v to v' = v − W J,

        W = (1/m_A + 1/m_B) 1 + p_A p_Aᵀ/I_A + p_B p_Bᵀ/I_B,   p = ẑ × r   (r: lever from the centre of mass to P)
        J₁ = v_n/W_nn n̂   (stops the approach),   J₂ = W⁻¹ v   (stops all relative motion),   D = J₂ − J₁
        J = (1+e) J₁ + (1+e_t) D   if this has |J_t| ≤ μ J_n,
        J = (1+e) J₁ + κ D         otherwise, with κ = μ (1+e) J_1n / (|D_t| − μ D_n).

    Errata of the paper: it prints α(n̂,n̂), the part of W_nn without the masses, in J₁. Its words ("bring the normal
    component of the relative velocity to zero") and the original law need W_nn, and a central impact has α = 0.
    (The other slip, the transposed ∂C/∂q, is named at `acceleration`.)

    What follows from it. W D = (0, s) has no normal part, s = v_t − W_tn v_n/W_nn, so v'_n = −e v_n in both cases,
    and D is orthogonal to J₁ in W. Hence with κ = 1+e_t in the first case the kinetic energy changes by exactly

        ΔT = −½ (1−e²) J₁ᵀ W J₁ − ½ κ (2−κ) Dᵀ W D.

    The second case needs (1+e_t)(|D_t| − μ D_n) > μ (1+e) J_1n, so κ exists there and 0 ≤ κ < 1+e_t. The energy
    therefore never rises for e in [0, 1] and e_t in [−1, 1], whatever μ ≥ 0 is; with e > 1 or e_t > 1 it can. (If
    A is a driven surface this holds in the frame of the surface at P; the surface may do work on B.) The first
    case leaves v'_t = −e_t s − e v_n W_tn/W_nn: it ends all sliding only if e_t = 0 and e W_tn = 0.

    Vectors are (2,) in world axes, levers go from the centre of mass to P. An immovable body has inverses of 0. The
    impulse is zero unless the bodies approach (v_n > 0).
    """
    v_n = float(normal @ v_rel)
    if v_n <= 0:
        return np.zeros(2)
    tangent = turned(normal)
    turn_a, turn_b = turned(lever_a), turned(lever_b)
    w = (inv_mass_a + inv_mass_b) * np.eye(2)
    w += inv_inertia_a * np.outer(turn_a, turn_a) + inv_inertia_b * np.outer(turn_b, turn_b)
    stop_approach = v_n / (normal @ w @ normal) * normal
    stop_sliding = np.linalg.solve(w, v_rel) - stop_approach
    # |J_t| ≤ μ J_n with J₁'s part on the right: rounding then can't let the divisor of κ vanish.
    divisor = float(abs(tangent @ stop_sliding) - friction * (normal @ stop_sliding))
    limit = float(friction * (1 + restitution) * (normal @ stop_approach))
    kappa = 1 + tangential_restitution
    if kappa * divisor > limit:
        kappa = limit / divisor
    return (1 + restitution) * stop_approach + kappa * stop_sliding


def resolve_contacts(
    position: Array,
    velocity: Array,
    parameters: Parameters,
    *,
    floor: bool = True,
    sprocket: Sprocket | None = None,
    self_contact: bool = True,
) -> tuple[Array, dict[str, int]]:
    """One pass over all touching circles, each contact seeing the velocities that those before it left.

    A link has a circle of its radius at either end. Circles touch when they overlap (gap < 0); a touching contact
    gets the impulse of `collision_impulse` if it approaches, else nothing. Positions never change. Two circles, or
    a circle and the sprocket, with exactly the same centre have no normal and are left alone.

    Order: floor, links 0 … n−1, left circle before right; sprocket likewise; then self-contacts in two halves, each by
    joint pair in the order of `self_contact_order`: of a joint pair (p, q), the first half has the link pairs (p, q)
    and (p+1, q+1), the second (p, q+1) and (p+1, q), links mod n. Equal and neighbouring links are passed over.

    The point P and the normal: floor (A; y = 0): the circle's lowest point, +y. Sprocket (A): the circle's point
    nearest the sprocket's centre, radially outwards; the surface moves with Ω ẑ × (P − centre). Two links: midway
    between the points of the circles that are deepest in the other, from A, the link at joint p, to B, that at q > p.

    Returns the new velocity (n, 3), and the numbers of impulses by kind: "floor", "sprocket", "self".
    """
    n = len(position)
    velocity = velocity.copy()
    inv_mass = 1 / link_masses(n, parameters)
    inv_inertia = 1 / link_inertias(n, parameters)
    radii = link_radii(n, parameters)
    counts = {"floor": 0, "sprocket": 0, "self": 0}

    def collide(
        a: int | None, b: int, point: Array, normal: Array, law: tuple[float, float], surface: Array | None = None
    ) -> bool:
        """Resolve one contact of link b with link a, or with a surface of the given velocity (at rest if None)."""
        lever_a, lever_b = np.zeros(2), point - position[b, :2]
        v_a, inverses_a = np.zeros(2) if surface is None else surface, (0.0, 0.0)
        v_b = velocity[b, :2] + velocity[b, 2] * turned(lever_b)
        if a is not None:
            lever_a, inverses_a = point - position[a, :2], (inv_mass[a], inv_inertia[a])
            v_a = velocity[a, :2] + velocity[a, 2] * turned(lever_a)
        inverses = (*inverses_a, inv_mass[b], inv_inertia[b])
        coefficients = (*law, parameters.tangential_restitution)
        impulse = collision_impulse(v_a - v_b, normal, lever_a, lever_b, *inverses, *coefficients)
        if a is not None:
            velocity[a, :2] -= inv_mass[a] * impulse
            velocity[a, 2] -= inv_inertia[a] * cross(lever_a, impulse)
        velocity[b, :2] += inv_mass[b] * impulse
        velocity[b, 2] += inv_inertia[b] * cross(lever_b, impulse)
        return bool(impulse.any())

    ends = np.stack(link_ends(position, parameters), axis=1)
    if floor:
        law = (parameters.floor_restitution, parameters.floor_friction)
        upwards = np.array([0.0, 1.0])
        for link in range(n):
            for centre in ends[link]:
                if centre[1] - radii[link] < 0:
                    counts["floor"] += collide(None, link, centre - radii[link] * upwards, upwards, law)
    if sprocket is not None:
        law = (parameters.sprocket_restitution, parameters.sprocket_friction)
        hub, contact_radius, angular_velocity = sprocket
        for link in range(n):
            for centre in ends[link]:
                distance = np.hypot(*(centre - hub))
                if 0 < distance < contact_radius + radii[link]:
                    outwards = (centre - hub) / distance
                    point = centre - radii[link] * outwards
                    surface = angular_velocity * turned(point - hub)
                    counts["sprocket"] += collide(None, link, point, outwards, law, surface)
    if self_contact:
        law = (parameters.chain_restitution, parameters.chain_friction)
        in_order = sorted(touching_pairs(position, parameters), key=self_contact_order)
        for half, pair in product((0, 1), in_order):
            for a, b, centre_a, centre_b in _circle_pairs(pair, ends, half):
                distance = np.hypot(*(centre_b - centre_a))
                if 0 < distance < radii[a] + radii[b]:
                    normal = (centre_b - centre_a) / distance
                    nearest = centre_a + radii[a] * normal, centre_b - radii[b] * normal
                    counts["self"] += collide(a, b, sum(nearest) / 2, normal, law)
    return velocity, counts


def self_contact_order(pair: tuple[int, int]) -> tuple[int, int, int, int]:
    """Sort key of a joint pair (p, q), p < q: p mod 2, q mod 2, p, q."""
    p, q = pair
    return p % 2, q % 2, p, q


def touching_pairs(position: Array, parameters: Parameters) -> list[tuple[int, int]]:
    """All joint pairs (p, q), p < q, sorted, at which circles of two links overlap, by trying every pair.

    Circles of the same link or of neighbours never count. Exactly concentric circles do overlap.
    """
    n = len(position)
    radii = link_radii(n, parameters)
    ends = np.stack(link_ends(position, parameters), axis=1)
    return [
        (p, q)
        for p in range(n)
        for q in range(p + 1, n)
        if any(
            np.hypot(*(centre_b - centre_a)) < radii[a] + radii[b]
            for half in (0, 1)
            for a, b, centre_a, centre_b in _circle_pairs((p, q), ends, half)
        )
    ]


def _circle_pairs(pair: tuple[int, int], ends: Array, half: int) -> Iterator[tuple[int, int, Array, Array]]:
    """Link a at joint p, link b at joint q and the centres of their circles there, for links that can touch."""
    n = len(ends)
    p, q = pair
    for after_p in (0, 1):
        after_q = after_p ^ half
        a, b = (p + after_p) % n, (q + after_q) % n
        if 2 <= (b - a) % n <= n - 2:
            yield a, b, ends[a, 1 - after_p], ends[b, 1 - after_q]
