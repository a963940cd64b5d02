"""Files of results beside other programs, which open them, change them, and hold them open."""

import os
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest
import xarray

from tests.support.command_line import Command
from tests.support.made_walks import make_walk
from tests.support.synthetic_sweep import SHARD_SIZE, SWEEP, content, run, synthetic_sweep
from warpchain.inputs.validation import ChangedFileError, DamagedFileError, InputError, InputWarning
from warpchain.results.sweep_result import load, merge
from warpchain.results.walk_result import load_walk
from warpchain.store.folder import SweepFolder
from warpchain.store.shards import read_manifest

ONE_BLOCK = synthetic_sweep({"name": "main", "grid": {"links": [60, 90]}, "samples": 30})


def look(path: Path) -> None:
    """Open a file for writing and close it again, as viewers and notebooks do."""
    h5py.File(path, "r+").close()


def note(path: Path) -> None:
    """Add a note to a file."""
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "mine " * 1000


def cut(path: Path) -> None:
    """Lose the end of a file."""
    os.truncate(path, path.stat().st_size // 2)


def empty(path: Path) -> None:
    """Lose the content of a file, as a power cut may."""
    os.truncate(path, 0)


def test_a_look_changes_nothing(tmp_path: Path, command: Command) -> None:
    """Whoever opens files for writing and changes nothing leaves all bytes; the folder is read and gone on with."""
    run(tmp_path / "sweep", ONE_BLOCK)
    merge(tmp_path / "sweep", tmp_path / "all.h5")
    make_walk().save(tmp_path / "walk.h5")
    before = content(tmp_path)
    for path in tmp_path.rglob("*.h5"):
        look(path)
    assert content(tmp_path) == before
    assert load(tmp_path / "sweep").missing_count == load(tmp_path / "all.h5").missing_count == 0
    assert load_walk(tmp_path / "walk.h5").dx == make_walk().dx
    assert command("info", str(tmp_path / "sweep")).status == 0
    run(tmp_path / "sweep", ONE_BLOCK)


def test_a_change_is_told_from_damage(tmp_path: Path) -> None:
    """A file that another program has added to is whole and named as changed; a cut one is damaged."""
    run(tmp_path / "sweep", ONE_BLOCK)
    merge(tmp_path / "sweep", path := tmp_path / "all.h5")
    whole = path.read_bytes()
    note(path)
    with pytest.raises(ChangedFileError, match=f"^{path}: another program has changed it; merge the folders again"):
        load(path)
    path.write_bytes(whole)
    cut(path)
    with pytest.raises(DamagedFileError, match=f"^{path}: damaged or cut short; ") as caught:
        load(path)
    assert not isinstance(caught.value, ChangedFileError)


def test_a_changed_shard_is_not_deleted(tmp_path: Path) -> None:
    """A run, which deletes damaged shards, refuses one with somebody's note in it."""
    run(tmp_path)
    note(path := tmp_path / "shards/000001.h5")
    before = content(tmp_path)
    with pytest.raises(InputError, match=f"^{path}: another program has changed it; move it out of this folder"):
        run(tmp_path)
    assert content(tmp_path) == before


@pytest.mark.parametrize("harm", [Path.unlink, cut, empty, note])
def test_a_lost_manifest_is_rebuilt_of_the_shards(tmp_path: Path, harm: Callable[[Path], None]) -> None:
    """Without sweep.h5, or with a torn one, a reader says what to do; the sweep file then keeps every shard."""
    run(tmp_path / "whole")
    folder = tmp_path / "sweep"
    run(folder)
    expected = content(folder)
    harm(folder / "sweep.h5")
    with pytest.raises(DamagedFileError, match=r"run the sweep in this folder again; all shards are kept$"):
        load(folder)
    with pytest.warns(InputWarning, match=f"^{folder / 'sweep.h5'}: was missing or damaged; it was written again"):
        with SweepFolder.open(folder, SWEEP, shard_size=SHARD_SIZE) as store:
            assert store.missing() == []
    assert content(folder) == expected == content(tmp_path / "whole")


def test_a_manifest_is_rebuilt_for_the_sweep_of_the_shards_only(tmp_path: Path) -> None:
    """Another sweep, fewer samples or another part is refused, and nothing is touched; more samples are added."""
    folder, block = tmp_path / "sweep", {"name": "main", "grid": {"links": [60, 90]}}
    other = synthetic_sweep({**block, "samples": 30}, seed=7)
    fewer, more = (synthetic_sweep({**block, "samples": samples}) for samples in (20, 40))
    run(folder, ONE_BLOCK, part=(1, 2))
    (folder / "sweep.h5").unlink()
    before = content(folder)
    for sweep, part, problem in (
        (other, (1, 2), "the shards are of another sweep; use that sweep"),
        (fewer, (1, 2), "the shards are of another sweep; use that sweep, with as many samples"),
        (ONE_BLOCK, (1, 1), "the shards are of one part of the sweep; use --part 1/2"),
        (ONE_BLOCK, (2, 2), "the shards are of one part of the sweep; use --part 1/2"),
    ):
        with pytest.raises(InputError, match=problem):
            SweepFolder.open(folder, sweep, shard_size=SHARD_SIZE, part=part)
        assert content(folder) == before
    with pytest.warns(InputWarning, match="written again"):
        run(folder, more, part=(1, 2))
    assert read_manifest(folder).part == (1, 2) and load(folder).summary()["missing"] == 40
    assert "samples: 40" in (folder / "sweep.yaml").read_text()


@pytest.mark.parametrize("harm", [Path.unlink, cut])
def test_fresh_needs_no_manifest(tmp_path: Path, harm: Callable[[Path], None]) -> None:
    """A folder whose sweep.h5 is lost or torn can be begun anew."""
    run(tmp_path)
    harm(tmp_path / "sweep.h5")
    run(tmp_path, ONE_BLOCK, fresh=True)
    assert load(tmp_path).name == "synthetic" and load(tmp_path).walk_count == 60


@pytest.mark.parametrize("first", ["xarray", "warpchain"])
def test_files_are_read_while_others_hold_them_open(tmp_path: Path, first: str) -> None:
    """Xarray, h5py and this package read one file in one process, whichever comes first."""
    run(tmp_path / "sweep", ONE_BLOCK)
    merge(tmp_path / "sweep", path := tmp_path / "all.h5")
    make_walk().save(walk := tmp_path / "walk.h5")
    shard = tmp_path / "sweep/shards/000000.h5"
    if first == "warpchain":
        assert load(path).missing_count == 0
    with xarray.open_dataset(path, engine="h5netcdf") as data, h5py.File(walk), h5py.File(shard), h5py.File(path):
        assert load(path).missing_count == load(tmp_path / "sweep").missing_count == 0
        assert load_walk(walk).dx == make_walk().dx
        assert data["dx"].size == 60
