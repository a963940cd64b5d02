"""Standard errors of means over the samples of a cell, held against the spread of means over many seeds."""

import functools
import math
from typing import Any

import numpy as np
import pytest

from tests.support.sweep_content import content
from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.sweeps.designs import RANDOMISATIONS, SAMPLERS, independent_groups
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.walks.cell_statistics import CellStatistics

SEEDS = 24
DRAWN = {"floor_friction": (0.2, 0.4), "phase": (0.0, 1.0), "clearance": (0.005, 0.015), "gravity": (9.0, 10.0)}
UNIFORM = {"all": "fixed", **{name: {"uniform": list(ends)} for name, ends in DRAWN.items()}}


def planned(sampler: str, seed: int, samples: int = 64, **keys: Any) -> Sweep:
    """A sweep of one cell that draws four quantities."""
    given = {"sampler": sampler, "samples": samples, "seed": seed, "distributions": UNIFORM, **keys}
    return load_sweep(content(grid=None, **given))


@functools.cache
def drawn(sampler: str, seed: int) -> tuple[Sweep, np.ndarray]:
    """A sweep of 64 samples, and its `fractions`; two distances are made of each."""
    sweep = planned(sampler, seed)
    return sweep, fractions(sweep)


def fractions(sweep: Sweep) -> np.ndarray:
    """What each walk drew, as fractions of the ranges, (walks, 4)."""
    draws = [sweep.walk(index).draws for index in sweep.indices.tolist()]
    return np.array([[(draw[name] - low) / (high - low) for name, (low, high) in DRAWN.items()] for draw in draws])


def even(u: np.ndarray) -> np.ndarray:
    """A distance that follows what is drawn evenly: designs find its mean far better than random samples."""
    return 1 + u @ [1.0, 0.5, 0.2, 0.1] + 0.3 * u[:, 0] * u[:, 1]


def chaotic(u: np.ndarray) -> np.ndarray:
    """A distance that the least change of what is drawn scatters, as that of a walk; half of it follows evenly."""
    return even(u) + 0.3 * np.sin(1e6 * u @ [1.0, 0.7, 0.3, 0.9])


def found(sweep: Sweep, distance: Any, ended: np.ndarray | None = None) -> CellStatistics:
    """Statistics of walks that came so far, all at rest unless it is said which."""
    return statistics_of(sweep, distance(fractions(sweep)), ended)


def statistics_of(sweep: Sweep, dx: np.ndarray, ended: np.ndarray | None = None) -> CellStatistics:
    """Statistics of walks with these distances."""
    rest = np.full(len(dx), True) if ended is None else ended
    status = np.where(rest, Status.AT_REST, Status.TIME_LIMIT)
    return CellStatistics.of({}, "m", np.where(rest, dx, np.nan), status, sweep.blocks[0].groups)


@pytest.mark.parametrize("distance", [even, chaotic])
@pytest.mark.parametrize("sampler", SAMPLERS)
def test_printed_errors_are_those_of_the_means(sampler: str, distance: Any) -> None:
    """Over 24 seeds cell means scatter as their standard errors say, whatever the sampler: within 3 σ of a spread."""
    each_drawn = [drawn(sampler, seed) for seed in range(SEEDS)]
    cells = [statistics_of(sweep, distance(u)) for sweep, u in each_drawn]
    true = np.std([each.mean for each in cells], ddof=1)
    printed = math.sqrt(np.mean([each.standard_error**2 for each in cells]))
    assert true / printed == pytest.approx(1.0, abs=3 / math.sqrt(2 * (SEEDS - 1)))
    assert {int(each.independent) for each in cells} == {64 if sampler == "random" else RANDOMISATIONS}


@pytest.mark.parametrize("sampler", ["sobol", "saltelli", "latin_hypercube"])
def test_one_randomisation_has_no_error_and_says_why(sampler: str) -> None:
    """Where all walks depend on one another a mean has no error, and the statistics say what gives one."""
    cells = found(planned(sampler, 1, randomisations=1), even)
    assert np.isfinite(cells.mean) and np.isfinite(cells.sd) and np.isnan(cells.standard_error)
    assert "use randomisations: 8 and more samples" in cells.why_no_error
    assert found(planned(sampler, 1), even).why_no_error == ""
    one = found(planned(sampler, 1, samples=1), even)
    assert np.isnan(one.standard_error) and bool(one.why_no_error) == (sampler == "saltelli")


def test_fewer_randomisations_fill_the_ranges_more_evenly() -> None:
    """What is asked for is what a cell gets: each randomisation of a design is even by itself."""
    for randomisations in (1, 4, 8):
        u = fractions(planned("sobol", 3, randomisations=randomisations))
        for group in range(randomisations):
            own = np.sort(u[group::randomisations], axis=0)
            assert (np.floor(own * len(own)) == np.arange(len(own))[:, np.newaxis]).all()


def test_errors_of_random_samples_are_those_of_textbooks() -> None:
    """Of independent samples it is sd / √count to rounding, whichever walks are missing from the mean."""
    ended = np.random.default_rng(1).random(64) > 0.3
    cells = found(planned("random", 5), chaotic, ended)
    assert cells.count == cells.independent == ended.sum()
    assert cells.standard_error == pytest.approx(cells.sd / math.sqrt(ended.sum()), rel=1e-12)


def test_errors_hold_where_walks_fail() -> None:
    """Where every third walk fails at random, groups have unlike numbers of walks; errors are still those of means."""
    cells = []
    for seed in range(SEEDS):
        ended = np.random.default_rng(seed).random(64) > 1 / 3
        cells.append(found(planned("sobol", seed), even, ended))
    true = np.std([each.mean for each in cells], ddof=1)
    printed = math.sqrt(np.mean([each.standard_error**2 for each in cells]))
    assert true / printed == pytest.approx(1.0, abs=3 / math.sqrt(2 * (SEEDS - 1)))


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"sampler": "random", "randomisations": 8}, r"^sweep\.randomisations: random samples are independent anyway"),
        ({"sampler": "sobol", "randomisations": 6}, r"^sweep\.randomisations: expected a power of 2 for sobol, got 6"),
        ({"sampler": "sobol", "randomisations": 0}, r"^sweep\.randomisations: "),
    ],
)
def test_numbers_of_randomisations_that_do_not_fit_are_refused(keys: dict[str, Any], problem: str) -> None:
    """One line names the key and says what to do."""
    with pytest.raises(InputError, match=problem):
        load_sweep(content(samples=16, **keys))


def test_the_digest_tells_the_randomisations_apart() -> None:
    """Other randomisations are another sweep; a random one has none, and keeps the digest that it has had."""
    digests = {planned("sobol", 1, randomisations=count).digest() for count in (1, 2, 8)}
    assert len(digests) == 3 and planned("sobol", 1).digest() in digests
    assert "randomisations" not in planned("random", 1).canonical()["blocks"][0]
    assert planned("sobol", 1).canonical()["blocks"][0]["randomisations"] == RANDOMISATIONS


def test_groups_are_those_of_whole_samples() -> None:
    """All walks of a sample are in one group, and more samples move none to another."""
    assert independent_groups("saltelli", 20, 3, 2).tolist() == [0] * 5 + [1] * 5 + [0] * 5 + [1] * 5
    few, many = (independent_groups("sobol", count, 3, 8) for count in (16, 64))
    assert (many[:16] == few).all() and np.bincount(many).tolist() == [8] * 8
