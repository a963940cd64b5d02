"""Joints that reverse within a step: what Fehlberg's estimate does not see, and what others do."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.reports.test_sweep_page import Document
from tests.support import command_line
from tests.support.command_line import Command
from warpchain.bench.problems import reversals as problem
from warpchain.bench.problems.hard_starts import PAPER, reversing_loop, struck_loop
from warpchain.bench.problems.numpy_steps import accepted_steps, attempt
from warpchain.bench.problems.reversals import REFERENCE, Ends, fly, reversals, starts_of, step_errors
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS, Tableau
from warpchain.oracle import motion_equations

command = command_line.command

EACH = pytest.mark.parametrize("tableau", TABLEAUS.values(), ids=list(TABLEAUS))
SMOOTH = PAPER.with_values({"friction_smoothing": 1.0})


def error_weights_by_node(tableau: Tableau) -> dict[object, object]:
    """Σ (b − b̂) over the stages at each time of the step, exactly; times without weight are left out."""
    sums: dict[object, object] = {}
    for row, weight, embedded in zip(tableau.matrix, tableau.weights, tableau.embedded, strict=True):
        sums[sum(row)] = sums.get(sum(row), 0) + weight - embedded
    return {node: total for node, total in sums.items() if total}


@EACH
def test_only_fehlbergs_estimate_is_blind_to_time(tableau: Tableau) -> None:
    """Its error weights cancel at every time of the step; those of the others do not, also within the step."""
    found = error_weights_by_node(tableau)
    assert (found == {}) == (tableau.name == "rkf78")
    assert tableau.name == "rkf78" or any(0 < node < 1 for node in found)


@EACH
def test_a_jump_in_time_has_an_error_that_fehlberg_does_not_estimate(tableau: Tableau) -> None:
    """v̇ jumps from −1 to 1 at t = 0.6 of a step, x is a clock: v should be −0.2 at its end, and is far from that.

    The estimate of `dp5` is a tenth of the error or less: it sees jumps, but not all of them.
    """

    def acceleration(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.array([0.0, np.sign(position[0] - 0.6)])

    step = attempt(tableau, acceleration, (np.zeros(2), np.array([1.0, 0.0])), 1.0)
    error, estimate = step.end[1][1] + 0.2, step.estimate[1][1]
    assert step.end[0][0] == pytest.approx(1.0, abs=1e-15) and abs(error) > 0.02
    assert abs(estimate) < 1e-15 if tableau.name == "rkf78" else abs(estimate) > 0.005


def test_steps_in_numpy_are_steps_of_the_engine() -> None:
    """As many steps are accepted as the engine attempts, but for a few; ends agree where the flight is smooth."""
    start = reversing_loop()
    acceleration = partial(motion_equations.acceleration, parameters=SMOOTH)
    for method in ("rkf78", "dp5"):
        steps = accepted_steps(TABLEAUS[method], acceleration, start, problem.DURATION, 1e-9)
        ends = fly(SMOOTH, [start], method, 1e-9)
        assert len(steps) == pytest.approx(ends.attempts, rel=0.03)
        assert sum(step.length for step in steps) == pytest.approx(problem.DURATION, rel=1e-12)
        assert Ends(steps[-1].end[1][None, :, 2], len(steps)).errors(ends).max() < 1e-7


def test_a_struck_loop_has_hit_the_floor() -> None:
    """The lowest links have lost their approach, all others turn and fall on; no joint has been pulled open."""
    position, velocity = struck_loop(0.1)
    ends = np.concatenate(motion_equations.link_ends(position, PAPER))
    assert ends[:, 1].min() == pytest.approx(PAPER.circle_radius, abs=2e-9)
    assert np.linalg.norm(motion_equations.joint_opening(position, PAPER), axis=1).max() < 1e-15
    struck = np.abs(velocity[:, 2] + 60.0) > 1e-9
    assert 1 <= struck.sum() <= 4 and position[struck, 1].max() < 2 * PAPER.link_length
    mean = motion_equations.linear_momentum(velocity, PAPER) / motion_equations.link_masses(40, PAPER).sum()
    assert -2.0 < mean[1] < -1.8


@pytest.mark.parametrize("kind", problem.STARTS)
def test_fehlberg_at_1e_11_errs_far_more_than_others(kind: str) -> None:
    """Where joints reverse at Table 1's ω_c a thousandth and a hundredth of the tolerance help `rkf78` little.

    The other methods come to where the references part; SciPy on the NumPy model agrees with them.
    """
    starts = starts_of(kind)
    true = fly(PAPER, starts, *REFERENCE)
    errors = {
        (method, tolerance): float(np.median(fly(PAPER, starts, method, tolerance).errors(true)))
        for method in ("rkf78", "dp5", "rodas5p")
        for tolerance in ((1e-6, 1e-9, 1e-11) if method == "rkf78" else (1e-9, 1e-11))
    }
    assert errors["rkf78", 1e-6] < 20 * errors["rkf78", 1e-9]
    assert errors["rkf78", 1e-9] < 10 * errors["rkf78", 1e-11]
    assert errors["dp5", 1e-9] > 50 * errors["dp5", 1e-11]
    for method in ("dp5", "rodas5p"):
        assert errors["rkf78", 1e-9] > 3 * errors[method, 1e-9]
        assert errors["rkf78", 1e-11] > 100 * errors[method, 1e-11]
        assert errors[method, 1e-11] < 2e-8
    theirs = problem.fly_in_scipy(PAPER, starts[1:2], 1e-11)
    assert theirs.errors(Ends(true.spins[1:2], 0)).max() < 1e-7 < errors["rkf78", 1e-11] / 5


@pytest.mark.parametrize("kind", problem.STARTS)
def test_where_kinks_take_many_steps_fehlberg_is_as_good(kind: str) -> None:
    """At ω_c = 1 rad/s `rkf78` at 1e-9 errs no more than `dp5`, up to where the references part."""
    starts = starts_of(kind)
    true = fly(SMOOTH, starts, *REFERENCE)
    (ours, theirs) = (np.median(fly(SMOOTH, starts, method, 1e-9).errors(true)) for method in ("rkf78", "dp5"))
    assert ours < 2 * theirs and ours < 2e-8


def test_accepted_steps_err_by_thousands_of_tolerances() -> None:
    """At 1e-11 those of `rkf78` do, where a joint reverses in less than a tenth of the step; those of `dp5` do not."""
    start, duration = starts_of("struck")[1], 3e-5
    ours, theirs = (step_errors(PAPER, start, method, 1e-11, duration) for method in ("rkf78", "dp5"))
    assert ours.max() > 1000 and theirs.max() < 100
    assert step_errors(SMOOTH, start, "rkf78", 1e-11, duration).max() < 20
    acceleration = partial(motion_equations.acceleration, parameters=PAPER)
    step = accepted_steps(TABLEAUS["rkf78"], acceleration, start, duration, 1e-11)[int(ours.argmax())]
    before, after = (state[1][:, 2] - np.roll(state[1][:, 2], -1) for state in (step.start, step.end))
    reverses = before * after < 0
    assert np.abs(after - before)[reverses].max() > 10 * 2 * PAPER.friction_smoothing


def test_the_part_writes_a_table_a_figure_and_a_section(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`--parts reversals` prints its table; the same numbers are in the document and on the page."""
    monkeypatch.setattr(problem, "SMOOTHINGS", (PAPER.friction_smoothing,))
    monkeypatch.setattr(problem, "TOLERANCES", (1e-6, 1e-9))
    monkeypatch.setattr(problem, "WATCHED_TIME", 1e-5)
    answer = command(*"bench accuracy -o new --parts reversals --methods dp5,hybrid,rodas5p --no-scipy".split())
    assert (answer.status, answer.err) == (0, "")
    lines = answer.out.splitlines()
    assert [Path(line).name for line in lines[-3:]] == ["accuracy.json", "reversals.png", "accuracy.html"]
    rows = json.loads((tmp_path / "new/accuracy.json").read_text())["reversals"]
    keys = [(row["start"], row["method"], row["tolerance"]) for row in rows]
    assert keys == [
        (start, method, tolerance)
        for start in ("struck", "reversing")
        for method in ("dp5", "rodas5p")
        for tolerance in (1e-6, 1e-9)
    ]
    assert [line.split()[:4] for line in lines[1 : 1 + len(rows)]] == [
        [start, "0.001", method, f"{tolerance:g}"] for start, method, tolerance in keys
    ]
    for row, line in zip(rows, lines[1:], strict=False):
        assert f"{row['error']:.1e}" in line and 0 < row["trust"] < 1e-7 < row["greatest_error"] * 1e3
        assert row["error"] <= row["greatest_error"] and row["attempts"] > 100
        assert (row["step_error"] is None) == (row["method"] == "rodas5p")
    page = Document((tmp_path / "new/accuracy.html").read_text(encoding="utf-8"))
    assert len(page.rows["reversing-joints"]) == 1 + len(rows) and len(page.images) == 1


def test_methods_on_rigid_joints_are_left_out() -> None:
    """`hybrid` alone leaves nothing to compare."""
    assert list(reversals(["hybrid"], True, lambda text: pytest.fail(text))) == []
