"""Waves along a chain: limits, the equations of motion linearised about a straight chain and a ring, tapped rings."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import warpchain
from studies.waves import rings, run
from studies.waves.dispersion import (
    LOWER_BACKWARD,
    LOWER_FORWARD,
    long_wave_speed,
    ring_spin,
    ring_waves,
    straight_waves,
)
from studies.waves.rings import fit_rates, from_tap, mode_amplitudes, tapped_ring
from tests.oracle_model.motion_equations import acceleration
from warpchain import Status, preset

PAPER = preset("paper").with_values({"coulomb_friction": 0.0})
SOFT = preset("soft").with_values({"coulomb_friction": 0.0})
TENSION, SPEED = 15.0, 7.5
PHASES = np.array([0.05, 0.3, 0.7, 1.0, 1.3, 1.5, np.pi / 2])


def straight_modes(parameters, tension, phase):
    """Transverse rates of a straight chain (8,): the equations of motion, differentiated by complex steps.

    Six pairs, each joint opened by T/k; the third pair is moved. Neither it nor its neighbours touch the joint that
    closes the chain over its whole length.
    """
    links, opening = 12, tension / parameters.joint_stiffness
    position = np.zeros((links, 3))
    position[:, 0] = (parameters.link_length + opening) * np.arange(links)
    system = np.zeros((8, 8), dtype=complex)
    system[:4, 4:] = np.eye(4)
    for column in range(8):
        state = [position.astype(complex), np.zeros((links, 3), dtype=complex)]
        link, part = divmod(column % 4, 2)
        state[column // 4][4 + link, 1 + part] += 1e-30j
        changed = acceleration(*state, parameters, gravity=False).imag[:, 1:] / 1e-30
        for pair in (1, 2, 3):
            shift = np.exp(-2j * phase * (pair - 2))
            system[4:, column] += shift * changed[2 * pair : 2 * pair + 2].ravel()
    return np.linalg.eigvals(system)


def nearest(wanted, found):
    """The nearest of the rates `found` (k, …) to each of `wanted` (k, p)."""
    apart = np.abs(wanted[:, :, None] - found[:, None, :])
    return np.take_along_axis(found, np.argmin(apart, axis=2), axis=1)


@pytest.mark.parametrize("friction", [0.0, 9e-6, 9e-5, 9e-4])
def test_straight_chain_agrees_with_the_equations_of_motion(friction):
    """All four rates are those of the linearised equations, but for 1e-4 by which k = 1e9 N/m gives way at most."""
    parameters = PAPER.with_values({"viscous_friction": friction})
    waves = straight_waves(parameters, TENSION, PHASES)
    found = np.array([straight_modes(parameters, TENSION, phase) for phase in PHASES])
    assert_allclose(nearest(waves.rate, found), waves.rate, rtol=1e-4)
    assert np.abs(waves.rate.imag).max() > 100


def test_long_waves_run_at_the_speed_of_a_string():
    """κ → 0: phase and group speed tend to √(Tℓ/m̄), damping to βκ⁴/(2m̄ℓ²)."""
    waves = straight_waves(PAPER, TENSION, [1e-2])
    speed = long_wave_speed(PAPER, TENSION)
    assert speed == pytest.approx(np.sqrt(TENSION * 0.01268 / 3.4235e-3), rel=1e-12)
    for found in (waves.phase_speed, waves.group_speed):
        assert found[0, LOWER_FORWARD] * PAPER.link_length == pytest.approx(speed, rel=1e-4)
        assert found[0, LOWER_BACKWARD] * PAPER.link_length == pytest.approx(-speed, rel=1e-4)
    expected = PAPER.viscous_friction * 1e-8 / (2 * 3.4235e-3 * PAPER.link_length**2)
    assert waves.damping[0, LOWER_FORWARD] == pytest.approx(expected, rel=1e-4)
    assert waves.reach[0, LOWER_FORWARD] == pytest.approx(speed / PAPER.link_length / expected, rel=1e-3)


def ring_modes(n, parameters, speed, numbers):
    """Rates of bending (k, 4) of a ring [1/s] in the frame that turns along, where it looks the same at every pair.

    Small motions are ∝ exp(iκj + λt), κ = 2π·number/n: two links, six coordinates (radial, tangential, angle). With the
    equations Ẍ = A δX + B δẊ differentiated by complex steps, and Ẋ = ξ̇ + Ω ẑ × ξ, ξ̈ = (A + Ω B ẑ× + Ω²) ξ +
    (B − 2Ω ẑ×) ξ̇. Bending is the slower third of the rates, springs of joints the others.
    """
    position, velocity = tapped_ring(n, parameters, speed, np.zeros(n))
    spin, (cosine, sine) = velocity[0, 2], position[:, :2].T / np.hypot(*position[:, :2].T)
    axes = np.zeros((n, 3, 3))  # component, direction
    axes[:, :2, :2] = np.moveaxis(np.array([[cosine, -sine], [sine, cosine]]), -1, 0)
    axes[:, 2, 2] = 1.0
    derivatives = np.empty((2, n // 2, 6, 6))
    for which, column in np.ndindex(2, 6):
        link, direction = divmod(column, 3)
        state = [position.astype(complex), velocity.astype(complex)]
        state[which][link] += 1e-30j * axes[link, :, direction]
        changed = acceleration(*state, parameters, gravity=False).imag / 1e-30
        derivatives[which, :, :, column] = np.einsum("lcd,lc->ld", axes, changed).reshape(n // 2, 6)
    turn, square, rates = np.zeros((6, 6)), np.diag([1.0, 1.0, 0.0] * 2) * spin**2, []
    turn[[0, 3], [1, 4]], turn[[1, 4], [0, 3]] = -1.0, 1.0
    for number in numbers:
        wave = np.exp(-4j * np.pi * number * np.arange(n // 2) / n)
        place, rate = (np.tensordot(wave, blocks, axes=1) for blocks in derivatives)
        lower = [place + spin * rate @ turn + square, rate - 2 * spin * turn]
        found = np.linalg.eigvals(np.block([[np.zeros((6, 6)), np.eye(6)], lower]))
        rates.append(found[np.argsort(np.abs(found))][:4])
    return np.array(rates)


@pytest.mark.parametrize("links", [8, 12, 60])
@pytest.mark.parametrize("friction", [0.0, 9e-5])
def test_ring_agrees_with_the_equations_of_motion(links, friction):
    """The exact ring has the bending modes of the linearised NumPy model, but for what k = 1e9 N/m stretches."""
    parameters = PAPER.with_values({"viscous_friction": friction})
    numbers = np.arange(2, links // 4 + 1)
    waves, modes = ring_waves(parameters, links, SPEED, numbers), ring_modes(links, parameters, SPEED, numbers)
    assert_allclose(nearest(waves.rate, modes), waves.rate, rtol=2e-5)
    assert_allclose(nearest(modes, waves.rate), modes, rtol=2e-5)


def tapped(links, spins, times, parameters=SOFT):
    """Angles of a ring's links (t, n) [rad] after a tap, less those of the ring that turns on."""
    position, velocity = tapped_ring(links, parameters, SPEED, spins)
    motion = warpchain.simulate(
        parameters,
        position + np.array([0.0, 1.0, 0.0]),  # above the floor
        velocity,
        float(times[-1]),
        times=times,
        gravity=False,
        tolerance=1e-8,
    )
    assert motion.status == Status.FINISHED
    turned = ring_spin(parameters, links, SPEED) * times[:, None]
    angles: np.ndarray = motion.position[:, :, 2] - position[:, 2] - turned
    return angles


def test_modes_of_a_tapped_ring():
    """Slow and fast modes of 60 links ring at the rates of theory: frequencies to 0.1 %, damping to 1 %."""
    links, interval, numbers = 60, 8e-4, np.arange(2, 13)
    place = from_tap(links)
    angles = tapped(links, 0.1 * place * np.exp(-(place**2) / 4.5), interval * np.arange(100))
    wanted = ring_waves(SOFT, links, SPEED, numbers).rate[:, [LOWER_BACKWARD, LOWER_FORWARD]]
    found = []
    for number, rates in zip(numbers, wanted, strict=True):
        instants = min(100, int(-6 / rates[0].real / interval))  # before it has died
        found.append(fit_rates(mode_amplitudes(angles, number)[:instants], interval, 4))
    measured = nearest(wanted, np.array(found))
    assert_allclose(measured.imag, wanted.imag, rtol=1e-3)
    assert_allclose(measured.real, wanted.real, rtol=1e-2)


def test_the_page_has_the_reach_of_waves():
    """The table is what the theory gives."""
    assert rings.reach_table() in run.FOLDER.joinpath("README.md").read_text(encoding="utf-8")
