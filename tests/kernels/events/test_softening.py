"""Softer joints in the pile: when, how much, and that nothing else changes."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import warpchain
from tests.support.presets import PAPER
from tests.support.setups import setup_walk
from warpchain import InputError, State, Status
from warpchain.inputs.start_shapes import ellipse, lay_chain

SERIES = ("time", "center", "center_velocity", "kinetic_energy", "spring_energy", "lowest", "rms_speed")


def short_walk(**settings):
    """A walk of a loop of 20 links with the joints of Table 1."""
    given = {"links": 20, "frequency": 8.0, "start": "ellipse", "method": "reference"}
    given |= {"soften_area": 0.3, "frame_interval": 1e-3}
    return warpchain.walk(**given | settings)


@pytest.fixture(scope="module")
def stiff_walk():
    """The walk with its own joints throughout."""
    return short_walk()


@pytest.fixture(scope="module")
def softened_walk():
    """The same, softened in the pile."""
    return short_walk(soften_pile=True)


@pytest.fixture(scope="module")
def loose_walk():
    """The same, in steps to a looser tolerance from there."""
    return short_walk(soften_pile=True, soft_tolerance=1e-3)


def shoelace(joints: np.ndarray) -> np.ndarray:
    """Area (f,) inside polygons (f, n, 2)."""
    x, y = joints[..., 0], joints[..., 1]
    return 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)


def test_joints_soften_at_the_first_mark_of_a_small_area(softened_walk) -> None:
    """The moment is that of the first sample whose loop encloses less than 0.3 of the area at the release."""
    area = shoelace(softened_walk.frame_joints)
    first = np.flatnonzero(area / area[0] < 0.3)[0]
    assert 0 < first < len(area) - 20
    assert softened_walk.softened_at == softened_walk.frame_time[first]


def test_nothing_changes_before_the_joints_soften(stiff_walk, softened_walk, loose_walk) -> None:
    """Up to the switch all series are equal to the bit, whether joints soften then and to what tolerance."""
    switch = int(np.searchsorted(softened_walk.time, softened_walk.softened_at, side="right")) - 1
    for name in SERIES:
        stiff, soft, loose = (getattr(walk, name) for walk in (stiff_walk, softened_walk, loose_walk))
        for one, other in ((stiff, soft), (soft, loose)):
            assert_array_equal(one[: switch + 1], other[: switch + 1], err_msg=name)
            assert name == "time" or not np.array_equal(one[switch + 1], other[switch + 1]), name
    assert np.isnan(stiff_walk.softened_at) and loose_walk.softened_at == softened_walk.softened_at


def test_softened_walks_end_alike_with_fewer_steps(stiff_walk, softened_walk, loose_walk) -> None:
    """The chain comes to rest at the same place to a millimetre, in far fewer steps, fewer still if looser."""
    assert softened_walk.status == Status.AT_REST
    assert softened_walk.dx == pytest.approx(stiff_walk.dx, abs=1e-3)
    assert loose_walk.dx == pytest.approx(softened_walk.dx, abs=1e-3)
    assert softened_walk.steps_accepted < 0.7 * stiff_walk.steps_accepted
    assert loose_walk.steps_accepted < softened_walk.steps_accepted


def openings(state: State) -> float:
    """Sum of the squares of all joints' openings [m²]."""
    angle = state.position[:, 2]
    arm = state.parameters.link_length / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    left, right = state.position[:, :2] - arm, state.position[:, :2] + arm
    return float(np.sum((np.roll(left, -1, axis=0) - right) ** 2))


@pytest.mark.parametrize("method", ["rkf78", "dp5"])
def test_ledger_of_a_softened_walk_closes(method: str) -> None:
    """What softening frees is ½ (k − k') Σ C² at the two switches; with it the ledger closes as before."""
    walk = short_walk(method=method, soften_pile=True, soften_area=0.6)
    energy = walk.energy
    at_release = energy["kinetic_at_release"] + energy["potential_at_release"]
    assert abs(energy["residual"]) < 1e-5 * at_release
    area = shoelace(walk.frame_joints)
    switches = [walk.frame_time[np.flatnonzero(area / area[0] < fraction)[0]] for fraction in (0.6, 0.3)]
    assert switches[0] == walk.softened_at < switches[1]
    soft, softest = (openings(walk.state(moment)) for moment in switches)
    stiffness = walk.setup.parameters.joint_stiffness
    freed = 0.99 * stiffness * soft + 0.009 * stiffness * softest
    assert energy["softening"] == pytest.approx(freed / 2, rel=1e-6)


def test_marks_too_far_apart_for_joints_to_stiffen_are_refused() -> None:
    """Joints stiffen at marks of the record, which may be 2 ms apart at most."""
    with pytest.raises(InputError, match=r"^options\.soften_drive: .* 0\.005 s .* at most 0\.002 s, or .*$"):
        setup_walk("paper", {"soften_drive": True, "record_interval": 5e-3})


@pytest.mark.parametrize("name", ["soften_pile", "soften_drive"])
def test_simulate_does_not_soften(name: str) -> None:
    """A given chain has neither release nor pile: asked to soften, `simulate` refuses."""
    position, velocity = lay_chain(ellipse(1.0), 8, PAPER.link_length, 1.0)
    with pytest.raises(InputError, match=rf"^options\.{name}: only a walk"):
        warpchain.simulate("paper", position, velocity, 0.1, **{name: True})
