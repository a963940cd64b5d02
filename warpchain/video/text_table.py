"""Read videos from text tables, as Tracker and similar programs export them; users call `read`."""

import codecs
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.validation import InputError, Whole, checked, checked_path, shown
from warpchain.video.camera import GRAVITY, LEAD, Video, rounding_of

UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_OF_HEADS: Final = {"x": UNITS, "y": UNITS, "t": {"s": 1.0, "ms": 1e-3}}
"""Name of a column → the units that its header may contain."""
_HEAD: Final = re.compile(r"(?P<name>[txy])(?:_\{(?P<below>[^}]*)\})?(?!\w)[\s/.,]*[(\[]?(?P<unit>[^)\]]*)[)\]]?")
"""Header of a column: its name, a subscript, and a unit, as in `x (cm)`, `x / cm`, `x [cm]` and `x_{cm} (mm)`."""
LARGEST: Final = 8_000_000
"""Maximum size of a file in bytes; a minute at 240 frames per second with 20 columns takes half of it."""
LONGEST: Final = 60.0
"""Maximum duration of a video [s], because the release is searched for in all of it."""
SLOWEST: Final = 10.0
"""Minimum frames per second; a lower rate means that the times have another unit."""
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
) -> Video:
    """Read a video from a text table with columns t, x and y of the centre of mass, as Tracker exports it.

    Lines above the column headers, other columns, and frames with an empty cell or `nan` are skipped. Columns are
    separated by tabs, semicolons, commas or spaces; a comma that does not separate columns is a decimal point. A
    header may contain a unit, as in `x (cm)` and `t (ms)`: m, cm or mm, and s or ms.

    Args:
        path: path of the file.
        links: number of links.
        frequency: frequency of the sprocket [Hz].
        unit: unit of lengths in the file, of `origin` and of `outline`; None: the unit in the headers, else m.
        direction: direction in which the chain walks in the picture.
        origin: x of the sprocket's axis and y of the floor, in the coordinates of the file.
        fps: true frames per second, if the file has the times of a slow-motion video.
        release: time of the release in the file, with `fps` since the first marked frame [s]; None: fitted to the fall.
        outline: minimum and maximum x, minimum and maximum y of the joints before the release, in the coordinates of
            the file; None: unknown.
        speed: speed of the loop before the release [m/s], e.g. n ℓ divided by the period of a marked link; None:
            unknown.

    Raises:
        OSError: the file cannot be read.
        InputError: the path is not a file, columns are missing, a line is not numeric, or an argument is refused.
    """
    checked(links, "links", Annotated[Whole, Field(ge=4)])
    checked(frequency, "frequency", _POSITIVE, "Hz")
    checked(fps, "fps", _POSITIVE | None)
    checked(release, "release", float | None, "s")
    checked(speed, "speed", _POSITIVE | None, "m/s")
    checked_array(origin, "origin", 2)
    checked(outline, "outline", Annotated[list[float], Field(min_length=4, max_length=4)] | None)
    if unit not in (None, *UNITS) or direction not in ("right", "left"):
        given = f"unit {shown(unit)} and direction {shown(direction)}"
        raise InputError(f"unit: expected m, cm or mm, and direction right or left, got {given}; correct them")
    lines = [_cells(line) for line in _text(checked_path(path, "path"), path).splitlines()]
    first, heads = _heads(lines, path)
    scale, seconds = _units(heads, unit, path)
    names, rows = [head and head[1] for head in heads], []
    for number, cells in enumerate(lines[first + 1 :], first + 2):
        row = [cells[k] for k in map(names.index, "txy") if k < len(cells) and cells[k]]
        if any(cells[len(names) :]):
            raise InputError(f"{path}: line {number} has too many cells; separate them by tabs or semicolons")
        if len(row) == 3:  # Tracker leaves cells empty where nothing was marked
            try:
                rows.append([float(cell) for cell in row])
            except ValueError:
                raise InputError(f"{path}: line {number} is not numeric; correct or delete it") from None
    table = np.array(rows).reshape(-1, 3)
    time, x, y = table[np.isfinite(table).all(axis=1)].T  # pandas writes nan where nothing was marked
    if len(time) < 20 or np.any(np.diff(time) <= 0):
        raise InputError(f"{path}: expected at least 20 frames in order of time, got {len(time)}; export more")
    time = time * seconds if fps is None else np.round((time - time[0]) / np.median(np.diff(time))) / fps
    rate, span = 1 / float(np.median(np.diff(time))), float(time[-1] - time[0])
    if rate < SLOWEST:
        raise InputError(
            f"t: expected 10 frames per second or more, got {rate:.3g}; if t is in ms, write t (ms), or use fps"
        )
    if not span <= LONGEST:
        raise InputError(
            f"t: expected at most {LONGEST:g} s, got {span:.4g} s; export only the time around the release"
        )
    sign, order = (1, [0, 1, 2, 3]) if direction == "right" else (-1, [1, 0, 2, 3])
    scales = scale * np.array([sign, 1])
    center = (np.column_stack([x, y]) - origin) * scales
    edges = None if outline is None else (np.reshape(outline, 4)[order] - np.repeat(origin, 2)) * np.repeat(scales, 2)
    release = _fitted_release(time, center[:, 1]) if release is None else release
    return Video(time=time - release, center=center, links=links, frequency=frequency, outline=edges, speed=speed)


def _text(file: Path, path: object) -> str:
    """The text of a file in UTF-8 or, as some Windows programs write it, in UTF-16 with a byte-order mark."""
    if file.exists() and not file.is_file():  # others may never end
        raise InputError(f"{path}: not a regular file; use the path of a text table")
    with file.open("rb") as opened:
        content = opened.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise InputError(f"{path}: more than {LARGEST / 1e6:g} MB; export only the centre of mass around the release")
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = content.decode("utf-16" if wide else "utf-8-sig", errors="replace")
    if "\0" in text:
        raise InputError(f"{path}: neither UTF-8 nor UTF-16 with a byte-order mark; save it as UTF-8 text")
    return text


def _cells(line: str) -> list[str]:
    """The cells of a line."""
    mark = next((mark for mark in "\t;," if mark in line), None)
    line = line if mark == "," else line.replace(",", ".")  # numbers with decimal points
    cells = line.split(mark) if mark else re.split(r"\s+(?![(\[])", line.strip())  # a unit stays with its head
    return [cell.strip(' "') for cell in cells]


def _heads(lines: list[list[str]], path: object) -> tuple[int, list[re.Match[str] | None]]:
    """Number of the line with the column headers, and the match of each; None for other columns."""
    for number, cells in enumerate(lines):
        heads = [_HEAD.fullmatch(cell) for cell in cells]
        names = [head[1] for head in heads if head]
        if {"t", "x", "y"} <= {*names}:
            if len(names) > 3:
                raise InputError(f"{path}: several columns t, x or y; export one track, the centre of mass")
            return number, heads
    words = next((cells for cells in lines if len(cells) > 2 and not re.search(r"\d", "".join(cells))), None)
    others = f", got {shown(', '.join(words))}" if words else ""
    raise InputError(
        f"{path}: expected column headers t, x and y{others}; export or rename these of the centre of mass"
    )


def _units(heads: list[re.Match[str] | None], given: str | None, path: object) -> tuple[float, float]:
    """Metres per unit of length and seconds per unit of time: from the headers, from the argument, or m and s."""
    lengths, seconds = set() if given is None else {given}, 1.0
    for head in filter(None, heads):
        known = _OF_HEADS[head["name"]]
        if head["unit"] and head["unit"] not in known:
            remedy = f"use {', '.join(known)}, or name the column {head['name']}"
            raise InputError(f"{path}: unknown unit in the header {shown(head[0])}; {remedy}")
        if head["name"] == "t":
            seconds = known[head["unit"] or "s"]
        elif head["unit"]:
            lengths.add(head["unit"])
        elif head["below"] in UNITS and given is None:
            raise InputError(f"unit: the header {head[0]} of {path} may mean a unit or the centre of mass; set unit")
    if len(lengths) > 1:
        raise InputError(f"unit: headers of {path} and unit say {' and '.join(sorted(lengths))}; correct one of them")
    return UNITS[lengths.pop() if lengths else "m"], seconds


def _fitted_release(time: Array, y: Array) -> float:
    """Time at which a height that was constant begins to fall freely, for at least 30 ms."""

    def misfit(start: float) -> float:
        near = slice(*np.searchsorted(time, [start - LEAD, start + 0.03]))
        return float((y[near] + GRAVITY / 2 * np.maximum(time[near] - start, 0) ** 2).var())

    starts = np.arange(time[0] + LEAD / 2, time[-1] - 0.1, 2.5e-4)
    if not len(starts):
        raise InputError("release: the video is too short to fit the release; set release")
    release = float(min(starts, key=misfit))
    still = y[(time > release - LEAD) & (time < release)].var()
    if misfit(release) > 4 * max(still, rounding_of(y) ** 2, 1e-8):
        raise InputError("release: found no beginning of a free fall; check unit and fps, or set release")
    return release
