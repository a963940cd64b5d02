"""Floor contacts of a tilting chain: the law in three dimensions, and one pass over all rollers."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.oracle_model import contact_equations, tilting_contacts, tilting_plane
from tests.oracle_model.tilting_plane import Plane, axes, tilted_plane
from tests.support.impulse_cases import HAND_CASES, UNIT
from tests.support.tilted_chains import mirrored, tilted_heap
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


@pytest.mark.parametrize(
    "name", [name for name, (collision, _) in HAND_CASES.items() if collision.inv_mass_b and not collision.inv_mass_a]
)
def test_impulse_in_a_turned_plane_is_the_planar_one(name):
    """Cases worked by hand for the planar law, laid into any plane of the room."""
    collision, expected = HAND_CASES[name]
    generator = np.random.default_rng(1)
    for _ in range(10):
        frame, _ = np.linalg.qr(generator.normal(size=(3, 3)))
        lever = np.array([-collision.lever_b[1], collision.lever_b[0]])
        w = np.diag([0.0, 0.0, generator.uniform(0.1, 2.0)])
        w[:2, :2] = collision.inv_mass_b * np.eye(2) + collision.inv_inertia_b * np.outer(lever, lever)
        impulse = tilting_contacts.tilting_collision_impulse(
            -frame[:, :2] @ collision.v_rel,
            frame[:, :2] @ collision.normal,
            frame @ w @ frame.T,
            *astuple(collision)[-3:],
        )
        assert_allclose(impulse, frame[:, :2] @ expected, rtol=1e-12, atol=1e-13)


def test_impulse_of_a_ball_by_hand():
    """A ball of 2 kg that slides along (0.6, 0.8) is braked against its way, within the cone of friction."""
    # W = 1/2, v_n = −4, slip 5: P_n = (1 + e)·8 = 12; sticking takes 10 ≤ 12 μ. μ = 1/4: 3. e_t = 0.2, μ = 1: 12.
    for friction, tangential, braking in ((1.0, 0.0, 10.0), (0.25, 0.0, 3.0), (1.0, 0.2, 12.0), (0.0, 0.0, 0.0)):
        impulse = tilting_contacts.tilting_collision_impulse(
            np.array([3.0, 4.0, -4.0]), np.array([0.0, 0.0, 1.0]), np.eye(3) / 2, 0.5, friction, tangential
        )
        assert_allclose(impulse, [-0.6 * braking, -0.8 * braking, 12.0], rtol=1e-14, atol=1e-14)


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


def test_point_velocity_is_that_of_the_rigid_link():
    """The velocity of a link's point is its centre's plus angular velocity × lever, worked out in the room."""
    for seed in range(20):
        position, velocity, plane, parameters, _ = tilted_heap(seed, PAPER)
        frame = axes(plane)
        spin, _ = tilting_plane.link_turning(position, velocity, plane, parameters, half_width=0.0)
        centre = tilting_plane.room_velocity(position, velocity, plane)
        point = np.array([0.01, -0.02, 0.004])
        lever = frame @ (point - [*position[2, :2], 0.0])
        v = tilting_contacts.point_velocity(point, position[2], velocity[2], plane.rates)
        assert_allclose(frame @ v, centre[2] + np.cross(spin[2], lever), rtol=1e-12, atol=1e-12)


# --- one pass ---


def test_fallen_links_by_hand():
    """Four equal links that fall flat on their sides: left rollers first, and four copies as if each were free."""
    # M = 4, moments about e1 4 S = 4, about e2 4 (I + S) = 8; N = 4. Left, X = −1, u = −1: W_nn = 4 (1/4 + 1/8) = 3/2,
    # J = 2/3; the copy gets u = −1 + 2/3, ω2 = 4 · (2/3)/8 = 1/3. Right, X = 1, falls with 2/3: J = 4/9, u = ω2 = 1/9.
    position, velocity = np.zeros((4, 3)), np.zeros((4, 3))
    plane = replace(tilted_plane(speed=-1.0, origin=(0.0, 1.7, 0.0)), y=np.array([0.0, 0.0, 1.0]))
    parameters = UNIT.with_values({"floor_friction": 0.0})
    result = tilting_contacts.resolve_tilting_floor(position, velocity, plane, parameters, half_width=ROOT_3)
    assert [impulse.link for impulse in result.impulses] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert_allclose([impulse.impulse[2] for impulse in result.impulses], [2 / 3, 4 / 9] * 4, rtol=1e-12)
    # Ŷ has no part within the plane, so the rollers are pushed at the middle of their lower faces.
    assert_allclose([impulse.point for impulse in result.impulses], [[-1, 0, -ROOT_3], [1, 0, -ROOT_3]] * 4)
    assert_allclose(result.plane.rates, [1 / 9, 0, 1 / 9], atol=1e-12)
    assert result.merging_loss == pytest.approx(0.0, abs=1e-12)
    assert_array_equal(plane.rates, [-1, 0, 0])


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


def test_lone_contact_obeys_the_law():
    """If one roller touches once, v_n becomes −e v_n at its point, and nothing is lost by merging."""
    lone = 0
    for seed in range(600):
        (position, velocity, plane, parameters), _, result = passed(seed)
        if len(result.impulses) != 1:
            continue
        lone += 1
        (impulse,) = result.impulses
        place = (impulse.point, position[impulse.link])
        before = tilting_contacts.point_velocity(*place, velocity[impulse.link], plane.rates)
        after = tilting_contacts.point_velocity(*place, result.velocity[impulse.link], result.plane.rates)
        assert plane.y @ before < 0
        bound = 1e-10 * (np.linalg.norm(before) + np.linalg.norm(after))
        assert_allclose(plane.y @ after, -parameters.floor_restitution * (plane.y @ before), atol=bound)
        assert result.merging_loss == 0
    assert lone >= 30, lone


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


def test_mirror_image_and_order_of_links_make_no_difference():
    """The mirrored heap gets the mirrored pass to the bit, and links that are counted from another one get the same."""
    for seed in HEAPS:
        (position, velocity, plane, parameters), half_width, result = passed(seed)
        image = tilting_contacts.resolve_tilting_floor(
            position, velocity, mirrored(plane), parameters, half_width=half_width
        )
        assert_array_equal(image.velocity, result.velocity)
        assert_array_equal(image.plane.rates, -result.plane.rates)
        assert image.merging_loss == result.merging_loss
        rolled = tilting_contacts.resolve_tilting_floor(
            np.roll(position, 2, axis=0), np.roll(velocity, 2, axis=0), plane, parameters, half_width=half_width
        )
        # Heaps with W far from round enlarge rounding.
        scale = 1 + np.abs(result.velocity).max()
        assert_allclose(np.roll(rolled.velocity, -2, axis=0), result.velocity, atol=1e-10 * scale)
        assert_allclose(rolled.plane.rates, result.plane.rates, atol=1e-10 * scale)


def test_exactly_flat_chain_is_pushed_at_the_middle_of_its_faces():
    """With Ŷ along the normal nothing is undefined: the fallen chain is pushed at its rollers' centres."""
    for side in (1.0, -1.0):
        position, velocity, _, parameters, _ = tilted_heap(4, PAPER)
        plane = Plane(-side, np.array([3.0, -2.0]), np.array([1.0, 0, 0]), np.array([0, 0, side]), np.zeros(3))
        result = tilting_contacts.resolve_tilting_floor(position, velocity, plane, parameters, half_width=4e-3)
        assert len(result.impulses) >= len(position)
        assert np.all(np.isfinite(result.velocity)) and np.all(np.isfinite(result.plane.rates))
        ends = np.concatenate(tilting_plane.link_ends(position, parameters))
        for impulse in result.impulses:
            assert impulse.point[2] == -side * 4e-3
            assert np.abs(ends - impulse.point[:2]).max(axis=1).min() == 0


def test_chain_above_the_floor_or_going_up_is_left_alone():
    """No roller in the floor, or none that approaches: nothing changes."""
    for height, speed in ((0.6, -1.0), (0.4, 1.0), (0.4, 0.0)):
        position, velocity, plane = lone_link(0.0, height)
        velocity[0, 1] = speed
        result = tilting_contacts.resolve_tilting_floor(position, velocity, plane, UNIT, half_width=0.1)
        assert result.impulses == ()
        assert result.merging_loss == 0
        assert_array_equal(result.velocity, velocity)
        assert_array_equal(result.plane.rates, plane.rates)
