"""What the command line says of sweeps before they run, of cells that stop at their errors, and of many samples."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.run.test_sweep_run import TINY
from tests.support.command_line import Command
from tests.support.synthetic_sweep import content, run
from warpchain.results.sweep_result import load
from warpchain.sweeps.plan import load_sweep

BRIEF = ("--links", "20", "--frequency", "5", "--start", "ellipse", "--preset", "soft", "--set", "method=dp5")


def plan(command: Command, *arguments: str) -> dict[str, Any]:
    """The plan of a sweep as JSON."""
    answer = command("sweep", *arguments, "--plan", "--json")
    assert (answer.status, answer.err) == (0, "")
    found: dict[str, Any] = json.loads(answer.out)
    return found


@pytest.fixture
def tiny(command: Command) -> str:
    """The file of a small sweep of 80 walks in four cells, in the folder of the command."""
    Path("tiny.yaml").write_text(yaml.safe_dump(TINY, sort_keys=False))
    return "tiny.yaml"


def test_a_plan_says_what_a_run_will_leave(command: Command, tiny: str) -> None:
    """Walks, files and bytes are those of the sweep, nothing is written, and then a plan says that nothing is left."""
    found = plan(command, tiny)
    assert (found["cells"], found["walks"], found["done"]) == (4, [80, 80], 0) and not Path("swept").exists()
    assert plan(command, tiny, "--part", "1/4")["walks"] == [20, 20]
    run(Path("swept"), load_sweep(tiny), shard_size=2)
    assert len(list(Path("swept/shards").iterdir())) == found["shards"]
    assert plan(command, tiny, "-o", "swept") | {"done": 80, "walks": [0, 0], "shards": 0} == plan(
        command, tiny, "-o", "swept"
    )
    rows = [line.partition("  ")[0] for line in command("sweep", tiny, "-o", "swept", "--pilot").out.splitlines()]
    assert rows == ["sweep", "cells", "walks done", "walks left", "memory"]
    more = plan(command, tiny, "-o", "swept", "--samples", "30")
    assert (more["done"], more["walks"]) == (80, [40, 40])


def test_a_plan_of_rounds_says_the_least_and_the_most(command: Command, tiny: str) -> None:
    """Before a run the first round and `at_most`; in its folder what is left, and a forecast between the two."""
    how = (tiny, "--until", "2%", "--samples", "8", "--at-most", "256")
    found = plan(command, *how)
    assert (found["walks"], found["expected"]) == ([32, 1024], None)
    run(Path("swept"), load_sweep(tiny, samples=8, until={"dx": 0.05}, at_most=64), shard_size=2)
    there = int(load("swept").is_there.sum())
    found = plan(command, *how, "-o", "swept")
    least, most = found["walks"]
    assert found["done"] == there and least <= found["expected"] <= most <= 1024 - there
    run(Path("swept"), load_sweep(tiny, samples=8, until={"dx": 0.02}, at_most=256), shard_size=2)
    assert plan(command, *how, "-o", "swept")["walks"] == [0, 0]


def test_a_pilot_times_the_corners(command: Command, tiny: str) -> None:
    """Each corner of the grid is timed, and the time in all is that of its walks; on a GPU it is refused."""
    answer = command("sweep", tiny, "--pilot")
    assert answer.status == 0 and len(re.findall(r"a walk of n = \d+, ν = \d+ Hz +\d\.\d\d s", answer.out)) == 4
    assert re.search(r"^time +\d:\d\d:\d\d$", answer.out, re.MULTILINE)
    answer = command("sweep", tiny, "--pilot", "--gpus", "2")
    assert answer.status == 2 and answer.err.startswith("error: --pilot: a GPU runs thousands of walks at once")


def test_tables_say_which_errors_are_reached(command: Command, tiny: str) -> None:
    """A column has the walks of each cell, another whether its error is reached; a folder that goes on has missing."""
    sweep = load_sweep(tiny, samples=8, until={"dx": 0.02}, at_most=16)
    run(Path("swept"), sweep, shard_size=2)
    lines = command("info", "swept").out.splitlines()
    assert lines[1].endswith("walks  error reached") and {line.split()[-1] for line in lines[2:6]} <= {"yes", "no"}
    found = json.loads(command("info", "swept", "--json").out)
    assert found["walks"] == load("swept").is_there.sum() == 64
    assert found["statuses"]["missing"] == 0 and len(found["blocks"]["main"]["reached"]) == 2
    max(Path("swept/shards").iterdir()).unlink()
    assert "not yet" in command("info", "swept").out


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("--until", "1%", "--until", "dx=2%"), "--until: dx is given twice; remove one"),
        (("--until", "1 kg"), "sweep.until.dx: expected a standard error, such as 0.01, 1 % or 2 mm; got '1 kg'"),
        (("--at-most", "64"), "sweep.at_most: until is missing; remove it, or add until: {dx: 1 %}"),
        (("--plan", "--fresh"), "--fresh: a plan deletes nothing; remove it, or use another folder"),
    ],
)
def test_what_does_not_go_together_is_refused(
    command: Command, tiny: str, arguments: tuple[str, ...], problem: str
) -> None:
    """One line, and nothing is written."""
    answer = command("sweep", tiny, "-o", "swept", *arguments)
    assert (answer.status, answer.err) == (2, f"error: {problem}\n") and not Path("swept").exists()


def test_many_samples_of_a_walk_have_a_mean_and_a_picture(command: Command) -> None:
    """Mean, error and spread are those of the sweep in the folder, whose median walk is drawn; more samples join."""
    answer = command("walk", *BRIEF, "--samples", "3", "--seed", "5", "-o", "many")
    result = load("many")
    cells = result.statistics()
    assert answer.status == 0 and result.shape == (3,) and result.seed == 5
    mean, error = map(float, re.findall(r"Δx +(\S+) ± (\S+) m, mean and standard error of 3 walks", answer.out)[0])
    assert mean == pytest.approx(cells.mean.item(), abs=error / 5)
    assert error == pytest.approx(cells.standard_error.item(), rel=0.06)
    assert answer.out.splitlines()[-1] == "many/samples.png"
    assert Path("many/samples.png").read_bytes().startswith(b"\x89PNG")
    before = content(Path("many/shards"))
    assert command("walk", *BRIEF, "--samples", "4", "--seed", "5", "-o", "many").status == 0
    assert before.items() < content(Path("many/shards")).items()
    alone = json.loads(command("walk", *BRIEF, "--seed", "5", "--json").out)
    assert alone["dx"] == load("many").dx[0]


def test_samples_of_which_some_fail(command: Command) -> None:
    """They are counted, status 1; where none comes to rest there is no distance and no picture."""
    answer = command("walk", *BRIEF, "--set", "walk_limit=0.02", "--samples", "2", "-o", "many")
    assert answer.status == 1 and re.search(r"Δx +unknown; no walk came to rest", answer.out)
    assert "2 time_limit" in answer.out and answer.err.startswith("2 time_limit: ")
    assert not Path("many/samples.png").exists()
    answer = command("walk", "--samples", "2", "--like", "many", "--index", "0")
    assert (answer.status, answer.err) == (
        2,
        "error: --like: only for one walk, not with --samples; remove one of them\n",
    )
