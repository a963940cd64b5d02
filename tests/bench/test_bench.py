"""`warpchain bench`: its model against an independent one, its steps against counts, and the command itself."""

import json

import numpy as np
import pytest

from tests.oracle_model import motion_equations
from tests.support.command_line import Command
from tests.support.presets import PAPER
from warpchain.bench import measurements
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.run.simulation import simulate


@pytest.mark.parametrize("links", [4, 10])
def test_the_model_is_that_of_the_tests(links: int) -> None:
    """Accelerations of a chain in any state, as the equations are written down for the tests."""
    generator = np.random.default_rng(links)
    position, velocity = lay_chain(ellipse(1.3), links, PAPER.link_length, speed=2.0)
    position += 1e-5 * generator.normal(size=position.shape)
    velocity += generator.normal(size=velocity.shape)
    expected = motion_equations.acceleration(position, velocity, PAPER)
    found = measurements.acceleration(position, velocity, PAPER)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("device", ["cpu", "fibers"])
def test_steps_are_those_of_a_flight(device: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is timed is the flight after its first millisecond."""
    monkeypatch.setattr(measurements, "TIMED", 1.2e-3)
    start = measurements.flying(8)
    end, seconds, accepted, rejected = measurements.fly(start, "dp5", 2, device)
    assert seconds > 0
    first, whole = (
        simulate(PAPER, *start, instants[-1], times=instants, method="dp5", device=device)
        for instants in ([1e-3], [1e-3, 1.2e-3])
    )
    assert np.array_equal(end[0], first.position[-1])
    assert accepted == whole.steps_accepted - first.steps_accepted > 10
    assert rejected == whole.steps_rejected - first.steps_rejected


def test_the_command_prints_tables_or_json(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """A line for each method and SciPy, one for the sweep; errors are those of methods that agree; null for NaN."""
    methods = ["os32", "rkf78"]
    monkeypatch.setattr(measurements, "method_names", lambda: methods)
    monkeypatch.setattr(measurements, "COMPARED_TIME", 1e-4)
    monkeypatch.setattr(measurements, "TIMED", 2e-4)
    monkeypatch.setattr(measurements, "ROUNDS", 1)
    monkeypatch.setattr(measurements, "WALKS", {"cpu": 2})
    monkeypatch.setattr(measurements, "WALK", {"links": 20, "start": "ellipse", "walk_limit": 0.01})
    record = json.loads(command("bench", "--links", "8", "--json").out)
    assert [step["method"] for step in record["steps"]] == [*methods, measurements.SCIPY]
    assert record["steps"][-1]["rejected"] is None and all(record["machine"].values())
    assert all(step["microseconds"] > 0 and step["position_error"] < 1e-6 for step in record["steps"])
    assert record["walks"]["walks"] == 2 and record["walks"]["at_rest"] == 0
    answer = command("bench", "--links", "8")
    lines = answer.out.splitlines()
    assert answer.err == "" and lines[-1].split()[:4] == [record["walks"]["method"], "0.003", "2", "0"]
    assert [line.split()[1] for line in lines if line.strip().startswith("8 ")] == [*methods, "DOP853"]
