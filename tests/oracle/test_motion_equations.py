"""The NumPy reference: motion and energies against derivatives and numbers by hand, the turning loop in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from tests.oracle_model.circular_loop import circular_loop
from tests.support.mild_parameters import MILD, UNIT
from tests.support.presets import PAPER
from warpchain.inputs.parameters import Parameters


def disturbed_loop(n: int, parameters: Parameters, seed: int = 1):
    """A circular loop at 2 m/s with joints opened by micrometres and links turning at random."""
    generator = np.random.default_rng(seed)
    position, velocity = circular_loop(n, parameters, 2.0)
    position += generator.normal(size=(n, 3)) * [2e-6, 2e-6, 2e-4]
    velocity += generator.normal(size=(n, 3)) * [0.02, 0.02, 3.0]
    return position, velocity


def complex_gradient(function, point: np.ndarray) -> np.ndarray:
    """Derivatives of an analytic function by complex steps: exact to rounding."""
    gradient = np.empty(point.shape)
    for index in np.ndindex(*point.shape):
        shifted = point.astype(complex)
        shifted[index] += 1e-40j
        gradient[index] = function(shifted).imag / 1e-40
    return gradient


@pytest.mark.parametrize("parameters", [MILD, PAPER.with_values({"friction_smoothing": 5.0})])
def test_acceleration_is_gradient_of_potential_and_rayleigh_function(parameters):
    """M q̈ = −∂V/∂q − ∂R/∂q̇, with V and Rayleigh's R written down here and differentiated by complex steps."""
    n, p = 6, parameters
    half, masses, inertias = (
        p.link_length / 2,
        [p.inner_mass, p.outer_mass] * 3,
        [p.inner_inertia, p.outer_inertia] * 3,
    )

    def potential(q):
        energy = 0
        for i in range(n):
            (x, y, angle), (x_next, y_next, angle_next) = q[i], q[(i + 1) % n]
            gap_x = x_next - x - half * (np.cos(angle) + np.cos(angle_next))
            gap_y = y_next - y - half * (np.sin(angle) + np.sin(angle_next))
            energy += p.joint_stiffness / 2 * (gap_x**2 + gap_y**2) + masses[i] * p.gravity * y
        return energy

    def rayleigh(q, v):
        dissipation = 0
        for i in range(n):
            (vx, vy, spin), (vx_next, vy_next, spin_next) = v[i], v[(i + 1) % n]
            angle, angle_next = q[i, 2], q[(i + 1) % n, 2]
            rate_x = vx_next - vx + half * (np.sin(angle) * spin + np.sin(angle_next) * spin_next)
            rate_y = vy_next - vy - half * (np.cos(angle) * spin + np.cos(angle_next) * spin_next)
            relative = spin - spin_next
            dissipation += p.joint_damping / 2 * (rate_x**2 + rate_y**2) + p.viscous_friction / 2 * relative**2
            dissipation += p.coulomb_friction * p.friction_smoothing * np.log(np.cosh(relative / p.friction_smoothing))
        return dissipation

    position, velocity = disturbed_loop(n, p)
    force = -complex_gradient(potential, position) - complex_gradient(lambda v: rayleigh(position, v), velocity)
    expected = force / np.column_stack([masses, masses, inertias])
    result = motion_equations.acceleration(position, velocity, p)
    assert_allclose(result, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    gravity = motion_equations.acceleration(position, velocity, p) - motion_equations.acceleration(
        position, velocity, p, gravity=False
    )
    assert_allclose(gravity, np.tile([0, -p.gravity, 0], (n, 1)), atol=1e-9 * np.abs(expected).max())


def test_energies_and_momenta_by_hand():
    """Energies and momenta of four separate unit links, worked out term by term."""
    position = np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0.0]])
    velocity = np.array([[1, 0, 2], [0, 3, 0], [0, 0, 0], [0, 0, -1.0]])
    parameters = UNIT.with_values({"joint_stiffness": 10.0, "gravity": 10.0})
    # C = (2,0), (−2,2), (−6,0), (−2,−2): Σ|C|² = 4 + 8 + 36 + 8 = 56.
    assert motion_equations.spring_energy(position, parameters) == pytest.approx(280)
    assert motion_equations.gravitational_energy(position, parameters) == pytest.approx(40)
    assert motion_equations.kinetic_energy(velocity, parameters) == pytest.approx((1 + 9 + 4 + 1) / 2)
    assert motion_equations.total_energy(position, velocity, parameters) == pytest.approx(327.5)
    assert motion_equations.total_energy(position, velocity, parameters, gravity=False) == pytest.approx(287.5)
    assert_allclose(motion_equations.linear_momentum(velocity, parameters), [1, 3])
    # About (2, 1): (−2,−1)×(1,0) = 1, (2,−1)×(0,3) = 6, spin 2 − 1.
    assert motion_equations.angular_momentum(position, velocity, parameters) == pytest.approx(8)
