"""The turning loop in closed form against the equations of motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from tests.oracle_model.circular_loop import circular_loop, circular_loop_force
from warpchain.inputs.parameters import preset

PAPER = preset("paper")


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
