"""Sections of a user's values, and the names of their fields; the paper's symbols stand for names.

`mu_fc`, or μ_fc itself, stands for `floor_friction`.
"""

from collections.abc import Mapping
from typing import Any, Final, TypeVar

from pydantic import BaseModel

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import InputError, field_unit, path_of, shown, suggestion

T = TypeVar("T")

_SPELLINGS: Final = str.maketrans(
    {"ℓ": "ell", "β": "beta", "μ": "mu", "\N{MICRO SIGN}": "mu", "ν": "nu", "τ": "tau", "ω": "omega"}
)


def spelled(symbol: str) -> str:
    """A symbol in ASCII, Greek letters by their names."""
    return symbol.translate(_SPELLINGS)


SECTIONS: Final[Mapping[str, type[BaseModel]]] = {"scene": Scene, "options": Options, "parameters": Parameters}
"""Sections of a user's values, and the models that hold their fields."""
SECTION_OF: Final = {name: section for section, model in SECTIONS.items() for name in model.model_fields}
"""Section of each field; no name is in two."""
SYMBOL_OF: Final = {
    name: spelled(str(field.json_schema_extra["symbol"]))
    for model in SECTIONS.values()
    for name, field in model.model_fields.items()
    if isinstance(field.json_schema_extra, dict) and "symbol" in field.json_schema_extra
}
"""Name → symbol, in ASCII; no symbol is the name of a field."""
NAME_OF_SYMBOL: Final = {symbol: name for name, symbol in SYMBOL_OF.items()}
DOTTED_NAMES: Final = {
    written: f"{SECTION_OF[name]}.{written}"
    for written, name in ({name: name for name in SECTION_OF} | NAME_OF_SYMBOL).items()
}
"""Name or symbol → the same with its section before it."""


def unit_of(name: str) -> str:
    """SI unit of a field; `DIMENSIONLESS` for pure numbers and for what is no number."""
    return field_unit(SECTIONS[SECTION_OF[name]].model_fields[name])


def full_name(written: Any) -> Any:
    """Name of the field that is written as its name or symbol; anything else stays as it is."""
    return NAME_OF_SYMBOL.get(spelled(written), written) if isinstance(written, str) else written


def by_name(values: Mapping[Any, T], path: str = "") -> dict[Any, T]:
    """Values by the full names of their fields; neither names nor values are checked.

    Args:
        values: name or symbol → value.
        path: where the values were given.

    Raises:
        InputError: a value is given twice, by name and by symbol.
    """
    named: dict[Any, T] = {}
    for written, value in values.items():
        name = full_name(written)
        if name in named:
            raise InputError(f"{path_of(path, name)}: given twice, also as {shown(SYMBOL_OF[name])}; leave one out")
        named[name] = value
    return named


def by_section(settings: Mapping[str, object]) -> dict[str, dict[str, object]]:
    """Values by name or symbol, sorted into `SECTIONS`; the values are not checked.

    Raises:
        InputError: there is no such field, or a value is given twice.
    """
    sections: dict[str, dict[str, object]] = {section: {} for section in SECTIONS}
    for name, value in by_name(settings).items():
        sections[SECTION_OF[dotted_name(name, shown(name))]][name] = value
    return sections


def dotted_name(written: str, path: str) -> str:
    """Name of the field that is written as name or symbol, with or without its section: `parameters.mu_fc`.

    Raises:
        InputError: there is none; the message begins with `path`.
    """
    section, _, last = written.rpartition(".")
    name: str = full_name(last)
    if name not in SECTION_OF or section not in ("", SECTION_OF[name]):
        raise InputError(f"{path}: unknown name; {suggestion(last, DOTTED_NAMES)}")
    return name
