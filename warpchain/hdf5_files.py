"""HDF5 files of results: equal content gives equal bytes, and a checksum detects damage.

The first attribute of a file, `checksum`, holds the length of the file and the SHA-256 of all its bytes but these 64
digits:

    warpchain SHA-256 of 0000000000104179 bytes: HEX

The checksum is compared before the HDF5 library gets a byte, because damage may make that library hang or crash. HDF5
keeps texts of attributes in a heap without checksums of its own, so that the digits can be filled in afterwards. Other
programs that open a file for writing and change nothing leave it as it is. Two other places were tried: behind the
content, where such a program cuts the checksum off; and a user block before it, with which xarray does not recognise
the file.

Fields of a dataclass that a file keeps are annotated with `Stored`; `write_fields` and `read_fields` go by that.
"""

import hashlib
import io
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NamedTuple, get_args

import numpy as np

from warpchain.files import AnyPath, naming
from warpchain.inputs.validation import ChangedFileError, DamagedFileError, InputError
from warpchain.version import FORMAT_VERSION

if TYPE_CHECKING:
    import h5py
    import xarray

_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
_CHECKSUM: Final = "warpchain SHA-256 of {:016d} bytes: {}"
_PREFIX: Final = b"warpchain SHA-256 of "
_HEAD: Final = 2**16
"""Number of bytes at the beginning of a file that hold its checksum and its kind."""
_DIMS: Final = {"t": "time", "f": "frame_time", "n": "joint", "2": "axis", "3": "room_axis"}
"""Letter or size in a shape → name of the dimension."""
_LABELS: Final = {"axis": ["x", "y"], "room_axis": ["x", "y", "z"]}
"""Coordinates of dimensions that are not numbered."""
_FIXED: Final[dict[str, Any]] = {"libver": ("v108", "v108"), "track_order": True}
"""Version bounds without which equal content would not give equal bytes; they also leave out times."""

WALK_FILE: Final = "walk.h5"
SWEEP_FILE: Final = "sweep.h5"
"""Names of the file of a saved walk, and of the manifest of a sweep, in their folders."""


@dataclass(frozen=True)
class Stored:
    """Annotation of a field that files keep: a number, an array, or a dictionary of numbers by `keys` with meanings.

    Its SI unit, "1" for pure numbers, and its meaning in one line. The shape of an array is such as "t 2" for (t, 2): t
    instants, f frames, n links; `empty` says when it has no instants or frames although there are some, "" if never.
    """

    unit: str
    meaning: str
    shape: str = ""
    empty: str = ""
    keys: Mapping[str, str] = field(default_factory=dict)

    @property
    def described(self) -> str:
        """Meaning and shape."""
        if not self.shape:
            return self.meaning
        sizes = self.shape.split()
        shape = f"{self.meaning}, shape ({', '.join(sizes)}{',' * (len(sizes) == 1)})"
        return f"{shape}; none {self.empty}" if self.empty else shape

    @property
    def digested(self) -> list[object]:
        """What a file depends on; the wording of meanings it does not."""
        return [self.unit, self.shape, list(self.keys)]

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions."""
        return tuple(_DIMS[size] for size in self.shape.split())

    def path(self, name: str) -> str:
        """Where a file keeps the field of this name."""
        group = {"": "summary", "t": "series", "f": "frames"}[self.shape[:1]]
        return f"{group}/{name.removeprefix('frame_')}"


class Format(NamedTuple):
    """The format of one kind of file: its name, and a digest of the table of its fields.

    A field that is added, renamed or measured otherwise makes another format, also if nobody raised `FORMAT_VERSION`.
    """

    kind: str
    digest: str

    @classmethod
    def of(cls, kind: str, *tables: Mapping[str, Any]) -> "Format":
        """The format of files with the fields of some tables: name → `Stored`, or what else the content depends on."""
        named = [[(name, getattr(field, "digested", field)) for name, field in table.items()] for table in tables]
        return cls(kind, hashlib.sha256(repr(named).encode()).hexdigest()[:16])


def stored_fields(kind: type) -> dict[str, Stored]:
    """The fields of a dataclass that files keep: name → annotation."""
    notes = ((item.name, note) for item in fields(kind) for note in get_args(item.type))
    return {name: note for name, note in notes if isinstance(note, Stored)}


def write_fields(
    group: "h5py.Group", values: Mapping[str, Any], kept: Mapping[str, Stored], joints: type = np.float64
) -> None:
    """Write `kept` fields, see `stored_fields`, with units and meanings; arrays without numbers are left out.

    What each joint has in each frame gets the precision of `joints`.
    """
    for name, stored in kept.items():
        for key, meaning in (stored.keys or {"": stored.described}).items():
            value = values[name][key] if key else values[name]
            if stored.shape:  # a NaN has many bit patterns, and the pattern may depend on the batch
                value = np.where(np.isnan(value), np.nan, value).astype(joints if "n" in stored.shape else np.float64)
            if np.size(value):
                dims = tuple(dim.removeprefix("frame_") for dim in stored.dims)
                put(group, f"{stored.path(name)}/{key}".removesuffix("/"), value, stored.unit, meaning, dims)


def put(
    group: "h5py.Group", path: str, value: Any, unit: str, meaning: str, dims: tuple[str, ...] = ()
) -> "h5py.Dataset":
    """Write one dataset with its unit and meaning; a dimension whose name it does not have has a coordinate beside it.

    A dimension of several datasets of a group is that of the first; coordinates are what netCDF and xarray read.
    """
    dataset = group.create_dataset(path, data=value)
    dataset.attrs["units"], dataset.attrs["description"] = unit, meaning
    for place, dim in enumerate(dims):
        if dataset.name.endswith(f"/{dim}"):
            dataset.make_scale(dim)
            continue
        if dim not in dataset.parent:
            labels = np.array(_LABELS[dim], object) if dim in _LABELS else np.arange(dataset.shape[place], dtype="<i4")
            dataset.parent.create_dataset(dim, data=labels).make_scale(dim)
        dataset.dims[place].attach_scale(dataset.parent[dim])
    return dataset


def dataset_of(values: Mapping[str, Any], kept: Mapping[str, Stored]) -> "xarray.Dataset":
    """Arrays and numbers of `kept` fields, see `stored_fields`, as a data set with coordinates, units and meanings.

    Arrays without numbers are left out; a dictionary is a variable for each key.
    """
    import xarray

    found: dict[str, Any] = {}
    for name, stored in kept.items():
        for key, meaning in (stored.keys or {"": stored.described}).items():
            value = values[name][key] if key else values[name]
            if np.size(value):
                notes = {"units": stored.unit, "description": meaning}
                found[f"{name}_{key}".removesuffix("_")] = stored.dims, value, notes
    coords: dict[str, Any] = {name: found.pop(name) for name in ("time", "frame_time") if name in found}
    for dims, value, _ in found.values():
        for dim, size in zip(dims, np.shape(value), strict=True):
            coords.setdefault(dim, (dim, _LABELS.get(dim, np.arange(size))))
    return xarray.Dataset(found, coords)


def read_fields(group: "h5py.Group", kept: Mapping[str, Stored], links: int) -> dict[str, Any]:
    """What `write_fields` wrote; arrays of floats come back in double precision."""
    values: dict[str, Any] = {}
    sizes = {"t": 0, "f": 0, "n": links, "2": 2, "3": 3}
    for name, stored in kept.items():
        path = stored.path(name)
        if stored.keys:
            values[name] = {key: group[path][key][()].item() for key in stored.keys}
        elif not stored.shape:
            values[name] = group[path][()].item()
        elif path in group:
            values[name] = group[path][()].astype(np.float64)
        else:
            values[name] = np.empty([sizes[size] for size in stored.shape.split()])
    return values


def hdf5_image(form: Format, fill: "Callable[[h5py.File], None]") -> bytes:
    """The bytes of an HDF5 file of some format that `fill` fills; equal content gives equal bytes.

    It is made in memory: on a full disk HDF5 neither says what is wrong nor closes the file.
    """
    import h5py

    image, unset = io.BytesIO(), _CHECKSUM.format(0, "0" * 64)
    with h5py.File(image, "w", **_FIXED) as file:
        file.attrs["checksum"] = unset
        file.attrs["format"], file.attrs["format_version"] = form.kind, FORMAT_VERSION
        file.attrs["format_digest"] = form.digest
        fill(file)
    content = image.getbuffer()
    place = bytes(content[:_HEAD]).index(unset.encode())
    stop = place + len(unset)
    content[place:stop] = _CHECKSUM.format(len(content), "0" * 64).encode()
    digest = hashlib.sha256(content[: stop - 64])
    digest.update(content[stop:])
    content[stop - 64 : stop] = digest.hexdigest().encode()
    return bytes(content)


@contextmanager
def reading_hdf5(path: AnyPath, form: Format | None, remedy: str, wanted: str | None = None) -> "Iterator[h5py.File]":
    """An HDF5 file that `hdf5_image` made, undamaged and of a format, or of any if that is None.

    The remedy says what to do about a damaged or an older file; `wanted`, which file to give instead of one of another
    kind, is None of files that a sweep has in its folder.

    Raises:
        OSError: it cannot be read.
        InputError: it is no regular file, of another kind or of another version, or warpchain did not write it.
        DamagedFileError: it is damaged or cut short; a `ChangedFileError` if another program
            has changed it.
    """
    import h5py

    # HDF5 reads the file through Python: opened by its name, the file could not be open elsewhere in this process with
    # other flags of locking, as xarray has it.
    with open_regular(path) as content:
        _check(content, path, remedy, wanted)
        with h5py.File(content, "r") as file:
            _check_format(file, path, form, remedy, wanted)
            yield file


def _check_format(file: "h5py.File", path: AnyPath, form: Format | None, remedy: str, wanted: str | None) -> None:
    """Check format and version of a file; errors as of `reading_hdf5`."""
    if form is not None and (found := file.attrs["format"]) != form.kind:
        raise InputError(f"{path}: expected a {form.kind}, got a {found}; {wanted or 'move it out of this folder'}")
    if (version := int(file.attrs["format_version"])) != FORMAT_VERSION:
        later = f", but this warpchain reads {FORMAT_VERSION}; update warpchain"
        earlier = f" of an earlier warpchain, which reads it; {remedy}"
        raise InputError(f"{path}: format version {version}{later if version > FORMAT_VERSION else earlier}")
    if form is not None and file.attrs.get("format_digest") != form.digest:
        raise InputError(f"{path}: has other fields than this warpchain reads; {remedy}")


def _check(content: BinaryIO, path: AnyPath, remedy: str, wanted: str | None) -> None:
    """Compare a file with its checksum; errors as of `reading_hdf5`."""
    with naming(path, "read"):
        head, size = content.read(_HEAD), content.seek(0, os.SEEK_END)
        place = head.find(_PREFIX)
        stop = place + len(_CHECKSUM.format(0, "0" * 64))
        content.seek(stop)
        digest = hashlib.sha256(head[: stop - 64])
        while piece := content.read(2**20):
            digest.update(piece)
        content.seek(0)
    if place >= 0 and head[place:stop] == _CHECKSUM.format(size, digest.hexdigest()).encode():
        return
    if place < 0 and (size or wanted):  # in the folder of a sweep an empty file is torn
        what = "of an earlier warpchain, or damaged" if b"warpchain " in head else "not an HDF5 file of warpchain"
        what = what if head.startswith(_SIGNATURE) else "not an HDF5 file"
        raise InputError(f"{path}: {what}; {wanted or 'move it out of this folder, or use another folder'}")
    end = int.from_bytes(head[28:36], "little")  # of the content, as the HDF5 library notes it in its head
    if end == size and not head[place:].startswith(_CHECKSUM.format(size, "").encode()):
        raise ChangedFileError(f"{path}: another program has changed it; {remedy}")
    raise DamagedFileError(f"{path}: damaged or cut short; {remedy}")


def claims_to_be(path: AnyPath, kind: str) -> bool:
    """Whether a regular file is of a kind by its beginning, damaged or not, or is empty, as a torn one may be."""
    with open_regular(path) as content, naming(path, "read"):
        head = content.read(_HEAD)
    return not head or (_PREFIX in head and kind.encode() in head)


def kind_of_hdf5(path: AnyPath, wanted: str) -> str:
    """The kind of an HDF5 file that `hdf5_image` made; errors as of `reading_hdf5`."""
    with reading_hdf5(path, None, "fetch another copy of it", wanted) as file:
        return str(file.attrs["format"])


def open_regular(path: AnyPath) -> BinaryIO:
    """A file, open for reading; an `OSError` of one line names one that cannot be read.

    Opening a pipe or a device does not wait: what is no regular file is refused by an `InputError`.
    """
    try:
        with naming(path, "read"):
            at_once = getattr(os, "O_NONBLOCK", 0)  # which Windows does not have
            file = open(path, "rb", opener=lambda name, flags: os.open(name, flags | at_once))
    except IsADirectoryError:
        raise InputError(f"{path}: expected a file, got a folder; use another path") from None
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise InputError(f"{path}: expected a file, got a pipe or a device; use another path")
    return file
