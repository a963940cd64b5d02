"""Which walks of a sweep are inaccurate, by their rows."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.tallies import CONTACTS
from warpchain.walks.faults import FAULTS, faults
from warpchain.walks.rows import Rows, drawn_column


def faults_of_columns(
    columns: Mapping[str, NDArray[Any]], lengths: Mapping[str, NDArray[Any]]
) -> dict[str, NDArray[np.bool_]]:
    """Whether each walk has each of `warpchain.walks.faults.FAULTS`.

    Args:
        columns: of a sweep, by name.
        lengths: `link_length` and `circle_radius` [m] of each walk before anything is drawn.
    """
    own = dict(lengths)
    for name in own:
        if (column := drawn_column(name)) in columns:  # NaN in rows of blocks that do not draw it
            own[name] = np.where(np.isnan(columns[column]), own[name], columns[column])
    deepest = np.max([columns[f"penetration_{kind}"] for kind in CONTACTS], axis=0)
    return faults(columns["energy_error"], columns["greatest_opening"], deepest, **own)


def faults_of_rows(rows: Rows, lengths: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[np.bool_]]:
    """The same of rows, of which some may be missing; `lengths` of all walks of the sweep."""
    columns = {name: rows[name] for name in rows.dtype.names or ()}
    return faults_of_columns(columns, {name: values[rows["index"]] for name, values in lengths.items()})


def fault_remedies(blocks: Iterable[Mapping[str, NDArray[np.bool_]]]) -> dict[str, int]:
    """What inaccurate walks mean and what to try → number of walks of all blocks; only what there is.

    Args:
        blocks: as of `faults_of_columns`, for each block.
    """
    found = list(blocks)
    counts = {remedy: sum(int(block[name].sum()) for block in found) for name, remedy in FAULTS.items()}
    return {remedy: count for remedy, count in counts.items() if count}
