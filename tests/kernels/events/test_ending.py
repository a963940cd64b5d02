"""When a walk first touches itself and when its loop collapses, after how many bounces."""

import math

import numpy as np
import pytest
import warp as wp

import warpchain
from tests.kernels.events.test_softening import shoelace
from warpchain import Status, preset
from warpchain.engine.batch import Batch
from warpchain.engine.devices import start_device
from warpchain.inputs.options import Options
from warpchain.kernels import layout
from warpchain.kernels.events.ending import watch_ending
from warpchain.kernels.types import State

CPU = start_device("cpu").warp
NEVER = -math.inf

# --- the watch, fed with made-up samples ---


@wp.kernel(module="unique", enable_backward=False)
def _samples(
    state: State,
    times: wp.array(dtype=wp.float64),
    areas: wp.array(dtype=wp.float64),
    impulses: wp.array(dtype=wp.int64),
    last: wp.array(dtype=wp.float64),
    bounces: wp.array(dtype=wp.int64),
):
    for i in range(times.shape[0]):
        state.counts[0, layout.BOUNCES] = bounces[i]
        watch_ending(state, 0, times[i], areas[i], impulses[i], last[i], i == 0)


def watched(areas: list[float], impulses: list[int], last: list[float], bounces: list[int]) -> list[float]:
    """The six entries of the watch after samples at 0, 1, 2 … ms; NaN where nothing was noted."""
    batch = Batch(1, 4, Options())
    batch.set_chain(0, preset("soft"), 4)
    batch.load(0, np.zeros((4, 3)), np.zeros((4, 3)), stop_time=1.0, stop_status=Status.FINISHED)
    times = 1e-3 * np.arange(len(areas))
    arrays = [
        wp.array(values, dtype=kind, device=CPU)
        for values, kind in (
            *((times, wp.float64), (areas, wp.float64), (impulses, wp.int64)),
            *((last, wp.float64), (bounces, wp.int64)),
        )
    ]
    wp.launch(_samples, dim=1, inputs=[batch.state, *arrays], device=CPU)
    return [batch.watched(0, row) for row in range(layout.SELF_CONTACT_AT, layout.COLLAPSE_FLIGHT + 1)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_first_sample_of_each_event_is_noted(sign: float) -> None:
    """Time, bounces and flight are those of the first sample that fulfils it, whichever way the loop runs."""
    areas = [sign * area for area in (8.0, 7.0, 4.0, 3.999, 9.0, -1.0)]
    noted = watched(areas, [0, 0, 3, 3, 9, 9], [NEVER, 0.5e-3, 1.5e-3, 2.5e-3, 2.6e-3, 2.6e-3], [0, 1, 2, 4, 5, 6])
    assert noted == pytest.approx([2e-3, 2, 0.5e-3, 3e-3, 4, 0.5e-3])


def test_what_never_happens_is_not_noted() -> None:
    """Half of the area is not less than half; no impulse is no contact."""
    assert np.isnan(watched([2.0, 1.0, 1.5], [0, 0, 0], [NEVER] * 3, [0, 0, 0])).all()


def test_events_before_the_floor_have_no_flight() -> None:
    """Before the first bounce no time since the floor is known: infinite, after none."""
    assert watched([2.0, 0.5], [0, 1], [NEVER] * 2, [0, 0]) == [1e-3, 0, math.inf, 1e-3, 0, math.inf]


def test_a_loop_without_area_does_not_collapse() -> None:
    """A chain folded flat at the release has no loop to lose."""
    assert math.isnan(watched([0.0, 0.0], [0, 0], [NEVER] * 2, [0, 0])[3])


# --- a walk ---


@pytest.fixture(scope="module", params=["hybrid", "os32", "tilting"])
def walk(request: pytest.FixtureRequest) -> warpchain.WalkResult:
    """A soft chain of 30 links that walks until it is at rest, with a frame at every sample."""
    method = request.param if request.param != "tilting" else "os32"
    plane = "tilting" if request.param == "tilting" else "fixed"
    return warpchain.walk(
        links=30, frequency=8.0, preset="soft", start="ellipse", method=method, plane=plane, frame_interval=1e-3
    )


def test_collapse_is_seen_in_the_frames(walk: warpchain.WalkResult) -> None:
    """`collapsed_at` is the first frame that encloses less than half of the area of the first one."""
    area = shoelace(walk.frame_joints)
    first = np.flatnonzero(area / area[0] < 0.5)[0]
    assert first > 100
    assert walk.collapsed_at == walk.frame_time[first]


def test_self_contact_is_seen_in_the_frames(walk: warpchain.WalkResult) -> None:
    """Circles of links without a common joint are apart in all frames before `self_contact_at`, and meet around it."""
    joints, n, radius = walk.frame_joints, walk.setup.scene.links, walk.setup.parameters.circle_radius
    steps = np.arange(n)[:, None] - np.arange(n)
    far = np.minimum(steps % n, -steps % n) > 1  # the two circles of a joint belong to neighbours
    least = np.array([np.hypot(*np.moveaxis(frame[:, None] - frame, -1, 0))[far].min() for frame in joints])
    at = int(np.flatnonzero(walk.frame_time == walk.self_contact_at)[0])
    assert np.all(least[:at] > 2 * radius - 1e-4)
    assert least[at - 1 : at + 1].min() < 2 * radius + 1e-3
    assert walk.impulses["self"] > 0


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
    assert math.isnan(walk.self_contact_at) and math.isnan(walk.collapsed_at)
    assert walk.bounces_before_self_contact == walk.bounces_before_collapse == -1
    assert math.isnan(walk.flight_before_self_contact) and math.isnan(walk.flight_before_collapse)
