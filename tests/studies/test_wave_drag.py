"""The drag on waves leaves what is no wave: momenta, the run along the path, stationary loops."""

import numpy as np
import pytest
from numpy.typing import NDArray

import warpchain
from studies.waves.wave_drag import RUNNING, drag_waves, inertia_of, loop_motions, wave_motion
from tests.support.arrays import Array
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.inputs.parameters import preset

LINKS, SPEED = 60, 5.0
CHAIN = preset("soft")
LENGTH = np.array([CHAIN.link_length])
INERTIA = inertia_of(LINKS, CHAIN)


def loop(aspect: float = 1.0) -> tuple[Array, Array]:
    """An ellipse that runs along itself, as one of one loop."""
    position, velocity = lay_chain(ellipse(aspect), LINKS, CHAIN.link_length, SPEED)
    return position[None], velocity[None]


def dragged(
    position: Array, velocity: Array, share: float = 0.3, least_mode: float = 0.0
) -> tuple[Array, Array, Array]:
    """What `drag_waves` gives for one loop."""
    return drag_waves(position, velocity, INERTIA[None], LENGTH, np.array([share]), np.array([least_mode]))


def momenta(position: Array, velocity: Array) -> Array:
    """Momentum x, y and angular momentum about the origin."""
    mass, spin = INERTIA[:, 0], INERTIA[:, 2]
    x, y, _ = position[0].T
    u, v, omega = velocity[0].T
    return np.array([mass @ u, mass @ v, mass @ (x * v - y * u) + spin @ omega])


def test_a_circle_that_runs_along_itself_has_no_waves() -> None:
    """Nothing is taken, and the run along the path is that of the links."""
    position, velocity = loop()
    after, energy, speed = dragged(position, velocity)
    assert np.allclose(after, velocity, atol=1e-9)
    assert energy[0] < 1e-20
    assert abs(speed[0]) == pytest.approx(SPEED, rel=2e-3)  # links are chords of the circle


@pytest.mark.parametrize("least_mode", [0.0, 5.0])
def test_momenta_and_the_run_along_the_path_stay_and_energy_falls(least_mode: float) -> None:
    """Of a loop far from the origin with random velocities on top."""
    position, velocity = loop(2.0)
    position += np.array([0.3, 0.2, 0.0])
    velocity += np.random.default_rng(1).normal(size=velocity.shape) * [0.5, 0.5, 10.0] + [1.0, -2.0, 0.0]
    after, energy, speed = dragged(position, velocity, least_mode=least_mode)
    assert np.allclose(momenta(position, after), momenta(position, velocity), rtol=0, atol=1e-12)
    again = dragged(position, after)
    assert again[2][0] == pytest.approx(speed[0], rel=5e-3)
    assert again[1][0] < energy[0]
    assert not np.allclose(after, velocity)


@pytest.mark.parametrize(("mode", "least_mode", "left"), [(6, 0.0, 0.7), (6, 6.0, 0.7), (6, 6.5, 1.0), (12, 7.0, 0.7)])
def test_a_wave_of_one_length_loses_its_share(mode: int, least_mode: float, left: float) -> None:
    """And nothing if it is longer than those that are dragged."""
    position, velocity = loop()
    motions, normal = loop_motions(position, LENGTH)
    wave = np.cos(2 * np.pi * mode * np.arange(LINKS) / LINKS)
    velocity[..., :2] += 0.1 * wave[:, None] * normal[0]
    after, _, _ = dragged(position, velocity, least_mode=least_mode)
    rest = wave_motion(motions[:, RUNNING], after, INERTIA[None])[1]
    across = np.einsum("nc,nc->n", rest[0, :, :2], normal[0])
    # links of two masses: a wave is not quite a wave of one length
    assert 2 / LINKS * across @ wave == pytest.approx(0.1 * left, rel=0.01)


def exponents(amplitude: NDArray[np.complex128], step: float) -> NDArray[np.complex128]:
    """Complex rates [1/s] of the two exponentials that make up a signal (Prony's method)."""
    rows = np.stack([amplitude[:-2], amplitude[1:-1]], axis=1)
    recursion = np.linalg.lstsq(rows, -amplitude[2:], rcond=None)[0]
    return np.asarray(np.log(np.roots([1.0, recursion[1], recursion[0]])) / step)


@pytest.mark.parametrize("rate", [0.0, 40.0])
def test_the_fast_wave_dies_at_the_rate_of_the_drag_and_the_slow_one_hardly_changes(rate: float) -> None:
    """Both waves of one length on a simulated ring without friction, followed in the frame of its links."""
    parameters = CHAIN.with_values({"viscous_friction": 0.0, "coulomb_friction": 0.0})
    mode, step, unseen = 8, 5e-4, 10
    position, velocity = loop()
    _, normal = loop_motions(position, LENGTH)
    wave = 0.02 * np.cos(2 * np.pi * mode * np.arange(LINKS) / LINKS)
    velocity[..., :2] += wave[:, None] * normal[0]
    velocity[..., 2] += (np.roll(wave, -1) - np.roll(wave, 1)) / (2 * LENGTH[0])
    amplitude = []
    for _ in range(80):
        velocity, _, _ = dragged(position, velocity, 1 - np.exp(-rate * step))
        end = warpchain.simulate(
            parameters, position[0], velocity[0], step, times=[step], floor=False, gravity=False, method="dp5"
        )
        position, velocity = end.position[-1][None], end.velocity[-1][None]
        amplitude.append(np.fft.fft(np.hypot(*position[0, :, :2].T))[mode])
    found = exponents(np.array(amplitude[unseen:]), step)
    # links move towards higher numbers; a phase that grows belongs to crests that move against them
    fast, slow = sorted(found, key=lambda found: float(found.imag))
    assert fast.imag < 0 < slow.imag
    assert -fast.real == pytest.approx(rate, abs=0.05 * 40.0)
    assert -slow.real == pytest.approx(0.0, abs=0.1 * 40.0)
