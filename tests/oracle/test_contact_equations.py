"""The NumPy reference of collisions against hand-worked numbers and the law's invariants."""

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.testing import assert_allclose, assert_array_equal

from tests.oracle_model import contact_equations, motion_equations
from tests.support.impulse_cases import (
    HAND_CASES,
    UNIT,
    Collision,
    collisions,
    crumpled_chain,
    crumpled_chains,
    law_violations,
)
from warpchain.inputs.parameters import preset

PAPER = preset("paper")


def scattered_links(n: int):
    """n links far apart in the air, at rest."""
    position = np.column_stack([10.0 * np.arange(n), np.full(n, 100.0), np.zeros(n)])
    return position, np.zeros((n, 3))


# --- the law of one collision ---


@pytest.mark.parametrize("name", HAND_CASES)
def test_impulse_by_hand(name):
    """Impulses worked out by hand."""
    collision, expected = HAND_CASES[name]
    assert_allclose(contact_equations.collision_impulse(*collision.arguments()), expected, rtol=1e-14, atol=1e-14)


@given(collisions())
@settings(max_examples=1000, deadline=None, derandomize=True)
def test_impulse_obeys_the_law(collision: Collision):
    """Any approaching collision: v'_n = −e v_n, |J_t| ≤ μ J_n, and kinetic energy never rises."""
    assert law_violations(collision, contact_equations.collision_impulse(*collision.arguments())) == []


@given(collisions())
@settings(max_examples=300, deadline=None, derandomize=True)
def test_energy_change_is_the_stated_sum_of_losses(collision: Collision):
    """ΔT = −½ (1−e²) J₁ᵀWJ₁ − ½ κ(2−κ) DᵀWD, with κ read off the impulse."""
    v, normal = np.array(collision.v_rel), np.array(collision.normal)
    w = np.column_stack([v - collision.relative_velocity_after(unit) for unit in np.eye(2)])
    stop_approach = normal * (normal @ v) / (normal @ w @ normal)
    slide = np.linalg.solve(w, v) - stop_approach
    impulse = contact_equations.collision_impulse(*collision.arguments())
    rest = impulse - (1 + collision.restitution) * stop_approach
    size = np.linalg.norm(slide) * (np.linalg.norm(slide) + np.linalg.norm(impulse))
    assert abs(rest[0] * slide[1] - rest[1] * slide[0]) <= 1e-11 * size
    assert -1e-11 * size <= rest @ slide <= (1 + collision.tangential_restitution) * (slide @ slide) + 1e-11 * size
    # With rest = κ D: κ(2 − κ) DᵀWD = (2 D − rest)ᵀ W rest.
    losses = (1 - collision.restitution**2) * (stop_approach @ w @ stop_approach) + (2 * slide - rest) @ w @ rest
    scale = np.linalg.norm(v) * np.linalg.norm(impulse) + impulse @ w @ impulse
    assert_allclose(collision.kinetic_energy_change(impulse), -losses / 2, atol=1e-11 * scale)


# --- contacts of a chain ---


def test_floor_contact_by_hand():
    """A flat link that falls on its left circle sticks at the touching point; a raised circle is left alone."""
    # Left circle overlaps, right one must not: the link is tilted by 1e-3, by which the numbers move.
    # P = (−1, −0.5) from the centre, v_P = (0, −3): W = [2, 1/2; 1/2, 5/4] in (n, t), J₂ = [5/3, −2/3] within μ = 1.
    position, velocity = scattered_links(4)
    position[0] = [0.0, 0.4995, 1e-3]
    velocity[0] = [0.0, -3.0, 0.0]
    result, counts = contact_equations.resolve_contacts(position, velocity, UNIT)
    assert counts == {"floor": 1, "sprocket": 0, "self": 0}
    assert_allclose(result[0], [2 / 3, -4 / 3, -4 / 3], atol=5e-3)
    assert_array_equal(result[1:], 0)
    assert_array_equal(velocity[0], [0.0, -3.0, 0.0])
    _, counts = contact_equations.resolve_contacts(position, velocity, UNIT, floor=False)
    assert counts["floor"] == 0


def test_sprocket_drags_a_link_by_hand():
    """A link falling on the sprocket's top slides and is dragged along by the turning surface."""
    # Left circle on top of the sprocket at (0, 50), R = 3, Ω = 1 (anticlockwise: surface moves to −x with 3 m/s).
    # v = [3, 3], P = (−1, −0.5) from the link's centre: J₁ = 3/2 n̂, J₂ = [1, 2], D = [−1/2, 2], J^(a) = [1, 2] slides:
    # κ = (3/2)/(2 + 1/2) = 3/5, J = [1.2, 1.2], world (−1.2, 1.2), torque −1.2 − 0.6 = −1.8.
    position, velocity = scattered_links(4)
    position[1] = [1.0, 50 + 3.4, 0.0]
    velocity[1] = [0.0, -3.0, 0.0]
    sprocket = (np.array([0.0, 50.0]), 3.0, 1.0)
    result, counts = contact_equations.resolve_contacts(position, velocity, UNIT, sprocket=sprocket)
    assert counts == {"floor": 0, "sprocket": 1, "self": 0}
    assert_allclose(result[1], [-1.2, -3 + 1.2, -1.8], rtol=1e-12)
    _, counts = contact_equations.resolve_contacts(position, velocity, UNIT)
    assert counts["sprocket"] == 0


def test_two_links_by_hand():
    """Two falling links whose right circles meet centrally end with a common velocity there."""
    # Link 0 at the origin, flat, moving right with 2 m/s; link 2 folded back, right end 0.8 m to the right. P is
    # midway, n̂ = +x through both centres: W_nn = 2, J = 1.
    position, velocity = scattered_links(6)
    position[0] = [0.0, 50.0, 0.0]
    position[2] = [2.8, 50.0, np.pi]
    velocity[0] = [2.0, 0.0, 0.0]
    assert contact_equations.touching_pairs(position, UNIT) == [(0, 2)]
    result, counts = contact_equations.resolve_contacts(position, velocity, UNIT)
    assert counts == {"floor": 0, "sprocket": 0, "self": 1}
    assert_allclose(result[[0, 2]], [[1, 0, 0], [1, 0, 0]], atol=1e-12)
    _, counts = contact_equations.resolve_contacts(position, velocity, UNIT, self_contact=False)
    assert counts["self"] == 0


@pytest.mark.parametrize("kind", ["floor", "sprocket", "chain"])
def test_each_kind_of_contact_has_its_own_coefficients(kind):
    """An upright link that lands on its lower circle slides, or sticks, by the coefficients of what it lands on."""
    # Lever (0, −1.5): W_nn = 1, W_nt = 0, W_tt = 1 + 1.5² = 3.25. e = 0.3: J_n = 1.3·3 = 3.9. At 10 m/s it slides,
    # J_t = 3.9/4; at 0.5 m/s it sticks, J_t = (1 + e_t)·0.5/3.25. Landing on an equal link doubles W: half of both.
    parameters = UNIT.with_values({f"{kind}_restitution": 0.3, f"{kind}_friction": 0.25, "tangential_restitution": 0.5})
    height = {"floor": 1.5, "sprocket": 84.5, "chain": 103.0}[kind] - 1e-9
    share = 0.5 if kind == "chain" else 1.0
    for speed, pull in ((10.0, 3.9 / 4), (0.5, 1.5 * 0.5 / 3.25)):
        position, velocity = scattered_links(6)
        position[2], velocity[2] = [0.0, height, np.pi / 2], [speed, -3.0, 0.0]
        position[0] = [0.0, 100.0, np.pi / 2]
        sprocket = (np.array([0.0, 80.0]), 3.0, 0.0)
        result, counts = contact_equations.resolve_contacts(position, velocity, parameters, sprocket=sprocket)
        assert counts == {"floor": kind == "floor", "sprocket": kind == "sprocket", "self": kind == "chain"}
        assert_allclose(result[2, :2], [speed - share * pull, share * 3.9 - 3], atol=1e-7)
        assert_allclose(result[2, 2], -1.5 * share * pull, atol=1e-7)


def test_self_contacts_go_in_the_documented_order():
    """A heap of six links equals a hand-written list of joint pairs, resolved one by one, and order matters."""
    order = [(0, 2), (0, 4), (2, 4), (0, 1), (0, 3), (0, 5), (2, 3), (2, 5), (4, 5)]
    order += [(1, 2), (1, 4), (3, 4), (1, 3), (1, 5), (3, 5)]
    position, start = crumpled_chain(6, 16, UNIT.link_length, 0.3)

    def in_order(pairs):
        velocity, count = start.copy(), 0
        ends = {
            "left": motion_equations.link_ends(position, UNIT)[0],
            "right": motion_equations.link_ends(position, UNIT)[1],
        }
        for p, q in pairs:
            for a, end_a, b, end_b in [
                (p, "right", q, "right"),
                (p, "right", (q + 1) % 6, "left"),
                ((p + 1) % 6, "left", q, "right"),
                ((p + 1) % 6, "left", (q + 1) % 6, "left"),
            ]:
                gap = ends[end_b][b] - ends[end_a][a]
                if min(abs(a - b), 6 - abs(a - b)) < 2 or np.linalg.norm(gap) >= 2 * UNIT.circle_radius:
                    continue
                normal, point = gap / np.linalg.norm(gap), ends[end_a][a] + gap / 2
                arm_a, arm_b = point - position[a, :2], point - position[b, :2]
                v_a = velocity[a, :2] + velocity[a, 2] * np.array([-arm_a[1], arm_a[0]])
                v_b = velocity[b, :2] + velocity[b, 2] * np.array([-arm_b[1], arm_b[0]])
                j = contact_equations.collision_impulse(v_a - v_b, normal, arm_a, arm_b, *[1.0] * 4, 0.0, 1.0, 0.0)
                velocity[a] -= [*j, arm_a[0] * j[1] - arm_a[1] * j[0]]
                velocity[b] += [*j, arm_b[0] * j[1] - arm_b[1] * j[0]]
                count += bool(j.any())
        return velocity, count

    expected, count = in_order(order)
    result, counts = contact_equations.resolve_contacts(position, start, UNIT, floor=False)
    assert counts["self"] == count > 5
    assert_allclose(result, expected, rtol=1e-12, atol=1e-12)
    assert np.abs(in_order(sorted(order))[0] - expected).max() > 1e-3


@given(crumpled_chains())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_self_contacts_keep_momenta_and_never_raise_energy(heap):
    """In any heap, self-contacts keep linear and angular momentum, and kinetic energy doesn't rise."""
    n, seed, size = heap
    position, velocity = crumpled_chain(n, seed, PAPER.link_length, size)
    result, _ = contact_equations.resolve_contacts(position, velocity, PAPER, floor=False)
    momentum = motion_equations.linear_momentum(velocity, PAPER)
    assert_allclose(motion_equations.linear_momentum(result, PAPER), momentum, atol=1e-15)
    spin = motion_equations.angular_momentum(position, velocity, PAPER)
    assert_allclose(motion_equations.angular_momentum(position, result, PAPER), spin, atol=1e-17)
    energy = motion_equations.kinetic_energy(velocity, PAPER)
    assert motion_equations.kinetic_energy(result, PAPER) <= energy * (1 + 1e-14)


@given(crumpled_chains())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_touching_pairs_are_those_of_all_link_pairs(heap):
    """The joint pairs are those found by going over links and their ends instead of joints."""
    n, seed, size = heap
    position, _ = crumpled_chain(n, seed, PAPER.link_length, size)
    left, right = motion_equations.link_ends(position, PAPER)
    expected = set()
    for a in range(n):
        for b in range(n):
            if min((a - b) % n, (b - a) % n) >= 2:
                for joint_a, end_a in ((a, right[a]), ((a - 1) % n, left[a])):
                    for joint_b, end_b in ((b, right[b]), ((b - 1) % n, left[b])):
                        if np.linalg.norm(end_a - end_b) < 2 * PAPER.circle_radius:
                            expected.add((min(joint_a, joint_b), max(joint_a, joint_b)))
    assert contact_equations.touching_pairs(position, PAPER) == sorted(expected)
