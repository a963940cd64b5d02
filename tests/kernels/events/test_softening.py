"""Softer joints in the pile and on the sprocket: when, how much, and that nothing else changes."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import warpchain
from tests.support.setups import setup_walk
from warpchain import InputError, Status, preset
from warpchain.engine.control import SOFTEST
from warpchain.inputs.start_shapes import ellipse, lay_chain

PAPER = preset("paper")
SERIES = ("time", "center", "center_velocity", "kinetic_energy", "spring_energy", "lowest", "rms_speed")


# --- area and joints ---


# --- the pile ---


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
def early_walk():
    """The same, softened earlier, so that its area then halves."""
    return short_walk(soften_pile=True, soften_area=0.6)


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


def test_nothing_changes_before_the_joints_soften(stiff_walk, softened_walk) -> None:
    """Up to the switch the series are those of the stiff walk to the bit, afterwards they are not."""
    switch = int(np.flatnonzero(softened_walk.time == softened_walk.softened_at)[0])
    for name in SERIES:
        stiff, soft = getattr(stiff_walk, name), getattr(softened_walk, name)
        assert_array_equal(stiff[: switch + 1], soft[: switch + 1], err_msg=name)
        assert not np.array_equal(stiff[switch + 1], soft[switch + 1]), name
    assert np.isnan(stiff_walk.softened_at)


def test_soft_tolerance_changes_a_walk_from_where_its_joints_soften(stiff_walk, softened_walk) -> None:
    """A walk that never softens has the same bits for any; one that does has them up to there, then fewer steps."""
    unsoftened = short_walk(soft_tolerance=1e-3)
    loose = short_walk(soften_pile=True, soft_tolerance=1e-3)
    switch = int(np.flatnonzero(softened_walk.time == softened_walk.softened_at)[0])
    for name in SERIES:
        assert_array_equal(getattr(unsoftened, name), getattr(stiff_walk, name), err_msg=name)
        tight, after = getattr(softened_walk, name), getattr(loose, name)
        assert_array_equal(after[: switch + 1], tight[: switch + 1], err_msg=name)
        assert not np.array_equal(after[switch + 1], tight[switch + 1]), name
    assert loose.softened_at == softened_walk.softened_at
    assert loose.steps_accepted < softened_walk.steps_accepted
    assert loose.dx == pytest.approx(softened_walk.dx, abs=1e-3)


def test_softened_walk_ends_alike_with_fewer_steps(stiff_walk, softened_walk) -> None:
    """The chain comes to rest at the same place to a millimetre, in far fewer steps."""
    assert softened_walk.status == Status.AT_REST
    assert softened_walk.dx == pytest.approx(stiff_walk.dx, abs=1e-3)
    assert softened_walk.steps_accepted < 0.7 * stiff_walk.steps_accepted


@pytest.mark.parametrize("method", ["rkf78", "dp5"])
def test_ledger_of_a_softened_walk_closes(method: str, early_walk) -> None:
    """What softening frees is ½ (k − k') Σ C² at the two switches; with it the ledger closes as before."""
    walk = early_walk if method == "rkf78" else short_walk(method=method, soften_pile=True, soften_area=0.6)
    energy = walk.energy
    at_release = energy["kinetic_at_release"] + energy["potential_at_release"]
    assert abs(energy["residual"]) < 1e-5 * at_release
    area = shoelace(walk.frame_joints)
    switches = [walk.frame_time[np.flatnonzero(area / area[0] < fraction)[0]] for fraction in (0.6, 0.3)]
    assert switches[0] == walk.softened_at < switches[1]
    (to_soft,), (to_softest,) = (walk.spring_energy[walk.time == moment] for moment in switches)
    assert energy["softening"] == pytest.approx(0.99 * to_soft + 0.9 * to_softest, rel=1e-12)


def test_soft_joints_are_left_alone() -> None:
    """A walk with the softest joints has nothing to soften: it is the same to the bit and says that it did not."""
    joints = {name: getattr(SOFTEST, name) for name in ("joint_stiffness", "joint_damping", "friction_smoothing")}
    walks = [short_walk(preset="soft", soften_pile=on, **joints) for on in (False, True)]
    for name in SERIES:
        assert_array_equal(getattr(walks[0], name), getattr(walks[1], name), err_msg=name)
    assert walks[0].energy == walks[1].energy
    assert np.isnan(walks[1].softened_at)


# --- refusals ---


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"soften_drive": True, "record_interval": 5e-3},
            r"options\.soften_drive: joints stiffen at each record_interval, and 0\.005 s .* at most 0\.002 s, or .*",
        ),
    ],
)
def test_bad_values_are_refused(settings: dict, message: str) -> None:
    """Options of softening that cannot be are refused in one line."""
    with pytest.raises(InputError, match=f"^{message}$"):
        setup_walk("paper", settings, None)


@pytest.mark.parametrize("name", ["soften_pile", "soften_drive"])
def test_simulate_does_not_soften(name: str) -> None:
    """A given chain has neither release nor pile: asked to soften, `simulate` refuses."""
    position, velocity = lay_chain(ellipse(1.0), 8, PAPER.link_length, 1.0)
    with pytest.raises(InputError, match=rf"^options\.{name}: only a walk"):
        warpchain.simulate("paper", position, velocity, 0.1, **{name: True})
