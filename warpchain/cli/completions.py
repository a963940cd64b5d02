"""What a shell completes: the words that an option or argument takes; typer leaves out those that begin otherwise."""

import glob
import os
from collections.abc import Iterator


def methods() -> list[tuple[str, str]]:
    """Words for the method, and the integrators with what they are."""
    from warpchain.inputs.methods import METHODS, METHODS_BY_NEED

    words = [(word, f"{settings['method']} with settings") for word, settings in METHODS_BY_NEED.items()]
    return [*words, *METHODS.items()]


def presets() -> list[str]:
    """Presets of parameters."""
    from warpchain.inputs.parameters import PRESETS

    return list(PRESETS)


def starts() -> list[str]:
    """Ways to start a walk."""
    from warpchain.inputs.scene import Scene
    from warpchain.inputs.value_list import field_choices

    return list(field_choices(Scene.model_fields["start"]))


def names() -> list[str]:
    """Names of values, and the symbols that stand for them."""
    from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF

    return [*SECTION_OF, *NAME_OF_SYMBOL]


def assignments() -> list[str]:
    """Beginnings of NAME=VALUE."""
    return [f"{name}=" for name in names()]


def sweep_files(incomplete: str) -> Iterator[str]:
    """Bare names of the sweeps that come with the package, then folders and YAML files."""
    from warpchain.sweeps.shipped import shipped_sweeps

    yield from shipped_sweeps()
    for path in sorted(glob.glob(f"{glob.escape(incomplete)}*")):
        if os.path.isdir(path):
            yield f"{path}/"
        elif path.endswith((".yaml", ".yml")):
            yield path
