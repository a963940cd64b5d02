"""The kernels' impulse law at two links, and at a link on a surface: collisions worked by hand."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.support.impulse_cases import BALL, HAND_CASES, HEAD_ON
from tests.support.kernels_under_test import fixed_contacts, link_pairs

RADIUS = 0.1
DISTANCE = 0.15
"""Circles of two links overlap by 2 · RADIUS − DISTANCE."""
ON_SURFACES = [name for name, (collision, _) in HAND_CASES.items() if collision.inv_mass_a == 0]


def spin_velocity(omega, lever):
    """ω ẑ × lever."""
    return omega * np.array([-lever[1], lever[0]])


def turn_by(impulse, lever, inverse_inertia):
    """Change of a body's angular velocity by an impulse at a lever."""
    return (lever[0] * impulse[1] - lever[1] * impulse[0]) * inverse_inertia


def two_links(collision, push_rate=0.0):
    """A collision as two links with overlapping circles that drift and spin anyhow, before and after it.

    Returns:
        velocity (2, 3) of A and B before, the same after, and depth, energy lost and number of impulses (3,).
    """
    generator = np.random.default_rng(0)
    levers = np.array([collision.lever_a, collision.lever_b])
    point, spins, drift = generator.uniform(-1, 1, 2), generator.normal(size=2), generator.normal(size=2)
    turning = [spin_velocity(spin, lever) for spin, lever in zip(spins, levers, strict=True)]
    velocity = np.column_stack([[collision.v_rel + drift + turning[1] - turning[0], drift], spins])
    inverses = [
        [collision.inv_mass_a, collision.inv_inertia_a],
        [collision.inv_mass_b, collision.inv_inertia_b],
    ]
    ends = point + np.array([[-0.5], [0.5]]) * DISTANCE * np.array(collision.normal)
    law = [RADIUS, collision.restitution, collision.friction, collision.tangential_restitution]
    given = (point - levers, velocity, np.array(inverses), np.array([*law, *ends.ravel()]))
    after, results = link_pairs(*(values[None] for values in given), push_rate)
    return velocity, after[0], results[0]


@pytest.mark.parametrize("name", HAND_CASES)
def test_two_links_by_hand(name):
    """Two links get the hand-worked impulse and its opposite, separating ones none."""
    collision, expected = HAND_CASES[name]
    before, after, (depth, _, hits) = two_links(collision)
    inverses = (
        (-1, collision.lever_a, collision.inv_mass_a, collision.inv_inertia_a),
        (1, collision.lever_b, collision.inv_mass_b, collision.inv_inertia_b),
    )
    for change, (sign, lever, inverse_mass, inverse_inertia) in zip(after - before, inverses, strict=True):
        assert_allclose(change[:2], sign * np.array(expected) * inverse_mass, atol=1e-13)
        assert_allclose(change[2], sign * turn_by(expected, lever, inverse_inertia), atol=1e-13)
    assert hits == (np.dot(collision.v_rel, collision.normal) > 0)
    assert depth == pytest.approx(2 * RADIUS - DISTANCE, rel=1e-14)
    if not hits:
        assert_array_equal(after, before)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_overlapping_links_part_as_fast_as_they_are_pushed(restitution):
    """Links that do not part meet as if they approached faster by push_rate times their depth; the work is booked."""
    push_rate = 20.0
    collision = replace(HEAD_ON, v_rel=(0.0, 0.0), restitution=restitution)
    before, after, (depth, lost, hits) = two_links(collision, push_rate)
    push = push_rate * depth
    assert hits == 1
    assert after[1, 0] - after[0, 0] == pytest.approx((1 + restitution) * push, rel=1e-12)
    energies = [np.sum(velocity**2) / 2 for velocity in (before, after)]
    assert energies[0] - energies[1] == pytest.approx(lost, abs=1e-13)
    parting = replace(collision, v_rel=(-1.01 * push, 0.0))
    before, after, (_, lost, hits) = two_links(parting, push_rate)
    assert hits == lost == 0
    assert_array_equal(after, before)


@pytest.mark.parametrize("distance", [2 * RADIUS, 0.25, 0.0])
def test_links_apart_or_concentric_keep_their_velocities(distance):
    """Circles that just touch, are apart, or have the same centre and so no normal, are left alone."""
    position = np.array([[[0.0, 0.0], [1.0, 0.0]]])
    velocity = np.array([[[6.0, 0.0, 1.0], [0.0, 0.0, 2.0]]])
    inverses = np.ones((1, 2, 2))
    law = [RADIUS, 1.0, 1.0, 0.0]
    after, results = link_pairs(position, velocity, inverses, np.array([[*law, 0.0, 0.0, distance, 0.0]]))
    assert_array_equal(after, velocity)
    assert_array_equal(results, [[0.0, 0.0, 0.0]])
    after, results = link_pairs(position, velocity, inverses, np.array([[*law, 0.0, 0.0, 1.99 * RADIUS, 0.0]]))
    assert np.all(after[0, :, 0] != velocity[0, :, 0])
    assert results[0, 2] == 1


def on_surface(collision, velocity, surface, gap=-1e-3):
    """What `fixed_contact` leaves of link B: velocity (3,), energy lost, number of impulses."""
    given = [gap, *collision.normal, *collision.lever_b, *surface, collision.inv_mass_b, collision.inv_inertia_b]
    given += [collision.restitution, collision.friction, *velocity, collision.tangential_restitution]
    result = fixed_contacts(np.array([given]))[0]
    return result[:3], result[3], result[4]


@pytest.mark.parametrize("surface", [(0.0, 0.0), (1.5, -0.7)])
@pytest.mark.parametrize("name", ON_SURFACES)
def test_link_on_surface_by_hand(name, surface):
    """A link that meets an immovable body, at rest or moving, gets the hand-worked impulse; none if it is above."""
    collision, expected = HAND_CASES[name]
    spin = 0.8
    velocity = np.array([*(np.array(surface) - collision.v_rel - spin_velocity(spin, collision.lever_b)), spin])
    after, _, hits = on_surface(collision, velocity, surface)
    assert_allclose((after - velocity)[:2], np.array(expected) * collision.inv_mass_b, atol=1e-13)
    turned = turn_by(expected, collision.lever_b, collision.inv_inertia_b)
    assert_allclose(after[2] - velocity[2], turned, atol=1e-13)
    assert hits == 1
    for gap in (0.0, 1e-300):
        after, lost, hits = on_surface(collision, velocity, surface, gap)
        assert_array_equal(after, velocity)
        assert hits == lost == 0


def test_loss_of_a_ball_by_hand():
    """A ball of 2 kg that falls with (3, −4) m/s and leaves with (0, 2) m/s loses 25 − 4 J."""
    after, lost, hits = on_surface(replace(BALL, friction=1.0), (3.0, -4.0, 0.0), (0.0, 0.0))
    assert_allclose([*after, lost, hits], [0.0, 2.0, 0.0, 21.0, 1.0], atol=1e-14)
