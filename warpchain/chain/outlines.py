"""Fits measured joints to a chain of links of one length; `State.of_joints` calls this."""

from typing import Final

import numpy as np

from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError

WIDEST_MISFIT: Final = 0.5
"""Greatest difference of the distance of two given joints from a link length, in link lengths."""


def fitted(joints: Array, rates: Array, length: float) -> tuple[Array, Array]:
    """Joints that are a link length apart, and their rates that keep it so, near given ones; both (n, 2)."""
    n = len(joints)
    apart = np.linalg.norm(joints - np.roll(joints, 1, axis=0), axis=1)
    worst = int(np.abs(apart - length).argmax())
    if abs(apart[worst] - length) > WIDEST_MISFIT * length:
        raise InputError(
            f"joints: the loop is not closed, or lengths are not in m: joints {(worst - 1) % n} and {worst} are "
            f"{apart[worst]:.3g} m apart, and links are {length:g} m long; pass every joint, in order"
        )
    places = joints.copy()
    for _ in range(50):
        span = places - np.roll(places, 1, axis=0)
        misfit = (np.sum(span**2, axis=1) - length**2) / 2
        if np.abs(misfit).max() <= 1e-13 * length**2:
            return places, rates - _pull(span, np.sum(span * (rates - np.roll(rates, 1, axis=0)), axis=1))
        places -= _pull(span, misfit)
    raise InputError(f"joints: found no closed chain of {n} links of {length:g} m near them; measure them again")


def _pull(span: Array, change: Array) -> Array:
    """The least motion of the joints, (n, 2), that changes half the squares of the spans by so much, (n,)."""
    n = len(span)
    rates = np.zeros((n, n, 2))  # of each half square by each joint
    rates[np.arange(n), np.arange(n)] = span
    rates[np.arange(n), np.arange(n) - 1] -= span
    least = np.linalg.lstsq(rates.reshape(n, 2 * n), change)[0]
    return np.asarray(least, dtype=np.float64).reshape(n, 2)
