"""Floors that are not flat: gaps by brute force, contacts and falls by a second program, sliding by its formula."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import warpchain
from tests.hard_cases.starts import dropped
from tests.oracle_model import motion_equations, terrain
from tests.support.blocks_under_test import floor_with
from tests.support.folded_chains import folded_chain
from tests.support.kernels_under_test import TERRAIN, ContactPass, Placed
from tests.support.presets import PAPER, SOFT

STAIRS = np.array([[-0.05, 0.0], [0.0, 0.0], [0.0, -0.02], [0.03, -0.02], [0.03, -0.04], [0.1, -0.04]])
HILLS = np.array([[-0.06, 0.01], [-0.02, 0.0], [0.0, 0.012], [0.011, 0.0], [0.03, -0.004], [0.06, 0.0]])
BOX = np.array([[-0.1, 0.0], [-0.01, 0.0], [-0.01, 0.02], [0.02, 0.02], [0.02, 0.0], [0.1, 0.0]])
PROFILES = {"stairs": STAIRS, "hills": HILLS, "box": BOX}
every_profile = pytest.mark.parametrize("points", PROFILES.values(), ids=PROFILES)


def heaps_above(points, count=30, depth=5e-4):
    """Folded chains whose capsules are up to so much below a profile or a little above it, by brute force [m]."""
    generator = np.random.default_rng(len(points))
    for seed in range(count):
        position, velocity = folded_chain(8, seed, PAPER.link_length, opening=1e-5)
        position[:, 0] += generator.uniform(-0.03, 0.03)
        position[:, 1] += 0.2
        position[:, 1] -= brute_gap(position, points) + generator.uniform(-depth, depth)
        for _ in range(4):  # not the vertical distance
            position[:, 1] -= max(brute_gap(position, points), 0.0)
        yield position, velocity


def brute_gap(position, points):
    """Least distance of 1001 points of every link's axis from the floor, less r."""
    left, right = motion_equations.link_ends(position, PAPER)
    share = np.linspace(0, 1, 1001)[:, None, None]
    return (
        floor_with(points, PAPER).distances((left + share * (right - left)).reshape(-1, 2)).min() - PAPER.circle_radius
    )


@every_profile
def test_the_gap_is_that_of_whole_links(points):
    """The least gap of circles and corners is the distance of the links, as if they were as broad as their circles."""
    heaps = list(heaps_above(points))
    results = ContactPass([Placed(*heap, PAPER) for heap in heaps], profile=points).run(TERRAIN)
    for (position, _), result in zip(heaps, results, strict=True):
        assert result["terrain_gap"] == pytest.approx(brute_gap(position, points), abs=2e-6)


@every_profile
def test_contacts_equal_a_second_program(points):
    """A pass over chains that overlap faces, convex and concave corners leaves that program's velocities and counts."""
    heaps = [(position - [0, 1e-4, 0], velocity) for position, velocity in heaps_above(points)]
    contact_pass = ContactPass([Placed(*heap, PAPER) for heap in heaps], profile=points)
    results = contact_pass.run(TERRAIN)
    for world, ((position, velocity), result) in enumerate(zip(heaps, results, strict=True)):
        expected, count = terrain.resolve(position, velocity, points, PAPER)
        assert result["terrain"] == count
        assert_allclose(contact_pass.velocity(world), expected, rtol=1e-9, atol=1e-9)
        lost = motion_equations.kinetic_energy(velocity, PAPER) - motion_equations.kinetic_energy(expected, PAPER)
        assert contact_pass.fixed_loss(world) == pytest.approx(lost, rel=1e-9, abs=1e-15)
    assert sum(result["terrain"] for result in results) > 20


def test_a_corner_meets_the_side_of_a_link():
    """A level link that falls on an edge between its circles gets one impulse there: v' = −e v at the edge."""
    edge = np.array([[-1.0, -1.0], [-0.001, -1.0], [-0.001, 0.0], [0.001, 0.0], [0.001, -1.0], [1.0, -1.0]])
    position = np.zeros((4, 3))
    position[:, 1] = PAPER.circle_radius - 1e-5
    position[:, 0] = [0.0, 0.3, 0.6, 0.9]
    velocity = np.tile([0.0, -1.0, 0.0], (4, 1))
    contact_pass = ContactPass([Placed(position, velocity, PAPER)], profile=edge)
    (result,) = contact_pass.run(TERRAIN)
    assert result["terrain_gap"] == pytest.approx(-1e-5)
    after = contact_pass.velocity(0)
    assert_array_equal(after[1:], velocity[1:])
    at_last_edge = after[0, 1] + 0.001 * after[0, 2]
    assert result["terrain"] == 2 and at_last_edge == pytest.approx(PAPER.floor_restitution, abs=0.2)


# --- motion ---


def test_a_level_slope_is_the_flat_floor_to_the_bit():
    """A chain that falls and rolls on a level slope has the motion of one on the flat floor."""
    position, velocity = dropped(links=12)
    flat, level = (
        warpchain.simulate(
            "soft", position, velocity, 0.01, times=[0.01], floor=floor, method="os32", precision="mixed"
        )
        for floor in (True, [[-1, 0], [1, 0]])
    )
    assert flat.impulses["floor"] > 20
    assert level.impulses == flat.impulses and level.steps_accepted == flat.steps_accepted
    assert_array_equal(level.position, flat.position)
    assert_array_equal(level.velocity, flat.velocity)


def lying_chain(degrees, speed):
    """Four links upon one another on a slope through the origin, which slide down it."""
    angle = -np.radians(degrees)
    along, up = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    places = np.array([0.0, SOFT.link_length, SOFT.link_length, 0.0])
    position = np.column_stack(
        [np.outer(places, along) + SOFT.circle_radius * up, angle + np.pi * np.array([0, 0, 1, 1])]
    )
    return position, np.tile([*(speed * along), 0.0], (4, 1)), along


@pytest.mark.parametrize("corners", [False, True])
@pytest.mark.parametrize(("degrees", "friction"), [(20.0, 0.2), (10.0, 0.5)])
def test_a_block_of_chain_slides_by_the_formula(degrees, friction, corners):
    """Down a slope it gains g (sin α − μ cos α) t, or it stops after v² / 2g(μ cos α − sin α)."""
    chain = SOFT.with_values({"floor_restitution": 0.0, "floor_friction": friction})
    position, velocity, along = lying_chain(degrees, 0.4)
    down = np.array([np.cos(np.radians(degrees)), -np.sin(np.radians(degrees))])
    points = np.outer([-1.0, 0.04, 1.0] if corners else [-1.0, 1.0], down)
    moved = warpchain.simulate(
        chain, position, velocity, 0.15, times=[0.07, 0.15], floor=points, method="os32", precision="mixed"
    )
    gain = SOFT.gravity * (np.sin(np.radians(degrees)) - friction * np.cos(np.radians(degrees)))
    speed, way = moved.velocity[:, :, :2].mean(axis=1) @ along, (moved.position[:, 0, :2] - position[0, :2]) @ along
    if gain > 0:
        assert_allclose(speed, 0.4 + gain * moved.time, rtol=2e-3)
        assert_allclose(way, 0.4 * moved.time + gain * moved.time**2 / 2, rtol=2e-3)
    else:
        assert way[-1] == pytest.approx(0.4**2 / (-2 * gain), rel=1e-2) and abs(speed[-1]) < 1e-3


@pytest.mark.parametrize(("first", "second", "until"), [(0.1, 0.3, 0.02), (0.3, 0.1, 0.008)])
def test_a_block_slides_over_two_segments_by_the_formula(first, second, until):
    """v²/2g is the sum of μ times way on each; while the block of length 2ℓ crosses, of the mean μ times 2ℓ."""
    chain = SOFT.with_values({"floor_restitution": 0.0, "floor_friction": 0.9, "circle_radius": 1e-3})
    position, velocity, _ = lying_chain(0.0, 0.4)
    position[:, 1] = chain.circle_radius
    front = position[:, 0].max() + chain.link_length / 2
    points = [[-1, 0, 0.0, first], [front + until, 0, 0.0, second], [2, 0]]
    moved = warpchain.simulate(
        chain, position, velocity, 0.4, times=[0.4], floor=points, method="os32", precision="mixed"
    )
    length = 2 * chain.link_length
    left = 0.4**2 / (2 * chain.gravity) - first * until - (first + second) / 2 * length
    way = moved.position[0, :, 0].mean() - position[:, 0].mean()
    assert left > 0 and way == pytest.approx(until + length + left / second, rel=1e-2)
    assert np.abs(moved.velocity).max() < 1e-2


def test_bounces_have_the_restitution_of_their_segment():
    """Upright links that fall on segments and on a corner rise at e times their speed, so to e² of the height."""
    points = np.array([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, -1.0], [2.0, -1.0]])
    laws = np.array([[0.2, 0.5], [0.9, 0.5], [0.3, 0.5], [0.5, 0.5]])
    position = np.zeros((4, 3))
    position[:, 0], position[:, 2] = [-0.5, 0.5, 1.0 + 1e-9, 1.5], np.pi / 2
    position[:, 1] = PAPER.link_length / 2 + PAPER.circle_radius - 1e-5 - np.array([0, 0, 0, 1])
    velocity = np.tile([0.0, -1.0, 0.0], (4, 1))
    contact_pass = ContactPass([Placed(position, velocity, PAPER)], profile=points, laws=laws)
    contact_pass.run(TERRAIN)
    assert_allclose(contact_pass.velocity(0)[:, 1], [0.2, 0.9, 0.3, 0.5], rtol=1e-6)


@pytest.mark.parametrize("points", [STAIRS, HILLS], ids=["stairs", "hills"])
def test_a_fall_equals_a_second_program(points):
    """A chain that falls on corners and moves by 5 mm and 0.4 rad is where that program's small steps have it."""
    mild = SOFT.with_values({"joint_stiffness": 2e3, "joint_damping": 0.05, "viscous_friction": 1e-5})
    position, velocity = folded_chain(4, 7, mild.link_length, opening=1e-5)
    position[:, 1] += 0.2
    position[:, 1] -= brute_gap(position, points)
    position[:, 1] -= max(brute_gap(position, points) - 5e-4, 0)
    velocity = 0.2 * velocity * [1, 1, 0.2] - [0.0, 1.0, 0.0]
    expected, _, count = terrain.fallen(position, velocity, points, mild, 6e-3, 8e-6)
    given = {"self_contact": False, "method": "os32", "tolerance": 1e-9, "contact_step": 2e-6}
    found = warpchain.simulate(mild, position, velocity, 6e-3, times=[6e-3], floor=points, **given)
    assert min(count, found.impulses["floor"]) > 500
    assert_allclose(found.position[0, :, :2], expected[:, :2], atol=1e-5)
    assert_allclose(found.position[0, :, 2], expected[:, 2], atol=1e-3)
