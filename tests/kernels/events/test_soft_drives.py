"""Walks whose joints are softer on the sprocket: how soft, how fast, and that the same loop is released."""

import numpy as np
import pytest

import warpchain
from tests.support.setups import setup_walk
from warpchain import Status, preset
from warpchain.engine.batch import Batch
from warpchain.engine.control import STIFFENING_TIME
from warpchain.walks.walk_phases import Phase, WalkRun

PAPER = preset("paper")


SPINNING = {"links": 30, "frequency": 15.0, "start": "spinning", "steady_time": 0.4, "method": "reference"}


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


@pytest.mark.parametrize("load_factor", [5.0, 40.0])
def test_joints_under_load_are_as_soft_as_it_allows(load_factor: float) -> None:
    """Under load k is such that speed and mean weight stretch joints by 1e-3; in between softness follows log λ."""
    frequency, links = 15.0, 60
    settings = {"links": links, "frequency": frequency, "start": "spinning", "load_factor": load_factor}
    setup = setup_walk("soft", settings | {"method": "explicit"}, None)
    batch = Batch(1, links, setup.options)
    run = WalkRun(batch, 0, setup)
    radius = PAPER.sprocket_radius + PAPER.circle_radius
    density = (PAPER.inner_mass + PAPER.outer_mass) / 2 / PAPER.link_length
    tension = density * (2 * np.pi * frequency * radius) ** 2
    side = links * PAPER.link_length / 2 - np.pi * radius
    weight = load_factor * density * PAPER.gravity * side / 2  # in the middle of a side

    def softness_of(wanted: float) -> float:
        return 1 + np.log10(1e7 / np.clip(wanted / PAPER.link_length, 1e6, 1e7))

    free, loaded = softness_of(tension / 3e-4), softness_of((tension + weight) / 1e-3)
    assert free != loaded
    seen = set()
    while run.phase != Phase.WALK:
        batch.launch([0], run.features, 500)
        load, softness = batch.state.load_factor.numpy()[0], batch.state.softness.numpy()[0]
        expected = free + (loaded - free) * np.log(load) / np.log(load_factor)
        if batch.time(0) > 1.5e-3:
            assert softness == pytest.approx(expected, abs=1e-9)
            seen.add(load)
        if batch.status(0) != Status.RUNNING:
            assert run.next_phase()
            break
    assert {1.0, load_factor} < seen


def test_a_drive_on_softer_joints_ends_as_one_on_stiff_joints() -> None:
    """Released after a drive on softer joints, a loop has the same shape and speed as after one on its own joints."""
    settings = {"links": 36, "frequency": 15.0, "method": "dp5", "tolerance": 1e-4, "settle_time": 0.2}
    settings |= {"spin_up_time": 0.5, "steady_time": 0.2, "walk_limit": 1e-3, "frame_interval": 1e-3}
    stiff, soft = (warpchain.walk(**settings, preset="paper", soften_drive=on) for on in (False, True))
    assert soft.steps_accepted < 0.15 * stiff.steps_accepted
    assert soft.simulated_time == pytest.approx(stiff.simulated_time, abs=0.01)
    assert soft.kinetic_energy[0] == pytest.approx(stiff.kinetic_energy[0], rel=5e-3)
    for axis in (0, 1):
        extents = [np.ptp(walk.frame_joints[0, :, axis]) for walk in (stiff, soft)]
        assert extents[1] == pytest.approx(extents[0], rel=0.01)
    assert soft.greatest_penetration["sprocket"] < 1e-3


def test_a_whole_walk_from_soft_joints() -> None:
    """Softened on the sprocket and in the pile, a walk ends at rest where it should, and its ledger closes."""
    walk = warpchain.walk(
        method="reference", start="spinning", soften_drive=True, soften_pile=True, soften_area=0.7, frame_interval=None
    )
    assert walk.status == Status.AT_REST
    assert 0.5 < walk.dx < 0.8
    assert 0.3 < walk.softened_at < walk.walk_time
    at_release = walk.energy["kinetic_at_release"] + walk.energy["potential_at_release"]
    assert abs(walk.energy["residual"]) < 1e-5 * at_release
