"""A JSON schema of sweep files, with which editors check and complete them.

Fields of sections come from their models; the keys around them follow `warpchain.sweeps.sweep_file`. What only whole
cells can tell, such as a chain too short for its sprocket, is left to `warpchain.sweeps.plan.load_sweep`.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from pydantic.fields import FieldInfo

from warpchain.inputs.distributions import DRAWABLE, LARGEST_SEED, TABLE
from warpchain.inputs.parameters import PRESETS
from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF, SECTIONS, SYMBOL_OF
from warpchain.inputs.validation import DIMENSIONLESS, field_unit
from warpchain.inputs.value_list import field_choices
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.sizes import AXIS_LIMIT
from warpchain.sweeps.sweep_file import VERSION

Schema = dict[str, Any]

_KEYWORDS: Final = ("type", "anyOf", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum")
"""What is taken over from pydantic's schema of a field. Defaults are not: some depend on the method."""

_POSITIVE: Final[Schema] = {"type": "number", "exclusiveMinimum": 0}
_COUNT: Final[Schema] = {"type": "integer", "minimum": 1, "maximum": 2**30}


def sweep_schema() -> Schema:
    """The schema, draft 07, as JSON-able content."""
    outer: dict[str, Schema] = {
        "version": {"const": VERSION, "description": "of the file format"},
        "name": {"type": "string", "minLength": 1, "description": "name of the sweep"},
        "seed": {"type": "integer", "minimum": 0, "maximum": LARGEST_SEED, "description": "of all random numbers"},
        "same_samples_along": {
            "type": "array",
            "items": _enumerated(("preset", *SECTION_OF, *NAME_OF_SYMBOL)),
            "description": "axes along which the same samples are drawn",
        },
        "record": {
            **_object({"series": _kept("series"), "frames": _kept("frames", before=_POSITIVE)}),
            "description": "motion that is kept beside the table of results",
        },
        "blocks": {
            **_listed({"$ref": "#/definitions/block"}),
            "description": "several grids in one sweep; a block takes from the top level what it does not give",
        },
    }
    inner: dict[str, Schema] = {
        "preset": {"$ref": "#/definitions/preset"},
        "samples": {**_COUNT, "description": "samples in each cell of the grid"},
        "sampler": {**_enumerated(SAMPLERS), "default": "random", "description": "how samples spread"},
        **{section: {"$ref": f"#/definitions/{section}"} for section in SECTIONS},
        "distributions": {"$ref": "#/definitions/distributions"},
        "grid": {"$ref": "#/definitions/grid"},
    }
    fields = {
        name: _field(name, field, model.model_json_schema()["properties"][name])
        for model in SECTIONS.values()
        for name, field in model.model_fields.items()
    }
    preset = {**_enumerated(PRESETS), "description": "parameters to start from"}
    block_name = {"type": "string", "pattern": "^[A-Za-z0-9][A-Za-z0-9_-]*$", "description": "name of the block"}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "warpchain sweep",
        **_object({**outer, **inner}, required=("version", "name", "seed"), nullable=False),
        "not": {"required": ["blocks", "grid"]},
        "definitions": {
            "block": _object({"name": block_name, **inner}, required=("name",), nullable=False),
            "preset": preset,
            "fields": fields,
            **{section: _object(_named(model.model_fields, section, _value)) for section, model in SECTIONS.items()},
            "distributions": _object(
                {"all": _enumerated(("table", "fixed")), **_named(DRAWABLE, "distributions", _distribution)}
            ),
            "grid": {
                **_object({"preset": _listed({"$ref": "#/definitions/preset"}), **_named(SECTION_OF, "grid", _axis)}),
                "description": "axes; their values are exact unless distributions name the quantity",
            },
        },
    }


def _field(name: str, field: FieldInfo, generated: Mapping[str, Any]) -> Schema:
    """Schema of one field: what pydantic says, its choices, and its unit and symbol in words."""
    schema = {key: generated[key] for key in _KEYWORDS if key in generated}
    choices = field_choices(name, field)
    if choices and field.annotation is not bool:
        schema |= _enumerated(choices)
    description = str(field.description)
    if field_unit(field) != DIMENSIONLESS:
        description += f"; in {field_unit(field)}"
    if name in SYMBOL_OF:
        description += f"; symbol {SYMBOL_OF[name]}"
    return {**schema, "description": description}


def _value(name: str) -> Schema:
    return {"$ref": f"#/definitions/fields/{name}"}


def _axis(name: str) -> Schema:
    """Values of an axis: a list, of numbers also a range."""
    field = SECTIONS[SECTION_OF[name]].model_fields[name]
    values = _listed(_value(name))
    if field.annotation not in (int, float):
        return values
    ends = {"from": _value(name), "to": _value(name)}
    steps: dict[str, Schema] = {"step": _POSITIVE, "count": {"type": "integer", "minimum": 2, "maximum": AXIS_LIMIT}}
    span = _object({**ends, **steps}, required=("from", "to"), nullable=False)
    return {"anyOf": [values, {**span, "oneOf": [{"required": ["step"]}, {"required": ["count"]}]}]}


def _distribution(name: str) -> Schema:
    """What a sample may draw of a quantity."""
    ends: Schema = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
    gaussian = _object({"mean": _value(name), "sigma": _POSITIVE}, required=("sigma",), nullable=False)
    forms = {"uniform": ends, "gaussian": gaussian}
    given = [_object({key: form}, required=(key,), nullable=False) for key, form in forms.items()]
    return {"anyOf": [_enumerated(("table", "fixed") if name in TABLE else ("fixed",)), *given]}


def _kept(what: str, **more: Schema) -> Schema:
    """Whether, of which samples and how often something is kept."""
    sample = {"type": "integer", "minimum": 0, "maximum": 2**30}
    keys: dict[str, Schema] = {"interval": _POSITIVE, "samples": {"anyOf": [{"const": "all"}, _listed(sample)]}, **more}
    return {"anyOf": [{"type": "boolean"}, _object(keys, nullable=False)], "description": f"{what} of samples"}


def _named(names: Iterable[str], where: str, schema: Callable[[str], Schema]) -> dict[str, Schema]:
    """Schema of each name in a definition, to which that of its symbol refers."""
    by_name = {name: schema(name) for name in names}
    symbols = {SYMBOL_OF[name]: name for name in by_name if name in SYMBOL_OF}
    return by_name | {symbol: {"$ref": f"#/definitions/{where}/properties/{name}"} for symbol, name in symbols.items()}


def _enumerated(words: Iterable[Any]) -> Schema:
    return {"enum": list(words)}


def _listed(item: Schema) -> Schema:
    return {"type": "array", "items": item, "minItems": 1, "maxItems": AXIS_LIMIT}


def _object(properties: Mapping[str, Schema], *, required: Iterable[str] = (), nullable: bool = True) -> Schema:
    """A mapping with known keys; one that may have nothing behind it is nullable."""
    kind = ["object", "null"] if nullable else "object"
    needed = {"required": list(required)} if required else {}
    return {"type": kind, "properties": dict(properties), "additionalProperties": False, **needed}
