"""Files that are damaged, lie, or lead elsewhere: each gives what it gave before, or is refused in one line."""

import itertools
import json
import math
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray

from tests.support.forged_files import forged, with_byte
from tests.support.made_sweeps import make_sweep
from tests.support.made_walks import make_walk
from tests.support.sweep_content import content
from tests.support.synthetic_sweep import SWEEP, run
from warpchain.cli.main import main
from warpchain.hdf5_files import PIECE, put_text
from warpchain.inputs.validation import DamagedFileError, InputError, InputWarning
from warpchain.status import Status
from warpchain.store.folder import SweepFolder
from warpchain.store.manifest_content import with_checksum
from warpchain.store.merged_file import check_merged, merge
from warpchain.store.sweep_result import load
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


def sweep_numbers(folder: Path) -> Any:
    """All that a reader gets of a sweep."""
    result = load(folder)
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
        path = tmp_path / "sweep/shards/000000020-000000039.h5" if kind == "shard" else tmp_path / "sweep/sweep.json"
        read = lambda: sweep_numbers(tmp_path / "sweep")  # noqa: E731
    if kind == "merged":
        path = tmp_path / "all.h5"
        merge(tmp_path / "sweep", path)
        read = lambda: check_merged(path)  # noqa: E731
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


def test_a_merged_file_is_still_one_to_others(tmp_path: Path) -> None:
    """Checksums behind the content are no matter to xarray, which finds out by itself what the file is."""
    run(tmp_path / "sweep")
    merge(tmp_path / "sweep", tmp_path / "all.h5")
    with xarray.open_dataset(tmp_path / "all.h5", group="rest") as data:
        assert data.dx.shape == (3, 2, 20)


def test_info_checks_a_merged_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a whole file says of itself is shown; one wrong bit anywhere is named, and another file is no merged one."""
    run(tmp_path / "sweep")
    path = tmp_path / "all.h5"
    merge(tmp_path / "sweep", path)
    assert status_of("info", path, "--json") in (None, 0)
    found = json.loads(capsys.readouterr().out)
    assert found["title"] == "synthetic" and found["walks"] == 160 and found["walks_missing"] == 0
    whole = path.read_bytes()
    path.write_bytes(with_byte(whole, len(whole) // 2, lambda byte: byte ^ 1))
    assert status_of("info", path) == 1
    assert capsys.readouterr().err.startswith(f"error: {path}: damaged or cut short (somewhere in its bytes ")
    shard = next((tmp_path / "sweep/shards").iterdir())
    assert status_of("info", shard) == 2
    assert capsys.readouterr().err.startswith(f"error: {shard}: HDF5, but no merged sweep; give")


def test_large_files_are_read_in_checked_pieces(tmp_path: Path) -> None:
    """Of a file of many pieces only those in use are read, and each of these is checked."""
    path = tmp_path / "walk.h5"
    joints = np.random.default_rng(3).random((41, 3000, 2))
    walk = make_walk(3000, frame_joints=joints)
    walk.save(path)
    assert path.stat().st_size > 7 * PIECE
    np.testing.assert_array_equal(load_walk(path).frame_joints, joints)
    whole = path.read_bytes()
    for place in (PIECE - 1, PIECE, 5 * PIECE + 7):
        path.write_bytes(with_byte(whole, place, lambda byte: byte ^ 1))
        first = place // PIECE * PIECE
        with pytest.raises(DamagedFileError, match=rf"somewhere in its bytes {first} to {first + PIECE}"):
            load_walk(path)


def status_of(*arguments: object) -> int | str | None:
    """Exit status of the command line."""
    with pytest.raises(SystemExit) as done:
        main([str(word) for word in arguments])
    return done.value.code


def test_a_zeroed_sector_does_not_hang_the_command_line(tmp_path: Path) -> None:
    """What made the HDF5 library loop for ever is refused at once: status 1 and one line."""
    run(tmp_path / "sweep")
    make_walk().save(tmp_path / "walk.h5")
    shard = next((tmp_path / "sweep/shards").iterdir())
    for path, words in ((shard, ("info", tmp_path / "sweep")), (tmp_path / "walk.h5", ("plot", tmp_path / "walk.h5"))):
        whole = path.read_bytes()
        starts = [start for start in range(0, 10 * SECTOR, SECTOR) if any(whole[start : start + SECTOR])]
        assert len(starts) > 2
        for start in starts[-2:]:
            path.write_bytes(whole[:start] + bytes(SECTOR) + whole[start + SECTOR :])
            command = [sys.executable, "-m", "warpchain", *map(str, words)]
            done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=60)
            assert done.returncode == 1 and done.stdout == ""
            assert done.stderr.startswith(f"error: {path}: damaged or cut short") and done.stderr.count("\n") == 1


# Hostile files with right checksums


def external_link(file: h5py.File, name: str, elsewhere: Path) -> None:
    """A link to another file."""
    with h5py.File(elsewhere.with_suffix(".h5"), "w") as other:
        other["x"] = np.arange(801.0)
    del file[name]
    file[name] = h5py.ExternalLink(str(elsewhere.with_suffix(".h5")), "x")


def soft_link(file: h5py.File, name: str, elsewhere: Path) -> None:
    """A link to another dataset."""
    del file[name]
    file[name] = h5py.SoftLink("/series/lowest")


def external_storage(file: h5py.File, name: str, elsewhere: Path) -> None:
    """Numbers out of another file."""
    del file[name]
    file.create_dataset(name, (801,), "<f8", external=[(str(elsewhere), 0, 8 * 801)])


def virtual(file: h5py.File, name: str, elsewhere: Path) -> None:
    """Numbers out of datasets elsewhere."""
    del file[name]
    layout = h5py.VirtualLayout((801,), "<f8")
    layout[:] = h5py.VirtualSource(str(elsewhere), "x", (801,))
    file.create_virtual_dataset(name, layout)


def bomb(file: h5py.File, name: str, elsewhere: Path) -> None:
    """A few bytes that say they are 10^12 numbers."""
    del file[name]
    file.create_dataset(name, (10**12,), "<f8", chunks=(10**6,), compression="gzip")


def unwritten(file: h5py.File, name: str, elsewhere: Path) -> None:
    """10^12 numbers that are nowhere."""
    del file[name]
    file.create_dataset(name, (10**12,), "<f8")


def references(file: h5py.File, name: str, elsewhere: Path) -> None:
    """References to objects in the place of numbers."""
    del file[name]
    file.create_dataset(name, data=np.array([file.ref] * 801, h5py.ref_dtype), dtype=h5py.ref_dtype)


def group(file: h5py.File, name: str, elsewhere: Path) -> None:
    """A group in the place of numbers."""
    del file[name]
    file.create_group(name)


HOSTILE = (external_link, soft_link, external_storage, virtual, bomb, unwritten, references, group)


@pytest.mark.parametrize("change", HOSTILE, ids=lambda change: change.__name__)
def test_a_walk_file_is_read_and_nothing_else(tmp_path: Path, change: Callable[..., None]) -> None:
    """Right checksums do not make a file lead elsewhere, or larger in memory than it is."""
    (tmp_path / "secret").write_bytes(b"secret" * 2000)
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with forged(path) as file:
        change(file, "series/time", tmp_path / "secret")
    with pytest.raises(DamagedFileError, match=rf"^{path}: damaged or cut short \(series/time|^{path}: .*\(time "):
        load_walk(path)


def test_the_number_and_the_limit_are_said(tmp_path: Path) -> None:
    """A file that declares more than it has says how much."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with forged(path) as file:
        unwritten(file, "series/time", tmp_path)
    with pytest.raises(DamagedFileError, match=r"declares 8000000000000 bytes, but the file has \d{6}\)"):
        load_walk(path)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("summary/dx", math.nan, "status at_rest and distance nan"),
        ("series/time", np.linspace(0.8, 0.0, 801), "damaged or cut short"),
        ("series/time", np.linspace(0.0, 0.8, 800), "damaged or cut short"),
        ("series/time", np.linspace(0.0, 0.8, 801, dtype=np.float32), "of another type"),
        ("summary/bounces", 3.5, "of another type"),
        ("frames/joints", np.zeros((41, 30)), "has the shape"),
    ],
)
def test_a_walk_that_lies_is_refused(tmp_path: Path, name: str, value: Any, words: str) -> None:
    """Numbers that no walk has are refused, with right checksums, too."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with forged(path) as file:
        del file[name]
        file[name] = value
    with pytest.raises(DamagedFileError, match=words):
        load_walk(path)


@pytest.mark.parametrize(
    ("attribute", "value"),
    [
        *(("setup", text) for text in ("[" * 10_000, "[]", "3", '{"preset": "soft"}')),
        *(("status", text) for text in ("running", "asleep")),
        *(("seed", text) for text in ('"x"', "[1]", "9" * 5000)),
        *(("versions", text) for text in ("[1]", '{"warpchain": 3}')),
        ("format_version", "five"),
        *(("setup", value) for value in (3, np.arange(3), h5py.Empty("f"))),
    ],
)
def test_odd_attributes_of_a_walk_are_refused(tmp_path: Path, attribute: str, value: Any) -> None:
    """Attributes that are nested, of another type or unknown end in one line."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with forged(path) as file:
        if isinstance(value, str):
            put_text(file, attribute, value)
        else:
            file.attrs[attribute] = value
    with pytest.raises(InputError, match=rf"^{path}: "):
        load_walk(path)


def test_texts_in_a_heap_are_refused(tmp_path: Path) -> None:
    """Texts of any length, on whose heap the HDF5 library can hang, are not read."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with forged(path) as file:
        file.attrs["versions"] = "{}"
    with pytest.raises(DamagedFileError, match="attribute versions is no text or number"):
        load_walk(path)


def lying(name: str, value: Any) -> Callable[[np.ndarray], None]:
    """Rows with another value in the fourth."""

    def change(rows: np.ndarray) -> None:
        rows[name][3] = value

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lying("status", 77), "has no status that ends a walk"),
        (lying("status", Status.RUNNING), "has no status that ends a walk"),
        (lying("status", Status.TIME_LIMIT), "has a distance without being at rest"),
        (lying("dx", math.inf), "none at rest"),
        (lying("index", 9), "not those of the walks at places 0 to 19"),
        (lying("bounces", -2), "has a negative count"),
        (lying("phase_drawn", math.nan), "lacks a quantity that was drawn"),
    ],
)
def test_a_shard_that_lies_is_named_and_computed_again(
    tmp_path: Path, change: Callable[[np.ndarray], None], words: str
) -> None:
    """A reader refuses rows that no walks have; a run names the shard, and leaves the right one in its place."""
    run(tmp_path)
    path = tmp_path / "shards/000000000-000000019.h5"
    whole = path.read_bytes()
    with forged(path) as file:
        rows = file["rows"][()]
        assert rows["status"][3] == Status.AT_REST
        change(rows)
        file["rows"][...] = rows
    with pytest.raises(DamagedFileError, match=rf"^{path}: .*{words}"):
        load(tmp_path)
    with pytest.warns(InputWarning, match=f"{path}: .*; its walks are computed again"):
        run(tmp_path)
    assert path.read_bytes() == whole and words in (tmp_path / "log.txt").read_text()


@pytest.mark.parametrize("rows", [np.zeros(20), np.zeros((20, 2)), np.array([], np.int8)])
def test_rows_of_another_type_are_refused(tmp_path: Path, rows: np.ndarray) -> None:
    """Anything else in the place of the rows is refused."""
    run(tmp_path)
    path = tmp_path / "shards/000000000-000000019.h5"
    with forged(path) as file:
        del file["rows"]
        file["rows"] = rows
    assert status_of("info", tmp_path) == 1


# sweep.json


def rewrite(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change a sweep.json and its checksum."""
    path = folder / "sweep.json"
    given = json.loads(path.read_text())
    for name in ("format", "format_version", "sha256"):
        del given[name]
    change(given)
    path.write_text(json.dumps(with_checksum(given)))


@pytest.mark.parametrize(
    "change",
    [
        lambda given: given.update(walk_count=161),
        lambda given: given.update(shard_size=0),
        lambda given: given.update(shard_size="20"),
        lambda given: given.update(sweep=[]),
        lambda given: given.update(versions=[3]),
        lambda given: given.update(earlier={"digest": "x"}),
        lambda given: given.update(earlier=[{"digest": "0" * 64, "samples": [30, 8], "shard_size": 20}]),
        lambda given: given.update(earlier=[{"digest": "0" * 64, "samples": [10, 8], "shard_size": 20}]),
        lambda given: given.update(more=1),
        lambda given: given.pop("digest"),
        lambda given: given["blocks"][0]["axes"].update(links=[60, 90, 121]),
        lambda given: given["sweep"]["blocks"][0]["grid"].update(links=[60, 90, 121]),
        lambda given: given["sweep"]["blocks"][0]["grid"].update(links=[]),
        lambda given: given["sweep"]["blocks"][0]["grid"].update(links="60"),
        lambda given: given["sweep"]["blocks"][0]["grid"].update(colour=[1]),
        lambda given: given["sweep"]["blocks"][0].update(samples=-1),
        lambda given: given["sweep"]["blocks"][0].update(samples=10**30),
        lambda given: given["sweep"]["blocks"][0].update(samples=10**9),
        lambda given: given["sweep"]["blocks"][0].update(sampler="dice"),
        lambda given: given["sweep"].update(seed=-1),
        lambda given: given["sweep"].update(record={"series": {"interval": "x", "samples": "all"}}),
        lambda given: given["sweep"].update(record=[]),
    ],
)
def test_a_manifest_that_contradicts_itself_is_refused(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], capsys: pytest.CaptureFixture[str]
) -> None:
    """Wrong types and values that do not follow from the sweep end in one line, with the right checksum, too."""
    run(tmp_path)
    rewrite(tmp_path, change)
    assert status_of("info", tmp_path) in (1, 2)
    error = capsys.readouterr().err
    assert error.startswith(f"error: {tmp_path / 'sweep.json'}: ") and error.count("\n") == 1


def test_a_nested_or_large_manifest_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """JSON of any depth, numbers of any length and files of any size end in one line."""
    run(tmp_path)
    for text in ("[" * 10_000 + "]" * 10_000, '{"a":' * 10_000, f'{{"format": {"9" * 5000}}}', " " * 2**25):
        (tmp_path / "sweep.json").write_text(text)
        assert status_of("info", tmp_path) in (1, 2)
        assert capsys.readouterr().err.count("\n") == 1


def test_real_manifests_agree(tmp_path: Path) -> None:
    """Sweeps of every sampler, with presets on an axis, and grown ones, are read."""
    grid = {"preset": ["paper", "soft"], "links": [30, 60]}
    for number, (sampler, drawn) in enumerate(itertools.product(("random", "sobol", "saltelli"), (1, 2))):
        for samples in (2, 4):
            names = ("floor_friction", "phase")[:drawn]
            given = content(preset=None, sampler=sampler, samples=samples, grid=grid)
            given["distributions"] = {"all": "fixed"} | {name: {"uniform": [0.1, 0.3]} for name in names}
            result = make_sweep(tmp_path / str(number), given)
            assert result.missing_count == 0


# What is in a folder


@pytest.mark.parametrize("name", ["sweep.json", "lock", "shards/000000000-000000019.h5", "log.txt"])
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


def test_a_discarded_link_does_not_stick(tmp_path: Path) -> None:
    """A link of that name is removed, not what it leads to."""
    run(tmp_path / "sweep")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("mine")
    (tmp_path / "sweep/.discarded-01234567").symlink_to(tmp_path / "mine")
    run(tmp_path / "sweep")
    assert not os.path.lexists(tmp_path / "sweep/.discarded-01234567")
    assert (tmp_path / "mine/notes.txt").read_text() == "mine"
