"""Shared parts of all input checks: `InputError`, fields with units, and refusals in one line.

A refusal reads `path.of.field: what is wrong; what to do`. Validators raise an `InputError` that begins with the name
of a field, or a `ValueError` about their own field; `refusals` makes lines of these and of pydantic's own errors.
"""

import difflib
import functools
import math
import reprlib
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Set, ValuesView
from pathlib import Path
from typing import Annotated, Any, Final, Self, TypeVar

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import to_jsonable_python

from warpchain.files import given_path

STRICT: Final = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
"""Of models that hold a user's values."""

DIMENSIONLESS: Final = "1"
_LIMITS: Final = ("ge", "gt", "le", "lt")

LONGEST_LINE: Final = 200
"""Most characters of a line of a message."""
LONGEST_NAME: Final = 255
"""Most characters of a name that a user gives to something; a folder's name has no more."""
_LONGEST_PATH: Final = 120
"""Most characters of a path with which a line begins that is too long; one can go to a path only if it is whole."""
_LONGEST_VALUE: Final = 60
"""Most characters of a value in a message."""
MOST_PROBLEMS: Final = 20
"""Most problems that are described, each in a line; the others are counted."""

T = TypeVar("T")

DEEPEST: Final = 20
"""Most lists and mappings inside of one another; a sweep file has eight at most."""
MOST_VALUES: Final = 100_000
"""Most values, keys and lists that are taken at once; each takes time and memory before it can be checked."""


class InputError(ValueError):
    """Input that the user can correct; its text is `path.of.field: what is wrong; what to do`, in one line.

    Several refused values of a sweep have a line each. A line has at most `LONGEST_LINE` characters, all of them
    printable, whatever was given.
    """

    def __init__(self, *problems: str) -> None:
        """Have a line for each problem."""
        super().__init__(*map(one_line, problems))

    def __str__(self) -> str:
        """All lines."""
        return "\n".join(self.args)


class UnknownNameError(InputError, KeyError):
    """A name that is not there, such as that of a column; its text says which one may be meant."""


class Named(dict[str, T]):
    """Values by their names; an unknown name is an `UnknownNameError`."""

    def __missing__(self, name: object) -> T:
        """Refuse the name."""
        raise UnknownNameError(f"{shown(name)}: unknown name; {suggestion(name, [*self])}")


class DamagedFileError(InputError):
    """A file that is not what warpchain wrote; its text is `path: what is wrong; what to do`, in one line."""


class ChangedFileError(DamagedFileError):
    """A file that is whole but that another program has changed since warpchain wrote it."""


class InputWarning(UserWarning):
    """Input that is possible but probably not meant; its text reads like that of an `InputError`."""


def number_field(default: Any, unit: str, description: str | None = None, **more: Any) -> Any:
    """A pydantic field that holds a number: its default, `...` for none, SI unit, `DIMENSIONLESS` if pure, and meaning.

    The description of a field of a section may stand below it. `more` are limits `ge`, `gt`, `le`, `lt`, as of
    `pydantic.Field`; anything else stands beside the unit.
    """
    limits = {name: more.pop(name) for name in _LIMITS if name in more}
    return Field(default, description=description, json_schema_extra={"unit": unit, **more}, **limits)


WHOLE: Final = BeforeValidator(lambda x: int(x) if isinstance(x, float) and x.is_integer() else x)
"""Of whole numbers: 60.0 is sixty."""
Whole = Annotated[int, WHOLE]


def field_unit(field: FieldInfo) -> str:
    """Unit of a field that `number_field` made; `DIMENSIONLESS` for any other."""
    extra = field.json_schema_extra
    return str(extra.get("unit", DIMENSIONLESS)) if isinstance(extra, dict) else DIMENSIONLESS


def field_limits(field: FieldInfo) -> dict[str, float]:
    """The limits `ge`, `gt`, `le`, `lt` that a field has."""
    return {name: float(getattr(limit, name)) for limit in field.metadata for name in _LIMITS if hasattr(limit, name)}


def field_bounds(field: FieldInfo) -> tuple[float, float]:
    """Least and greatest value that the limits of a field leave."""
    limits = field_limits(field)
    least = limits["ge"] if "ge" in limits else math.nextafter(limits.get("gt", -math.inf), math.inf)
    return least, limits["le"] if "le" in limits else math.nextafter(limits.get("lt", math.inf), -math.inf)


_FIELDS: Final[dict[str, FieldInfo]] = {}
_SECTION_OF: Final[dict[str, str]] = {}
_SYMBOL_OF: Final[dict[str, str]] = {}
_NAME_OF_SYMBOL: Final[dict[str, str]] = {}
"""What refusals know of the sections that are imported; `warpchain.inputs.fields` has all."""
NEW_NAMES: Final = {
    "further_hold": "extra_hold",
    "record_loads": "record_joint_forces",
    "stiff_joint_factor": "joint_friction_factor",
    "walk_until": "stop_time",
}
"""Names that values had in development versions → the names that replace them; the old ones are refused."""

_SPELLINGS: Final = str.maketrans(
    {"ℓ": "ell", "β": "beta", "μ": "mu", "\N{MICRO SIGN}": "mu", "ν": "nu", "τ": "tau", "ω": "omega"}
)


def spelled(symbol: str) -> str:
    """A symbol in ASCII, Greek letters by their names."""
    return symbol.translate(_SPELLINGS)


class Section(BaseModel):
    """A section of a user's values: parameters, scene or options; its fields have their names from then on."""

    model_config = STRICT | ConfigDict(use_attribute_docstrings=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Tell the names of the fields; those without a description have the text that stands below them."""
        for name, field in cls.model_fields.items():
            _FIELDS[name], _SECTION_OF[name] = field, cls.__name__.lower()
            field.description = " ".join((field.description or "").split())
            if isinstance(field.json_schema_extra, dict) and "symbol" in field.json_schema_extra:
                _SYMBOL_OF[name] = spelled(str(field.json_schema_extra["symbol"]))
                _NAME_OF_SYMBOL[_SYMBOL_OF[name]] = name

    def check_together(self) -> None:
        """Raise an `InputError` if fields contradict one another."""

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        self.check_together()
        return self


def full_name(written: Any) -> Any:
    """Name of the field that is written as its name or symbol, `mu_fc` or μ_fc; anything else stays as it is."""
    return _NAME_OF_SYMBOL.get(spelled(written), written) if isinstance(written, str) else written


def by_name(values: Mapping[Any, T], path: str = "") -> dict[Any, T]:
    """Values by the full names of their fields, unchecked; an `InputError` if one is given twice."""
    named: dict[Any, T] = {}
    for written, value in values.items():
        name = full_name(written)
        if name in named:
            raise InputError(f"{path_of(path, name)}: given twice, also as {shown(_SYMBOL_OF[name])}; remove one")
        named[name] = value
    return named


def suggested_name(written: object, keys: Iterable[str] = ()) -> str:
    """The remedy for an unknown name of a field, or for one of these keys, or for a field in a wrong place."""
    if written in _SECTION_OF:
        return f"move it to {_SECTION_OF[str(written)]}"
    stem = f"{spelled(written)}_" if isinstance(written, str) else ""
    if family := [symbol for symbol in _NAME_OF_SYMBOL if stem and symbol.startswith(stem)]:  # mu: of which pair?
        return f"did you mean {' or '.join(filter(None, (', '.join(family[:-1]), family[-1])))}?"
    fields = {name: f"{section}.{name}" for name, section in _SECTION_OF.items()}
    symbols = {symbol: f"{_SECTION_OF[name]}.{symbol}" for symbol, name in _NAME_OF_SYMBOL.items()}
    return suggestion(written, {key: key for key in keys} | fields | symbols)


ModelT = TypeVar("ModelT", bound=BaseModel)
SectionT = TypeVar("SectionT", bound=Section)


def validated(model: type[ModelT], values: Mapping[str, object], path: str) -> ModelT:
    """Build a pydantic model, with errors as one line that names the field and what to give.

    NumPy's numbers are taken as `plain` does. If a value is refused, an `InputError` describes the first and counts
    the others; it begins with `path`, where they were given, such as `scene`.
    """
    own = _OWN.issuperset(map(type, values.values()))
    try:
        return model.model_validate(values if own else plain(values, path))
    except ValidationError as error:
        others = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
        raise InputError(refusals(error, path)[0] + others) from None


def with_numbers(model: SectionT, numbers: Mapping[str, float], path: str) -> SectionT:
    """A model with other numbers, which every walk of a sweep has, in fields of floats; errors as of `validated`."""
    changed = model.model_copy(update=numbers)
    for name, number in numbers.items():
        least, most = _bounds_of(name)
        if not least <= number <= most:
            return validated(type(model), vars(changed), path)
    try:
        changed.check_together()
    except InputError:
        return validated(type(model), vars(changed), path)
    return changed


_bounds_of = functools.cache(lambda name: field_bounds(_FIELDS[name]))
_OWN: Final = frozenset((float, int, str, bool, type(None)))


def refusals(error: ValidationError, path: str, keys: Iterable[str] = (), unit: str = DIMENSIONLESS) -> list[str]:
    """A line for each of pydantic's errors, `MOST_PROBLEMS` at most: the field's path, the problem, and what was given.

    `path` is that of the value that was validated. By an unknown name one of the `keys` may be meant, beside fields;
    `unit` is that of what is no field.
    """
    lines = []
    for problem in error.errors(include_url=False)[:MOST_PROBLEMS]:
        where, cause = path, problem.get("ctx", {}).get("error")
        for part in problem["loc"]:
            if not (isinstance(part, str) and part.startswith(("(", "["))):  # the branch of a union, "[key]" of a key
                where = path_of(where, part)
        if isinstance(cause, InputError):
            lines.append(f"{where}.{cause}".removeprefix("."))
        elif problem["type"] == "extra_forbidden":
            unknown = "not possible here" if problem["loc"][-1] in _SECTION_OF else "unknown name"
            lines.append(f"{where}: {unknown}; {suggested_name(problem['loc'][-1], keys)}")
        elif problem["type"] == "model_type":
            lines.append(f"{where}: expected names with values, got {shown(problem['input'])}; use a mapping")
        elif cause is not None or problem["type"] == "missing":
            lines.append(f"{where}: {cause or 'missing; set a value'}")
        else:
            its_unit = next((field_unit(_FIELDS[name]) for name in problem["loc"] if name in _FIELDS), unit)
            got = problem.get("ctx", {}).get("actual_length") or shown(problem["input"])
            lines.append(f"{where}: expected {_expected(problem, its_unit)}, got {got}")
    if error.error_count() > len(lines):
        lines.append(f"{error.error_count() - len(lines)} more problems; correct these first")
    return lines


_BOUNDS: Final = {
    "greater_than_equal": ("at least", "ge"),
    "greater_than": ("more than", "gt"),
    "less_than_equal": ("at most", "le"),
    "less_than": ("less than", "lt"),
}
_FORMS: Final = {
    "string_pattern_mismatch": "text of the form {pattern}",
    "string_too_long": "at most {max_length} characters",
    "string_too_short": "at least {min_length} characters",
    "too_long": "at most {max_length} values",
    "too_short": "at least {min_length} values",
}
_KINDS: Final = {
    "bool_type": "true or false",
    "dict_type": "a mapping",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_from_float": "an integer",
    "int_type": "an integer",
    "list_type": "a list",
    "string_type": "text",
    "tuple_type": "a list",
}
"""Types of pydantic's errors → what was expected."""


def _expected(problem: Mapping[str, Any], unit: str) -> str:
    """What one of pydantic's errors expected in place of the value, in the unit of the field."""
    kind, context = problem["type"], problem.get("ctx", {})
    if kind in _BOUNDS:
        words, limit = _BOUNDS[kind]
        return f"{words} {short(context[limit])}" + (f" {unit}" if unit != DIMENSIONLESS else "")
    if kind in _FORMS:
        return _FORMS[kind].format(**context)
    text = _KINDS.get(kind) or str(problem["msg"]).removeprefix("Input should be ").replace("an instance of", "a")
    return text + (f" in {unit}" if unit != DIMENSIONLESS else "")


def plain(value: object, path: str = "value") -> Any:
    """A user's value in Python's own types, as a YAML file gives it; what is none of these is left as it is.

    NumPy's numbers, truth values and texts become Python's; arrays, ranges, tuples and what pandas and xarray have for
    them become lists, tables mappings of lists, also inside of lists and mappings. NumPy's times become texts, which no
    number can be. An `InputError`, which begins with the path of a value, says that there are more than `MOST_VALUES`
    of them, or deeper than `DEEPEST`; that values are masked; or that a set, an iterator or a view stands for a list.
    """
    left = MOST_VALUES

    def converted(value: Any, depth: int, keys: tuple[object, ...] = ()) -> Any:
        nonlocal left
        left -= 1
        if left < 0:
            raise InputError(f"{path}: expected at most {MOST_VALUES} values, got more; use fewer")
        if type(value) in _OWN:
            return value
        if hasattr(value, "to_dict") and hasattr(value, "columns"):
            value = value.to_dict("list")
        elif hasattr(value, "to_numpy"):
            value = value.to_numpy()
        if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
            raise InputError(f"{functools.reduce(path_of, keys, path)}: {MASKED}")
        if isinstance(value, Set | Iterator | ValuesView | memoryview):
            where, kind = functools.reduce(path_of, keys, path), type(value).__name__
            raise InputError(f"{where}: expected a list, got a {kind}, whose order or content is not fixed; use a list")
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value[()]
        if isinstance(value, np.generic):
            kind = value.dtype.kind
            return float(value) if kind == "f" else value.item() if kind in "biucSU" else str(value)
        if not isinstance(value, Mapping | np.ndarray | list | tuple | range):
            return value
        if depth == DEEPEST:
            raise InputError(f"{path}: expected at most {DEEPEST} nested lists or mappings, got more; use fewer")
        if isinstance(value, Mapping):
            return {key: converted(item, depth + 1, (*keys, key)) for key, item in value.items()}
        return [converted(item, depth + 1, keys) for item in value]

    return converted(value, 0)


MASKED: Final = "expected numbers, got masked values; use an array without a mask"


def is_masked(value: object, depth: int = 3) -> bool:
    """Whether a value, or one inside of its lists as deep as arrays go, is an array of NumPy with masked elements."""
    if isinstance(value, list | tuple):
        return depth > 0 and any(is_masked(item, depth - 1) for item in value)
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.is_masked(value))


_adapter = functools.lru_cache(lambda kind: TypeAdapter(kind, config=ConfigDict(strict=True, allow_inf_nan=False)))


def checked(value: object, path: str, kind: Any, unit: str = DIMENSIONLESS) -> Any:
    """A value that is no field, such as an argument of a function, in Python's own types; else an `InputError`.

    `kind` is an annotation that pydantic can check, such as `bool` or `Annotated[float, Field(gt=0)]`; `path`, the name
    of the value, and the unit of a number are for errors.
    """
    try:
        return _adapter(kind).validate_python(plain(value, path))
    except ValidationError as error:
        raise InputError(refusals(error, path, unit=unit)[0]) from None


def checked_path(value: object, path: str) -> Path:
    """The value as a path, if a file system can have it; else an `InputError` that begins with `path`."""
    try:
        return given_path(value)  # type: ignore[arg-type]
    except (OSError, TypeError):
        raise InputError(f"{path}: expected a path, got {shown(value)}; pass it as text") from None


def suggestion(given: object, known: Mapping[str, str] | Iterable[str]) -> str:
    """The remedy for an unknown name: the closest of the known, or as many as find room, shown as a mapping says."""
    names = known if isinstance(known, Mapping) else {name: name for name in known if name != given}
    if isinstance(given, str) and given in NEW_NAMES:
        return f"use {NEW_NAMES[given]}, its new name"
    close = difflib.get_close_matches(str(given)[:_LONGEST_VALUE], names, n=1) if isinstance(given, str) else []
    if close:
        return f"did you mean {names[close[0]]}?"
    if not names:
        return "none is possible; remove it"
    return f"use one of {textwrap.shorten(', '.join(names.values()), 125, placeholder=' ...')}"


def path_of(path: str, key: object) -> str:
    """Path of what stands behind a key of the mapping, or at a place of the list, at `path`, for errors."""
    if isinstance(key, int):
        return f"{path}[{key}]"
    is_plain = isinstance(key, str) and len(key) <= _LONGEST_VALUE and key.isidentifier()
    return f"{path}.{key if is_plain else shown(key)}".removeprefix(".")


def printable(text: str) -> str:
    """A text fit for any terminal: every character that is not printable, such as ESC, is written as its escape."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in text)


def one_line(text: str, kind: str = "") -> str:
    """A message as one printable line of at most `LONGEST_LINE` characters, behind its kind, such as `error: `.

    What is too long lacks its end, and the middle of a path of more than `_LONGEST_PATH` characters at its beginning.
    """
    ends = text if len(text) < 10 * LONGEST_LINE else text[: 5 * LONGEST_LINE] + text[-5 * LONGEST_LINE :]
    text, room = printable(" ".join(ends.split())), LONGEST_LINE - len(kind)
    where, colon, rest = text.partition(": ")
    longest = max(_LONGEST_PATH, room - len(colon + rest))
    if len(text) > room and len(where) > longest:
        text = f"{where[: longest // 3]}...{where[longest // 3 + 3 - longest :]}{colon}{rest}"
    return kind + (text if len(text) <= room else f"{text[: room - 3]}...")


def json_value(value: Any) -> Any:
    """A value with arrays in it as JSON has it; a number that is not finite is null."""
    return to_jsonable_python(value, inf_nan_mode="null", fallback=lambda array: array.tolist())


def short(number: float, digits: int = 6) -> str:
    """A number rounded to some significant digits; `1e9`, not `1e+09`."""
    mantissa, e, exponent = f"{float(f'{number:.{digits}g}'):.{max(digits, 6)}g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if e else mantissa


def shown(value: object) -> str:
    """A value as an error message shows it: one printable line of at most 60 characters.

    No more of the value is written out than is shown, so that large and nested ones cost nothing.
    """
    text = printable(" ".join(_BRIEF.repr(value).split()))
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."


class _Brief(reprlib.Repr):
    """The first characters of a value as Python writes it."""

    def repr_int(self, value: int, level: int) -> str:
        """A whole number; Python refuses to write very long ones."""
        return str(value) if value.bit_length() < 1000 else f"a whole number of {value.bit_length()} bits"


_BRIEF: Final = _Brief()
_BRIEF.maxlevel, _BRIEF.maxstring, _BRIEF.maxother = 3, _LONGEST_VALUE, 2 * _LONGEST_VALUE
_BRIEF.maxlist = _BRIEF.maxtuple = _BRIEF.maxdict = 20
