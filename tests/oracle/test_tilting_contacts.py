"""Floor contacts of a tilting chain: the law in three dimensions, and one pass over all rollers."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.oracle_model import tilting_contacts, tilting_plane
from tests.oracle_model.tilting_plane import axes, tilted_plane
from tests.support.presets import PAPER
from tests.support.tilted_chains import tilted_heap

HEAPS = range(150)


def passed(seed: int):
    """A heap's arguments of the pass, the half width and the pass."""
    *heap, half_width = tilted_heap(seed, PAPER)
    return heap, half_width, tilting_contacts.resolve_tilting_floor(*heap, half_width=half_width)


@pytest.mark.parametrize("seed", range(20))
def test_impulse_obeys_the_law(seed):
    """Any approaching collision: v_n becomes −e v_n, P lies in the cone, pushes only, and no energy is made."""
    generator = np.random.default_rng(seed)
    for _ in range(25):
        root = generator.normal(size=(3, 3))
        w = root @ root.T + 10 ** generator.uniform(-4, 0) * np.eye(3)
        normal, v = generator.normal(size=(2, 3))
        normal /= np.linalg.norm(normal)
        v *= -np.sign(normal @ v)
        e, friction = generator.choice([0.0, 1.0, generator.uniform()], 2)
        tangential = generator.choice([-1.0, 0.0, 1.0, generator.uniform(-1, 1)])
        impulse = tilting_contacts.tilting_collision_impulse(v, normal, w, e, friction, tangential)
        size, after = np.linalg.norm(impulse), v + w @ impulse
        push = normal @ impulse
        assert push > 0
        assert_allclose(normal @ after, -e * (normal @ v), atol=1e-10 * np.linalg.norm(w) * size)
        assert np.linalg.norm(impulse - push * normal) <= friction * push + 1e-12 * size
        assert impulse @ (v + after) <= 1e-10 * size * np.linalg.norm(v)
        assert_array_equal(
            tilting_contacts.tilting_collision_impulse(-v, normal, w, e, friction, tangential), np.zeros(3)
        )


def test_place_of_contact_by_hand():
    """Both rims alike: between them; one in the floor or falling: that one; falling at speeds 3 and 1: at h/2."""
    upright, still = tilted_plane(origin=(0.0, 0.4, 0.0)), np.zeros(3)

    def touching(*, plane=upright, v=still, turn=0.0):
        rates = np.array([0.0, turn, 0.0])
        return tilting_contacts.touching_point(np.array([1.0, 0.0]), np.zeros(3), v, plane, rates, 0.5, 2.0)

    falling = np.array([0.0, -2.0, 0.0])
    assert_array_equal(touching(v=falling), [1.0, -0.5, 0.0])
    assert touching() is None
    assert touching(v=-falling) is None
    # Upright: the rim at ζ moves up with ẏ − ζ ω1.
    assert_allclose(touching(v=falling, turn=0.5), [1.0, -0.5, 1.0])
    assert_allclose(touching(v=falling, turn=-0.5), [1.0, -0.5, -1.0])
    assert_allclose(touching(v=falling, turn=4.0), [1.0, -0.5, 2.0])
    assert_allclose(touching(turn=-4.0), [1.0, -0.5, -2.0])
    # Tilted by 0.1 the rims differ in height by 4 sin 0.1 = 0.40: only the one at −h is in the floor.
    leaning = tilted_plane(0.1, origin=(0.0, 0.6, 0.0))
    assert_allclose(touching(plane=leaning, v=falling), [1.0, -0.5, -2.0])
    assert touching(plane=replace(leaning, origin=np.array([0.0, 0.8, 0.0])), v=falling) is None


def test_pass_keeps_the_laws():
    """In any heap momenta change by Σ J and Σ r × J in the room, J lies in the cone, losses are all that is lost."""
    touched, merged = [], 0
    for seed in HEAPS:
        heap, half_width, result = passed(seed)
        position, velocity, plane, parameters = heap
        frame = axes(plane)
        impulses = np.array([frame @ each.impulse for each in result.impulses]).reshape(-1, 3)
        points = np.array([plane.origin + frame @ each.point for each in result.impulses]).reshape(-1, 3)
        states = (velocity, plane), (result.velocity, result.plane)
        before, after = (
            np.concatenate(
                [
                    tilting_plane.room_momentum(position, *state, parameters),
                    tilting_plane.room_angular_momentum(position, *state, parameters, half_width=half_width),
                ]
            )
            for state in states
        )
        expected = np.concatenate([impulses.sum(axis=0), np.cross(points, impulses).sum(axis=0)])
        assert_allclose(after - before, expected, atol=1e-11 * (np.abs(impulses).sum() + 1e-2))
        before, after = (
            tilting_plane.tilting_kinetic_energy(position, *state, parameters, half_width=half_width)
            for state in states
        )
        losses = [each.loss for each in result.impulses]
        assert after <= before * (1 + 1e-12)
        assert_allclose(before - after, sum(losses) + result.merging_loss, atol=1e-11 * before)
        assert min([0.0, *losses]) >= -1e-11 * before and result.merging_loss >= 0
        for each in result.impulses:
            push = plane.y @ each.impulse
            along = np.linalg.norm(each.impulse - push * plane.y)
            assert push > 0 and along <= parameters.floor_friction * push + 1e-11 * np.linalg.norm(each.impulse)
        merged += result.merging_loss > 1e-6 * before
        touched.append(len(result.impulses))
    assert max(touched) >= 10 and np.mean(touched) > 2 and merged > 25
