"""What a shell completes: the words that an option or argument takes."""

import glob
import os
from collections.abc import Iterator


def methods(incomplete: str) -> Iterator[tuple[str, str]]:
    """Words for the method, and the integrators with what they are."""
    from warpchain.inputs.methods import METHODS, METHODS_BY_NEED

    titles = {word: f"{settings['method']} with settings" for word, settings in METHODS_BY_NEED.items()}
    yield from ((name, title) for name, title in {**titles, **METHODS}.items() if name.startswith(incomplete))


def presets(incomplete: str) -> Iterator[str]:
    """Presets of parameters."""
    from warpchain.inputs.parameters import PRESETS

    yield from (name for name in PRESETS if name.startswith(incomplete))


def starts(incomplete: str) -> Iterator[str]:
    """Ways to start a walk."""
    from warpchain.inputs.scene import Scene
    from warpchain.inputs.value_list import field_choices

    choices = field_choices("start", Scene.model_fields["start"])
    yield from (word for word in choices if word.startswith(incomplete))


def names(incomplete: str) -> Iterator[str]:
    """Names of values, and the symbols that stand for them."""
    from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF

    yield from (name for name in (*SECTION_OF, *NAME_OF_SYMBOL) if name.startswith(incomplete))


def assignments(incomplete: str) -> Iterator[str]:
    """Beginnings of NAME=VALUE."""
    yield from (f"{name}=" for name in names(incomplete))


def sweep_files(incomplete: str) -> Iterator[str]:
    """Bare names of the sweeps that come with the package, then folders and YAML files."""
    from warpchain.sweeps.shipped import shipped_sweeps

    yield from (name for name in shipped_sweeps() if name.startswith(incomplete))
    for path in sorted(glob.glob(f"{glob.escape(incomplete)}*")):
        if os.path.isdir(path):
            yield f"{path}/"
        elif path.endswith((".yaml", ".yml")):
            yield path
