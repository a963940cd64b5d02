"""Walks whose joints are softer on the sprocket: how soft, how fast, and that the same loop is released."""

import numpy as np
import pytest

import warpchain
from tests.support.presets import PAPER
from warpchain.engine.control import STIFFENING_TIME

SPINNING = {"links": 30, "frequency": 15.0, "start": "spinning", "steady_time": 0.4, "method": "explicit"}


def test_joints_are_soft_on_the_sprocket_and_stiff_soon_after_the_release() -> None:
    """Spring energy is n T²/2k' at the release, T = m̄ v²/ℓ, k' such as stretches by 3e-4; as on stiff joints soon."""
    stiff, soft = (
        warpchain.walk(**SPINNING, preset="paper", clearance=0.02, walk_limit=0.06, soften_drive=on)
        for on in (False, True)
    )
    speed = 2 * np.pi * 15.0 * (PAPER.sprocket_radius + PAPER.circle_radius)
    tension = (PAPER.inner_mass + PAPER.outer_mass) / 2 * speed**2 / PAPER.link_length
    for walk, stiffness in ((stiff, PAPER.joint_stiffness), (soft, tension / (3e-4 * PAPER.link_length))):
        level = 30 * tension**2 / (2 * stiffness)
        assert walk.spring_energy[0] == pytest.approx(level, rel=0.5)
    assert stiff.lowest.min() > 0
    levels = [np.median(walk.spring_energy[walk.time > STIFFENING_TIME + 2e-3]) for walk in (stiff, soft)]
    assert levels[1] == pytest.approx(levels[0], rel=0.1)


def test_a_drive_on_softer_joints_ends_as_one_on_stiff_joints() -> None:
    """Released after a drive on softer joints, a loop has the same shape and speed as after one on its own joints."""
    settings = {"links": 36, "frequency": 15.0, "method": "os32", "tolerance": 1e-4, "start": "spinning"}
    settings |= {"steady_time": 0.2, "walk_limit": 1e-3, "frame_interval": 1e-3}
    stiff, soft = (warpchain.walk(**settings, preset="paper", soften_drive=on) for on in (False, True))
    assert soft.steps_accepted < 0.15 * stiff.steps_accepted
    assert soft.simulated_time == pytest.approx(stiff.simulated_time, abs=0.01)
    assert soft.kinetic_energy[0] == pytest.approx(stiff.kinetic_energy[0], rel=5e-3)
    for axis in (0, 1):
        extents = [np.ptp(walk.frame_joints[0, :, axis]) for walk in (stiff, soft)]
        assert extents[1] == pytest.approx(extents[0], rel=0.01)
    assert soft.greatest_penetration["sprocket"] < 1e-3
