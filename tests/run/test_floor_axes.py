"""Slopes, floors, releases and values of links as axes of a sweep."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from pydantic import BaseModel
from pydantic.fields import FieldInfo

import warpchain
from tests.support.sweep_content import content
from warpchain.inputs.fields import FIELDS
from warpchain.inputs.validation import InputError
from warpchain.results.sweep_result import merge
from warpchain.run.sweep_run import sweep_of_keywords
from warpchain.sweeps.block import is_axis
from warpchain.sweeps.plan import load_sweep

STEP = [[-1, 0], [0.1, 0], [0.1, -0.05], [1, -0.05]]
NAMED = {"flat": "flat", "step": STEP}
BRIEF: dict[str, Any] = {
    "samples": 1,
    "options": {"method": "explicit"},
    "distributions": {"all": "fixed"},
    "record": {"series": True},
}


def sweep(out: Path, **changes: Any) -> warpchain.SweepResult:
    """The result of a small sweep."""
    return warpchain.sweep(content(**BRIEF | changes), out, workers=1, progress=False)


def test_heaps_slide_down_slopes_with_the_acceleration_of_a_block(tmp_path: Path) -> None:
    """Over slope × friction of the floor, collapsed chains gain g (sin α − μ cos α) a second."""
    scene = {"start": "ellipse", "links": 12, "frequency": 2, "stop_time": 1.2}
    result = sweep(tmp_path, scene=scene, grid={"slope": [25, 35], "floor_friction": [0.1, 0.2]})
    for degrees, friction in np.ndindex(2, 2):
        angle, mu = np.radians(result.axes["slope"][degrees]), result.axes["floor_friction"][friction]
        walk = result.series(slope=result.axes["slope"][degrees], floor_friction=mu)
        late = walk.time > 0.8
        along = walk.center[late] @ [np.cos(angle), -np.sin(angle)]
        found = 2 * np.polyfit(walk.time[late], along, 2)[0]
        gravity = walk.setup.parameters.gravity
        assert found == pytest.approx(gravity * (np.sin(angle) - mu * np.cos(angle)), rel=1e-4)


def test_named_floors_are_an_axis_of_the_walks_that_each_floor_gives_alone(tmp_path: Path) -> None:
    """Walks are those of a sweep with that floor, to the bit; files, data sets, figures and calls have the names."""
    scene = {"start": "ellipse", "links": 16}
    result = sweep(tmp_path / "all", scene=scene, grid={"floor": NAMED, "frequency": [2, 6]})
    assert result.axes["floor"].tolist() == ["flat", "step"]
    for number, (name, floor) in enumerate(NAMED.items()):
        alone = sweep(tmp_path / name, scene={**scene, "floor": floor}, grid={"frequency": [2, 6]})
        for column, values in alone.blocks["main"].columns.items():
            if column not in ("index", "wall_time"):
                np.testing.assert_array_equal(result.blocks["main"].columns[column][number], values, column)
    merge(tmp_path / "all", tmp_path / "all.h5")
    with xarray.open_dataset(tmp_path / "all.h5", engine="h5netcdf") as merged:
        np.testing.assert_array_equal(merged.dx.sel(floor="step"), result.dx[1])
    again = warpchain.load(tmp_path / "all.h5").walk(floor="step", frequency=6)
    assert [list(point) for point in again.setup.scene.floor] == STEP and again.dx == result.dx[1, 1, 0]
    texts = [text.get_text() for text in result.plot(x="frequency").legends[0].get_texts()]
    assert texts[:2] == ["flat", "step"]
    with pytest.raises(InputError, match=r"^floor: 'steps' is not on the axis; use one of flat, step$"):
        result.walk(floor="steps", frequency=6)


def test_a_sweep_by_keywords_takes_one_floor_or_names_with_floors() -> None:
    """Points are one floor, names with points an axis; releases and values of links likewise, null among them."""
    one = sweep_of_keywords({"links": [40, 60], "floor": STEP, "samples": 1}, "x")
    assert list(one.blocks[0].axes) == ["links"] and [*map(list, one.walk(0).setup.scene.floor)] == STEP
    masses = {"own": None, "heavy": [0.02] * 40}
    lifts = {"none": None, "lift": [[0.1, 0.0, 0.02, 15.0]]}
    both = sweep_of_keywords({"links": 40, "link_masses": masses, "release": lifts, "samples": 1}, "x")
    scenes = [both.walk(index).setup.scene for index in range(4)]
    assert [scene.link_masses for scene in scenes] == [None, None, (0.02,) * 40, (0.02,) * 40]
    assert [scene.release for scene in scenes] == [None, ((0.1, 0.0, 0.02, 15.0),)] * 2
    assert load_sweep(both.canonical()).digest() == both.digest() != one.digest()


def test_a_mapping_that_a_field_takes_is_its_value(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a field whose value may be a mapping, such a one is no axis; names with such mappings are one."""

    class Bowl(BaseModel):
        radius: float

    monkeypatch.setitem(FIELDS, "floor", FieldInfo.from_annotation(Bowl | str))
    assert not is_axis("floor", {"radius": 2.0})
    assert is_axis("floor", {"deep": {"radius": 2.0}, "flat": "flat"}) and is_axis("floor", {"radius": "deep"})


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        ({"floor": [STEP]}, r"floor: expected a name for each value; use e\.g\. floor: \{flat: flat, .*"),
        ({"floor": {"back": [[0, 0], [-1, 0]]}}, r"floor\.back: point 1 lies behind the point before it; .*"),
        ({"floor": {"a step": STEP}}, r"floor\.'a step': expected text of the form .*, got 'a step'"),
        ({"floor": NAMED, "slope": [0, 5]}, r"slope\[1\]: not possible with a profile; .*"),
        (
            {"links": [4], "link_radii": {"wide": [4e-3, 7e-3] * 2}},
            r"link_radii\.wide\[1\]: expected less than half a link, .*",
        ),
        (
            {"release": {"lift": [[0.1, 0, 0.02, 0]]}},
            r"release\.lift: a motion of the sprocket is not possible with start: ellipse.*",
        ),
    ],
)
def test_refusals(grid: dict[str, Any], message: str) -> None:
    """The message names the value on the axis, by its name if it has one, and says what to do."""
    with pytest.raises(InputError, match=rf"^sweep\.grid\.{message}"):
        load_sweep(content(samples=1, scene={"start": "ellipse"}, grid=grid))


@pytest.mark.parametrize("floors", [["flat", STEP], [STEP, STEP[:2]]])
def test_several_values_by_keyword_need_names(floors: list[Any]) -> None:
    """As an axis of a file does."""
    with pytest.raises(InputError, match=r"^sweep\.grid\.floor: expected a name for each value; .*"):
        sweep_of_keywords({"links": 36, "frequency": 20, "floor": floors}, None)
