"""Walks on floors that are not flat: energy, release, end, files, sweeps and pictures."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import warpchain
from tests.kernels.contacts.test_terrain import BOX, SOFT
from tests.support.blocks_under_test import floor_with
from warpchain import Status
from warpchain.pictures.player import player

STEP = [[-1.0, 0.0], [0.1, 0.0], [0.1, -0.05], [1.0, -0.05]]


@pytest.mark.parametrize(
    "scene",
    [
        {"slope": 8.0},
        {"slope": -5.0},
        {"floor": [[-1, 0], [0.1, 0], [0.1, -0.02], [0.2, -0.02], [0.2, 0.01], [1, 0.01]]},
    ],
    ids=["down", "up", "pit and step"],
)
def test_energy_is_accounted_for_on_every_floor(scene):
    """What a walk begins with is what it ends with and what was lost, to a thousandth."""
    walk = warpchain.walk(links=24, start="ellipse", preset="soft", method="explicit", frame_interval=None, **scene)
    at_release = walk.energy["kinetic_at_release"]
    assert walk.status == Status.AT_REST and walk.impulses["floor"] > 100
    assert abs(walk.energy["residual"]) < 1e-3 * at_release
    assert walk.greatest_penetration["floor"] < 2e-4


def test_energies_count_from_the_floor_below_the_release():
    """However high a floor lies, a bad walk is as bad, and a series begins and ends where the ledger does."""
    bad = {"frequency": 3, "method": "explicit", "tolerance": 0.1, "beta": 0, "tau_c": 0, "floor_restitution": 0.8}
    for y in (-2.0, 0.0, 50.0):
        walk = warpchain.walk(links=30, start="ellipse", floor=[[-3, y], [3, y]], walk_limit=3, **bad)
        assert walk.energy_error > 1 and walk.warnings()
        energy = (walk.gravitational_energy + walk.spring_energy)[[0, -1]]
        np.testing.assert_allclose(
            energy, [walk.energy[f"potential_at_{end}"] for end in ("release", "end")], atol=1e-12
        )
        assert 0.01 < walk.energy["potential_at_release"] < 0.1


def test_what_falls_without_turning_stops_on_the_floor():
    """The error of a flight that only falls is zero: its steps are bounded by the time of the fall."""
    walk = warpchain.walk(links=60, frequency=0, start="ellipse", gravity=1.6)
    assert walk.status == Status.AT_REST and walk.greatest_penetration["floor"] < 2e-4


def test_ice_gives_no_push_along_it_and_rubber_does():
    """On points with μ = 0 the centre keeps its x while the loop lands and spins; with μ = 1 it is off at once."""
    scene = {"links": 24, "start": "ellipse", "preset": "soft", "method": "explicit", "walk_limit": 0.2}
    ice, rubber = (warpchain.walk(floor=[[-1, 0, 0.018, mu], [1, 0]], **scene) for mu in (0.0, 1.0))
    assert ice.impulses["floor"] > 100 and rubber.impulses["floor"] > 100
    assert np.abs(ice.center[:, 0]).max() < 1e-9 and np.abs(ice.center_velocity[:, 0]).max() < 1e-9
    assert rubber.center_velocity[-1, 0] > 0.2


def test_a_walk_down_a_steep_slope_ends_by_its_distance():
    """It ends where its centre has gone the limit along the slope, and Δx is that of no chain at rest."""
    walk = warpchain.walk(links=24, start="ellipse", preset="soft", method="explicit", slope=30.0, distance_limit=0.5)
    assert walk.status == Status.DISTANCE_LIMIT and walk.status.ok and np.isnan(walk.dx)
    assert walk.center[-1, 0] / np.cos(np.radians(30)) == pytest.approx(0.5, abs=0.01)
    assert walk.center[-1, 0] >= 0.5 * np.cos(np.radians(30)) > walk.center[-3, 0]


@pytest.mark.thorough
def test_a_loop_wider_than_the_hanging_chain_starts_outside_of_walls():
    """Between walls that the hanging chain clears the spinning one is raised until no circle is in one."""
    walls = [[-1, 0.2], [-0.068, 0.2], [-0.068, 0], [0.068, 0], [0.068, 0.2], [1, 0.2]]
    walk = warpchain.walk(links=40, preset="soft", clearance_of="hanging", clearance=0.003, floor=walls, stop_time=1e-3)
    x, y = walk.frame_joints[0].T
    assert x.min() < -0.068 and y[np.abs(x) > 0.068].min() > 0.2


def test_the_release_is_at_its_clearance_from_the_profile():
    """The nearest circle of the first frame is at the clearance from the floor, whatever is below the chain."""
    for scene in ({"slope": 20.0}, {"floor": BOX.tolist()}):
        walk = warpchain.walk(
            links=24, start="ellipse", preset="soft", method="explicit", clearance=0.02, distance_limit=1e-3, **scene
        )
        points = BOX if "floor" in scene else np.array([[0, 0], [np.cos(np.radians(20)), -np.sin(np.radians(20))]])
        first = floor_with(points, SOFT).distances(walk.frame_joints[0]).min() - SOFT.circle_radius
        assert first == pytest.approx(0.02, abs=1e-4)


@pytest.mark.parametrize("x", [0.0, 0.004, 0.008])
def test_a_spike_below_the_side_of_a_link_is_cleared_as_well(x: float) -> None:
    """The nearest place of a link, between its circles, too, is at the clearance, to 3 % of a link's length."""
    spike = [[-1, -0.3], [x - 1e-3, -0.3], [x, 0], [x + 1e-3, -0.3], [1, -0.3]]
    scene = {"start": "ellipse", "clearance": 2e-3, "floor": spike, "stop_time": 1e-4}
    joints = warpchain.walk(links=24, preset="soft", method="explicit", **scene).frame_joints[0]
    places = np.concatenate(
        [joints + share * (np.roll(joints, -1, axis=0) - joints) for share in np.linspace(0, 1, 99)]
    )
    assert np.hypot(*(places - (x, 0)).T).min() - SOFT.circle_radius == pytest.approx(2e-3, abs=4e-4)


def test_a_profile_survives_files_and_is_drawn(tmp_path: Path) -> None:
    """A saved walk has its floor; film strip and player draw the profile, the player in tenths of a millimetre."""
    walk = warpchain.walk(links=24, start="ellipse", preset="soft", method="explicit", floor=STEP)
    walk.save(tmp_path / "walk.h5")
    loaded = warpchain.load_walk(tmp_path / "walk.h5")
    assert loaded.setup == walk.setup and [list(point) for point in loaded.setup.scene.floor] == STEP
    assert loaded.dx == loaded.center[-1, 0]
    line = [[-0.5, 0.0], [0.1, 0.0], [0.1, -0.05], [0.5, -0.05]]
    assert np.allclose(loaded.setup.floor.line(-0.5, 0.5), line)
    drawn = json.loads(re.search(r"const walk = (.*);", player(loaded))[1])["floor"]
    assert drawn[1:4] == [[-10000, 0], [1000, 0], [1000, -500]]
    low = loaded.plot("film_strip").axes[0].get_ylim()[0]
    assert low < -0.05
