"""Films out of text tables, as Tracker and other programs that follow points in videos export them."""

import codecs
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from warpchain.films.film import GRAVITY, LEAD, Film, rounding_of
from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.validation import InputError, Whole, checked, checked_path, shown

UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_OF_HEADS: Final = {"x": UNITS, "y": UNITS, "t": {"s": 1.0, "ms": 1e-3}}
"""Name of a column → the units that its head may give."""
_HEAD: Final = re.compile(r"(?P<name>[txy])(?:_\{(?P<below>[^}]*)\})?(?!\w)[\s/.,]*[(\[]?(?P<unit>[^)\]]*)[)\]]?")
"""Head of a column: its name, a subscript, and a unit, as in `x (cm)`, `x / cm`, `x [cm]` and `x_{cm} (mm)`."""
LARGEST: Final = 8_000_000
"""Most bytes of a file; a minute of 240 frames a second with 20 columns has half of them."""
LONGEST: Final = 60.0
"""Most seconds of a film; the release is looked for everywhere in it."""
SLOWEST: Final = 10.0
"""Least frames a second; fewer are times in another unit."""
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
    Columns are parted by tabs, semicolons, commas or spaces; a comma that does not part them is a decimal point. Heads
    may have a unit, m, cm or mm, and s or ms, as in `x (cm)` and `t (ms)`; others are refused.

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
    lines = [_cells(line) for line in _text(checked_path(path, "path"), path).splitlines()]
    first, heads = _heads(lines, path)
    scale, seconds = _units(heads, unit, path)
    names, rows = [head and head[1] for head in heads], []
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
    time = time * seconds if fps is None else np.round((time - time[0]) / np.median(np.diff(time))) / fps
    rate, span = 1 / float(np.median(np.diff(time))), float(time[-1] - time[0])
    if rate < SLOWEST:
        raise InputError(f"t: {rate:.3g} frames a second; if the times are in ms, write t (ms), or give fps")
    if not span <= LONGEST:
        raise InputError(f"t: the film lasts {span:.4g} s; cut it to {LONGEST:g} s at most about the release")
    sign, order = (1, [0, 1, 2, 3]) if direction == "right" else (-1, [1, 0, 2, 3])
    scales = scale * np.array([sign, 1])
    center = (np.column_stack([x, y]) - origin) * scales
    edges = None if outline is None else (np.reshape(outline, 4)[order] - np.repeat(origin, 2)) * np.repeat(scales, 2)
    release = _fitted_release(time, center[:, 1]) if release is None else release
    return Film(time=time - release, center=center, links=links, frequency=frequency, outline=edges, speed=speed)


def _text(file: Path, path: object) -> str:
    """The text of a file, in UTF-8 or, as some programs for Windows write it, UTF-16 that says so."""
    if file.exists() and not file.is_file():  # others may never end
        raise InputError(f"{path}: no regular file; give the path of a text table")
    with file.open("rb") as opened:
        content = opened.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise InputError(f"{path}: more than {LARGEST / 1e6:g} MB; export the centre of mass about the release only")
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = content.decode("utf-16" if wide else "utf-8-sig", errors="replace")
    if "\0" in text:
        raise InputError(f"{path}: neither UTF-8 nor UTF-16 with a byte-order mark; save it as a text in UTF-8")
    return text


def _cells(line: str) -> list[str]:
    """The cells of a line."""
    mark = next((mark for mark in "\t;," if mark in line), None)
    line = line if mark == "," else line.replace(",", ".")  # numbers with decimal points
    cells = line.split(mark) if mark else re.split(r"\s+(?![(\[])", line.strip())  # a unit stays with its head
    return [cell.strip(' "') for cell in cells]


def _heads(lines: list[list[str]], path: object) -> tuple[int, list[re.Match[str] | None]]:
    """Number of the line with the heads of the columns, and what each says; None for other columns."""
    for number, cells in enumerate(lines):
        heads = [_HEAD.fullmatch(cell) for cell in cells]
        names = [head[1] for head in heads if head]
        if {"t", "x", "y"} <= {*names}:
            if len(names) > 3:
                raise InputError(f"{path}: several columns t, x or y; export one track, the centre of mass")
            return number, heads
    words = next((cells for cells in lines if len(cells) > 2 and not re.search(r"\d", "".join(cells))), None)
    others = f", but {shown(', '.join(words))}" if words else ""
    wanted = "export these of the centre of mass, or rename them"
    raise InputError(f"{path}: no line with the column heads t, x and y{others}; {wanted}")


def _units(heads: list[re.Match[str] | None], given: str | None, path: object) -> tuple[float, float]:
    """Metres in the unit of lengths and seconds in that of times: those that heads say, the one given, or m and s."""
    lengths, seconds = set() if given is None else {given}, 1.0
    for head in filter(None, heads):
        known = _OF_HEADS[head["name"]]
        if head["unit"] and head["unit"] not in known:
            remedy = f"give {', '.join(known)}, or name the column {head['name']}"
            raise InputError(f"{path}: unknown unit in the head {shown(head[0])}; {remedy}")
        if head["name"] == "t":
            seconds = known[head["unit"] or "s"]
        elif head["unit"]:
            lengths.add(head["unit"])
        elif head["below"] in UNITS and given is None:
            raise InputError(f"unit: the head {head[0]} of {path} may mean a unit or the centre of mass; give unit")
    if len(lengths) > 1:
        raise InputError(f"unit: heads of {path} and unit say {' and '.join(sorted(lengths))}; correct one of them")
    return UNITS[lengths.pop() if lengths else "m"], seconds


def _fitted_release(time: Array, y: Array) -> float:
    """When a height that was constant begins to fall freely, for at least 30 ms."""

    def misfit(start: float) -> float:
        near = slice(*np.searchsorted(time, [start - LEAD, start + 0.03]))
        return float((y[near] + GRAVITY / 2 * np.maximum(time[near] - start, 0) ** 2).var())

    starts = np.arange(time[0] + LEAD / 2, time[-1] - 0.1, 2.5e-4)
    if not len(starts):
        raise InputError("release: the film is too short to fit it; give it")
    release = float(min(starts, key=misfit))
    still = y[(time > release - LEAD) & (time < release)].var()
    if misfit(release) > 4 * max(still, rounding_of(y) ** 2, 1e-8):
        raise InputError("release: nothing begins to fall freely; check unit and fps, or give it")
    return release
