"""Results of sweeps: arrays with named axes, statistics, xarray, pandas, and the one merged file."""

import math
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from tests.support.command_line import Command
from tests.support.synthetic_sweep import SHARD_SIZE, SWEEP, run, synthetic_rows, synthetic_sweep, write
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.results.sweep_result import load, merge
from warpchain.results.walk_result import load_walk
from warpchain.status import Status
from warpchain.store.folder import SweepFolder
from warpchain.store.shards import Manifest
from warpchain.walks.rows import COLUMNS, STORED_COLUMNS, drawn_column

SINGLE = synthetic_sweep(
    {
        "name": "main",
        "grid": {
            "links": [60, 90],
            "start": ["rest", "ellipse"],
            "self_contact": [False, True],
            "frequency": [5.0, 7.5],
        },
        "samples": 6,
    }
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The complete sweep of two blocks."""
    directory = tmp_path_factory.mktemp("two")
    run(directory)
    return directory


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of one block with axes of all types, walks 20 … 39 missing."""
    directory = tmp_path_factory.mktemp("one")
    run(directory, SINGLE)
    (directory / "shards/000035.h5").unlink()
    return directory


def test_arrays_have_named_axes(folder: Path) -> None:
    """Every walk is where block, cell and sample say, every column under its name and to the bit."""
    result = load(folder)
    assert result.name == "synthetic" and result.seed == SWEEP.seed and list(result.blocks) == ["rest", "ellipse"]
    rows = np.concatenate([synthetic_rows(SWEEP, shard) for shard in Manifest(SWEEP, SHARD_SIZE).wanted])
    rest, ellipse = result.blocks["rest"], result.blocks["ellipse"]
    assert rest.dims == ("links", "frequency", "sample") and rest.shape == rest.dx.shape == (3, 2, 20)
    assert ellipse.dims == ("gravity", "sample") and ellipse.shape == (5, 8)
    assert rest.axes["links"].tolist() == [60, 90, 120] and rest.axes["links"].dtype == np.int64
    assert rest.axes["frequency"].tolist() == [5.0, 12.5]
    assert rest.index[2, 1, 3] == 3 * 11 + 5 and ellipse.index[4, 7] == 7 * 11 + 10
    for name in ("status", *STORED_COLUMNS, *map(drawn_column, rest.drawn)):
        assert getattr(rest, name).tobytes() == np.ascontiguousarray(rows[name][:120]).tobytes(), name
        assert getattr(rest, name).dtype == rows.dtype[name]
    assert set(rest.columns) == {*COLUMNS, "phase_drawn", "floor_friction_drawn", "clearance_drawn"}
    assert set(ellipse.columns) == {*COLUMNS, "phase_drawn", "link_length_drawn"}
    assert result.walk_count == 160 and result.missing_count == 0


def test_missing_walks_are_counted(single: Path) -> None:
    """Walks that are not there have status −1 and NaN; the attributes of an only block are those of the result."""
    result = load(single)
    missing = np.zeros(result.shape, bool)
    missing.ravel()[20:40] = True
    assert result.shape == (2, 2, 2, 2, 6) and sorted(result.index.ravel()) == list(range(96))
    assert ((result.status == -1) == missing).all() and np.isnan(result.dx[missing]).all()
    assert (result.steps_accepted[missing] == -1).all() and np.isnan(result.phase_drawn[missing]).all()
    assert np.isfinite(result.phase_drawn[~missing]).all()
    failed = int((result.status == Status.TIME_LIMIT).sum())
    assert 0 < failed < 30
    assert result.summary() == {"at_rest": 76 - failed, "time_limit": failed, "missing": 20}
    assert result.missing_count == 20 and result.unit("self_contact") == "1"
    assert f"{failed} time_limit, 20 missing" in repr(result)
    assert {"dx", "phase_drawn", "statistics", "summary", "blocks"} <= set(dir(result))


def test_a_sweep_just_begun_is_all_missing(tmp_path: Path) -> None:
    """A folder is read while its sweep runs, from the first moment, without the lock."""
    with SweepFolder.open(tmp_path, SWEEP, shard_size=20):
        assert load(tmp_path).summary() == {"at_rest": 0, "missing": 160}
        (tmp_path / "shards").rmdir()
        result = load(tmp_path)
    assert result.missing_count == 160 and np.isnan(result.blocks["ellipse"].statistics().mean).all()


def test_statistics_are_over_walks_at_rest(tmp_path: Path) -> None:
    """Mean and deviation of known numbers; failed and missing walks are in neither, but counted."""
    sweep = synthetic_sweep({"name": "main", "grid": {"frequency": [10, 20, 30, 40, 50]}, "samples": 4})
    status = [[1, 1, 1, 1], [1, 3, 6, 1], [1, 3, 3, 3], [3, 3, 3, 3]]
    with SweepFolder.open(tmp_path, sweep, shard_size=4) as store:
        for cell, shard in enumerate(store.missing()[:4]):
            rows = synthetic_rows(sweep, shard)
            rows["status"] = status[cell]
            rows["dx"] = np.where(rows["status"] == 1, [1.0, 2.0, 4.0, 5.0], np.nan)
            write(store, shard, rows)
    found = load(tmp_path).statistics()
    assert found.unit == "m" and found.axes["frequency"].tolist() == [10, 20, 30, 40, 50]
    assert found.count.tolist() == [4, 2, 1, 0, 0]
    assert found.failed.tolist() == [0, 2, 3, 4, 0] and found.missing.tolist() == [0, 0, 0, 0, 4]
    np.testing.assert_allclose(found.mean, [3.0, 3.0, 1.0, math.nan, math.nan])
    np.testing.assert_allclose(found.sd, [math.sqrt(10 / 3), math.sqrt(8), *[math.nan] * 3])
    np.testing.assert_allclose(found.standard_error[:2], [math.sqrt(10 / 12), 2.0])
    assert load(tmp_path).statistics("bounces").mean.shape == (5,)


def test_names_that_are_not_there_are_refused(single: Path) -> None:
    """Columns, axes, blocks and figures: one line with the name that is meant; codes of statuses have no mean."""
    result = load(single)
    (block,) = result.blocks.values()
    named: dict[str, Callable[[str], object]] = {"bounce": result.statistics, "bounces_": block.values}
    named |= {"bounced": result.cell_statistics, "bouncess": result.unit, "bounce_s": block.meaning}
    named |= {"bouncy": result.columns.__getitem__, "bounces2": result.plot}
    for name, call in named.items():
        with pytest.raises(InputError, match=f"'{name}'.*; did you mean bounces") as caught:
            call(name)
        assert isinstance(caught.value, KeyError) and "\n" not in str(caught.value)
    for refused in ("status", "index", 3, ["dx"]):
        with pytest.raises(InputError, match="is not a column of numbers; use one of dx, "):
            result.statistics(refused)
    with pytest.raises(InputError, match="'mian': unknown name; did you mean main"):
        result.blocks["mian"]
    with pytest.raises(InputError, match="unknown name; did you mean links"):
        result.axes["link"]
    with pytest.raises(AttributeError, match=r"^bounce: unknown column; did you mean bounces\?$"):
        result.bounce  # noqa: B018


def test_a_sweep_is_no_saved_walk(tmp_path: Path, single: Path) -> None:
    """Its folder and its merged file are refused as one, with the command that saves one of its walks."""
    with pytest.warns(InputWarning, match="20 of .* walks are missing"):
        merge(single, tmp_path / "merged.h5")
    for path in (single, tmp_path / "merged.h5"):
        with pytest.raises(InputError, match=r"use a saved walk; `walk --like SWEEP --index I` saves one"):
            load_walk(path)


def test_no_sweep_no_result(tmp_path: Path, single: Path) -> None:
    """A folder without a sweep, or none at all, is named; a bad shard is no missing one."""
    for nothing, problem in ((tmp_path, "no sweep in this folder"), (tmp_path / "none", "does not exist")):
        with pytest.raises(InputError, match=f"{nothing}: {problem}"):
            load(nothing)
    with pytest.raises(InputError, match=r"sweep\.yaml: not an HDF5 file; use the folder of a sweep"):
        load(single / "sweep.yaml")
    run(tmp_path)
    path = tmp_path / "shards/000001.h5"
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(InputError, match=f"{path}: damaged or cut short; move it"):
        load(tmp_path)


def test_walks_as_a_table(folder: Path) -> None:
    """pandas gets one row for each walk, with block, axes, sample and all that any block draws."""
    table = load(folder).to_pandas()
    assert len(table) == 160 and list(table.columns[:4]) == ["block", "links", "frequency", "sample"]
    assert table["index"].tolist() == SWEEP.indices.tolist()
    row = table[table["index"] == 15 * 11 + 4].iloc[0]
    assert (row.block, row.links, row.frequency, row["sample"]) == ("rest", 120, 5.0, 15)
    assert row.phase_drawn == load(folder).blocks["rest"].phase_drawn[2, 0, 15] and np.isnan(row.link_length_drawn)
    assert table[table.block == "ellipse"].gravity.tolist() == np.repeat([1.6, 3.7, 9.8, 12.0, 24.8], 8).tolist()


def test_a_merged_file_is_read_like_a_folder(folder: Path, single: Path, tmp_path: Path, command: Command) -> None:
    """The same result, which the commands show likewise."""
    for number, given in enumerate((folder, single)):
        path = tmp_path / f"{number}.h5"
        merge(given, path)
        one, other = load(path), load(given)
        assert (one.sweep, one.provenance, list(one.blocks)) == (other.sweep, other.provenance, list(other.blocks))
        for ours, theirs in zip(one.blocks.values(), other.blocks.values(), strict=True):
            for name, values in {**ours.axes, **ours.columns}.items():
                np.testing.assert_array_equal(values, {**theirs.axes, **theirs.columns}[name], err_msg=name)
        assert [command(word, str(path)).status for word in ("info", "plot", "report")] == [0, 0, 0]
    assert (tmp_path / "report.html").exists() and list(tmp_path.glob("*.png"))


def test_merged_file_of_one_block(single: Path, tmp_path: Path) -> None:
    """Plain `xarray.open_dataset` of the merged file gives what the result itself gives."""
    path = tmp_path / "merged.h5"
    merge(single, path)
    expected = load(single).to_xarray()
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert set(data.coords) == {"links", "start", "self_contact", "frequency", "sample"}
        xarray.testing.assert_equal(data, expected)
        assert data.self_contact.dtype == bool and data.start.values.tolist() == ["rest", "ellipse"]
        assert set(data.attrs) == {*expected.attrs, "checksum", "format", "format_version", "format_digest"}
        for name in expected.variables:
            notes = {key: np.array(value).tolist() for key, value in data[name].attrs.items()}
            assert notes == {key: np.array(value).tolist() for key, value in expected[name].attrs.items()}, name
        mean = data.dx.where(data.status == 1).mean("sample")
        np.testing.assert_allclose(mean, load(single).statistics().mean)


def test_a_merged_file_replaces_another_only(folder: Path, single: Path, tmp_path: Path) -> None:
    """An older merged file, of whichever sweep, gives way; any other file is refused and stays."""
    path = tmp_path / "merged.h5"
    merge(single, path)
    merge(folder, path)
    with h5py.File(path) as file:
        assert file.attrs["digest"] == SWEEP.digest()
    shard = next((folder / "shards").iterdir()).read_bytes()
    others = {"my.yaml": b"version: 1\n", "empty.h5": b"", "shard.h5": shard, "cut.h5": path.read_bytes()[:1000]}
    for name, content in others.items():
        (tmp_path / name).write_bytes(content)
    for name in others:
        with pytest.raises(OSError, match=rf"{name}: already exists and is not a merged sweep; use another name$"):
            merge(folder, tmp_path / name)
    assert {name: (tmp_path / name).read_bytes() for name in others} == others
