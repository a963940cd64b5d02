"""Walks of chains whose links are unlike: two kinds as values of each link, charms, stiff joints, gradients."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.presets import SOFT
from tests.support.setups import setup_walk
from warpchain import Status
from warpchain.chain.link_values import LinkValues, alternating, link_values, mean_value
from warpchain.pictures.chain import link_outlines
from warpchain.pictures.places import circle_radii

BRIEF = {"preset": "soft", "method": "explicit", "links": 36, "frequency": 15.0}
"""A short chain, which walks for a second of one core."""
KINDS = {
    "link_masses": np.resize([SOFT.inner_mass, SOFT.outer_mass], 36),
    "link_inertias": np.resize([SOFT.inner_inertia, SOFT.outer_inertia], 36),
    "viscous_frictions": [SOFT.viscous_friction] * 36,
    "coulomb_frictions": (SOFT.coulomb_friction,) * 36,
    "link_radii": [SOFT.circle_radius] * 36,
}
"""Table 1's chain, value by value."""


def values_of(links: int = 60, **settings: Any) -> Any:
    """Values of the links of a scene."""
    return setup_walk("soft", {"links": links, **settings}).link_values


def test_two_kinds_given_link_by_link_walk_as_two_kinds() -> None:
    """The whole walk from the sprocket on is the same to the bit."""
    kinds, each = (warpchain.walk(start="spinning", **BRIEF, **own) for own in ({}, KINDS))
    assert kinds.status == each.status == Status.AT_REST
    assert (kinds.dx, kinds.energy, kinds.hold_time) == (each.dx, each.energy, each.hold_time)
    assert np.array_equal(kinds.frame_joints, each.frame_joints)


@pytest.mark.parametrize("start", ["spinning", "ellipse"])
def test_a_walk_in_another_unit_of_mass_is_the_same(start: str) -> None:
    """With 512 times all masses, inertias, frictions, k and b: equal to the bit, on softened joints too."""
    paper = warpchain.preset("paper")
    names = [name for name, q in paper.quantities().items() if "kg" in q.unit or "N" in q.unit]
    heavy = {"unusual_values": True, **{name: 512 * getattr(paper, name) for name in names}}
    usual, same = (warpchain.walk(links=30, start=start, frame_interval=None, **each) for each in ({}, heavy))
    assert len(names) == 8 and usual.softened_at == same.softened_at > 0
    assert same.dx == usual.dx and same.energy == {name: 512 * value for name, value in usual.energy.items()}


@pytest.mark.parametrize("measures", ["contact", "pitch"])
def test_the_sprocket_knows_the_circles_of_the_links(measures: str) -> None:
    """Wide circles given link by link walk as a `circle_radius` as wide, loop on the sprocket included, to the bit."""
    brief = {**BRIEF, "links": 50, "start": "spinning", "sprocket_radius_is": measures, "walk_limit": 0.05}
    one, each = (warpchain.walk(**brief, **own) for own in ({"circle_radius": 6e-3}, {"link_radii": [6e-3] * 50}))
    assert (one.hold_time, one.release, one.energy) == (each.hold_time, each.release, each.energy)
    assert one.greatest_penetration == each.greatest_penetration
    assert np.array_equal(one.center, each.center)


def test_joints_ride_on_the_wider_of_their_circles() -> None:
    """Every second link may be narrow, and a charm wide: the other joints ride as high as without."""
    for wide, height in (({"link_radii": [2e-3, 6e-3] * 30}, 6e-3), ({"charm_radius": 6e-3}, SOFT.circle_radius)):
        assert setup_walk("soft", {"links": 60, **wide}).riding_radius == height


def test_a_charm_closes_the_ledger_and_is_read_back(tmp_path: Path) -> None:
    """Mass, centre and energy of a walk with a heavy link are those of the links, and its file says what they were."""
    charm = {"charm_link": 7, "charm_mass": 0.02, "charm_inertia": 2e-7}
    walk = warpchain.walk(start="ellipse", frame_interval=1e-3, **BRIEF, **charm)
    assert walk.status == Status.AT_REST
    lost = sum(walk.energy[name] for name in ("joint_friction", "joint_damping", "floor", "self_contact", "softening"))
    assert abs(walk.energy["residual"]) < 1e-3 * lost
    mass = alternating(SOFT, 36).mass
    mass[7] += 0.02
    joints = walk.frame_joints[0]
    centre = mass @ (joints + np.roll(joints, 1, axis=0)) / 2 / mass.sum()
    assert walk.center[0] == pytest.approx(centre, abs=1e-6)
    walk.save(tmp_path / "charm.h5")
    again = warpchain.load_walk(tmp_path / "charm.h5")
    assert again.setup == walk.setup
    assert again.setup.scene.charm_mass == 0.02


def test_a_walk_on_unlike_circles_rests_on_the_widest(tmp_path: Path) -> None:
    """It closes its ledger, starts at its clearance, rests on circles no deeper than 0.1 mm, and is drawn as it is."""
    radii = np.resize([4.2e-3, 2.5e-3, 5e-3], 36)
    walk = warpchain.walk(start="ellipse", clearance=0.012, frame_interval=1e-2, link_radii=radii, **BRIEF)
    assert walk.status == Status.AT_REST
    lost = sum(walk.energy[name] for name in ("joint_friction", "joint_damping", "floor", "self_contact", "softening"))
    assert abs(walk.energy["residual"]) < 1e-3 * lost
    heights = walk.frame_joints[..., 1]
    lowest = np.minimum(heights - radii, np.roll(heights, 1, axis=1) - radii).min(axis=1)
    assert lowest[0] == walk.lowest[0] == walk.release["lowest"] == pytest.approx(0.012, abs=1e-12)
    assert -1e-4 < lowest[-1] < 1e-4 and walk.lowest[-1] == pytest.approx(lowest[-1], abs=1e-5)
    outlines = link_outlines(walk.frame_joints[0], circle_radii(walk))
    assert 0.012 <= outlines[..., 1].min() < 0.0121  # they are polygons
    walk.save(tmp_path / "unlike.h5")
    assert warpchain.load_walk(tmp_path / "unlike.h5").setup == walk.setup


def test_rules_change_what_they_say() -> None:
    """A charm one link, a stiff joint one joint, a gradient all links by equal steps; arrays come before rules."""
    usual = alternating(SOFT, 60)
    charm = values_of(charm_link=7, charm_mass=0.02, charm_inertia=1e-6)
    assert charm.mass[7] == usual.mass[7] + 0.02 and charm.inertia[7] == usual.inertia[7] + 1e-6
    assert np.array_equal(np.delete(charm.mass, 7), np.delete(usual.mass, 7))
    stiff = values_of(stiff_joint=3, joint_friction_factor=10.0)
    assert np.flatnonzero(stiff.viscous_friction != usual.viscous_friction).tolist() == [3]
    assert stiff.coulomb_friction[3] == 10 * SOFT.coulomb_friction
    graded = values_of(mass_gradient=0.5)
    assert graded.mass / usual.mass == pytest.approx(np.linspace(0.5, 1.5, 60), rel=1e-14)
    assert graded.inertia / usual.inertia == pytest.approx(np.linspace(0.5, 1.5, 60), rel=1e-14)
    narrow = values_of(charm_link=7, charm_radius=2e-3)
    assert np.flatnonzero(narrow.radius != usual.radius).tolist() == [7] and narrow.radius[7] == 2e-3
    both = values_of(link_masses=[1e-3] * 60, charm_link=59, charm_mass=1.0)
    assert both.mass.tolist() == [1e-3] * 59 + [1.001]
    assert not any(values.alternates for values in (charm, stiff, graded, narrow, both)) and usual.alternates


def test_chains_of_many_walks_are_those_of_each_alone() -> None:
    """Values of links and what follows from them, of chains with all kinds of rules, are to the bit those of one."""
    rules: list[dict[str, Any]] = [
        {},
        {"charm_link": 7, "charm_mass": 0.02, "charm_inertia": 1e-6, "charm_radius": 2e-3},
        {"stiff_joint": 3, "joint_friction_factor": 10.0},
        {"mass_gradient": 0.3},
        {"link_masses": [1e-3, 2e-3, 4e-3] * 20, "link_radii": [2e-3, 5e-3] * 30},
        {"inner_mass": 3.7001e-3, "outer_inertia": 5e-8},
    ]
    setups = [setup_walk("soft", {"links": 60, **each}) for each in rules]
    lengths = np.array([setup.parameters.link_length for setup in setups])
    together = link_values([setup.scene for setup in setups], [setup.parameters for setup in setups])
    loads = together.greatest_load(lengths)
    for place, setup in enumerate(setups):
        alone = setup.link_values
        assert all(np.array_equal(row[place], own) for row, own in zip(*map(_rows, (together, alone)), strict=True))
        assert together.total_mass[place] == alone.total_mass == math.fsum(alone.mass[::2] + alone.mass[1::2])
        assert together.mean_mass[place] == alone.mean_mass == mean_value(alone.mass)
        assert together.alternates[place] == alone.alternates == (place in (0, 5))
        assert loads[place] == alone.greatest_load(setup.parameters.link_length)
    assert np.isinf(loads[0]) != np.isinf(loads[5])


def _rows(values: LinkValues) -> list[Any]:
    return [*vars(values).values()]


def test_an_odd_number_of_links_of_one_kind_walks() -> None:
    """37 links alike, or given one by one, make a chain, which walks."""
    alike = {"outer_mass": SOFT.inner_mass, "outer_inertia": SOFT.inner_inertia}
    walk = warpchain.walk(start="ellipse", **{**BRIEF, "links": 37}, **alike)
    each = {"link_masses": [SOFT.inner_mass] * 37, "link_inertias": [SOFT.inner_inertia] * 37}
    assert walk.status == Status.AT_REST
    assert walk.dx == warpchain.walk(start="ellipse", **{**BRIEF, "links": 37}, **each).dx
