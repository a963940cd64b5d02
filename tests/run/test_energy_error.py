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


@pytest.mark.parametrize(("residual", "warned"), [(0.199, False), (-0.199, False), (0.201, True), (-0.201, True)])
def test_a_walk_warns_above_five_per_cent(residual: float, warned: bool, capsys: pytest.CaptureFixture[str]) -> None:
    """The table of the command line, the line of Python and the facts of a notebook all say so, or none does."""
    ledger = make_walk().energy | {"kinetic_at_release": 3.0, "potential_at_release": 1.0, "residual": residual}
    walk = make_walk(energy=ledger)
    print_walk(walk)
    table = " ".join(capsys.readouterr().out.split())
    assert (ENERGY_REMEDY in table) == warned
    assert ("energy error 5.0e-02" in repr(walk)) == warned
    assert (ENERGY_REMEDY in walk.warnings()) == warned


@pytest.mark.parametrize(("fault", "limit"), [("opening", "link_length"), ("penetration", "circle_radius")])
@pytest.mark.parametrize("part", [0.999, 1.001])
def test_a_walk_warns_of_joints_that_came_apart_and_circles_that_sank_in(
    fault: str, limit: str, part: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """Joints opened by more than a link length, or circles sunk in by more than their radius, are no clean result."""
    whole = make_walk()
    size = part * getattr(whole.setup.parameters, limit)
    depths = whole.greatest_penetration | {"self": size}
    walk = make_walk(**({"greatest_opening": size} if fault == "opening" else {"greatest_penetration": depths}))
    print_walk(walk)
    warned = part > 1
    assert (FAULTS[fault] in " ".join(capsys.readouterr().out.split())) == warned
    assert (FAULTS[fault] in walk.warnings()) == warned
    assert ("inaccurate" in repr(walk)) == warned


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
