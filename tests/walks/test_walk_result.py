"""Results of walks: what they hold, and the file that keeps them."""

import re
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest
import xarray

from tests.support.made_walks import assert_same, make_unreleased, make_walk
from warpchain.hdf5_files import Format, Stored, hdf5_image
from warpchain.inputs.validation import InputError
from warpchain.results import walk_result
from warpchain.results.walk_result import WalkResult, load_walk
from warpchain.status import Status
from warpchain.walks.walk_numbers import STORED

# Status


def test_status_says_what_to_try() -> None:
    """Only rest and a finished simulation are good ends; every failure names a remedy, in one line."""
    assert [status for status in Status if status.ok] == [Status.AT_REST, Status.FINISHED, Status.DISTANCE_LIMIT]
    for status in Status:
        assert re.fullmatch(r"[A-Z][^\n]*\.", status.sentence), status
        assert ("; " in status.sentence) == (not status.ok), status


# The file


@pytest.mark.parametrize("make", [make_walk, make_unreleased])
def test_round_trip(make: Callable[[], WalkResult], tmp_path: Path) -> None:
    """A walk read back equals the one saved to the bit, NaN and absent parts included."""
    walk = make()
    walk.save(tmp_path / "walk.h5")
    assert_same(load_walk(tmp_path / "walk.h5"), walk)
    assert [path.name for path in tmp_path.iterdir()] == ["walk.h5"]


def test_xarray_reads_a_walk(tmp_path: Path) -> None:
    """The file of a walk opens as a tree without unnamed dimensions; the walk itself gives the same numbers."""
    walk = make_walk()
    walk.save(tmp_path / "walk.h5")
    with xarray.open_datatree(tmp_path / "walk.h5") as tree:
        assert not any("phony" in str(name) for node in tree.subtree for name in node.dims)
        joints, data = tree["frames/joints"], walk.to_xarray()
        assert joints.dims == ("time", "joint", "axis") and list(joints.axis.values) == ["x", "y"]
        assert (joints.values == walk.frame_joints).all() and (joints.time == walk.frame_time).all()
        assert (tree["series/center"].sel(axis="y") == walk.center[:, 1]).all()
        assert tree["series/kinetic_energy"].attrs["units"] == "J"
    assert data.frame_joints.dims == ("frame_time", "joint", "axis") and data.attrs["status"] == walk.status.label
    assert data.energy_residual == walk.energy["residual"] and (data.center.values == walk.center).all()
    table = walk.to_pandas()
    assert (table.index == walk.time).all() and (table["center_velocity_x"] == walk.center_velocity[:, 0]).all()
    assert make_unreleased().to_pandas().empty and "time" not in make_unreleased().to_xarray().dims


def test_foreign_files_are_refused(tmp_path: Path) -> None:
    """Text, an empty file, other HDF5, and other files of warpchain are told apart."""
    path = tmp_path / "walk.h5"
    with h5py.File(path, "w") as file:
        file["x"] = 1.0
    for content, problem in (
        (path.read_bytes(), "not an HDF5 file of warpchain"),
        (b"dx = 0.6\n", "not an HDF5 file"),
        (b"", "not an HDF5 file"),
        (hdf5_image(Format.of("another kind"), lambda file: None), "expected a warpchain walk, got a another kind"),
    ):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=rf"^{path}: {problem}.*; .*$") as caught:
            load_walk(path)
        assert "\n" not in str(caught.value)


def test_a_file_with_other_fields_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A field that is added without another version makes another format; the wording of a meaning does not."""
    path, unit = tmp_path / "walk.h5", Stored("m", "one meaning")
    assert Format.of("kind", {"dx": unit}) == Format.of("kind", {"dx": Stored("m", "said otherwise")})
    assert Format.of("kind", {"dx": unit}) != Format.of("kind", {"dx": Stored("mm", "one meaning")})
    with monkeypatch.context() as patched:
        patched.setattr(walk_result, "_FORMAT", Format.of("warpchain walk", STORED, {"rebound_height": unit}))
        make_walk().save(path)
    with pytest.raises(InputError, match=f"^{path}: has other fields than .*; run the walk again"):
        load_walk(path)
