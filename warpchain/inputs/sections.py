"""Sections of a user's values, by name in signatures of functions, and by name or symbol in what a user gives."""

import inspect
from collections.abc import Callable, Container, Iterable, Mapping
from typing import Any, Final, TypeVar

from warpchain.inputs import validation
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import NAME_OF_SYMBOL, SECTION_OF, SYMBOL_OF, InputError, Section, shown

__all__ = ["NAME_OF_SYMBOL", "SECTIONS", "SECTION_OF", "SYMBOL_OF", "by_section", "dotted_name", "takes_fields"]

F = TypeVar("F", bound=Callable[..., object])

SECTIONS: Final[Mapping[str, type[Section]]] = {"scene": Scene, "options": Options, "parameters": Parameters}
"""Sections of a user's values, and the models that hold their fields."""


def takes_fields(*sections: str, without: Container[str] = (), beside: Iterable[str] = ()) -> Callable[[F], F]:
    """Let the signature of a function name the fields that its ``**settings`` take, for notebooks to complete.

    These are the fields of some `SECTIONS`, `without` those that it does not take, and what it takes `beside` them.
    """

    def named(function: F) -> F:
        signature = inspect.signature(function)
        *own, settings = signature.parameters.values()
        types: dict[str, Any] = dict.fromkeys(beside, Any)
        for section in sections:
            types |= {name: field.annotation for name, field in SECTIONS[section].model_fields.items()}
        fields = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=..., annotation=kind)
            for name, kind in types.items()
            if name not in signature.parameters and name not in without
        ]
        function.__signature__ = signature.replace(parameters=[*own, *fields, settings])  # type: ignore[attr-defined]
        return function

    return named


def by_section(settings: Mapping[str, object]) -> dict[str, dict[str, object]]:
    """Values by name or symbol, sorted into `SECTIONS`, unchecked; an `InputError` if there is no such field."""
    sections: dict[str, dict[str, object]] = {section: {} for section in SECTIONS}
    for name, value in validation.by_name(settings).items():
        sections[SECTION_OF[dotted_name(name, shown(name))]][name] = value
    return sections


def dotted_name(written: str, path: str) -> str:
    """Name of the field written as name or symbol, with or without its section; `path` is for the `InputError`."""
    section, _, last = written.rpartition(".")
    name: str = validation.full_name(last)
    if name not in SECTION_OF or section not in ("", SECTION_OF[name]):
        raise InputError(f"{path}: unknown name; {validation.suggested_name(last)}")
    return name
