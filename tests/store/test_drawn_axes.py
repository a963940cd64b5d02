"""A grid axis over a quantity that is drawn as well: the axis and what was drawn are two things everywhere."""

from pathlib import Path

import numpy as np
import pytest
import xarray
from matplotlib.text import Text

from tests.support.made_sweeps import distance, make_sweep
from tests.support.sweep_content import content
from warpchain.reports.sweep_figures import figures
from warpchain.reports.sweep_page import write_report
from warpchain.results.sweep_result import SweepResult, load, merge

VALUES = {"floor_friction": 0.27, "clearance": 0.01, "tilt": 0.5}


def swept(folder: Path, name: str) -> SweepResult:
    """A made sweep with an axis over a quantity that is drawn about each of its values."""
    value = VALUES[name]
    drawn = {"all": "fixed", name: {"gaussian": {"sigma": 1e-5 * value}}}
    scene = {"plane": "tilting" if name == "tilt" else "fixed"}
    return make_sweep(folder, content(scene=scene, grid={name: [value, 1.001 * value]}, distributions=drawn), distance)


@pytest.mark.parametrize("name", VALUES)
def test_an_axis_over_a_drawn_quantity_is_exported(name: str, tmp_path: Path) -> None:
    """Arrays, xarray, pandas, the merged file, figures and the page hold both, each under a name of its own."""
    result = swept(tmp_path / "sweep", name)
    axis = np.array([VALUES[name], 1.001 * VALUES[name]])
    drawn = getattr(result, f"{name}_drawn")
    assert result.axes[name].tolist() == axis.tolist()
    assert drawn.shape == (2, 3) and len(set(drawn.ravel())) == 6
    np.testing.assert_allclose(drawn, axis[:, None] * np.ones(3), rtol=1e-4)  # centred on the grid value
    assert result.unit(f"{name}_drawn") == result.unit(name)
    assert result.meaning(f"{name}_drawn") != result.meaning(name)

    data = result.to_xarray()
    assert data[name].values.tolist() == axis.tolist() and data[name].dims == (name,)
    assert data[f"{name}_drawn"].dims == (name, "sample")
    np.testing.assert_array_equal(data[f"{name}_drawn"], drawn)

    merge(tmp_path / "sweep", tmp_path / "merged.h5")
    with xarray.open_dataset(tmp_path / "merged.h5", engine="h5netcdf") as merged:
        assert merged[name].values.tolist() == axis.tolist()
        np.testing.assert_array_equal(merged[f"{name}_drawn"], drawn)

    assert all(picture.name and picture.figure for picture in figures(result))
    write_report(tmp_path / "sweep", tmp_path / "report.html")
    assert name in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_parameter_sets_are_an_axis_with_columns(tmp_path: Path) -> None:
    """Figures, xarray and the merged file have the sets along `point`, and what stands in each beside it."""
    points = {"floor_friction": [0.1, 0.2, 0.3], "load_factor": [None, 1.0, 2.0]}
    result = make_sweep(tmp_path / "sets", content(points=points, grid={"links": [60, 90]}), distance)
    assert "parameter set" in {text.get_text() for text in result.plot().findobj(Text)}
    merge(tmp_path / "sets", tmp_path / "sets.h5")
    assert load(tmp_path / "sets.h5").design().equals(result.design())
    with xarray.open_dataset(tmp_path / "sets.h5", engine="h5netcdf") as merged:
        for data in (merged, result.to_xarray()):
            assert set(data.coords) == {"point", "links", "sample", *points}
            np.testing.assert_array_equal(data.floor_friction, points["floor_friction"])
            np.testing.assert_array_equal(data.load_factor, [np.nan, 1.0, 2.0])
            assert data.floor_friction.attrs["symbol"] == "μ_fc"
