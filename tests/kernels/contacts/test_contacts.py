"""The contact pass of whole chains: against the reference, in the documented order, energy accounted for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import contact_equations, motion_equations
from tests.oracle_model.circular_loop import circular_loop
from tests.support.folded_chains import folded_chain
from tests.support.kernels_under_test import FLOOR, LIST, SELF, SPROCKET, ContactPass, Placed
from tests.support.presets import PAPER

TURNING = -90.0
"""Angular velocity of the sprocket, in rad/s: about that of 15 Hz."""
HUB = (np.zeros(2), PAPER.sprocket_radius, TURNING)

# n, seed, tilt: from the shortest chain to the paper's, in random walks and in flat piles
HEAPS = [(4, 1, np.pi), (6, 2, np.pi), (8, 3, np.pi), (8, 4, 0.2), (60, 5, np.pi), (60, 6, 0.2), (150, 7, np.pi)]


def placed_heap(n, seed, tilt, parameters=PAPER):
    """A folded chain that moves at random."""
    return Placed(*folded_chain(n, seed, parameters.link_length, tilt=tilt), parameters)


def with_random_coefficients(seed):
    """Table 1 with restitutions and frictions drawn at random, tangential restitution included."""
    generator = np.random.default_rng(seed)
    names = [f"{kind}_{law}" for kind in ("floor", "chain", "sprocket") for law in ("restitution", "friction")]
    values = {name: float(generator.uniform(0, 1)) for name in names}
    return PAPER.with_values(values | {"tangential_restitution": float(generator.uniform(-1, 1))})


def assert_same_velocity(result, expected):
    """Velocities agree to 1e-12 of the greatest in their column."""
    assert np.all(np.isfinite(result))
    assert_allclose((result - expected) / np.abs(expected).max(axis=0), 0, atol=1e-12)


# --- whole chains against the reference ---


@pytest.mark.parametrize(("n", "seed", "tilt"), HEAPS)
def test_floor_sprocket_and_self_contacts_equal_reference(n, seed, tilt):
    """A pass over floor, turning sprocket and self-contacts leaves the reference's velocities and counts."""
    heap = placed_heap(n, seed, tilt)
    contact_pass = ContactPass([heap], sprocket_speed=TURNING)
    (result,) = contact_pass.run(LIST | FLOOR | SPROCKET | SELF)
    expected, counts = contact_equations.resolve_contacts(heap.position, heap.velocity, PAPER, sprocket=HUB)
    assert {kind: result[kind] for kind in counts} == counts
    if n > 4:
        assert min(counts.values()) > 0
    assert_same_velocity(contact_pass.velocity(0), expected)


@pytest.mark.parametrize("kind", ["floor", "sprocket", "self"])
def test_each_kind_alone_equals_reference(kind):
    """Each kind of contact equals the reference with coefficients drawn at random, e_t included."""
    heaps = [placed_heap(n, n + i, np.pi, with_random_coefficients(i)) for i in range(12) for n in (8, 20)]
    contact_pass = ContactPass(heaps, sprocket_speed=TURNING)
    results = contact_pass.run({"floor": FLOOR, "sprocket": SPROCKET, "self": LIST | SELF}[kind])
    chosen = {"floor": kind == "floor", "sprocket": HUB if kind == "sprocket" else None, "self_contact": kind == "self"}
    for world, (heap, result) in enumerate(zip(heaps, results, strict=True)):
        expected, counts = contact_equations.resolve_contacts(heap.position, heap.velocity, heap.parameters, **chosen)
        assert result[kind] == counts[kind]
        assert_same_velocity(contact_pass.velocity(world), expected)
    assert sum(result[kind] for result in results) > 100


@pytest.mark.parametrize(("body", "speed"), [(FLOOR, 0.0), (SPROCKET, 0.0), (SPROCKET, TURNING)])
def test_a_sunken_circle_leaves_at_push_rate_times_its_depth(body, speed):
    """Without restitution a resting link's only sunken circle moves out at that speed, and its work is booked."""
    push_rate = 2000.0
    dull = PAPER.with_values({"sprocket_restitution": 0.0, "floor_restitution": 0.0})
    seen = 0
    for seed in range(20):
        position, velocity = folded_chain(20, seed, dull.link_length, tilt=np.pi)
        position[:, 0] += dull.sprocket_radius + dull.link_length
        if body == FLOOR:
            position[:, 1] -= np.min(position[:, 1])
        contact_pass = ContactPass([Placed(position, 0 * velocity, dull)], push_rate=push_rate, sprocket_speed=speed)
        contact_pass.run(body)
        after = contact_pass.velocity(0)
        ends = np.stack(motion_equations.link_ends(position, dull), axis=1)
        if body == FLOOR:
            outwards, depth = np.broadcast_to([0.0, 1.0], ends.shape), dull.circle_radius - ends[:, :, 1]
        else:
            distance = np.linalg.norm(ends, axis=2)
            outwards, depth = ends / distance[..., None], dull.sprocket_radius + dull.circle_radius - distance
        for link in np.flatnonzero((depth > 0).sum(axis=1) == 1):
            end = int(np.argmax(depth[link]))
            arm = ends[link, end] - dull.circle_radius * outwards[link, end] - position[link, :2]
            speed_out = (after[link, :2] + after[link, 2] * np.array([-arm[1], arm[0]])) @ outwards[link, end]
            assert speed_out == pytest.approx(push_rate * depth[link, end], rel=1e-10)
            seen += 1
        assert np.all(after[np.all(depth <= 0, axis=1)] == 0)
        gained = motion_equations.kinetic_energy(after, dull)
        assert contact_pass.fixed_loss(0) == pytest.approx(-gained, rel=1e-12)
    assert seen > 10


def test_circles_almost_as_wide_as_links_meet_past_one_link():
    """If r is close to ℓ/2, circles at both ends of one link, of the links before and after it, can touch."""
    wide = PAPER.with_values({"circle_radius": 0.4999 * PAPER.link_length})
    position, velocity = circular_loop(20, PAPER, 5.0)
    generator = np.random.default_rng(0)
    position[:, :2] += generator.normal(size=(20, 2)) * 1e-5
    velocity += generator.normal(size=(20, 3))
    expected, counts = contact_equations.resolve_contacts(position, velocity, wide, floor=False)
    assert counts["self"] > 3
    contact_pass = ContactPass([Placed(position, velocity, wide)])
    (result,) = contact_pass.run(LIST | SELF)
    assert result["self"] == counts["self"]
    assert_same_velocity(contact_pass.velocity(0), expected)


# --- gaps, energy, what is left alone ---


@pytest.mark.parametrize("parts", [FLOOR, SPROCKET, FLOOR | SPROCKET, LIST | SELF])
def test_loss_is_change_of_kinetic_energy(parts):
    """The loss returned is the change of kinetic energy, and positive unless the sprocket turns."""
    heaps = [placed_heap(n, seed, tilt, with_random_coefficients(seed)) for n, seed, tilt in HEAPS]
    for speed in (0.0, TURNING):
        contact_pass = ContactPass(heaps, sprocket_speed=speed)
        results = contact_pass.run(parts)
        for world, (heap, result) in enumerate(zip(heaps, results, strict=True)):
            before = motion_equations.kinetic_energy(heap.velocity, heap.parameters)
            after = motion_equations.kinetic_energy(contact_pass.velocity(world), heap.parameters)
            fixed_loss = contact_pass.fixed_loss(world)
            lost = result["self_loss"] if parts & SELF else fixed_loss
            assert lost != 0
            assert_allclose(lost, before - after, atol=1e-13 * (before + after))
            if parts & SELF:
                assert fixed_loss == 0
            if speed == 0 or not parts & SPROCKET:
                assert lost > 0
