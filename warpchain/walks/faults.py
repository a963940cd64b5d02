"""What makes a walk inaccurate, although it may have come to rest."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_ENERGY_ERROR: Final = 0.05
"""Greatest energy error of a walk that nothing warns of."""
ENERGY_REMEDY: Final = (
    f"more than {100 * MOST_ENERGY_ERROR:g} % of the energy at release is unaccounted for; lower options.tolerance"
)
FAULTS: Final = {
    "energy": ENERGY_REMEDY,
    "opening": "joints opened by more than a link length, so that the chain came apart; lower the masses or "
    "options.tolerance, or raise parameters.joint_stiffness",
    "penetration": "circles sank in by more than the least radius, through what they touched; "
    "lower options.contact_step",
}
"""Faults of a walk, each with what it means and what to try."""


def energy_error(at_release: ArrayLike, residual: ArrayLike) -> NDArray[np.float64]:
    """Size of the energy unaccounted for [J], relative to kinetic and potential energy at release; NaN before it."""
    energy = np.asarray(at_release, np.float64)
    return np.abs(residual) / np.where(energy > 0, energy, np.nan)


LENGTHS: Final = ("link_length", "circle_radius", "link_radii", "charm_radius")
"""Quantities against which openings and penetrations are held."""


def least(value: Any) -> float:
    """The least of a number or of several; ∞ for None."""
    return float(np.min(np.inf if value is None else value))


def faults(energy_error: Any, opening: Any, penetration: Any, lengths: Mapping[str, Any]) -> dict[str, Any]:
    """Whether walks have each of `FAULTS`: of numbers or arrays; NaN is no fault.

    Given are the greatest opening of a joint and penetration of a circle [m], and the `least` of each of `LENGTHS` [m].
    """
    link_length, circle_radius, link_radii, charm_radius = (lengths[name] for name in LENGTHS)
    radius = np.minimum(charm_radius, np.where(np.isinf(link_radii), circle_radius, link_radii))
    return {
        "energy": energy_error > MOST_ENERGY_ERROR,
        "opening": opening > link_length,
        "penetration": penetration > radius,
    }
