"""Sections of a user's values, and the fields in them by name or symbol."""

from collections.abc import Mapping
from typing import Final

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import (
    NAME_OF_SYMBOL,
    SECTION_OF,
    SYMBOL_OF,
    InputError,
    Section,
    by_name,
    full_name,
    shown,
    suggested_name,
)

__all__ = ["NAME_OF_SYMBOL", "SECTIONS", "SECTION_OF", "SYMBOL_OF", "by_section", "dotted_name"]

SECTIONS: Final[Mapping[str, type[Section]]] = {"scene": Scene, "options": Options, "parameters": Parameters}
"""Sections of a user's values, and the models that hold their fields."""


def by_section(settings: Mapping[str, object]) -> dict[str, dict[str, object]]:
    """Values by name or symbol, sorted into `SECTIONS`, unchecked; an `InputError` if there is no such field."""
    sections: dict[str, dict[str, object]] = {section: {} for section in SECTIONS}
    for name, value in by_name(settings).items():
        sections[SECTION_OF[dotted_name(name, shown(name))]][name] = value
    return sections


def dotted_name(written: str, path: str) -> str:
    """Name of the field that is written as name or symbol, with or without its section: `parameters.mu_fc`.

    An `InputError` that begins with `path` says that there is none.
    """
    section, _, last = written.rpartition(".")
    name: str = full_name(last)
    if name not in SECTION_OF or section not in ("", SECTION_OF[name]):
        raise InputError(f"{path}: unknown name; {suggested_name(last)}")
    return name
