"""Rows of a sweep: the numbers of each walk, keyed by its block, its cell and its sample."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import reduce
from operator import getitem
from typing import Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.tallies import CONTACTS, LOST
from warpchain.hdf5_files import stored_fields
from warpchain.inputs.distributions import DRAWABLE
from warpchain.inputs.fields import FIELDS
from warpchain.inputs.validation import UnknownNameError, field_unit, shown, suggestion
from warpchain.walks.landmarks import MOST_ENERGY_ERROR, energy_error, faults
from warpchain.walks.outcome import Outcome

Rows = NDArray[np.void]
Columns = Mapping[str, NDArray[Any]]

ROW_KEYS: Final = np.dtype([("block", "<i4"), ("cell", "<i4"), ("sample", "<i4")])
"""What a row is found by: number of its block, of its cell in C order over the axes, of its sample in the cell."""

MISSING: Final = -1
"""Status of a walk that has not been computed yet; no code of `Status` is negative."""

_DRAWN: Final = "_drawn"


@dataclass(frozen=True)
class Column:
    """A column of a sweep: its type in NumPy's notation, SI unit ("1" for pure numbers) and meaning.

    The path is the field of `Outcome` that it is of, and the key in a field that is a dictionary; others have none.
    """

    kind: str
    unit: str
    meaning: str
    path: tuple[str, ...] = ()

    @property
    def digested(self) -> list[object]:
        """What a file depends on, see `Stored.digested`."""
        return [self.kind, self.unit, self.path]


def _stored_columns() -> Iterator[tuple[str, Column]]:
    """The columns of the fields of `Outcome`."""
    types = {item.name: get_args(item.type) for item in fields(Outcome)}
    for name, stored in stored_fields(Outcome).items():
        kind = "<i8" if types[name][0] in (int, dict[str, int]) else "<f8"
        for key, meaning in (stored.keys or {"": stored.meaning}).items():
            prefix = "loss" if name == "energy" and key in LOST else name.removeprefix("greatest_") if key else name
            path = (name, key) if key else (name,)
            yield "_".join((prefix, *path[1:])), Column(kind, stored.unit, meaning, path)


STORED_COLUMNS: Final = dict(_stored_columns())
"""Columns that shards keep, beside keys, status and what is drawn."""
COLUMNS: Final = {
    "index": Column("<i8", "1", "number of the walk in its sweep"),
    "status": Column("<i1", "1", f"code of what ended the walk; {MISSING} while it is missing"),
    **STORED_COLUMNS,
    "energy_at_release": Column("<f8", "J", "energy at release, kinetic and potential"),
    "energy_error": Column(
        "<f8",
        "1",
        "size of the energy unaccounted for, |residual|, relative to kinetic and potential at release; above "
        f"{MOST_ENERGY_ERROR} the walk is inaccurate",
    ),
}
"""Columns of every sweep; behind them comes one for each quantity that the sweep draws, see `drawn_column`.

What is missing, or does not exist (the distance of a walk that failed), is NaN among floats and −1 among integers.
"""


def checked_quantity(name: object, columns: Iterable[str], path: str) -> str:
    """Name of one of some columns that means can be of; an `UnknownNameError` if it is none of them."""
    known = [each for each in columns if each not in ("index", "status")]
    if name not in known:
        raise UnknownNameError(f"{path}: {shown(name)} is not a column of numbers; {suggestion(name, known)}")
    return str(name)


def row_type(drawn: Iterable[str]) -> np.dtype[np.void]:
    """Type of a row, given the quantities that some block of the sweep draws, in any order."""
    names = set(drawn)
    stored = [("status", "<i1"), *((name, column.kind) for name, column in STORED_COLUMNS.items())]
    return np.dtype([*ROW_KEYS.descr, *stored, *((drawn_column(name), "<f8") for name in DRAWABLE if name in names)])


def missing_rows(kind: np.dtype[np.void], keys: Rows) -> Rows:
    """Rows of walks of which nothing is known but their keys, shape (len(keys),)."""
    rows = np.empty(len(keys), kind)
    for name in kind.names or ():
        rows[name] = keys[name] if name in (ROW_KEYS.names or ()) else np.nan if kind[name].kind == "f" else MISSING
    return rows


def fill_outcomes(rows: Rows, places: Sequence[int], outcomes: Mapping[str, Any]) -> None:
    """Write the numbers of walks, of `outcomes_of`, into those of `missing_rows` at their places."""
    rows["status"][places] = outcomes["status"]
    for name, column in STORED_COLUMNS.items():
        rows[name][places] = reduce(getitem, column.path, outcomes)


def fill_drawn(rows: Rows, places: Sequence[int], points: Sequence[Mapping[str, float]]) -> None:
    """Write what was drawn for each of some walks into `missing_rows` at their places."""
    for name in dict.fromkeys(name for point in points for name in point):
        rows[drawn_column(name)][places] = [point.get(name, np.nan) for point in points]


def derived_columns(columns: "Columns | Rows") -> dict[str, NDArray[np.float64]]:
    """The columns that are computed from others."""
    at_release = columns["energy_kinetic_at_release"] + columns["energy_potential_at_release"]
    return {"energy_at_release": at_release, "energy_error": energy_error(at_release, columns["energy_residual"])}


def drawn_column(name: str) -> str:
    """Name of the column of a drawn quantity; its own name belongs to the axis that it may be drawn about."""
    return f"{name}{_DRAWN}"


def quantity_of(column: str) -> str:
    """Field of `Parameters`, `Scene` or `Options` behind an axis or a column of a drawn quantity."""
    return column.removesuffix(_DRAWN)


def field_column(name: str) -> Column:
    """Unit and meaning of an axis or of the column of a drawn quantity, as a column of floats.

    A `KeyError` says that there is no such field of `Parameters`, `Scene` or `Options`, and that it is not `preset`.
    """
    if name == "preset":
        return Column("<f8", "1", "named set of parameters that others are changed from")
    field = FIELDS[quantity_of(name)]
    meaning = field.description or name
    return Column("<f8", field_unit(field), f"{meaning}; as drawn for the walk" if name.endswith(_DRAWN) else meaning)


def faults_of_columns(columns: Columns, lengths: Columns) -> dict[str, NDArray[np.bool_]]:
    """Whether each walk in columns of a sweep has each of `warpchain.walks.landmarks.FAULTS`.

    Lengths are the least of each of `LENGTHS` [m] before anything was drawn, along the axes of the columns.
    """
    own = dict(lengths)
    for name in own:
        if (column := drawn_column(name)) in columns:  # NaN in rows of blocks that do not draw it
            own[name] = np.where(np.isnan(columns[column]), own[name], columns[column])
    deepest = np.max([columns[f"penetration_{kind}"] for kind in CONTACTS], axis=0)
    return faults(columns["energy_error"], columns["greatest_opening"], deepest, own)
