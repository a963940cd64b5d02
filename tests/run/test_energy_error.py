"""Walks whose energy is not accounted for: too large a tolerance is told, although the chain comes to rest."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.support.made_walks import make_unreleased, make_walk
from warpchain.cli.main import main
from warpchain.cli.terminal import print_walk
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.sweep_run import sweep
from warpchain.store.sweep_result import load
from warpchain.walks.faults import ENERGY_REMEDY, FAULTS

COARSE = {
    "grid": {"tolerance": [1e-1, 1e-6]},
    "samples": 1,
    "preset": "paper",
    "scene": {"start": "ellipse", "walk_limit": 0.02, "links": 30},
    "options": {"method": "dp5"},
}
"""Two walks, of which the first has a tolerance that does not suit its stiff joints."""


def test_energy_error_is_relative_to_kinetic_and_potential_energy_at_release() -> None:
    """|residual| over both energies at the release, whatever was lost; NaN for a chain that was never released."""
    ledger = make_walk().energy | {"kinetic_at_release": 3.0, "potential_at_release": 1.0, "residual": -0.5}
    assert make_walk(energy=ledger).energy_error == 0.125 == make_walk(energy=ledger).to_dict()["energy_error"]
    assert math.isnan(make_unreleased().energy_error)


@pytest.mark.parametrize(
    ("fault", "limit"), [("energy", None), ("opening", "link_length"), ("penetration", "circle_radius")]
)
@pytest.mark.parametrize("part", [0.995, 1.005])
def test_a_walk_warns(fault: str, limit: str | None, part: float, capsys: pytest.CaptureFixture[str]) -> None:
    """Above 5 % of energy, joints opened by a link length, circles sunk in by a radius: table, line and notebook."""
    whole = make_walk()
    size = part * (0.2 if limit is None else getattr(whole.setup.parameters, limit))
    ledger = whole.energy | {"kinetic_at_release": 3.0, "potential_at_release": 1.0, "residual": -size}
    changed = {
        "energy": {"energy": ledger},
        "opening": {"greatest_opening": size},
        "penetration": {"greatest_penetration": whole.greatest_penetration | {"self": size}},
    }
    walk, remedy = make_walk(**changed[fault]), FAULTS.get(fault, ENERGY_REMEDY)
    print_walk(walk)
    table = " ".join(capsys.readouterr().out.split())
    told = (remedy in table, remedy in walk.warnings(), any(w in repr(walk) for w in ("inaccurate", "error")))
    assert told == (part > 1,) * 3


def test_a_sweep_counts_inaccurate_walks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Column, progress, log, `info` and report tell of the walk with a coarse tolerance, and of no other."""
    seen: list[SweepProgress] = []
    result = sweep(**COARSE, out=tmp_path / "sweep", workers=1, on_progress=seen.append)
    ratio = np.abs(result.energy_residual) / result.energy_at_release
    np.testing.assert_array_equal(result.energy_error, ratio)
    assert result.energy_error[0, 0] > 0.05 > 1e-3 > result.energy_error[1, 0]
    assert result.inaccurate.tolist() == [[True], [False]] and result.inaccurate_count == 1
    assert seen[-1].inaccurate == 1 and "1 inaccurate" in (tmp_path / "sweep/log.txt").read_text()
    for arguments in (["info"], ["info", "--json"], ["report"]):
        with pytest.raises(SystemExit):
            main([arguments[0], str(tmp_path / "sweep"), *arguments[1:]])
    told = capsys.readouterr().out
    assert f"1 inaccurate: {ENERGY_REMEDY}" in " ".join(told.split())
    assert json.loads(told[told.index("{") : told.rindex("}") + 1])["inaccurate"] == 1
    page = (tmp_path / "sweep/report.html").read_text()
    assert "Inaccurate walks" in page and f"energy: 1</h3><p>{ENERGY_REMEDY}" in page
    assert load(tmp_path / "sweep").unit("energy_error") == "1"
