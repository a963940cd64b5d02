"""What makes a walk inaccurate, although it may have come to rest."""

from typing import Any, Final

from warpchain.walks.energy_error import ENERGY_REMEDY, MOST_ENERGY_ERROR

FAULTS: Final = {
    "energy": ENERGY_REMEDY,
    "opening": "joints opened by more than a link length, so that the chain came apart; lower the masses or "
    "options.tolerance, or raise parameters.joint_stiffness",
    "penetration": "circles sank in by more than their radius, through what they touched; lower options.contact_step",
}
"""Faults of a walk, each with what it means and what to try."""


def faults(energy_error: Any, opening: Any, penetration: Any, link_length: Any, circle_radius: Any) -> dict[str, Any]:
    """Whether walks have each of `FAULTS`: of numbers or arrays, lengths in m. NaN is no fault."""
    return {
        "energy": energy_error > MOST_ENERGY_ERROR,
        "opening": opening > link_length,
        "penetration": penetration > circle_radius,
    }
