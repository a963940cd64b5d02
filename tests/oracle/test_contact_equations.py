"""The NumPy reference of collisions against hand-worked numbers and the law's invariants."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import contact_equations, motion_equations
from tests.support.folded_chains import crumpled_chain
from tests.support.mild_parameters import UNIT
from tests.support.presets import PAPER

# Notation: n̂ from A to B, t̂ = ẑ × n̂, W, J₁, J₂ as in `collision_impulse`, D = J₂ − J₁, vectors in brackets are (n, t)
# components. A case is v_A − v_B, n̂, the levers of A and B, 1/m and 1/I of A, then of B.

# A ball of 2 kg hits the floor with (3, −4) m/s, no lever: v = (4, 3), W = 1/2, J₁ = 8 n̂, J₂ = [8, 6], D = [0, 6].
# n̂ = +y, so t̂ = −x: world = (−J_t, J_n). e = 0.5: J_n = 12.
BALL = ((-3.0, 4.0), (0.0, 1.0), (0.0, 0.0), (0.0, 0.0), 0.0, 0.0, 0.5, 2.0)
# A body with m = I = 1 falls with 3 m/s onto the floor, P at (1, −1) from its centre: r × n̂ = 1, r × t̂ = −1,
# W = [2 −1; −1 2], det 3, v = [3, 0], J₁ = 3/2 n̂, J₂ = [2, 1], D = [1/2, 1].
CORNER = ((0.0, 3.0), (0.0, 1.0), (0.0, 0.0), (1.0, -1.0), 0.0, 0.0, 1.0, 1.0)
# Two bodies, n̂ = +x: m_A = I_A = m_B = 1, I_B = 1/2, levers (1, 1) and (−1, 0): r_A × n̂ = −1, r_A × t̂ = 1, r_B × n̂ = 0,
# r_B × t̂ = −1, W = [3 −1; −1 5], det 14. v = [6, 12]: J₁ = 2 n̂, J₂ = (1/14)[5·6 + 12, 6 + 3·12] = [3, 3], D = [1, 3].
PAIR = ((6.0, 12.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 0.0), 1.0, 1.0, 1.0, 2.0)
# PAIR turned by the angle whose cosine and sine are 0.6 and 0.8: world = (0.6 J_n − 0.8 J_t, 0.8 J_n + 0.6 J_t).
TURNED = ((-6.0, 12.0), (0.6, 0.8), (-0.2, 1.4), (-0.6, -0.8), *PAIR[4:])


def scattered_links(n: int):
    """n links far apart in the air, at rest."""
    position = np.column_stack([10.0 * np.arange(n), np.full(n, 100.0), np.zeros(n)])
    return position, np.zeros((n, 3))


# --- the law of one collision ---


@pytest.mark.parametrize(
    ("case", "law", "expected"),
    [
        # J^(a) = [12, 6] needs μ ≥ 1/2. μ = 1/4: κ = (1/4)·12/6 = 1/2, J = [12, 3].
        (BALL, (0.5, 0.25, 0.0), (-3.0, 12.0)),
        (BALL, (0.5, 1.0, 0.0), (-6.0, 12.0)),
        # J^(a) = 3/2 n̂ + D = [2, 1].
        (CORNER, (0.0, 1.0, 0.0), (-1.0, 2.0)),
        # μ = 1/4: κ = (1/4)(3/2)/(1 − (1/4)(1/2)) = 3/7, J = [3/2 + 3/14, 3/7] = [12/7, 3/7].
        (CORNER, (0.0, 0.25, 0.0), (-3 / 7, 12 / 7)),
        # (1 + e) J₁ = 3 n̂. J^(a) = [4, 3].
        (PAIR, (0.5, 1.0, 0.0), (4.0, 3.0)),
        (TURNED, (0.5, 1.0, 0.0), (0.0, 5.0)),
        # μ = 1/2 < 3/4: κ = (1/2)·3/(3 − 1/2) = 3/5, J = [3.6, 1.8].
        (PAIR, (0.5, 0.5, 0.0), (3.6, 1.8)),
        # e_t = 1: J^(a) = [5, 6] is beyond μ = 1: κ = 3/(3 − 1) = 3/2, J = [4.5, 4.5].
        (PAIR, (0.5, 1.0, 1.0), (4.5, 4.5)),
        # separating and grazing
        (((-1e-9, 12.0), *PAIR[1:]), (0.5, 1.0, 0.0), (0.0, 0.0)),
        (((0.0, 12.0), *PAIR[1:]), (0.5, 1.0, 0.0), (0.0, 0.0)),
    ],
)
def test_impulse_by_hand(case, law, expected):
    """Impulses worked out by hand."""
    impulse = contact_equations.collision_impulse(*map(np.array, case[:4]), *case[4:], *law)
    assert_allclose(impulse, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("seed", range(20))
def test_impulse_obeys_the_law(seed):
    """Any approaching collision: v'_n = −e v_n, |J_t| ≤ μ J_n, and kinetic energy never rises.

    Levers reach four radii of gyration, so W is anything from round to far from it, and sliding can jam.
    """
    generator = np.random.default_rng(seed)
    for _ in range(25):
        mass, gyration = np.exp(generator.uniform(np.log(1e-3), 0, (2, 2)))
        levers = gyration[:, None] * generator.uniform(-4, 4, (2, 2))
        inverse_mass, inverse_inertia = np.array([1 / mass, 1 / (mass * gyration**2)]) * generator.choice(
            [(1, 1), (1, 1), (0, 1), (1, 0)]
        )
        direction, across = generator.uniform(-np.pi, np.pi), generator.uniform(-1.57, 1.57)
        normal = np.array([np.cos(direction), np.sin(direction)])
        v = np.exp(generator.uniform(np.log(1e-3), np.log(10))) * np.array(
            [np.cos(direction + across), np.sin(direction + across)]
        )
        restitution, friction = generator.choice([0.0, 1.0, generator.uniform()], 2)
        tangential = generator.choice([-1.0, 0.0, 1.0, generator.uniform(-1, 1)])
        bodies = [each for pair in zip(inverse_mass, inverse_inertia, strict=True) for each in pair]
        impulse = contact_equations.collision_impulse(v, normal, *levers, *bodies, restitution, friction, tangential)
        after = v.copy()  # from each body's own equations: B gets the impulse, A its opposite
        for lever, by_mass, by_inertia in zip(levers, inverse_mass, inverse_inertia, strict=True):
            spin = by_inertia * motion_equations.cross(lever, impulse)
            after -= by_mass * impulse + spin * np.array([-lever[1], lever[0]])
        stiffness = inverse_mass.sum() + inverse_inertia @ np.sum(levers**2, axis=1)
        size = np.linalg.norm(impulse)
        speed, push = np.linalg.norm(v) + stiffness * size, normal @ impulse
        assert push > 0 and abs(normal @ after + restitution * (normal @ v)) <= 1e-12 * speed
        assert np.linalg.norm(impulse - push * normal) <= friction * push + 1e-12 * size
        assert impulse @ (v + after) >= -1e-12 * size * speed


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


@pytest.mark.parametrize("seed", range(60))
def test_self_contacts_keep_momenta_and_never_raise_energy(seed):
    """In any heap, from dense to sparse ones, self-contacts keep both momenta, and kinetic energy doesn't rise."""
    position, velocity = crumpled_chain((4, 6, 8, 12)[seed % 4], seed, PAPER.link_length, 0.3 + seed / 20)
    result, _ = contact_equations.resolve_contacts(position, velocity, PAPER, floor=False)
    momentum = motion_equations.linear_momentum(velocity, PAPER)
    assert_allclose(motion_equations.linear_momentum(result, PAPER), momentum, atol=1e-15)
    spin = motion_equations.angular_momentum(position, velocity, PAPER)
    assert_allclose(motion_equations.angular_momentum(position, result, PAPER), spin, atol=1e-17)
    energy = motion_equations.kinetic_energy(velocity, PAPER)
    assert motion_equations.kinetic_energy(result, PAPER) <= energy * (1 + 1e-14)
