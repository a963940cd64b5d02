"""Waves along a chain: the straight one under tension and the ring that circulates without gravity.

Joints are closed and friction is viscous. Small changes of the links' angles ϑ_j ∝ exp(iκj + λt) have the phase κ per
link and the rate λ = −γ − iω: ω > 0 runs towards greater j. README.md derives what is solved here: A(λ) B(λ) = h² λ⁴
with h = δ − ¼ μℓ², and A, B of the straight chain and of the ring, two bands in 0 < κ ≤ π/2.

Coulomb friction is left out: it is not linear. Joints that keep their sense of rotation, because the loop bends there,
do not feel it in small waves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.polynomial.polynomial import polyroots
from numpy.typing import ArrayLike

from studies.common import Array
from warpchain import Parameters

Factors = Callable[[Array, float], tuple[Array, Array, Array]]

UPPER_BACKWARD, LOWER_BACKWARD, LOWER_FORWARD, UPPER_FORWARD = range(4)
"""Columns of `Waves.rate`: bands and directions. In the ring backward is the slow family, forward the fast one."""
FRICTION_STEPS = 64  # Friction rises from nothing in so many steps, while the branches are followed
PHASE_STEP = 1e-5  # Step of a central difference with respect to the phase [rad]
ROUNDING = 1e-12  # Damping below this part of a rate is rounding


@dataclass(frozen=True, eq=False)
class Waves:
    """Free waves of k phases, four each; columns are `UPPER_BACKWARD` … `UPPER_FORWARD`."""

    phase: Array  # κ [rad], (k,)
    rate: Array  # λ = −γ − iω [1/s] in the chain's frame, (k, 4), as all below
    frequency: Array  # ω [rad/s]; 0 if friction lets a wave creep back without swinging
    damping: Array  # γ, at which an amplitude falls [1/s]
    phase_speed: Array  # ω/κ, the speed of crests [links/s]
    group_speed: Array  # dω/dκ, the speed of packets [links/s]
    reach: Array  # How far a packet runs until its amplitude is 1/e [links]; infinite if its damping is rounding


def straight_waves(parameters: Parameters, tension: float, phase: ArrayLike) -> Waves:
    """Transverse waves of a straight chain under the tension T [N], at phases κ per link in (0, π/2], shape (k,)."""

    def factors(phases: Array, friction: float) -> tuple[Array, Array, Array]:
        squares = np.sin(phases / 2) ** 2, np.cos(phases / 2) ** 2
        first, second = (
            np.stack([tension * parameters.link_length * s, 4 * friction * s**2, inertia * s + quarter * c], axis=-1)
            for s, c in (squares, squares[::-1])
        )
        return first, second, squares[0] * squares[1]

    mass, inertia, *_ = _links(parameters)
    quarter = mass * parameters.link_length**2 / 4
    return _waves(parameters, np.asarray(phase, dtype=np.float64), factors)


def ring_waves(parameters: Parameters, links: int, speed: float, number: ArrayLike) -> Waves:
    """Bending modes of a circulating ring without gravity, exact for rigid links and closed joints.

    Its N links, N even, move at `speed` [m/s]; `number` has whole wavelengths around it, from 2 to N/4, shape (k,).
    Rates are those in the frame that turns with the ring, at the phases 2πn/N.
    """
    mass, inertia, *_ = _links(parameters)
    eighth, alpha, spin = mass * parameters.link_length**2 / 8, np.pi / links, ring_spin(parameters, links, speed)

    def factors(phases: Array, friction: float) -> tuple[Array, Array, Array]:
        forward, backward = phases / 2 + alpha, phases / 2 - alpha
        found, weights = [], []
        for bend, shift in ((np.sin(phases / 2) ** 2, 0.0), (np.cos(phases / 2) ** 2, np.pi / 2)):
            here, there = forward + shift, backward + shift
            weight = (np.sin(here) * np.sin(there)) ** 2
            ahead, behind = (np.cos(here) * np.sin(there)) ** 2, (np.sin(here) * np.cos(there)) ** 2
            both = eighth * (ahead + behind)
            stiffness = spin**2 * (2 * eighth / np.tan(alpha) ** 2 * weight - both)
            turning = 4 * friction * bend * weight + 2j * spin * eighth * (ahead - behind)
            found.append(np.stack([stiffness, turning, inertia * weight + both], axis=-1))
            weights.append(weight)
        return found[0], found[1], weights[0] * weights[1]

    return _waves(parameters, 2 * alpha * np.asarray(number), factors)


def long_wave_speed(parameters: Parameters, tension: float) -> float:
    """c = √(Tℓ/m̄), the speed of long waves along the chain under the tension T [N], in m/s."""
    return float(np.sqrt(tension * parameters.link_length / _links(parameters)[0]))


def ring_spin(parameters: Parameters, links: int, speed: float) -> float:
    """Ω = 2 v sin(π/N)/ℓ, at which a ring turns whose joints move at `speed` [m/s], in rad/s."""
    return float(2 * speed * np.sin(np.pi / links) / parameters.link_length)


def _links(p: Parameters) -> tuple[float, float, float, float]:
    """m̄ and Ī, means of mass and moment of inertia, and half of what inner links have more than outer ones, μ and δ."""
    pairs = (p.inner_mass, p.outer_mass), (p.inner_inertia, p.outer_inertia)
    return *((inner + outer) / 2 for inner, outer in pairs), *((inner - outer) / 2 for inner, outer in pairs)


def _waves(parameters: Parameters, phases: Array, factors: Factors) -> Waves:
    """Solve A B = h² λ⁴ at each phase, and follow its roots from zero friction to the chain's.

    `factors` maps phases (k,) and friction to the coefficients of A and B, (k, 3) from λ⁰ on, each times any weight,
    and to the product of the weights, (k,).
    """
    *_, mass, inertia = _links(parameters)
    coupling = inertia - mass * parameters.link_length**2 / 4

    def quartic(phases: Array, friction: float) -> Array:
        first, second, weight = factors(phases, friction)
        product = np.zeros((len(phases), 5), dtype=np.complex128)
        for power in range(3):
            product[:, power : power + 3] += first[:, power, None] * second
        product[:, 4] -= coupling**2 * weight
        return product

    rates, orders = _by_frequency(_roots(quartic(phases, 0.0))), np.array(list(permutations(range(4))))
    for friction in parameters.viscous_friction * np.linspace(0.0, 1.0, FRICTION_STEPS + 1)[1:]:
        found = _roots(quartic(phases, friction))
        nearest = np.abs(found[:, orders] - rates[:, None, :]).sum(axis=2).argmin(axis=1)
        rates = np.take_along_axis(found, orders[nearest], axis=1)
    ahead, behind = (quartic(phases + step, friction) for step in (PHASE_STEP, -PHASE_STEP))
    powers = rates[:, :, None] ** np.arange(5)
    by_phase = np.einsum("kp,krp->kr", (ahead - behind) / (2 * PHASE_STEP), powers)
    by_rate = np.einsum("kp,krp->kr", quartic(phases, friction)[:, 1:] * np.arange(1, 5), powers[:, :, :4])
    frequency, damping = -rates.imag, -rates.real
    with np.errstate(divide="ignore", invalid="ignore"):  # where two roots meet there is no slope
        speed = (by_phase / by_rate).imag
        reach = np.where(damping > ROUNDING * np.abs(rates), np.abs(speed) / damping, np.inf)
    return Waves(phases, rates, frequency, damping, frequency / phases[:, None], speed, reach)


def _by_frequency(rates: Array) -> Array:
    """Rates of each row, by falling imaginary part."""
    return np.take_along_axis(rates, np.argsort(-rates.imag, axis=-1), axis=-1)


def _roots(coefficients: Array) -> Array:
    """Roots of polynomials, (k, p) for coefficients (k, p + 1) from the constant on."""
    return np.array([polyroots(row) for row in coefficients])
