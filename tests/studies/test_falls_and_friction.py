"""The studies of the tilting plane, the floor's friction and slopes make their tables and figures of made sweeps."""

from pathlib import Path

import pytest

import warpchain
from studies.common import read_rows
from studies.floor_friction import run as friction
from studies.slopes import run as slopes
from studies.tilting_plane import run as falls
from studies.tilting_plane import taps
from tests.support.made_sweeps import make_sweep
from warpchain.inputs.yaml_files import read_yaml
from warpchain.sweeps.plan import PlannedWalk


def test_best_friction_is_that_of_the_furthest_walks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of made walks that go furthest with 0.2; both figures and numbers come of one folder."""
    monkeypatch.setattr(friction, "FIGURE", tmp_path / "distances.png")

    def outcome(walk: PlannedWalk) -> float:
        return 1.0 - abs(walk.setup.parameters.floor_friction - 0.2) + 0.002 * walk.sample

    content = read_yaml(Path(friction.__file__).with_name("sweeps") / "floor_friction.yaml") | {"samples": 2}
    result = make_sweep(tmp_path / "sweep", content, outcome)
    assert (friction.furthest(result.blocks["rest"]) == 0.2).all()
    assert "| 0.2 | 1.001 |" in friction.ledger(result.blocks["rest"], 120, 30.0)
    friction.main(str(tmp_path / "sweep"))
    assert (tmp_path / "distances.png").stat().st_size > 10_000


def test_distances_of_falling_chains_are_compared_with_those_of_fixed_planes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Made walks go a tenth further with each tilt; a folder of another sweep is refused."""
    monkeypatch.setattr(falls, "FOLDER", tmp_path)
    (tmp_path / "README.md").write_text("<!-- tilt -->\n<!-- end of tilt -->\n", encoding="utf-8")

    def outcome(walk: PlannedWalk) -> float:
        return (1.1 if walk.setup.scene.plane == "tilting" else 1.0) * (1 + 0.01 * walk.sample)

    grid = {"links": [60, 120], "frequency": [10, 20]}
    content = {
        "version": 1,
        "name": "tilt",
        "seed": 1,
        "preset": "soft",
        "samples": 4,
        "blocks": [
            {"name": "fixed", "grid": grid},
            {"name": "tilted", "scene": {"plane": "tilting"}, "grid": grid | {"tilt": [0.001, 0.1]}},
        ],
    }
    make_sweep(tmp_path / "sweep", content, outcome)
    falls.main(str(tmp_path / "sweep"))
    assert "| 1.100 ± 0.005 | 1.10, 1.10 |" in (tmp_path / "README.md").read_text(encoding="utf-8")
    assert (tmp_path / "figures" / "falls.png").stat().st_size > 10_000
    make_sweep(tmp_path / "other", {name: content[name] for name in content if name != "blocks"} | {"grid": grid})
    with pytest.raises(warpchain.InputError, match="no blocks fixed and tilted"):
        falls.main(str(tmp_path / "other"))


def test_walks_without_end_are_counted_beside_the_distances_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of made walks those beyond 14° have no end, and no distance; the others go further with the slope."""
    monkeypatch.setattr(slopes, "PAGE", tmp_path / "README.md")
    monkeypatch.setattr(slopes, "FIGURE", tmp_path / "slopes.png")
    names = ("slope", "friction", "stairs")
    markers = "".join(f"<!-- {name} -->\n<!-- end of {name} -->\n" for name in names)
    slopes.PAGE.write_text(markers, encoding="utf-8")

    def outcome(walk: PlannedWalk) -> float | warpchain.Status:
        slope = walk.setup.scene.slope
        return warpchain.Status.DISTANCE_LIMIT if slope > 14 else 2 + slope / 10 + 0.002 * walk.sample

    content = read_yaml(Path(slopes.__file__).with_name("sweeps") / "slopes.yaml") | {"samples": 2}
    make_sweep(tmp_path / "sweep", content, outcome)
    slopes.main(str(tmp_path / "sweep"))
    page = slopes.PAGE.read_text(encoding="utf-8")
    assert "| 60 | 10 | 5 | 2.501 | 0.001 | 0% | – |" in page
    assert "| 120 | 25 | 20 | – | – | 100% |" in page
    assert slopes.FIGURE.stat().st_size > 10_000


def test_taps_are_compared_with_fixed_planes_and_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Made walks go a tenth further with a push; the tap has its value and unit, and that of its block."""
    monkeypatch.setattr(taps, "FOLDER", tmp_path)
    monkeypatch.setattr(taps, "RESULTS", tmp_path / "taps.csv")
    marks = ("taps", "taps by links")
    (tmp_path / "README.md").write_text(
        "".join(f"<!-- {m} -->\n<!-- end of {m} -->\n" for m in marks), encoding="utf-8"
    )

    def outcome(walk: PlannedWalk) -> float:
        return (1.1 if walk.setup.scene.lateral_speed else 1.0) * (1 + 0.01 * walk.sample)

    grid = {"links": [60, 120], "frequency": [10, 20]}
    content = {
        "version": 1,
        "name": "taps",
        "seed": 1,
        "preset": "soft",
        "samples": 4,
        "scene": {"plane": "tilting"},
        "blocks": [
            {"name": "fixed", "scene": {"plane": "fixed"}, "grid": grid},
            {"name": "lateral_speed", "scene": {"tilt": 0.1}, "grid": grid | {"lateral_speed": [0.3]}},
        ],
    }
    make_sweep(tmp_path / "sweep", content, outcome)
    taps.main(str(tmp_path / "sweep"))
    rows = read_rows(taps.RESULTS)
    assert [row["links"] for row in rows] == ["all", "60", "120"]
    assert rows[0]["tap"] == "tilt 0.1 rad, lateral speed 0.3 m/s" and rows[0]["ratio"] == "1.100"
    assert "1.100 ± 0.005 (1.10 to 1.10)" in (tmp_path / "README.md").read_text(encoding="utf-8")
