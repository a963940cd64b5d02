"""Texts on figures and in tables: numbers, units, quantities, cells, walks excluded from means; titles."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.distributions import TABLE
from warpchain.inputs.fields import FIELDS, SECTION_OF
from warpchain.inputs.parameters import PRESETS, Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import DIMENSIONLESS, field_unit, short
from warpchain.walks.cell_statistics import CellStatistics
from warpchain.walks.walk_numbers import WalkNumbers as Walk

_SYMBOLS: Final = {"dx": "Δx", "links": "n", "frequency": "ν"}
"""The paper's symbols of what is not in Table 1."""

_NAMES: Final = {
    "dx": "distance walked",
    "links": "number of links",
    "frequency": "frequency of the sprocket",
    "point": "parameter set",
}
"""Names that say more than those of the fields."""

SPREADS: Final = ("mean", "sd", "standard_error", "at_least")
"""Statistics of a quantity in a cell, in its unit: see `CellStatistics`."""
COUNTS: Final = ("count", "absent", "failed", "missing")
"""Numbers of walks of a cell: at rest with the quantity, at rest without it, ended otherwise, not computed yet."""


def value_text(value: Any) -> str:
    """A value as a sweep file has it: a number, a name, whether something is on, or null."""
    if value is None or isinstance(value, bool | np.bool_):
        return "null" if value is None else str(value).lower()
    return value if isinstance(value, str) else short(value)


def short_texts(values: Sequence[Any] | NDArray[Any]) -> list[str]:
    """Values of an axis; numbers exactly in six digits or, where those don't do, in as few as tell them apart."""
    texts = [value_text(value) for value in values]
    if any(value is None or isinstance(value, str | bool | np.bool_) for value in values):
        return texts
    digits = 2  # 17 tell any two numbers apart
    while any(float(text) != value for text, value in zip(texts, values, strict=True)) and digits < 17:
        digits += 1
        texts = [short(value, digits) for value in values]
        if len(set(texts)) == len(texts):
            break
    return texts


def with_error(mean: float, error: float) -> str:
    """A mean and its standard error, which has two digits: ``0.606 ± 0.012``; the mean alone if it has no error."""
    if not 0 < error < math.inf:
        return short(mean, 3)
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{mean:.{digits}f} ± {error:.{digits}f}"


def unit_text(name: str) -> str:
    """Unit of a field of `Parameters`, `Scene` or `Options`; empty for pure numbers, `preset` and `point`."""
    if name not in SECTION_OF:
        return ""
    unit = field_unit(FIELDS[name])
    return "" if unit == DIMENSIONLESS else unit


def with_unit(text: str, unit: str) -> str:
    """A text and a unit as ``Δx / m``; without the unit if it is empty or that of pure numbers."""
    return text if unit in ("", DIMENSIONLESS) else f"{text} / {unit}"


def axis_symbol(name: str) -> str:
    """The paper's symbol of a field, or else its name."""
    if name in Parameters.model_fields:
        return Parameters.quantities()[name].symbol
    return _SYMBOLS.get(name, name.replace("_", " "))


def math_symbol(name: str) -> str:
    r"""The same for a figure: ``$μ_\mathrm{fc}$``."""
    if name not in Parameters.model_fields and name not in _SYMBOLS:
        return quantity_name(name)
    base, _, index = axis_symbol(name).partition("_")
    return f"${base}" + (f"_\\mathrm{{{index}}}$" if index else "$")


def quantity_name(name: str) -> str:
    """A field or a column in words."""
    return _NAMES.get(name, name.replace("_", " ").replace("coulomb", "Coulomb"))


def quantity_text(name: str) -> str:
    """The same for a label of a figure, with the symbol if there is one."""
    symbol = math_symbol(name)
    return f"{quantity_name(name)} {symbol}" if symbol.startswith("$") else quantity_name(name)


def named_values(name: str, values: Sequence[Any] | NDArray[Any]) -> list[str]:
    """Values of a quantity for a title: ``$n$ = 60``, ``$ν$ = 15 Hz``."""
    return [f"{math_symbol(name)} = {text} {unit_text(name)}".rstrip() for text in short_texts(values)]


def quantity_label(name: str) -> str:
    """Name, symbol and unit of a field, for an axis of a figure."""
    return with_unit(quantity_text(name), unit_text(name))


def cell_values(axes: Mapping[str, NDArray[Any]], place: Iterable[int]) -> dict[str, Any]:
    """Value of each axis in the cell at a place along the axes."""
    return {name: values[i] for (name, values), i in zip(axes.items(), place, strict=True)}


def cell_text(values: Mapping[str, Any]) -> str:
    """Describe a cell, given the value of each axis by its name, as ``n = 60, ν = 15 Hz``."""
    texts = (f"{axis_symbol(name)} = {value_text(value)} {unit_text(name)}" for name, value in values.items())
    return ", ".join(text.rstrip() for text in texts)


MARK: Final = "*"
"""Of a mean of survivors, see `cell_notes`."""


def cell_table(found: "CellStatistics") -> tuple[list[str], Iterator[list[str]]]:
    """Head and rows of a table: mean and spread of the distance in each cell, and numbers of walks.

    The notes below it are those of `cell_notes`.
    """
    lengths = {"mean Δx / m": found.mean, "s.d. / m": found.sd, "s.e. / m": found.standard_error}
    lengths |= {"at least / m": found.at_least} if np.isfinite(found.at_least).any() else {}
    counts = {"at rest": found.count, "failed": found.failed}
    counts |= {"ended as asked": found.absent} if found.absent.any() else {}
    counts |= {"not run yet": found.missing} if found.missing.any() else {}
    if found.reached is not None:
        words = np.where(found.reached, "yes", np.where(found.missing > 0, "not yet", "no"))
        counts |= {"walks": found.count + found.absent + found.failed, "error reached": words}
    rows = (
        [
            *(value_text(value) for value in cell_values(found.axes, place).values()),
            *(f"{values[place]:.4f}{marks.get(name, '')}".replace("nan", "–") for name, values in lengths.items()),
            *(f"{values[place]}" for values in counts.values()),
        ]
        for place in np.ndindex(*found.mean.shape)
        for marks in [{"mean Δx / m": MARK if found.of_survivors[place] else " "}]
    )
    return [*(with_unit(axis_symbol(name), unit_text(name)) for name in found.axes), *lengths, *counts], rows


def cell_notes(cells: Iterable["CellStatistics"]) -> list[str]:
    """What marks, bounds and missing errors in the tables of some blocks mean; one line for each that occurs."""
    found, notes = list(cells), list[str]()
    if any(each.of_survivors.any() for each in found):
        notes.append(f"{MARK} mean of the walks that came to rest only; the others of its cell have no Δx")
    if any(np.isfinite(each.at_least).any() for each in found):
        notes.append("at least: mean of all walks, if those still moving at distance_limit had stopped there")
    return [*notes, *dict.fromkeys(each.why_no_error for each in found if each.why_no_error)]


def lost_note(cells: Sequence[Mapping[str, Any]]) -> str:
    """Number of walks that are not in the means of some cells, each with numbers of `COUNTS`; empty if all are."""
    counts = {name: sum(int(np.sum(cell[name])) for cell in cells) for name in COUNTS}
    walks = sum(counts.values())
    texts = {"failed": "walks failed", "absent": "have none", "missing": "not run yet"}
    return ", ".join(f"{counts[name]} of {walks} {text}" for name, text in texts.items() if counts[name])


_SELDOM: Final = ("links", "frequency", "walk_limit", "hold_limit")
"""Fields that titles say anyway, or that matter to no figure."""
_MOST_DIFFERENCES: Final = 4


def differences(values: Mapping[str, Any], preset: str | None, symbol: Callable[[str], str] = axis_symbol) -> list[str]:
    """What of a scene and parameters differs from the defaults and from Table 1, such as ``μ_fc = 0.1``, ``slope 3°``.

    A difference of a preset is its name. The symbols are for plain text, or those of `math_symbol`.
    """
    usual = vars(Scene()) | vars(PRESETS[preset or "paper"])
    found = [f"preset {preset}"] * (preset not in (None, "paper"))
    for name, value in values.items():
        if name in _SELDOM or name not in usual or value == usual[name]:
            continue
        unit = unit_text(name) if unit_text(name) == "°" else f" {unit_text(name)}"
        if isinstance(value, list | tuple | dict):
            found.append("profile as floor" if name == "floor" else f"own {quantity_name(name)}")
        elif name in Parameters.model_fields:
            found.append(f"{symbol(name)} = {value_text(value)}{unit}".rstrip())
        else:
            found.append(f"{quantity_name(name)} {value_text(value)}{unit}".rstrip())
    return found[:_MOST_DIFFERENCES] + ["…"] * (len(found) > _MOST_DIFFERENCES)


def setting(walk: Walk, symbol: Callable[[str], str] = axis_symbol) -> str:
    """Links, frequency, and what else differs from the defaults, as a title; symbols as of `differences`."""
    setup, drawn = walk.setup, TABLE if walk.seed is not None else {}
    values = {name: value for name, value in (vars(setup.scene) | vars(setup.parameters)).items() if name not in drawn}
    texts = [setup.described.replace(" at ", ", ", 1), *differences(values, setup.preset, symbol)]
    return ", ".join([*texts, "sampled values"] if drawn else texts)


def headline(walk: Walk) -> str:
    """Links, frequency and, if it came to rest, how far it walked."""
    text = "Δx = x / cos α" if walk.setup.scene.slope else "Δx"
    return setting(walk) + (f": {text} = {walk.dx:.3f} m" if math.isfinite(walk.dx) else "")
