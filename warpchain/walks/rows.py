"""Rows of a sweep: what one walk leaves, as a NumPy structure."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.tallies import CONTACTS, LOST
from warpchain.inputs.distributions import DRAWABLE
from warpchain.inputs.sections import SECTION_OF, SECTIONS
from warpchain.inputs.validation import field_unit
from warpchain.walks.energy_error import ENERGY_ERROR, MOST_ENERGY_ERROR, energy_error
from warpchain.walks.walk_result import STORED

Rows = NDArray[np.void]

_DRAWN: Final = "_drawn"

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


def _flat(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Something for each field of `WalkResult`, by names of columns: a column for each key of a dictionary."""
    flat = dict(fields)
    for prefix, name in (("impulses", "impulses"), ("penetration", "greatest_penetration")):
        flat |= {f"{prefix}_{kind}": value for kind, value in fields[name].items()}
    return flat | {f"{'loss' if key in LOST else 'energy'}_{key}": value for key, value in fields["energy"].items()}


_NOTES: Final = {
    "index": ("1", "number of the walk in its sweep"),
    "status": ("1", f"code of what ended the walk; {MISSING} while it is missing"),
    "energy_at_release": ("J", "energy at release, kinetic and potential"),
    "energy_error": ("1", f"{ENERGY_ERROR}; above {MOST_ENERGY_ERROR} the walk is inaccurate"),
    **_flat(
        {
            name: {key: (stored.unit, meaning) for key, meaning in stored.keys.items()} or (stored.unit, stored.meaning)
            for name, stored in STORED.items()
        }
    ),
}
_KINDS: Final = {
    "index": "<i8",
    "status": "<i1",
    **dict.fromkeys(("dx", "walk_time", "simulated_time", "hold_time", "drift", "softened_at"), "<f8"),
    **dict.fromkeys(("lateral_drift", "final_tilt", "final_yaw", "greatest_tilt", "fell_at"), "<f8"),
    **dict.fromkeys(("fell_over", "fell_before_collapse"), "<i1"),
    **dict.fromkeys(("self_contact_at", "flight_before_self_contact", "collapsed_at", "flight_before_collapse"), "<f8"),
    **dict.fromkeys(("bounces", "bounces_before_self_contact", "bounces_before_collapse"), "<i4"),
    **dict.fromkeys(("steps_accepted", "steps_rejected", *(f"impulses_{kind}" for kind in CONTACTS)), "<i8"),
    **dict.fromkeys(("greatest_opening", *(f"penetration_{kind}" for kind in CONTACTS)), "<f8"),
    **dict.fromkeys(
        ("energy_at_release", *(f"loss_{name}" for name in LOST), "energy_residual", "energy_error"), "<f8"
    ),
}
COLUMNS: Final = {name: Column(kind, *_NOTES[name]) for name, kind in _KINDS.items()}
"""Columns of every sweep; behind them comes one for each quantity that the sweep draws, see `drawn_column`.

A number is the same however its walk was computed, so there is no wall time. What is missing, or does not
exist (the distance of a walk that failed), is NaN in a column of floats and −1 in one of integers.
"""

ROW: Final = np.dtype([(name, column.kind) for name, column in COLUMNS.items()])
"""Type of a row of a sweep that draws nothing."""


def fill_row(row: Any, outcome: Mapping[str, Any], drawn: Mapping[str, float]) -> None:
    """Write a walk into its row, which has its index already.

    Args:
        row: one of `missing_rows`.
        outcome: of the walk, see `WalkRun.outcome`.
        drawn: name → value of what was drawn for it.
    """
    energy = outcome["energy"]
    values = _flat(outcome) | {"energy_at_release": energy["kinetic_at_release"] + energy["potential_at_release"]}
    values["energy_error"] = energy_error(energy)
    for name in COLUMNS.keys() - {"index"}:
        row[name] = values[name]
    for name, value in drawn.items():
        row[drawn_column(name)] = value


def drawn_column(name: str) -> str:
    """Name of the column of a drawn quantity; its own name belongs to the axis that it may be drawn about."""
    return f"{name}{_DRAWN}"


def quantity_of(column: str) -> str:
    """Field of `Parameters`, `Scene` or `Options` behind an axis or a column of a drawn quantity."""
    return column.removesuffix(_DRAWN)


def field_column(name: str) -> Column:
    """Unit and meaning of an axis or of the column of a drawn quantity, as a column of floats.

    Raises:
        KeyError: there is no such field of `Parameters`, `Scene` or `Options`, and it is not `preset`.
    """
    if name == "preset":
        return Column("<f8", "1", "named set of parameters that others are changed from")
    if name.endswith(_DRAWN):
        own = field_column(quantity_of(name))
        return Column(own.kind, own.unit, f"{own.meaning}; as drawn for the walk")
    field = SECTIONS[SECTION_OF[name]].model_fields[name]
    return Column("<f8", field_unit(field), field.description or name)


def row_type(drawn: Iterable[str]) -> np.dtype[np.void]:
    """Type of a row.

    Args:
        drawn: quantities that some block of the sweep draws, in any order.
    """
    names = set(drawn)
    return np.dtype([*ROW.descr, *((drawn_column(name), "<f8") for name in DRAWABLE if name in names)])


def missing_rows(kind: np.dtype[np.void], walks: range) -> Rows:
    """Rows of walks of which nothing is known but their indices, shape (len(walks),)."""
    rows = np.empty(len(walks), kind)
    for name in kind.names or ():
        rows[name] = np.nan if rows[name].dtype.kind == "f" else MISSING
    rows["index"] = walks
    return rows
