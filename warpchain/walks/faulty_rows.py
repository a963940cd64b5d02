"""Which walks of a sweep are inaccurate, by their columns."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.tallies import CONTACTS
from warpchain.walks.faults import FAULTS, faults
from warpchain.walks.rows import drawn_column

LENGTHS: Final = ("link_length", "circle_radius")
"""Against which openings and penetrations are held."""


def faults_of_columns(
    columns: Mapping[str, NDArray[Any]], lengths: Mapping[str, NDArray[Any]]
) -> dict[str, NDArray[np.bool_]]:
    """Whether each walk has each of `warpchain.walks.faults.FAULTS`.

    Args:
        columns: of a sweep, by name.
        lengths: `LENGTHS` [m] before anything was drawn, along the axes of the columns.
    """
    own = dict(lengths)
    for name in own:
        if (column := drawn_column(name)) in columns:  # NaN in rows of blocks that do not draw it
            own[name] = np.where(np.isnan(columns[column]), own[name], columns[column])
    deepest = np.max([columns[f"penetration_{kind}"] for kind in CONTACTS], axis=0)
    return faults(columns["energy_error"], columns["greatest_opening"], deepest, **own)


def fault_remedies(blocks: Iterable[Mapping[str, NDArray[np.bool_]]]) -> dict[str, int]:
    """What inaccurate walks mean and what to try → number of walks of all blocks; only what there is.

    Args:
        blocks: as of `faults_of_columns`, for each block.
    """
    found = list(blocks)
    counts = {remedy: sum(int(block[name].sum()) for block in found) for name, remedy in FAULTS.items()}
    return {remedy: count for remedy, count in counts.items() if count}
