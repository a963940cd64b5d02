"""Bootstrap intervals and the two-sample test, against SciPy and against what can be counted by hand."""

from functools import partial

import numpy as np
import pytest
from scipy import stats

from warpchain.bench.accuracy.two_samples import bootstrap_interval, kolmogorov_smirnov


@pytest.mark.parametrize(("m", "k", "shift"), [(1, 1, 0.0), (5, 5, 0.5), (12, 7, 1.0), (200, 60, 0.3), (200, 200, 0.1)])
def test_the_test_is_that_of_scipy(m: int, k: int, shift: float) -> None:
    """Distance and exact probability are SciPy's, whichever of the two samples comes first."""
    generator = np.random.default_rng(m + k)
    first, second = generator.normal(size=m), generator.normal(size=k) + shift
    truth = stats.ks_2samp(first, second, method="exact")
    for pair in ((first, second), (second, first)):
        distance, probability = kolmogorov_smirnov(*pair)
        assert distance == pytest.approx(truth.statistic, abs=1e-15)
        assert probability == pytest.approx(truth.pvalue, rel=1e-9)


def test_what_can_be_counted() -> None:
    """Two and two values, quite apart: 2 of the 6 orders are so. Equal samples are never apart."""
    assert kolmogorov_smirnov(np.array([1.0, 2.0]), np.array([3.0, 4.0])) == (1.0, pytest.approx(1 / 3))
    same = np.array([1.0, 2.0, 3.0])
    assert kolmogorov_smirnov(same, same) == (0.0, 1.0)


def test_equal_distributions_are_rejected_as_often_as_said() -> None:
    """Of 400 pairs of samples of one distribution about 5 % have a probability below 5 %, at most."""
    generator = np.random.default_rng(1)
    low = sum(kolmogorov_smirnov(*generator.normal(size=(2, 30)))[1] < 0.05 for _ in range(400))
    assert 5 <= low <= 30  # the test is discrete: 3.5 % at these sizes


def test_intervals_are_those_of_scipy() -> None:
    """Intervals of mean and standard deviation agree with SciPy's percentile bootstrap, and come out the same again."""
    sample = np.random.default_rng(3).normal(0.66, 0.03, size=80)
    for statistic in (np.mean, partial(np.std, ddof=1)):
        interval = bootstrap_interval(sample, statistic)
        truth = stats.bootstrap(
            (sample,), statistic, method="percentile", n_resamples=10_000, rng=5
        ).confidence_interval
        assert interval == pytest.approx((truth.low, truth.high), abs=2e-4)
        assert interval == bootstrap_interval(sample, statistic)
    half = 1.96 * sample.std() / np.sqrt(80)
    assert bootstrap_interval(sample, np.mean) == pytest.approx((sample.mean() - half, sample.mean() + half), abs=3e-4)


def test_one_value_has_no_interval() -> None:
    """Fewer than two values give NaN, not an interval of no width."""
    assert np.isnan(bootstrap_interval(np.array([1.0]), np.mean)).all()
    assert np.isnan(bootstrap_interval(np.empty(0), np.mean)).all()
