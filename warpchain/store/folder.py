"""The folder of a sweep, as the one process that runs the sweep holds it.

    DIR/sweep.json     what the folder belongs to, see `Manifest`; written first, replaced when the sweep grows
    DIR/sweep.yaml     the resolved sweep, for people and to run again
    DIR/shards/        0-000003.h5 holds the rows of some walks, 0-000003-motion.h5 what is kept of their motion
    DIR/log.txt        what the runs of the sweep did, with times
    DIR/lock           locked by the process that runs the sweep; the system unlocks it when that ends

None of these is a symbolic link when a sweep is run: nothing is written or deleted outside of the folder. A damaged
shard is deleted, named in log.txt and by a warning, and computed again.

A sweep grows when its file is given more samples: the shards that are there stay, 1-000000.h5 and so on join them, see
`warpchain.store.manifest`. Whatever happens between two of these lines, the next `SweepFolder.open` goes on from there.
"""

import datetime
import fcntl
import os
import re
import shutil
import socket
import time
import warnings
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np
import yaml

from warpchain.files import given_path, make_folder, naming, remove_output, write_whole
from warpchain.hdf5_files import open_regular
from warpchain.inputs.validation import DamagedFileError, InputError, InputWarning
from warpchain.store.manifest import OWN, Folder, Manifest, Shard, read_manifest
from warpchain.store.shards import opened_motions, present_shards, read_shard, stamp
from warpchain.sweeps.designs import EXTENSIBLE
from warpchain.sweeps.plan import Sweep
from warpchain.version import NUMERICS_VERSION
from warpchain.walks.rows import Rows

LOCK_TRIES: Final = 5
"""Tries to lock a folder: `running_rate` of another process holds the lock for a moment."""
LOCK_PAUSE: Final = 0.02
"""Time [s] between two of them."""

_PART: Final = re.compile(r"\.(?:sweep|\d+-\d{6,}(?:-motion)?)\.[0-9a-f]{8}\.part\.(?:json|yaml|h5)")
_HOLDER: Final = re.compile(r"process \d+ on \S*")

_YAML_HEAD: Final = """\
# The sweep of this folder with all its values. A copy with more samples adds them to this folder; a copy that is
# changed otherwise needs another folder.
# It names the method that was run: for the one that suits another device, give a copy of it method: standard.
"""


@dataclass(frozen=True)
class SweepFolder(AbstractContextManager["SweepFolder"]):
    """The folder of a sweep, locked against other processes until `close` or the end of this process.

    Attributes:
        directory: the folder.
        manifest: what it belongs to, and how its walks are laid out in shards.
        lock: descriptor of the lock.
    """

    directory: Path
    manifest: Manifest
    lock: int

    @property
    def stamp(self) -> str:
        """What `write_shard` wants of a worker."""
        return stamp(self.directory)

    @classmethod
    def open(
        cls, directory: Folder, sweep: Sweep, *, fresh: bool = False, shard_size: int, part: tuple[int, int] = (1, 1)
    ) -> Self:
        """Begin a sweep in a folder, or go on with it, with more samples if the sweep has more than the folder.

        Args:
            directory: the folder; made if need be.
            sweep: the sweep that is to be in it.
            fresh: delete what a sweep has left in the folder, and begin.
            shard_size: number of walks in a shard of a new folder, or of the walks that are added to a folder; the
                shards that a folder has keep their size.
            part: see `Manifest.part`; a folder keeps the part that it was begun with.

        Raises:
            OSError: the folder cannot be made, locked, read or written.
            InputError: another process holds the folder, it belongs to another sweep or to something else, or a
                shard is foreign. Nothing has been deleted.

        Warns:
            InputWarning: a shard was damaged; its walks are missing now.
        """
        path = given_path(directory)
        make_folder(path)
        _refuse_strangers(path)
        lock = _locked(path)
        try:
            folder = cls(path, _prepared(path, sweep, Manifest.of(sweep, shard_size, part), fresh), lock)
            folder._check()
            folder._describe()
        except BaseException:
            _unlock(lock)
            raise
        return folder

    def log(self, text: str) -> None:
        """Add a line with the time to log.txt; an `OSError` if it cannot be written."""
        path = self.directory / "log.txt"
        now = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
        with naming(path), open(path, "a", encoding="utf-8") as file:
            file.write(f"{now}  {text}\n")

    def missing(self) -> list[Shard]:
        """The shards that are not there yet, in order; errors as of `present_shards`."""
        present = {shard.name for shard in present_shards(self.directory, self.manifest)}
        return [shard for shard in self.manifest.wanted if shard.name not in present]

    def close(self) -> None:
        """Let other processes have the folder."""
        _unlock(self.lock)

    def __exit__(self, *problem: object) -> None:
        """Close."""
        self.close()

    def _check(self) -> None:
        """Refuse a folder with foreign shards, and delete damaged ones."""
        problems, bad = [], {}
        for shard in present_shards(self.directory, self.manifest):
            try:
                read_shard(self.directory, shard)
                if shard.keeps_motion:
                    with opened_motions(self.directory, shard):
                        pass
            except DamagedFileError as error:
                bad[shard] = str(error).partition("; ")[0]
            except InputError as error:
                problems.append(str(error))
        if problems:
            raise InputError(problems[0] + (f" (and {len(problems) - 1} more)" if problems[1:] else ""))
        for shard, problem in bad.items():
            for name in reversed(shard.files):
                remove_output(self.directory / "shards" / name)
            self.log(f"{problem}; deleted, its walks are computed again")
            warnings.warn(f"{problem}; its walks are computed again", InputWarning, stacklevel=4)

    def _describe(self) -> None:
        """Write what the folder says of its sweep, if that is new; sweep.yaml is never older than sweep.json."""
        description = self.directory / "sweep.yaml"
        if read_manifest(self.directory).growth != self.manifest.growth:
            remove_output(description)
            write_whole(self.directory / "sweep.json", self.manifest.text())
        if not description.exists():
            sweep = self.manifest.sweep.canonical()
            text = yaml.safe_dump(sweep, sort_keys=False, allow_unicode=True)
            write_whole(description, _YAML_HEAD + text)


def read_rows(directory: Folder, manifest: Manifest) -> tuple[list[Shard], Rows]:
    """The shards that are in a folder, and the rows of all their walks, shape (walks,); needs no lock, at any moment.

    Raises:
        OSError: the folder or a shard cannot be read.
        InputError: a shard is damaged or foreign.
    """
    shards = present_shards(directory, manifest)
    rows = [np.empty(0, manifest.row_type), *(read_shard(directory, shard) for shard in shards)]
    return shards, np.concatenate(rows)


def running_rate(directory: Folder) -> float | None:
    """Walks per second that the process that runs a sweep has written since it began; None if none runs it.

    The times of the files tell: a run writes the lock when it begins, and then its shards.

    Raises:
        OSError: the folder cannot be read.
        InputError: there is no sweep in it.
    """
    present = present_shards(directory, read_manifest(directory))
    try:
        with open_regular(Path(directory) / "lock") as lock:
            began = os.fstat(lock.fileno()).st_mtime
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        folder = Path(directory) / "shards"
        done = sum(len(shard) for shard in present if (folder / shard.name).stat().st_mtime >= began)
        seconds = time.time() - began  # negative if the clock was set back
        return done / seconds if seconds > 0 else 0.0
    except FileNotFoundError:
        pass
    return None


def _prepared(folder: Path, sweep: Sweep, manifest: Manifest, fresh: bool) -> Manifest:
    """Make manifest and folder of the shards, in an order in which a kill at any moment does no harm.

    Returns:
        The manifest that the folder is to have; a grown one is not written yet.
    """
    _clear_leftovers(folder)
    named = folder / "sweep.json"
    if not named.exists():
        for name in OWN:
            if (folder / name).exists():
                raise InputError(f"{folder / name}: in the way of a sweep; give another folder")
        write_whole(named, manifest.text())
    elif fresh:
        _discard(folder, read_manifest(folder))
        write_whole(named, manifest.text())
    else:
        manifest = _continued(folder, sweep, manifest)
    make_folder(folder / "shards")
    return manifest


def _continued(folder: Path, sweep: Sweep, manifest: Manifest) -> Manifest:
    """The manifest of a folder that is to go on with a sweep, whose manifest in a new folder is given.

    Raises:
        InputError: the folder holds another sweep, or one whose samples do not grow to those of this one.
    """
    found = read_manifest(folder)
    if found.numerics_version != NUMERICS_VERSION:
        raise InputError(
            f"{folder}: its walks are of numerics {found.numerics_version}, but this warpchain has "
            f"{NUMERICS_VERSION}; use the version that began it, give another folder, or start anew with fresh"
        )
    if found.part != manifest.part:
        own, wanted = ("{}/{}".format(*part) if part[1] > 1 else "1/1 (all)" for part in (found.part, manifest.part))
        remedy = f"give --part {own}" if found.part[1] > 1 else "leave --part out"
        raise InputError(f"{folder}: holds part {own} of its sweep, not {wanted}; {remedy}, or another folder")
    digest = found.sweep.digest()  # by this version, which may know of more fields than that which began the folder
    if digest == manifest.digest:
        return found
    there = list(found.growth[-1].samples)
    if len(there) != len(sweep.blocks) or sweep.digest(there) != digest:
        raise InputError(
            f"{folder}: holds another sweep ({found.sweep.name}), or this one before it was changed; "
            "give another folder, or start anew with fresh, which deletes what is there"
        )
    for count, block in zip(there, sweep.blocks, strict=True):
        name, asked, sampler = block.name, block.samples_given, block.sampler
        if asked < count:
            raise InputError(
                f"{folder}: holds {count} samples of each cell of block {name}, but {asked} are asked for; "
                f"give samples: {count} or more, or another folder"
            )
        if asked > count and sampler not in EXTENSIBLE:
            raise InputError(
                f"{folder}: holds {count} samples of each cell of block {name}, but a {sampler} of {asked} samples "
                f"has other points; give samples: {count}, sampler: random from the start, or another folder"
            )
    return manifest.grown_from(found)


def _discard(folder: Path, manifest: Manifest) -> None:
    """Delete what a sweep left, its shards first; nothing if there is a foreign file among them."""
    present_shards(folder, manifest)
    with naming(folder):
        if (folder / "shards").exists():
            shutil.rmtree(folder / "shards")
        for name in ("sweep.yaml", "log.txt"):
            (folder / name).unlink(missing_ok=True)


def _clear_leftovers(folder: Path) -> None:
    """Delete the parts of files that a killed process left."""
    with naming(folder):
        for place in (folder, folder / "shards"):
            for path in place.iterdir() if place.is_dir() else ():
                if _PART.fullmatch(path.name) and (path.is_symlink() or not path.is_dir()):
                    path.unlink(missing_ok=True)


def _refuse_strangers(folder: Path) -> None:
    """Refuse a folder in which a name of the sweep's own is a link, pipe or device; an `InputError`."""
    for path in (folder / name for name in (*OWN, "lock")):
        if path.is_symlink() or (path.exists() and not (path.is_file() or path.is_dir())):
            kind = "a symbolic link" if path.is_symlink() else "a pipe or a device"
            raise InputError(f"{path}: {kind}, where a sweep writes and deletes; remove it, or give another folder")


_held: set[int] = set()
"""Descriptors of the locks of this process. A forked child shares them, and would keep the folder of a killed run
locked; so a child closes them at once."""


def _give_up() -> None:
    while _held:
        os.close(_held.pop())


os.register_at_fork(after_in_child=_give_up)


def _locked(folder: Path) -> int:
    """Lock a folder and say in the lock file who has it; the descriptor of the lock."""
    path = folder / "lock"
    with naming(path):
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        holder = os.pread(descriptor, 200, 0).decode(errors="replace").strip()
        if holder and not _HOLDER.fullmatch(holder):
            raise InputError(f"{path}: in the way of a sweep; give another folder")
        for tries_left in reversed(range(LOCK_TRIES)):
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if not tries_left:
                    raise InputError(
                        f"{folder}: in use by {holder or 'another process'}; wait for it to end, or give another folder"
                    ) from None
                time.sleep(LOCK_PAUSE)
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)
    except BaseException:
        os.close(descriptor)
        raise
    _held.add(descriptor)
    return descriptor


def _unlock(descriptor: int) -> None:
    if descriptor in _held:
        _held.remove(descriptor)
        os.close(descriptor)
