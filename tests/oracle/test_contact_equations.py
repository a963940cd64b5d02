"""The NumPy reference of collisions against hand-worked numbers and the law's invariants."""

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.testing import assert_allclose

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
@settings(max_examples=300, deadline=None, derandomize=True)
def test_impulse_obeys_the_law(collision: Collision):
    """Any approaching collision: v'_n = −e v_n, |J_t| ≤ μ J_n, and kinetic energy never rises."""
    assert law_violations(collision, contact_equations.collision_impulse(*collision.arguments())) == []


# --- contacts of a chain ---


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
