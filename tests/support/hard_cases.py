"""The table of hard cases for tests: its subjects by their names, every method, and what makes a flight sound."""

from typing import Any

import numpy as np
import pytest

import warpchain
from warpchain import Parameters, Status, Trajectory
from warpchain.bench.problems.hard_cases import HARD_CASES
from warpchain.bench.problems.hard_starts import energy_error, energy_scale
from warpchain.bench.starts import State
from warpchain.kernels.methods.method import method_names

SUBJECTS = {case.name: case.subject for case in HARD_CASES}
METHODS = method_names()
every_method = pytest.mark.parametrize("method", METHODS)


def quick_with(*quick: str) -> Any:
    """Parametrises a test with every method, marked as slow unless it is one of these."""
    slow = pytest.mark.slow
    return pytest.mark.parametrize("method", [pytest.param(m, marks=() if m in quick else slow) for m in METHODS])


def simulate(parameters: Parameters, state: State, duration: float, **settings: Any) -> Trajectory:
    """`warpchain.simulate` at 1e-6, recording just the end."""
    return warpchain.simulate(parameters, *state, duration, times=[duration], **{"tolerance": 1e-6, **settings})


def assert_sound(flight: Trajectory, parameters: Parameters, state: State, within: float = 1e-5) -> None:
    """Finished, finite, and the ledger closes to a fraction of the energy of motion and springs at the start."""
    assert flight.status == Status.FINISHED, flight.status.sentence
    position, velocity = flight.position[-1], flight.velocity[-1]
    assert np.all(np.isfinite(position)) and np.all(np.isfinite(velocity))
    # a flight on rigid joints is looser than springs
    closes_within = max(within, 1e-4) if flight.losses["joint_switch"] else within
    assert energy_error(flight, parameters, state) < closes_within
    assert abs(flight.losses["joint_switch"]) < 1e-3 * energy_scale(parameters, state)
    losses = [loss for name, loss in flight.losses.items() if name != "joint_switch"]
    assert all(loss > -within * energy_scale(parameters, state) for loss in losses)
