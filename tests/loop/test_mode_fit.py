"""Amplitudes, rates and packets of made motions that are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from warpchain.loop.mode_fit import find_packet, fit_rates, mode_amplitudes


def test_amplitude_of_a_made_mode():
    """A travelling wave of inner links alone has its amplitude in the first column, and other numbers have none."""
    links, number = 24, 3
    place, time = np.arange(links), np.linspace(0, 1, 5)[:, None]
    angles = 0.2 * np.cos(2 * np.pi * number * place / links - 4 * time) * (place % 2 == 0)
    assert_allclose(mode_amplitudes(angles, number), np.stack([0.1 * np.exp(-4j * time[:, 0]), 0 * time[:, 0]], axis=1))
    assert_allclose(mode_amplitudes(angles, 4), 0, atol=1e-15)


def test_rates_of_made_signals():
    """Three decaying oscillations in two noisy signals are found."""
    rates = np.array([-3 + 200j, -20 + 150j, -8 - 170j])
    times = 1e-3 * np.arange(120)
    mixing = np.array([[1.0, 0.3j], [0.5, 1.0], [0.2, -0.4]])
    noise = 1e-6 * np.random.default_rng(1).normal(size=(120, 2))
    found = fit_rates(np.exp(times[:, None] * rates) @ mixing + noise, 1e-3, 3)
    assert_allclose(found, rates[[0, 1, 2]], rtol=1e-5)


def test_too_few_instants_are_refused():
    """Eleven instants do not tell four exponentials apart."""
    with pytest.raises(ValueError, match="give at least 12"):
        fit_rates(np.ones((11, 1), dtype=complex), 1e-3, 4)


@pytest.mark.parametrize("link", [30.25, 58.5, 118.5])
def test_place_of_a_made_packet(link):
    """A Gaussian packet is where it was put, also across the end of the count; its spectrum is around its number."""
    links, number = 60, 8
    offset = (np.arange(links) - link + links / 2) % links - links / 2
    angles = 0.3 * np.cos(2 * np.pi * number * offset / links) * np.exp(-(offset**2) / 50)
    packet = find_packet(angles, link + 1.5, 25.0)
    assert packet.place == pytest.approx(link, abs=1e-3)
    assert packet.amplitude == pytest.approx(0.3 * (np.pi * 25) ** 0.25, rel=1e-6)
    assert packet.mean(np.arange(2.0, 20.0)) == pytest.approx(number, abs=0.01)
