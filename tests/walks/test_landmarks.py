"""The loop at the release and the bounces, against NumPy on the links, and against impulses that were put in."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.made_walks import make_unreleased
from warpchain import WalkResult
from warpchain.chain.resolution import resolve
from warpchain.kernels.events import tallies, tilting
from warpchain.pictures.walk_figures import FALLEN
from warpchain.walks.landmarks import PAUSE, bounces


@pytest.fixture(scope="module")
def walk() -> WalkResult:
    """A chain that is thrown off its sprocket and bounces."""
    return warpchain.walk(links=60, frequency=20.0, start="spinning", preset="soft")


def test_the_loop_at_the_release_is_that_of_its_links(walk: WalkResult) -> None:
    """Centre of mass, outline of the joints and mean speed along the links, summed by NumPy."""
    state, chain = walk.state(0.0), walk.setup.parameters
    mass = np.resize([chain.inner_mass, chain.outer_mass], 60)
    along = np.column_stack([np.cos(state.position[:, 2]), np.sin(state.position[:, 2])])
    center = mass @ state.position[:, :2] / mass.sum()
    (left, low), (right, high) = state.joints.min(axis=0), state.joints.max(axis=0)
    expected = {"center_x": center[0], "center_y": center[1], "width": right - left, "height": high - low}
    assert walk.release == pytest.approx({**expected, "lowest": low - chain.circle_radius}, abs=1e-9)
    assert walk.release_speed == pytest.approx(np.mean(np.sum(state.velocity[:, :2] * along, axis=1)), rel=1e-12)


def test_a_plane_that_tilts_has_them_along_itself() -> None:
    """Width, height and the lowest point do not know the tilt; the centre of mass is in the room."""
    settings = {"links": 40, "frequency": 15.0, "start": "spinning", "preset": "soft", "walk_limit": 0.002}
    upright, leaning = (warpchain.walk(plane="tilting", tilt=tilt, **settings) for tilt in (0.0, 0.3))
    for name in ("width", "height", "lowest"):
        assert leaning.release[name] == pytest.approx(upright.release[name], abs=1e-12)
    assert leaning.release["center_y"] == leaning.center[0, 1] < upright.release["center_y"]


def test_a_sweep_has_the_release_of_each_walk(tmp_path: Path) -> None:
    """In columns; a walk that goes on from a state has that of its walk, and one that was never released none."""
    settings: dict[str, Any] = {"preset": "soft", "scene": {"start": "spinning", "walk_limit": 0.1}}
    result = warpchain.sweep(
        grid={"links": [40], "frequency": [15]}, samples=1, out=tmp_path / "s", progress=False, **settings
    )
    walk = result.walk(0)
    for name, value in {**walk.release, "speed": walk.release_speed}.items():
        assert result.columns[f"release_{name}"].item() == value
    rest = warpchain.walk(start=walk.state(0.06))
    assert (rest.release, rest.release_speed) == (walk.release, walk.release_speed)
    lost = warpchain.walk(links=40, frequency=15.0, preset="soft", start="rest", hold_limit=0.01)
    assert lost.status == warpchain.Status.NOT_STEADY and lost.simulated_time > lost.walk_time == len(lost.time) == 0
    assert np.isnan([lost.dx, *lost.energy.values(), *lost.release.values(), lost.release_speed]).all()


@pytest.mark.parametrize("slope", [0.0, 5.0])
def test_bounces_have_the_impulses_that_were_put_in(slope: float) -> None:
    """A body flies, slides for 20 ms, flies, and sticks half-way through its second contact; nothing is simulated."""
    setup = resolve("paper", scene={"links": 30, "slope": slope}, options={}, parameters={"floor_friction": 0.3})
    time, angle, mass = np.arange(0, 0.4, 0.001), np.radians(slope), 15 * (3.700e-3 + 3.147e-3)
    normal = 0.05 * ((time > 0.1) & (time <= 0.12)) + 0.02 * ((time > 0.2) & (time <= 0.24))
    forward = np.where(time > 0.22, 0.1, 0.3) * normal
    axes = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    impulse = np.column_stack([forward, normal]) @ axes
    velocity = np.cumsum(impulse, axis=0) / mass - np.outer(time, [0, 9.809]) + [0.3, 0.1]
    table = bounces(time, velocity, setup)
    assert table["start"] == pytest.approx([0.1, 0.2]) and table["end"] == pytest.approx([0.12, 0.24])
    assert table["sticks_at"] == pytest.approx([np.nan, 0.221], nan_ok=True)
    expected = [impulse[time < 0.15].sum(axis=0), impulse[time > 0.15].sum(axis=0)]
    assert np.column_stack([table["impulse_x"], table["impulse_y"]]) == pytest.approx(np.array(expected))


def test_bounces_of_a_walk_are_those_that_kernels_count(walk: WalkResult) -> None:
    """As many, the first while circles are at the floor, and with friction times its pressure, for all slides."""
    table = walk.bounce_table()
    assert len(table["start"]) == walk.bounces > 4
    heights = np.interp([table["start"][0] - 0.001, table["start"][0] + 0.001], walk.time, walk.lowest)
    assert heights[0] > 2e-4 > heights[1]
    friction = walk.setup.parameters.floor_friction
    slid = np.isnan(table["sticks_at"])
    assert slid[0] and table["impulse_x"][slid] == pytest.approx(friction * table["impulse_y"][slid], rel=1e-9)
    assert not slid[-1]  # the pile lies


def test_walks_without_bounces_have_none() -> None:
    """One that was never released has an empty table."""
    assert all(len(column) == 0 for column in make_unreleased().bounce_table().values())


def test_constants_that_kernels_have_too_are_the_same() -> None:
    """The pause between two bounces, and the tilt at which a chain has fallen over."""
    assert float(tallies.BOUNCE_PAUSE) == PAUSE
    assert float(tilting.FALLEN) == pytest.approx(np.sin(np.radians(FALLEN)), abs=1e-15)


@pytest.mark.parametrize(
    "scene", [{"floor": [[0, 0], [0.3, 0], [0.3, -0.05], [2, -0.05]]}, {"plane": "tilting", "tilt": 0.1}]
)
def test_bounces_off_profiles_and_of_tilting_planes(scene: dict[str, Any]) -> None:
    """As many as the kernels count; they carry the weight of the chain from its release to rest."""
    walk = warpchain.walk(links=40, frequency=20.0, start="spinning", preset="soft", method="explicit", **scene)
    table, chain = walk.bounce_table(), walk.setup.parameters
    assert list(table) == ["start", "end", "impulse_x", "impulse_y"] and len(table["start"]) == walk.bounces > 1
    mass = 20 * (chain.inner_mass + chain.outer_mass)
    first, last = walk.center_velocity[[0, -1], 1]
    assert table["impulse_y"].sum() == pytest.approx(mass * (last - first + chain.gravity * walk.time[-1]))
