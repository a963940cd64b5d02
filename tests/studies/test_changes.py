"""How far results have moved since another revision: cells of both, in units of both standard errors."""

import json
import subprocess
from pathlib import Path

import pytest
from scipy import stats

from studies import changes

HEAD = "; seed 1; python -m studies.small\nlinks,frequency,dx_mean,dx_se\n"


def test_cells_are_told_apart_and_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells that both files have, with an error, are compared; numbers name the same cell however they are written."""
    before = f"# numerics 10 and 12{HEAD}60,15.0,1.00,0.04\n90,15.0,0.5,0\n120,15.0,0.5,0.1\n"
    (tmp_path / "cells.csv").write_text(f"# numerics 18{HEAD}60,15,1.05,0.03\n90,15,0.6,0\n", encoding="utf-8")
    monkeypatch.setattr(changes, "FOLDER", tmp_path)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], 0, before))
    found = changes.moved("cells.csv", "any")
    assert found is not None
    versions, sizes = found
    assert versions == "10, 12"
    assert sizes.to_dict() == pytest.approx({"60, 15": 1.0})


def test_intervals_of_the_paper_become_standard_errors() -> None:
    """Half of a 95 % interval of n pairs is Student's factor times the standard error; single pairs are left out."""
    width = 0.02 * stats.t.ppf(0.975, 4)
    effect = {"value": 0.5, "relative": [[0.1, 0.2]], "half_width": [[width, width]], "pairs": [[5, 1]]}
    text = json.dumps({"sweep": {"numerics_version": 18, "effects": {"k": {"values": [effect]}}}})
    cells = changes.cells_of("numbers.json", text)
    assert cells.loc["sweep effects k values 0.5 0"].to_dict() == pytest.approx({"value": 0.1, "error": 0.02})
    assert len(cells) == 1
