"""The study of the phase diagram: endings, reduction of parts, scaling laws, and that its tables are of its files."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.common import drawn_terms, read_columns, write_rows
from studies.phase_diagram import candidates, cells, laws, run, strands
from studies.phase_diagram.endings import Ending, endings
from tests.support.made_sweeps import distance, make_sweep
from warpchain import Status
from warpchain.sweeps.plan import PlannedWalk

NAN = math.nan
SWEEP: dict[str, Any] = {
    "version": 1,
    "name": "part",
    "seed": 1,
    "preset": "soft",
    "samples": 6,
    "scene": {"start": "spinning"},
    "grid": {"links": [30, 60, 90], "frequency": [3, 15]},
}


@pytest.mark.parametrize(
    ("columns", "ending"),
    [
        ((-1, NAN, -1, NAN), Ending.UNKNOWN),
        ((Status.NOT_STEADY, NAN, -1, NAN), Ending.UNKNOWN),
        ((Status.TIME_LIMIT, 0.5, 3, 0.0), Ending.UNKNOWN),
        ((Status.AT_REST, NAN, -1, NAN), Ending.KEPT),
        ((Status.AT_REST, 0.03, 0, NAN), Ending.IN_FLIGHT),
        ((Status.AT_REST, 0.5, 1, 0.011), Ending.IN_FLIGHT),
        ((Status.AT_REST, 0.5, 1, 0.009), Ending.FIRST),
        ((Status.AT_REST, 0.5, 1, 0.0), Ending.FIRST),
        ((Status.AT_REST, 0.5, 2, 0.0), Ending.SECOND),
        ((Status.AT_REST, 0.5, 7, 0.0), Ending.LATER),
    ],
)
def test_every_case_has_its_ending(columns: tuple[int, float, int, float], ending: Ending) -> None:
    """Status first, then where the loop collapsed, then in which bounce."""
    names = ("status", "collapsed_at", "bounces_before_collapse", "flight_before_collapse")
    assert endings({name: np.array([value]) for name, value in zip(names, columns, strict=True)}).tolist() == [ending]


def outcome(walk: PlannedWalk) -> "float | Status | None":
    """Some walks fail, some are missing; the others go their distance."""
    if walk.setup.scene.links == 90 and walk.setup.scene.frequency == 15:
        return Status.NOT_STEADY
    if walk.sample == 4:
        return Status.TIME_LIMIT
    return None if walk.sample == 5 else distance(walk)


def test_parts_are_reduced_together(tmp_path: Path) -> None:
    """Means, deviations and counts are those of the walks of all parts; failed and missing ones are counted."""
    other = SWEEP | {"seed": 2, "name": "other", "grid": {"frequency": [15, 24], "links": [60, 90]}}
    parts = [make_sweep(tmp_path / str(number), sweep, outcome) for number, sweep in enumerate((SWEEP, other))]
    walks = cells.walks_by_cell(parts)
    assert list(walks) == [(30, 3.0), (30, 15.0), (60, 3.0), (60, 15.0), (60, 24.0), (90, 3.0), (90, 15.0), (90, 24.0)]
    both = cells.reduced(60, 15.0, walks[60, 15.0])
    dx = np.concatenate([parts[0].dx[1, 1, :4], parts[1].dx[0, 0, :4]])
    assert both["dx_mean"] == pytest.approx(dx.mean()) and both["dx_sd"] == pytest.approx(dx.std(ddof=1))
    assert both["dx_se"] == pytest.approx(dx.std(ddof=1) / math.sqrt(8))
    assert (both["walks"], both["at_rest"], both["time_limit"], both["missing"]) == (10, 8, 2, 2)
    assert both["bounces_mean"] == 7
    assert both["in_flight"] == 8
    failed = cells.reduced(90, 15.0, walks[90, 15.0])
    assert (failed["at_rest"], failed["not_steady"]) == (0, 12)
    assert math.isnan(failed["dx_mean"]) and math.isnan(failed["dx_sd"]) and math.isnan(failed["dx_50"])


def test_meetings_of_strands_are_counted(tmp_path: Path) -> None:
    """Every walk at rest has each event once, and one way of ending; early walks are compared with late ones."""
    rows = list(strands.reduced([make_sweep(tmp_path / "made", SWEEP | {"name": "strands"}, outcome)]))
    write_rows(tmp_path / "strands.csv", rows)
    made = read_columns(tmp_path / "strands.csv")
    assert made["at_rest"].tolist() == [4, 4, 4, 4, 4, 0] and made["walks"].tolist() == [5, 5, 5, 5, 5, 6]
    for event in strands.EVENTS:
        assert sum(made[f"{event}_{key}"] for key in strands.BEGUN).tolist() == made["at_rest"].tolist()
    assert sum(made[f"{way.label}_{k}"] for way in strands.WAYS for k in range(3)).sum() == 20


def test_an_early_meeting_is_told_from_what_is_drawn() -> None:
    """Of walks that go a tenth less far, and met early where a drawn quantity shortens them, the tenth is found."""
    drawn, phase, noise = np.random.default_rng(1).normal(size=(3, 4000))
    early = drawn + noise > 0
    found = strands._early(1 - 0.1 * early - 0.05 * drawn, early, drawn_terms({"a_drawn": drawn, "phase_drawn": phase}))
    assert found["held"] == pytest.approx(-0.1, rel=0.03) and found["raw"] < -0.14


def test_the_error_of_an_early_meeting_knows_of_unequal_scatter() -> None:
    """Where the few that met early scatter three times as far as the others, the error is the scatter of the result."""
    random = np.random.default_rng(2)
    early, found = np.arange(80) < 12, []
    for _ in range(300):
        drawn, phase = random.normal(size=80), random.random(80)
        dx = 1 + 0.01 * np.where(early, 3.0, 1.0) * random.normal(size=80)
        result = strands._early(dx, early, drawn_terms({"a_drawn": drawn, "phase_drawn": phase}))
        found.append([result["held"], result["held_se"]])
    values, errors = np.array(found).T
    assert errors.mean() == pytest.approx(values.std(), rel=0.15)


def made_cells(exponent: float, power: float, noise: float = 0.0) -> dict[str, np.ndarray]:
    """Cells of the law Δx = n^power F(ν n^exponent), with a curve F that is no power."""
    links, frequency = (axis.ravel() for axis in np.meshgrid(np.arange(30.0, 241, 10), np.arange(3.0, 61, 3)))
    x = frequency * links**exponent
    scatter = np.exp(noise * np.random.default_rng(1).normal(size=len(links)))
    top = x.max()
    dx = links**power * (x / top) ** 2 / (1 + 30 * (x / top)) * scatter
    whole = np.full(len(links), 100.0)
    found = {"links": links, "frequency": frequency, "dx_mean": dx}
    return found | {name: whole for name in ("at_rest", "walks")}


@pytest.mark.parametrize("exponent", [-1.2, -0.5, 0.0])
def test_the_search_finds_the_exponent_of_a_made_law(exponent: float) -> None:
    """One variable puts all cells on a curve, and the search finds it; the candidate of that exponent fits as well."""
    points = laws.points_of(made_cells(exponent, 1.0))
    assert laws.best_variable(points) == pytest.approx(exponent, abs=0.002)
    fitting = {-0.5: "spline of Δx/(nℓ) over v²/(g nℓ)", 0.0: "spline of Δx/(nℓ) over ν²ℓ/g"}.get(exponent)
    laws_of_it = candidates.CANDIDATES[6:]
    rms = {law.name: laws.root_mean_square(candidates.residual(points, law)) for law in laws_of_it}
    assert all((value < 0.5) == (name == fitting) for name, value in rms.items()), rms


def test_a_sum_of_powers_is_found_and_predicts_what_it_has_not_seen() -> None:
    """Of cells made by a law its numbers are found, without error; a law of another kind predicts them worse."""
    made = made_cells(0.0, 1.0)
    speed, length = 2 * np.pi * laws.RADIUS * made["frequency"], laws.LINK_LENGTH * made["links"]
    turns = speed * candidates.TIME / length
    made["dx_mean"] = length * (0.4 * turns + 1.9 * turns**2.5)
    points = laws.points_of(made)
    free, power = candidates.CANDIDATES[1], candidates.CANDIDATES[5]
    assert free.fit(points)[0] == pytest.approx((0.4, 1.9, 2.5), rel=1e-4)
    for block in candidates.BLOCKS:
        assert laws.root_mean_square(candidates.left_out(points, free, block)) < 1e-3
        assert laws.root_mean_square(candidates.left_out(points, power, block)) > 10
        assert np.all(candidates.block_errors(points, free, block) < 1e-3)


@pytest.mark.thorough
def test_the_command_draws_and_writes_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the committed files it draws all figures and writes the committed page."""
    page = (run.FOLDER / "README.md").read_text(encoding="utf-8")
    (tmp_path / "README.md").write_text(page, encoding="utf-8")
    monkeypatch.setattr(run, "FOLDER", tmp_path)
    run.make()
    assert (tmp_path / "README.md").read_text(encoding="utf-8") == page
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == {"maps", "laws", "scales"}
