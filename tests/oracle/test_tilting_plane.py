"""The NumPy model of a tilting plane against Newton and Euler in the room, invariants and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.oracle_model import motion_equations, tilting_plane
from tests.oracle_model.circular_loop import circular_loop
from tests.oracle_model.tilting_plane import Plane, axes, tilted_plane
from tests.support.impulse_cases import UNIT
from tests.support.mild_parameters import MILD, SILENT
from tests.support.tilted_chains import mirrored, tumbling_loop
from warpchain.inputs.parameters import preset

PAPER = preset("paper")
WIDE = 0.02
"""Half width with which S is as large as the links' moments of inertia, m."""
SEEDS = range(8)


def rate(function, position, velocity, plane: Plane, parameters, *, half_width: float):
    """Time derivative of `function(position, velocity, plane)` by a complex step along the equations of motion."""
    step = 1e-40j
    links, rates = tilting_plane.tilting_acceleration(position, velocity, plane, parameters, half_width=half_width)
    x_rate, y_rate, origin_rate = tilting_plane.frame_rates(plane)
    ahead = Plane(
        plane.speed + step * rates[0],
        plane.turn + step * rates[1:],
        plane.x + step * x_rate,
        plane.y + step * y_rate,
        plane.origin + step * origin_rate,
    )
    return np.imag(function(position + step * velocity, velocity + step * links, ahead)) / step.imag


def joint_loads(position, velocity, parameters):
    """Force (n, 2) and torque (n,) of all joints on each link within the plane, by the planar model."""
    n = len(position)
    planar = motion_equations.acceleration(position, velocity, parameters, gravity=False)
    force = planar[:, :2] * motion_equations.link_masses(n, parameters)[:, None]
    return force, planar[:, 2] * motion_equations.link_inertias(n, parameters)


# --- the plane in the room ---


def test_axes_by_hand():
    """Tilt lowers e2 towards −Ẑ, yaw turns e1 anticlockwise seen from above, and both are read back."""
    assert_array_equal(axes(tilted_plane()), np.eye(3))
    # At π/2 of yaw e1 points to −Ẑ; a tilt of 30° before it has leaned e2 from Ŷ to what was −Ẑ, which is now −X̂.
    expected = np.array([[0, -0.5, np.sqrt(0.75)], [0, np.sqrt(0.75), 0.5], [-1, 0, 0]])
    assert_allclose(axes(tilted_plane(np.pi / 6, np.pi / 2)), expected, atol=1e-15)
    for tilt, yaw in ((0.3, -2.0), (-1.2, 3.0), (0.0, 0.5)):
        plane = tilted_plane(tilt, yaw)
        assert_allclose(axes(plane) @ axes(plane).T, np.eye(3), atol=1e-15)
        assert_allclose(np.linalg.det(axes(plane)), 1)
        assert_allclose([tilting_plane.tilt_of(plane), tilting_plane.yaw_of(plane)], [tilt, yaw], rtol=1e-14)
    plane = tilted_plane(0.3, turn=(2.0, 0.0))
    assert_allclose(tilting_plane.frame_rates(plane)[1][2] / np.cos(0.3), -2.0, rtol=1e-14)


@pytest.mark.parametrize("seed", SEEDS)
def test_axes_turn_with_the_angular_velocity(seed):
    """Each plane axis changes in the room by Ω × e, and the origin moves along e3."""
    position, velocity, plane = tumbling_loop(6, MILD, seed)
    turning = axes(plane) @ [*plane.turn, 0.0]
    change = rate(lambda x, v, moved: axes(moved), position, velocity, plane, MILD, half_width=WIDE)
    assert_allclose(change.T, np.cross(turning, axes(plane).T), atol=1e-13)
    drift = rate(lambda x, v, moved: moved.origin, position, velocity, plane, MILD, half_width=WIDE)
    assert_allclose(drift, plane.speed * axes(plane)[:, 2], atol=1e-14)


@pytest.mark.parametrize("seed", SEEDS)
def test_velocity_is_derivative_of_place(seed):
    """The centres' velocities in the room are the derivatives of their places."""
    position, velocity, plane = tumbling_loop(6, MILD, seed)
    change = rate(
        lambda x, v, moved: tilting_plane.room_position(x, moved), position, velocity, plane, MILD, half_width=WIDE
    )
    assert_allclose(tilting_plane.room_velocity(position, velocity, plane), change, rtol=1e-12, atol=1e-12)


def test_floor_gap_is_height_of_lowest_rim_point():
    """No point of the rollers' rims is lower, and some point is as low, in any attitude."""
    angle = np.linspace(0, 2 * np.pi, 20000)
    circle = PAPER.circle_radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for seed, tilt in enumerate((0.0, 0.5, -0.5, 1.5, np.pi / 2, -np.pi / 2)):
        position, _, plane = tumbling_loop(6, PAPER, seed)
        plane = replace(tilted_plane(tilt, 1.0), origin=plane.origin)
        ends = np.concatenate(motion_equations.link_ends(position, PAPER))
        rims = [np.column_stack([end + circle, np.full(len(circle), side * 4e-3)]) for end in ends for side in (-1, 1)]
        lowest = plane.origin[1] + (np.concatenate(rims) @ plane.y).min()
        assert tilting_plane.floor_gap(position, plane, PAPER, half_width=4e-3) == pytest.approx(lowest, abs=1e-9)


# --- equations of motion ---


@pytest.mark.parametrize("seed", SEEDS)
def test_links_obey_newton_and_euler_in_the_room(seed):
    """Each link's momentum within the plane, and its own spin along e3, change by joints and weight only."""
    position, velocity, plane = tumbling_loop(6, MILD, seed)
    force, torque = joint_loads(position, velocity, MILD)
    mass = motion_equations.link_masses(6, MILD)[:, None]
    slope = rate(tilting_plane.room_velocity, position, velocity, plane, MILD, half_width=WIDE)
    expected = force - mass * MILD.gravity * plane.y[:2]
    assert_allclose((mass * slope @ axes(plane))[:, :2], expected, atol=1e-12 * np.abs(force).max())

    def own(x, v, moved):
        return tilting_plane.link_turning(x, v, moved, MILD, half_width=WIDE)[1]

    change = rate(own, position, velocity, plane, MILD, half_width=WIDE) @ axes(plane)[:, 2]
    assert_allclose(change, torque, atol=1e-12 * np.abs(torque).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_chain_obeys_newton_and_euler_in_the_room(seed):
    """Momentum changes by the weight, angular momentum by the weight's torque and the dampers' b C × Ċ."""
    position, velocity, plane = tumbling_loop(6, MILD, seed)

    def momentum(x, v, moved):
        return tilting_plane.room_momentum(x, v, moved, MILD)

    def angular_momentum(x, v, moved):
        return tilting_plane.room_angular_momentum(x, v, moved, MILD, half_width=WIDE)

    mass = motion_equations.link_masses(6, MILD)
    weight = mass[:, None] * [0.0, -MILD.gravity, 0.0]
    largest = np.abs(joint_loads(position, velocity, MILD)[0]).max()
    slope = rate(momentum, position, velocity, plane, MILD, half_width=WIDE)
    assert_allclose(slope, weight.sum(axis=0), atol=1e-13 * largest)
    opening = motion_equations.joint_opening(position, MILD)
    opening_rate = motion_equations.joint_opening_rate(position, velocity, MILD)
    dampers = -MILD.joint_damping * motion_equations.cross(opening, opening_rate).sum()
    expected = np.cross(tilting_plane.room_position(position, plane), weight).sum(axis=0) + dampers * axes(plane)[:, 2]
    slope = rate(angular_momentum, position, velocity, plane, MILD, half_width=WIDE)
    assert_allclose(slope, expected, atol=1e-13 * largest)


def test_link_turns_as_a_rod_of_a_width():
    """By hand: moments S along the rod, I + S across it and I about the normal, in a plane of any attitude."""
    # h = √3: S = 1 · 12/12 = 1, I = 1. Link 0 lies along e1, link 1 along e2.
    position, velocity = np.zeros((4, 3)), np.zeros((4, 3))
    position[1, 2], velocity[:, 2] = np.pi / 2, 7.0
    plane = tilted_plane(0.4, 0.8, turn=(3.0, 5.0))
    spin, own = tilting_plane.link_turning(position, velocity, plane, UNIT, half_width=np.sqrt(3.0))
    assert_allclose(spin[:2] @ axes(plane), [[3, 5, 7], [3, 5, 7]], rtol=1e-14)
    assert_allclose(own[:2] @ axes(plane), [[3, 10, 7], [6, 5, 7]], rtol=1e-14)


@pytest.mark.parametrize("seed", SEEDS)
def test_mass_matrix_carries_the_energy_of_rigid_bodies(seed):
    """The rigid bodies' energy in the room is the planar model's and ½ νᵀ A ν, without a mixed term."""
    position, velocity, plane = tumbling_loop(6, PAPER, seed)
    matrix = tilting_plane.plane_mass_matrix(position, PAPER, half_width=WIDE)
    assert_allclose(matrix, matrix.T)
    expected = motion_equations.kinetic_energy(velocity, PAPER) + plane.rates @ matrix @ plane.rates / 2
    energy = tilting_plane.tilting_kinetic_energy(position, velocity, plane, PAPER, half_width=WIDE)
    assert energy == pytest.approx(expected, rel=1e-13)
    potential = PAPER.gravity * sum(
        motion_equations.link_masses(6, PAPER)
        * (plane.origin[1] + position[:, 0] * plane.y[0] + position[:, 1] * plane.y[1])
    )
    expected += potential + motion_equations.spring_energy(position, PAPER)
    total = tilting_plane.tilting_energy(position, velocity, plane, PAPER, half_width=WIDE)
    assert total == pytest.approx(expected, rel=1e-13)
    weightless = tilting_plane.tilting_energy(position, velocity, plane, PAPER, half_width=WIDE, gravity=False)
    assert total - weightless == pytest.approx(potential, rel=1e-9)


def test_upright_plane_is_the_planar_model():
    """A plane that is upright and doesn't turn, whatever its heading and drift, has the planar accelerations."""
    position, velocity, _ = tumbling_loop(8, PAPER, 1)
    for plane in (tilted_plane(), tilted_plane(0.0, 0.7, speed=0.3, origin=(1.0, 2.0, 3.0))):
        for gravity in (True, False):
            links, rates = tilting_plane.tilting_acceleration(
                position, velocity, plane, PAPER, half_width=4e-3, gravity=gravity
            )
            assert_array_equal(links, motion_equations.acceleration(position, velocity, PAPER, gravity=gravity))
            assert_array_equal(rates, 0)


def test_mirror_image_has_mirrored_accelerations():
    """The mirrored plane's speeds change by the opposite, its links alike."""
    position, velocity, plane = tumbling_loop(8, MILD, 3)
    links, rates = tilting_plane.tilting_acceleration(position, velocity, plane, MILD, half_width=WIDE)
    image = tilting_plane.tilting_acceleration(position, velocity, mirrored(plane), MILD, half_width=WIDE)
    assert_array_equal(image[0], links)
    assert_array_equal(image[1], -rates)


def test_standing_loop_tips_over_like_a_pendulum():
    """A loop at rest whose foot is held at the origin falls at g M R sin τ over its moment about the foot."""
    n, half_width, tilt = 12, 4e-3, 1e-3
    position, _ = circular_loop(n, PAPER, 0.0)
    radius = np.hypot(*position[0, :2])
    position[:, 1] += 0.08
    mass, inertia = motion_equations.link_masses(n, PAPER), motion_equations.link_inertias(n, PAPER)
    # About a diameter of the ring: half of m R², half of the links' own I; their width 2h adds m (2h)²/12.
    moment = (mass * radius**2 + inertia).sum() / 2 + mass.sum() * (0.08**2 + (2 * half_width) ** 2 / 12)
    matrix = tilting_plane.plane_mass_matrix(position, PAPER, half_width=half_width)
    force = tilting_plane.plane_force(position, np.zeros((n, 3)), tilted_plane(tilt), PAPER)
    turning = np.linalg.solve(matrix[1:, 1:], force[1:])  # u̇ = 0: the foot stays
    # τ̇ = −ω1.
    assert_allclose(-turning, [PAPER.gravity * mass.sum() * 0.08 * np.sin(tilt) / moment, 0], rtol=1e-12, atol=1e-15)


# --- flight ---


@pytest.mark.parametrize("gravity", [False, True])
def test_flight_keeps_energy_and_momenta(gravity):
    """Energy, momentum and all of angular momentum are kept, but for what the weight adds to momenta."""
    position, velocity, plane = tumbling_loop(8, SILENT, 5)
    times = np.array([0.0, 2e-3, 5e-3])
    positions, velocities, planes, evaluations = tilting_plane.solve_tilting_flight(
        position, velocity, plane, times, SILENT, half_width=WIDE, gravity=gravity
    )
    assert evaluations > 100
    assert_array_equal(positions[0], position)
    mass = motion_equations.link_masses(8, SILENT)
    weight = np.array([0, -SILENT.gravity * mass.sum() * gravity, 0])
    centre = mass @ tilting_plane.room_position(position, plane) / mass.sum()
    energy = tilting_plane.tilting_energy(position, velocity, plane, SILENT, half_width=WIDE, gravity=gravity)
    momentum = tilting_plane.room_momentum(position, velocity, plane, SILENT)
    spin = tilting_plane.room_angular_momentum(position, velocity, plane, SILENT, half_width=WIDE)
    assert np.abs(axes(planes[-1]) - axes(plane)).max() > 0.1
    for time, x, v, moved in zip(times, positions, velocities, planes, strict=True):
        assert_allclose(axes(moved) @ axes(moved).T, np.eye(3), atol=1e-15)
        after = tilting_plane.tilting_energy(x, v, moved, SILENT, half_width=WIDE, gravity=gravity)
        assert_allclose(after, energy, rtol=1e-10)
        expected = momentum + weight * time
        size = np.linalg.norm(momentum)
        assert_allclose(tilting_plane.room_momentum(x, v, moved, SILENT), expected, atol=1e-10 * size)
        path = centre + momentum / mass.sum() * time + weight / mass.sum() * time**2 / 2
        assert_allclose(mass @ tilting_plane.room_position(x, moved) / mass.sum(), path, atol=1e-10)
        # ∫ X_cm × weight: the part of the centre's path along the weight adds nothing.
        expected = spin + np.cross(centre * time + momentum / mass.sum() * time**2 / 2, weight)
        after = tilting_plane.room_angular_momentum(x, v, moved, SILENT, half_width=WIDE)
        assert_allclose(after, expected, atol=1e-10 * np.linalg.norm(spin))


def test_joint_friction_keeps_momenta():
    """Joint friction takes energy, but neither momentum nor any part of angular momentum."""
    parameters = MILD.with_values({"joint_damping": 0.0})
    position, velocity, plane = tumbling_loop(6, parameters, 2)
    ends = tilting_plane.solve_tilting_flight(
        position, velocity, plane, np.array([0.0, 3e-3]), parameters, half_width=WIDE, gravity=False
    )
    x, v, moved = (end[-1] for end in ends[:3])
    before, after = (
        tilting_plane.tilting_energy(*state, parameters, half_width=WIDE, gravity=False)
        for state in ((position, velocity, plane), (x, v, moved))
    )
    assert after < 0.9999 * before
    momentum = tilting_plane.room_momentum(position, velocity, plane, parameters)
    assert_allclose(tilting_plane.room_momentum(x, v, moved, parameters), momentum, atol=1e-10 * max(abs(momentum)))
    spin = tilting_plane.room_angular_momentum(position, velocity, plane, parameters, half_width=WIDE)
    after = tilting_plane.room_angular_momentum(x, v, moved, parameters, half_width=WIDE)
    assert_allclose(after, spin, atol=1e-10 * max(abs(spin)))


def test_circulating_ring_precesses_like_a_rigid_top():
    """A circulating loop's normal circles its angular momentum L at the rate |L|/I_t of a symmetric top."""
    n, half_width, turn = 8, 4e-3, np.array([0.3, -0.2])
    position, velocity = circular_loop(n, SILENT, 5.0, stretched=True)
    plane = tilted_plane(0.3, 0.5, turn=turn)
    mass, inertia = motion_equations.link_masses(n, SILENT), motion_equations.link_inertias(n, SILENT)
    polar = mass @ np.sum(position[:, :2] ** 2, axis=1) + inertia.sum()
    across = polar / 2 + mass.sum() * (2 * half_width) ** 2 / 12
    total = axes(plane) @ [*(across * turn), polar * velocity[0, 2]]
    rate_of_top = np.linalg.norm(total) / across
    axis = total / np.linalg.norm(total)
    normal = axes(plane)[:, 2]
    times = np.linspace(0.0, 2 * np.pi / rate_of_top, 4)
    _, _, planes, _ = tilting_plane.solve_tilting_flight(
        position, velocity, plane, times, SILENT, half_width=half_width, gravity=False
    )
    along = (axis @ normal) * axis
    circle = np.linalg.norm(normal - along)
    for time, moved in zip(times, planes, strict=True):
        angle = rate_of_top * time
        expected = along + np.cos(angle) * (normal - along) + np.sin(angle) * np.cross(axis, normal)
        # The loop is no rigid body: it bends with (ω/θ̇)², here 1e-6.
        assert_allclose(axes(moved)[:, 2], expected, atol=1e-5 * circle)


def test_mirror_image_flies_mirrored():
    """The mirrored start gives the mirrored flight."""
    position, velocity, plane = tumbling_loop(6, MILD, 4)
    times = np.array([0.0, 1e-3])
    flights = [
        tilting_plane.solve_tilting_flight(position, velocity, start, times, MILD, half_width=WIDE)
        for start in (plane, mirrored(plane))
    ]
    assert_allclose(flights[1][0], flights[0][0], rtol=1e-12, atol=1e-14)
    there, image = mirrored(flights[0][2][-1]), flights[1][2][-1]
    for name in ("speed", "turn", "x", "y", "origin"):
        assert_allclose(getattr(image, name), getattr(there, name), rtol=1e-11, atol=1e-13)
