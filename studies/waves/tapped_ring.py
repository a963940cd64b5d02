"""A ring of links that turns like a rigid body, tapped: the state from which `warpchain.simulate` moves it on."""

import numpy as np
from numpy.typing import NDArray

from warpchain import Parameters

Array = NDArray[np.float64]


def tapped_ring(links: int, parameters: Parameters, speed: float, spins: Array) -> tuple[Array, Array]:
    """A turning ring whose springs are in equilibrium, with further angular velocities of its links by a tap.

    With α = π/n the ring turns at Ω = speed · 2 sin α/ℓ. All links are tangential, inner ones at the distance ρ₁ from
    the centre and outer ones at ρ₂; the springs supply the centripetal forces (without damping b) if

        (m₁Ω²/k − 2) ρ₁ + 2 cos 2α ρ₂ = −ℓ sin 2α,    2 cos 2α ρ₁ + (m₂Ω²/k − 2) ρ₂ = −ℓ sin 2α.

    The tap opens no joint: velocities of joints are sums of those across the links, less their mean. That closes the
    ring only if the spins have no part ∝ exp(±2πij/n), so this part, which moves the ring without bending it, is left
    out.

    Args:
        links: n, even, at least 4.
        parameters: of the chain.
        speed: of the joints of the closed ring before the tap [m/s]; anticlockwise if positive.
        spins: further angular velocities [rad/s], (n,).

    Returns:
        position (n, 3) and velocity (n, 3): x, y [m], θ [rad] and their rates.
    """
    alpha, length = np.pi / links, parameters.link_length
    spin, coupling = speed * 2 * np.sin(alpha) / length, 2 * np.cos(2 * alpha)
    inner, outer = (m * spin**2 / parameters.joint_stiffness for m in (parameters.inner_mass, parameters.outer_mass))
    balance = np.array([[inner - 2, coupling], [coupling, outer - 2]])
    distance = np.tile(np.linalg.solve(balance, np.full(2, -length * np.sin(2 * alpha))), links // 2)
    angle = 2 * np.pi * np.arange(links) / links
    outwards, ahead = (np.stack([np.cos(each), np.sin(each)], axis=1) for each in (angle, angle + np.pi / 2))
    first = np.exp(1j * angle)
    kept = spins - 2 / links * np.real(np.sum(spins * first.conj()) * first)
    turning = -length * kept[:, None] * outwards  # velocity of a link's end relative to its beginning
    joints = np.cumsum(turning, axis=0)
    joints -= joints.mean(axis=0)
    position = np.column_stack([distance[:, None] * outwards, angle + np.pi / 2])
    across = spin * distance[:, None] * ahead + joints - turning / 2
    return position, np.column_stack([across, spin + kept])
