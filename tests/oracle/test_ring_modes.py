"""The circulating ring of the NumPy model, linearised: rigid motions, small flights, joint friction and joints."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from tests.oracle_model.circular_loop import circular_loop, tapped_loop
from tests.oracle_model.ring_modes import ring_modes
from tests.support.mild_parameters import SILENT
from warpchain.inputs.parameters import preset

PAPER = preset("paper").with_values({"coulomb_friction": 0.0})
SPEED = 5.0


def test_a_ring_that_moves_or_turns_is_no_wave():
    """n = ±1: translations have the rate ±iΩ in the turning frame, twice; n = 0: the angle and the spin stay."""
    modes = ring_modes(12, SILENT, SPEED, np.array([-1, 0, 1]))
    spin = circular_loop(12, SILENT, SPEED)[1][0, 2]
    for row, expected in ((0, -1j * spin), (2, 1j * spin)):
        apart = np.sort(np.abs(modes.bending[row] - expected))
        assert_allclose(apart[:2], 0, atol=1e-2 * spin)  # a double root: the square root of rounding
        assert apart[2] > spin
    apart = np.sort(np.abs(modes.bending[1]))
    assert_allclose(apart[:2], 0, atol=1e-2 * spin)
    assert apart[2] > spin


def test_modes_of_opposite_numbers_are_conjugates():
    """The equations are real, so −n has the conjugate rates of n; N/2 more is the same mode of pairs."""
    modes = ring_modes(12, PAPER, SPEED, np.array([3, -3, 9]))
    for rates in (modes.bending, modes.joints):
        for row, wanted in ((1, rates[0].conj()), (2, rates[0])):
            apart = np.abs(wanted[:, None] - rates[row])
            assert np.all(apart.min(axis=1) < 1e-7 * np.abs(wanted))


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


def test_coulomb_friction_counts_as_viscous_where_joints_do_not_turn():
    """τ_c/ω_c adds to β: the rates are those of a chain with that much viscous friction."""
    sticking = PAPER.with_values({"coulomb_friction": 1.1e-4, "friction_smoothing": 10.0})
    viscous = PAPER.with_values({"viscous_friction": 9e-5 + 1.1e-5})
    numbers = np.array([2, 3, 5])
    first, second = (ring_modes(20, parameters, SPEED, numbers) for parameters in (sticking, viscous))
    assert_allclose(first.bending, second.bending, rtol=1e-9)
    assert np.abs(first.bending - ring_modes(20, PAPER, SPEED, numbers).bending).max() > 1.0


def test_joints_are_those_of_their_springs():
    """The fastest modes of the joints have the scale √(k (1/m + …)), whatever the ring does."""
    slow, fast = (ring_modes(20, SILENT, speed, np.array([4])).joints for speed in (0.5, 1.0))
    assert_allclose(np.abs(slow), np.abs(fast), rtol=1e-2)
    softer = SILENT.with_values({"joint_stiffness": SILENT.joint_stiffness / 4})
    assert_allclose(np.abs(ring_modes(20, softer, 0.5, np.array([4])).joints), np.abs(slow) / 2, rtol=1e-2)


def test_bending_as_fast_as_the_joints_is_refused():
    """Sticking joints of the paper's ω_c creep back faster than their springs swing."""
    with pytest.raises(ValueError, match=r"give stiffer joints or less friction$"):
        ring_modes(20, preset("paper"), SPEED, np.array([2]))


def test_a_tap_opens_no_joint():
    """Whatever the spins, the tapped ring's joints stay as they are, and it has no further momentum of equal links."""
    parameters = SILENT.with_values({"outer_mass": SILENT.inner_mass})
    spins = np.random.default_rng(3).normal(size=20)
    position, velocity = tapped_loop(20, parameters, SPEED, spins)
    still, before = circular_loop(20, parameters, SPEED, stretched=True)
    assert_allclose(position, still)
    rates = motion_equations.joint_opening_rate(position, velocity - before, parameters)
    assert_allclose(rates, 0, atol=1e-12)
    assert_allclose(motion_equations.linear_momentum(velocity, parameters), 0, atol=1e-12)
    assert np.abs(velocity - before)[:, 2].max() > 1.0
