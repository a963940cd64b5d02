"""Figures of sweeps, and the numbers that stand on them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from scipy import stats

from tests.support.made_sweeps import FIGURE_6, SMALL, distance, make_sweep
from warpchain.pictures.style import GREEN, RED, NothingToShow, Picture
from warpchain.reports.sweep_figures import figure6, figures, sensitivities, sensitivity
from warpchain.results.sweep_result import SweepResult
from warpchain.status import Status
from warpchain.sweeps.plan import PlannedWalk


def one_block(**keys: Any) -> dict[str, Any]:
    """A sweep of one block."""
    return {"version": 1, "name": "one", "seed": 1, "preset": "soft", "samples": 4} | keys


def flawed(walk: PlannedWalk) -> float | Status | None:
    """In the first cell one of three walks fails, in the second all; the last cell has not been run yet."""
    if walk.index == 0 or walk.index in (3, 4, 5):
        return Status.NOT_FINITE if walk.index else Status.TIME_LIMIT
    return distance(walk) if walk.index < 15 else None


ARGUMENTS = ("floor_restitution", "floor_friction", "chain_restitution")
"""Three coefficients, drawn from 0 to 1, that are x, y and z of the function of Ishigami and Homma (1990)."""
ISHIGAMI = np.array([[0.3139, 0.4424, 0.0], [0.5576, 0.4424, 0.2437]])
"""First-order and total Sobol indices of that function, a = 7, b = 0.1."""


def ishigami_distance(walk: PlannedWalk) -> float:
    """The function of what a walk has drawn."""
    x, y, z = (math.pi * (2 * walk.draws[name] - 1) for name in ARGUMENTS)
    return math.sin(x) + 7 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)


def ishigami(samples: int, frequencies: list[int], **keys: Any) -> dict[str, Any]:
    """A sweep that draws the arguments of the function, a cell for each frequency."""
    drawn = {"all": "fixed", **{name: {"uniform": [0, 1]} for name in ARGUMENTS}}
    grid = {"frequency": frequencies}
    return one_block(sampler="saltelli", samples=samples, distributions=drawn, grid=grid, **keys)


@pytest.fixture(scope="module")
def sweep6(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """The sweep of Figure 6, complete."""
    return make_sweep(tmp_path_factory.mktemp("sweep6"), FIGURE_6)


@pytest.fixture(scope="module")
def flawed6(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """A small one with failures, and not yet complete."""
    return make_sweep(tmp_path_factory.mktemp("flawed6"), SMALL, flawed)


@pytest.fixture(scope="module")
def saltelli(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """A sweep for Sobol indices, complete."""
    return make_sweep(tmp_path_factory.mktemp("saltelli"), ishigami(512, [10]), ishigami_distance)


def panels(picture: Picture) -> list[Axes]:
    """The axes of a picture that hold data, in order."""
    return [axes for axes in picture.figure.axes if axes.has_data() and axes.axison]


def means(axes: Axes, color: str) -> dict[float, float]:
    """Position → mean of the points of one colour in a panel."""
    lines = [line for line in axes.lines if line.get_color() == color]
    return {x: y for line in lines for x, y in np.asarray(line.get_xydata()).tolist() if np.isfinite(y)}


# Figure 6


def test_figure6_shows_means_boxes_and_bars(sweep6: SweepResult) -> None:
    """The dot is the mean, the box one and the bar two standard deviations; starts stand side by side."""
    axes, *_, both, _ = panels(figure6(sweep6))
    expected = sweep6.blocks["rest"].dx[0]
    mean, sd = expected.mean(axis=-1), expected.std(axis=-1, ddof=1)
    np.testing.assert_allclose(list(means(axes, RED).items()), np.stack([np.arange(5.0, 31, 5), mean], 1))
    boxes = [patch for patch in axes.patches if isinstance(patch, Rectangle)][6:]
    np.testing.assert_allclose([(box.get_y(), box.get_height()) for box in boxes], np.stack([mean - sd, 2 * sd], 1))
    bars = [path.vertices[:, 1] for path in axes.collections[0].get_paths()]  # type: ignore[index]
    np.testing.assert_allclose(bars, np.stack([mean - 2 * sd, mean + 2 * sd], 1))
    rest, ellipse = means(both, RED), means(both, GREEN)
    np.testing.assert_allclose(np.add(list(rest)[1:], list(ellipse)) / 2, [10, 15, 20, 25, 30])


def test_figure6_counts_what_is_not_in_the_means(flawed6: SweepResult) -> None:
    """Failed and missing walks are counted under their panel; means are of the others, and no mean of none."""
    first, second = panels(figure6(flawed6))
    assert first.get_xlabel() == "4 of 6 walks failed"
    assert second.get_xlabel() == "3 of 12 not run yet"
    mean = pytest.approx(flawed6.blocks["rest"].dx[0, 0, 1:].mean())
    assert means(first, RED) == {10.0: mean}
    (mark,) = [line for line in first.lines if line.get_label() == "_mark"]  # the mean of two of three walks
    assert np.asarray(mark.get_xydata()).tolist() == [[10.0, mean]] and mark.get_markerfacecolor() == "white"
    assert len(means(second, GREEN)) == 1


# Sensitivity


def test_sensitivity_is_known_and_scipys(saltelli: SweepResult) -> None:
    """Indices are Ishigami's, and SciPy's to rounding."""
    (cell,) = sensitivities(saltelli)
    table = saltelli.dx.reshape(-1, 5).T
    expected = stats.sobol_indices(func={"f_A": table[:1], "f_B": table[1:2], "f_AB": table[2:, None]}, n=512)
    np.testing.assert_allclose(cell.indices, [expected.first_order, expected.total_order], atol=1e-12)
    np.testing.assert_allclose(cell.indices, ISHIGAMI, atol=0.1)
    assert (cell.samples, cell.lost) == (512, 0)


def test_intervals_of_sensitivity_hold_what_they_say(tmp_path: Path) -> None:
    """Of the known indices 95 % lie inside their intervals: over 16 cells of 64 samples within 3 σ of the count."""
    result = make_sweep(tmp_path / "many", ishigami(64, list(range(10, 26))), ishigami_distance)
    cells = sensitivities(result)
    inside = [(cell.intervals[..., 0] <= ISHIGAMI) & (cell.intervals[..., 1] >= ISHIGAMI) for cell in cells]
    assert len(cells) == 16 and np.mean(inside) == pytest.approx(0.95, abs=3 * math.sqrt(0.95 * 0.05 / (16 * 3)))
    one = make_sweep(tmp_path / "one", ishigami(16, [10], randomisations=1), ishigami_distance)
    assert np.isnan(sensitivities(one)[0].intervals).all()
    assert "without intervals: one randomisation" in sensitivity(one).figure.get_supxlabel()


def test_samples_that_until_never_asked_for_are_not_lost(tmp_path: Path) -> None:
    """A cell that stopped after its first round has no more samples, and its panel says nothing of others."""
    content = ishigami(16, [10], until={"dx": 0.9}, at_most=64)
    (cell,) = sensitivities(make_sweep(tmp_path, content, ishigami_distance))
    assert (cell.samples, cell.lost) == (16, 0)


def test_sensitivity_leaves_out_incomplete_samples(tmp_path: Path) -> None:
    """A sample with a failed walk is left out as a whole and counted; a block without two samples has no indices."""
    distributions = {"all": "fixed", "floor_friction": "table", "phase": "table", "clearance": "table"}
    content = one_block(sampler="saltelli", samples=8, distributions=distributions, grid={"frequency": [10, 20]})

    def outcome(walk: PlannedWalk) -> float | Status:
        return Status.TIME_LIMIT if walk.index in (3, 5) or walk.cell == (1,) else distance(walk)

    result = make_sweep(tmp_path, content, outcome)
    (cell,) = sensitivities(result)
    assert (cell.samples, cell.lost, cell.cell) == (6, 2, "ν = 10 Hz")
    assert panels(sensitivity(result))[0].get_xlabel() == "2 of 8 samples are not complete"
    with pytest.raises(NothingToShow, match="complete samples"):
        sensitivities(make_sweep(tmp_path / "none", content, lambda walk: Status.TIME_LIMIT))
    with pytest.raises(NothingToShow, match="sampler: saltelli"):
        sensitivities(make_sweep(tmp_path / "random", one_block(grid={"frequency": [10]})))


def test_a_single_parameter_set_is_a_series_of_figure6(tmp_path: Path) -> None:
    """Its number of links titles the panel."""
    content = one_block(points={"links": [60]}, grid={"frequency": [10, 20]})
    (panel,) = panels(figure6(make_sweep(tmp_path, content)))
    assert panel.get_title(loc="left") == "$n$ = 60"


# All of them


def test_figures_are_those_that_a_sweep_has_something_for(
    tmp_path: Path, sweep6: SweepResult, saltelli: SweepResult, flawed6: SweepResult
) -> None:
    """Each kind of sweep gives its own figures, all of which can be drawn; without a walk at rest there is none."""
    for result, names in (
        (sweep6, {"distance"}),
        (saltelli, {"sensitivity"}),
        (make_sweep(tmp_path / "failed", SMALL, lambda walk: Status.TIME_LIMIT), set[str]()),
        (flawed6, {"distance"}),
    ):
        pictures = list(figures(result))
        found = [picture.name for picture in pictures]
        assert names <= set(found) and bool(found) == bool(names) and len(set(found)) == len(found)
        for picture in pictures:
            picture.figure.savefig(tmp_path / "picture.png", dpi=40)
