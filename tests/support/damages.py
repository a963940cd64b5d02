"""Damage to files as plain data, so that it can be sent to another process and written down.

A place is a whole number of any size; it is taken modulo the length of what is damaged.
"""

import json
import posixpath
from collections.abc import Callable, Sequence
from typing import Any

import h5py
import numpy as np

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


def forge(file: h5py.File, steps: Steps) -> None:
    """Change the objects in an HDF5 file: other numbers, types, shapes, layouts, links and attributes."""
    for kind, place, *more in steps:
        names: list[str] = []
        file.visit(names.append)
        if kind in ATTRIBUTE_CHANGES:
            group = file[("/", *names)[more.pop(0) % (len(names) + 1)]]
            attributes = sorted(group.attrs)
            if attributes:
                ATTRIBUTE_CHANGES[kind](group, attributes[place % len(attributes)], *more)
        elif names:
            OBJECT_CHANGES[kind](file, names[place % len(names)], *more)


def _number(file: h5py.File, name: str, at: int, value: float) -> None:
    """Another number in a dataset, in one of its columns."""
    dataset = file[name]
    if not isinstance(dataset, h5py.Dataset) or not 0 < (dataset.size or 0) < 10**6:
        return
    values = np.array(dataset[()])
    flat = values.reshape(-1)
    column = flat.dtype.names[at % len(flat.dtype.names)] if flat.dtype.names else None
    target = flat if column is None else flat[column]
    if target.dtype.kind not in "if":
        return
    with np.errstate(all="ignore"):
        target[at % len(flat)] = np.float64(value).astype(target.dtype)
    dataset[...] = values


def _delete(file: h5py.File, name: str) -> None:
    del file[name]


def _soft_link(file: h5py.File, name: str, target: str) -> None:
    del file[name]
    file[name] = h5py.SoftLink(target)


def _external_link(file: h5py.File, name: str, target: str) -> None:
    del file[name]
    file[name] = h5py.ExternalLink(target, "/")


def _hard_link(file: h5py.File, name: str, at: int) -> None:
    """Another object under this name; a group may then contain itself."""
    names = ["/"]
    file.visit(names.append)
    target = file[names[at % len(names)]]
    del file[name]
    parent = posixpath.dirname(name)
    if not parent or parent in file:
        file[name] = target


def _other(file: h5py.File, name: str, kind: str, shape: Sequence[int], layout: str) -> None:
    """Another dataset under this name."""
    del file[name]
    if layout == "compressed":
        file.create_dataset(name, shape or (1,), kind, compression="gzip")
    elif layout == "unwritten":
        file.create_dataset(name, shape, kind)
    elif layout == "chunks":
        file.create_dataset(name, (2**40,), kind, chunks=(2**10,))
    else:
        file.create_dataset(name, data=np.ones(shape, kind))


def _text(file: h5py.File, name: str) -> None:
    """Texts of any length under this name."""
    del file[name]
    file[name] = ["a", "b" * 1000]


def _group(file: h5py.File, name: str) -> None:
    del file[name]
    file.create_group(name)


OBJECT_CHANGES: dict[str, Callable[..., None]] = {
    "number": _number,
    "delete": _delete,
    "soft link": _soft_link,
    "external link": _external_link,
    "hard link": _hard_link,
    "other": _other,
    "text": _text,
    "group": _group,
}


def _set_text(group: Any, name: str, text: str) -> None:
    """A text of fixed length, as warpchain writes it."""
    content = text.encode("utf-8", "surrogatepass")
    group.attrs.create(name, content, dtype=h5py.string_dtype("utf-8", max(1, len(content))))


def _set_value(group: Any, name: str, value: Any) -> None:
    """A number, a list of them or a text of any length."""
    group.attrs[name] = value


def _cut_text(group: Any, name: str, steps: Steps) -> None:
    """The text that is there, damaged."""
    value = group.attrs[name]
    if isinstance(value, bytes | np.bytes_ | str):
        content = damaged(value if isinstance(value, bytes) else str(value).encode(), steps)
        group.attrs.create(name, content, dtype=h5py.string_dtype("utf-8", max(1, len(content))))


def _without(group: Any, name: str) -> None:
    del group.attrs[name]


ATTRIBUTE_CHANGES: dict[str, Callable[..., None]] = {
    "set text": _set_text,
    "set value": _set_value,
    "damage text": _cut_text,
    "remove": _without,
}


def changed_json(text: str, steps: Steps) -> Any:
    """The content of a JSON text with other values, or without some, at places anywhere in it."""
    content = {"": json.loads(text)}
    for kind, place, *more in steps:
        places = list(_places(content))
        holder, key = places[place % len(places)]
        if kind == "replace":
            holder[key] = more[0]
        elif kind == "drop" and holder is not content:
            del holder[key]
        elif kind == "double" and isinstance(holder, list):
            holder.insert(key, holder[key])
        elif kind == "add" and isinstance(holder[key], dict):
            holder[key][more[0]] = more[1]
    return content[""]


def _places(value: Any) -> Any:
    """Each value in lists and mappings, as its holder and its key."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in list(items):
        yield value, key
        yield from _places(item)
