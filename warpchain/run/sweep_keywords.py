"""A sweep said by keyword arguments: the content of a sweep file, with defaults."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from warpchain.inputs.sections import SECTION_OF, by_section
from warpchain.inputs.setup import DEFAULT_PRESET
from warpchain.inputs.validation import InputError, by_name, plain
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.sweeps.sweep_file import VERSION, BlockKeys

KEYS: Final = (*BlockKeys.model_fields, "same_samples_along", "record", "name", "seed")
"""Keys of a sweep file that are keywords."""


def sweep_of_keywords(given: Mapping[str, object], out: str | os.PathLike[str] | None) -> Sweep:
    """The sweep that keyword arguments describe.

    Args:
        given: `KEYS`, and fields of a walk by name or symbol; a list or a range is an axis of the grid, behind those
            given. Left out, the name is that of the folder, the seed 0, and the preset that of a walk, unless it is
            an axis.
        out: Folder of the results.

    Raises:
        InputError: Something is refused; one line for each value.
    """
    usual = {"name": (Path(out).absolute().name if out is not None else "") or "sweep", "seed": 0, "version": VERSION}
    values = plain(given, "sweep")
    content: dict[str, Any] = usual | {key: values.pop(key) for key in KEYS if key in values}
    by_section(values)  # refuses unknown names
    if isinstance(content.get("preset"), list):
        values = {"preset": content.pop("preset"), **values}
    for name, value in by_name(values).items():
        key = "grid" if isinstance(value, list | dict) else SECTION_OF[name]
        others = content.setdefault(key, {})
        if isinstance(others, dict):  # the check of the content refuses anything else
            if name in by_name(others):
                raise InputError(f"{name}: given twice, also in {key}; leave one out")
            content[key] = {**others, name: value}
    grid = content.get("grid")
    if not (isinstance(grid, Mapping) and "preset" in grid):
        content.setdefault("preset", DEFAULT_PRESET)
    return load_sweep(content)
