"""The lock of a sweep's folder, by which one process at a time runs a sweep there; `SweepFolder.open` takes it.

Where the file system has `flock`, the file `lock` is locked, and the system unlocks it when the process ends, however
it ends. Elsewhere, as on Windows and some network file systems, the lock is the presence of the file `lock.held`. A
killed process leaves that file; the library `filelock` removes it if it is of a process of this machine that has ended,
and a refusal names it otherwise.
"""

import errno
import os
import re
import socket
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Final

from warpchain.files import naming
from warpchain.inputs.validation import InputError, InputWarning

_HOLDER: Final = re.compile(r"process \d+ on \S*")
_NO_LOCKS: Final = frozenset({errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EINVAL})
"""Numbers (errno) by which a file system says that it has no `flock`."""

_held: dict[int, Callable[[], None] | None] = {}
"""Descriptors of the locks of this process → what removes the file `lock.held` of each. A forked child shares them, and
would keep the folder of a killed run locked; so a child closes them at once."""


def _give_up() -> None:
    while _held:
        os.close(_held.popitem()[0])


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_give_up)


def locked(folder: Path) -> Callable[[], None]:
    """Lock a folder and write into the file `lock` who has it; what comes back unlocks it.

    Raises:
        OSError: a file cannot be written there.
        InputError: another process has the folder, or its file `lock` is of something else.
    """
    path = folder / "lock"
    with naming(path):
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    release_file: Callable[[], None] | None = None
    try:
        holder = os.read(descriptor, 200).decode(errors="replace").strip()
        if holder and not _HOLDER.fullmatch(holder):
            raise InputError(f"{path}: in the way of a sweep; use another folder")
        in_use = f"{folder}: in use by {holder or 'another process'}; wait for it to end"
        try:
            with naming(path):
                if not _has_flock(descriptor):
                    release_file = _locked_by_a_file(folder, in_use)
        except BlockingIOError:
            raise InputError(f"{in_use}, or use another folder") from None
        if not path.exists():  # by a process that was refused the folder
            raise InputError(f"{path}: was deleted meanwhile; try again")
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
    except BaseException:
        os.close(descriptor)
        if release_file is not None:
            release_file()
        raise
    _held[descriptor] = release_file  # and the lock of `filelock`, which its end as an object would open

    def unlock() -> None:
        if descriptor in _held:
            own = _held.pop(descriptor)
            os.close(descriptor)
            if own is not None:
                own()

    return unlock


def _has_flock(descriptor: int) -> bool:
    """Lock a file by `flock` if there is one; a `BlockingIOError` says that another process has locked it."""
    try:
        import fcntl
    except ImportError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return False
        raise
    return True


def _locked_by_a_file(folder: Path, in_use: str) -> Callable[[], None]:
    """Make the file `lock.held`; what comes back removes it. An `InputError` says that another process has made it."""
    from filelock import SoftFileLock, Timeout

    path = folder / "lock.held"
    lock = SoftFileLock(path, timeout=0, thread_local=False)
    try:
        lock.acquire()
    except Timeout:
        raise InputError(f"{in_use}, or delete {path.name} there if it has ended") from None
    text = f"{folder}: has no flock, so the file {path.name} locks it; a killed process may leave that file there"
    warnings.warn(text, InputWarning, stacklevel=5)
    return lock.release
