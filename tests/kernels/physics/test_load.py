"""Another force on links: said in one file, it acts in every stage and stands in the energies."""

import json
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from tests.support.tied_chain import DRAG, DURATION, LINKS, POINT, SOFT, STIFFNESS, start


def pull(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Accelerations by the spring on link 1 and the drag on link 4, (n, 3)."""
    force = np.zeros_like(position)
    arm = SOFT.link_length / 2 * motion_equations.direction(position[1, 2])
    force[1, :2] = STIFFNESS * (POINT - position[1, :2] - arm)
    force[1, 2] = motion_equations.cross(arm, force[1, :2])
    force[4] = -DRAG * velocity[4] * [1, 1, 1e-4]
    mass, inertia = motion_equations.link_masses(LINKS, SOFT), motion_equations.link_inertias(LINKS, SOFT)
    return force / np.column_stack([mass, mass, inertia])


@pytest.mark.parametrize(
    ("method", "device"), [("dp5", "cpu"), ("os32", "fibers"), pytest.param("hybrid", "cpu", marks=pytest.mark.slow)]
)
def test_a_force_in_one_file_acts_in_every_stage(method: str, device: str) -> None:
    """A chain tied to a point, one link of which is slowed, is where DOP853 at 1e-12 has it, and has that energy."""
    command = [sys.executable, "-m", "tests.support.tied_chain", method, device]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    position, velocity, energy = map(np.array, json.loads(done.stdout.splitlines()[-1]))

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        x, v = state.reshape(2, LINKS, 3)
        return np.concatenate([v, motion_equations.acceleration(x, v, SOFT) + pull(x, v)]).ravel()

    end = motion_equations.integrated(rates, np.stack(start()).ravel(), DURATION, 1e-12, 1e-12)
    places, speeds = end.reshape(2, LINKS, 3)
    assert_allclose(position, places, atol=2e-8 * np.abs(places).max())
    assert_allclose(velocity, speeds, atol=2e-8 * np.abs(speeds).max())
    arm = SOFT.link_length / 2 * motion_equations.direction(position[1, 2])
    stretch = POINT - position[1, :2] - arm
    expected = motion_equations.gravitational_energy(position, SOFT) + STIFFNESS / 2 * (stretch @ stretch)
    assert energy == pytest.approx(expected, rel=1e-13)
    free = motion_equations.solve_flight(*start(), DURATION, SOFT)[0]
    assert np.abs(places - free).max() > 1e-4
