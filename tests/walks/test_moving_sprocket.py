"""A release by a given motion of the sprocket, with the floor present."""

from typing import Any

import numpy as np
import pytest
import warp as wp
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

import warpchain
from tests.walks.test_states import assert_rest_of, walked
from warpchain import InputError
from warpchain.chain.sprocket_motion import motion_rows, sprocket_places
from warpchain.kernels.contacts.fixed_body import moved_sprocket
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.types import Drive

SPUN: dict[str, Any] = {"links": 36, "frequency": 20.0, "start": "spinning", "preset": "soft", "method": "os32"}
MOTION = ((0.02, 0.0, -0.01, 20.0), (0.05, 0.1, -0.01, 5.0), (0.06, 0.1, 0.02, 0.0))


@wp.kernel(enable_backward=False)
def places(times: wp.array(dtype=wp.float64), drive: Drive, found: wp.array2d(dtype=wp.float64)):
    """Place, velocity and angular velocity of the sprocket at some times."""
    i = wp.tid()
    face = moved_sprocket(Face(), drive, 0, times[i])
    found[i, 0] = face.x
    found[i, 1] = face.y
    found[i, 2] = face.u
    found[i, 3] = face.v
    found[i, 4] = face.turning


def test_the_sprocket_is_where_scipy_has_it() -> None:
    """Between its rows it goes on SciPy's monotone cubics, from rest; its rate of turning changes evenly.

    Pictures have it where kernels do, until it vanishes.
    """
    height, frequency = 0.08, 20.0
    times = np.sort(np.append(np.random.default_rng(1).uniform(0, 0.06, 200), [0.0, 0.02, 0.05, 0.06]))
    drive, found = Drive(), wp.zeros((len(times), 5), dtype=wp.float64, device="cpu")
    drive.motion = wp.array(motion_rows(MOTION, frequency, height)[None], dtype=wp.float64, device="cpu")
    drive.push_rate = wp.zeros(1, dtype=wp.float64, device="cpu")
    wp.launch(places, len(times), [wp.array(times, dtype=wp.float64, device="cpu"), drive, found], device="cpu")
    rows = np.array([(0.0, 0.0, 0.0, frequency), *MOTION])
    place = rows[:, 1:3] + [0.0, height]
    slopes = PchipInterpolator(rows[:, 0], place).derivative()(rows[:, 0])
    slopes[0] = 0.0
    curve = CubicHermiteSpline(rows[:, 0], place, slopes)
    ours = found.numpy()
    np.testing.assert_allclose(ours[:, :2], curve(times), rtol=1e-12, atol=1e-15)
    drawn = sprocket_places(MOTION, times) + np.array([0.0, height])
    np.testing.assert_allclose(drawn[times < 0.06], ours[times < 0.06, :2], rtol=1e-12, atol=1e-15)
    assert np.isnan(drawn[times >= 0.06]).all() and np.isnan(sprocket_places(None, times)).all()
    np.testing.assert_allclose(ours[:, 2:4], curve.derivative()(times), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(ours[:, 4], -2 * np.pi * np.interp(times, rows[:, 0], rows[:, 3]), rtol=1e-12)
    assert (np.abs(ours[:, 0] - 0.05) <= 0.05 + 1e-15).all()  # no overshoot


def test_a_sprocket_that_goes_on_as_it_was_keeps_the_loop() -> None:
    """The loop stays where and as fast as it was; when the sprocket vanishes, its centre falls on a parabola."""
    walk = warpchain.walk(**SPUN, release=[[0.2, 0.0, 0.0, 20.0]], clearance=1.0, stop_time=0.4)
    held = walk.time <= 0.2
    assert np.ptp(walk.center[held], axis=0).max() < 2e-3
    assert np.ptp(walk.kinetic_energy[held]) < 0.02 * walk.kinetic_energy[0]
    free = walk.time >= 0.2
    since = walk.time[free] - 0.2
    start, speed = walk.center[free][0], walk.center_velocity[free][0]
    fall = start + speed * since[:, None] - [0.0, walk.setup.parameters.gravity / 2] * since[:, None] ** 2
    np.testing.assert_allclose(walk.center[free], fall, atol=1e-7)
    assert walk.impulses["floor"] == walk.bounces == 0 and walk.impulses["sprocket"] > 1000


def test_a_throw_gives_the_chain_the_speed_of_the_sprocket() -> None:
    """A sprocket that is moved along takes the chain with it; what it does is in the ledger, which closes."""
    usual = walked(**SPUN)
    thrown = warpchain.walk(**SPUN, release=[[0.1, 0.2, 0.0, 20.0]])
    at = np.searchsorted(thrown.time, 0.1)
    moved = thrown.center[at] - thrown.center[0]
    assert moved[0] == pytest.approx(0.2, abs=0.03)
    speed = thrown.center_velocity[at : at + 20].mean(axis=0)
    assert 1.5 < speed[0] < 4.0  # the motion ends at 2 m/s, and the loop swings forward
    assert thrown.status.label == "at_rest" and thrown.dx > usual.dx + 1
    assert thrown.energy["floor"] < usual.energy["floor"] and thrown.energy_error < 1e-3
    assert thrown.greatest_penetration["sprocket"] < 1e-3


LOWERED = [[0.05, 0.0, -0.012, 0.0], [0.07, 0.0, -0.012, 0.0]]
HYBRID = {"links": 36, "frequency": 15.0, "start": "spinning"}
PRESSED = {"links": 30, "frequency": 8.0, "start": "spinning", "preset": "soft"}


@pytest.mark.parametrize(
    ("settings", "release", "deep"),
    [(SPUN, LOWERED, False), (HYBRID, LOWERED, False), (PRESSED, [[0.2, 0, -0.02, 0]], True)],
    ids=["explicit", "hybrid", "pressed into the floor"],
)
def test_a_walk_goes_on_when_the_sprocket_has_vanished(settings: dict[str, Any], release: Any, deep: bool) -> None:
    """Lowered onto the floor and stopped, a loop walks less far; from then on its states go on to the bit."""
    lowered = warpchain.walk(**settings, release=release)
    assert lowered.status.label == "at_rest" and lowered.dx < walked(**settings).dx
    assert lowered.energy_error < 1e-2 and lowered.bounces > 0
    with pytest.raises(InputError, match=r"t: expected a time after 0\.\d+ s, when the sprocket vanishes, got 0.05 s"):
        lowered.state(0.05)
    state = lowered.state(release[-1][0])
    assert (state.joints[:, 1] < 0).any() == deep
    assert_rest_of(warpchain.walk(start=state), lowered, state.time)


def test_a_motion_through_the_floor_is_refused() -> None:
    """How low the sprocket may go is known when the loop hangs on it."""
    with pytest.raises(InputError, match=r"scene\.release: expected y of at least -0\.238\d* m, got -0\.5"):
        warpchain.walk(**SPUN, release=[[0.2, 0.0, -0.5, 8.0]])
