"""Files that are damaged or lead elsewhere: each gives what it gave before, or is refused in one line."""

import os
import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.made_walks import make_walk
from tests.support.synthetic_sweep import SWEEP, run
from warpchain.cli.main import main
from warpchain.inputs.validation import InputError
from warpchain.store.folder import SweepFolder
from warpchain.store.merged_file import merge
from warpchain.store.sweep_result import load
from warpchain.version import FORMAT_VERSION
from warpchain.walks.walk_result import load_walk

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


@pytest.mark.parametrize("kind", ["shard", "sweep.json", "walk", "merged"])
def test_damage_is_refused_or_does_no_harm(tmp_path: Path, kind: str) -> None:
    """Flipped bits, zeroed sectors and cuts of any file: one line that names the file, or equal numbers."""
    if kind == "walk":
        path = tmp_path / "walk.h5"
        make_walk().save(path)
        read: Callable[[], Any] = lambda: walk_numbers(path)  # noqa: E731
    else:
        run(tmp_path / "sweep")
        path = tmp_path / "sweep/shards/0-000001.h5" if kind == "shard" else tmp_path / "sweep/sweep.json"
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
        assert kind == "sweep.json" or damaged == whole, number
    assert refusals > FLIPS


def test_info_compares_a_merged_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It shows what it shows of the folder; one wrong bit anywhere is named, and another file is no merged one."""
    run(tmp_path / "sweep")
    path = tmp_path / "all.h5"
    merge(tmp_path / "sweep", path)
    told = []
    for given in (tmp_path / "sweep", path):
        assert status_of("info", given, "--json") in (None, 0)
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] + bytes([whole[len(whole) // 2] ^ 1]) + whole[len(whole) // 2 + 1 :])
    assert status_of("info", path) == 1
    assert capsys.readouterr().err.startswith(f"error: {path}: damaged, cut short or of an earlier warpchain; ")
    shard = next((tmp_path / "sweep/shards").iterdir())
    assert status_of("info", shard) == 2
    assert capsys.readouterr().err.startswith(f"error: {shard}: a warpchain shard, not a warpchain sweep result; give")


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
    with pytest.raises(InputError, match=f"^{path}: damaged, cut short or of an earlier warpchain; "):
        load_walk(path)


_OLDER = b"\nwarpchain checksums: SHA-256 of 0000000000000908 bytes in pieces, " + b"0" * 64 + b"\n"


def status_of(*arguments: object) -> int | str | None:
    """Exit status of the command line."""
    with pytest.raises(SystemExit) as done:
        main([str(word) for word in arguments])
    return done.value.code


# What is in a folder


@pytest.mark.parametrize("name", ["sweep.json", "lock", "shards/0-000000.h5", "log.txt"])
def test_pipes_in_a_folder_are_refused(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Nobody waits for a pipe that nobody writes to."""
    run(tmp_path)
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    if name != "log.txt":
        assert status_of("info", tmp_path) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"error: {tmp_path / name}: a pipe or a device") and error.count("\n") == 1
    with pytest.raises((InputError, OSError), match=str(tmp_path / name)):
        with SweepFolder.open(tmp_path, SWEEP, shard_size=20) as store:
            store.log("begun")


@pytest.mark.parametrize("name", ["sweep.json", "sweep.yaml", "shards", "log.txt", "lock"])
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
