"""The NumPy model of a tilting plane against Newton and Euler in the room, invariants and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations, tilting_plane
from tests.oracle_model.tilting_plane import Plane, axes, tilted_plane
from tests.support.mild_parameters import MILD
from tests.support.presets import PAPER
from tests.support.tilted_chains import tumbling_loop

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


@pytest.mark.parametrize("seed", SEEDS)
def test_axes_and_places_move_as_the_rates_say(seed):
    """Each plane axis changes in the room by Ω × e; the centres' velocities are the derivatives of their places."""
    position, velocity, plane = tumbling_loop(6, MILD, seed)
    turning = axes(plane) @ [*plane.turn, 0.0]
    change = rate(lambda x, v, moved: axes(moved), position, velocity, plane, MILD, half_width=WIDE)
    assert_allclose(change.T, np.cross(turning, axes(plane).T), atol=1e-13)
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
