"""A sweep said by keyword arguments: the content of a sweep file, with defaults."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from warpchain.inputs.setup import DEFAULT_PRESET
from warpchain.inputs.validation import plain
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.sweeps.sweep_file import VERSION


def sweep_of_keywords(given: Mapping[str, object], out: str | os.PathLike[str] | None) -> Sweep:
    """The sweep that keyword arguments describe.

    Args:
        given: Keys of a sweep file with one block. Left out, the name is that of the folder, the seed 0, and the preset
            that of a walk, unless it is an axis.
        out: Folder of the results.

    Raises:
        InputError: Something is refused; one line for each value.
    """
    content: dict[str, Any] = {**plain(given, "sweep"), "version": VERSION}
    content.setdefault("name", (Path(out).absolute().name if out is not None else "") or "sweep")
    content.setdefault("seed", 0)
    grid = content.get("grid")
    if not (isinstance(grid, Mapping) and "preset" in grid):
        content.setdefault("preset", DEFAULT_PRESET)
    return load_sweep(content)
