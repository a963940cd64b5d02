"""The scripts of the phase diagram: reduction of parts, scaling laws, figures, and the tables of the page."""

import math
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
from warpchain.walks.endings import Ending

SWEEP: dict[str, Any] = {
    "version": 1,
    "name": "part",
    "seed": 1,
    "preset": "soft",
    "samples": 6,
    "scene": {"start": "spinning"},
    "grid": {"links": [30, 60, 90], "frequency": [3, 15]},
}


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    """The script; those beside it are found as if it were run."""
    sys.path.insert(0, str(ROOT / "docs"))
    import phase_diagram

    yield phase_diagram
    sys.path.remove(str(ROOT / "docs"))


@pytest.fixture(scope="module")
def scaling(script: ModuleType) -> ModuleType:
    """The module of the scaling laws."""
    module: ModuleType = script.phase_scaling
    return module


def outcome(walk: PlannedWalk) -> "float | Status | None":
    """Some walks fail, some are missing; the others go their distance."""
    if walk.setup.scene.links == 90 and walk.setup.scene.frequency == 15:
        return Status.NOT_STEADY
    if walk.sample == 4:
        return Status.TIME_LIMIT
    return None if walk.sample == 5 else distance(walk)


# --- reduction ---


def test_parts_are_reduced_together(script: ModuleType, tmp_path: Path) -> None:
    """Means, deviations and counts are those of the walks of all parts; failed and missing ones are counted."""
    other = SWEEP | {"seed": 2, "name": "other", "grid": {"frequency": [15, 24], "links": [60, 90]}}
    parts = [make_sweep(tmp_path / str(number), sweep, outcome) for number, sweep in enumerate((SWEEP, other))]
    walks = script.walks_by_cell(part for number in "01" for part in script.read_part(str(tmp_path / number)))
    assert list(walks) == [(30, 3.0), (30, 15.0), (60, 3.0), (60, 15.0), (60, 24.0), (90, 3.0), (90, 15.0), (90, 24.0)]
    both = script.reduced(60, 15.0, walks[60, 15.0])
    dx = np.concatenate([parts[0].dx[1, 1, :4], parts[1].dx[0, 0, :4]])
    assert both["dx_mean"] == pytest.approx(dx.mean()) and both["dx_sd"] == pytest.approx(dx.std(ddof=1))
    assert both["dx_se"] == pytest.approx(dx.std(ddof=1) / math.sqrt(8))
    assert (both["walks"], both["at_rest"], both["time_limit"], both["missing"]) == (10, 8, 2, 2)
    assert both["bounces_mean"] == 7 and both["in_flight"] == 8 and both["dx_in_flight"] == pytest.approx(dx.mean())
    failed = script.reduced(90, 15.0, walks[90, 15.0])
    assert (failed["at_rest"], failed["not_steady"]) == (0, 12)
    assert math.isnan(failed["dx_mean"]) and math.isnan(failed["dx_sd"]) and math.isnan(failed["dx_50"])


def read(script: ModuleType, *paths: Path) -> dict[tuple[int, float], dict[str, np.ndarray]]:
    """The walks of some parts by cell."""
    walks: dict[tuple[int, float], dict[str, np.ndarray]] = script.walks_by_cell(
        part for path in paths for part in script.read_part(str(path))
    )
    return walks


def test_parts_that_do_not_belong_together_are_refused(script: ModuleType, tmp_path: Path) -> None:
    """The same walks twice, or walks of another kind, would make wrong statistics; the device does not matter."""
    first = tmp_path / "first"
    make_sweep(first, SWEEP)
    for name, change, message in (
        ("again", {"name": "again"}, "walks of another part, the seed is the same"),
        ("scene", {"seed": 2, "scene": {"start": "rest"}}, "other settings than the parts before"),
        ("axes", {"seed": 2, "grid": {"links": [60]}}, "give a sweep of links and frequency"),
    ):
        make_sweep(tmp_path / name, SWEEP | change)
        with pytest.raises(InputError, match=message):
            read(script, first, tmp_path / name)
    apart = {"grid": {"links": [120], "frequency": [3]}, "options": {"device": "cpu"}}
    make_sweep(tmp_path / "apart", SWEEP | apart)
    assert len(read(script, first, tmp_path / "apart")) == 7


def test_a_kept_part_is_reduced_as_its_folder(script: ModuleType, tmp_path: Path) -> None:
    """The file has the columns in single precision and the settings; the walks are those of the folder."""
    make_sweep(tmp_path / "folder", SWEEP, outcome)
    script.keep(str(tmp_path / "folder"), tmp_path / "part.npz")
    folder, file = (read(script, tmp_path / name) for name in ("folder", "part.npz"))
    for cell, walks in folder.items():
        one, other = (script.reduced(*cell, columns) for columns in (walks, file[cell]))
        assert one == pytest.approx(other, rel=1e-6, nan_ok=True)
    with pytest.raises(InputError, match="walks of another part"):
        read(script, tmp_path / "folder", tmp_path / "part.npz")


def test_a_part_may_lack_columns(script: ModuleType, tmp_path: Path) -> None:
    """Without the columns of the collapse no ending is known; without Δx it is no part."""
    status, dx = np.ones((1, 1, 3), np.int8), np.array([[[1.0, 2.0, 3.0]]])
    np.savez(tmp_path / "few.npz", links=[60], frequency=[15.0], status=status, dx=dx)
    ((cell, walks),) = read(script, tmp_path / "few.npz").items()
    row = script.reduced(*cell, walks)
    assert (row["at_rest"], row["dx_mean"], row["told"], row["kept"]) == (3, 2.0, 0, 0)
    assert all(math.isnan(row[name]) for name in ("hold_time_mean", "bounces_mean", "bounces_sd", "attempts_mean"))
    np.savez(tmp_path / "none.npz", links=[60], frequency=[15.0], status=status)
    with pytest.raises(InputError, match="no column dx"):
        script.read_part(str(tmp_path / "none.npz"))


def test_a_damaged_part_is_refused(script: ModuleType, tmp_path: Path) -> None:
    """Cut short, or another kind of file."""
    path = tmp_path / "cut.npz"
    np.savez(path, links=[60], frequency=[15.0])
    for content in (path.read_bytes()[:-40], b"text"):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"cut\.npz: damaged, or no part"):
            script.read_part(str(path))


def test_a_cell_counts_its_endings(script: ModuleType) -> None:
    """Each walk at rest has one ending; means over those of an ending are of these alone."""
    columns = {
        "status": [1, 1, 1, 1, 7],
        "dx": [1.0, 2.0, 3.0, 6.0, np.nan],
        "steps_accepted": [10, 10, 10, 10, 100],
        "steps_rejected": [0, 0, 0, 0, 0],
        "energy_error": [0.0, 0.0, 0.06, 0.0, np.nan],
        "flight_before_collapse": [0.0, 0.0, 0.0, 0.2, np.nan],
        "bounces_before_collapse": [1, 4, 4, 3, -1],
        "bounces_before_self_contact": [1, 2, 2, 3, -1],
        "bounces": [1, 5, 6, 3, 0],
        "walk_time": [1.0] * 5,
        "hold_time": [1.0] * 5,
        "collapsed_at": [0.1, 0.5, 0.7, 0.4, np.nan],
        "self_contact_at": [0.1, 0.2, 0.2, np.nan, np.nan],
        script.TOLD: [True] * 5,
    }
    row = script.reduced(60, 15.0, {name: np.array(values) for name, values in columns.items()})
    assert {way.label: row[way.label] for way in script.WAYS if row[way.label]} == {
        Ending.FIRST.label: 1,
        Ending.FOLDED_AT_SECOND.label: 2,
        Ending.IN_FLIGHT.label: 1,
    }
    assert (row["dx_first"], row["dx_folded_at_second"], row["dx_in_flight"]) == (1.0, 2.5, 6.0)
    assert (row["inaccurate"], row["attempts_mean"], row["not_steady"]) == (1, 28.0, 1)
    assert row["self_contact_at_mean"] == pytest.approx(0.5 / 3)


def test_an_ending_is_compared_with_the_others_of_its_cell(script: ModuleType) -> None:
    """Its walks are none of the others; a cell with few walks on either side tells nothing."""
    cells = {f"{dx}{way.label}": np.zeros(3) for way in script.WAYS for dx in ("", "dx_")}
    cells |= {f"dx_{way.label}": np.full(3, math.nan) for way in script.WAYS}
    for way, number, distance_ in (
        (Ending.FIRST, [200, 99, 900], [1.0, 1.0, 3.0]),
        (Ending.SECOND, [100, 500, 0], [2.0, 2.0, math.nan]),
        (Ending.LATER, [300, 500, 99], [4.0, 2.0, 1.0]),
    ):
        cells[way.label], cells[f"dx_{way.label}"] = np.array(number, float), np.array(distance_)
    np.testing.assert_allclose(script.over_others(cells, [Ending.FIRST]), [1 / 3.5, math.nan, math.nan])
    np.testing.assert_allclose(script.over_others(cells, [Ending.SECOND], [Ending.LATER]), [0.5, 1.0, math.nan])
    both = script.over_others(cells, [Ending.FIRST, Ending.SECOND])
    np.testing.assert_allclose(both, [4 / 3 / 4, (99 + 1000) / 599 / 2, math.nan])
    assert script.text_of_ratios(both) == "0.625 (0.33 to 0.92, 2 cells)"
    assert script.text_of_ratios(both[2:]) == "" and script.text_of_ratios(both[1:]) == "0.917 (one cell)"


def test_the_file_keeps_the_rows(script: ModuleType, tmp_path: Path) -> None:
    """What is written comes back to six digits, NaN included."""
    rows = [{"links": 30, "dx_mean": 1.23456789, "dx_sd": math.nan}, {"links": 40, "dx_mean": 2.0, "dx_sd": 0.5}]
    script.write_csv(rows, tmp_path / "new" / "cells.csv")
    cells = script.read_csv(tmp_path / "new" / "cells.csv")
    np.testing.assert_array_equal(cells["links"], [30, 40])
    np.testing.assert_array_equal(cells["dx_mean"], [1.23457, 2.0])
    np.testing.assert_array_equal(cells["dx_sd"], [math.nan, 0.5])


def test_the_command_draws_and_writes_the_tables(
    script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a small unfinished sweep with cells that failed: the file, both figures or a word why not, and the page."""
    make_sweep(tmp_path / "part", SWEEP, outcome)
    page = tmp_path / "page.md"
    page.write_text("".join(f"<!-- {name} -->\n<!-- end of {name} -->\n" for name in script.TABLES), encoding="utf-8")
    for name, path in (("CSV", tmp_path / "cells.csv"), ("FIGURES", tmp_path), ("PAGE", page)):
        monkeypatch.setattr(script, name, path)
    script.main([str(tmp_path / "part")])
    assert (tmp_path / "phase_diagram.png").stat().st_size > 10_000
    text = page.read_text(encoding="utf-8")
    assert "| 90 |" in text and "| `not_steady` | 6 | 1 | 90 links, 15 Hz |" in text and "too few" in text
    before = (tmp_path / "cells.csv").read_bytes()
    script.main([])
    assert (tmp_path / "cells.csv").read_bytes() == before and page.read_text(encoding="utf-8") == text


# --- laws ---


def made_cells(exponent: float, power: float, noise: float = 0.0) -> dict[str, np.ndarray]:
    """Cells of the law Δx = n^power F(ν n^exponent), with a curve F that is no power."""
    links, frequency = (axis.ravel() for axis in np.meshgrid(np.arange(30.0, 241, 10), np.arange(3.0, 61, 3)))
    x = frequency * links**exponent
    scatter = np.exp(noise * np.random.default_rng(1).normal(size=len(links)))
    top = x.max()
    dx = links**power * (x / top) ** 2 / (1 + 30 * (x / top)) * scatter
    whole = np.full(len(links), 100.0)
    return {"links": links, "frequency": frequency, "dx_mean": dx, "at_rest": whole, "walks": whole}


@pytest.mark.parametrize("exponent", [-1.2, -0.5, 0.0])
def test_the_search_finds_the_exponent_of_a_made_law(scaling: ModuleType, exponent: float) -> None:
    """One variable puts all cells on a curve, and the search finds it; the candidate of that exponent fits as well."""
    points = scaling.points_of(made_cells(exponent, 1.0))
    assert scaling.best_variable(points) == pytest.approx(exponent, abs=0.002)
    assert scaling.drift(points).count(f"{exponent:.2f}") == 2  # no drift: the slower and the faster half agree
    fitting = {-0.5: "Δx/(nℓ) over v²/(g nℓ)", 0.0: "Δx/(nℓ) over ν²ℓ/g"}.get(exponent)
    left = {law.name: scaling.rms_residual(law.x(points), law.y(points)) for law in scaling.CANDIDATES}
    assert all((value < 0.5) == (name == fitting) for name, value in left.items()), left


def test_both_exponents_are_found(scaling: ModuleType) -> None:
    """The power of n beside the variable is found where the curve is no power law."""
    c, d = scaling.best_powers(scaling.points_of(made_cells(-0.8, 0.4)))
    assert (c, d) == (pytest.approx(-0.8, abs=0.01), pytest.approx(0.4, abs=0.02))


def test_errors_are_those_of_the_noise(scaling: ModuleType) -> None:
    """The residual is that of the noise in per cent, and the exponent is right within a few of its errors."""
    points = scaling.points_of(made_cells(-0.5, 1.0, noise=0.05))
    x = points.frequency * points.links**-0.5
    assert scaling.rms_residual(x, points.distance / points.length) == pytest.approx(5.0, rel=0.1)
    (error,) = scaling.bootstrap(points, scaling.best_variable)
    assert 0 < error < 0.05 and abs(scaling.best_variable(points) + 0.5) < 4 * error


def test_a_power_law_is_found(scaling: ModuleType) -> None:
    """Both exponents of a pure power law, without residual."""
    cells = made_cells(0.0, 1.0)
    cells["dx_mean"] = 3e-3 * cells["frequency"] ** 1.7 * cells["links"] ** -0.9
    points = scaling.points_of(cells)
    assert scaling.power_law(points) == pytest.approx((1.7, -0.9))
    assert np.abs(scaling.power_law_residuals(points)).max() < 1e-12


def test_cells_with_many_failures_are_left_out(scaling: ModuleType) -> None:
    """A mean over the walks that were steady may be that of other walks than the rest."""
    cells = made_cells(-0.5, 1.0)
    cells["at_rest"] = np.where(cells["links"] == 30, 94.0, 95.0)
    assert set(scaling.points_of(cells).links) == set(np.arange(40.0, 241, 10))


# --- the page ---


def test_the_page_has_the_tables_of_the_file(script: ModuleType) -> None:
    """All tables but that of the laws are rendered from the committed file; it has the cells of the sweep."""
    cells = script.read_csv(script.CSV)
    page = script.PAGE.read_text(encoding="utf-8")
    tables = {name: render(cells) for name, render in script.TABLES.items() if name != "scaling"}
    assert script.with_tables(page, tables) == page, "out of date; run python docs/phase_diagram.py"
    assert np.array_equal(cells["told"], sum(cells[way.label] for way in script.WAYS))
    assert np.all(cells["told"] <= cells["at_rest"])
    assert np.array_equal(cells["walks"], cells["at_rest"] + sum(cells[code.label] for code in script.FAILURES))


@pytest.mark.slow
def test_the_page_has_the_laws_of_the_file(script: ModuleType) -> None:
    """The table of the laws, with its bootstrap, is that of the committed file."""
    page = script.PAGE.read_text(encoding="utf-8")
    table = script.TABLES["scaling"](script.read_csv(script.CSV))
    assert script.with_tables(page, {"scaling": table}) == page, "out of date; run python docs/phase_diagram.py"


def test_a_page_without_markers_is_refused(script: ModuleType) -> None:
    """Tables are put between markers only."""
    with pytest.raises(ValueError, match="needs <!-- cells --> and <!-- end of cells --> once each"):
        script.with_tables("<!-- cells -->", {"cells": ""})
