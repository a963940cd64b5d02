"""Checks the checksums of compiled kernels in Warp's cache before a process loads them.

Warp loads what it finds there: an object with one bit flipped computes another distance or crashes. Beside the folder
of a module stands a file of the SHA-256 of all that is loaded from it. It is also a lock: while one process compares or
compiles a module, others wait for it instead of compiling it as well.

A cache that cannot be written to, such as that of a container or a class room, serves for the kernels that are whole in
it; `warpchain compile` fills one.
"""

import contextlib
import errno
import hashlib
import json
import os
import secrets
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import warp as wp

from warpchain.files import DISK_FAILURES
from warpchain.inputs.validation import InputError

LOADED = (".o", ".cubin", ".ptx", ".meta")
"""Endings of the files that are loaded from a module's folder."""
LONGEST_WAIT = 120.0
"""Time [s] after which a process no longer waits for another: that one may have been stopped for good."""
ROOM: Final = 2**24
"""Bytes that must fit on the disk of the cache before a kernel is compiled.

On a full disk the compiler ends the process. An object has up to 2 MB, and several are compiled at once.
"""
UNWRITABLE: Final = frozenset({errno.EROFS, errno.EACCES, errno.EPERM})
"""Numbers (errno) with which a system refuses to write to a cache that it may let read."""


def load_checked(module: wp.Module, device: wp.Device, make: Callable[[], wp.Module]) -> None:
    """Load a module of entries for blocks of its threads; what is missing or does not fit its checksum is compiled.

    `make` makes the module of the same name that is compiled. An `InputError` says that the folder of the cache cannot
    be used, an `OSError` that its disk is full or broken.
    """
    folder = Path(wp.config.kernel_cache_dir, module.get_module_identifier())
    record = folder.with_name(f"{folder.name}.sha256")
    try:
        try:
            with _locked(record):
                _load(module, device, make, folder, record)
        except OSError as error:
            if error.errno not in UNWRITABLE or not _is_whole(folder, record):
                raise
            wp.load_aot_module(module, device, module_dir=folder)
    except OSError as error:
        raise cache_refusal(error) from error


def _load(module: wp.Module, device: wp.Device, make: Callable[[], wp.Module], folder: Path, record: Path) -> None:
    """Load a module from a cache that can be written to, while no other process does."""
    recorded = _recorded(record)
    if not _checksums(folder).items() <= recorded.items():
        shutil.rmtree(folder)
    try:
        wp.load_aot_module(module, device, module_dir=folder)
    except FileNotFoundError:
        _make_sure_of_room(record)
        try:
            with _read_headers(device):
                wp.compile_aot_module(make(), device, module_dir=folder)
        except OSError:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        wp.load_aot_module(module, device, module_dir=folder)
    if (now := _checksums(folder)) != recorded:
        record.write_text(json.dumps(now), encoding="utf-8")  # cut short by a kill, it fits nothing


@contextlib.contextmanager
def _read_headers(device: wp.Device) -> Iterator[None]:
    """Share Warp's headers, as the compiler for CPUs has read them, among threads and processes.

    Warp keeps what it read for one thread of one process. Reading takes 2.5 s, a third of the time of a kernel. A
    checksum precedes the content here. The compiler refuses, with a message, what was read of headers with another time
    of modification, so the folder is that of one installation of Warp.
    """
    if not device.is_cpu:
        yield
        return
    found = [(path.name, path.stat()) for path in sorted(Path(wp.__file__).parent.glob("native/**/*.h"))]
    dated = repr([(name, stat.st_size, stat.st_mtime_ns) for name, stat in found])
    kept = Path(wp.config.kernel_cache_dir, f"headers_{hashlib.sha256(dated.encode()).hexdigest()[:16]}")
    own = Path(wp._src.context.runtime.get_clang_pch_dir())  # type: ignore[attr-defined]
    for path in kept.glob("*.pch"):
        if (own / path.name).exists():
            continue
        memory = path.read_bytes()
        if hashlib.sha256(memory[32:]).digest() == memory[:32]:
            (own / path.name).write_bytes(memory[32:])
        else:
            path.unlink(missing_ok=True)
    yield
    for path in own.glob("*.pch"):
        if not (kept / path.name).exists():
            content = path.read_bytes()
            kept.mkdir(exist_ok=True)
            trial = kept / f"{secrets.token_hex(4)}.trial"
            trial.write_bytes(hashlib.sha256(content).digest() + content)
            trial.replace(kept / path.name)


def _make_sure_of_room(record: Path) -> None:
    """An `OSError` if the disk of the cache, or a quota, has not `ROOM` left; nothing of the trial is left."""
    trial = record.with_name(f"{record.name}.{secrets.token_hex(4)}.room")
    try:
        with open(trial, "wb") as file:
            for _ in range(16):
                file.write(bytes(ROOM // 16))
            file.flush()
            os.fsync(file.fileno())  # some file systems say only now that they are full
    finally:
        trial.unlink(missing_ok=True)


def _is_whole(folder: Path, record: Path) -> bool:
    """Whether the files of a module are there and fit their checksums."""
    found = _checksums(folder)
    return bool(found) and found == _recorded(record)


def cache_refusal(error: OSError) -> Exception:
    """What to raise because of an error in the folder of the cache: one line, unless the disk is full or broken."""
    if error.errno in DISK_FAILURES:
        problem = type(error)(f"{_cache()}: {os.strerror(error.errno)}; make room for kernels, or set WARP_CACHE_PATH")
        problem.errno = error.errno
        return problem
    text = f"WARP_CACHE_PATH: {_cache()}: {error.strerror or error}; name a folder for kernels that can be written to"
    return InputError(text)


def _cache() -> str:
    """The folder of the cache, as far as it is known."""
    return wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH", "the folder of Warp's cache")


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Make a file if it is not there, and keep other processes from it for a while, where the system has locks."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        with contextlib.suppress(ImportError):  # Windows has no flock: two processes may compile the same
            import fcntl

            _wait(descriptor, fcntl.flock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(descriptor)


def _wait(descriptor: int, lock: Callable[[int, int], None], how: int) -> None:
    """Wait until a file is locked, but no longer than `LONGEST_WAIT`."""
    last = time.monotonic() + LONGEST_WAIT
    while time.monotonic() < last:
        try:
            lock(descriptor, how)
            return
        except BlockingIOError:
            time.sleep(0.02)
        except OSError:
            return  # a file system without locks: two processes may compile the same


def _recorded(record: Path) -> dict[str, str]:
    """Name → checksum, as recorded; nothing if the record is not there, empty or damaged."""
    try:
        content = json.loads(record.read_bytes())
    except (FileNotFoundError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _checksums(folder: Path) -> dict[str, str]:
    """Name → SHA-256 of each file that may be loaded from a module's folder; nothing if there is none."""
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files if file.suffix in LOADED}
