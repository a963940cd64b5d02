"""What a walk tells while it is computed."""

from typing import Any

import numpy as np
import pytest

import warpchain
from warpchain.walks.walk_phases import Progress

SMALL: dict[str, Any] = {"links": 40, "preset": "soft", "frame_interval": 4e-3}


@pytest.mark.parametrize(
    "more",
    [
        {"start": "ellipse"},
        {"start": "spinning"},
        {"start": "ellipse", "plane": "tilting", "tilt": 0.1},
        {"start": "spinning", "release": [[0.02, 0, 0, 15]]},
    ],
)
def test_progress_has_each_frame_once(more: dict[str, Any]) -> None:
    """Together they are the frames of the result, in the room; the sprocket's height is known with the first."""
    told: list[Progress] = []
    walk = warpchain.walk(**SMALL, **more, on_progress=told.append)
    times = np.concatenate([each.frame_time for each in told])
    joints = np.concatenate([each.frame_joints for each in told if len(each.frame_time)])
    assert len(times) > 50 and times.tobytes() == walk.frame_time.tobytes()
    wanted = walk.frame_joints if walk.joints_lab is None else walk.joints_lab
    np.testing.assert_array_equal(joints, wanted)
    first = next(each for each in told if len(each.frame_time))
    np.testing.assert_equal(first.sprocket_height, walk.sprocket_height)


def test_progress_of_a_walk_from_a_state() -> None:
    """It has the frames from the state on."""
    before, told = warpchain.walk(**SMALL, start="ellipse"), list[Progress]()
    walk = warpchain.walk(start=before.state(0.1), frame_interval=4e-3, on_progress=told.append)
    assert np.concatenate([each.frame_time for each in told]).tobytes() == walk.frame_time.tobytes()
