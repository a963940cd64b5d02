"""Softer joints in the pile: when, how much, and that nothing else changes."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import warpchain
from warpchain import State, Status

SERIES = ("time", "center", "center_velocity", "kinetic_energy", "spring_energy", "lowest", "rms_speed")


def short_walk(**settings):
    """A walk of a loop of 20 links with the joints of Table 1."""
    given = {"links": 20, "frequency": 8.0, "start": "ellipse", "method": "reference"}
    given |= {"soften_area": 0.3, "frame_interval": 1e-3}
    return warpchain.walk(**given | settings)


@pytest.fixture(scope="module")
def walks():
    """The walk with its own joints throughout, softened in the pile, and in steps to a looser tolerance from there."""
    return short_walk(), short_walk(soften_pile=True), short_walk(soften_pile=True, soft_tolerance=1e-3)


def shoelace(joints: np.ndarray) -> np.ndarray:
    """Area (f,) inside polygons (f, n, 2)."""
    x, y = joints[..., 0], joints[..., 1]
    return 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)


def test_joints_soften_at_the_first_mark_of_a_small_area(walks) -> None:
    """The moment is that of the first sample whose loop encloses less than 0.3 of the area at the release."""
    _, softened_walk, _ = walks
    area = shoelace(softened_walk.frame_joints)
    first = np.flatnonzero(area / area[0] < 0.3)[0]
    assert 0 < first < len(area) - 20
    assert softened_walk.softened_at == softened_walk.frame_time[first]


def test_nothing_changes_before_the_joints_soften(walks) -> None:
    """Up to the switch all series are equal to the bit, whether joints soften then and to what tolerance."""
    stiff_walk, softened_walk, loose_walk = walks
    switch = int(np.searchsorted(softened_walk.time, softened_walk.softened_at, side="right")) - 1
    for name in SERIES:
        stiff, soft, loose = (getattr(walk, name) for walk in walks)
        for one, other in ((stiff, soft), (soft, loose)):
            assert_array_equal(one[: switch + 1], other[: switch + 1], err_msg=name)
            assert name == "time" or not np.array_equal(one[switch + 1], other[switch + 1]), name
    assert np.isnan(stiff_walk.softened_at) and loose_walk.softened_at == softened_walk.softened_at


def test_softened_walks_end_alike_with_fewer_steps(walks) -> None:
    """The chain comes to rest at the same place to a millimetre, in far fewer steps, fewer still if looser."""
    stiff_walk, softened_walk, loose_walk = walks
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
