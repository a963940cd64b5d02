"""Reading YAML files, strictly."""

import os
import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any, Final

import yaml

from warpchain.inputs.validation import InputError, shown


def read_yaml(path: str | os.PathLike[str]) -> object:
    """Content of a YAML file, with the numbers of :class:`Loader`.

    Raises:
        InputError: the file cannot be read, is not YAML or gives a key twice.
    """
    try:
        return yaml.load(Path(path).read_text(encoding="utf-8"), Loader=Loader)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; give the path of a readable YAML file") from None
    except yaml.MarkedYAMLError as error:
        line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        problem = ", ".join(filter(None, (error.context, error.problem)))
        raise InputError(f"{path}{line}: {problem}; correct the YAML") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}; correct the YAML") from None


class Loader(yaml.SafeLoader):
    """PyYAML's safe loader, but a repeated key is an error and a number means what it looks like."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Mapping of a node; PyYAML itself lets the last of several equal keys win."""
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if isinstance(key, yaml.ScalarNode) and (key.tag, key.value) in seen:
                problem = f"key {shown(key.value)} is given twice"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            seen.add((key.tag, str(key.value)))
        return super().construct_mapping(node, deep)


# YAML 1.1, PyYAML's dialect, reads 060 as 48 and 1:30 as 90, and takes 1e9 for text.
_INTEGER: Final = re.compile(r"[-+]?(?:0|[1-9][0-9_]*)$")
_FLOAT: Final = re.compile(
    r"""[-+]?(?:\.[0-9]+|[0-9]+\.[0-9]*)(?:[eE][-+]?[0-9]+)?$
      | [-+]?[0-9]+[eE][-+]?[0-9]+$
      | [-+]?\.(?:inf|Inf|INF)$
      | \.(?:nan|NaN|NAN)$""",
    re.VERBOSE,
)
_NUMBERS: Final = {"tag:yaml.org,2002:int": _INTEGER, "tag:yaml.org,2002:float": _FLOAT}
Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in _NUMBERS]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in _NUMBERS.items():
    Loader.add_implicit_resolver(_tag, _pattern, list("-+.0123456789"))
