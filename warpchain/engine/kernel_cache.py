"""Compiled kernels in Warp's cache, compared with checksums of ours before a process loads them.

Warp loads what it finds there: an object with one bit flipped computes another distance or crashes. Beside the folder
of a module stands a file of the SHA-256 of all that is loaded from it. It is also a lock: while one process compares or
compiles a module, others wait for it instead of compiling it as well.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import warp as wp

from warpchain.files import DISK_FAILURES
from warpchain.inputs.validation import InputError

LOADED = (".o", ".cubin", ".ptx", ".meta")
"""Endings of the files that are loaded from a module's folder."""
LONGEST_WAIT = 120.0
"""Time [s] after which a process no longer waits for another: that one may have been stopped for good."""


def load_checked(module: wp.Module, device: wp.Device, make: Callable[[], wp.Module]) -> None:
    """Load a module of entries for blocks of its threads; what is missing or does not fit its checksum is compiled.

    `make` makes the module of the same name that is compiled. An `InputError` says that the folder of the cache cannot
    be used, an `OSError` that its disk is full or broken.
    """
    folder = Path(wp.config.kernel_cache_dir, module.get_module_identifier())
    try:
        with _locked(folder.with_name(f"{folder.name}.sha256")) as record:
            recorded = _recorded(record)
            if not _checksums(folder).items() <= recorded.items():
                shutil.rmtree(folder)
            try:
                wp.load_aot_module(module, device, module_dir=folder)
            except FileNotFoundError:
                wp.compile_aot_module(make(), device, module_dir=folder)
                wp.load_aot_module(module, device, module_dir=folder)
            if (now := _checksums(folder)) != recorded:
                os.truncate(record, 0)
                os.pwrite(record, json.dumps(now).encode(), 0)  # cut short by a kill, it fits nothing
    except OSError as error:
        raise cache_refusal(error) from error


def cache_refusal(error: OSError) -> Exception:
    """What to raise because of an error in the folder of the cache: one line, unless the disk is full or broken."""
    if error.errno in DISK_FAILURES:
        return error
    folder = wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH", "the folder of Warp's cache")
    text = f"WARP_CACHE_PATH: {folder}: {error.strerror or error}; name a folder for kernels that can be written to"
    return InputError(text)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[int]:
    """Open a file for reading and writing, made if need be, and keep other processes from it for a while."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        last = time.monotonic() + LONGEST_WAIT
        while time.monotonic() < last:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(0.02)
            except OSError:
                break  # a file system without locks: two processes may compile the same
        yield descriptor
    finally:
        os.close(descriptor)


def _recorded(record: int) -> dict[str, str]:
    """Name → checksum, as recorded; nothing if the record is empty or damaged."""
    try:
        content = json.loads(os.pread(record, os.fstat(record).st_size, 0))
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _checksums(folder: Path) -> dict[str, str]:
    """Name → SHA-256 of each file that may be loaded from a module's folder; nothing if there is none."""
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files if file.suffix in LOADED}
