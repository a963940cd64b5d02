"""Forces and moments of joints that a walk records, against mechanics; fine frames; what is refused."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.oracle_model.motion_equations import friction_torque, link_masses
from tests.support.made_walks import assert_same
from warpchain.inputs.validation import InputError
from warpchain.results.walk_result import WalkResult

FLIGHT: dict[str, Any] = {"preset": "soft", "start": "ellipse", "links": 24, "clearance": 0.03, "walk_limit": 0.04}
"""A loop that does not reach the floor within its 40 ms."""
FINE = 5e-5  # s


@cache
def flight(**settings: Any) -> WalkResult:
    """A flight whose loads are recorded."""
    return warpchain.walk(**FLIGHT | settings, record_joint_forces=True, frame_interval=FINE)


def test_forces_and_gravity_accelerate_each_link() -> None:
    """From 10 ms on the impulse of both joints and gravity on a link is its change of momentum in the frames."""
    walk = flight(ellipse_aspect=1.5, method="dp5")
    time, joints, forces = walk.frame_time, walk.frame_joints, walk.frame_forces
    mass = link_masses(FLIGHT["links"], walk.setup.parameters)[:, None]
    velocity = np.gradient((joints + np.roll(joints, 1, axis=1)) / 2, time, axis=0)
    on_link = forces - np.roll(forces, 1, axis=1) - mass * np.array([0.0, walk.setup.parameters.gravity])
    impulse = np.cumsum((on_link[1:] + on_link[:-1]) / 2 * np.diff(time)[:, None, None], axis=0)
    begin = int(np.searchsorted(time, 0.010))
    for moment in (0.015, 0.025, 0.035):
        end = int(np.searchsorted(time, moment))
        gained = mass * (velocity[end] - velocity[begin])
        given = impulse[end - 1] - impulse[begin - 1]
        assert np.abs(gained).max() > 0.01
        np.testing.assert_allclose(given, gained, atol=1e-3 * np.abs(gained).max())


def test_a_circulating_ring_has_the_tension_rho_v_squared() -> None:
    """A round loop in flight has T = ρ v² cos(π/n) in every joint, on average over 10 ms, to 0.02 %.

    Two tensions at the angle 2π/n hold a link, whose centre runs at v cos(π/n) around the middle: 2T sin(π/n) =
    m v²/R cos(π/n) and ℓ = 2R sin(π/n).
    """
    walk = flight(ellipse_aspect=1.0, method="dp5")
    late = walk.frame_time > 0.03
    joints, forces = walk.frame_joints[late], walk.frame_forces[late]
    mass = link_masses(FLIGHT["links"], walk.setup.parameters)
    center = joints.mean(axis=1, keepdims=True)
    velocity = np.gradient(joints - center, walk.frame_time[late], axis=0)
    ahead = np.roll(joints, -1, axis=1) - np.roll(joints, 1, axis=1)
    tension = np.sum(forces * ahead, axis=2) / np.linalg.norm(ahead, axis=2)
    density = mass.mean() / walk.setup.parameters.link_length
    expected = density * np.mean(np.sum(velocity**2, axis=2)) * np.cos(np.pi / len(mass))
    assert expected > 5.0
    np.testing.assert_allclose(tension.mean(axis=0), expected, rtol=2e-4)


def test_moments_are_those_of_turning_joints() -> None:
    """In every joint the moment on the link before it is β w + τ_c tanh(w / ω_c), with w from the frames, to 0.1 %."""
    walk = flight(ellipse_aspect=1.5, method="dp5")
    link = walk.frame_joints - np.roll(walk.frame_joints, 1, axis=1)
    angle = np.unwrap(np.arctan2(link[..., 1], link[..., 0]), axis=0)
    spin = np.gradient(angle, walk.frame_time, axis=0)
    turn = np.roll(spin, -1, axis=1) - spin
    expected = friction_torque(turn, walk.setup.parameters)
    late = walk.frame_time > 0.01
    apart = np.abs(walk.frame_moments - expected)[late]
    assert np.median(apart) < 1e-3 * np.median(np.abs(expected))


@pytest.mark.parametrize("start", ["ellipse", "spinning"])
def test_they_change_no_bit_of_the_walk(start: str) -> None:
    """With loads in fine frames or without frames the walk is the same; before the release frames come with samples."""
    given: dict[str, Any] = {"preset": "soft", "links": 40, "start": start, "walk_limit": 0.06, "method": "explicit"}
    loaded = warpchain.walk(**given, record_joint_forces=True, record_before=0.05, frame_interval=2e-4)
    plain = warpchain.walk(**given, frame_interval=None)
    assert len(loaded.frame_time) > 250 and loaded.impulses["floor"] > 0
    frames = ("frame_time", "frame_joints", "frame_forces", "frame_moments")
    assert_same(loaded, plain, *frames, "before_release", "wall_time", "provenance")
    if start == "spinning":
        before = loaded.before_release
        assert before is not None
        np.testing.assert_allclose(np.diff(before.frame_time), 1e-3, atol=1e-4)


def test_planes_come_with_fine_frames() -> None:
    """Each fine frame of a plane that tilts has the plane of its moment: it turns a little from frame to frame."""
    walk = flight(plane="tilting", tilt=0.1, tilt_rate=3.0)
    assert len(walk.frame_axes) == len(walk.frame_forces) == len(walk.frame_time) > 500
    lean = np.arctan2(-walk.frame_axes[:, 1, 2], walk.frame_axes[:, 1, 1])
    assert abs(lean[0]) == pytest.approx(0.1, rel=1e-6)
    assert np.abs(np.diff(lean)).max() < 1.5 * 3.0 * 2 * FINE
    assert abs(lean[-1]) == pytest.approx(abs(walk.final_tilt), abs=3.0 * 2 * FINE)


def test_standard_is_explicit_where_loads_are_recorded() -> None:
    """Rigid joints have no forces: standard changes, hybrid and setups of hybrid walks are refused."""
    brief = FLIGHT | {"walk_limit": 1e-3}
    assert warpchain.walk(**brief, record_joint_forces=True).setup.options.method == "os32"
    rigid = warpchain.walk(**brief)
    assert rigid.setup.options.method == "hybrid" and rigid.frame_forces.shape == (0, 24, 2)
    assert rigid.frame_moments.shape == (0, 24)
    refusal = r"options\.method: 'hybrid' has rigid joints, without forces; use explicit"
    for settings in ({"method": "hybrid"}, {"setup": rigid.setup}):
        with pytest.raises(InputError, match=refusal):
            warpchain.walk(**settings, record_joint_forces=True)
