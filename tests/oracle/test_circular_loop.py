"""The turning loop in closed form against the equations of motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from tests.oracle_model.circular_loop import circular_loop, circular_loop_force
from warpchain.inputs.parameters import preset

PAPER = preset("paper")


@pytest.mark.parametrize("n", [4, 6, 60])
def test_closed_loop_has_closed_joints_of_given_speed(n):
    """Joints of the circular loop are closed, stay closed, and move at the given speed, anticlockwise."""
    position, velocity = circular_loop(n, PAPER, 5.0)
    assert_allclose(motion_equations.joint_opening(position, PAPER), 0, atol=1e-15)
    assert_allclose(motion_equations.joint_opening_rate(position, velocity, PAPER), 0, atol=1e-13)
    _, joint = motion_equations.link_ends(position, PAPER)
    spin = velocity[:, 2]
    joint_velocity = velocity[:, :2] + spin[:, None] * [-1, 1] * (joint - position[:, :2])[:, ::-1]
    assert_allclose(np.hypot(*joint_velocity.T), 5.0, rtol=1e-12)
    assert motion_equations.angular_momentum(position, velocity, PAPER) > 0


@pytest.mark.parametrize("n", [4, 6, 60])
def test_tension_supplies_centripetal_force_and_no_torque(n):
    """The closed form of the joint force, radial part included, holds alternating links on their circle exactly."""
    speed = 5.0
    position, velocity = circular_loop(n, PAPER, speed)
    tangential, radial = circular_loop_force(n, PAPER, speed)
    _, joint = motion_equations.link_ends(position, PAPER)
    outwards = joint / np.linalg.norm(joint, axis=1)[:, None]
    along = np.column_stack([-outwards[:, 1], outwards[:, 0]])
    force = tangential * along + radial * np.where(np.arange(n) % 2, -1, 1)[:, None] * outwards
    before = np.roll(force, 1, axis=0)
    mass = motion_equations.link_masses(n, PAPER)[:, None]
    expected = -mass * velocity[:, 2:] ** 2 * position[:, :2]
    assert_allclose(force - before, expected, atol=1e-12 * tangential)
    across = np.column_stack([-np.sin(position[:, 2]), np.cos(position[:, 2])])
    assert_allclose(np.sum(across * (force + before), axis=1), 0, atol=1e-12 * tangential)


def test_tension_to_leading_order():
    """T tends to m̄ v²/ℓ and S/T to zero as n grows, like 1/n² and 1/n."""
    mean = (PAPER.inner_mass + PAPER.outer_mass) / 2 * 25 / PAPER.link_length
    for n in (60, 600):
        tangential, radial = circular_loop_force(n, PAPER, 5.0)
        assert 1 - tangential / mean == pytest.approx((np.pi / n) ** 2 / 2, rel=1e-2)
        assert abs(radial / tangential) == pytest.approx(0.553 / 6.847 * np.pi / n, rel=1e-2)


@pytest.mark.parametrize("n", [4, 6, 60])
def test_stretched_loop_is_an_exact_equilibrium(n):
    """With b = 0 every link of the stretched loop has just its centripetal acceleration; with b > 0 not quite."""
    parameters = PAPER.with_values({"joint_stiffness": 1e5, "joint_damping": 0.0})
    position, velocity = circular_loop(n, parameters, 5.0, stretched=True)
    spin = velocity[0, 2]
    scale = spin**2 * np.linalg.norm(position[0, :2])
    result = motion_equations.acceleration(position, velocity, parameters, gravity=False)
    assert_allclose(result[:, :2], -(spin**2) * position[:, :2], atol=1e-7 * scale)
    torque_scale = circular_loop_force(n, parameters, 5.0)[0] * parameters.link_length
    assert_allclose(result[:, 2] * motion_equations.link_inertias(n, parameters), 0, atol=1e-8 * torque_scale)
    opening = motion_equations.joint_opening(position, parameters)
    assert np.linalg.norm(opening, axis=1).min() > 1e-5
    damped = parameters.with_values({"joint_damping": 1.0})
    loss = spin**2 * np.sum(opening**2)
    assert motion_equations.damping_power(position, velocity, damped) == pytest.approx(loss, rel=1e-9)


def test_springs_open_by_tension_over_stiffness():
    """k C of the stretched loop tends to the rigid joints' force, T along and ±S outwards, like 1/k."""
    n, speed = 12, 5.0
    force = circular_loop_force(n, PAPER, speed)
    errors = []
    for stiffness in (1e5, 1e6):
        parameters = PAPER.with_values({"joint_stiffness": stiffness, "joint_damping": 0.0})
        position, velocity = circular_loop(n, parameters, speed, stretched=True)
        joint = motion_equations.joint_force(position, velocity, parameters)
        middle = (np.arange(n) + 0.5) * 2 * np.pi / n
        along = joint[:, 1] * np.cos(middle) - joint[:, 0] * np.sin(middle)
        outwards = (joint[:, 0] * np.cos(middle) + joint[:, 1] * np.sin(middle)) * np.tile([1, -1], n // 2)
        errors.append([np.ptp(along), np.ptp(outwards), along[0] - force[0], outwards[0] - force[1]])
    assert_allclose(np.array(errors)[:, :2], 0, atol=1e-6)
    assert_allclose(np.array(errors)[0, 2:] / np.array(errors)[1, 2:], 10, rtol=0.05)


def test_stretched_loop_turns_like_a_rigid_body():
    """Integrated for a twentieth of a turn, the stretched loop is where rigid rotation takes it."""
    parameters = PAPER.with_values({"joint_stiffness": 1e5, "joint_damping": 0.0})
    position, velocity = circular_loop(12, parameters, 5.0, stretched=True)
    end = 0.05 * 2 * np.pi / velocity[0, 2]
    positions, _, _ = motion_equations.solve_flight(position, velocity, np.array([0.0, end]), parameters, gravity=False)
    turn = velocity[0, 2] * end
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    assert_allclose(positions[1, :, :2], position[:, :2] @ rotation.T, atol=1e-11)
    assert_allclose(positions[1, :, 2], position[:, 2] + turn, atol=1e-9)


def test_too_fast_a_loop_is_refused():
    """A stretched loop that its springs can't hold is refused."""
    parameters = PAPER.with_values({"joint_stiffness": 10.0, "joint_damping": 0.0})
    with pytest.raises(ValueError, match="can't hold"):
        circular_loop(12, parameters, 5.0, stretched=True)
