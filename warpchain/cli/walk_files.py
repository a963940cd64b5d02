"""The folder of a walk: its record, its figures, its moving picture."""

import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from warpchain.files import DISK_FAILURES, checked_output, failure, make_folder, remedy, remove_output
from warpchain.inputs.validation import InputError, one_line
from warpchain.pictures.style import save_figure
from warpchain.pictures.walk_shape import Kind
from warpchain.walks.walk_result import WalkResult

_RECORD: Final = "walk.h5"
_KINDS: Final[tuple[Kind, ...]] = ("figure5", "film_strip", "loop", "tilt")
"""Figures that are drawn beside the record."""


def try_walk_folder(folder: Path, animation: str | None) -> None:
    """Check before a walk that all its files can be written; errors as of `try_folder` and `checked_output`."""
    try_folder(folder)
    if folder.is_dir():
        moving = [] if animation is None else [f"walk.{animation}"]
        for name in (_RECORD, *(f"{kind}.png" for kind in _KINDS), *moving):
            checked_output(folder / name)


def try_folder(folder: Path) -> None:
    """Check before a long run that a folder can be written to; nothing is left there.

    Raises:
        InputError: it cannot.
        OSError: the disk is full or broken.
    """
    nearest = folder.absolute()
    try:
        while True:
            try:
                nearest.lstat()
                break
            except FileNotFoundError:
                nearest = nearest.parent
        with tempfile.TemporaryDirectory(prefix=".warpchain-", dir=nearest):
            pass
    except OSError as error:
        if error.errno in DISK_FAILURES:
            raise failure(error.errno, f"--output: {folder}: {error.strerror}; {remedy(error.errno)}") from None
        raise InputError(f"--output: {folder}: {error.strerror}; give a folder that can be written to") from None


def write_walk(result: WalkResult, folder: Path, animation: str | None) -> Iterator[Path]:
    """Write the record, then its pictures, each whole or not at all; yield the path of each.

    Pictures of an earlier walk that this one has none of are deleted: they do not belong to this record.

    Raises:
        OSError: a file cannot be written.
    """
    make_folder(folder)
    result.save(folder / _RECORD)
    yield folder / _RECORD
    for kind in _KINDS:
        remove_output(folder / f"{kind}.png")
    has = {"loop": result.before_release is not None, "tilt": result.joints_in_room is not None}
    yield from draw_figures(result, folder, [kind for kind in _KINDS if has.get(kind, True)])
    if animation is not None:
        path = folder / f"walk.{animation}"
        try:
            result.animate(path)
        except ValueError as error:
            remove_output(path)
            _note(path, error)
        else:
            yield path


def draw_figures(walk: WalkResult, folder: Path, kinds: Iterable[Kind]) -> Iterator[Path]:
    """Draw figures into a folder; yield the path of each, and say on stderr which a walk has nothing for, and why.

    Raises:
        OSError: a file cannot be written.
    """
    for kind in kinds:
        path = folder / f"{kind}.png"
        try:
            figure = walk.plot(kind)
        except ValueError as error:
            _note(path, error)
        else:
            save_figure(figure, path)
            yield path


def _note(path: Path, error: ValueError) -> None:
    print(one_line(f"{path}: not drawn; {error}"), file=sys.stderr)
