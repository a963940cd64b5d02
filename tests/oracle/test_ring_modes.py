"""The circulating ring of the NumPy model, linearised: rigid motions, small flights, joint friction and joints."""

import numpy as np

from tests.oracle_model import motion_equations
from tests.oracle_model.circular_loop import circular_loop, tapped_loop
from tests.oracle_model.ring_modes import ring_modes
from tests.support.mild_parameters import SILENT
from warpchain.inputs.parameters import preset

PAPER = preset("paper").with_values({"coulomb_friction": 0.0})
SPEED = 5.0


def test_rates_are_those_of_a_small_flight():
    """A tapped ring flown by SciPy: its mode is a sum of the twelve rates, not of rates 1 % greater."""
    links, number = 12, 2
    wave = 2 * np.pi * number * np.arange(links) / links
    start, spinning = tapped_loop(links, SILENT, SPEED, 1e-2 * np.cos(wave))
    times = 5e-4 * np.arange(60)
    motion, _, _ = motion_equations.solve_flight(start, spinning, times, SILENT, gravity=False, rtol=1e-9, atol=1e-11)
    angles = motion[:, :, 2] - start[:, 2] - circular_loop(links, SILENT, SPEED)[1][0, 2] * times[:, None]
    amplitude = angles @ np.exp(-1j * wave)
    modes = ring_modes(links, SILENT, SPEED, np.array([number]))
    rates = np.concatenate([modes.bending[0], modes.joints[0]])
    left = []
    for factor in (1.0, 1.01):
        basis = np.exp(times[:, None] * factor * rates)
        fitted = np.linalg.lstsq(basis, amplitude, rcond=None)[0]
        left.append(np.abs(basis @ fitted - amplitude).max() / np.abs(amplitude).max())
    assert left[0] < 1e-5
    assert left[1] > 1e-2
