"""What every check of a user's values shares: the error, bounds, and refusals in one line.

A refusal reads `path.of.field: what is wrong; what to do`. Models raise `refusal`, `validated` turns pydantic's errors
into such lines.
"""

import difflib
import itertools
import math
import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticCustomError

STRICT: Final = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
"""Of models that hold a user's values."""

DIMENSIONLESS: Final = "1"


LONGEST_LINE: Final = 200
"""Most characters of a line of a message."""
LONGEST_NAME: Final = 255
"""Most characters of a name that a user gives to something; a folder's name has no more."""
_LONGEST_VALUE: Final = 60
"""Most characters of a value in a message."""
_LONGEST_PATH: Final = 120
"""Most characters of a path with which a line begins that is too long; one can go to a path only if it is whole."""
_LONGEST_CHOICE: Final = 125
"""Most characters of a list of possible words in a message."""

DEEPEST: Final = 20
"""Most lists and mappings inside of one another; a sweep file has eight at most."""
MOST_VALUES: Final = 100_000
"""Most values, keys and lists that are taken at once; each takes time and memory before it can be checked."""


class InputError(ValueError):
    """Input that the user can correct; its text is `path.of.field: what is wrong; what to do`, in one line.

    A call that checks several values at once, `warpchain.sweep`, has a line for each. A line has at most
    `LONGEST_LINE` characters, all of them printable, whatever was given.
    """

    def __init__(self, *problems: str) -> None:
        """Have a line for each problem."""
        super().__init__(*map(one_line, problems))

    def __str__(self) -> str:
        """All lines."""
        return "\n".join(self.args)


class DamagedFileError(InputError):
    """A file that is not what warpchain wrote; its text is `path: what is wrong; what to do`, in one line."""


class InputWarning(UserWarning):
    """Input that is possible but probably not meant; its text reads like that of an `InputError`."""


@dataclass(frozen=True)
class Bounds:
    """An interval of physical values.

    Attributes:
        lower: lower end, in the unit of the quantity.
        upper: upper end; included when finite.
        lower_included: whether the lower end itself is physical.
    """

    lower: float
    upper: float = math.inf
    lower_included: bool = True

    def admit(self, value: float) -> bool:
        """Whether `value` is finite and inside the interval."""
        above = value >= self.lower if self.lower_included else value > self.lower
        return math.isfinite(value) and above and value <= self.upper


def number_field(default: Any, unit: str, description: str, **more: Any) -> Any:
    """A pydantic field that holds a number.

    Args:
        default: its default, in `unit`; `...` for none.
        unit: SI unit, `DIMENSIONLESS` for pure numbers.
        description: its meaning, in one line.
        more: limits `ge`, `gt`, `le`, `lt` in `unit`, as of `pydantic.Field`; anything else stands beside the unit.
    """
    limits = {name: more.pop(name) for name in ("ge", "gt", "le", "lt") if name in more}
    return Field(default, description=description, json_schema_extra={"unit": unit, **more}, **limits)


def field_unit(field: FieldInfo) -> str:
    """Unit of a field that `number_field` made; `DIMENSIONLESS` for any other."""
    extra = field.json_schema_extra
    return str(extra["unit"]) if isinstance(extra, dict) else DIMENSIONLESS


def field_limits(field: FieldInfo) -> dict[str, float]:
    """The limits `ge`, `gt`, `le`, `lt` that a field has."""
    limits: dict[str, float] = {}
    for limit in field.metadata:
        limits |= {name: float(getattr(limit, name)) for name in ("ge", "gt", "le", "lt") if hasattr(limit, name)}
    return limits


def field_bounds(field: FieldInfo) -> Bounds:
    """The interval that the limits of a field leave."""
    limits = field_limits(field)
    upper = math.nextafter(limits["lt"], -math.inf) if "lt" in limits else limits.get("le", math.inf)
    return Bounds(limits.get("ge", limits.get("gt", -math.inf)), upper, "gt" not in limits)


def refusal(field: str, message: str) -> PydanticCustomError:
    """An error for a pydantic validator to raise; `validated` turns it into `….field: message`."""
    return PydanticCustomError("refusal", "{text}", {"field": field, "text": message})


ModelT = TypeVar("ModelT", bound=BaseModel)


def validated(model: type[ModelT], values: Mapping[str, object], path: str) -> ModelT:
    """Build a pydantic model, with errors as one line that names the field and the remedy.

    Args:
        model: `Parameters`, or another model whose fields carry a unit.
        values: name → value; NumPy's numbers are taken as `plain` does.
        path: where the values were given, such as `scene`; the error's field path starts with it.

    Raises:
        InputError: some value is refused; the first is described, the others are counted.
    """
    few = len(values) <= 2 * len(model.model_fields)
    own = few and all(type(name) is str and type(value) in _OWN for name, value in values.items())
    try:
        return model.model_validate(dict(values) if own else plain(values, path))
    except ValidationError as error:
        first, *others = error.errors()
        count = f" (and {len(others)} more)" if others else ""
        raise InputError(_described(first, model, path) + count) from None


_OWN: Final = frozenset((float, int, str, bool, type(None)))
"""Python's own types; sweeps have millions of such values."""


def plain(value: object, path: str = "value") -> Any:
    """A user's value in Python's own types, as a YAML file gives it; what is none of these is left as it is.

    NumPy's numbers, truth values and texts become Python's, and so do classes derived from these; arrays, ranges and
    tuples become lists, also inside of lists and mappings.

    Raises:
        InputError: there are more than `MOST_VALUES` of them, or deeper than `DEEPEST`, a key is no text or number, or
            a value is a span of time; the message begins with `path`.
    """
    left = MOST_VALUES

    def counted(count: int) -> None:
        if count > left:
            raise InputError(f"{path}: more than {MOST_VALUES} values; give fewer")

    def listed(items: Iterable[object], count: int, depth: int) -> list[Any]:
        counted(count)
        return [converted(item, depth) for item in items]

    def converted(value: object, depth: int) -> Any:
        nonlocal left
        left -= 1
        if type(value) in _OWN:
            return value
        for kind, copied in _OWN_CONTAINERS:
            if isinstance(value, kind) and type(value) is not kind:
                value = copied(value)
        if isinstance(value, np.ndarray | list | tuple | range | Mapping) and depth > DEEPEST:
            raise InputError(f"{path}: more than {DEEPEST} lists or mappings inside of one another; give fewer")
        if isinstance(value, Mapping):
            keys = listed(value, len(value), depth + 1)
            for key in keys:
                if not isinstance(key, str | int | float | None):
                    raise InputError(f"{path}: {shown(key)} is no name; give names as text")
            return dict(zip(keys, listed(value.values(), len(value), depth + 1), strict=True))
        if isinstance(value, np.ndarray):
            counted(value.size)
            items = value if value.dtype.kind in "mMV" and value.ndim else value.tolist()  # times are no numbers
            return listed(items, len(items), depth + 1) if value.ndim else converted(items, depth + 1)
        if isinstance(value, range):
            return listed(value, left + 1 if value[left:] else len(value), depth + 1)  # len() has a limit of its own
        if isinstance(value, list | tuple):
            return listed(value, len(value), depth + 1)
        if isinstance(value, np.timedelta64):  # a whole number to NumPy and pydantic, in whatever unit
            raise InputError(f"{path}: {shown(value)} is of type timedelta64; give a plain number")
        for kind, own in _OWN_TYPES:
            if isinstance(value, kind):
                return own(value)
        return value

    return converted(value, 0)


_OWN_TYPES: Final[Sequence[tuple[type, Callable[[Any], object]]]] = (
    (bool, bool),
    (np.bool_, bool),
    (np.integer, int),
    (np.floating, float),
    (int, int.__int__),
    (float, float.__float__),
    (str, str.__str__),
)
"""Types of numbers, truth values and texts → what makes Python's own of them, past what a derived class overrides."""

_OWN_CONTAINERS: Final[Sequence[tuple[type, Callable[[Any], object]]]] = (
    (dict, lambda items: dict(dict.items(items))),
    (list, list.copy),
    (tuple, lambda items: tuple.__getitem__(items, slice(None))),
)
"""Likewise of lists and mappings."""


def checked_whole(value: object, path: str, least: int, most: int) -> int:
    """The value, if it is a whole number in [least, most].

    Raises:
        InputError: it is not; the message begins with `path`.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        limit = f"2**{most.bit_length()} - 1" if most > 2**64 else str(most)
        raise InputError(f"{path}: {shown(value)} is no whole number from {least} to {limit}; give one")
    return value


def checked_positive(value: object, path: str, kind: str = "number") -> float:
    """The value, if it is a positive finite number.

    Raises:
        InputError: it is not; the message begins with `path` and asks for a `kind`.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= sys.float_info.max:
        raise InputError(f"{path}: {shown(value)} is no positive {kind}; give one")
    return value


def checked_path(value: object, path: str) -> Path:
    """The value as a path, if a file system can have it.

    Raises:
        InputError: it is none; the message begins with `path`.
    """
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or re.search("[\0\ud800-\udc7f\udd00-\udfff]", text):
        raise InputError(f"{path}: {shown(value)} is no path; give one as text")
    return Path(str.__str__(text))


def suggestion(given: object, known: Iterable[str]) -> str:
    """The remedy for an unknown name: the closest known one, or all of them."""
    names = list(known)
    close = difflib.get_close_matches(as_word(given), names, n=1)
    return f"did you mean {close[0]}?" if close else f"give one of {choice(names)}"


def as_word(given: object) -> str:
    """What was given for a name, as a text of bounded length to compare with known names."""
    return given[:_LONGEST_VALUE] if isinstance(given, str) else shown(given)


def choice(names: Iterable[str]) -> str:
    """Names with commas between them, and dots for those that find no room in a message."""
    text = ", ".join(names)
    if len(text) <= _LONGEST_CHOICE:
        return text
    return text[: text.rindex(", ", 0, _LONGEST_CHOICE)] + ", ..."


def path_of(path: str, key: object) -> str:
    """Path of what stands behind a key of the mapping at `path`, for errors."""
    is_plain = isinstance(key, str) and len(key) <= _LONGEST_VALUE and key.isidentifier()
    return f"{path}.{key if is_plain else shown(key)}"


def printable(text: str) -> str:
    """A text fit for any terminal: every character that is not printable, such as ESC, is written as its escape."""
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() else each.encode("unicode_escape", "surrogatepass").decode("ascii") for each in text
    )


def one_line(text: str, kind: str = "") -> str:
    """A message as one printable line of at most `LONGEST_LINE` characters.

    What is too long lacks its end, and the middle of a path of more than `_LONGEST_PATH` characters at its beginning.

    Args:
        text: the message.
        kind: what stands before it, such as `error: `.
    """
    if len(text) > 10 * LONGEST_LINE:  # a short way for long texts, of which no more is shown
        text = text[: 5 * LONGEST_LINE] + text[-5 * LONGEST_LINE :]
    text, room = printable(" ".join(text.split())), LONGEST_LINE - len(kind)
    where, colon, rest = text.partition(": ")
    longest = max(_LONGEST_PATH, room - len(colon + rest))
    if len(text) > room and len(where) > longest:
        first = longest // 3
        text = f"{where[:first]}...{where[first + 3 - longest :]}{colon}{rest}"
    return kind + (text if len(text) <= room else f"{text[: room - 3]}...")


def short(number: float) -> str:
    """A number with at most six digits; `1e9`, not `1e+09`."""
    mantissa, e, exponent = f"{number:.6g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if e else mantissa


def shown(value: object) -> str:
    """A value as an error message shows it: one printable line of at most 60 characters.

    No more of the value is written out than is shown, so that large and nested ones cost nothing.
    """
    text = printable(" ".join(_written(value, 3).split()))
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."


def _written(value: object, depth: int) -> str:
    """The first characters, or a few more, of a value as Python writes it; `depth`: of the containers written out."""
    try:
        if isinstance(value, str):
            return repr(str.__str__(value)[: _LONGEST_VALUE + 1])
        if isinstance(value, bytes | bytearray):
            return repr(value[: _LONGEST_VALUE + 1])
        if isinstance(value, int) and value.bit_length() > _WRITTEN_BITS:
            return f"{'-' if value < 0 else ''}about 1e{int(value.bit_length() * math.log10(2))}"
        if isinstance(value, int | float):
            return str(value)
        if isinstance(value, np.ndarray) and (value.size > _WRITTEN_ITEMS or value.dtype == object):
            return f"array of shape {value.shape}"
        if isinstance(value, list | tuple | set | frozenset | dict):
            return _container(value, depth)
        return repr(value)[: 2 * _LONGEST_VALUE]
    except Exception:  # whatever an object of a foreign class raises when it is asked for its text
        return f"<{type(value).__name__}>"


_WRITTEN_BITS: Final = 10_000
"""Most bits of a whole number that is written out; Python refuses very long ones."""
_WRITTEN_ITEMS: Final = 20
"""Most items of a container that are written out; they fill the room for a value."""


def _container(value: Collection[object], depth: int) -> str:
    """The first items of a list, a tuple, a set or a mapping."""
    opening, closing = "[]" if isinstance(value, list) else "()" if isinstance(value, tuple) else "{}"
    if depth == 0:
        return f"{opening}...{closing}"
    items = itertools.islice(value, _WRITTEN_ITEMS)
    if isinstance(value, dict):
        texts = [f"{_written(key, depth - 1)}: {_written(value[key], depth - 1)}" for key in items]
    else:
        texts = [_written(item, depth - 1) for item in items]
    return opening + ", ".join(texts) + (", ..." if len(value) > _WRITTEN_ITEMS else "") + closing


def _described(error: ErrorDetails, model: type[BaseModel], path: str) -> str:
    """One line for one of pydantic's errors: the field's path, the problem and the remedy."""
    key = error.get("ctx", {}).get("field", error["loc"][0] if error["loc"] else "")
    name = as_word(key)
    where = path_of(path, key)
    if error["type"] in ("extra_forbidden", "invalid_key"):
        return f"{where}: unknown key; {suggestion(name, model.model_fields)}"
    if error["type"] == "refusal" or name not in model.model_fields:
        return f"{where}: {error['msg']}"
    return f"{where}: {_problem(error, model.model_fields[name], name)}"


_LIMITS: Final = {
    "greater_than": ("gt", "not greater than", "a greater value"),
    "greater_than_equal": ("ge", "less than", "{limit} or more"),
    "less_than": ("lt", "not less than", "a smaller value"),
    "less_than_equal": ("le", "greater than", "{limit} or less"),
}
"""Kind of pydantic's error → its key for the limit, how a value breaks it, and what to give."""


def _problem(error: ErrorDetails, field: FieldInfo, name: str) -> str:
    """What is wrong with the value of a known field, in the words of the field's own unit, and the remedy."""
    kind, given, value = error["type"], error["input"], shown(error["input"])
    unit = field_unit(field)
    in_unit = "" if unit == DIMENSIONLESS else f" {unit}"
    number = "whole number" if field.annotation is int else "plain number"
    number += f" in{in_unit}" if in_unit else ""
    if kind in _LIMITS:
        key, breach, remedy = _LIMITS[kind]
        limit = f"{error['ctx'][key]:.12g}"
        if kind == "greater_than" and limit == "0":
            remedy = f"a positive {name.rpartition('_')[2]}"
        return f"{value} is {breach} {limit}{in_unit}; give {remedy.format(limit=limit)}"
    match kind:
        case "missing":
            return f"missing; give a {number}"
        case "finite_number":
            return f"{value} is not finite; give a {number}"
        case "float_type" | "int_type":
            return _not_a_number(given, number, unit)
        case "literal_error":
            return f"{value} is unknown; {suggestion(given, get_args(field.annotation))}"
        case "bool_type":
            return f"{value} is not a truth value; give true or false"
        case "string_type":
            return f"{value} is not text; give a name"
        case _:
            return str(error["msg"])


_NUMBER_IN_TEXT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d_].*|[%°].*)?", re.DOTALL)


def _not_a_number(value: object, number: str, unit: str) -> str:
    """Why `value` is no number, and what to give; text such as "15 Hz" gets advice about units."""
    if value is None:
        return f"empty; give a {number}"
    if isinstance(value, str):
        match = _NUMBER_IN_TEXT.fullmatch(value) if len(value) <= _LONGEST_VALUE else None
        if match is None:
            return f"{shown(value)} is text; give a {number}"
        digits, written = match.groups()
        if written is None:
            return f"{shown(value)} is text; give a {number}, without quotes or leading zeros"
        if written.strip() == unit:
            return f"{shown(value)} has its unit written with it; give a {number}: {digits}"
        remedy = "give a plain number" if unit == DIMENSIONLESS else f"convert it and give a {number}"
        return f"{shown(value)} has a unit written with it; {remedy}"
    if isinstance(value, int) and not isinstance(value, bool):
        return f"{shown(value)} is too large; give a {number}"
    return f"{shown(value)} is of type {type(value).__name__}; give a {number}"
