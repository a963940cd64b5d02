"""Reading YAML files, strictly."""

import os
import re
import stat
from collections.abc import Hashable
from typing import Any, Final

import yaml

from warpchain.inputs.validation import DEEPEST, MOST_VALUES, InputError, checked_path, shown

LARGEST_FILE: Final = 1_000_000
"""Most bytes of a YAML file."""
_MOST_DIGITS: Final = 400
"""Most digits of a whole number; the greatest number of a computer has 309."""


def read_yaml(path: str | os.PathLike[str]) -> object:
    """Content of a YAML file, with the numbers of :class:`Loader`.

    Raises:
        InputError: the file cannot be read, is no regular file or too large, is not YAML, gives a key twice, or has
            more values than `Loader` takes.
    """
    path = checked_path(path, "file")
    try:
        found = os.stat(path)
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):  # others may never end
            raise InputError(f"{path}: no regular file; give the path of a readable YAML file")
        with open(path, "rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; give the path of a readable YAML file") from None
    if len(content) > LARGEST_FILE:
        raise InputError(f"{path}: more than {LARGEST_FILE} bytes; write numbers as ranges, or give several files")
    try:
        return parse_yaml(content.decode("utf-8"))
    except yaml.MarkedYAMLError as error:
        line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        problem = ", ".join(filter(None, (error.context, error.problem)))
        raise InputError(f"{path}{line}: {problem}; correct the YAML") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}; correct the YAML") from None


def parse_yaml(text: str) -> Any:
    """Content of a YAML text, with the numbers of :class:`Loader`.

    Raises:
        yaml.YAMLError: the text is not YAML, gives a key twice, or has more values than `Loader` takes.
    """
    try:
        return yaml.load(text, Loader=Loader)
    except yaml.reader.ReaderError as error:
        raise yaml.YAMLError(f"the character at place {error.position + 1} is not allowed") from None
    except (ValueError, OverflowError):
        raise yaml.YAMLError("an escape or a version stands for no character or number") from None


class Loader(yaml.SafeLoader):
    """PyYAML's safe loader, but a repeated key is an error and a number means what it looks like.

    Values are texts, numbers, truth values, nothing, lists and mappings: dates are texts, and there is no tag for
    anything else. There are at most `MOST_VALUES` of them, each counted as often as aliases (`*name`) repeat it, and
    not more than `DEEPEST` inside of one another.
    """

    def __init__(self, text: str) -> None:
        """Begin to read a text."""
        super().__init__(text)
        self._depth = self._count = 0
        self._counts: dict[int, int] = {}  # by the `id` of each node; all are kept until the text is read

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """The next value, counted before anything is made of it."""
        start, mark = self._count, self.peek_event().start_mark  # type: ignore[no-untyped-call]
        is_alias = self.check_event(yaml.AliasEvent)
        self._depth += 1
        if self._depth > DEEPEST:
            raise _refused(f"more than {DEEPEST} lists or mappings inside of one another", mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if is_alias and id(node) not in self._counts:
            raise _refused("an alias stands for a value that contains it", mark)
        self._count += self._counts[id(node)] if is_alias else 1
        if self._count > MOST_VALUES:
            raise _refused(f"more than {MOST_VALUES} values, with those that aliases repeat", mark)
        if not is_alias:
            self._counts[id(node)] = self._count - start
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Mapping of a node; PyYAML itself lets the last of several equal keys win."""
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if isinstance(key, yaml.ScalarNode):
                if (key.tag, key.value) in seen:
                    raise _refused(f"key {shown(key.value)} is given twice", key.start_mark)
                seen.add((key.tag, key.value))
        return super().construct_mapping(node, deep)

    def construct_number(self, node: yaml.ScalarNode) -> object:
        """Number of a node, which may have a tag that says so."""
        text = self.construct_scalar(node)
        is_whole = node.tag == _INT
        if not (_INTEGER.match(text) or (not is_whole and _FLOAT.match(text))) or (
            is_whole and len(text) > _MOST_DIGITS
        ):
            raise _refused(f"{shown(text)} is no number that can be read", node.start_mark)
        return self.construct_yaml_int(node) if is_whole else self.construct_yaml_float(node)

    def construct_truth(self, node: yaml.ScalarNode) -> object:
        """Truth value of a node, which may have a tag that says so."""
        if self.construct_scalar(node).lower() not in self.bool_values:
            raise _refused(f"{shown(node.value)} is no truth value", node.start_mark)
        return self.construct_yaml_bool(node)


def _refused(problem: str, mark: yaml.Mark) -> yaml.MarkedYAMLError:
    return yaml.constructor.ConstructorError(None, None, problem, mark)


# YAML 1.1, PyYAML's dialect, reads 060 as 48 and 1:30 as 90, and takes 1e9 for text.
_INTEGER: Final = re.compile(r"[-+]?(?:0|[1-9][0-9_]*)$")
_FLOAT: Final = re.compile(
    r"""[-+]?(?:\.[0-9]+|[0-9]+\.[0-9]*)(?:[eE][-+]?[0-9]+)?$
      | [-+]?[0-9]+[eE][-+]?[0-9]+$
      | [-+]?\.(?:inf|Inf|INF)$
      | \.(?:nan|NaN|NAN)$""",
    re.VERBOSE,
)
_INT, _REAL = "tag:yaml.org,2002:int", "tag:yaml.org,2002:float"
_NUMBERS: Final = {_INT: _INTEGER, _REAL: _FLOAT}
_DATE: Final = "tag:yaml.org,2002:timestamp"
Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in (*_NUMBERS, _DATE)]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in _NUMBERS.items():
    Loader.add_implicit_resolver(_tag, _pattern, list("-+.0123456789"))

Loader.yaml_constructors = {
    f"tag:yaml.org,2002:{name}": yaml.SafeLoader.yaml_constructors[f"tag:yaml.org,2002:{name}"]
    for name in ("null", "str", "seq", "map")
}
Loader.add_constructor(_INT, Loader.construct_number)
Loader.add_constructor(_REAL, Loader.construct_number)
Loader.add_constructor("tag:yaml.org,2002:bool", Loader.construct_truth)
Loader.add_constructor(None, Loader.construct_undefined)  # type: ignore[type-var]
