"""Waves in a recorded motion: modes of a ring, the decaying oscillations that they are made of, and packets."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def mode_amplitudes(angles: Array, number: int) -> Complex:
    """Fourier components of links' angles [rad], shape (t, n), of inner and outer links apart.

    Returns:
        2/n Σ ϑ_j exp(−2πi · number · j/n) over even and over odd j [rad], shape (t, 2).
    """
    links = angles.shape[1]
    wave = 2 / links * np.exp(-2j * np.pi * number * np.arange(links) / links)
    return np.stack([angles[:, part::2] @ wave[part::2] for part in (0, 1)], axis=1)


def fit_rates(signals: Complex, interval: float, count: int) -> Complex:
    """Rates λ of the sum of `count` exponentials Σ a exp(λt) that signals, shape (t, s), have in common.

    ESPRIT (Roy and Kailath, IEEE Trans. ASSP 37 (1989) 984): stretches of the signals span a space that is the same one
    sample later but for the factors exp(λ · interval), which are the eigenvalues of the map between both.

    Returns:
        λ [1/s], by falling imaginary part, shape (count,).

    Raises:
        ValueError: there are too few instants.
    """
    instants = len(signals)
    stretch = 2 * instants // 3
    if instants < 3 * count:
        raise ValueError(f"{instants} instants do not tell {count} exponentials apart; give at least {3 * count}")
    rows = np.concatenate(
        [np.lib.stride_tricks.sliding_window_view(column, stretch) for column in signals.T]
    )  # (s × starts, stretch)
    space = np.linalg.svd(rows, full_matrices=False)[2][:count].T
    shift = np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0]
    rates = np.log(np.linalg.eigvals(shift).astype(np.complex128)) / interval
    return np.asarray(rates[np.argsort(-rates.imag)])


@dataclass(frozen=True, eq=False, kw_only=True)
class Packet:
    """A packet of waves at one instant.

    Attributes:
        place: centre of its squared envelope [links].
        amplitude: root of the sum of its squared envelope [rad].
        shares: of the modes 0, 1, … in the sum of its squared spectrum, shape (n/2,).
    """

    place: float
    amplitude: float
    shares: Array

    def mean(self, values: Array) -> float:
        """The mean of values of the modes from 2 on, as many as are given, by their shares."""
        shares = self.shares[2 : 2 + len(values)]
        return float(shares @ values / shares.sum())


def find_packet(angles: Array, link: float, width: float) -> Packet:
    """The packet of a ring's angles (n,) at most `width` links from the place `link`, on an endless count of links.

    The envelope is that of the waves with n > 0 in exp(2πinj/N), twice their absolute value.
    """
    links = len(angles)
    spectrum = np.fft.fft(angles)
    spectrum[0] = 0.0
    spectrum[links // 2 :] = 0.0
    offset = (np.arange(links) - link + links / 2) % links - links / 2
    signal = np.where(np.abs(offset) <= width, 2 * np.fft.ifft(spectrum), 0.0)
    energy = np.abs(signal) ** 2
    total = float(energy.sum())
    shares = np.abs(np.fft.fft(signal))[: links // 2] ** 2
    return Packet(place=link + float(energy @ offset) / total, amplitude=total**0.5, shares=shares / shares.sum())
