"""The errors of means at which cells of a sweep stop: what a user gives, and when one is reached."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.validation import InputError, shown, suggestion
from warpchain.walks.rows import COLUMNS

LEAST_GROUPS: Final = 8
"""Least number of independent walks, or randomisations, whose spread is taken for an error: fewer agree by accident."""
AT_MOST: Final = 1024
"""Most samples of a cell unless a sweep says otherwise; a power of two, as designs need."""

_QUANTITIES: Final = [name for name in COLUMNS if name not in ("index", "status")]
_GIVEN: Final = re.compile(r"\s*([-+0-9.eE]+)\s*(.*?)\s*")
_PREFIXES: Final = {"": 1.0, "k": 1e3, "c": 1e-2, "m": 1e-3, "µ": 1e-6, "μ": 1e-6}


@dataclass(frozen=True)
class Target:
    """A standard error that a mean is to have, in the unit of its column, or relative to the size of the mean."""

    error: float
    is_relative: bool

    def most(self, mean: NDArray[np.float64]) -> NDArray[np.float64]:
        """The error that each of some means is to have, in the unit of the column; a relative one of zero is zero."""
        return self.error * np.abs(mean) if self.is_relative else np.full(mean.shape, self.error)

    def canonical(self) -> float | str:
        """Its form in a sweep file, in SI units."""
        return self.error if self.is_relative else f"{self.error!r} absolute"


def targets(given: Any) -> dict[str, Target]:
    """Name of each quantity → its target, of a mapping, or of one value, which is of Δx; else an `InputError`."""
    named = given if isinstance(given, Mapping) else {"dx": given}
    if not named:
        raise ValueError("expected the error of a quantity, got none; use until: {dx: 1 %}")
    return {name: _target(name, value) for name, value in named.items()}


def _target(name: Any, given: Any) -> Target:
    """The target of 0.01, "1 %" (both relative), "2 mm" or "0.002 absolute", in SI units."""
    if name not in _QUANTITIES:
        raise InputError(f"{name}: not a column of numbers; {suggestion(name, _QUANTITIES)}")
    unit = COLUMNS[name].unit
    scales = {f"{prefix}{unit}": scale for prefix, scale in _PREFIXES.items() if unit != "1"} | {"absolute": 1.0}
    found = _GIVEN.fullmatch(given) if isinstance(given, str) else None
    number, written = (found[1], found[2]) if found else (given, "")
    try:
        value = math.nan if isinstance(number, bool) else float(number)
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    value *= scales.get(written, 0.01 if written == "%" else 1.0 if written == "" else math.nan)
    if not 0 < value < (1.0 if written in ("", "%") else math.inf):
        example = "0.5 absolute" if unit == "1" else f"2 m{unit}" if unit in ("m", "s", "J") else f"0.01 {unit}"
        raise InputError(f"{name}: expected a standard error, such as 0.01, 1 % or {example}; got {shown(given)}")
    return Target(value, written in ("", "%"))
