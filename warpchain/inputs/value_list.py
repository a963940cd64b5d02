"""All values that a user may give, with what is known of each."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.sections import SECTIONS, SYMBOL_OF
from warpchain.inputs.validation import field_limits, field_unit


@dataclass(frozen=True)
class ValueEntry:
    """What is known of one value.

    Attributes:
        name: its name.
        symbol: the paper's symbol in ASCII, which may stand for the name; None if it has none.
        unit: SI unit, "1" for pure numbers and for what is no number.
        value: what holds when nothing is given; None where a rule decides, which `meaning` tells.
        sigma: standard deviation in Table 1, in `unit`; None if the table gives none.
        limits: `ge`, `gt`, `le`, `lt` → limit, in `unit`.
        choices: the possible values, if these are words or truth values, else empty.
        source: where the value is from.
        meaning: one line.
    """

    name: str
    symbol: str | None
    unit: str
    value: Any
    sigma: float | None
    limits: Mapping[str, float]
    choices: tuple[Any, ...]
    source: str
    meaning: str


def list_values(preset_name: str) -> dict[str, list[ValueEntry]]:
    """Entries of all fields by section, parameters first.

    Args:
        preset_name: the preset that parameters have their values from.

    Raises:
        InputError: there is no such preset.
    """
    parameters = preset(preset_name)
    # A word for the method stands for settings of other options, which are listed as they come out.
    options = Options().model_dump() | {"method": Options.model_fields["method"].default}
    values = {"parameters": parameters.model_dump(), "scene": dict(Scene()), "options": options}
    return {section: list(_entries(section, values[section], preset_name)) for section in values}


def _entries(section: str, values: Mapping[str, Any], preset_name: str) -> Iterator[ValueEntry]:
    quantities = Parameters.quantities()
    for name, field in SECTIONS[section].model_fields.items():
        extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        words: Any = extra.get("enum", [word for word in get_args(field.annotation) if isinstance(word, str)])
        sigma, source, quantity = None, "chosen here", quantities.get(name)
        if quantity is not None:
            sigma = quantity.sigma or None
            if quantity.value != values[name]:
                source = f"preset {preset_name}"
            elif quantity.source != "assumed":
                source = f"Table 1, {quantity.source}"
        yield ValueEntry(
            name=name,
            symbol=SYMBOL_OF.get(name),
            unit=field_unit(field),
            value=values[name],
            sigma=sigma,
            limits=field_limits(field),
            choices=(True, False) if field.annotation is bool else tuple(words),
            source=source,
            meaning=str(field.description),
        )
