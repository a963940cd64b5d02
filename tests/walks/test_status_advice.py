"""What the sentence of each failed status tells a user to try, tried on a walk or a flight that ended so."""

from typing import Any

import pytest

import warpchain
from tests.hard_cases.starts import dropped, folded
from tests.support.command_line import Command
from warpchain import Status

SHORT = {"links": 40, "start": "ellipse", "frame_interval": None}
FIRST_MOMENTS = {**SHORT, "preset": "soft", "method": "reference", "stop_time": 0.02}
SLIDING = {**SHORT, "method": "explicit", "slope": 20.0, "mu_fc": 0.1, "walk_limit": 1.0}
WHIRLING = {"start": "spinning", "charm_mass": 0.02, "frame_interval": None}

ADVICE: list[Any] = [
    (Status.TIME_LIMIT, SHORT | {"walk_limit": 0.1}, [({"walk_limit": 20.0}, "scene.walk_limit")]),
    (
        Status.TIME_LIMIT,
        SLIDING,
        [({"mu_fc": 1.0}, "floor_friction"), ({"distance_limit": 0.3}, "scene.distance_limit")],
    ),
    (
        Status.STEP_LIMIT,
        FIRST_MOMENTS | {"tolerance": 1e-10, "step_limit": 1000},
        [({"step_limit": 10_000}, "options.step_limit"), ({"tolerance": 1e-6}, "options.tolerance")],
    ),
    (Status.STEP_LIMIT, FIRST_MOMENTS | {"preset": "paper", "step_limit": 1000}, [({"preset": "soft"}, "soften")]),
    (
        Status.STEP_TOO_SMALL,
        FIRST_MOMENTS | {"tolerance": 1e-10, "smallest_step": 1.5e-5},
        [({"smallest_step": 1e-12}, "smallest_step; lower"), ({"tolerance": 1e-6}, "options.tolerance")],
    ),
    (
        Status.STEP_TOO_SMALL,
        FIRST_MOMENTS | {"joint_stiffness": 1e12, "joint_damping": 1e12},
        [({"joint_stiffness": 1e7, "joint_damping": 100.0}, "stiffness, damping")],
    ),
    (Status.STEP_TOO_SMALL, FIRST_MOMENTS | {"coulomb_friction": 1e9}, [({"coulomb_friction": 1.1e-4}, "friction")]),
    (
        Status.NOT_STEADY,
        {"links": 40, "preset": "soft", "hold_limit": 0.01, "frame_interval": None},
        [({"hold_limit": 30.0}, "scene.hold_limit; raise")],
    ),
    pytest.param(
        Status.NOT_STEADY,
        WHIRLING,
        [({"start": "ellipse"}, "start: ellipse"), ({"frequency": 5.0}, "a third of the frequency")],
        marks=pytest.mark.slow,
    ),
]


@pytest.mark.parametrize(("status", "settings", "remedies"), ADVICE)
def test_the_advice_of_a_status_helps(
    status: Status, settings: dict[str, Any], remedies: list[tuple[dict[str, Any], str]]
) -> None:
    """The walk ends with the status; with each remedy that the sentence names it ends as planned."""
    assert warpchain.walk(**settings).status is status
    for remedy, named in remedies:
        assert named in status.sentence
        assert warpchain.walk(**settings | remedy).status.ok, remedy


def test_the_advice_of_statuses_that_only_flights_reach() -> None:
    """Absurd speeds are lowered, and a neighbour list that is too wide is made narrower."""
    position, velocity = dropped()
    lying = folded(60)
    for status, first, second, named in (
        (Status.NOT_FINITE, {"velocity": velocity * 1e305}, {"velocity": velocity}, "lower speeds"),
        (Status.LIST_OVERFLOW, {"skin": 1.0}, {"skin": 2e-3}, "lower options.skin"),
    ):
        given = (
            {"position": position} if "velocity" in first else dict(zip(("position", "velocity"), lying, strict=True))
        )
        ends = [warpchain.simulate("soft", duration=1e-4, **given, **case).status for case in (first, second)]
        assert named in status.sentence and ends == [status, Status.FINISHED]


def test_a_loop_that_is_not_steady_is_not_said_to_drift_too_little(command: Command) -> None:
    """What was watched last may have been still; the line says that it was not what counts."""
    told = command("walk", "--links", "40", "--preset", "soft", "--set", "hold_limit=0.4", "--set", "load_factor=1")
    assert told.status == 1 and "not_steady" in told.out
    (line,) = [line for line in told.out.splitlines() if line.startswith("loop held")]
    assert "shape or speed kept changing" in line or "never watched" in line
