"""Floor contacts of a tilting chain: the law in three dimensions, and one pass over all rollers."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.oracle_model import contact_equations, tilting_contacts, tilting_plane
from tests.oracle_model.tilting_plane import Plane, axes, tilted_plane
from tests.support.impulse_cases import UNIT
from tests.support.tilted_chains import tilted_heap
from warpchain.inputs.parameters import preset

PAPER = preset("paper")
HEAPS = range(300)
ROOT_3 = float(np.sqrt(3.0))
"""Half width in m with which a link of 1 kg has S = 1 kg m²."""


def passed(seed: int, upright: bool = False):
    """A heap's arguments of the pass, the half width and the pass."""
    *heap, half_width = tilted_heap(seed, PAPER, upright)
    return heap, half_width, tilting_contacts.resolve_tilting_floor(*heap, half_width=half_width)


def kinetic_energy(position, velocity, plane, parameters, half_width):
    """Kinetic energy of the links as rigid bodies in the room."""
    return tilting_plane.tilting_kinetic_energy(position, velocity, plane, parameters, half_width=half_width)


def lone_link(tilt: float, height: float, x: float = 0.0) -> tuple[np.ndarray, np.ndarray, Plane]:
    """Four unit links: link 0 flat along e1 at (x, 0), the others high up; the plane's origin at `height` [m]."""
    position = np.array([[x, 0.0, 0.0], [-40.0, 1e3, 0.0], [0.0, 1e3, 0.0], [40.0, 1e3, 0.0]])
    return position, np.zeros((4, 3)), tilted_plane(tilt, origin=(0.0, height, 0.0))


# --- the law of one collision ---


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


# --- where a roller touches ---


def test_place_of_contact_by_hand():
    """Both rims alike: between them; one in the floor or falling: that one; falling at speeds 3 and 1: at h/2."""
    position, velocity, plane = lone_link(0.0, 0.4)
    sizes = (UNIT.circle_radius, 2.0)

    def touching(*, plane=plane, v=velocity[0], turn=0.0):
        rates = np.array([0.0, turn, 0.0])
        return tilting_contacts.touching_point(np.array([1.0, 0.0]), position[0], v, plane, rates, *sizes)

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


# --- one pass ---


def test_two_copies_of_the_plane_by_hand():
    """Two links of a fallen chain meet the floor at mirrored places; merging loses their copies' opposite turns."""
    # All links along e2. M = 4, about e1 4 (I + S) + 4 · 2² = 24, about e2 4 S + 4 · 1² = 8. The plane is tipped so
    # that only the left rollers of links 0 and 1 reach the floor, at (∓1, −3). N = 2,
    # W_nn = 2 (1/4 + 9/24 + 1/8) = 3/2, J = 2/3.
    # Copies: u = −1 + 2 (2/3)/4 = −2/3, ω1 = 2 (−3) (2/3)/24 = −1/6, ω2 = ±2 (2/3)/8 = ±1/6.
    # Merging: ½ · 8 · (1/6)² = 1/9.
    position = np.array([[-1.0, -2, np.pi / 2], [1, -2, np.pi / 2], [-1, 2, np.pi / 2], [1, 2, np.pi / 2]])
    slope = 1e-7
    plane = Plane(
        speed=-1.0,
        turn=np.zeros(2),
        x=np.array([1.0, 0.0, 0.0]),
        y=np.array([0.0, slope, 1.0]),
        origin=np.array([0.0, ROOT_3 + 2 * slope, 0.0]),
    )
    parameters = UNIT.with_values({"floor_friction": 0.0, "circle_radius": 1e-9})
    result = tilting_contacts.resolve_tilting_floor(position, np.zeros((4, 3)), plane, parameters, half_width=ROOT_3)
    assert [each.link for each in result.impulses] == [0, 1]
    assert_allclose([each.impulse for each in result.impulses], [[0, 0, 2 / 3]] * 2, atol=1e-6)
    assert_allclose([each.loss for each in result.impulses], [1 / 3] * 2, atol=1e-6)
    assert_allclose(result.plane.rates, [-2 / 3, -1 / 6, 0], atol=1e-6)
    assert result.merging_loss == pytest.approx(1 / 9, abs=1e-6)


@pytest.mark.parametrize("half_width", [0.0, 4e-3])
def test_upright_plane_is_the_planar_model(half_width):
    """In an upright plane at rest the floor gives the planar impulses, midway between the rims."""
    touched = 0
    for seed in range(60):
        position, velocity, plane, parameters, _ = tilted_heap(seed, PAPER, upright=True)
        result = tilting_contacts.resolve_tilting_floor(position, velocity, plane, parameters, half_width=half_width)
        lifted = position + np.array([0.0, plane.origin[1], 0.0])
        expected, counts = contact_equations.resolve_contacts(lifted, velocity, parameters, self_contact=False)
        assert_allclose(result.velocity, expected, rtol=1e-11, atol=1e-11)
        assert len(result.impulses) == counts["floor"]
        assert_array_equal(result.plane.rates, 0)
        assert all(impulse.point[2] == 0 for impulse in result.impulses)
        touched += counts["floor"]
    assert touched > 100


def test_pass_changes_momenta_by_its_impulses():
    """Momentum changes by Σ J and angular momentum by Σ r × J in the room, in any heap."""
    touched = []
    for seed in HEAPS:
        (position, velocity, plane, parameters), half_width, result = passed(seed)
        frame = axes(plane)
        impulses = np.array([frame @ each.impulse for each in result.impulses]).reshape(-1, 3)
        points = np.array([plane.origin + frame @ each.point for each in result.impulses]).reshape(-1, 3)
        size = np.abs(impulses).sum() + 1e-2
        change = tilting_plane.room_momentum(
            position, result.velocity, result.plane, parameters
        ) - tilting_plane.room_momentum(position, velocity, plane, parameters)
        assert_allclose(change, impulses.sum(axis=0), atol=1e-11 * size)
        after, before = (
            tilting_plane.room_angular_momentum(position, *state, parameters, half_width=half_width)
            for state in ((result.velocity, result.plane), (velocity, plane))
        )
        assert_allclose(after - before, np.cross(points, impulses).sum(axis=0), atol=1e-11 * size)
        touched.append(len(result.impulses))
    assert max(touched) >= 10
    assert np.mean(touched) > 2


def test_pass_loses_what_collisions_and_merging_lose():
    """The energy never rises, each impulse lies in the cone, and the losses add up to the change of energy."""
    merged = 0
    for seed in HEAPS:
        heap, half_width, result = passed(seed)
        position, _, plane, parameters = heap
        before = kinetic_energy(*heap, half_width)
        after = kinetic_energy(position, result.velocity, result.plane, parameters, half_width)
        losses = [impulse.loss for impulse in result.impulses]
        assert np.all(np.isfinite(result.velocity)) and np.all(np.isfinite(result.plane.rates))
        assert after <= before * (1 + 1e-12)
        assert_allclose(before - after, sum(losses) + result.merging_loss, atol=1e-11 * before)
        assert min([0.0, *losses]) >= -1e-11 * before
        assert result.merging_loss >= 0
        merged += result.merging_loss > 1e-6 * before
        for each in result.impulses:
            push = plane.y @ each.impulse
            assert push > 0
            along = np.linalg.norm(each.impulse - push * plane.y)
            assert along <= parameters.floor_friction * push + 1e-11 * np.linalg.norm(each.impulse)
    assert merged > 50
