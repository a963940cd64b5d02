"""The paper's symbols as names of fields: `mu_fc`, or μ_fc itself, stands for `floor_friction`."""

from collections.abc import Mapping
from functools import cache
from typing import Any, Final, TypeVar

from pydantic import BaseModel

from warpchain.inputs.validation import InputError, path_of, shown

T = TypeVar("T")

_SPELLINGS: Final = str.maketrans(
    {"ℓ": "ell", "β": "beta", "μ": "mu", "\N{MICRO SIGN}": "mu", "ν": "nu", "τ": "tau", "ω": "omega"}
)


def spelled(symbol: str) -> str:
    """A symbol in ASCII, Greek letters by their names."""
    return symbol.translate(_SPELLINGS)


@cache
def names_by_symbol(model: type[BaseModel]) -> Mapping[str, str]:
    """Symbol, in ASCII → name, of all fields of a model that have a symbol."""
    extras = {name: field.json_schema_extra for name, field in model.model_fields.items()}
    return {
        spelled(str(extra["symbol"])): name
        for name, extra in extras.items()
        if isinstance(extra, dict) and "symbol" in extra
    }


def full_name(written: Any, names: Mapping[str, str]) -> Any:
    """Name of the field that is written as its name or symbol; anything else stays as it is.

    Args:
        written: what was written.
        names: symbol, in ASCII → name.
    """
    return names.get(spelled(written), written) if isinstance(written, str) else written


def by_full_name(values: Mapping[Any, T], names: Mapping[str, str], path: str | None) -> dict[Any, tuple[str, T]]:
    """Values by the full names of their fields, each with the path where it was given.

    Args:
        values: name or symbol → value; a name that is unknown stays as it is.
        names: symbol, in ASCII → name.
        path: where the values were given; None for keyword arguments.

    Raises:
        InputError: a value is given twice, by name and by symbol.
    """
    found: dict[Any, tuple[str, T]] = {}
    for written, value in values.items():
        where = shown(written) if path is None else path_of(path, written)
        name = full_name(written, names)
        if name in found:
            raise InputError(f"{where}: also given as {found[name][0]}; leave one out")
        found[name] = where, value
    return found
