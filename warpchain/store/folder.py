"""The folder of a sweep, as seen by the process that runs the sweep.

    DIR/sweep.h5       what the folder belongs to, see `Manifest`; written first, replaced when the sweep grows
    DIR/sweep.yaml     the resolved sweep, for people and to run again
    DIR/shards/        000003.h5 holds the rows of some walks, and what is kept of their motion
    DIR/log.txt        what the runs of the sweep did, with times
    DIR/ro-crate-metadata.json  where and when it was run, for archives, see `warpchain.store.crate`
    DIR/lock           locked by the process that runs the sweep, see `warpchain.store.folder_lock`

None of these is a symbolic link when a sweep is run: nothing is written or deleted outside of the folder. A damaged
shard is deleted, named in log.txt and by a warning, and computed again.

A sweep grows when its file is given more samples: the shards that are there stay, others join them. Whatever happens
between two of these lines, the next `SweepFolder.open` resumes from there.
"""

import re
import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import yaml
from numpy.typing import NDArray

from warpchain.files import AnyPath, given_path, make_folder, naming, now, remove_output, write_whole
from warpchain.hdf5_files import SWEEP_FILE, WALK_FILE, claims_to_be
from warpchain.inputs.validation import ChangedFileError, DamagedFileError, InputError, InputWarning
from warpchain.store import shards
from warpchain.store.folder_lock import locked
from warpchain.store.shards import Manifest, Part, Shard, read_manifest
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.plan import Sweep
from warpchain.sweeps.rounds import Asked
from warpchain.walks.rows import MISSING, ROW_KEYS, Rows, missing_rows

_PART: Final = re.compile(r"\.(?:sweep|\d{6,})\.[0-9a-f]{8}\.part\.(?:yaml|h5)")

_YAML_HEAD: Final = """\
# The sweep of this folder with all its values. A copy with more samples adds them to this folder; a copy that is
# changed otherwise needs another folder.
# It names the method that was run. For the default method of another device, set method: standard in a copy.
"""


@dataclass(frozen=True)
class SweepFolder(AbstractContextManager["SweepFolder"]):
    """The folder of a sweep, locked against other processes until `close` or the end of this process.

    `unlock` lets other processes have it; `found` says of each walk in the order of `Manifest.keys` whether it was
    there when the folder was read, and `asked` whether it is to be there, which with `until` follows from those.
    """

    directory: Path
    manifest: Manifest
    unlock: Callable[[], None]
    found: NDArray[np.bool_]
    asked: NDArray[np.bool_]

    @classmethod
    def open(cls, directory: AnyPath, sweep: Sweep, shard_size: int, fresh: bool = False, part: Part = (1, 1)) -> Self:
        """Begin a sweep in a folder, made if need be, or resume it, with more samples if the sweep has more.

        `fresh` deletes what a sweep has left there, and begins. New shards have `shard_size` walks, those that are
        there keep their size. A folder keeps the `Manifest.part` that it was begun with. An `InputWarning` says that a
        shard was damaged: its walks are missing now.

        Raises:
            OSError: the folder cannot be made, locked, read or written.
            InputError: another process holds the folder, it belongs to another sweep or to something else, or a
                shard is foreign. Nothing has been deleted, and nothing new is left.
        """
        path = given_path(directory)
        make_folder(path)
        for own in (path / name for name in (*shards.OWN, "lock")):
            if own.is_symlink() or (own.exists() and not (own.is_file() or own.is_dir())):
                kind = "a symbolic link" if own.is_symlink() else "a pipe or a device"
                raise InputError(f"{own}: {kind}, where a sweep writes and deletes; remove it, or use another folder")
        is_new = not (path / "lock").exists()
        unlock = locked(path)
        try:
            manifest = _prepared(path, sweep, Manifest(sweep, shard_size, part), fresh)
            damaged: dict[str, str] = {}
            rows, _ = read_rows(path, manifest, damaged)
            folder = cls(path, manifest, unlock, *seen(manifest.sweep, rows)[:2])
            for name, problem in damaged.items():
                remove_output(path / "shards" / name)
                folder.log(f"{problem}; deleted, its walks are computed again")
                warnings.warn(f"{problem}; its walks are computed again", InputWarning, stacklevel=3)
            if read_manifest(path).sweep.digest() != manifest.sweep.digest():
                remove_output(path / "sweep.yaml")  # which is never older than sweep.h5
                write_whole(path / SWEEP_FILE, manifest.image())
            if not (path / "sweep.yaml").exists():
                text = yaml.safe_dump(manifest.sweep.canonical(), sort_keys=False, allow_unicode=True)
                write_whole(path / "sweep.yaml", _YAML_HEAD + text)
        except BaseException as error:
            if is_new and isinstance(error, InputError):
                (path / "lock").unlink(missing_ok=True)
            unlock()
            raise
        return folder

    def log(self, text: str) -> None:
        """Add a line with the time to log.txt; an `OSError` if it cannot be written."""
        path = self.directory / "log.txt"
        with naming(path), open(path, "a", encoding="utf-8") as file:
            file.write(f"{now()}  {text}\n")

    def missing(self) -> list[Shard]:
        """The shards that are not there yet, in order, with `until` those of a round; errors as of `read_rows`."""
        written = set(shards.shard_files(self.directory))
        left = [shard for shard in self.manifest.left(self.found, self.asked) if shard.name not in written]
        if left or not self.manifest.sweep.has_rounds:
            return left
        rows, _ = read_rows(self.directory, self.manifest)
        self.found[:], self.asked[:], _ = seen(self.manifest.sweep, rows)
        return self.manifest.left(self.found, self.asked)

    @property
    def walks(self) -> int:
        """Number of the walks of this folder so far, missing ones included; with `until` it grows by rounds."""
        return int((self.manifest.mine & self.asked).sum())

    @property
    def left(self) -> int:
        """Number of those that were missing when the folder was read."""
        return int((self.manifest.mine & self.asked & ~self.found).sum())

    def close(self) -> None:
        """Let other processes have the folder."""
        self.unlock()

    def __exit__(self, *problem: object) -> None:
        """Close."""
        self.close()


def read_rows(
    directory: AnyPath, manifest: Manifest, damaged: dict[str, str] | None = None
) -> tuple[list[Rows], list[NDArray[Any]]]:
    """For each block the rows of its walks, and of each what opens the file with its motion, and the group in there.

    Needs no lock, at any moment. Rows of walks that are not there yet are those of `missing_rows`; for a motion that is
    not kept stands None. `damaged` takes the name of each damaged shard and what is wrong with it; without it that is
    an `InputError`, as is a foreign shard. An `OSError` says that the folder or a shard cannot be read.
    """
    tables, motions = [], []
    for number, block in enumerate(manifest.sweep.blocks):
        keys = manifest.keys[manifest.keys["block"] == number]
        tables.append(missing_rows(manifest.row_type, keys).reshape(-1, block.samples))
        motions.append(np.full(tables[-1].shape, None))
    for name in shards.shard_files(directory):
        try:
            with shards.opened_shard(directory, name, manifest.digest, manifest.numerics_version) as file:
                rows, kept = shards.rows_of(file, manifest.row_type), [int(row) for row in file.get("motion", ())]
        except DamagedFileError as error:
            if damaged is None or isinstance(error, ChangedFileError):
                raise
            if not claims_to_be(path := Path(directory) / "shards" / name, shards.SHARD.kind):
                raise InputError(f"{path}: not a shard of this sweep; move it out of this folder") from None
            damaged[name] = str(error).partition("; ")[0]
            continue
        place = Path(directory).absolute(), name, manifest.digest, manifest.numerics_version
        opened = partial(shards.opened_shard, *place)
        numbers, cells, samples = (rows[key] for key in ROW_KEYS.names or ())
        try:
            for number, table in enumerate(tables):
                own = numbers == number
                table[cells[own], samples[own]] = rows[own]
            for row in kept:
                motions[numbers[row]][cells[row], samples[row]] = opened, f"motion/{row}"
        except IndexError:
            raise InputError(f"{Path(directory) / 'shards' / name}: {shards.FOREIGN}") from None
    return tables, motions


def seen(sweep: Sweep, rows: list[Rows]) -> tuple[NDArray[np.bool_], NDArray[np.bool_], list[Asked]]:
    """`found` and `asked` of a `SweepFolder`, given the rows of each block, and what is asked of each block."""
    found = np.concatenate([table["status"].ravel() for table in rows]) != MISSING
    cells = [Asked.of(*both) for both in zip(sweep.blocks, rows, strict=True)]
    return found, np.concatenate([each.walks.ravel() for each in cells]), cells


def _prepared(folder: Path, sweep: Sweep, manifest: Manifest, fresh: bool) -> Manifest:
    """Make manifest and folder of the shards, in an order in which a kill at any moment does no harm.

    What comes back is the manifest that the folder is to have; a grown one is not written yet.
    """
    _clear_leftovers(folder)
    named, has_shards = folder / SWEEP_FILE, any(shards.own_shards(folder))
    if not (named.exists() or has_shards):
        for name in (*shards.OWN, WALK_FILE):
            if (folder / name).exists():
                raise InputError(f"{folder / name}: in the way of a sweep; move it away, or use another folder")
        write_whole(named, manifest.image())
    elif fresh:
        if not has_shards:
            _is_whole(folder)  # refuses what is not of a sweep
        _clear(folder)
        write_whole(named, manifest.image())
    elif not _is_whole(folder):
        _rebuild(folder, manifest)
    else:
        manifest = continued(folder, sweep, manifest)
    make_folder(folder / "shards")
    return manifest


def _clear(folder: Path) -> None:
    """Delete what a sweep has written, shards first; nothing, if there is something else among them."""
    own, place = [*shards.own_shards(folder)], folder / "shards"
    there = sorted(place.iterdir()) if place.is_dir() else []
    if others := [path for path in there if path not in own]:
        raise InputError(f"{others[0]}: no sweep has written this; move it out of this folder")
    with naming(folder):
        for path in (*own, folder / "sweep.yaml", folder / "log.txt", folder / shards.CRATE):
            path.unlink(missing_ok=True)


def _is_whole(folder: Path) -> bool:
    """Whether sweep.h5 is there and undamaged; an `InputError` if it is of something else or of another version."""
    try:
        read_manifest(folder)
    except DamagedFileError:
        return False
    return True


def _rebuild(folder: Path, manifest: Manifest) -> None:
    """Write a lost or damaged sweep.h5 again, if the shards are those of this sweep; else an `InputError`."""
    path, damaged = folder / SWEEP_FILE, dict[str, str]()
    problem = f"{path}: lost or damaged, and the shards are"
    try:
        read_rows(folder, manifest, damaged)
    except InputError as error:
        if shards.FOREIGN not in str(error):
            raise
        remedy = "use that sweep, with as many samples, or another folder"
        raise InputError(f"{problem} of another sweep; {remedy}") from None
    parts = set()
    for name in {*shards.shard_files(folder)} - damaged.keys():
        with shards.opened_shard(folder, name, manifest.digest, manifest.numerics_version) as shard:
            parts.add(tuple(shard.attrs["part"].tolist()))
    if len(parts) == 1 and manifest.part not in parts:
        raise InputError(f"{problem} of one part of the sweep; use --part {{}}/{{}}".format(*parts.pop()))
    write_whole(path, manifest.image())
    given = folder / "sweep.yaml"
    if given.exists() and given.read_text("utf-8").startswith(_YAML_HEAD):
        given.unlink()  # it may be of fewer samples
    warnings.warn(
        f"{path}: was missing or damaged; it was written again, and all shards are kept", InputWarning, stacklevel=4
    )


def continued(folder: Path, sweep: Sweep, manifest: Manifest) -> Manifest:
    """The manifest of a folder in which a sweep of this manifest is to resume; an `InputError` if it holds another."""
    found = read_manifest(folder)
    shards.check_numerics_of(folder, found.numerics_version)
    if found.part != manifest.part:
        own, wanted = ("{}/{}".format(*part) if part[1] > 1 else "1/1 (all)" for part in (found.part, manifest.part))
        remedy = f"use --part {own}" if found.part[1] > 1 else "remove --part"
        raise InputError(f"{folder}: holds part {own} of its sweep, not {wanted}; {remedy}, or another folder")
    there, asked = ([block.samples_given for block in one.blocks] for one in (found.sweep, sweep))
    ones = [1] * len(there)  # digests by this version, which may know of more fields than that which began the folder
    if len(there) != len(asked) or sweep.digest(ones) != found.sweep.digest(ones):
        raise InputError(
            f"{folder}: holds another sweep ({found.sweep.name}), or this one before it was changed; "
            "use another folder, or fresh, which deletes what is there"
        )
    for count, more, before, block in zip(there, asked, found.sweep.blocks, sweep.blocks, strict=True):
        up_to, key = "up to " if before.until else "", "at_most" if block.until else "samples"
        holds = f"{folder}: holds {up_to}{count} samples of each cell of block {block.name}, but"
        if more < count:
            raise InputError(f"{holds} {more} are requested; use {key}: {count} or more, or another folder")
        if found.part[1] > 1 and bool(before.until) != bool(block.until):
            raise InputError(f"{folder}: parts with and without until have different walks; use another folder")
        if more > count and not SAMPLERS[block.sampler].grows:
            raise InputError(f"{holds} a {block.sampler} design cannot grow; use samples: {count}, or another folder")
    return found if found.sweep.digest() == sweep.digest() else replace(manifest, versions=found.versions)


def _clear_leftovers(folder: Path) -> None:
    """Delete the parts of files that a killed process left."""
    with naming(folder):
        for place in (folder, folder / "shards"):
            for path in place.iterdir() if place.is_dir() else ():
                if _PART.fullmatch(path.name) and (path.is_symlink() or not path.is_dir()):
                    path.unlink(missing_ok=True)
