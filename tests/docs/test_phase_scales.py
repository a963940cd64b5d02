"""The script that finds the time in the law of the phase diagram."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.docs.code_blocks import ROOT
from tests.support.made_sweeps import distance, make_sweep
from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.sweeps.plan import PlannedWalk

SWEEP: dict[str, Any] = {
    "version": 1,
    "name": "scales",
    "seed": 1,
    "preset": "soft",
    "samples": 4,
    "scene": {"start": "spinning"},
    "blocks": [
        {"name": "gravity", "grid": {"gravity": [4.9, 19.6], "links": [60, 90], "frequency": [6]}},
        {
            "name": "links_of_18_mm",
            "parameters": {"link_length": 0.018},
            "distributions": {"link_length": "fixed"},
            "grid": {"links": [60], "frequency": [6, 12]},
        },
    ],
}


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    """The script; those beside it are found as if it were run."""
    sys.path.insert(0, str(ROOT / "docs"))
    import phase_scales

    yield phase_scales
    sys.path.remove(str(ROOT / "docs"))


def test_cells_have_the_quantities_that_were_varied(script: ModuleType, tmp_path: Path) -> None:
    """From an axis or from the block; means and errors are those of the walks at rest."""

    def outcome(walk: PlannedWalk) -> "float | Status | None":
        return Status.NOT_STEADY if walk.sample == 3 else distance(walk)

    result = make_sweep(tmp_path / "folder", SWEEP, outcome)
    rows = script.reduced(result)
    assert [(row["gravity"], row["link_length"], row["links"], row["frequency"]) for row in rows] == [
        (4.9, 0.01268, 60, 6.0),
        (4.9, 0.01268, 90, 6.0),
        (19.6, 0.01268, 60, 6.0),
        (19.6, 0.01268, 90, 6.0),
        (9.809, 0.018, 60, 6.0),
        (9.809, 0.018, 60, 12.0),
    ]
    dx = result.blocks["gravity"].columns["dx"][1, 0, 0, :3]
    assert (rows[2]["walks"], rows[2]["at_rest"]) == (4, 3)
    assert rows[2]["dx_mean"] == pytest.approx(dx.mean())
    assert rows[2]["dx_se"] == pytest.approx(dx.std(ddof=1) / np.sqrt(3))


def test_an_unfinished_or_other_sweep_is_refused(script: ModuleType, tmp_path: Path) -> None:
    """One line says what is wanted."""
    unfinished = make_sweep(tmp_path / "part", SWEEP, lambda walk: None if walk.sample == 3 else distance(walk))
    with pytest.raises(InputError, match="block gravity: walks are missing; run the sweep to its end"):
        script.reduced(unfinished)
    other = {name: value for name, value in SWEEP.items() if name != "blocks"} | {"grid": {"links": [60, 90]}}
    with pytest.raises(InputError, match="block main: no axes links and frequency"):
        script.reduced(make_sweep(tmp_path / "other", other))


@pytest.mark.parametrize("exponents", [(-0.5, 0.5, 0.0), (-0.5, 0.0, 0.5), (-0.3, 0.1, 0.2)])
def test_the_exponents_of_a_made_time_are_found(script: ModuleType, exponents: tuple[float, float, float]) -> None:
    """Cells whose Δx is the curve's with some time have no residual with it, and its exponents are found."""
    curve = script.Curve()
    rows = []
    for gravity, radius, link in [
        (9.809, 0.06, 0.0127),
        (4.0, 0.06, 0.0127),
        (9.809, 0.1, 0.0127),
        (9.809, 0.06, 0.02),
    ]:
        for links, frequency in [(60, 6), (60, 12), (120, 12), (120, 24), (180, 24)]:
            scales = np.array([gravity, radius, link]) / np.array(script.NORMAL)
            turns = 2 * np.pi * radius * frequency / (links * link) * np.prod(scales ** np.array(exponents))
            dx = links * link * curve(np.array([turns]))[0]
            row = {"block": "gravity", "links": links, "frequency": frequency, "gravity": gravity, "radius": radius}
            row |= {"link_length": link, "walks": 10, "at_rest": 10, "dx_mean": dx}
            rows.append({name: str(value) for name, value in row.items()})
    rows.append(rows[0] | {"at_rest": "9", "dx_mean": "1000"})  # too many failures
    cells = script.Cells(rows)
    assert len(cells.names) == 20
    assert np.abs(curve.left(cells, exponents)).max() < 1e-12
    assert np.abs(curve.left(cells, (0.0, 0.0, 0.0))).max() > 0.1
    assert curve.best_exponents(cells, np.arange(20)) == pytest.approx(exponents, abs=1e-4)


def test_the_page_has_the_table_of_the_file(script: ModuleType) -> None:
    """It is rendered from the committed files."""
    page = script.phase_diagram.PAGE.read_text(encoding="utf-8")
    text = script.table(script.Cells(script.phase_diagram.read_rows(script.CSV)), script.Curve())
    assert script.with_tables(page, {"scales": text}) == page, "out of date; run python docs/phase_scales.py"
