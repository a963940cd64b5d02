"""Studies of one sweep make their tables and figures of made sweeps; no walk is simulated."""

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from studies.accuracy import run as accuracy
from studies.charm import run as charm
from studies.floor_friction import run as friction
from studies.slopes import run as slopes
from studies.tilting_plane import run as falls
from studies.tilting_plane import taps
from tests.support.made_sweeps import make_sweep
from tests.support.sweep_content import blocks, content
from warpchain import InputError, Status
from warpchain.inputs.yaml_files import read_yaml
from warpchain.sweeps.plan import PlannedWalk

TILTING = {"scene": {"plane": "tilting"}}
GRID = {"links": [60, 120], "frequency": [10, 20]}


def sweep_of(module: ModuleType, **changes: Any) -> dict[str, Any]:
    """The study's own sweep with two samples."""
    (path,) = Path(module.__file__ or "").parent.glob("sweeps/*.yaml")
    return read_yaml(path) | {"samples": 2} | changes


def of_blocks(name: str, *given: Mapping[str, Any]) -> dict[str, Any]:
    """A sweep with four samples in each cell, whose first block has a fixed plane."""
    return blocks({"name": "fixed", "grid": GRID}, *given, name=name, samples=4)


def further(by: float, when: Callable[[PlannedWalk], object]) -> Callable[[PlannedWalk], float]:
    """Walks that go so many times as far when something is so."""
    return lambda walk: (by if when(walk) else 1.0) * (1 + 0.01 * walk.sample)


def endless(walk: PlannedWalk) -> float | Status:
    """Walks beyond 14° have no end; the others go further with the slope."""
    slope = walk.setup.scene.slope
    return Status.DISTANCE_LIMIT if slope > 14 else 2 + slope / 10 + 0.002 * walk.sample


MADE: dict[str, tuple[ModuleType, dict[str, Any], Callable[..., Any], list[str]]] = {
    "charm": (
        charm,
        sweep_of(charm, blocks=[sweep_of(charm)["blocks"][0] | {"samples": 2}]),
        lambda walk: 1.0 - walk.setup.scene.charm_mass + 0.002 * (walk.sample - 0.5),
        ["| 0 | 1.000 (0.001) |", "| 100 | 0.900 (0.001) |"],
    ),
    "slopes": (
        slopes,
        sweep_of(slopes),
        endless,
        ["| 5° | 2.50 | 2.50 |", "| 15° | – (100 %) |", "| 120 links | 2.00 |"],
    ),
    "tilts": (
        falls,
        of_blocks("tilt", {"name": "tilted", "grid": GRID | {"tilt": [0.001, 0.1]}} | TILTING),
        further(1.1, lambda walk: walk.setup.scene.plane == "tilting"),
        ["| 1.100 ± 0.005 | 1.10, 1.10 |"],
    ),
    "taps": (
        taps,
        of_blocks(
            "taps",
            {
                "name": "lateral_speed",
                "scene": {"plane": "tilting"},
                "grid": GRID | {"lateral_speed": [0.3]},
            },
        ),
        further(1.1, lambda walk: walk.setup.scene.lateral_speed),
        ["| lateral speed 0.3 m/s |", "| 1.100 (1.10–1.10) |"],
    ),
    "floor friction": (
        friction,
        sweep_of(friction),
        lambda walk: 1.0 - abs(walk.setup.parameters.floor_friction - 0.2) + 0.002 * walk.sample,
        [],
    ),
}
"""Study, sweep, what its walks give, and what its page then has."""


@pytest.mark.parametrize("name", MADE)
def test_what_was_put_in_stands_on_the_page(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables have the numbers of the made walks, and the figure of the study is drawn."""
    module, given, outcome, expected = MADE[name]
    shutil.copy(module.FOLDER / "README.md", tmp_path)
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    monkeypatch.setattr(charm, "TIMES", (0.0, 0.01))  # its loops walk for a moment
    result = make_sweep(tmp_path / "sweep", given, outcome)
    module.main(str(tmp_path / "sweep"))
    page = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert [line for line in expected if line not in page] == []
    assert name == "taps" or [path.stat().st_size > 10_000 for path in (tmp_path / "figures").iterdir()] == [True]
    if module is friction:
        assert (friction.furthest(result.blocks["rest"]) == 0.2).all()
        assert "| 0.2 | 1.001 |" in page


def test_walks_of_two_sweeps_are_compared_in_pairs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Scatter that samples share cancels; a tenth more is found, and sweeps of other cells are refused."""
    monkeypatch.setattr(accuracy, "FOLDER", tmp_path)
    folders = [str(tmp_path / name) for name in ("base", "tenth", "other")]
    for folder, by in zip(folders, (1.0, 1.1, 1.0), strict=True):
        given = content(grid={"links": [60]}) if folder == folders[2] else content()
        make_sweep(Path(folder), given, further(by, lambda walk: True))
    accuracy.main(folders[1], folders[0])
    shown = capsys.readouterr().out
    assert shown.count("+10.00 ± 0.00 % (3 pairs)") == 4 and "mean of 4 cells +10.000 ± 0.000 %" in shown
    with pytest.raises(InputError, match="other cells"):
        accuracy.main(folders[0], folders[2])
    with pytest.raises(InputError, match="not one block with points"):
        accuracy.main(folders[0])
    points = {"method": ["os32", "os32", "dp5"], "tolerance": [1e-3, 1e-4, 1e-4]}
    methods = content(grid={"links": [60]}, points=points, same_samples_along=["point"])
    make_sweep(tmp_path / "methods", methods, further(1.1, lambda walk: walk.setup.options.tolerance == 1e-3))
    (tmp_path / "README.md").write_text("<!-- small -->\n<!-- end of small -->\n", encoding="utf-8")
    accuracy.main(str(tmp_path / "methods"))
    page = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "| `os32` | 0.001 | 14 | +10.00 ± 0.00 |" in page and "| `os32` | 0.0001 | 14 | +0.00 ± 0.00 |" in page
    with pytest.raises(InputError, match="no blocks fixed and tilted"):
        falls.main(folders[0])
