"""Texts on figures and in tables: numbers, units, quantities and cells."""

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np

from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import DIMENSIONLESS
from warpchain.store.sweep_result import BlockResult
from warpchain.walks.rows import field_column

DISTANCE: Final = "distance walked $Δx$ / m"
FREQUENCY: Final = "frequency of the sprocket $ν$ / Hz"


def number_text(value: float) -> str:
    """A number in its shortest form: 1e-6 and 1e7, not 1e-06 and 1e+07."""
    return re.sub(r"e\+?(-?)0*(?=\d)", r"e\1", f"{value:g}")


def value_text(value: Any) -> str:
    """A value of an axis: a number, a name, or whether something is on."""
    return str(value) if isinstance(value, str | bool | np.bool_) else number_text(value)


def unit_text(name: str) -> str:
    """Unit of a field of `Parameters`, `Scene` or `Options`; empty for pure numbers."""
    unit = field_column(name).unit
    return "" if unit == DIMENSIONLESS else unit


def with_unit(text: str, unit: str) -> str:
    """A text and a unit as ``Δx / m``; without the unit if it is empty or that of pure numbers."""
    return text if unit in ("", DIMENSIONLESS) else f"{text} / {unit}"


def axis_symbol(name: str) -> str:
    """Symbol of a field: that of a parameter, n for links, ν for the frequency; for other fields the name."""
    if name in Parameters.model_fields:
        return Parameters.quantities()[name].symbol
    return {"links": "n", "frequency": "ν"}.get(name, name.replace("_", " "))


def quantity_text(name: str) -> str:
    """Name of a field, with its symbol if it is a parameter, for a label of a figure."""
    text = name.replace("_", " ").replace("coulomb", "Coulomb")
    if name not in Parameters.model_fields:
        return text
    base, _, index = Parameters.quantities()[name].symbol.partition("_")
    return f"{text} ${base}" + (f"_\\mathrm{{{index}}}$" if index else "$")


def quantity_label(name: str) -> str:
    """Name, symbol and unit of a field, for an axis of a figure."""
    return with_unit(quantity_text(name), unit_text(name))


def cell_values(block: BlockResult, place: Iterable[int]) -> dict[str, Any]:
    """Value of each axis of a block in the cell at a place along the axes."""
    return {name: values[i] for (name, values), i in zip(block.axes.items(), place, strict=True)}


def cell_text(values: Mapping[str, Any]) -> str:
    """Describe a cell, as ``n = 60, ν = 15 Hz``.

    Args:
        values: name of an axis → value.
    """
    texts = (f"{axis_symbol(name)} = {value_text(value)} {unit_text(name)}" for name, value in values.items())
    return ", ".join(text.rstrip() for text in texts)
