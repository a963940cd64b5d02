"""When cells stop that run until the errors of their means are reached, and how good these means and errors are."""

from typing import Any

import numpy as np
import pytest

from tests.support.stopping_rule import coverage, gaussian, skewed, stopped
from tests.support.sweep_content import content
from warpchain.inputs.validation import InputError
from warpchain.status import Status
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.rounds import Asked
from warpchain.walks.rows import MISSING


def asked(until: Any, dx: np.ndarray, status: np.ndarray | None = None, **keys: Any) -> tuple[list[int], list[bool]]:
    """Walks that cells ask for, and whether they have their errors, given all that they would find, (cells, most)."""
    given = {"samples": 4, "at_most": dx.shape[1], "until": until, **keys}
    (block,) = load_sweep(content(grid={"links": [60 + 2 * cell for cell in range(len(dx))]}, **given)).blocks
    status = np.where(np.isnan(dx), Status.TIME_LIMIT, Status.AT_REST) if status is None else status
    columns = dict.fromkeys(("energy_kinetic_at_release", "energy_potential_at_release", "energy_residual"), dx)
    found = Asked.of(block, {"status": status, "dx": dx, "bounces": np.ones(dx.shape, int), **columns})
    return found.walks.sum(axis=1).tolist(), found.reached.tolist()


def scattered(mean: float, sd: float, most: int = 256) -> np.ndarray:
    """Distances of one cell, as like their distribution as can be at any power of two."""
    return mean + sd * np.tile([1.0, -1.0], most // 2)[np.newaxis]


@pytest.mark.parametrize(
    ("until", "mean", "walks", "reached"),
    [
        ("5 %", 1.0, 8, True),  # 0.1 / √7 = 3.8 %
        ("1 %", 1.0, 128, True),
        ("0.1 %", 1.0, 256, False),
        ({"dx": "1 cm"}, 1.0, 128, True),
        ({"dx": "1 cm"}, 0.0, 128, True),
        ("1 %", 0.0, 256, False),  # of nothing
        ("1 %", -1.0, 128, True),
        ({"dx": "5 %", "bounces": "1 %"}, 1.0, 8, True),  # all bounce equally often: no error
        ({"dx": "1 %", "bounces": "1 %"}, 1.0, 128, True),
    ],
)
def test_a_cell_stops_at_its_error(until: Any, mean: float, walks: int, reached: bool) -> None:
    """Relative to the size of the mean or not, of one quantity or several; a mean of zero has no relative error."""
    assert asked(until, scattered(mean, 0.1)) == ([walks], [reached])


def test_few_walks_tell_no_error() -> None:
    """However alike, fewer than eight walks that came to rest do not stop a cell."""
    alike = np.full((2, 64), 1.0)
    alike[1, 1:15:2] = np.nan  # nine of its first 16 come to rest, five of its first eight
    assert asked("1 %", alike) == ([8, 16], [True, True])


def test_a_cell_in_which_nothing_comes_to_rest_stops_in_vain() -> None:
    """After 32 walks without a distance there is no error to wait for; one that rests late is waited for."""
    nothing = np.full((2, 256), np.nan)
    nothing[1, 30] = 1.0
    assert asked("1 %", nothing) == ([32, 256], [False, False])
    assert asked("1 %", nothing, samples=64)[0] == [64, 256]


def test_only_finished_rounds_decide() -> None:
    """A cell asks for no more, and is not done, while a walk of its round is missing, whatever the others found."""
    dx = np.repeat(scattered(1.0, 0.1), 3, axis=0)
    status = np.full(dx.shape, int(Status.AT_REST))
    status[0, 7:] = status[1, 8:] = status[2, 40] = MISSING
    assert asked("5 %", dx, status) == ([8, 8, 8], [False, True, True])
    assert asked("1 %", dx, status) == ([8, 16, 64], [False, False, False])


def test_designs_count_by_their_randomisations() -> None:
    """Sixteen walks that agree within each of eight groups have the error of eight; their spread counts, not √16."""
    groups = np.tile([1.1, 0.9], 4)
    dx = np.tile(groups, 32)[np.newaxis]
    distributions = {"all": "fixed", "phase": {"uniform": [0, 1]}}
    given = {"samples": 8, "sampler": "sobol", "distributions": distributions}
    assert asked("3.7 %", dx, **given) == ([256], [False])  # 0.1 / √7, however many walks there are
    assert asked("3.8 %", dx, **given) == ([8], [True])


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ({"until": {"dxx": 0.01}}, r"sweep\.until\.dxx: not a column of numbers; did you mean dx\?"),
        ({"until": {"dx": 1}}, r"sweep\.until\.dx: expected a standard error, such as 0\.01, 1 % or 2 mm; got 1"),
        ({"until": {"dx": "2 s"}}, r"sweep\.until\.dx: expected a standard error"),
        ({"until": {"bounces": "nan %"}}, r"sweep\.until\.bounces: .* or 0\.5 absolute; got 'nan %'"),
        ({"until": True}, r"sweep\.until\.dx: expected a standard error"),
        ({"until": {}}, r"sweep\.until: expected the error of a quantity, got none; use"),
        ({"at_most": 64}, r"sweep\.at_most: until is missing; remove it"),
        ({"until": 0.01, "at_most": 4}, r"sweep\.at_most: .*8"),
        ({"until": 0.01, "samples": 16, "at_most": 8}, r"sweep\.at_most: expected samples: 16 or more, got 8"),
        (
            {"until": 0.01, "samples": 1800},
            r"sweep\.until: the first round has samples: 1800 in each cell, .*; use fewer",
        ),
        ({"until": 0.01, "distributions": {"all": "fixed"}, "samples": 1}, r"sweep\.until: nothing is sampled"),
        ({"until": 0.01, "sampler": "latin_hypercube"}, r"sweep\.until: a latin_hypercube design cannot grow; use"),
        (
            {"until": 0.01, "sampler": "sobol", "samples": 4, "at_most": 12},
            r"sweep\.at_most: expected a power of 2 for sobol, got 12",
        ),
        (
            {"until": 0.01, "sampler": "sobol", "samples": 4, "randomisations": 4},
            r"sweep\.randomisations: until needs 8, got 4",
        ),
        ({"until": 0.01, "at_most": 2**24}, r"sweep\.at_most: .* walks, got .*; use fewer"),
    ],
)
def test_what_cannot_be_reached_is_refused(keys: dict[str, Any], problem: str) -> None:
    """One line names the key and says what to do."""
    with pytest.raises(InputError, match=f"^{problem}") as caught:
        load_sweep(content(**keys))
    assert "\n" not in str(caught.value)


def test_the_canonical_form_says_the_same() -> None:
    """Written out and read again a sweep asks for the same; its folder is that of any other errors."""
    sweep = load_sweep(content(until={"dx": "2 mm", "walk_time": "1 %"}))
    again = load_sweep(sweep.canonical())
    assert again.blocks[0].until == sweep.blocks[0].until and again.digest() == sweep.digest()
    plain = load_sweep(content(samples=1024))
    assert sweep.digest() != plain.digest() and sweep.digest([1]) == plain.digest([1])


@pytest.mark.parametrize(("sampler", "least"), [("random", 0.90), ("sobol", 0.86)])
@pytest.mark.parametrize("draw", [gaussian(0.05), skewed(0.3)])
def test_means_hold_after_stopping(draw: Any, sampler: str, least: float) -> None:
    """Of 200 seeds 95 % intervals hold the mean nearly as often, and stopping shifts it by a part of its error only.

    With 1000 seeds it is 94 to 95 % of random samples, and 91 to 94 % of the eight randomisations of a design.
    """
    cells, found = stopped(draw, 0.01, sampler=sampler)
    assert found.reached.all() and coverage(cells) >= least
    assert abs((cells.mean - 1).mean()) < 0.25 * 0.01
    assert 0.6 * 0.01 < np.sqrt(((cells.mean - 1) ** 2).mean()) < 1.25 * 0.01
