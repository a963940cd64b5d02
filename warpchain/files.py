"""Files that are written whole or not at all."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path in the same folder, which becomes `path` if the block ends without an error.

    The data reach the disk before the file is renamed. So `path` is at any moment, even after a power cut, either the
    old or the whole new file.

    Raises:
        OSError: the file cannot be written; one line that names it. No temporary file is left.
    """
    target = Path(path)
    part = target.with_name(f".{target.stem}.{secrets.token_hex(4)}.part{target.suffix}")
    try:
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield part
        with open(part, "r+b") as content:
            os.fsync(content.fileno())
        os.replace(part, target)
    except OSError as error:
        raise OSError(
            f"{target}: cannot be written ({reason(error)}); give a path in a folder that can take it"
        ) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def reason(error: OSError) -> str:
    """The system's short text for an error; HDF5 hides it in a paragraph."""
    return os.strerror(error.errno) if error.errno else " ".join(str(error).split())


def version_refusal(found: int, known: int, remedy: str) -> str | None:
    """Why a file of one format version is refused where another is known; None if they are equal.

    Args:
        found: version of the file.
        known: version that this warpchain reads.
        remedy: how to get an older file's content in this version.
    """
    if found == known:
        return None
    if found > known:
        return f"format version {found}, but this warpchain reads {known}; update warpchain"
    return f"format version {found}, but this warpchain reads {known}; {remedy}, or use the warpchain that wrote it"
