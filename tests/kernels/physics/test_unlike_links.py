"""Chains whose links and joints all differ: flights against SciPy, impulses, invariants, multiplied loads."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import contact_equations, motion_equations
from tests.support.arrays import Array
from tests.support.driven_loops import hold, released_loop
from tests.support.folded_chains import folded_chain
from tests.support.kernels_under_test import FLOOR, LIST, SELF, SPROCKET, ContactPass, Placed
from tests.support.presets import PAPER, SOFT
from tests.support.rigid_chains import exact_rigid_flight, loop
from tests.support.unlike_links import UnlikeLinks, unlike_links
from warpchain import Status
from warpchain.chain.link_values import LinkValues, alternating
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options


def fly(chain: UnlikeLinks, start: tuple[Array, Array], duration: float, fixed_body: str, **options: Any) -> Batch:
    """Carry a chain on; a batch of one world."""
    links = len(start[0])
    batch = Batch(1, links, Options(**options))
    batch.worlds[0].set_chain(chain.parameters, links, own=chain.own)
    batch.worlds[0].load(*start, stop_time=duration, stop_status=Status.FINISHED)
    batch.run([0], batch.features(fixed_body=fixed_body))
    assert batch.worlds[0].status == Status.FINISHED
    return batch


# --- flights ---


@pytest.mark.parametrize("links", [12, 13])
def test_flights_agree_with_scipy(links: int) -> None:
    """With springs, joints that damp and rub, and gravity, DOP853 at 1e-12 has the same flight to 1e-8."""
    chain, duration = unlike_links(links, SOFT), 5e-3
    position, velocity = lay_chain(ellipse(1.5), links, SOFT.link_length, 2.0, 0.1)
    position[:, 1] += 1.0  # far above the floor
    velocity[:, 2] += np.random.default_rng(1).normal(size=links)
    batch = fly(chain, (position, velocity), duration, "floor", method="dp5", tolerance=1e-10)
    places, speeds = motion_equations.solve_flight(position, velocity, duration, chain)
    assert_allclose(batch.worlds[0].position, places, atol=1e-8 * np.abs(places).max())
    assert_allclose(batch.worlds[0].velocity, speeds, atol=1e-8 * np.abs(speeds).max())
    before = motion_equations.total_energy(position, velocity, chain)
    after = motion_equations.total_energy(batch.worlds[0].position, batch.worlds[0].velocity, chain)
    assert before - after == pytest.approx(sum(batch.worlds[0].losses.values()), rel=1e-7)


@pytest.mark.parametrize("links", [7, 16, 61])
def test_flights_on_rigid_joints_agree_with_scipy(links: int) -> None:
    """Rigid joints of unlike links move as the dense equations do, by DOP853 at 1e-10, to the method's 1e-6."""
    smooth = PAPER.with_values({"friction_smoothing": 50.0})
    chain = unlike_links(links, smooth)
    position, velocity = loop(links, chain)
    duration = 2e-4
    flight = fly(chain, (position, velocity), duration, "floor", method="hybrid", flight_tolerance=1e-8)
    places, speeds = exact_rigid_flight(position, velocity, chain, duration, tolerance=1e-10)
    assert flight.worlds[0].losses["joint_damping"] == 0.0
    assert np.abs(flight.worlds[0].position - places).max() < 1e-6 * np.abs(places).max()
    assert np.abs(flight.worlds[0].velocity - speeds).max() < 1e-6 * np.abs(speeds).max()


@pytest.mark.parametrize(("method", "precision"), [("dp5", "double"), ("hybrid", "mixed")])
def test_collisions_keep_momentum_and_the_ledger_of_energy(method: str, precision: str) -> None:
    """A chain folded into itself keeps its momentum but for gravity, to 1e-12, and books what it loses, to 1e-3."""
    chain = unlike_links(60, SOFT)
    position, velocity = folded_chain(60, 3, SOFT.link_length, tilt=0.3, opening=0.0)
    position += [0.0, 1.0, 0.0]
    velocity += [1.0, 0.5, 0.0]
    batch = fly(chain, (position, velocity), 2e-2, "floor", method=method, tolerance=1e-5, precision=precision)
    assert batch.worlds[0].counts["self"] > 100 and batch.worlds[0].counts["floor"] == 0
    gained = motion_equations.linear_momentum(batch.worlds[0].velocity, chain) - motion_equations.linear_momentum(
        velocity, chain
    )
    gained[1] += chain.masses.sum() * SOFT.gravity * batch.worlds[0].time
    assert_allclose(gained, 0, atol=1e-12)
    before = motion_equations.total_energy(position, velocity, chain)
    after = motion_equations.total_energy(batch.worlds[0].position, batch.worlds[0].velocity, chain)
    assert before - after == pytest.approx(sum(batch.worlds[0].losses.values()), rel=1e-3)


# --- impulses ---


@pytest.mark.parametrize(("links", "tilt"), [(8, np.pi), (60, 0.2), (150, np.pi)])
def test_a_contact_pass_equals_reference(links: int, tilt: float) -> None:
    """Floor, turning sprocket and links of unlike masses leave the reference's velocities, to 1e-12, and counts."""
    chain = unlike_links(links, PAPER)
    position, velocity = folded_chain(links, links, PAPER.link_length, tilt=tilt)
    contact_pass = ContactPass([Placed(position, velocity, chain)], sprocket_speed=-90.0)
    (result,) = contact_pass.run(LIST | FLOOR | SPROCKET | SELF)
    hub = (np.zeros(2), PAPER.sprocket_radius, -90.0)
    expected, counts = contact_equations.resolve_contacts(position, velocity, chain, sprocket=hub)
    assert result["fits"]
    assert {kind: result[kind] for kind in counts} == counts and counts["self"] > 0
    assert_allclose((contact_pass.velocity(0) - expected) / np.abs(expected).max(axis=0), 0, atol=1e-12)


def test_links_that_meet_head_on_part_by_the_formula() -> None:
    """Two links on one line, m₁ with u, m₂ at rest: the impulse is (1 + e) u m₁ m₂ / (m₁ + m₂), whatever the others."""
    chain = unlike_links(8, PAPER)
    m, length, r = chain.masses, PAPER.link_length, chain.radii
    # links 1 and 5 lie on the x axis, end to end but for 0.1 mm; all others are far away
    position = np.column_stack([np.zeros(8), 1.0 + np.arange(8), np.zeros(8)])
    position[1] = [-length / 2 - r[1] + 5e-5, 0.0, 0.0]
    position[5] = [length / 2 + r[5] - 5e-5, 0.0, 0.0]
    velocity = np.zeros((8, 3))
    velocity[1, 0] = 2.0
    contact_pass = ContactPass([Placed(position, velocity, chain)], skin=20.0)
    (result,) = contact_pass.run(LIST | SELF)
    assert result["self"] == 1
    impulse = (1 + PAPER.chain_restitution) * 2.0 * m[1] * m[5] / (m[1] + m[5])
    after = contact_pass.velocity(0)
    assert after[1, 0] == pytest.approx(2.0 - impulse / m[1], rel=1e-12)
    assert after[5, 0] == pytest.approx(impulse / m[5], rel=1e-12)
    assert result["self_loss"] == pytest.approx(
        (m[1] * 2.0**2 - m[1] * after[1, 0] ** 2 - m[5] * after[5, 0] ** 2) / 2, rel=1e-10
    )


def test_unlike_circles_on_the_floor_and_against_one_another_part_by_the_formula() -> None:
    """Gaps are those of each circle, and an off-centre impulse acts in the middle of the overlap."""
    chain = unlike_links(8, PAPER.with_values({"tangential_restitution": 1.0, "chain_friction": 1.0}))
    r, m, inertia, a = chain.radii, chain.masses, chain.inertias, PAPER.link_length / 2
    position = np.column_stack([np.arange(8.0), np.full(8, 1.0), np.zeros(8)])
    position[3, 1] = r[3] - 2e-5  # both circles in the floor
    position[6, 1] = r[6] + 1e-5  # above it
    velocity = np.tile([0.0, -1.0, 0.0], (8, 1))
    floor = ContactPass([Placed(position, velocity, chain)])
    (result,) = floor.run(FLOOR)
    assert result["floor"] == 2 and result["floor_gap"] == pytest.approx(-2e-5, abs=1e-15)
    # two level links side by side: left circle of link 2 over the right one of link 5, overlapping by 0.1 mm
    overlap = 1e-4
    position[2], position[5] = [a, 1.0 + r[2] + r[5] - overlap, 0.0], [-a, 1.0, 0.0]
    velocity[:] = 0
    velocity[2] = [0.3, -1.0, 0.0]
    beside = ContactPass([Placed(position, velocity, chain)], skin=20.0)
    (result,) = beside.run(LIST | SELF)
    assert result["self"] == 1 and result["self_depth"] == pytest.approx(overlap, abs=1e-15)
    levers = np.array([[-a, -(r[2] - overlap / 2)], [a, r[5] - overlap / 2]])
    normal = np.array([0.0, 1.0])
    expected = contact_equations.collision_impulse(
        np.array([-0.3, 1.0]), normal, levers[1], levers[0], 1 / m[5], 1 / inertia[5], 1 / m[2], 1 / inertia[2],
        PAPER.chain_restitution, 1.0, 1.0,
    )  # fmt: skip
    after = beside.velocity(0)
    assert_allclose((after[2, :2] - velocity[2, :2]) * m[2], expected, rtol=1e-10)
    assert_allclose(after[5, :2] * m[5], -expected, rtol=1e-10)
    assert after[5, 2] == pytest.approx(-motion_equations.cross(levers[1], expected) / inertia[5], rel=1e-10)
    assert after[2, 2] == pytest.approx(motion_equations.cross(levers[0], expected) / inertia[2], rel=1e-10)


# --- multiplied loads ---


def test_a_stationary_loop_of_unlike_inertias_stays_as_it_is_under_load() -> None:
    """Every third link has 1.6 times the inertia, others 0.7: 15 times the loads leave its shape and its place."""
    loop_on_sprocket = released_loop(links=60, frequency=20.0, start="spinning")
    usual = alternating(SOFT, 60)
    own = LinkValues(**{**vars(usual), "inertia": usual.inertia * np.resize([1.6, 0.7, 0.7], 60)})
    free, loaded = (
        hold(loop_on_sprocket, SOFT, duration, load_factor=factor, own=own)
        for duration, factor in ((0.5, 1.0), (1.0, 15.0))
    )
    height, width, curvature = free[[0, 1, 4]]
    change = np.abs(loaded - free) / [height, width, width, height, curvature]
    assert np.all(change < [0.002, 0.005, 0.003, 0.002, 0.01]), change
