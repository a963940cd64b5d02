"""Damage to files as plain data, so that it can be sent to another process and written down.

A place is a whole number of any size; it is taken modulo the length of what is damaged.
"""

from collections.abc import Callable, Sequence
from typing import Any

SECTOR = 512

Steps = Sequence[Sequence[Any]]
"""Kinds of damage, each with its arguments, in the order in which they are done."""


def damaged(content: bytes, steps: Steps) -> bytes:
    """A copy of the bytes of a file after all steps."""
    for kind, place, *more in steps:
        content = _OF_BYTES[kind](content, place % (len(content) or 1), *more)
    return content


def _flip(content: bytes, place: int, bit: int) -> bytes:
    return content[:place] + bytes(byte ^ 1 << bit for byte in content[place : place + 1]) + content[place + 1 :]


def _zero(content: bytes, place: int, sectors: int) -> bytes:
    start = place // SECTOR * SECTOR
    return content[:start] + bytes(len(content[start : start + sectors * SECTOR])) + content[start + sectors * SECTOR :]


def _cut(content: bytes, place: int) -> bytes:
    return content[:place]


def _insert(content: bytes, place: int, text: str, count: int) -> bytes:
    return content[:place] + text.encode("latin-1") * count + content[place:]


def _overwrite(content: bytes, place: int, text: str) -> bytes:
    new = text.encode("latin-1")
    return content[:place] + new + content[place + len(new) :]


def _splice(content: bytes, place: int, source: int, length: int) -> bytes:
    """Bytes from elsewhere in the file, over those at a place."""
    source %= len(content) or 1
    return content[:place] + content[source : source + length] + content[place + length :]


def _move(content: bytes, place: int, source: int, length: int) -> bytes:
    """Bytes taken out at one place and put in at another."""
    source %= len(content) or 1
    rest = content[:source] + content[source + length :]
    return rest[:place] + content[source : source + length] + rest[place:]


_OF_BYTES: dict[str, Callable[..., bytes]] = {
    "flip": _flip,
    "zero": _zero,
    "cut": _cut,
    "insert": _insert,
    "overwrite": _overwrite,
    "splice": _splice,
    "move": _move,
}
