"""The sweeps that come with the package, found by their bare names, and the file that a new sweep starts from."""

import errno
import os
import re
from pathlib import Path
from typing import Final

from warpchain.files import failure, write_whole
from warpchain.inputs.validation import InputError, checked_path, suggestion

_PACKAGE: Final = Path(__file__).parents[1]
_SHIPPED: Final = _PACKAGE / "shipped_sweeps"
"""In a checkout a link to sweeps/."""
_TEMPLATE: Final = _PACKAGE / "sweeps" / "new_sweep.yaml"


def shipped_sweeps() -> list[str]:
    """Bare names of the sweeps that come with the package."""
    return sorted(path.stem for path in _SHIPPED.glob("*.yaml"))


def sweep_path(source: str | os.PathLike[str]) -> Path:
    """Path of a sweep file, or of a sweep of the package by its bare name; an `InputError` if it is neither."""
    path = checked_path(source, "sweep")
    name = str(path)
    if os.path.isfile(path) or not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        return path
    known = shipped_sweeps()
    if name not in known:
        raise InputError(f"{name}: neither a file nor a shipped sweep; {suggestion(name, known)}")
    return _SHIPPED / f"{name}.yaml"


def write_new_sweep(path: Path) -> None:
    """Write a small sweep file whose comments explain its keys; an `InputError` if there is a file already."""
    text = _TEMPLATE.read_text(encoding="utf-8")
    if os.path.lexists(path):
        raise InputError(f"--new: {path} exists; give another name")
    try:
        write_whole(path, text)
    except OSError as error:
        raise failure(error.errno or errno.EIO, f"--new: {error}") from error
