"""Files that are damaged or lead elsewhere: each gives what it gave before, or is refused in one line."""

import os
import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.command_line import Command
from tests.support.made_walks import make_walk
from tests.support.synthetic_sweep import SWEEP, run
from warpchain.inputs.validation import InputError
from warpchain.results.sweep_result import load, merge
from warpchain.results.walk_result import load_walk
from warpchain.store.folder import SweepFolder
from warpchain.version import FORMAT_VERSION

FLIPS, SECTOR = 200, 512


def damages(whole: bytes, seed: int) -> Iterator[bytes]:
    """Copies with one wrong bit, with a sector of zeros, and cut short."""
    chance = random.Random(seed)
    for _ in range(FLIPS):
        changed = bytearray(whole)
        changed[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        yield bytes(changed)
    for start in range(0, len(whole), max(SECTOR, len(whole) // 100)):
        yield whole[:start] + bytes(len(whole[start : start + SECTOR])) + whole[start + SECTOR :]
    for _ in range(20):
        yield whole[: chance.randrange(len(whole))]


def sweep_numbers(path: Path) -> Any:
    """All that a reader gets of a sweep."""
    result = load(path)
    blocks = [
        [(name, values.tobytes(), values.dtype) for name, values in {**block.axes, **block.columns}.items()]
        for block in result.blocks.values()
    ]
    return result.sweep, result.seed, result.provenance, blocks


def walk_numbers(path: Path) -> Any:
    """All that a reader gets of a walk."""
    walk = load_walk(path)
    return walk.to_dict(), walk.center.tobytes(), walk.frame_joints.tobytes(), walk.time.tobytes()


@pytest.mark.parametrize("kind", ["shard", "sweep.h5", "walk", "merged"])
def test_damage_is_refused_or_does_no_harm(tmp_path: Path, kind: str) -> None:
    """Flipped bits, zeroed sectors and cuts of any file: one line that names the file, or equal numbers."""
    if kind == "walk":
        path = tmp_path / "walk.h5"
        make_walk().save(path)
        read: Callable[[], Any] = lambda: walk_numbers(path)  # noqa: E731
    else:
        run(tmp_path / "sweep")
        path = tmp_path / "sweep/shards/000001.h5" if kind == "shard" else tmp_path / "sweep/sweep.h5"
        read = lambda: sweep_numbers(tmp_path / "sweep")  # noqa: E731
    if kind == "merged":
        path = tmp_path / "all.h5"
        merge(tmp_path / "sweep", path)
        read = lambda: sweep_numbers(path)  # noqa: E731
    whole, expected, refusals = path.read_bytes(), read(), 0
    for number, damaged in enumerate(damages(whole, seed=17)):
        path.write_bytes(damaged)
        try:
            found = read()
        except InputError as error:
            refusals += 1
            assert str(error).startswith(f"{path}: ") and "\n" not in str(error), number
            continue
        assert found == expected, number
        assert damaged == whole, number
    assert refusals > FLIPS


def test_info_tells_a_damaged_file_from_another(tmp_path: Path, command: Command) -> None:
    """One wrong bit of a merged file is named, with exit status 1; another file is no merged one, 2."""
    run(tmp_path / "sweep")
    path = tmp_path / "all.h5"
    merge(tmp_path / "sweep", path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    answer = command("info", str(path))
    assert answer.status == 1
    assert answer.err.startswith(f"error: {path}: damaged or cut short; ")
    shard = next((tmp_path / "sweep/shards").iterdir())
    answer = command("info", str(shard))
    assert answer.status == 2
    assert answer.err.startswith(f"error: {shard}: expected a warpchain sweep result, got a warpchain shard; use")


@pytest.mark.parametrize("version", [FORMAT_VERSION - 1, FORMAT_VERSION + 1])
def test_files_of_other_versions_are_refused(tmp_path: Path, version: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one line that names the version that reads them; so are files with the checksums of 0.1."""
    path = tmp_path / "walk.h5"
    with monkeypatch.context() as patched:
        patched.setattr("warpchain.hdf5_files.FORMAT_VERSION", version)
        make_walk().save(path)
    newer = version > FORMAT_VERSION
    with pytest.raises(InputError, match="update warpchain$" if newer else "of an earlier warpchain, which reads it"):
        load_walk(path)
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + b"x" * 900 + _OLDER)
    with pytest.raises(InputError, match=f"^{path}: of an earlier warpchain, or damaged; "):
        load_walk(path)


_OLDER = b"\nwarpchain checksums: SHA-256 of 0000000000000908 bytes in pieces, " + b"0" * 64 + b"\n"


# What is in a folder


@pytest.mark.parametrize("name", ["sweep.h5", "lock", "shards/000000.h5", "log.txt"])
def test_pipes_in_a_folder_are_refused(tmp_path: Path, name: str, command: Command) -> None:
    """Nobody waits for a pipe that nobody writes to."""
    run(tmp_path)
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    if name not in ("log.txt", "lock"):
        answer = command("info", str(tmp_path))
        assert answer.status == 2 and answer.err.count("\n") == 1
        assert answer.err.startswith(f"error: {tmp_path / name}: expected a file, got a pipe or a device; ")
    with pytest.raises((InputError, OSError), match=str(tmp_path / name)):
        with SweepFolder.open(tmp_path, SWEEP, shard_size=20) as store:
            store.log("begun")


@pytest.mark.parametrize("name", ["sweep.h5", "sweep.yaml", "shards", "log.txt", "lock"])
@pytest.mark.parametrize("fresh", [False, True])
def test_links_in_a_folder_are_not_followed(tmp_path: Path, name: str, fresh: bool) -> None:
    """Where a sweep writes and deletes, a link is named; what it leads to stays, and the folder is not stuck."""
    folder, kept = tmp_path / "sweep", tmp_path / "kept"
    run(folder)
    (folder / "log.txt").touch()
    shutil.move(folder / name, kept)
    (folder / name).symlink_to(kept)
    before = {path: path.read_bytes() for path in (kept, *kept.glob("*")) if path.is_file()}
    with pytest.raises(InputError, match=f"^{folder / name}: a symbolic link"):
        SweepFolder.open(folder, SWEEP, shard_size=20, fresh=fresh)
    assert {path: path.read_bytes() for path in (kept, *kept.glob("*")) if path.is_file()} == before
    (folder / name).unlink()
    shutil.move(kept, folder / name)
    run(folder, fresh=fresh)
    assert load(folder).missing_count == 0
