"""States: taken from walks, continued, perturbed, or given by a measured outline."""

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

import warpchain
from tests.oracle_model.motion_equations import gravitational_energy, kinetic_energy
from warpchain import InputError, State, WalkResult
from warpchain.kernels.cpu import stage_rows
from warpchain.walks.walk_numbers import MOTION, NUMBERS

SPUN = {"links": 36, "frequency": 15.0, "start": "spinning"}
ELLIPSE = {"links": 36, "frequency": 20.0, "start": "ellipse", "preset": "soft", "method": "dp5"}
BRIEF = {"links": 12, "frequency": 3.0, "start": "ellipse", "preset": "soft", "clearance": 1e-3, "stop_time": 0.03}
WALKS: dict[str, tuple[dict[str, Any], float]] = {
    "explicit": (ELLIPSE, 0.6),
    "at the release": (ELLIPSE, 0.0),
    "rigid joints": (SPUN, 0.3),
    "soft joints": (SPUN, 0.95),
    "tilting": (SPUN | {"preset": "soft", "plane": "tilting", "tilt": 0.1}, 0.6),
    "gpu": (BRIEF | {"method": "dp5", "device": "fibers"}, 0.6),
}
"""Name → walk, and where its state is taken, as a share of its time."""


def numbers(walk: WalkResult) -> dict[str, object]:
    """All numbers of a walk that a repetition must have as well."""
    return {name: repr(getattr(walk, name)) for name in ("status", *NUMBERS) if name != "wall_time"}


def assert_rest_of(walk: WalkResult, whole: WalkResult, start: float) -> None:
    """A walk has the numbers of another one, and its samples and frames after a time, to the bit."""
    assert numbers(walk) == numbers(whole)
    for name, stored in MOTION.items():
        ours, theirs = getattr(walk, name), getattr(whole, name)
        kind = "frame_time" if stored.shape[0] == "f" else "time"
        if len(ours):
            later = [getattr(each, kind) > start for each in (walk, whole)]
            assert later[0].sum() > 3
            assert ours[later[0]].tobytes() == theirs[later[1]].tobytes(), name


walked = functools.cache(warpchain.walk)
"""A walk that several tests begin with."""


@pytest.fixture(scope="module")
def fall() -> WalkResult:
    """A walk of an ellipse without a sprocket."""
    return walked(**ELLIPSE)


@pytest.mark.parametrize("name", WALKS)
def test_a_state_goes_on_to_the_bit(name: str) -> None:
    """Unchanged, what begins from a state is the rest of its walk: every number, sample and frame."""
    settings, share = WALKS[name]
    whole = walked(**settings, frame_interval=1e-3)
    state = whole.state(share * whole.walk_time)
    assert 0 <= state.time - share * whole.walk_time < 2e-3
    if name in ("rigid joints", "soft joints"):
        assert (state.memory["state/is_rigid"] == 1) == (name == "rigid joints")
        assert (state.memory["state/softness"] > 0) == (name == "soft joints")
    assert_rest_of(warpchain.walk(start=state, frame_interval=1e-3), whole, state.time)


def test_a_state_of_the_rest_is_that_of_the_walk(fall: WalkResult, tmp_path: Path) -> None:
    """A walk that began from a state has states of its own, also after it was saved and loaded."""
    rest = warpchain.walk(start=fall.state(0.3))
    rest.save(tmp_path / "rest.h5")
    loaded = warpchain.load_walk(tmp_path / "rest.h5")
    for walk in (fall, rest, loaded):
        state = walk.state(0.7)
        assert_rest_of(warpchain.walk(start=state), fall, state.time)
    assert numbers(warpchain.walk(setup=loaded.setup)) == numbers(fall)


@pytest.mark.parametrize("settings", [ELLIPSE, SPUN], ids=["explicit", "hybrid"])
def test_a_perturbed_state_is_another_walk_with_a_ledger_of_its_own(
    settings: Mapping[str, Any], tmp_path: Path
) -> None:
    """Δx changes, energy counts from the perturbed state, clock and events go on; it is repeatable bit for bit."""
    whole = walked(**settings)
    state = whole.state(0.4 * whole.walk_time)
    perturbed = replace(state, velocity=1.01 * state.velocity)
    walk = warpchain.walk(start=perturbed)
    assert walk.status is whole.status and walk.dx != whole.dx
    kinetic = kinetic_energy(perturbed.velocity, perturbed.parameters)
    gravitational = gravitational_energy(perturbed.position, perturbed.parameters)
    assert walk.energy["kinetic_at_release"] == pytest.approx(kinetic, rel=1e-12)
    assert walk.gravitational_energy[0] == pytest.approx(gravitational, rel=1e-12)
    assert abs(walk.energy["residual"]) < 2e-3 * kinetic
    assert walk.time[0] == state.time and walk.time[1] == math.ceil(state.time * 1e3) * 1e-3
    assert walk.bounces >= state.memory["state/counts"][5]
    assert walk.collapsed_at == pytest.approx(whole.collapsed_at, abs=0.05)
    walk.save(tmp_path / "walk.h5")
    again = warpchain.load_walk(tmp_path / "walk.h5")
    assert numbers(warpchain.walk(setup=again.setup)) == numbers(walk)
    later = walk.state(walk.walk_time - 0.1)
    assert numbers(warpchain.walk(start=later)) == numbers(walk)


def test_a_state_goes_on_with_other_values(fall: WalkResult) -> None:
    """Other parameters, options, limits and floors hold from the state on, and the ledger of the new walk closes."""
    state = fall.state(0.3)
    planned, slippery, finer, other = (
        warpchain.walk(start=state, stop_time=0.4, **given)
        for given in ({}, {"floor_friction": 0.01}, {"tolerance": 1e-8}, {"method": "os32"})
    )
    assert planned.status.label == "finished" and planned.walk_time == 0.4
    assert slippery.center[-1, 0] < planned.center[-1, 0] - 1e-3  # friction drives it
    assert finer.setup.options.method == "dp5" and finer.steps_accepted > planned.steps_accepted
    assert other.setup.options.method == "os32" and other.setup.options.tolerance == 1e-6
    lower = warpchain.walk(start=fall.state(0.2), floor=[[-1, -0.5], [3, -0.5]], method="os32", precision="mixed")
    assert lower.status.label == "at_rest" and lower.center[-1, 1] == pytest.approx(fall.center[-1, 1] - 0.5, abs=5e-3)
    assert lower.energy_error < 1e-3
    later = lower.state(1.0)
    assert_rest_of(warpchain.walk(start=later), lower, later.time)


def outline(links: int, length: float) -> np.ndarray:
    """Joints of a regular polygon with sides of a length, above the floor."""
    angle = 2 * np.pi * np.arange(links) / links
    radius = length / (2 * math.sin(math.pi / links))
    return np.column_stack([radius * np.cos(angle), radius * (1.2 + np.sin(angle))])


LENGTH = warpchain.preset("paper").link_length
RING = outline(12, LENGTH)


def test_a_measured_outline_closes_and_moves_as_little_as_it_must() -> None:
    """Joints with errors become links of one length that meet; no way to do so needs noticeably less motion."""
    measured = RING + np.random.default_rng(3).normal(0, 7e-5, (12, 2))
    state = State.of_joints(measured)
    spans = np.linalg.norm(state.joints - np.roll(state.joints, 1, axis=0), axis=1)
    np.testing.assert_allclose(spans, LENGTH, rtol=1e-12)
    ends = state.joints - state.position[:, :2]
    lefts = np.roll(state.position[:, :2] - ends, -1, axis=0)
    np.testing.assert_allclose(lefts, state.joints, atol=1e-15)

    def misfit(joints: np.ndarray) -> np.ndarray:
        places = joints.reshape(-1, 2)
        return np.sum((places - np.roll(places, 1, axis=0)) ** 2, axis=1) - 1

    best = minimize(
        lambda joints: np.sum((joints - measured.ravel() / LENGTH) ** 2),
        measured.ravel() / LENGTH,
        constraints={"type": "eq", "fun": misfit},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 300},
    )
    assert best.success
    assert np.sum((state.joints - measured) ** 2) < 1.01 * best.fun * LENGTH**2
    assert (state.velocity == 0).all() and state.time == 0


def test_the_clock_of_a_state_is_that_of_its_walk() -> None:
    """Any other time is refused; a measured state has time 0."""
    state = State.of_joints(RING)
    for time in (-1.0, 1.0, math.nan, "a"):
        with pytest.raises(InputError, match=r"^time: expected the time of its walk, 0 s, got .*"):
            replace(state, time=time)


def test_measured_velocities_keep_links_as_long_as_they_are() -> None:
    """A rotation of all joints comes back as it is; of any rates, what would stretch links is taken away."""
    turning = 7.0 * np.column_stack([-RING[:, 1], RING[:, 0]])
    state = State.of_joints(RING, turning, "soft")
    np.testing.assert_allclose(state.velocity[:, 2], 7.0, rtol=1e-9)
    rates = np.random.default_rng(4).normal(0, 1, (12, 2))
    state = State.of_joints(RING, rates, "soft")
    angle, omega = state.position[:, 2], state.velocity[:, 2]
    arm = state.parameters.link_length / 2 * omega[:, None] * np.column_stack([-np.sin(angle), np.cos(angle)])
    right, left = state.velocity[:, :2] + arm, state.velocity[:, :2] - arm
    np.testing.assert_allclose(np.roll(left, -1, axis=0), right, atol=1e-12)


def test_a_chain_on_an_outline_falls_to_rest() -> None:
    """A ring that was measured at rest falls, and comes to rest near where it was; the walk says how it began."""
    joints = outline(36, warpchain.preset("soft").link_length)
    walk = warpchain.walk(start=State.of_joints(joints, parameters="soft"), method="dp5")
    assert walk.status.label == "at_rest" and abs(walk.dx) < 0.1
    assert "36 links from a given state" in repr(walk)
    height = joints[:, 1].mean()
    masses = 18 * (walk.setup.parameters.inner_mass + walk.setup.parameters.outer_mass)
    assert walk.gravitational_energy[0] == pytest.approx(masses * walk.setup.parameters.gravity * height, rel=1e-9)
    assert walk.time[0] == 0 and walk.sprocket_center is None and math.isnan(walk.sprocket_radius)


@pytest.mark.parametrize(
    ("joints", "problem"),
    [
        (RING * 1000, "joints: the loop is not closed, or lengths are not in m"),
        (outline(11, LENGTH), "joints: expected an even number, got 11"),
        (RING[:, :1], r"joints: expected shape .*, got \(12, 1\)"),
        (RING * np.nan, "joints: expected finite numbers"),
        ("ring", "joints: expected an array of numbers"),
    ],
)
def test_outlines_that_are_no_chain_are_refused(joints: Any, problem: str) -> None:
    """An open loop, another unit, an odd number of joints or no numbers: one line says so."""
    with pytest.raises(InputError, match=problem) as caught:
        State.of_joints(joints)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"links": 12, "clearance": 0.1}, "links, clearance: not possible with a state"),
        ({"seed": 1}, "seed: not possible with a state"),
        ({"walk_limit": 0.1}, "walk_limit: 0.1 s is before the state"),
        ({"floor": [[-1, 0.5], [1, 0.5]]}, r"start: link \d+ starts 0\.\d+ m inside the floor; raise"),
    ],
)
def test_what_comes_before_a_state_is_refused(fall: WalkResult, settings: dict[str, Any], problem: str) -> None:
    """Values of the drive, and a limit that has passed, beside a state; and times outside of the walk have none."""
    with pytest.raises(InputError, match=problem):
        warpchain.walk(start=fall.state(0.2), **settings)
    for time in (-0.1, math.nan, "soon"):
        with pytest.raises(InputError, match=r"^t: expected .*got"):
            fall.state(time)


def test_a_state_keeps_its_floor_in_simulate() -> None:
    """Unless another is given, the floor is that of the state's scene: a chain lies on its slope, not on y = 0."""
    state = warpchain.walk(**ELLIPSE | {"method": "os32", "tolerance": 1e-5}, slope=10.0).state(0.3)
    on_slope, in_the_air = (
        warpchain.simulate(state, duration=0.4, **given)
        for given in ({"method": "os32", "tolerance": 1e-5}, {"method": "dp5", "floor": False})
    )
    assert on_slope.impulses["floor"] > 0 == in_the_air.impulses["floor"]
    x, y = on_slope.position[-1, :, :2].T
    assert (y + x * math.tan(math.radians(10))).min() > 0 > y.min()
    with pytest.raises(InputError, match=r"position: link \d+ starts .* inside the floor"):
        warpchain.simulate(replace(state, position=state.position - [0, 0.3, 0]), duration=0.1, floor=True)


def test_a_state_of_other_rows_is_refused(fall: WalkResult, monkeypatch: pytest.MonkeyPatch) -> None:
    """What kernels with other rows of memory kept is not read as if it were ours; all rows of the memory count."""
    state = fall.state(0.3)
    monkeypatch.setattr(stage_rows, "STAGES", stage_rows.STAGES + 1)
    with pytest.raises(InputError, match="made with other kernels"):
        warpchain.walk(start=state)
