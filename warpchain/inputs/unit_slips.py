"""Refuses values that are probably in another unit than intended, such as lengths in mm or masses in g.

Every walk and every cell of a sweep is asked about them, see `Setup.checked`. Coefficients of joints,
such as k, b and ω_c, are left out: they are chosen over decades.
"""

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError, short

_FACTOR: Final = 10 * (1 + 1e-9)
"""More times the usual value, and a smaller part of it, are asked about; ten times and a tenth are common in scans."""
_NEAR: Final = 3.0
"""A unit is likely if the value in it is no more times, and no smaller part, of the usual one."""
_UNITS: Final[Mapping[str, Mapping[str, float]]] = {
    "m": {"mm": 1e-3, "cm": 1e-2, "inches": 0.0254, "µm": 1e-6},
    "kg": {"g": 1e-3, "mg": 1e-6},
    "kg m²": {"g mm²": 1e-9, "g cm²": 1e-7, "kg mm²": 1e-6, "kg cm²": 1e-4},
    "m/s²": {"cm/s²": 1e-2, "mm/s²": 1e-3},
}
"""SI unit → units that values may be in by mistake, in SI."""
_TABLE: Final = Parameters.quantities()
USUAL: Final[Mapping[str, tuple[float, str]]] = {
    **{name: (each.value, each.unit) for name, each in _TABLE.items() if each.unit in _UNITS},
    "link_masses": (_TABLE["inner_mass"].value, "kg"),
    "link_inertias": (_TABLE["inner_inertia"].value, "kg m²"),
    "link_radii": (_TABLE["circle_radius"].value, "m"),
    "charm_radius": (_TABLE["circle_radius"].value, "m"),
}
"""Name of each quantity that is asked about → value and unit of Table 1."""


def check_units(values: Mapping[str, Any], path: str) -> None:
    """Check that no value, a number or a list, is more than 10 times those of Table 1, or less than a tenth.

    Nothing is said of 0 and of null, nor of little gravity. The `InputError` begins with `path`, and names the unit
    that is probably meant, and how to insist.
    """
    for name, (usual, unit) in USUAL.items():
        given = values.get(name)
        if given is None:
            continue
        for value in np.atleast_1d(np.asarray(given, float)).tolist():
            ratio = value / usual
            if ratio > _FACTOR or (0 < value and ratio < 1 / _FACTOR and name != "gravity"):
                question = _question(value, usual, unit)
                problem = f"{short(value)} {unit} is {short(ratio, 3)} times Table 1's"
                raise InputError(f"{path}.{name}: {problem}; {question} set options.unusual_values: true to insist")


def _question(value: float, usual: float, unit: str) -> str:
    """What is probably meant, in SI."""
    far = {name: abs(math.log(value) + math.log(factor / usual)) for name, factor in _UNITS[unit].items()}
    name = min(far, key=lambda each: far[each])
    if far[name] > math.log(_NEAR):
        return f"use {unit}, or"
    return f"did you mean {short(value * _UNITS[unit][name])} ({short(value)} {name})? Else"
