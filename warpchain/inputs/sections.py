"""Sections of a user's values, and the names and symbols of their fields."""

import difflib
from collections.abc import Collection, Mapping
from typing import Any, Final, TypeVar

from pydantic import BaseModel

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.symbols import by_full_name, full_name, names_by_symbol, spelled
from warpchain.inputs.validation import InputError, as_word, choice

T = TypeVar("T")

SECTIONS: Final[Mapping[str, type[BaseModel]]] = {"scene": Scene, "options": Options, "parameters": Parameters}
"""Sections of a user's values, and the models that hold their fields."""
SECTION_OF: Final = {name: section for section, model in SECTIONS.items() for name in model.model_fields}
"""Section of each field; no name is in two."""
NAME_OF_SYMBOL: Final = {symbol: name for model in SECTIONS.values() for symbol, name in names_by_symbol(model).items()}
"""Symbol, in ASCII → name; no symbol is the name of a field."""
SYMBOL_OF: Final = {name: symbol for symbol, name in NAME_OF_SYMBOL.items()}


def by_name(
    values: Mapping[Any, T], path: str | None, known: Collection[str], *, elsewhere: bool = True
) -> dict[str, tuple[str, T]]:
    """Values by the full names of their fields, each with the path where it was given; the values are not checked.

    Args:
        values: name or symbol → value.
        path: where the values were given; None for keyword arguments.
        known: names that may be given there.
        elsewhere: whether an unknown name may belong to another section.

    Raises:
        InputError: a name is unknown, or given twice.
    """
    found = by_full_name(values, NAME_OF_SYMBOL, path)
    for name, (where, _) in found.items():
        if name not in known:
            raise InputError(f"{where}: unknown name; {suggested_name(name, known, elsewhere=elsewhere)}")
    return found


def by_section(settings: Mapping[str, object]) -> dict[str, dict[str, object]]:
    """Values by name or symbol, sorted into `SECTIONS`; the values are not checked.

    Raises:
        InputError: there is no such field, or a value is given twice.
    """
    sections: dict[str, dict[str, object]] = {section: {} for section in SECTIONS}
    for name, (_, value) in by_name(settings, None, SECTION_OF).items():
        sections[SECTION_OF[name]][name] = value
    return sections


def dotted_name(written: str, path: str) -> str:
    """Name of the field that is written as name or symbol, with or without its section: `parameters.mu_fc`.

    Raises:
        InputError: there is none; the message begins with `path`.
    """
    section, _, last = written.rpartition(".")
    name: str = full_name(last, NAME_OF_SYMBOL)
    if name not in SECTION_OF or section not in ("", SECTION_OF[name]):
        raise InputError(f"{path}: unknown name; {suggested_name(last, () if section else SECTION_OF)}")
    return name


def suggested_name(written: object, known: Collection[str], *, elsewhere: bool = True) -> str:
    """The remedy for an unknown name.

    Names like it are looked for among the known ones first: those of which it is the first or the last part, as `mu`
    is of `mu_fc`, then the closest one.

    Args:
        written: the name.
        known: names that may be given.
        elsewhere: whether names of other sections are suggested as well, with the section before them.
    """
    names = {name: name for name in (*known, *(SECTION_OF if elsewhere else ()))}
    names |= {symbol: name for symbol, name in NAME_OF_SYMBOL.items() if name in names}
    shown = {each: each if name in known else f"{SECTION_OF[name]}.{each}" for each, name in names.items()}
    text = spelled(as_word(written))
    alike = [text] if text in names else [name for name in names if _is_part(text, name)]
    here = [name for name in alike if names[name] in known]
    found = [shown[name] for name in here or alike or difflib.get_close_matches(text, names, n=1)]
    if found:
        return f"did you mean {' or '.join(filter(None, (', '.join(found[:-1]), found[-1])))}?"
    words = choice(known)
    if not known or (elsewhere and words.endswith("...")):
        return "give one of those that `warpchain parameters` lists"
    return f"give one of {words}"


def _is_part(text: str, name: str) -> bool:
    """Whether a text is the first or the last part of a name whose parts are joined by underscores."""
    return name.startswith(f"{text}_") or name.endswith(f"_{text}")
