"""Rows of a sweep: what one walk leaves, as a NumPy structure.

Unit and meaning of a column are those of the field of `WalkResult` that it comes from.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.distributions import DRAWABLE
from warpchain.inputs.setup import SECTION_OF, SECTIONS
from warpchain.inputs.validation import field_unit
from warpchain.walks.walk_result import CONTACTS, ENERGIES, LOST, STORED

Rows = NDArray[np.void]

MISSING: Final = -1
"""Status of a walk that has not been computed yet; no code of `Status` is negative."""


@dataclass(frozen=True)
class Column:
    """A column of the rows.

    Attributes:
        kind: its type in NumPy's notation.
        unit: SI unit, "1" for pure numbers.
        meaning: one line saying what the numbers are.
    """

    kind: str
    unit: str
    meaning: str


def _of_walk(kind: str, name: str, meaning: str = "") -> Column:
    """The column of a field of `WalkResult`; a meaning stands for one key of a dictionary."""
    stored = STORED[name]
    return Column(kind, stored.unit, f"{stored.meaning}: {meaning}" if meaning else stored.meaning)


COLUMNS: Final[dict[str, Column]] = {
    "index": Column("<i8", "1", "number of the walk in its sweep"),
    "status": Column("<i1", "1", f"code of what ended the walk; {MISSING} while it is missing"),
    "dx": _of_walk("<f8", "dx"),
    "walk_time": _of_walk("<f8", "walk_time"),
    "simulated_time": _of_walk("<f8", "simulated_time"),
    "hold_time": _of_walk("<f8", "hold_time"),
    "drift": _of_walk("<f8", "drift"),
    "softened_at": _of_walk("<f8", "softened_at"),
    "bounces": _of_walk("<i4", "bounces"),
    "steps_accepted": _of_walk("<i8", "steps_accepted"),
    "steps_rejected": _of_walk("<i8", "steps_rejected"),
    **{f"impulses_{key}": _of_walk("<i8", "impulses", meaning) for key, meaning in CONTACTS.items()},
    "greatest_opening": _of_walk("<f8", "greatest_opening"),
    **{f"penetration_{key}": _of_walk("<f8", "greatest_penetration", meaning) for key, meaning in CONTACTS.items()},
    "energy_at_release": Column("<f8", "J", "energy at release, kinetic and potential"),
    **{f"loss_{key}": Column("<f8", "J", ENERGIES[key]) for key in LOST},
    "energy_residual": Column("<f8", "J", ENERGIES["residual"]),
}
"""Columns of every sweep; behind them comes one for each quantity that the sweep draws.

A number is the same however its walk was computed, so there is no wall time. What is missing, or does not
exist (the distance of a walk that failed), is NaN in a column of floats and −1 in one of integers.
"""

ROW: Final = np.dtype([(name, column.kind) for name, column in COLUMNS.items()])
"""Type of a row of a sweep that draws nothing."""


def field_column(name: str) -> Column:
    """Unit and meaning of a field of `Parameters`, `Scene` or `Options`, or of `preset`, as a column of floats.

    Raises:
        KeyError: there is no such field.
    """
    if name == "preset":
        return Column("<f8", "1", "named set of parameters that others are changed from")
    field = SECTIONS[SECTION_OF[name]].model_fields[name]
    return Column("<f8", field_unit(field), field.description or name)


def row_type(drawn: Sequence[str]) -> np.dtype[np.void]:
    """Type of a row.

    Args:
        drawn: quantities that some block of the sweep draws, in any order.
    """
    ordered = [name for name in DRAWABLE if name in drawn]
    return np.dtype([*((name, column.kind) for name, column in COLUMNS.items()), *((n, "<f8") for n in ordered)])


def missing_rows(kind: np.dtype[np.void], walks: range) -> Rows:
    """Rows of walks of which nothing is known but their indices, shape (len(walks),)."""
    rows = np.empty(len(walks), kind)
    for name in kind.names or ():
        rows[name] = np.nan if rows[name].dtype.kind == "f" else MISSING
    rows["index"] = walks
    return rows
