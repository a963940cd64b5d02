"""Small motions about the circulating ring, from the equations of motion differentiated by complex steps.

The ring is the stretched `circular_loop`, without gravity. In the frame that turns along, at Ω, it is an equilibrium
and looks the same at every pair of links, so small motions are ∝ exp(iκj + λt) with κ = 2πn/N and each n is a problem
of its own: two links, six coordinates (radial, tangential, angle), twelve rates. In components along those directions

    Ẍ = A δX + B δẊ,    Ẋ = ξ̇ + Ω ẑ × ξ    give    ξ̈ = (A + Ω B ẑ× + Ω²) ξ + (B − 2Ω ẑ×) ξ̇.

With b > 0 the ring is not quite an equilibrium, see `circular_loop`; the equations are linearised about it as it is.
Joint friction is linearised where joints do not turn: a viscous friction of β + τ_c/ω_c. Without Coulomb friction it
is β.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from tests.oracle_model.circular_loop import circular_loop
from tests.oracle_model.motion_equations import acceleration
from warpchain.inputs.parameters import Parameters

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

STEP: Final = 1e-30
"""Length of a complex step [m, rad, m/s, rad/s]: derivatives are exact to rounding, as its square vanishes."""
BENDING: Final = 4
"""Rates of a mode number that belong to bending; the others belong to the springs of the joints."""
LEAST_RATIO: Final = 3.0
"""Bending and joints count as apart if their rates differ by this factor."""


def ring_modes(n: int, parameters: Parameters, speed: float, numbers: Array) -> Complex:
    """Small motions of the stretched circular loop.

    Args:
        n: number of links N, even, at least 4.
        parameters: the chain.
        speed: of the joints of the closed loop, m/s; anticlockwise if positive, links are numbered anticlockwise.
        numbers: mode numbers, whole wavelengths around the ring, shape (k,).

    Returns:
        rates λ = −γ − iω of bending, 1/s, in the frame that turns with the ring, by rising ω, shape (k, 4).

    Raises:
        ValueError: as `circular_loop`; or bending is as fast as the springs of the joints, which tells neither apart.
    """
    by_place, by_rate = _derivatives(n, parameters, speed)
    spin = float(circular_loop(n, parameters, speed)[1][0, 2])
    turn = np.zeros((6, 6))
    turn[[0, 3], [1, 4]], turn[[1, 4], [0, 3]] = -1.0, 1.0
    square = np.diag([1.0, 1.0, 0.0] * 2) * spin**2
    pairs = np.arange(n // 2)
    rates = []
    for number in numbers:
        wave = np.exp(-4j * np.pi * number * pairs / n)  # the responding pair has the phase 0, the moved one is ahead
        place, rate = (np.tensordot(wave, blocks, axes=1) for blocks in (by_place, by_rate))
        system = np.block(
            [
                [np.zeros((6, 6)), np.eye(6)],
                [place + spin * rate @ turn + square, rate - 2 * spin * turn],
            ]
        )
        found = np.linalg.eigvals(system)
        rates.append(found[np.argsort(np.abs(found))])
    sorted_rates = np.array(rates).reshape(-1, 12)
    bending, joints = sorted_rates[:, :BENDING], sorted_rates[:, BENDING:]
    if np.any(np.abs(joints[:, 0]) < LEAST_RATIO * np.abs(bending[:, -1])):
        raise ValueError("bending is as fast as the springs of the joints; give stiffer joints or less friction")
    order = np.argsort(-bending.imag, axis=1)
    return np.take_along_axis(bending, order, axis=1)


def _derivatives(n: int, parameters: Parameters, speed: float) -> tuple[Array, Array]:
    """Derivatives of the accelerations of each pair with respect to place and velocity of the first pair.

    Returns:
        ∂Ẍ/∂X and ∂Ẍ/∂Ẋ, shape (n/2, 6, 6) each: pair, its coordinate, the first pair's coordinate; along the radial
        and tangential direction at each link.
    """
    position, velocity = circular_loop(n, parameters, speed, stretched=True)
    angle = 2 * np.pi * np.arange(n) / n
    axes = np.zeros((n, 3, 3))  # component, direction
    axes[:, 0, 0], axes[:, 1, 0] = np.cos(angle), np.sin(angle)
    axes[:, 0, 1], axes[:, 1, 1] = -np.sin(angle), np.cos(angle)
    axes[:, 2, 2] = 1.0
    found = np.empty((2, n // 2, 6, 6))
    for column in range(6):
        link, direction = divmod(column, 3)
        for which in range(2):
            place, rate = position.astype(np.complex128), velocity.astype(np.complex128)
            (place, rate)[which][link] += 1j * STEP * axes[link, :, direction]
            changed = acceleration(place, rate, parameters, gravity=False).imag / STEP  # type: ignore[arg-type]
            found[which, :, :, column] = np.einsum("lcd,lc->ld", axes, changed).reshape(n // 2, 6)
    return found[0], found[1]
