"""The table of hard cases: every case is sound with every method, and what is not sound is found."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.hard_cases import SUBJECTS, every_method, quick_with
from warpchain import InputError, Status
from warpchain.bench.accuracy.plan import Plan, run_accuracy
from warpchain.bench.problems.hard_cases import HARD_CASES, Flight, Order, Outcome, Walk
from warpchain.bench.problems.hard_starts import SOFT, dropped
from warpchain.kernels.methods.method import find_method

RUN_ELSEWHERE = {"pile-slow-walk", "sixty-hertz", "standing", "links-1000"}
"""Slow cases that tests of hard flights and walks run, with shorter chains or looser tolerances where they must."""
SLOW_CASES = {"pile-dropped-soft", "pile-dropped-paper"} | RUN_ELSEWHERE
FLIGHTS = {name for name, subject in SUBJECTS.items() if isinstance(subject, Flight)}


@every_method
@pytest.mark.parametrize("name", [name for name in SUBJECTS if name in FLIGHTS - SLOW_CASES])
def test_flights_are_sound(name: str, method: str) -> None:
    """Status and energy of every flight of the table are such as it may have."""
    outcome = SUBJECTS[name].run(method)
    assert outcome.sound, outcome


@quick_with("rkf78", "dp5")
@pytest.mark.parametrize("name", [name for name in SUBJECTS if name not in FLIGHTS | SLOW_CASES])
def test_quick_cases_are_sound(name: str, method: str) -> None:
    """Every other case that takes no longer than a moment ends as it may."""
    outcome = SUBJECTS[name].run(method)
    assert outcome.sound, outcome


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rkf78", "os32", "hybrid"])
@pytest.mark.parametrize("name", sorted(SLOW_CASES - RUN_ELSEWHERE))
def test_slow_cases_are_sound(name: str, method: str) -> None:
    """The others do with the methods of the three words."""
    outcome = SUBJECTS[name].run(method)
    assert outcome.sound, outcome


@every_method
def test_fixed_steps_show_the_order(method: str) -> None:
    """The energy of undamped bouncing springs falls as h^p for an odd order p, as h^(p + 1) for an even one.

    One step multiplies the energy of an oscillator by |R(iωh)|², which leaves 1 by an even power of h; that of rodas5p
    by a higher one. Springs that nothing damps ring for ever, so hybrid never takes its joints for rigid here: it is
    os32. All steps have the length that is asked for.
    """
    outcome = Order().run(method)
    drift = re.fullmatch(r"drift of the energy ∝ h\^([\d.]+)", outcome.result)
    assert drift is not None
    order = find_method(method).order
    expected = 7 if method == "rodas5p" else order + (order + 1) % 2
    assert float(drift[1]) == pytest.approx(expected, abs=0.5)
    assert outcome.attempts == pytest.approx(sum(0.3 / step for step in Order().steps), rel=1e-3)


def test_what_is_not_sound_is_found() -> None:
    """A bound that nothing keeps, a wrong distance, a wrong status: each makes an outcome that is not sound."""
    flight = Flight(SOFT, dropped, 1e-4)
    assert flight.run("dp5").sound
    assert not replace(flight, bound=0.0).run("dp5").sound
    assert not replace(flight, expected=(Status.TIME_LIMIT,)).run("dp5").sound
    settings = {"links": 4, "frequency": 4.0, "start": "ellipse", "walk_limit": 0.01}
    assert Walk("soft", settings, expected=Status.TIME_LIMIT).run("dp5").sound
    assert not Walk("soft", settings).run("dp5").sound
    nowhere = Walk("soft", settings | {"walk_limit": 5.0}, distance=(5.0, 6.0)).run("dp5")
    assert nowhere.status == "at_rest" and not nowhere.sound


def test_a_method_that_refuses_a_case_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A refusal is a row of the table in the method's own words, not the end of the run."""

    def refuse(self: Walk, method: str) -> Outcome:
        raise InputError("options.method: no such joints")

    monkeypatch.setattr(Walk, "run", refuse)
    plan = Plan(parts=["hard-cases"], methods=["dp5"], cases=["links-4", "refused"])
    rows = run_accuracy(tmp_path, plan, lambda text: None)["hard_cases"]
    assert [(row["case"], row["status"], row["sound"]) for row in rows] == [
        ("links-4", "refused", False),
        ("refused", "refused", True),
    ]
    assert rows[0]["result"] == "options.method: no such joints"


def test_names_are_unique() -> None:
    """A name tells a case from all others."""
    assert len(SUBJECTS) == len(HARD_CASES) == 27
