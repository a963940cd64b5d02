"""A loop that turns like a rigid body, in closed form, with the conventions of `motion_equations`."""

import numpy as np
from numpy.typing import NDArray

from tests.oracle_model.motion_equations import direction, link_masses, turned
from warpchain.inputs.parameters import Parameters

Array = NDArray[np.float64]


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
    centre = distance[:, None] * direction(angle)
    position = np.column_stack([centre, angle + np.pi / 2])
    return position, np.column_stack([spin * turned(centre), np.full(n, spin)])


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
