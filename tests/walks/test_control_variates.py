"""Means that are corrected by what samples drew: right on average, their errors as large as they are said to be."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student
from scipy.stats import truncnorm

from tests.support.made_sweeps import make_sweep
from tests.support.sweep_content import content
from warpchain.inputs.distributions import Gaussian, Uniform
from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.walks.cell_statistics import CellStatistics
from warpchain.walks.control_variates import controlled

SEEDS = 200
MEANS = np.array([0.0, 0.5, 0.5])
"""Of a standard Gaussian and of two uniform quantities."""


def smooth(x: np.ndarray) -> tuple[np.ndarray, float]:
    """A distance that is nearly linear in what is drawn, and its mean by integrals known in closed form."""
    y = np.exp(0.1 * x[..., 0]) + 0.4 * x[..., 1] + 0.1 * x[..., 1] * x[..., 2]
    return y, math.exp(0.005) + 0.2 + 0.025


def chaotic(x: np.ndarray) -> tuple[np.ndarray, float]:
    """The same, and half as much scatter that no regression explains, of mean zero to twelve digits."""
    y, mean = smooth(x)
    return y + 0.15 * np.sin(1e6 * (x[..., 1] + x[..., 2])), mean


def even(x: np.ndarray) -> tuple[np.ndarray, float]:
    """A distance whose regression on what is drawn is flat: nothing is gained, and nothing must be lost."""
    return 1 + (x[..., 1] - 0.5) ** 2, 1 + 1 / 12


def found(law: Any, walks: int) -> tuple[CellStatistics, CellStatistics, float]:
    """Plain and corrected statistics of 200 cells of as many walks, and the true mean."""
    rng = np.random.default_rng(20180604)
    x = np.stack([rng.normal(size=(SEEDS, walks)), *rng.random((2, SEEDS, walks))], axis=-1)
    y, mean = law(x)
    plain = CellStatistics.of({}, "m", y, np.full(y.shape, Status.AT_REST), np.arange(walks))
    return plain, controlled(plain, y, x, np.broadcast_to(MEANS, (SEEDS, 3))), mean


@pytest.mark.parametrize("walks", [12, 48])
@pytest.mark.parametrize("law", [smooth, chaotic, even])
def test_intervals_hold_the_true_mean(law: Any, walks: int) -> None:
    """Of 200 seeds 95 % intervals hold the mean as often as they say, and the corrected means have no visible bias."""
    _, cells, mean = found(law, walks)
    inside = abs(cells.mean - mean) <= student.ppf(0.975, cells.independent - 1) * cells.standard_error
    assert 0.90 <= inside.mean() <= 0.99
    assert abs(cells.mean.mean() - mean) < 4 * cells.mean.std() / math.sqrt(SEEDS)


def test_walks_are_saved_where_results_follow_what_is_drawn() -> None:
    """A smooth law is worth many walks, a chaotic one twice as many, one that is flat none; errors scatter as said."""
    for law, least, most in ((smooth, 480.0, 1e6), (chaotic, 80.0, 160.0), (even, 40.0, 52.0)):
        plain, cells, mean = found(law, 48)
        gain = ((plain.mean - mean) ** 2).sum() / ((cells.mean - mean) ** 2).sum()
        assert cells.worth is not None and least < np.median(cells.worth) < most
        assert np.median(cells.worth) / 48 == pytest.approx(gain, rel=0.4)


def test_cells_that_cannot_be_corrected_say_so() -> None:
    """Survivors draw otherwise than all: no mean where a walk failed, nor of few walks; others keep theirs."""
    rng = np.random.default_rng(3)
    x, status = rng.random((2, 12, 2)), np.full((2, 12), int(Status.AT_REST))
    status[1, 3] = Status.TIME_LIMIT
    y = np.where(status == Status.AT_REST, x.sum(axis=-1) + 0.1 * rng.normal(size=(2, 12)), np.nan)
    plain = CellStatistics.of({}, "m", y, status, np.arange(12))
    cells = controlled(plain, y, x, np.full((2, 2), 0.5))
    assert np.isfinite(cells.mean).tolist() == np.isfinite(cells.standard_error).tolist() == [True, False]
    assert "not corrected" in cells.why_no_error and plain.why_no_error == ""
    few = CellStatistics.of({}, "m", y[:1, :4], status[:1, :4], np.arange(4))
    assert np.isnan(controlled(few, y[:1, :4], x[:1, :4], np.full((1, 2), 0.5)).mean).all()


@pytest.mark.parametrize("bounds", [(-math.inf, math.inf), (0.9, 1.3), (1.2, math.inf)])
def test_means_of_distributions_are_those_of_physical_draws(bounds: tuple[float, float]) -> None:
    """Cut at physical bounds, they are those of SciPy's truncated Gaussian, and of the range that is left."""
    law = Gaussian(1.0, 0.2, bounds)
    ends = [(end - 1.0) / 0.2 for end in bounds]
    assert law.expected() == pytest.approx(truncnorm.mean(*ends, loc=1.0, scale=0.2), rel=1e-12)
    assert Uniform(0.0, 2.0, (0.5, 3.0)).expected() == 1.25


LAWS = {"all": "fixed", "phase": {"uniform": [0, 1]}, "floor_friction": {"gaussian": {"mean": 0.3, "sigma": 0.02}}}


def test_a_sweep_is_corrected_by_its_distributions(tmp_path: Any) -> None:
    """Where results are linear in what was drawn, the corrected mean of each cell is that of the means, exactly."""
    result = make_sweep(
        tmp_path,
        content(samples=16, distributions=LAWS),
        lambda walk: walk.setup.scene.links / 60 + 2 * walk.draws["phase"] + 3 * walk.draws["floor_friction"],
    )
    cells = result.statistics(control=True)
    assert cells.mean == pytest.approx(np.array([[1.0] * 2, [1.5] * 2]) + 1 + 0.9, rel=1e-12)
    assert (abs(result.statistics().mean - cells.mean) > 1e-3).all() and (cells.worth > 1e6).all()


def test_a_sweep_of_one_cell_is_corrected(tmp_path: Any) -> None:
    """Without axes there is one mean, and rounds have one cell."""
    given = content(samples=8, until={"dx": 0.5}, at_most=8, grid=None, distributions=LAWS)
    result = make_sweep(tmp_path, given, lambda walk: 1 + walk.draws["phase"])
    cells = result.statistics(control=True)
    assert cells.mean.shape == cells.reached.shape == () and cells.mean == pytest.approx(1.5) and cells.reached


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"sampler": "sobol", "samples": 16}, "a sobol design fills the ranges evenly"),
        ({"distributions": {"all": "fixed"}, "samples": 1}, "nothing is sampled"),
        # the chain does not reach round larger sprockets
        (
            {"distributions": {"all": "fixed", "sprocket_radius": {"uniform": [0.03, 0.2]}}, "samples": 24},
            "was drawn twice, as it made no possible walk",
        ),
    ],
)
def test_samples_whose_means_are_not_known_are_refused(tmp_path: Any, keys: dict[str, Any], problem: str) -> None:
    """One line says why: designs, no draws, and samples that were drawn again."""
    result = make_sweep(tmp_path, content(**keys))
    with pytest.raises(InputError, match=f"^control: .*{problem}.*; remove"):
        result.statistics(control=True)
