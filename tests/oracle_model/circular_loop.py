"""A loop that turns like a rigid body, in closed form, with the conventions of `motion_equations`."""

import numpy as np

from tests.oracle_model.motion_equations import direction, link_masses, turned
from tests.support.arrays import Array
from warpchain.inputs.parameters import Parameters


def circular_loop(n: int, parameters: Parameters, speed: float) -> tuple[Array, Array]:
    """A loop with closed joints that turns about the origin, numbered anticlockwise: position and velocity (n, 3).

    It is a regular n-gon of side ℓ whose joints move at `speed` [m/s], anticlockwise if positive. With half the angle
    between links α = π/n, the joints lie at ℓ/(2 sin α) from the centre, the centres of mass at ℓ/(2 tan α), and
    the loop turns at Ω = speed · 2 sin α/ℓ. Joint friction is silent, as links don't turn relative to each other.
    Raises ValueError unless n is even and at least 4.
    """
    link_masses(n, parameters)
    length, alpha = parameters.link_length, np.pi / n
    spin = speed * 2 * np.sin(alpha) / length
    angle = np.linspace(0.0, 2 * np.pi, n, endpoint=False, dtype=np.float64)
    centre = length / (2 * np.tan(alpha)) * direction(angle)
    position = np.column_stack([centre, angle + np.pi / 2])
    return position, np.column_stack([spin * turned(centre), np.full(n, spin)])


def circular_loop_force(n: int, parameters: Parameters, speed: float) -> tuple[float, float]:
    """Tangential and radial component T and S [N] of the force in the joints of `circular_loop` at a speed [m/s].

    Exact for rigid joints, unequal masses included, and independent of the moments of inertia. With ρ the distance of
    the centres of mass, mirror symmetry about a link makes the force on it at its two ends mirror images. So the
    tangential component T (a pull on both links of a joint) is the same in all joints, the radial one ±S (on an
    inner link S, outwards if positive, on an outer link −S), and no torque is left: the regular polygon is an
    equilibrium even for alternating masses. The centripetal forces are

        inner: 2 (T sin α − S cos α) = m₁ Ω² ρ,    outer: 2 (T sin α + S cos α) = m₂ Ω² ρ,    α = π/n,

    and with v = Ω ℓ/(2 sin α) the speed of the joints and m̄ = (m₁ + m₂)/2

        T = m̄ v² cos α/ℓ,    S = (m₂ − m₁) v² sin α/(2ℓ),    |S/T| = |m₂ − m₁| tan α/(2 m̄).

    T is m̄ v²/ℓ to leading order in 1/n. Springs open by these forces divided by k, to leading order in T/(k ℓ).

    """
    inner, outer = link_masses(n, parameters)[:2]
    alpha = np.pi / n
    dynamic = speed**2 / parameters.link_length
    tangential = (inner + outer) / 2 * dynamic * np.cos(alpha)
    return float(tangential), float((outer - inner) / 2 * dynamic * np.sin(alpha))
