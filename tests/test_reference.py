"""The NumPy reference against hand-worked numbers, derivatives, invariants and closed forms."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.testing import assert_allclose, assert_array_equal

from warpchain import reference
from warpchain.parameters import Parameters, preset

from .impulse_cases import (
    BALL,
    HAND_CASES,
    Collision,
    collisions,
    crumpled_chain,
    crumpled_chains,
    law_violations,
)

PAPER = preset("paper")
MILD = PAPER.with_values(
    {
        "joint_stiffness": 1e5,
        "joint_damping": 0.5,
        "friction_smoothing": 5.0,
        "viscous_friction": 9e-4,
        "coulomb_friction": 1e-3,
    }
)
"""Soft and dissipative: every term of the equations matters within milliseconds."""
SILENT = MILD.with_values({"joint_damping": 0.0, "viscous_friction": 0.0, "coulomb_friction": 0.0})
"""MILD without dissipation."""
UNIT = PAPER.with_values(
    {
        "link_length": 2.0,
        "circle_radius": 0.5,
        **dict.fromkeys(["inner_mass", "outer_mass", "inner_inertia", "outer_inertia"], 1.0),
        **dict.fromkeys(["floor_restitution", "sprocket_restitution", "chain_restitution"], 0.0),
        **dict.fromkeys(["floor_friction", "sprocket_friction", "chain_friction"], 1.0),
    }
)
"""Links of 2 m, 1 kg and 1 kg m², circles of 0.5 m, e = 0 and μ = 1: for contacts worked by hand."""


def disturbed_loop(n: int, parameters: Parameters, seed: int = 1):
    """A circular loop at 2 m/s with joints opened by micrometres and links turning at random."""
    generator = np.random.default_rng(seed)
    position, velocity = reference.circular_loop(n, parameters, 2.0)
    position += generator.normal(size=(n, 3)) * [2e-6, 2e-6, 2e-4]
    velocity += generator.normal(size=(n, 3)) * [0.02, 0.02, 3.0]
    return position, velocity


def scattered_links(n: int):
    """n links far apart in the air, at rest."""
    position = np.column_stack([10.0 * np.arange(n), np.full(n, 100.0), np.zeros(n)])
    return position, np.zeros((n, 3))


def complex_gradient(function, point: np.ndarray) -> np.ndarray:
    """Derivatives of an analytic function by complex steps: exact to rounding."""
    gradient = np.empty(point.shape)
    for index in np.ndindex(*point.shape):
        shifted = point.astype(complex)
        shifted[index] += 1e-40j
        gradient[index] = function(shifted).imag / 1e-40
    return gradient


# --- masses and equations of motion ---


def test_even_links_are_inner():
    """Masses and inertias alternate, inner links first, and odd or tiny chains are refused."""
    assert_array_equal(reference.link_masses(4, PAPER), [3.7e-3, 3.147e-3] * 2)
    assert_array_equal(reference.link_inertias(4, PAPER), [1.69e-7, 1.292e-7] * 2)
    for n in (5, 2, 0):
        with pytest.raises(ValueError, match=f"even number of links, at least 4; got {n}"):
            reference.link_masses(n, PAPER)


def test_acceleration_by_hand():
    """One joint opened by (0.1, 0.2) m pulls the two links at it, and only them, by k C and its torque."""
    # A square of side 2 run anticlockwise; link 1 shifted by δ = (0.1, 0.2). C_0 = δ, C_1 = −δ; k = 10, so
    # F_0 = (1, 2), F_1 = (−1, −2), F_2 = F_3 = 0. t = (0,1), (−1,0), (0,−1), (1,0); a = 1.
    square = np.array([[0, -1, 0], [1, 0, np.pi / 2], [0, 1, np.pi], [-1, 0, 3 * np.pi / 2]])
    square[1, :2] += [0.1, 0.2]
    parameters = UNIT.with_values({"joint_stiffness": 10.0})
    expected = [[1, 2, 2], [-2, -4, 0], [1, 2, 2], [0, 0, 0]]
    result = reference.acceleration(square, np.zeros((4, 3)), parameters, gravity=False)
    assert_allclose(result, expected, atol=1e-14)


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
    result = reference.acceleration(position, velocity, p)
    assert_allclose(result, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    gravity = reference.acceleration(position, velocity, p) - reference.acceleration(
        position, velocity, p, gravity=False
    )
    assert_allclose(gravity, np.tile([0, -p.gravity, 0], (n, 1)), atol=1e-9 * np.abs(expected).max())


def test_opening_rate_is_derivative_of_opening():
    """Ċ is the derivative of C along the velocity."""
    position, velocity = disturbed_loop(8, MILD)
    step = 1e-6
    ahead, behind = (reference.joint_opening(position + sign * step * velocity, MILD) for sign in (1, -1))
    rate = reference.joint_opening_rate(position, velocity, MILD)
    assert_allclose(rate, (ahead - behind) / (2 * step), atol=1e-7)
    assert np.abs(rate).max() > 1e-2


def test_power_of_all_forces_is_minus_dissipated_power():
    """The rate of the total energy, Σ v·M a + dV/dt, is minus the power of joint friction and damping."""
    position, velocity = disturbed_loop(8, MILD)
    mass = np.column_stack([reference.link_masses(8, MILD)] * 2 + [reference.link_inertias(8, MILD)])
    force = mass * reference.acceleration(position, velocity, MILD)
    opening = reference.joint_opening(position, MILD)
    rate = np.sum(velocity * force) + MILD.gravity * np.sum(mass[:, 1] * velocity[:, 1])
    rate += MILD.joint_stiffness * np.sum(opening * reference.joint_opening_rate(position, velocity, MILD))
    friction = reference.friction_power(velocity, MILD)
    damping = reference.damping_power(position, velocity, MILD)
    assert friction > 1e-2
    assert damping > 1e-4
    assert_allclose(rate, -friction - damping, rtol=1e-10)


def test_energies_and_momenta_by_hand():
    """Energies and momenta of four separate unit links, worked out term by term."""
    position = np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0.0]])
    velocity = np.array([[1, 0, 2], [0, 3, 0], [0, 0, 0], [0, 0, -1.0]])
    parameters = UNIT.with_values({"joint_stiffness": 10.0, "gravity": 10.0})
    # C = (2,0), (−2,2), (−6,0), (−2,−2): Σ|C|² = 4 + 8 + 36 + 8 = 56.
    assert reference.spring_energy(position, parameters) == pytest.approx(280)
    assert reference.gravitational_energy(position, parameters) == pytest.approx(40)
    assert reference.kinetic_energy(velocity, parameters) == pytest.approx((1 + 9 + 4 + 1) / 2)
    assert reference.total_energy(position, velocity, parameters) == pytest.approx(327.5)
    assert reference.total_energy(position, velocity, parameters, gravity=False) == pytest.approx(287.5)
    assert_allclose(reference.linear_momentum(velocity, parameters), [1, 3])
    # About (2, 1): (−2,−1)×(1,0) = 1, (2,−1)×(0,3) = 6, spin 2 − 1.
    assert reference.angular_momentum(position, velocity, parameters) == pytest.approx(8)
    # Relative spins 2, 0, 1, −3.
    viscous = parameters.with_values({"viscous_friction": 0.5, "coulomb_friction": 0.0})
    assert reference.friction_power(velocity, viscous) == pytest.approx(0.5 * (4 + 1 + 9))


def test_friction_torque_by_hand():
    """f is odd, β w + τ_c beyond ω_c, and (β + τ_c/ω_c) w within."""
    assert_allclose(reference.friction_torque(np.array([10.0, -10.0]), PAPER), [1.01e-3, -1.01e-3], rtol=1e-14)
    assert_allclose(reference.friction_torque(np.array(1e-9), PAPER), (9e-5 + 0.11) * 1e-9, rtol=1e-10)


# --- flight ---


def test_flight_counts_its_evaluations(monkeypatch):
    """The reported number is that of all calls of the equations of motion, over all requested times."""
    calls = []
    acceleration = reference.acceleration
    monkeypatch.setattr(
        reference, "acceleration", lambda *args, **kwargs: calls.append(1) or acceleration(*args, **kwargs)
    )
    position, velocity = disturbed_loop(4, MILD)
    _, _, evaluations = reference.solve_flight(position, velocity, np.array([0.0, 1e-4, 2e-4]), MILD)
    assert evaluations == len(calls) > 0


def test_flight_keeps_energy_and_momenta():
    """Without dissipation a flight keeps energy and spin, and linear momentum grows by the weight alone."""
    position, velocity = disturbed_loop(8, SILENT)
    times = np.array([0.0, 2e-3, 4e-3])
    positions, velocities, evaluations = reference.solve_flight(position, velocity, times, SILENT)
    assert evaluations > 100
    assert_array_equal(positions[0], position)
    weight = np.array([0, -SILENT.gravity * reference.link_masses(8, SILENT).sum()])
    energy = reference.total_energy(position, velocity, SILENT)
    momentum = reference.linear_momentum(velocity, SILENT)
    spin = reference.angular_momentum(position, velocity, SILENT)
    assert np.abs(positions[-1] - positions[0]).max() > 1e-3
    for time, x, v in zip(times, positions, velocities, strict=True):
        assert_allclose(reference.total_energy(x, v, SILENT), energy, rtol=1e-9)
        assert_allclose(reference.linear_momentum(v, SILENT), momentum + weight * time, rtol=1e-9, atol=1e-14)
        assert_allclose(reference.angular_momentum(x, v, SILENT), spin, rtol=1e-9)


def test_joint_friction_keeps_momenta():
    """Joint friction alone takes energy but neither linear nor angular momentum."""
    parameters = MILD.with_values({"joint_damping": 0.0})
    position, velocity = disturbed_loop(8, parameters)
    positions, velocities, _ = reference.solve_flight(
        position, velocity, np.array([0.0, 3e-3]), parameters, gravity=False
    )
    before, after = (reference.total_energy(positions[t], velocities[t], parameters, gravity=False) for t in (0, 1))
    assert after < 0.9999 * before
    momentum = reference.linear_momentum(velocity, parameters)
    assert_allclose(reference.linear_momentum(velocities[1], parameters), momentum, rtol=1e-10)
    spin = reference.angular_momentum(position, velocity, parameters)
    assert_allclose(reference.angular_momentum(positions[1], velocities[1], parameters), spin, rtol=1e-9)


def test_angular_momentum_changes_by_the_dampers_torque():
    """dL/dt about the centre of mass is −Σ b C × Ċ, and nothing else."""
    position, velocity = disturbed_loop(8, MILD)
    opening = reference.joint_opening(position, MILD)
    rate = reference.joint_opening_rate(position, velocity, MILD)
    expected = -MILD.joint_damping * np.sum(opening[:, 0] * rate[:, 1] - opening[:, 1] * rate[:, 0])
    slope = reference.acceleration(position, velocity, MILD)
    # L is linear in the velocities, and X − X_cm adds (Ẋ − Ẋ_cm) × Ẋ = 0 in sum.
    assert_allclose(reference.angular_momentum(position, slope, MILD), expected, rtol=1e-6)
    assert abs(expected) > 1e-9


def test_lost_energy_is_integral_of_dissipated_power():
    """E(0) − E(T) equals the time integral of friction and damping power (Gauss–Legendre quadrature)."""
    position, velocity = disturbed_loop(6, MILD)
    end = 1e-3
    nodes, weights = np.polynomial.legendre.leggauss(24)
    times = np.concatenate([[0.0], end / 2 * (1 + nodes), [end]])
    positions, velocities, _ = reference.solve_flight(position, velocity, times, MILD, rtol=1e-11, atol=1e-11)
    power = [
        reference.friction_power(v, MILD) + reference.damping_power(x, v, MILD)
        for x, v in zip(positions[1:-1], velocities[1:-1], strict=True)
    ]
    energies = [reference.total_energy(positions[t], velocities[t], MILD) for t in (0, -1)]
    lost = energies[0] - energies[1]
    assert lost > 1e-6
    assert_allclose(end / 2 * np.dot(weights, power), lost, rtol=1e-6)


def test_flight_refuses_and_reports():
    """Unordered times are refused, and a solver that fails raises instead of returning numbers."""
    position, velocity = disturbed_loop(4, MILD)
    for times in ([0.0, 0.0], [1.0, 0.0], [], [[0.0, 1.0]]):
        with pytest.raises(ValueError, match="strictly increasing"):
            reference.solve_flight(position, velocity, np.array(times), MILD)
    for speed, error in ((np.nan, ValueError), (1e308, RuntimeError)):
        velocity[0, 0] = speed
        with pytest.raises(error, match=r"finite|failed between 0\.0 s and 0\.001 s"), np.errstate(all="ignore"):
            reference.solve_flight(position, velocity, np.array([0.0, 1e-3]), MILD)


def test_scipy_is_needed_by_flight_only(monkeypatch):
    """Importing the reference leaves SciPy alone, and without SciPy a flight names the extra to install."""
    code = "import sys, warpchain.reference; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    monkeypatch.setitem(sys.modules, "scipy.integrate", None)
    position, velocity = disturbed_loop(4, MILD)
    with pytest.raises(ImportError, match=r"warpchain\[scipy\]"):
        reference.solve_flight(position, velocity, np.array([0.0, 1e-3]), MILD)


# --- the law of one collision ---


@pytest.mark.parametrize("name", HAND_CASES)
def test_impulse_by_hand(name):
    """Impulses worked out by hand."""
    collision, expected = HAND_CASES[name]
    assert_allclose(reference.collision_impulse(*collision.arguments()), expected, rtol=1e-14, atol=1e-14)


@given(collisions())
@settings(max_examples=1000, deadline=None, derandomize=True)
def test_impulse_obeys_the_law(collision: Collision):
    """Any approaching collision: v'_n = −e v_n, |J_t| ≤ μ J_n, and kinetic energy never rises."""
    assert law_violations(collision, reference.collision_impulse(*collision.arguments())) == []


@given(collisions())
@settings(max_examples=300, deadline=None, derandomize=True)
def test_energy_change_is_the_stated_sum_of_losses(collision: Collision):
    """ΔT = −½ (1−e²) J₁ᵀWJ₁ − ½ κ(2−κ) DᵀWD, with κ read off the impulse."""
    v, normal = np.array(collision.v_rel), np.array(collision.normal)
    w = np.column_stack([v - collision.relative_velocity_after(unit) for unit in np.eye(2)])
    stop_approach = normal * (normal @ v) / (normal @ w @ normal)
    slide = np.linalg.solve(w, v) - stop_approach
    impulse = reference.collision_impulse(*collision.arguments())
    rest = impulse - (1 + collision.restitution) * stop_approach
    size = np.linalg.norm(slide) * (np.linalg.norm(slide) + np.linalg.norm(impulse))
    assert abs(rest[0] * slide[1] - rest[1] * slide[0]) <= 1e-11 * size
    assert -1e-11 * size <= rest @ slide <= (1 + collision.tangential_restitution) * (slide @ slide) + 1e-11 * size
    # With rest = κ D: κ(2 − κ) DᵀWD = (2 D − rest)ᵀ W rest.
    losses = (1 - collision.restitution**2) * (stop_approach @ w @ stop_approach) + (2 * slide - rest) @ w @ rest
    scale = np.linalg.norm(v) * np.linalg.norm(impulse) + impulse @ w @ impulse
    assert_allclose(collision.kinetic_energy_change(impulse), -losses / 2, atol=1e-11 * scale)


def test_energy_can_rise_beyond_the_bounds_of_restitution():
    """With e_t = 1.5 the sticking ball gains 11.25 J, so the bound e_t ≤ 1 is needed."""
    # e = 1, μ = 1: J = [16, 2.5·6 = 15]; D = [0, 6], DᵀWD = 18, −½·2.5·(2 − 2.5)·18 = 11.25.
    collision = replace(BALL, restitution=1.0, friction=1.0, tangential_restitution=1.5)
    impulse = reference.collision_impulse(*collision.arguments())
    assert_allclose(impulse, [-15, 16], rtol=1e-14)
    assert collision.kinetic_energy_change(impulse) == pytest.approx(11.25)


def test_law_violations_can_see():
    """The judge of the law names each law that a wrong impulse breaks."""
    collision = replace(BALL, restitution=0.0)
    assert law_violations(collision, np.array([-2.0, 8.0])) == []
    assert law_violations(collision, np.array([-2.1, 8.0])) == ["friction cone"]
    assert law_violations(collision, np.array([-2.0, 8.1])) == ["normal restitution"]
    assert "energy never rises" in law_violations(collision, np.array([0.0, 20.0]))
    assert "pushes only" in law_violations(collision, np.array([0.0, -8.0]))


# --- contacts of a chain ---


def test_floor_contact_by_hand():
    """A flat link that falls on its left circle sticks at the touching point; a raised circle is left alone."""
    # Left circle overlaps, right one must not: the link is tilted by 1e-3, by which the numbers move.
    # P = (−1, −0.5) from the centre, v_P = (0, −3): W = [2, 1/2; 1/2, 5/4] in (n, t), J₂ = [5/3, −2/3] within μ = 1.
    position, velocity = scattered_links(4)
    position[0] = [0.0, 0.4995, 1e-3]
    velocity[0] = [0.0, -3.0, 0.0]
    result, counts = reference.resolve_contacts(position, velocity, UNIT)
    assert counts == {"floor": 1, "sprocket": 0, "self": 0}
    assert_allclose(result[0], [2 / 3, -4 / 3, -4 / 3], atol=5e-3)
    assert_array_equal(result[1:], 0)
    assert_array_equal(velocity[0], [0.0, -3.0, 0.0])
    _, counts = reference.resolve_contacts(position, velocity, UNIT, floor=False)
    assert counts["floor"] == 0


def test_left_circle_goes_before_right():
    """A flat falling link: the right circle's impulse sees the spin that the left circle's impulse left."""
    position, velocity = scattered_links(4)
    position[2] = [0.0, 0.4, 0.0]
    velocity[2] = [0.0, -3.0, 0.0]
    result, counts = reference.resolve_contacts(position, velocity, UNIT)
    assert counts["floor"] == 2
    # The left circle leaves (2/3, −4/3, −4/3). The right one, P = (1, −0.5), then moves with (0, −8/3), so J = (8/9)
    # of the left one's mirror image: (−16/27, 40/27) world, with torque (1)(40/27) − (−1/2)(−16/27) = 32/27.
    expected = [2 / 3 - 16 / 27, -4 / 3 + 40 / 27, -4 / 3 + 32 / 27]
    assert_allclose(result[2], expected, rtol=1e-12)


def test_touching_but_not_overlapping_is_no_contact():
    """Contact needs a negative gap: a circle that just touches the floor or another circle does nothing."""
    position, velocity = scattered_links(6)
    position[0] = [0.0, 0.5, 0.0]
    position[3] = [0.0, 0.5 + 1.0, 0.0]
    velocity[0], velocity[3] = [0.0, -3.0, 0.0], [0.0, -6.0, 0.0]
    assert reference.touching_pairs(position, UNIT) == []
    result, counts = reference.resolve_contacts(position, velocity, UNIT)
    assert_array_equal(result, velocity)
    assert sum(counts.values()) == 0


def test_sprocket_drags_a_link_by_hand():
    """A link falling on the sprocket's top slides and is dragged along by the turning surface."""
    # Left circle on top of the sprocket at (0, 50), R = 3, Ω = 1 (anticlockwise: surface moves to −x with 3 m/s).
    # v = [3, 3], P = (−1, −0.5) from the link's centre: J₁ = 3/2 n̂, J₂ = [1, 2], D = [−1/2, 2], J^(a) = [1, 2] slides:
    # κ = (3/2)/(2 + 1/2) = 3/5, J = [1.2, 1.2], world (−1.2, 1.2), torque −1.2 − 0.6 = −1.8.
    position, velocity = scattered_links(4)
    position[1] = [1.0, 50 + 3.4, 0.0]
    velocity[1] = [0.0, -3.0, 0.0]
    sprocket = (np.array([0.0, 50.0]), 3.0, 1.0)
    result, counts = reference.resolve_contacts(position, velocity, UNIT, sprocket=sprocket)
    assert counts == {"floor": 0, "sprocket": 1, "self": 0}
    assert_allclose(result[1], [-1.2, -3 + 1.2, -1.8], rtol=1e-12)
    _, counts = reference.resolve_contacts(position, velocity, UNIT)
    assert counts["sprocket"] == 0


def test_two_links_by_hand():
    """Two falling links whose right circles meet centrally end with a common velocity there."""
    # Link 0 at the origin, flat, moving right with 2 m/s; link 2 folded back, right end 0.8 m to the right. P is
    # midway, n̂ = +x through both centres: W_nn = 2, J = 1.
    position, velocity = scattered_links(6)
    position[0] = [0.0, 50.0, 0.0]
    position[2] = [2.8, 50.0, np.pi]
    velocity[0] = [2.0, 0.0, 0.0]
    assert reference.touching_pairs(position, UNIT) == [(0, 2)]
    result, counts = reference.resolve_contacts(position, velocity, UNIT)
    assert counts == {"floor": 0, "sprocket": 0, "self": 1}
    assert_allclose(result[[0, 2]], [[1, 0, 0], [1, 0, 0]], atol=1e-12)
    _, counts = reference.resolve_contacts(position, velocity, UNIT, self_contact=False)
    assert counts["self"] == 0


@pytest.mark.parametrize("kind", ["floor", "sprocket", "chain"])
def test_each_kind_of_contact_has_its_own_coefficients(kind):
    """An upright link that lands on its lower circle slides, or sticks, by the coefficients of what it lands on."""
    # Lever (0, −1.5): W_nn = 1, W_nt = 0, W_tt = 1 + 1.5² = 3.25. e = 0.3: J_n = 1.3·3 = 3.9. At 10 m/s it slides,
    # J_t = 3.9/4; at 0.5 m/s it sticks, J_t = (1 + e_t)·0.5/3.25. Landing on an equal link doubles W: half of both.
    parameters = UNIT.with_values({f"{kind}_restitution": 0.3, f"{kind}_friction": 0.25, "tangential_restitution": 0.5})
    height = {"floor": 1.5, "sprocket": 84.5, "chain": 103.0}[kind] - 1e-9
    share = 0.5 if kind == "chain" else 1.0
    for speed, pull in ((10.0, 3.9 / 4), (0.5, 1.5 * 0.5 / 3.25)):
        position, velocity = scattered_links(6)
        position[2], velocity[2] = [0.0, height, np.pi / 2], [speed, -3.0, 0.0]
        position[0] = [0.0, 100.0, np.pi / 2]
        sprocket = (np.array([0.0, 80.0]), 3.0, 0.0)
        result, counts = reference.resolve_contacts(position, velocity, parameters, sprocket=sprocket)
        assert counts == {"floor": kind == "floor", "sprocket": kind == "sprocket", "self": kind == "chain"}
        assert_allclose(result[2, :2], [speed - share * pull, share * 3.9 - 3], atol=1e-7)
        assert_allclose(result[2, 2], -1.5 * share * pull, atol=1e-7)


def test_concentric_circles_are_left_alone():
    """Circles with the same centre touch, but have no normal: no impulse, no NaN."""
    position, velocity = scattered_links(6)
    position[0] = [0.0, 50.0, 0.0]
    position[3] = [2.0, 50.0, 0.0]
    velocity[0] = [2.0, 0.0, 0.0]
    assert reference.touching_pairs(position, UNIT) == [(0, 2)]
    sprocket = (np.array([3.0, 50.0]), 0.1, 1.0)
    result, counts = reference.resolve_contacts(position, velocity, UNIT, sprocket=sprocket)
    assert_array_equal(result, velocity)
    assert sum(counts.values()) == 0


def test_self_contacts_go_in_the_documented_order():
    """A heap of six links equals a hand-written list of joint pairs, resolved one by one, and order matters."""
    order = [(0, 2), (0, 4), (2, 4), (0, 1), (0, 3), (0, 5), (2, 3), (2, 5), (4, 5)]
    order += [(1, 2), (1, 4), (3, 4), (1, 3), (1, 5), (3, 5)]
    position, start = crumpled_chain(6, 16, UNIT.link_length, 0.3)

    def in_order(pairs):
        velocity, count = start.copy(), 0
        ends = {
            "left": reference.link_ends(position, UNIT)[0],
            "right": reference.link_ends(position, UNIT)[1],
        }
        for p, q in pairs:
            for a, end_a, b, end_b in [
                (p, "right", q, "right"),
                (p, "right", (q + 1) % 6, "left"),
                ((p + 1) % 6, "left", q, "right"),
                ((p + 1) % 6, "left", (q + 1) % 6, "left"),
            ]:
                gap = ends[end_b][b] - ends[end_a][a]
                if min(abs(a - b), 6 - abs(a - b)) < 2 or np.linalg.norm(gap) >= 2 * UNIT.circle_radius:
                    continue
                normal, point = gap / np.linalg.norm(gap), ends[end_a][a] + gap / 2
                arm_a, arm_b = point - position[a, :2], point - position[b, :2]
                v_a = velocity[a, :2] + velocity[a, 2] * np.array([-arm_a[1], arm_a[0]])
                v_b = velocity[b, :2] + velocity[b, 2] * np.array([-arm_b[1], arm_b[0]])
                j = reference.collision_impulse(v_a - v_b, normal, arm_a, arm_b, *[1.0] * 4, 0.0, 1.0, 0.0)
                velocity[a] -= [*j, arm_a[0] * j[1] - arm_a[1] * j[0]]
                velocity[b] += [*j, arm_b[0] * j[1] - arm_b[1] * j[0]]
                count += bool(j.any())
        return velocity, count

    expected, count = in_order(order)
    result, counts = reference.resolve_contacts(position, start, UNIT, floor=False)
    assert counts["self"] == count > 5
    assert_allclose(result, expected, rtol=1e-12, atol=1e-12)
    assert np.abs(in_order(sorted(order))[0] - expected).max() > 1e-3


@given(crumpled_chains())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_self_contacts_keep_momenta_and_never_raise_energy(heap):
    """In any heap, self-contacts keep linear and angular momentum, and kinetic energy doesn't rise."""
    n, seed, size = heap
    position, velocity = crumpled_chain(n, seed, PAPER.link_length, size)
    result, _ = reference.resolve_contacts(position, velocity, PAPER, floor=False)
    momentum = reference.linear_momentum(velocity, PAPER)
    assert_allclose(reference.linear_momentum(result, PAPER), momentum, atol=1e-15)
    spin = reference.angular_momentum(position, velocity, PAPER)
    assert_allclose(reference.angular_momentum(position, result, PAPER), spin, atol=1e-17)
    energy = reference.kinetic_energy(velocity, PAPER)
    assert reference.kinetic_energy(result, PAPER) <= energy * (1 + 1e-14)


@given(crumpled_chains())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_floor_and_resting_sprocket_never_raise_energy(heap):
    """In any heap that a floor and a sprocket at rest cut through, kinetic energy doesn't rise."""
    n, seed, size = heap
    position, velocity = crumpled_chain(n, seed, PAPER.link_length, size)
    sprocket = (np.array([0.0, 0.01]), 0.01, 0.0)
    result, counts = reference.resolve_contacts(position, velocity, PAPER, sprocket=sprocket)
    energy = reference.kinetic_energy(velocity, PAPER)
    assert reference.kinetic_energy(result, PAPER) <= energy * (1 + 1e-14)
    if sum(counts.values()) == 0:
        assert_array_equal(result, velocity)


@given(crumpled_chains())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_touching_pairs_are_those_of_all_link_pairs(heap):
    """The joint pairs are those found by going over links and their ends instead of joints."""
    n, seed, size = heap
    position, _ = crumpled_chain(n, seed, PAPER.link_length, size)
    left, right = reference.link_ends(position, PAPER)
    expected = set()
    for a in range(n):
        for b in range(n):
            if min((a - b) % n, (b - a) % n) >= 2:
                for joint_a, end_a in ((a, right[a]), ((a - 1) % n, left[a])):
                    for joint_b, end_b in ((b, right[b]), ((b - 1) % n, left[b])):
                        if np.linalg.norm(end_a - end_b) < 2 * PAPER.circle_radius:
                            expected.add((min(joint_a, joint_b), max(joint_a, joint_b)))
    assert reference.touching_pairs(position, PAPER) == sorted(expected)


# --- the circular loop ---


@pytest.mark.parametrize("n", [4, 6, 60])
def test_closed_loop_has_closed_joints_of_given_speed(n):
    """Joints of the circular loop are closed, stay closed, and move at the given speed, anticlockwise."""
    position, velocity = reference.circular_loop(n, PAPER, 5.0)
    assert_allclose(reference.joint_opening(position, PAPER), 0, atol=1e-15)
    assert_allclose(reference.joint_opening_rate(position, velocity, PAPER), 0, atol=1e-13)
    _, joint = reference.link_ends(position, PAPER)
    spin = velocity[:, 2]
    joint_velocity = velocity[:, :2] + spin[:, None] * [-1, 1] * (joint - position[:, :2])[:, ::-1]
    assert_allclose(np.hypot(*joint_velocity.T), 5.0, rtol=1e-12)
    assert reference.angular_momentum(position, velocity, PAPER) > 0


@pytest.mark.parametrize("n", [4, 6, 60])
def test_tension_supplies_centripetal_force_and_no_torque(n):
    """The closed form of the joint force, radial part included, holds alternating links on their circle exactly."""
    speed = 5.0
    position, velocity = reference.circular_loop(n, PAPER, speed)
    tangential, radial = reference.circular_loop_force(n, PAPER, speed)
    _, joint = reference.link_ends(position, PAPER)
    outwards = joint / np.linalg.norm(joint, axis=1)[:, None]
    along = np.column_stack([-outwards[:, 1], outwards[:, 0]])
    force = tangential * along + radial * np.where(np.arange(n) % 2, -1, 1)[:, None] * outwards
    before = np.roll(force, 1, axis=0)
    mass = reference.link_masses(n, PAPER)[:, None]
    expected = -mass * velocity[:, 2:] ** 2 * position[:, :2]
    assert_allclose(force - before, expected, atol=1e-12 * tangential)
    across = np.column_stack([-np.sin(position[:, 2]), np.cos(position[:, 2])])
    assert_allclose(np.sum(across * (force + before), axis=1), 0, atol=1e-12 * tangential)


def test_tension_to_leading_order():
    """T tends to m̄ v²/ℓ and S/T to zero as n grows, like 1/n² and 1/n."""
    mean = (PAPER.inner_mass + PAPER.outer_mass) / 2 * 25 / PAPER.link_length
    for n in (60, 600):
        tangential, radial = reference.circular_loop_force(n, PAPER, 5.0)
        assert 1 - tangential / mean == pytest.approx((np.pi / n) ** 2 / 2, rel=1e-2)
        assert abs(radial / tangential) == pytest.approx(0.553 / 6.847 * np.pi / n, rel=1e-2)


@pytest.mark.parametrize("n", [4, 6, 60])
def test_stretched_loop_is_an_exact_equilibrium(n):
    """With b = 0 every link of the stretched loop has just its centripetal acceleration; with b > 0 not quite."""
    parameters = PAPER.with_values({"joint_stiffness": 1e5, "joint_damping": 0.0})
    position, velocity = reference.circular_loop(n, parameters, 5.0, stretched=True)
    spin = velocity[0, 2]
    scale = spin**2 * np.linalg.norm(position[0, :2])
    result = reference.acceleration(position, velocity, parameters, gravity=False)
    assert_allclose(result[:, :2], -(spin**2) * position[:, :2], atol=1e-7 * scale)
    torque_scale = reference.circular_loop_force(n, parameters, 5.0)[0] * parameters.link_length
    assert_allclose(result[:, 2] * reference.link_inertias(n, parameters), 0, atol=1e-8 * torque_scale)
    opening = reference.joint_opening(position, parameters)
    assert np.linalg.norm(opening, axis=1).min() > 1e-5
    damped = parameters.with_values({"joint_damping": 1.0})
    loss = spin**2 * np.sum(opening**2)
    assert reference.damping_power(position, velocity, damped) == pytest.approx(loss, rel=1e-9)


def test_springs_open_by_tension_over_stiffness():
    """k C of the stretched loop tends to the rigid joints' force, T along and ±S outwards, like 1/k."""
    n, speed = 12, 5.0
    force = reference.circular_loop_force(n, PAPER, speed)
    errors = []
    for stiffness in (1e5, 1e6):
        parameters = PAPER.with_values({"joint_stiffness": stiffness, "joint_damping": 0.0})
        position, velocity = reference.circular_loop(n, parameters, speed, stretched=True)
        joint = reference.joint_force(position, velocity, parameters)
        middle = (np.arange(n) + 0.5) * 2 * np.pi / n
        along = joint[:, 1] * np.cos(middle) - joint[:, 0] * np.sin(middle)
        outwards = (joint[:, 0] * np.cos(middle) + joint[:, 1] * np.sin(middle)) * np.tile([1, -1], n // 2)
        errors.append([np.ptp(along), np.ptp(outwards), along[0] - force[0], outwards[0] - force[1]])
    assert_allclose(np.array(errors)[:, :2], 0, atol=1e-6)
    assert_allclose(np.array(errors)[0, 2:] / np.array(errors)[1, 2:], 10, rtol=0.05)


def test_stretched_loop_turns_like_a_rigid_body():
    """Integrated for a twentieth of a turn, the stretched loop is where rigid rotation takes it."""
    parameters = PAPER.with_values({"joint_stiffness": 1e5, "joint_damping": 0.0})
    position, velocity = reference.circular_loop(12, parameters, 5.0, stretched=True)
    end = 0.05 * 2 * np.pi / velocity[0, 2]
    positions, _, _ = reference.solve_flight(position, velocity, np.array([0.0, end]), parameters, gravity=False)
    turn = velocity[0, 2] * end
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    assert_allclose(positions[1, :, :2], position[:, :2] @ rotation.T, atol=1e-11)
    assert_allclose(positions[1, :, 2], position[:, 2] + turn, atol=1e-9)


def test_too_fast_a_loop_is_refused():
    """A stretched loop that its springs can't hold is refused."""
    parameters = PAPER.with_values({"joint_stiffness": 10.0, "joint_damping": 0.0})
    with pytest.raises(ValueError, match="can't hold"):
        reference.circular_loop(12, parameters, 5.0, stretched=True)
