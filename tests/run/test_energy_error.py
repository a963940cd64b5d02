"""Walks whose energy is not accounted for: too large a tolerance is told, although the chain comes to rest."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.command_line import Command
from tests.support.made_walks import make_unreleased, make_walk
from warpchain.cli.output import print_walk
from warpchain.engine.tallies import CONTACTS
from warpchain.results.sweep_result import load
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.sweep_run import sweep
from warpchain.sweeps.plan import load_sweep
from warpchain.walks.landmarks import FAULTS, LENGTHS
from warpchain.walks.rows import faults_of_columns

COARSE = {
    "grid": {"tolerance": [1e-1, 1e-6]},
    "samples": 1,
    "preset": "paper",
    "scene": {"start": "ellipse", "walk_limit": 0.02, "links": 30},
    "options": {"method": "os32"},
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
    walk, remedy = make_walk(**changed[fault]), FAULTS.get(fault, FAULTS["energy"])
    print_walk(walk)
    table = " ".join(capsys.readouterr().out.split())
    told = (remedy in table, remedy in walk.warnings(), any(w in repr(walk) for w in ("inaccurate", "error")))
    assert told == (part > 1,) * 3


CIRCLES: dict[str, Any] = {
    "a charm": {"charm_radius": 1e-3},
    "a wide charm": {"charm_radius": 6e-3},
    "all narrow": {"link_radii": [2e-3] * 29 + [3e-3]},
    "narrow, and a charm": {"link_radii": [2e-3] * 30, "charm_radius": 1e-3},
    "wide": {"link_radii": [6e-3] * 30},
}


@pytest.mark.parametrize("circles", CIRCLES.values(), ids=CIRCLES)
@pytest.mark.parametrize("drawn", [False, True])
@pytest.mark.parametrize("by", ["scene", "grid"])
def test_the_smallest_circle_tells_what_sank_in(circles: dict[str, Any], drawn: bool, by: str) -> None:
    """A walk and its row of a sweep warn above the radius of the narrowest link, given, on an axis or drawn."""
    brief = {"links": 30, "start": "ellipse"}
    axes = {name: {"own": value} if isinstance(value, list) else [value] for name, value in circles.items()}
    given = {"scene": {**brief, **circles}} if by == "scene" else {"scene": brief, "grid": axes}
    draws = {"all": "fixed"} | ({"circle_radius": {"uniform": [3e-3, 3.5e-3]}} if drawn else {})
    sweep = load_sweep(
        {"version": 1, "name": "s", "seed": 1, "preset": "paper", "samples": 1, "distributions": draws, **given}
    )
    setup = sweep.walk(0).setup
    narrowest = setup.link_values.radius.min()
    lengths = {name: sweep.blocks[0].parameter(name) for name in LENGTHS}
    for depth, sank in ((0.999 * narrowest, False), (1.001 * narrowest, True)):
        walk = make_walk(setup=setup, greatest_penetration=dict.fromkeys(CONTACTS, depth))
        assert (FAULTS["penetration"] in walk.warnings()) == sank
        columns = {f"penetration_{name}": np.array([depth]) for name in CONTACTS}
        columns |= {"energy_error": np.zeros(1), "greatest_opening": np.zeros(1)}
        columns |= {"circle_radius_drawn": np.array([setup.parameters.circle_radius])} if drawn else {}
        assert faults_of_columns(columns, lengths)["penetration"].item() == sank


def test_a_sweep_counts_inaccurate_walks(tmp_path: Path, command: Command) -> None:
    """Column, progress, log, `info` and report tell of the walk with a coarse tolerance, and of no other."""
    seen: list[SweepProgress] = []
    result = sweep(**COARSE, out=tmp_path / "sweep", workers=1, on_progress=seen.append)
    ratio = np.abs(result.energy_residual) / result.energy_at_release
    np.testing.assert_array_equal(result.energy_error, ratio)
    assert result.energy_error[0, 0] > 0.05 > 1e-3 > result.energy_error[1, 0]
    assert result.inaccurate.tolist() == [[True], [False]] and result.inaccurate_count == 1
    assert seen[-1].inaccurate == 1 and "1 inaccurate" in (tmp_path / "sweep/log.txt").read_text()
    assert f"1 inaccurate: {FAULTS['energy']}" in " ".join(command("info", "sweep").out.split())
    assert json.loads(command("info", "sweep", "--json").out)["inaccurate"] == 1
    command("report", "sweep")
    page = (tmp_path / "sweep/report.html").read_text()
    assert "Inaccurate walks" in page and f"energy: 1</h3><p>{FAULTS['energy']}" in page
    assert load(tmp_path / "sweep").unit("energy_error") == "1"
