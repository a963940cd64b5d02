"""Every field that a user may set, by its name or symbol: complete wherever it is imported, as it has all sections."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic.fields import FieldInfo

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import InputError, Section, by_name, full_name, shown, spelled, suggested_name

SECTIONS: Final[Mapping[str, type[Section]]] = {"scene": Scene, "options": Options, "parameters": Parameters}
"""Sections of a user's values, and the models that hold their fields."""
FIELDS: Final[dict[str, FieldInfo]] = {
    name: field for model in (Parameters, Options, Scene) for name, field in model.model_fields.items()
}
"""Name of each field → the field; no name is in two sections."""
SECTION_OF: Final = {name: section for section, model in SECTIONS.items() for name in model.model_fields}
"""Name of each field → its section."""
SYMBOL_OF: Final = {
    name: spelled(str(field.json_schema_extra["symbol"]))
    for name, field in FIELDS.items()
    if isinstance(field.json_schema_extra, dict) and "symbol" in field.json_schema_extra
}
"""Name → the paper's symbol, in ASCII; no symbol is the name of a field."""
NAME_OF_SYMBOL: Final = {symbol: name for name, symbol in SYMBOL_OF.items()}


def by_section(settings: Mapping[str, object], keys: Iterable[str] = ()) -> dict[str, dict[str, Any]]:
    """Values by name or symbol, sorted into sections, unchecked; an `InputError` if there is no such field.

    By an unknown name one of the `keys` may be meant, which stand beside fields.
    """
    sections: dict[str, dict[str, Any]] = {name: {} for name in SECTIONS}
    for name, value in by_name(settings).items():
        sections[SECTION_OF[dotted_name(name, shown(name), keys)]][name] = value
    return sections


def dotted_name(written: str, path: str, keys: Iterable[str] = ()) -> str:
    """Name of the field written as name or symbol, with or without its section; the rest is for the `InputError`."""
    section, _, last = written.rpartition(".")
    name: str = full_name(last)
    if name not in SECTION_OF or section not in ("", SECTION_OF[name]):
        raise InputError(f"{path}: unknown name; {suggested_name(last, keys)}")
    return name
