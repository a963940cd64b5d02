"""How well the balances of force and moment close on a mean loop.

With the line density ρ, the speed v and j = (Ī − m̄ ℓ²/6)/ℓ they are (T_e t + N n)' = ρ g ŷ and M' + N = j v² κ'.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from studies.stationary_loop.theory import MeanLoop

Array = NDArray[np.float64]

EDGE: Final = 4.0
"""Links at either end of the free part that balances leave out: averages there include links on the sprocket."""


@dataclass(frozen=True)
class Imbalance:
    """The error of a balance relative to its greatest term: root mean square and greatest value."""

    rms: float
    greatest: float


def imbalances(loop: MeanLoop) -> dict[str, Imbalance]:
    """The errors of the balances of the mean loop on its free part, `EDGE` links at its ends left out.

    Returns:
        `force`: (T_e t + N n)(s), less its value at the lowest point and the weight in between, ρ g ŷ s.
        `normal`: N' + T_e κ − ρ g cos φ.
        `moment`: M' + N − j v² κ'.
        `friction`: M − f(ℓ v κ'), where f is the moment of joints that turn like the mean curve.
    """
    p, edge = loop.parameters, EDGE * loop.parameters.link_length
    inside = (loop.s > loop.free[0] + edge) & (loop.s < loop.free[1] - edge)
    step = loop.length / len(loop.s)
    tangent = np.stack([-np.cos(loop.angle), np.sin(loop.angle)], axis=1)
    normal = np.stack([np.sin(loop.angle), np.cos(loop.angle)], axis=1)
    force = loop.effective_tension[:, None] * tangent + loop.shear[:, None] * normal
    bottom = np.array([np.interp(0.0, loop.s, force[:, axis]) for axis in (0, 1)])
    weight = np.stack([np.zeros_like(loop.s), p.density * p.gravity * loop.s], axis=1)
    shear_slope, moment_slope = (periodic_slope(values, len(values)) / step for values in (loop.shear, loop.moment))
    bend, across = loop.effective_tension * loop.curvature, p.density * p.gravity * np.cos(loop.angle)
    turned = p.inertia * loop.speed**2 * loop.bending
    expected = p.moment(p.link_length * loop.speed * loop.bending)
    terms = {
        "force": (np.hypot(*(force - bottom - weight).T), [np.hypot(*force.T)]),
        "normal": (shear_slope + bend - across, [shear_slope, bend, across]),
        "moment": (moment_slope + loop.shear - turned, [moment_slope, loop.shear, turned]),
        "friction": (loop.moment - expected, [loop.moment]),
    }
    found = {}
    for name, (rest, parts) in terms.items():
        scale = max(float(np.max(np.abs(part[inside]))) for part in parts)
        share = np.abs(rest[inside]) / scale
        found[name] = Imbalance(rms=float(np.sqrt(np.mean(share**2))), greatest=float(share.max()))
    return found


def periodic_slope(values: Array, period: float) -> Array:
    """Derivative of a periodic function from even samples of one period, shape (g,) or (g, c)."""
    waves = 2j * np.pi * np.fft.rfftfreq(len(values), period / len(values))
    if len(values) % 2 == 0:
        waves[-1] = 0.0
    spectrum = np.fft.rfft(values, axis=0) * waves.reshape(-1, *[1] * (values.ndim - 1))
    return np.fft.irfft(spectrum, len(values), axis=0)
