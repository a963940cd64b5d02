"""Reads YAML files that may be untrusted, with limits on size and depth."""

import os
import re
import stat
from typing import Any, Final

import yaml

from warpchain.inputs.validation import DEEPEST, MOST_VALUES, InputError, checked_path, plain, shown

LARGEST_FILE: Final = 400_000
"""Most bytes of a YAML file."""


def read_yaml(path: str | os.PathLike[str]) -> object:
    """Content of a regular YAML file that is not too large, see `parse_yaml`; else an `InputError`."""
    path = checked_path(path, "file")
    try:
        found = os.stat(path)
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):  # others may never end
            raise InputError(f"{path}: not a regular file; use the path of a readable YAML file")
        with open(path, "rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; use the path of a readable YAML file") from None
    if len(content) > LARGEST_FILE:
        raise InputError(
            f"{path}: expected at most {LARGEST_FILE} bytes, got more; write numbers as ranges, or use several files"
        )
    try:
        return parse_yaml(content.decode("utf-8"), str(path))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: {error}; save it as UTF-8 text") from None


def parse_yaml(text: str, path: str) -> Any:
    """Content of a YAML text: texts, numbers, truth values, nothing, lists and mappings.

    Numbers are those of YAML 1.2: `1e9` is one and so is `1_000`; `060` and `1:30`, which versions of YAML read
    differently, are texts, and so are dates. An `InputError`, which begins with `path`, says that the text is not YAML,
    gives a key twice, or has more values than `plain` takes.
    """
    try:
        content = yaml.load(text, Loader=_Loader)
    except _TooManyValuesError:
        raise InputError(f"{path}: expected at most {MOST_VALUES} values, got more; use fewer") from None
    except yaml.MarkedYAMLError as error:
        line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise InputError(f"{path}{line}: {error.problem}; correct the YAML") from None
    except RecursionError:
        raise InputError(f"{path}: expected at most {DEEPEST} nested lists or mappings, got more; use fewer") from None
    except (yaml.YAMLError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # PyYAML's own errors, and those of what it calls for a tag such as !!int before a text that is no number
        raise InputError(f"{path}: {shown(str(error))[1:-1]}; correct the YAML") from None
    return plain(content, path)


class _TooManyValuesError(Exception):
    """A text has more values than `plain` takes."""


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader with the numbers of YAML 1.2; a repeated key is an error, and so are too many values."""

    values = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose a node, unless there were too many: reading all of them would take seconds."""
        self.values += 1
        if self.values > MOST_VALUES:
            raise _TooManyValuesError
        return super().compose_node(parent, index)

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Look for repeated keys; `<<`, which PyYAML merges here, is a key like any other."""
        seen = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                problem = f"{shown(key.value)} is given twice"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            seen.add(key.value)


_NUMBERS: Final = {
    "tag:yaml.org,2002:int": re.compile(r"[-+]?(?:0|[1-9][0-9_]*)$"),
    "tag:yaml.org,2002:float": re.compile(
        r"[-+]?(?:\.[0-9]+|[0-9]+\.[0-9]*)(?:[eE][-+]?[0-9]+)?$|[-+]?[0-9]+[eE][-+]?[0-9]+$|[-+]?\.inf$|\.nan$"
    ),
}
_REPLACED: Final = (*_NUMBERS, "tag:yaml.org,2002:timestamp", "tag:yaml.org,2002:merge")
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in _REPLACED]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in _NUMBERS.items():
    _Loader.add_implicit_resolver(_tag, _pattern, list("-+.0123456789"))
