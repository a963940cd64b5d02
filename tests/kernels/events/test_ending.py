"""When a walk first touches itself, when strands of its loop meet and when it collapses, after how many bounces."""

import math

import numpy as np
import pytest

import warpchain
from tests.kernels.events.test_softening import shoelace
from warpchain import Status
from warpchain.kernels import layout

MIXED: dict[str, dict[str, float]] = {"hybrid": {}, "os32": {"tolerance": 1e-5}}
"""Settings with which a method makes steps in mixed precision."""


@pytest.fixture(scope="module", params=["hybrid", "os32", "tilting"])
def walk(request: pytest.FixtureRequest) -> warpchain.WalkResult:
    """A soft chain of 30 links that walks until it is at rest, with a frame at every sample."""
    method = request.param if request.param != "tilting" else "os32"
    plane = "tilting" if request.param == "tilting" else "fixed"
    brief = {"links": 30, "frequency": 8.0, "preset": "soft", "start": "ellipse", "frame_interval": 1e-3}
    return warpchain.walk(**brief, method=method, plane=plane, **MIXED[method])


def nearest(walk: warpchain.WalkResult, apart: int) -> np.ndarray:
    """Least distance in each frame (f,) of two joints that are so many links apart, or more [m]."""
    n = walk.setup.scene.links
    steps = np.arange(n)[:, None] - np.arange(n)
    far = np.minimum(steps % n, -steps % n) >= apart
    return np.array([np.hypot(*np.moveaxis(frame[:, None] - frame, -1, 0))[far].min() for frame in walk.frame_joints])


def test_collapse_is_seen_in_the_frames(walk: warpchain.WalkResult) -> None:
    """`collapsed_at` is the first frame that encloses less than half of the area of the first one."""
    area = shoelace(walk.frame_joints)
    first = np.flatnonzero(area / area[0] < 0.5)[0]
    assert first > 100
    assert walk.collapsed_at == walk.frame_time[first]


def test_self_contact_is_seen_in_the_frames(walk: warpchain.WalkResult) -> None:
    """Circles of links without a common joint are apart in all frames before `self_contact_at`, and meet around it."""
    radius, least = walk.setup.parameters.circle_radius, nearest(walk, 2)  # the circles of a joint are of neighbours
    at = int(np.flatnonzero(walk.frame_time == walk.self_contact_at)[0])
    assert np.all(least[:at] > 2 * radius - 1e-4)
    assert least[at - 1 : at + 1].min() < 2 * radius + 1e-3
    assert walk.impulses["self"] > 0


@pytest.mark.parametrize("method", ["hybrid", "os32"])
def test_strands_meet_after_the_first_crease(method: str) -> None:
    """Strands of a long loop meet when the frames say so, long after its first crease."""
    walk = warpchain.walk(
        links=120,
        frequency=20.0,
        preset="soft",
        start="ellipse",
        method=method,
        frame_interval=1e-3,
        walk_limit=1.2,
        **MIXED[method],
    )
    radius, least = walk.setup.parameters.circle_radius, nearest(walk, layout.STRANDS_APART)
    at = int(np.flatnonzero(walk.frame_time == walk.strands_met_at)[0])
    assert walk.self_contact_at + 0.1 < walk.strands_met_at
    assert np.all(least[:at] > 2 * radius - 1e-4)
    assert least[at - 1 : at + 1].min() < 2 * radius + 2e-3


def test_bounces_before_are_those_of_the_heights(walk: warpchain.WalkResult) -> None:
    """Bounces begun are counted by hand: lowest points below the floor after 10 ms without one."""
    low = walk.time[walk.lowest < 0]
    for at, bounces, flight in (
        (walk.self_contact_at, walk.bounces_before_self_contact, walk.flight_before_self_contact),
        (walk.collapsed_at, walk.bounces_before_collapse, walk.flight_before_collapse),
    ):
        before = low[low <= at]
        assert abs(1 + np.sum(np.diff(before) > 0.011) - bounces) <= 1
        assert 0 < bounces <= walk.bounces
        assert -1e-4 < flight - (at - before[-1]) < 3e-3


def test_a_walk_that_is_cut_short_has_neither() -> None:
    """A chain that is still in the air has not touched itself; its counts are −1."""
    walk = warpchain.walk(links=30, preset="soft", start="ellipse", method="os32", walk_limit=0.005)
    assert walk.status == Status.TIME_LIMIT
    assert math.isnan(walk.self_contact_at) and math.isnan(walk.strands_met_at) and math.isnan(walk.collapsed_at)
    bounces = (walk.bounces_before_self_contact, walk.bounces_before_strands_met, walk.bounces_before_collapse)
    assert bounces == (-1, -1, -1)
    assert math.isnan(walk.flight_before_strands_met) and math.isnan(walk.flight_before_collapse)
