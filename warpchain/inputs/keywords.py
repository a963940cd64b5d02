"""The keywords of `walk`, `sweep` and `simulate`, as help, notebooks, the site and type checkers show them.

The functions take fields of a walk as ``**settings``. Their names, types and defaults come from the models of the
fields: `takes_fields` puts them into the signature that a user reads at run time, and docs/generate_reference.py writes
the same into `warpchain/typed.pyi`, which type checkers and editors read.
"""

import inspect
import re
import textwrap
from collections.abc import Callable, Container, Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel

from warpchain.inputs.arrays import Array
from warpchain.inputs.fields import NAME_OF_SYMBOL, SECTION_OF
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene

Keywords = Mapping[str, tuple[str, Any]]
"""Name → type and default."""
F = TypeVar("F", bound=Callable[..., object])
_NAMED: Final = {"floor": "Floor", "start": "Start", "until": "float | str | Mapping[str, float | str]"}
"""Fields whose types have names, or take more than they become."""


class _Type(str):
    """A type in a signature, shown without quotes."""

    __slots__ = ()
    __repr__ = str.__str__


class _Signature(inspect.Signature):
    """A signature of a hundred keywords, shown in lines of readable length."""

    __slots__ = ()

    def __str__(self) -> str:
        """Lines that begin with a name."""
        whole = re.sub(r" (?=[=|])|(?<=[:=|]) ", "\N{NO-BREAK SPACE}", super().__str__())
        lines = textwrap.fill(whole, 100, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)
        return lines.replace("\N{NO-BREAK SPACE}", " ")


def _short(annotation: Any) -> _Type:
    """An annotation without the modules that its names are in."""
    text = inspect.formatannotation(annotation).replace(str(Array), "Array")
    return _Type(re.sub(r"\b(?:\w+\.)+(?=\w)", "", text))


def type_text(kind: Any) -> str:
    """A type in Python's notation, without bounds; a list may be any sequence."""
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return type_text(args[0])
    if origin in (Union, UnionType):
        return " | ".join(dict.fromkeys(map(type_text, args)))
    if origin is Literal:
        return f"Literal[{', '.join(map(repr, args))}]"
    if origin is dict or (isinstance(kind, type) and issubclass(kind, BaseModel)):
        return "Mapping[str, Any]"
    if origin in (list, tuple):
        return "Sequence[Any]"
    return "None" if kind is NoneType else str(kind.__name__)


def types_of(*models: type[BaseModel]) -> dict[str, str]:
    """Type of each field of some models."""
    fields = [each for model in models for each in model.model_fields.items()]
    return {name: _NAMED.get(name) or type_text(field.annotation) for name, field in fields}


def walk_keywords(method: str = "standard") -> Keywords:
    """All fields of a walk and the symbols of Table 1; defaults of a method and of the preset `paper`."""
    chosen = vars(Options.model_validate({"method": method})) | {"method": method}
    table = {name: quantity.value for name, quantity in Parameters.quantities().items()}
    defaults = {**vars(Scene()), **table, **chosen}
    found = {name: (kind, defaults[name]) for name, kind in types_of(Scene, Parameters, Options).items()}
    return found | {symbol: found[name] for symbol, name in NAME_OF_SYMBOL.items()}


def takes_fields(
    *sections: str, without: Container[str] = (), beside: Keywords | None = None, method: str = "standard"
) -> Callable[[F], F]:
    """Let the signature of a function show the fields that its ``**settings`` take, with types and defaults.

    These are the fields of some sections and their symbols, `without` those that it does not take, and what it takes
    `beside` them.
    """

    def named(function: F) -> F:
        signature = inspect.signature(function)
        *own, _ = (each.replace(annotation=_short(each.annotation)) for each in signature.parameters.values())
        known = walk_keywords(method).items()
        fields = {name: each for name, each in known if SECTION_OF[NAME_OF_SYMBOL.get(name, name)] in sections}
        taken = {name: each for name, each in {**(beside or {}), **fields}.items() if name not in without}
        shown = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=_Type(kind))
            for name, (kind, default) in taken.items()
        ]
        returned = _short(signature.return_annotation)
        function.__signature__ = _Signature([*own, *shown], return_annotation=returned)  # type: ignore[attr-defined]
        return function

    return named
