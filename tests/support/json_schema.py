"""A validator for the JSON schema keywords that this project's schema uses; any other keyword is an error."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

TYPES = {"object": Mapping, "array": list, "string": str, "number": (int, float), "integer": int, "null": type(None)}
NOTES = {"$schema", "title", "description", "default", "definitions"}


def problems(value: Any, schema: Mapping[str, Any], root: Mapping[str, Any], path: str = "$") -> Iterator[str]:
    """What a schema refuses in a value: paths and keywords."""
    for keyword, given in schema.items():
        if keyword == "$ref":
            target: Any = root
            for part in given.removeprefix("#/").split("/"):
                target = target[part]
            yield from problems(value, target, root, path)
        elif keyword == "properties":
            for name in given.keys() & (value.keys() if isinstance(value, Mapping) else ()):
                yield from problems(value[name], given[name], root, f"{path}.{name}")
        elif keyword == "items":
            for number, item in enumerate(value if isinstance(value, list) else ()):
                yield from problems(item, given, root, f"{path}[{number}]")
        elif keyword not in NOTES and not _holds(keyword, given, value, schema, root):
            yield f"{path}: {keyword}"


def _holds(keyword: str, given: Any, value: Any, schema: Mapping[str, Any], root: Mapping[str, Any]) -> bool:
    """Whether a value fulfils one keyword; one that is about another type holds."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    match keyword:
        case "type":
            return any(_is_of(value, name) for name in ([given] if isinstance(given, str) else given))
        case "enum":
            return value in given
        case "const":
            return value == given and isinstance(value, bool) == isinstance(given, bool)
        case "anyOf" | "oneOf":
            fitting = sum(not any(problems(value, each, root)) for each in given)
            return fitting == 1 if keyword == "oneOf" else fitting > 0
        case "not":
            return any(problems(value, given, root))
        case "required":
            return not isinstance(value, Mapping) or set(given) <= value.keys()
        case "additionalProperties":
            assert given is False
            return not isinstance(value, Mapping) or value.keys() <= schema["properties"].keys()
        case "minItems" | "maxItems":
            return not isinstance(value, list) or (
                len(value) >= given if keyword == "minItems" else len(value) <= given
            )
        case "minLength":
            return not isinstance(value, str) or len(value) >= given
        case "pattern":
            return not isinstance(value, str) or re.search(given, value) is not None
        case "minimum" | "maximum":
            return not is_number or (value >= given if keyword == "minimum" else value <= given)
        case "exclusiveMinimum" | "exclusiveMaximum":
            return not is_number or (value > given if keyword == "exclusiveMinimum" else value < given)
    raise AssertionError(f"unknown keyword {keyword}")


def _is_of(value: Any, name: str) -> bool:
    if name == "boolean" or isinstance(value, bool):
        return name == "boolean" and isinstance(value, bool)
    return isinstance(value, TYPES[name])
