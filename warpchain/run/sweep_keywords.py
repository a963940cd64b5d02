"""A sweep said by keyword arguments: the content of a sweep file, with defaults, and all of its errors at once."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from warpchain.inputs.sections import SECTIONS
from warpchain.inputs.setup import DEFAULT_PRESET
from warpchain.inputs.validation import InputError, plain
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.sweeps.sweep_file import VERSION, read_sweep

MOST_PROBLEMS: Final = 20
"""Most problems that are described, each in a line; the others are counted."""

_ALONE: Final = {"version": VERSION, "name": "sweep", "seed": 0, "preset": DEFAULT_PRESET, "samples": 1}
"""A sweep in which nothing is wrong, beside which each value is tried by itself."""


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
    try:
        return load_sweep(content)
    except InputError as error:
        problems = list(dict.fromkeys([*_problems(content), *error.args]))
        more = (
            [f"{len(problems) - MOST_PROBLEMS} more problems; correct these first"] if problems[MOST_PROBLEMS:] else []
        )
        raise InputError(*problems[:MOST_PROBLEMS], *more) from None


def _problems(content: Mapping[str, Any]) -> Iterator[str]:
    """What is wrong with each value by itself; what is wrong with several together is found by `load_sweep`."""
    for key in content:
        if key in ("version", "same_samples_along"):  # the latter names axes of the grid
            continue
        for part, index in _parts(key, content[key]):
            trial = {**_ALONE, key: part}
            if key == "grid" and isinstance(part, Mapping) and "preset" in part:
                del trial["preset"]
            try:
                read_sweep(trial)
            except InputError as error:
                yield str(error).replace("[0]", f"[{index}]", 1)


def _parts(key: str, value: object) -> Iterator[tuple[object, int]]:
    """A value of a sweep file in parts with one value each, and the place of each in its list."""
    if key not in (*SECTIONS, "distributions", "grid") or not isinstance(value, Mapping):
        yield value, 0
        return
    for name, content in value.items():
        if key == "grid" and isinstance(content, list) and content:
            yield from (({name: [item]}, index) for index, item in enumerate(content))
        else:
            yield {name: content}, 0
