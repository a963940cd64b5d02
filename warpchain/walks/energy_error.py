"""How much of a walk's energy is unaccounted for, and when that is too much."""

import math
from collections.abc import Mapping
from typing import Final

ENERGY_ERROR: Final = "size of the energy unaccounted for, |residual|, relative to kinetic and potential at release"
MOST_ENERGY_ERROR: Final = 0.05
"""Greatest energy error of a walk that nothing warns of."""
ENERGY_REMEDY: Final = (
    f"more than {100 * MOST_ENERGY_ERROR:g} % of the energy at release is unaccounted for; lower options.tolerance"
)


def energy_error(energy: Mapping[str, float]) -> float:
    """Size of the energy unaccounted for, relative to the energy at release, kinetic and potential; NaN before it.

    Args:
        energy: the ledger [J], with the keys `warpchain.walks.walk_result.ENERGIES`.
    """
    at_release = energy["kinetic_at_release"] + energy["potential_at_release"]
    return abs(energy["residual"]) / at_release if at_release > 0 else math.nan
