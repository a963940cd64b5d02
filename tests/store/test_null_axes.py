"""Null on an axis: the value that an option has when it is not given, like any other from the file to the figures."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
import yaml

import warpchain
from tests.run.test_sweep_run import TINY
from tests.support.command_line import Command
from tests.support.made_sweeps import make_sweep
from warpchain.inputs.validation import InputError
from warpchain.reports.sweep_figures import figures
from warpchain.results.sweep_result import load, merge
from warpchain.sweeps.plan import load_sweep

AXES = {"load_factor": [None, 1.0], "steady_time": [None, 0.1], "soft_tolerance": [1e-3, None]}


def given(name: str, values: Any, **more: Any) -> dict[str, Any]:
    """A sweep of eight brief walks over an axis."""
    return TINY | {"samples": 2, "grid": {"links": [30, 44], name: values}} | more


@pytest.mark.parametrize("name", AXES)
def test_a_sweep_with_null_on_an_axis_runs_from_yaml_and_from_python(name: str, command: Command) -> None:
    """Both run the same walks, with the option absent at null; their folders can be read, and are gone on with."""
    Path("null.yaml").write_text(yaml.safe_dump(given(name, AXES[name])), encoding="utf-8")
    assert "8 walks" in command("sweep", "null.yaml", "-o", "a", "--workers", "1").out
    values = np.array(AXES[name], dtype=object)
    result, other = warpchain.sweep(given(name, values), "b", workers=1, progress=False), load("a")
    assert result.summary() == other.summary() == {"at_rest": 0, "time_limit": 8, "missing": 0}
    assert result.axes[name].tolist() == other.axes[name].tolist() == AXES[name]
    np.testing.assert_array_equal(result.energy_error, other.energy_error)
    sweep = load_sweep("a/sweep.yaml")
    setups = [sweep.walk(index).setup for index in result.index[0, :, 0].tolist()]
    assert [getattr(setup.scene, name, getattr(setup.options, name, "")) for setup in setups] == AXES[name]
    assert sweep.digest() == result.provenance["digest"] == other.provenance["digest"]
    assert "null" in command("sweep", "a/sweep.yaml", "-o", "a").out
    assert json.loads(command("info", "a", "--json").out)["blocks"]["main"]["axes"][name] == AXES[name]


def test_null_is_nan_in_data_sets_and_a_name_in_figures(tmp_path: Path, command: Command) -> None:
    """xarray, pandas and the merged file have numbers; motions are found by None; figures and the page say null."""
    content = given("load_factor", AXES["load_factor"], scene={}, record={"series": False})
    result = make_sweep(tmp_path / "sweep", content)
    merge(tmp_path / "sweep", tmp_path / "all.h5")
    with xarray.open_dataset(tmp_path / "all.h5", engine="h5netcdf") as merged:
        for data in (merged, result.to_xarray()):
            np.testing.assert_array_equal(data.load_factor, [np.nan, 1.0])
            np.testing.assert_array_equal(data.dx.sel(load_factor=np.nan), result.dx[:, 0])
    np.testing.assert_array_equal(result.to_pandas().load_factor, np.tile([np.nan, np.nan, 1.0, 1.0], 2))
    with pytest.raises(InputError, match=r"^the motion of walk 4 is not there"):
        result.series(links=30, load_factor=None, sample=1)
    assert [text.get_text() for text in result.plot().legends[0].get_texts()][:2] == ["null", "1"]
    assert all(picture.figure for picture in figures(result))
    assert command("report", "sweep").status == 0
    assert ">null</td>" in (tmp_path / "sweep/report.html").read_text(encoding="utf-8")
