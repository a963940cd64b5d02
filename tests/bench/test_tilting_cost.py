"""`warpchain bench tilting`: what a plane that tilts adds to a step."""

import json

import pytest

from tests.support import command_line
from tests.support.command_line import Command

command = command_line.command


@pytest.mark.slow
def test_both_planes_are_measured_side_by_side(command: Command) -> None:
    """A row for each scene; the ratio is that of a tilting plane over a fixed one, both of which took time."""
    answer = command("bench", "tilting", "--links", "20", "--method", "os32", "--rounds", "1", "--json")
    assert answer.status == 0
    rows = json.loads(answer.out)["tilting"]
    assert [(row["scene"], row["links"], row["method"], row["chains"]) for row in rows] == [
        (scene, 20, "os32", 1) for scene in ("flight", "pile")
    ]
    for row in rows:
        assert row["fixed_microseconds"] > 0 and row["ratio"] == pytest.approx(
            row["tilting_microseconds"] / row["fixed_microseconds"]
        )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--method", "hybrid"], "options.method: 'hybrid' keeps the plane"),
        (["--links", "21"], "bench.links: 21 is odd"),
        (["--device", "cuda:99"], "cuda:99"),
    ],
)
def test_what_cannot_be_measured_is_refused(words: list[str], line: str, command: Command) -> None:
    """One line, exit status 2."""
    answer = command("bench", "tilting", *words)
    assert answer.status == 2 and line in answer.err and answer.err.count("\n") == 1
