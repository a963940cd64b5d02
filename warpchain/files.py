"""Writes files completely or not at all, and refuses to replace anything but regular files.

A file takes the place of nothing or of a regular file, never of a folder, device, FIFO, socket or symbolic link. A link
is refused, not followed: a folder of unknown origin could point it at any file. Links in the path to it are followed.

Content is written to a part beside the file, `.NAME.01234567.part.SUFFIX`; a killed writer leaves it. An unnamed file
(O_TMPFILE) was rejected: it cannot replace another one.
"""

import datetime
import errno
import os
import re
import secrets
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, Literal, NamedTuple

AnyPath = str | os.PathLike[str]
DISK_FAILURES: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})
"""Numbers (errno) of an `OSError` that no other path or permission would have avoided."""
UNLOCKED_FOR: Final = 1.0
"""Time [s] after its last change from which a part that nobody has locked is taken for that of a killed process."""


class NotReplaceable(OSError):  # noqa: N818 - the path is refused, nothing went wrong
    """Something is at a path that a new file must not replace; one line that names it."""


class FileKind(NamedTuple):
    """A kind of file by its content: what it is called, and whether the regular file at a path is of it."""

    name: str
    has: Callable[[Path], bool]


def given_path(path: AnyPath) -> Path:
    """A path as a user gave it; an `OSError` if it is none, or empty, which `Path` takes for the current folder."""
    text = os.fspath(path)
    if not text:
        raise OSError("a path is empty; name a file or folder")
    if re.search("[\0\ud800-\udc7f\udd00-\udfff]", text):
        raise OSError(f"{ascii(text)[:100]}: has a NUL or a lone surrogate; remove it")
    return Path(path)


def checked_output(path: AnyPath, only: FileKind | None = None) -> Path:
    """The path, if a file may be written there; everything that writes files for a user asks here.

    Replaced may be any regular file, or `only` one of a kind; a `NotReplaceable` says that something else is there. An
    `OSError` says that it is no path, or that the folder is not there.
    """
    target = given_path(path)
    with naming(target):
        target.parent.stat()
        try:
            mode = target.lstat().st_mode
        except FileNotFoundError:
            return target
    if not stat.S_ISREG(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "a symbolic link" if stat.S_ISLNK(mode) else "no regular file"
        raise NotReplaceable(f"{target}: cannot be written (it is {kind}); use another path")
    if only is not None and not only.has(target):
        raise NotReplaceable(f"{target}: already exists and is not a {only.name}; use another name")
    return target


@contextmanager
def replacing(path: AnyPath, only: FileKind | None = None) -> Iterator[Path]:
    """Yield the path of an empty part beside `path`, which becomes `path` if the block ends without an error.

    The data reach the disk before the part is renamed. So `path` is at any moment, even after a power cut, either the
    old or the whole new file. The block must not replace the part by another file.

    Errors are those of `checked_output`, and an `OSError` of one line that names the file, with the number of the
    cause, if it cannot be written. No part is left.
    """
    target = checked_output(path, only)
    part = target.with_name(f".{target.stem}.{secrets.token_hex(4)}.part{target.suffix}")
    with naming(target):
        descriptor = os.open(part, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)
    try:
        _lock(descriptor)
        with naming(target):
            yield part
            os.fsync(descriptor)
        checked_output(target, only)  # again: the block may have taken hours
        with naming(target):
            os.replace(part, target)
        with suppress(OSError):  # a folder that can be written but not read
            folder = os.open(target.parent, os.O_RDONLY)
            try:
                os.fsync(folder)  # the new name, too
            finally:
                os.close(folder)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    """Lock an open file against `clear_parts` of other processes; False if one has it, or the system has no locks."""
    try:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):
        return False
    return True


def clear_parts(path: AnyPath) -> None:
    """Delete what killed processes had written of a file; one that is being written is locked, and stays."""
    target = given_path(path)
    name = re.compile(rf"\.{re.escape(target.stem)}\.[0-9a-f]{{8}}\.part{re.escape(target.suffix)}")
    for part in target.parent.iterdir() if target.parent.is_dir() else ():
        if not name.fullmatch(part.name) or not stat.S_ISREG(part.lstat().st_mode):
            continue
        with suppress(OSError):  # it is complete now, or may not be deleted
            with open(part, "rb") as file:
                if time.time() - os.fstat(file.fileno()).st_mtime > UNLOCKED_FOR and _lock(file.fileno()):
                    part.unlink()


def now() -> str:
    """The time, as logs and provenance have it: in the notation of ISO 8601, to a second."""
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")


def write_whole(path: AnyPath, content: bytes | str, only: FileKind | None = None) -> None:
    """Write a file, see `replacing`; text in UTF-8."""
    data = content.encode() if isinstance(content, str) else content
    with replacing(path, only) as part:
        part.write_bytes(data)


def remove_output(path: AnyPath) -> None:
    """Delete a file that a new one would replace; nothing if there is none. Errors as of `checked_output`."""
    target = checked_output(path)
    with naming(target):
        target.unlink(missing_ok=True)


def make_folder(folder: Path) -> None:
    """Make a folder for files that follow, unless it is there; else an `OSError` of one line that names it."""
    with naming(folder):
        folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def naming(target: AnyPath, verb: Literal["written", "read"] = "written") -> Iterator[None]:
    """Turn an `OSError` of the `with` block into one of its class in one line, which names a file and what to do."""
    try:
        yield
    except OSError as error:
        number = error.errno or errno.EIO  # without a number: a library that writes a format failed
        remedy = _REMEDIES.get(number, "check the disk") if verb == "written" else "use the path of a readable file"
        reason = os.strerror(error.errno) if error.errno else " ".join(str(error).split())  # HDF5 has a paragraph
        problem = type(error)(f"{target}: cannot be {verb} ({reason}); {remedy}")
        problem.errno = number
        raise problem from error


def described(error: OSError) -> str:
    """The text of an error; one that the system made, not this package, gets the path and what to do."""
    if not error.strerror or not error.errno:
        return str(error)
    where = f"{os.fsdecode(error.filename)}: " if error.filename else ""
    return f"{where}cannot be read or written ({error.strerror}); {_REMEDIES.get(error.errno, 'check the disk')}"


_REMEDIES: Final = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), "free disk space"),
    **dict.fromkeys((errno.EROFS, errno.EACCES, errno.EPERM), "make the folder writable"),
    **dict.fromkeys((errno.ENOENT, errno.ENOTDIR, errno.EEXIST), "use a folder that exists"),
    errno.ENAMETOOLONG: "use a shorter path",
}
"""Errno with which the system refuses to write → what to do."""
