"""Walks of chains whose links are unlike: two kinds as values of each link, charms, stiff joints, gradients."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.setups import setup_walk
from warpchain import InputError, Status, preset
from warpchain.inputs.link_values import alternating
from warpchain.inputs.scene import link_values
from warpchain.sweeps.plan import load_sweep

SOFT = preset("soft")
BRIEF = {"preset": "soft", "method": "explicit", "links": 36, "frequency": 15.0}
"""A short chain, which walks for a second of one core."""
KINDS = {
    "link_masses": np.resize([SOFT.inner_mass, SOFT.outer_mass], 36),
    "link_inertias": np.resize([SOFT.inner_inertia, SOFT.outer_inertia], 36),
    "viscous_frictions": [SOFT.viscous_friction] * 36,
    "coulomb_frictions": (SOFT.coulomb_friction,) * 36,
}
"""Table 1's chain, value by value."""


def values_of(links: int = 60, **settings: Any) -> Any:
    """Values of the links of a scene."""
    setup = setup_walk("soft", {"links": links, **settings}, None)
    return link_values(setup.scene, setup.parameters)


def test_two_kinds_given_link_by_link_walk_as_two_kinds() -> None:
    """The whole walk from the sprocket on is the same to the bit."""
    kinds, each = (warpchain.walk(start="spinning", **BRIEF, **own) for own in ({}, KINDS))
    assert kinds.status == each.status == Status.AT_REST
    assert (kinds.dx, kinds.energy, kinds.hold_time) == (each.dx, each.energy, each.hold_time)
    assert np.array_equal(kinds.frame_joints, each.frame_joints)


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


def test_rules_change_what_they_say() -> None:
    """A charm one link, a stiff joint one joint, a gradient all links by equal steps; arrays come before rules."""
    usual = alternating(SOFT, 60)
    charm = values_of(charm_link=7, charm_mass=0.02, charm_inertia=1e-6)
    assert charm.mass[7] == usual.mass[7] + 0.02 and charm.inertia[7] == usual.inertia[7] + 1e-6
    assert np.array_equal(np.delete(charm.mass, 7), np.delete(usual.mass, 7))
    stiff = values_of(stiff_joint=3, stiff_joint_factor=10.0)
    assert np.flatnonzero(stiff.viscous_friction != usual.viscous_friction).tolist() == [3]
    assert stiff.coulomb_friction[3] == 10 * SOFT.coulomb_friction
    graded = values_of(mass_gradient=0.5)
    assert graded.mass / usual.mass == pytest.approx(np.linspace(0.5, 1.5, 60), rel=1e-14)
    assert graded.inertia / usual.inertia == pytest.approx(np.linspace(0.5, 1.5, 60), rel=1e-14)
    both = values_of(link_masses=[1e-3] * 60, charm_link=59, charm_mass=1.0)
    assert both.mass.tolist() == [1e-3] * 59 + [1.001]
    assert not any(values.alternates for values in (charm, stiff, graded, both)) and usual.alternates


def test_an_odd_number_of_links_needs_links_of_one_kind_or_values_of_each() -> None:
    """61 links alike, or given one by one, make a chain, which walks."""
    for start in ("rest", "ellipse"):
        with pytest.raises(InputError, match=r"^scene\.links: 61 is odd; inner and outer links alternate: give "):
            setup_walk("paper", {"links": 61, "start": start}, None)
    alike = {"outer_mass": SOFT.inner_mass, "outer_inertia": SOFT.inner_inertia}
    walk = warpchain.walk(start="ellipse", **{**BRIEF, "links": 37}, **alike)
    each = {"link_masses": [SOFT.inner_mass] * 37, "link_inertias": [SOFT.inner_inertia] * 37}
    assert walk.status == Status.AT_REST
    assert walk.dx == warpchain.walk(start="ellipse", **{**BRIEF, "links": 37}, **each).dx


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"charm_link": 60}, "scene.charm_link: 60 is not among 60 links; give 0 to 59"),
        ({"stiff_joint": 60}, "scene.stiff_joint: 60 is not among 60 links; give 0 to 59"),
        ({"link_masses": [1.0, 2.0]}, "scene.link_masses: 2 numbers for 60 links; give one for each"),
        ({"link_masses": [0.0] * 60}, "scene.link_masses[0]: 0 is no mass; give more"),
        ({"link_inertias": {7: 1e-7}}, "scene.link_inertias: Input should be a valid list, in kg m²; given "),
        ({"coulomb_frictions": [-1.0] * 60}, "scene.coulomb_frictions[0]: Input should be greater than or equal to 0"),
        ({"mass_gradient": 1.0}, "scene.mass_gradient: Input should be less than 1; given 1.0"),
        ({"charm_mass": 0.02, "load_factor": 9.0}, "scene.load_factor: 9 is too much for links of so little rotary "),
    ],
)
def test_what_makes_no_chain_is_refused(settings: dict[str, Any], message: str) -> None:
    """In one line that names the field and what to give."""
    with pytest.raises(InputError) as caught:
        setup_walk("paper", settings, None)
    assert str(caught.value).startswith(message) and "\n" not in str(caught.value)


def test_a_sweep_has_charms_as_an_axis_and_draws_them() -> None:
    """The mass is an axis with a range, the rest is fixed or drawn, and the resolved sweep says so."""
    content = {"version": 1, "name": "charm", "seed": 1, "samples": 2, "preset": "soft", "scene": {"charm_link": 7}}
    grid = {"charm_mass": {"from": 0, "to": 0.1, "step": 0.05}}
    sweep = load_sweep({**content, "grid": grid, "distributions": {"mass_gradient": {"uniform": [-0.1, 0.1]}}})
    setups = [sweep.planned(index).setup for index in range(6)]
    assert [setup.scene.charm_mass for setup in setups] == [0, 0.05, 0.1, 0, 0.05, 0.1]
    assert len({setup.scene.mass_gradient for setup in setups}) == 6
    assert sweep.canonical()["blocks"][0]["scene"]["charm_link"] == 7
    with pytest.raises(InputError, match=r"^sweep\.grid\.link_masses: not possible here; give it in scene"):
        load_sweep({**content, "grid": {"link_masses": [[1.0] * 60]}})


def test_sweeps_that_say_nothing_of_links_keep_their_digests() -> None:
    """Fields that have their defaults are left out, so that results made before the fields go on."""
    content = {"version": 1, "name": "old", "seed": 1, "samples": 2, "preset": "soft"}
    plain, said = load_sweep(content), load_sweep({**content, "scene": {"charm_mass": 0.0, "link_masses": None}})
    assert plain.digest() == said.digest() != load_sweep({**content, "scene": {"charm_mass": 0.01}}).digest()
    assert load_sweep(plain.canonical()).digest() == plain.digest()
