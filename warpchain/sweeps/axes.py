"""Values of an axis in a sweep file: a list, a range that is written out, or names with values that are lists."""

from collections import Counter
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Annotated, Any, Final

from pydantic import BaseModel, BeforeValidator, Field, ValidationError, ValidationInfo, WrapValidator

from warpchain.inputs.scene import COMPOUND
from warpchain.inputs.validation import FIELDS, LONGEST_NAME, MOST_VALUES, STRICT, InputError, checked, refusals, shown

AXIS_LIMIT: Final = 10_000
"""Most values of one axis."""
CELL_LIMIT: Final = 100_000
"""Most cells of a sweep, because each is checked when the sweep is loaded."""
Name = Annotated[str, Field(pattern="^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=LONGEST_NAME)]
"""Of a block, or of a value on an axis."""


class _Range(BaseModel):
    """Values from one to another, both included, in steps or of a number."""

    model_config = STRICT
    first: float = Field(alias="from")
    last: float = Field(alias="to")
    step: float | None = Field(None, gt=0)
    count: int | None = Field(None, ge=2, le=AXIS_LIMIT)

    def values(self) -> list[int | float]:
        """All values, computed in decimals, so that three steps of 0.1 from 0 lead to 0.3 and to no other number."""
        first, last = Decimal(str(self.first)), Decimal(str(self.last))
        if first >= last:
            raise InputError(f"to: {self.last} is not greater than from: {self.first}; give a greater value")
        if (self.step is None) == (self.count is None):
            raise InputError("step: a range needs either step or count; give one of them")
        step = (last - first) / (self.count - 1) if self.count else Decimal(str(self.step))
        if (last - first) / step >= AXIS_LIMIT:
            raise InputError(f"step: gives more than {AXIS_LIMIT} values; give a larger step")
        intervals = int((last - first) / step) if self.count is None else self.count - 1
        below = first + intervals * step
        if self.count is None and below != last:
            raise InputError(f"to: steps of {step} from {first} miss {last}; give {below}, {below + step} or a count")
        values = [first + number * step for number in range(intervals)] + [last]
        return [int(value) if value == int(value) and abs(value) < 2**53 else float(value) for value in values]


def _expanded(values: Any, check: Callable[[Any], list[Any]], info: ValidationInfo) -> list[Any]:
    """The values of an axis, those of a range written out; together no more than sweeps of `CELL_LIMIT` cells have."""
    if isinstance(values, Mapping):
        if info.context["expanded"] > CELL_LIMIT + MOST_VALUES:  # type: ignore[index]
            raise ValueError(f"more than {CELL_LIMIT} values in the ranges of all axes; give fewer")
        try:
            values = _Range.model_validate(values).values()
        except ValidationError as error:
            raise InputError(refusals(error, "", ("from", *_Range.model_fields))[0]) from None
        info.context["expanded"] += len(values)  # type: ignore[index]
    checked = check(values)
    value, count = Counter(checked).most_common(1)[0]
    if count > 1:
        raise ValueError(f"{shown(value)} is given twice; leave one out")
    return checked


def list_of(kind: Any) -> Any:
    """Annotation of a list of values."""
    return Annotated[list[kind], Field(min_length=1, max_length=AXIS_LIMIT)]


def axis(kind: Any) -> Any:
    """Annotation of the values of an axis, a list or a range."""
    return Annotated[list_of(kind), WrapValidator(_expanded, json_schema_input_type=list_of(kind) | _Range)]


def _with_names(values: Any) -> Any:
    if not isinstance(values, Mapping):
        raise ValueError("no names; give each value one, as in floor: {flat: flat, ramp: [[0, 0], [1, 0.1]]}")
    return values


def named_axis(kind: Any) -> Any:
    """Annotation of the values of an axis whose values may be lists: name → value."""
    named = Annotated[dict[Name, kind], Field(min_length=1, max_length=AXIS_LIMIT)]
    return Annotated[named, BeforeValidator(_with_names, json_schema_input_type=named)]


def is_axis(name: str, given: object) -> bool:
    """Whether a list or mapping that is given for a field by its name is an axis, and no value of the field."""

    def is_value(value: object) -> bool:
        try:
            checked(value, name, Annotated[FIELDS[name].annotation, Field(), *FIELDS[name].metadata])
        except InputError:
            return False
        return True

    if isinstance(given, list) and name in COMPOUND:  # of values without names, which an axis refuses
        return not is_value(given) and bool(given) and all(map(is_value, given))
    return isinstance(given, list) or (isinstance(given, dict) and not is_value(given))
