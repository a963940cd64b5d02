"""What every check of a user's values shares: the error, bounds, and refusals in one line.

A refusal reads `path.of.field: what is wrong; what to do`. Models raise `refusal`, `validated` turns pydantic's errors
into such lines.
"""

import difflib
import math
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeVar, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticCustomError

STRICT: Final = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
"""Of models that hold a user's values."""

DIMENSIONLESS: Final = "1"


class InputError(ValueError):
    """Input that the user can correct; its text is `path.of.field: what is wrong; what to do`, in one line.

    A call that checks several values at once, `warpchain.sweep`, has a line for each.
    """


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
    return PydanticCustomError("refusal", message, {"field": field})


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
    try:
        return model.model_validate(plain(values))
    except ValidationError as error:
        first, *others = error.errors()
        count = f" (and {len(others)} more)" if others else ""
        raise InputError(_described(first, model, path) + count) from None


def plain(value: object) -> Any:
    """A user's value in Python's own types, as a YAML file gives it; what is none of these is left as it is.

    NumPy's numbers, truth values and texts become Python's; arrays, ranges and tuples become lists, also inside of
    lists and mappings.
    """
    if isinstance(value, Mapping):
        return {key: plain(content) for key, content in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple | range):
        return [plain(item) for item in value]
    for kind, own in ((np.bool_, bool), (np.integer, int), (np.floating, float), (np.str_, str)):
        if isinstance(value, kind):
            return own(value)
    return value


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


def suggestion(given: object, known: Iterable[str]) -> str:
    """The remedy for an unknown name: the closest known one, or all of them."""
    names = list(known)
    close = difflib.get_close_matches(str(given), names, n=1)
    return f"did you mean {close[0]}?" if close else f"give one of {', '.join(names)}"


def path_of(path: str, key: object) -> str:
    """Path of what stands behind a key of the mapping at `path`, for errors."""
    return f"{path}.{key if str(key).isidentifier() else shown(key)}"


def short(number: float) -> str:
    """A number with at most six digits; `1e9`, not `1e+09`."""
    mantissa, e, exponent = f"{number:.6g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if e else mantissa


def shown(value: object) -> str:
    """A value as an error message shows it: one line of at most 60 characters."""
    text = str(value) if isinstance(value, int | float) else repr(value)
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


def _described(error: ErrorDetails, model: type[BaseModel], path: str) -> str:
    """One line for one of pydantic's errors: the field's path, the problem and the remedy."""
    key = error.get("ctx", {}).get("field", error["loc"][0] if error["loc"] else "")
    name = str(key)
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
        match = _NUMBER_IN_TEXT.fullmatch(value)
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
