"""The model in plain NumPy, written from its equations: the oracle that the tests hold the kernels against.

Nothing here is fast, and nothing here is shared with the kernels. Conventions of all functions:

- A chain of n links (n even, at least 4) has `position` (n, 3): x, y (m) and angle θ (rad) of each link's centre
  of mass, and `velocity` (n, 3): their time derivatives (m/s, rad/s). Even indices are inner links.
- u_i = (cos θ_i, sin θ_i) points from the left to the right end of link i, t_i = ẑ × u_i, a = ℓ/2. Joint i joins
  the right end of link i to the left end of link i+1 (mod n).
- `parameters` gives the values by the names of `warpchain.parameters.Parameters`. SI units, y upwards.

Sources: "A walking roller chain", sections 2.1 and 2.2; A. Chatterjee and A. Ruina, "A new algebraic rigid-body
collision law based on impulse space considerations", Journal of Applied Mechanics 65 (1998) 939-951.
"""

from __future__ import annotations

from itertools import pairwise, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Iterator

    from warpchain.parameters import Parameters

Array = NDArray[np.float64]
Sprocket = tuple[Array, float, float]
"""Centre (2,) in m, radius that the link circles touch in m, angular velocity in rad/s (anticlockwise > 0)."""


def link_masses(n: int, parameters: Parameters) -> Array:
    """Mass of each link, (n,), kg. Raises ValueError unless n is even and at least 4."""
    return _alternating(n, parameters.inner_mass, parameters.outer_mass)


def link_inertias(n: int, parameters: Parameters) -> Array:
    """Moment of inertia of each link about its centre, (n,), kg m². Raises ValueError as `link_masses`."""
    return _alternating(n, parameters.inner_inertia, parameters.outer_inertia)


def link_ends(position: Array, parameters: Parameters) -> tuple[Array, Array]:
    """Left and right end of each link, X ∓ a u, (n, 2) each, m."""
    offset = parameters.link_length / 2 * _direction(position[:, 2])
    return position[:, :2] - offset, position[:, :2] + offset


def joint_opening(position: Array, parameters: Parameters) -> Array:
    """C_i = left end of link i+1 − right end of link i, (n, 2), m; zero when the joint is closed."""
    left, right = link_ends(position, parameters)
    return np.roll(left, -1, axis=0) - right


def joint_opening_rate(position: Array, velocity: Array, parameters: Parameters) -> Array:
    """Time derivative of `joint_opening`, (n, 2), m/s."""
    offset_rate = parameters.link_length / 2 * velocity[:, 2:] * _turned(_direction(position[:, 2]))
    return np.roll(velocity[:, :2] - offset_rate, -1, axis=0) - (velocity[:, :2] + offset_rate)


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
    before = np.roll(here, 1, axis=0)
    spin = velocity[:, 2]
    lever = parameters.link_length / 2 * _turned(_direction(position[:, 2]))
    torque = np.sum(lever * (here + before), axis=1)
    torque -= friction_torque(spin - np.roll(spin, 1), parameters)
    torque -= friction_torque(spin - np.roll(spin, -1), parameters)
    result = np.empty((n, 3))
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


def friction_power(velocity: Array, parameters: Parameters) -> float:
    """Power that joint friction dissipates, Σ f(w) w with w = θ̇_i − θ̇_{i+1}, W."""
    spin = velocity[:, 2] - np.roll(velocity[:, 2], -1)
    return float(np.sum(friction_torque(spin, parameters) * spin))


def damping_power(position: Array, velocity: Array, parameters: Parameters) -> float:
    """Power that joint damping dissipates, Σ b |Ċ|², W."""
    return float(parameters.joint_damping * np.sum(joint_opening_rate(position, velocity, parameters) ** 2))


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
    return float(mass @ _cross(arm, drift) + link_inertias(n, parameters) @ velocity[:, 2])


def solve_flight(
    position: Array,
    velocity: Array,
    times: Array,
    parameters: Parameters,
    *,
    gravity: bool = True,
    rtol: float = 1e-12,
    atol: float = 1e-12,
    method: str = "DOP853",
) -> tuple[Array, Array, int]:
    """Integrate the free chain with `scipy.integrate.solve_ivp`.

    Every requested time ends an integration, so that no result is interpolated.

    Args:
        position: start, (n, 3), at `times[0]`.
        velocity: start, (n, 3), at `times[0]`.
        times: (t,), s, strictly increasing.
        parameters: the chain.
        gravity: whether gravity acts.
        rtol: relative tolerance of `solve_ivp`.
        atol: absolute tolerance of `solve_ivp`, for positions (m, rad) and velocities (m/s, rad/s) alike.
        method: method of `solve_ivp`.

    Returns:
        positions (t, n, 3), velocities (t, n, 3) and the number of evaluations of the equations.

    Raises:
        ImportError: SciPy is not installed.
        ValueError: `times` is not a strictly increasing sequence, or the start is not finite.
        RuntimeError: the solver failed.
    """
    try:
        from scipy.integrate import solve_ivp
    except ImportError as error:
        raise ImportError("solve_flight needs SciPy: pip install 'warpchain[scipy]'") from error

    times = np.asarray(times, dtype=np.float64)
    if times.ndim != 1 or len(times) == 0 or not np.all(np.diff(times) > 0):
        raise ValueError("times must be a strictly increasing sequence of at least one time")
    n = len(position)

    def derivative(_: float, state: Array) -> Array:
        x, v = state.reshape(2, n, 3)
        return np.concatenate([v, acceleration(x, v, parameters, gravity=gravity)]).ravel()

    states = np.empty((len(times), 2, n, 3))
    states[0] = position, velocity
    evaluations = 0
    for step, span in enumerate(pairwise(times)):
        solution = solve_ivp(
            derivative, span, states[step].ravel(), method=method, t_eval=[span[1]], rtol=rtol, atol=atol
        )
        evaluations += int(solution.nfev)
        if not solution.success or not np.all(np.isfinite(solution.y)):
            raise RuntimeError(f"{method} failed between {span[0]} s and {span[1]} s: {solution.message}")
        states[step + 1] = solution.y[:, -1].reshape(2, n, 3)
    return states[:, 0], states[:, 1], evaluations


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

    Args:
        v_rel: v_A − v_B at P, (2,), m/s.
        normal: unit vector from A to B, (2,).
        lever_a: P − centre of mass of A, (2,), m.
        lever_b: P − centre of mass of B, (2,), m.
        inv_mass_a: 1/m_A, 1/kg; 0 for an immovable body.
        inv_inertia_a: 1/I_A, 1/(kg m²); 0 for an immovable body.
        inv_mass_b: 1/m_B, 1/kg; not both bodies may be immovable.
        inv_inertia_b: 1/I_B, 1/(kg m²).
        restitution: e in [0, 1].
        friction: μ, at least 0.
        tangential_restitution: e_t in [−1, 1].

    Returns:
        J in world axes, (2,), N s; zero unless the bodies approach (v_n > 0).
    """
    v_n = float(normal @ v_rel)
    if v_n <= 0:
        return np.zeros(2)
    tangent = _turned(normal)
    turn_a, turn_b = _turned(lever_a), _turned(lever_b)
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

    A link has a circle of radius r at either end. Circles touch when they overlap (gap < 0); a touching contact
    gets the impulse of `collision_impulse` if it approaches, else nothing. Positions never change. Two circles, or
    a circle and the sprocket, with exactly the same centre have no normal and are left alone.

    Order: floor, links 0 … n−1, left circle before right; sprocket likewise; then self-contacts in two halves, each by
    joint pair in the order of `self_contact_order`: of a joint pair (p, q), the first half has the link pairs (p, q)
    and (p+1, q+1), the second (p, q+1) and (p+1, q), links mod n. Equal and neighbouring links are passed over.

    The point P and the normal: floor (A; y = 0): the circle's lowest point, +y. Sprocket (A): the circle's point
    nearest the sprocket's centre, radially outwards; the surface moves with Ω ẑ × (P − centre). Two links: midway
    between the circles' centres, from A, the link at joint p, to B, the link at joint q > p.

    Args:
        position: (n, 3).
        velocity: (n, 3); not changed.
        parameters: the chain and its coefficients of collision.
        floor: whether there is a floor.
        sprocket: the sprocket, or None.
        self_contact: whether links collide with each other.

    Returns:
        The new velocity (n, 3), and the numbers of impulses by kind: "floor", "sprocket", "self".
    """
    n = len(position)
    velocity = velocity.copy()
    inv_mass = 1 / link_masses(n, parameters)
    inv_inertia = 1 / link_inertias(n, parameters)
    radius = parameters.circle_radius
    counts = {"floor": 0, "sprocket": 0, "self": 0}

    def collide(
        a: int | None,
        b: int,
        point: Array,
        normal: Array,
        law: tuple[float, float],
        surface: Array | None = None,
    ) -> bool:
        """Resolve one contact of link b with link a, or with a surface of the given velocity (at rest if None)."""
        lever_a, lever_b = np.zeros(2), point - position[b, :2]
        v_a, inverses_a = np.zeros(2) if surface is None else surface, (0.0, 0.0)
        v_b = velocity[b, :2] + velocity[b, 2] * _turned(lever_b)
        if a is not None:
            lever_a, inverses_a = point - position[a, :2], (inv_mass[a], inv_inertia[a])
            v_a = velocity[a, :2] + velocity[a, 2] * _turned(lever_a)
        inverses = (*inverses_a, inv_mass[b], inv_inertia[b])
        coefficients = (*law, parameters.tangential_restitution)
        impulse = collision_impulse(v_a - v_b, normal, lever_a, lever_b, *inverses, *coefficients)
        if a is not None:
            velocity[a, :2] -= inv_mass[a] * impulse
            velocity[a, 2] -= inv_inertia[a] * _cross(lever_a, impulse)
        velocity[b, :2] += inv_mass[b] * impulse
        velocity[b, 2] += inv_inertia[b] * _cross(lever_b, impulse)
        return bool(impulse.any())

    ends = np.stack(link_ends(position, parameters), axis=1)
    if floor:
        law = (parameters.floor_restitution, parameters.floor_friction)
        upwards = np.array([0.0, 1.0])
        for link in range(n):
            for centre in ends[link]:
                if centre[1] - radius < 0:
                    counts["floor"] += collide(None, link, centre - radius * upwards, upwards, law)
    if sprocket is not None:
        law = (parameters.sprocket_restitution, parameters.sprocket_friction)
        hub, contact_radius, angular_velocity = sprocket
        for link in range(n):
            for centre in ends[link]:
                distance = np.hypot(*(centre - hub))
                if 0 < distance < contact_radius + radius:
                    outwards = (centre - hub) / distance
                    point = centre - radius * outwards
                    surface = angular_velocity * _turned(point - hub)
                    counts["sprocket"] += collide(None, link, point, outwards, law, surface)
    if self_contact:
        law = (parameters.chain_restitution, parameters.chain_friction)
        in_order = sorted(touching_pairs(position, parameters), key=self_contact_order)
        for half, pair in product((0, 1), in_order):
            for a, b, centre_a, centre_b in _circle_pairs(pair, ends, half):
                distance = np.hypot(*(centre_b - centre_a))
                if 0 < distance < 2 * radius:
                    normal = (centre_b - centre_a) / distance
                    counts["self"] += collide(a, b, (centre_a + centre_b) / 2, normal, law)
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
    ends = np.stack(link_ends(position, parameters), axis=1)
    return [
        (p, q)
        for p in range(n)
        for q in range(p + 1, n)
        if any(
            np.hypot(*(centre_b - centre_a)) < 2 * parameters.circle_radius
            for half in (0, 1)
            for _, _, centre_a, centre_b in _circle_pairs((p, q), ends, half)
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


def circular_loop(n: int, parameters: Parameters, speed: float, *, stretched: bool = False) -> tuple[Array, Array]:
    """A loop that turns like a rigid body about the origin, numbered anticlockwise.

    Closed joints (the default): a regular n-gon of side ℓ whose joints move at `speed`. With half the angle
    between links α = π/n, the joints lie at ℓ/(2 sin α) from the centre, the centres of mass at ℓ/(2 tan α), and
    the loop turns at Ω = speed · 2 sin α/ℓ.

    `stretched=True`: the springs' exact equilibrium at the same Ω, for b = 0. All links stay tangential, inner ones
    at distance ρ₁ from the centre and outer ones at ρ₂. A joint's opening after an inner link is then
    C = ((ρ₂ − ρ₁) cos α, (ρ₁ + ρ₂) sin α − ℓ cos α) in the radial and tangential direction midway between the
    two links, after an outer link its mirror image. Mirror symmetry about each link cancels all torques, and the
    forces k C supply the centripetal forces if

        (m₁Ω²/k − 2) ρ₁ + 2 cos 2α ρ₂ = −ℓ sin 2α,    2 cos 2α ρ₁ + (m₂Ω²/k − 2) ρ₂ = −ℓ sin 2α.

    Joint friction is silent, as links don't turn relative to each other. A damper is not: the model damps Ċ = Ω ẑ × C
    of the turning opening, so for b > 0 the loop loses the power n b Ω² |C|² and only nearly keeps its shape.

    Args:
        n: number of links, even, at least 4.
        parameters: the chain.
        speed: speed of the joints of the closed loop, m/s; anticlockwise if positive.
        stretched: whether the springs are in equilibrium with the rotation.

    Returns:
        position (n, 3), velocity (n, 3).

    Raises:
        ValueError: n is odd or less than 4, or the springs can't hold the stretched loop at this speed.
    """
    mass = link_masses(n, parameters)
    length = parameters.link_length
    alpha = np.pi / n
    spin = speed * 2 * np.sin(alpha) / length
    distance = np.full(n, length / (2 * np.tan(alpha)))
    if stretched:
        inner, outer = mass[:2] * spin**2 / parameters.joint_stiffness
        coupling = 2 * np.cos(2 * alpha)
        balance = np.array([[inner - 2, coupling], [coupling, outer - 2]])
        if inner >= 2 or np.linalg.det(balance) <= 0:
            raise ValueError(f"joint_stiffness {parameters.joint_stiffness} N/m can't hold {speed} m/s")
        distance = np.tile(np.linalg.solve(balance, np.full(2, -length * np.sin(2 * alpha))), n // 2)
    angle = np.linspace(0.0, 2 * np.pi, n, endpoint=False, dtype=np.float64)
    centre = distance[:, None] * _direction(angle)
    position = np.column_stack([centre, angle + np.pi / 2])
    return position, np.column_stack([spin * _turned(centre), np.full(n, spin)])


def circular_loop_force(n: int, parameters: Parameters, speed: float) -> tuple[float, float]:
    """Tangential and radial component of the force in the joints of the closed `circular_loop`, N.

    Exact for rigid joints, unequal masses included, and independent of the moments of inertia. With ρ the distance of
    the centres of mass, mirror symmetry about a link makes the force on it at its two ends mirror images. So the
    tangential component T (a pull on both links of a joint) is the same in all joints, the radial one ±S (on an
    inner link S, outwards if positive, on an outer link −S), and no torque is left: the regular polygon is an
    equilibrium even for alternating masses. The centripetal forces are

        inner: 2 (T sin α − S cos α) = m₁ Ω² ρ,    outer: 2 (T sin α + S cos α) = m₂ Ω² ρ,    α = π/n,

    and with v = Ω ℓ/(2 sin α) the speed of the joints and m̄ = (m₁ + m₂)/2

        T = m̄ v² cos α/ℓ,    S = (m₂ − m₁) v² sin α/(2ℓ),    |S/T| = |m₂ − m₁| tan α/(2 m̄).

    T is m̄ v²/ℓ to leading order in 1/n. Springs open by these forces divided by k, to leading order in T/(k ℓ).

    Args:
        n: number of links, even, at least 4.
        parameters: the chain.
        speed: v, m/s.

    Returns:
        T and S, N.

    Raises:
        ValueError: n is odd or less than 4.
    """
    inner, outer = link_masses(n, parameters)[:2]
    alpha = np.pi / n
    dynamic = speed**2 / parameters.link_length
    tangential = (inner + outer) / 2 * dynamic * np.cos(alpha)
    return float(tangential), float((outer - inner) / 2 * dynamic * np.sin(alpha))


def _alternating(n: int, inner: float, outer: float) -> Array:
    if n < 4 or n % 2:
        raise ValueError(f"a chain has an even number of links, at least 4; got {n}")
    return np.tile([inner, outer], n // 2)


def _direction(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _turned(vector: Array) -> Array:
    """ẑ × vector."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def _cross(first: Array, second: Array) -> Array:
    """The z component of first × second."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
