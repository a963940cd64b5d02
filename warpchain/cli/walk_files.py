"""The folder of a walk: its record and its figures."""

import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, get_args

from warpchain.files import checked_output, make_folder, naming, remove_output
from warpchain.inputs.validation import one_line
from warpchain.pictures.walk_shape import Kind

if TYPE_CHECKING:
    from warpchain.store.sweep_result import SweepResult
    from warpchain.walks.walk_result import WalkResult

RECORD: Final = "walk.h5"
_PICTURES: Final = (*(f"{kind}.png" for kind in get_args(Kind)), "walk.gif")
"""What `plot` and `animate` write beside the record unless told otherwise."""


def saved(path: Path, wanted: str) -> "WalkResult | SweepResult":
    """The walk or the sweep of a file or a folder; else an `InputError` says what is `wanted` in its place."""
    from warpchain.hdf5_files import kind_of_hdf5
    from warpchain.store.sweep_result import KIND, load
    from warpchain.walks.walk_result import load_walk

    record = path / RECORD if os.path.isfile(path / RECORD) else path
    is_sweep = record.is_dir() or (record.suffix != ".h5" and not record.exists())
    return load(record) if is_sweep or kind_of_hdf5(record, wanted) == KIND else load_walk(record)


def try_walk_folder(folder: Path) -> None:
    """Check before a walk that all its files can be written to a folder, by an `OSError`; nothing is left there."""
    nearest = folder.absolute()
    with naming(folder):
        while True:
            try:
                nearest.lstat()
                break
            except FileNotFoundError:
                nearest = nearest.parent
        with tempfile.TemporaryDirectory(prefix=".warpchain-", dir=nearest):
            pass
    if folder.is_dir():
        for name in (RECORD, *_PICTURES):
            checked_output(folder / name)


def write_walk(result: "WalkResult", folder: Path) -> Iterator[Path]:
    """Write the record, then its film strip, whole or not at all; yield the path of each.

    Figures and film of an earlier walk, which do not belong to this record, are deleted.
    """
    make_folder(folder)
    result.save(folder / RECORD)
    yield folder / RECORD
    for name in _PICTURES:
        remove_output(folder / name)
    yield from draw_figures(result, folder, ["film_strip"])


def draw_figures(walk: "WalkResult", folder: Path, kinds: Iterable[Kind]) -> Iterator[Path]:
    """Draw figures into a folder; yield the path of each, and say on stderr which a walk has nothing for, and why."""
    from warpchain.pictures.style import save_figure

    for kind in kinds:
        path = folder / f"{kind}.png"
        try:
            figure = walk.plot(kind)
        except ValueError as error:
            print(one_line(f"{path}: not drawn; {error}"), file=sys.stderr)
        else:
            save_figure(figure, path)
            yield path
