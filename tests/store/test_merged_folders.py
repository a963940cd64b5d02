"""One file of several folders: samples of sweeps with different seeds one behind the other."""

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
import yaml

from tests.run.test_sweep_run import BRIEF, TINY
from tests.support.made_sweeps import make_sweep
from tests.support.made_walks import assert_same
from tests.support.sweep_content import blocks, content
from warpchain.cli.main import main
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.run.sweep_run import sweep
from warpchain.store.merged_file import merge as merge_folders
from warpchain.store.sweep_result import load


def merge(*arguments: Path) -> int | str | None:
    """Exit status of the command."""
    with pytest.raises(SystemExit) as done:
        main(["merge", *map(str, arguments)])
    return done.value.code


def test_samples_of_several_folders_are_put_together(tmp_path: Path) -> None:
    """Rows and motions of each folder are at its samples, with its seed; a folder may have grown."""
    given = TINY | {"grid": {"links": [30, 44]}, "scene": BRIEF | {"frequency": 12.0}}
    given |= {"record": {"series": {"samples": [0, 2]}, "frames": {"samples": [2]}}, "samples": 3}
    sweep(given | {"seed": 8}, tmp_path / "a", workers=1)
    for samples in (3, 5):
        sweep(given | {"seed": 9, "samples": samples, "name": "other"}, tmp_path / "b", workers=1)
    assert merge(tmp_path / "a", tmp_path / "b", tmp_path / "both.h5") in (None, 0)
    parts = [load(tmp_path / name) for name in "ab"]
    with xarray.open_dataset(tmp_path / "both.h5", engine="h5netcdf") as data:
        assert data.seed.dims == ("sample",) and data.seed.values.tolist() == ["8"] * 3 + ["9"] * 5
        assert data.attrs["seed"] == "8, 9" and data.attrs["walks"] == 16 and data.attrs["walks_time_limit"] == 16
        assert [each["seed"] for each in json.loads(data.attrs["sweep"])] == [8, 9]
        for name in ("loss_joint_friction", "index", "floor_friction_drawn"):
            np.testing.assert_array_equal(data[name], np.concatenate([part.columns[name] for part in parts], axis=-1))
    both = load(tmp_path / "both.h5")
    for part, sample, place in ((0, 0, 0), (0, 2, 2), (1, 0, 3), (1, 2, 5)):
        for links in (30, 44):
            one, other = parts[part].series(links=links, sample=sample), both.series(links=links, sample=place)
            assert one.setup == other.setup and one.frame_joints.tobytes() == other.frame_joints.tobytes()
            np.testing.assert_array_equal(one.center, other.center)
    assert both.kept.tolist() == [[True, False, True, True, False, True, False, False]] * 2
    assert merge(tmp_path / "both.h5", tmp_path / "again.h5") in (None, 0)
    np.testing.assert_array_equal(load(tmp_path / "again.h5").index, both.index)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (content(), "has walks that a has, of seed 7"),
        (content(samples=5), "has walks that a has, of seed 7"),
        (content(seed=8, grid={"links": [60, 90], "frequency": [5, 12]}), "is not the sweep of"),
        (content(seed=8, options={"tolerance": 1e-5}), "is not the sweep of"),
        (blocks({"grid": {"links": [60, 90]}}, {"grid": {"frequency": [5, 10]}}, seed=8), "is not the sweep of"),
        (content(seed=8, samples=1, distributions={"all": "fixed"}), "block main draws nothing"),
    ],
)
def test_folders_that_do_not_fit_are_refused(
    tmp_path: Path,
    given: dict[str, Any],
    message: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The same walks twice, or other cells, are refused in one line, and no file is written."""
    make_sweep(tmp_path / "a", content())
    make_sweep(tmp_path / "b", given)
    monkeypatch.chdir(tmp_path)
    assert merge(Path("a"), Path("b"), Path("both.h5")) == 2
    error = capsys.readouterr().err.strip()
    assert "error: b: " in error and message in error and "\n" not in error
    assert not (tmp_path / "both.h5").exists()
    assert yaml.safe_load((tmp_path / "b/sweep.yaml").read_text())["name"] == "small"


def test_parts_of_one_grid_are_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run in parts by the command, of one file with other seed and samples, and merged, a sweep is as if run whole."""
    monkeypatch.chdir(tmp_path)
    given = TINY | {"record": {"series": {"samples": [0, 7]}}}
    Path("tiny.yaml").write_text(yaml.safe_dump(given, sort_keys=False), encoding="utf-8")
    numbers = ["--seed", "11", "--samples", "9"]
    names = [f"part-{number}" for number in (1, 2, 3)]
    for number, name in enumerate(names, 1):
        with pytest.raises(SystemExit) as done:
            main(["sweep", "tiny.yaml", "-o", name, "--part", f"{number}/3", "--workers", "1", *numbers])
        assert done.value.code == 1  # all walks end at their time limit
    whole = sweep("tiny.yaml", "whole", seed=11, samples=9, workers=1, progress=False)
    assert [load(name).summary()["missing"] for name in names] == [24, 24, 24]
    assert merge(*map(Path, names), Path("all.h5")) in (None, 0)
    both = load("all.h5")
    for name, column in whole.columns.items():
        assert both.columns[name].tobytes() == column.tobytes(), name
    for links, frequency, sample in itertools.product((30, 44), (5, 15), (0, 7)):
        at = {"links": links, "frequency": frequency, "sample": sample}
        assert_same(both.series(**at), whole.series(**at))
    with pytest.warns(InputWarning, match=r"two\.h5: 12 of 36 walks are missing"):
        merge_folders(["part-1", "part-2"], "two.h5")
    assert merge(Path("part-1"), Path("all.h5"), Path("twice.h5")) == 2
    with pytest.raises(InputError, match=r"holds part 1/3 of its sweep, not 2/3; give --part 1/3"):
        sweep("tiny.yaml", "part-1", seed=11, samples=9, part="2/3")
