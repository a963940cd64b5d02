"""The study of charms makes its tables and its figure of a made sweep."""

from pathlib import Path

import pytest

from studies.charm import run as charm
from tests.support.made_sweeps import make_sweep
from warpchain.inputs.yaml_files import read_yaml
from warpchain.sweeps.plan import PlannedWalk


def test_distances_by_the_mass_of_the_charm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of made walks that go less far by the metre per kilogram; the loops of the figure walk for a moment."""
    monkeypatch.setattr(charm, "FOLDER", tmp_path)
    monkeypatch.setattr(charm, "FIGURE", tmp_path / "charm.png")
    monkeypatch.setattr(charm, "TIMES", (0.0, 0.01))
    (tmp_path / "README.md").write_text("<!-- ellipse -->\n<!-- end of ellipse -->\n", encoding="utf-8")

    def outcome(walk: PlannedWalk) -> float:
        return 1.0 - walk.setup.scene.charm_mass + 0.002 * (walk.sample - 0.5)

    content = read_yaml(Path(charm.__file__).with_name("sweeps") / "charm.yaml")
    content["blocks"] = [content["blocks"][0] | {"samples": 2}]
    make_sweep(tmp_path / "sweep", content, outcome)
    charm.main(str(tmp_path / "sweep"))
    page = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "| 60 | 15 | 100 | 0.900 ± 0.001 |" in page and "| 120 | 25 | 0 | 1.000 ± 0.001 |" in page
    assert (tmp_path / "charm.png").stat().st_size > 10_000
