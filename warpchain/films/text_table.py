"""Films out of text tables, as Tracker and other programs that follow points in videos export them."""

import os
import re
from collections.abc import Sequence
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from warpchain.films.film import BEFORE, GRAVITY, Film
from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.validation import InputError, Whole, checked, checked_path, shown

UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_POSITIVE: Final = Annotated[float, Field(gt=0)]


def read(
    path: str | os.PathLike[str],
    *,
    links: int,
    frequency: float,
    unit: Literal["m", "cm", "mm"] | None = None,
    direction: Literal["right", "left"] = "right",
    origin: tuple[float, float] = (0.0, 0.0),
    fps: float | None = None,
    release: float | None = None,
    outline: Sequence[float] | None = None,
    speed: float | None = None,
) -> Film:
    """Read a film: a text table with columns t, x and y of the centre of mass, as Tracker exports it.

    Lines above the heads of the columns, other columns, and frames with an empty cell or `nan` are passed over.
    Columns are parted by tabs, semicolons, commas or spaces; a comma that does not part them is a decimal point.

    Args:
        path: the file.
        links: number of links.
        frequency: of the sprocket [Hz].
        unit: of lengths in the file, and of `origin` and `outline`; None: that of heads such as `x (cm)`, else m.
        direction: to which side the chain walks in the picture.
        origin: x of the sprocket's axis and y of the floor in the file.
        fps: true frames a second, if the times of the file are those of slow motion.
        release: time of the release in the file, with `fps` since the first marked frame [s]; None: fitted to the fall.
        outline: left and rightmost x, lowest and highest y of joints before the release, as seen; None: unknown.
        speed: of the loop before the release [m/s], such as n ℓ over the period of a painted link; None: unknown.

    Raises:
        OSError: the file cannot be read.
        InputError: it is no file, has no such columns, or a line that is not numbers; or another value is refused.
    """
    checked(links, "links", Annotated[Whole, Field(ge=4)])
    checked(frequency, "frequency", _POSITIVE, "Hz")
    checked(fps, "fps", _POSITIVE | None)
    checked(release, "release", float | None, "s")
    checked(speed, "speed", _POSITIVE | None, "m/s")
    checked_array(origin, "origin", 2)
    checked(outline, "outline", Annotated[list[float], Field(min_length=4, max_length=4)] | None)
    if unit not in (None, *UNITS) or direction not in ("right", "left"):
        raise InputError(f"unit: {shown(unit)}, direction: {shown(direction)}; give m, cm or mm, and right or left")
    lines, file = [], checked_path(path, "path")
    if file.exists() and not file.is_file():  # others may never end
        raise InputError(f"{path}: no regular file; give the path of a text table")
    for line in file.read_text(encoding="utf-8-sig", errors="replace").splitlines():
        mark = next((mark for mark in "\t;," if mark in line), None)
        line = line if mark == "," else line.replace(",", ".")  # numbers with decimal points
        cells = line.split(mark) if mark else re.split(r"\s+(?![(\[])", line.strip())  # a unit stays with its head
        lines.append([cell.strip(' "') for cell in cells])
    heads = [[re.sub(r"[\s(\[].*", "", cell) for cell in cells] for cells in lines]  # without units
    first = next((number for number, names in enumerate(heads) if {"t", "x", "y"} <= set(names)), None)
    if first is None:
        raise InputError(f"{path}: no line with the column heads t, x and y; export these of the centre of mass")
    units = {*re.findall(r"\b[xy][^\w;]+([cm]?m)\b", ";".join(lines[first])), *([unit] if unit else [])} or {"m"}
    if len(units) > 1:
        raise InputError(f"unit: heads of {path} and unit say {' and '.join(sorted(units))}; correct one of them")
    names, rows = heads[first], []
    if names.count("x") > 1:
        raise InputError(f"{path}: several columns x; export one track, the centre of mass")
    for number, cells in enumerate(lines[first + 1 :], first + 2):
        row = [cells[k] for k in map(names.index, "txy") if k < len(cells) and cells[k]]
        if any(cells[len(names) :]):
            raise InputError(f"{path}: line {number} has too many cells; part them by tabs or semicolons")
        if len(row) == 3:  # Tracker leaves cells empty where nothing was marked
            try:
                rows.append([float(cell) for cell in row])
            except ValueError:
                raise InputError(f"{path}: line {number} is not numbers; correct or delete it") from None
    table = np.array(rows).reshape(-1, 3)
    time, x, y = table[np.isfinite(table).all(axis=1)].T  # pandas writes nan where nothing was marked
    if len(time) < 20 or np.any(np.diff(time) <= 0):
        raise InputError(f"{path}: {len(time)} frames; give at least 20, in order of time")
    time = time if fps is None else np.round((time - time[0]) / np.median(np.diff(time))) / fps
    sign, order = (1, [0, 1, 2, 3]) if direction == "right" else (-1, [1, 0, 2, 3])
    scale = UNITS[units.pop()] * np.array([sign, 1])
    center = (np.column_stack([x, y]) - origin) * scale
    edges = None if outline is None else (np.reshape(outline, 4)[order] - np.repeat(origin, 2)) * np.repeat(scale, 2)
    release = _fitted_release(time, center[:, 1]) if release is None else release
    return Film(time=time - release, center=center, links=links, frequency=frequency, outline=edges, speed=speed)


def _fitted_release(time: Array, y: Array) -> float:
    """When a height that was constant begins to fall freely, for at least 30 ms."""

    def misfit(start: float) -> float:
        near = (time > start - BEFORE) & (time < start + 0.03)
        return float((y[near] + GRAVITY / 2 * np.maximum(time[near] - start, 0) ** 2).var())

    starts = np.arange(time[0] + BEFORE / 2, time[-1] - 0.1, 2.5e-4)
    if not len(starts):
        raise InputError("release: the film is too short to fit it; give it")
    release = float(min(starts, key=misfit))
    if misfit(release) > 4 * max(y[(time > release - BEFORE) & (time < release)].var(), 1e-8):
        raise InputError("release: nothing begins to fall freely; check unit and fps, or give it")
    return release
