"""The kernels' impulse law: by hand, what holds for all collisions, agreement with the reference."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.support.impulse_cases import BALL, HAND_CASES, Collision
from tests.support.kernels_under_test import fixed_contacts, link_pairs
from warpchain.oracle import contact_equations

RADIUS = 0.1
DISTANCE = 0.15
"""Circles of two links overlap by 2 · RADIUS − DISTANCE."""


def approaches(collision):
    """Whether the bodies of a collision approach."""
    return np.dot(collision.v_rel, collision.normal) > 0


def movable_floor_cases():
    """Hand-worked cases, by name, in which A is immovable."""
    return [name for name, (collision, _) in HAND_CASES.items() if collision.inv_mass_a == 0]


def random_collisions(count, seed, *, fixed=False):
    """Approaching collisions of bodies of 1 g to 1 kg; with `fixed`, A is immovable."""
    generator = np.random.default_rng(seed)
    cases = []
    for _ in range(count):
        angle = generator.uniform(-np.pi, np.pi)
        direction = angle + generator.uniform(-1.57, 1.57)
        speed = np.exp(generator.uniform(np.log(1e-3), np.log(10)))
        mass, gyration = np.exp(generator.uniform(np.log(1e-3), 0, (2, 2)))
        levers = gyration[:, None] * generator.uniform(-4, 4, (2, 2))
        inverses = np.column_stack([1 / mass, 1 / (mass * gyration**2)])
        if fixed:
            inverses[0] = 0
        restitution, friction = np.clip(generator.uniform(-0.2, 1.2, 2), 0, 1)
        cases.append(
            Collision(
                (speed * np.cos(direction), speed * np.sin(direction)),
                (np.cos(angle), np.sin(angle)),
                *map(tuple, levers.tolist()),
                *inverses.ravel().tolist(),
                restitution,
                friction,
                np.clip(generator.uniform(-1.5, 1.5), -1, 1),
            )
        )
    return cases


def spin_velocity(omega, lever):
    """ω ẑ × lever."""
    return omega[..., None] * np.stack([-lever[..., 1], lever[..., 0]], axis=-1)


class Pairs:
    """Collisions set up as two links with overlapping circles, somewhere and drifting, and resolved.

    Attributes hold one row per collision; axis 1 of position and velocity is the body, A or B.
    """

    def __init__(self, cases, seed=0, distance=DISTANCE, push_rate=0.0):
        """Set up and resolve; `push_rate` is that of `Chain`."""
        generator = np.random.default_rng(seed)
        count = len(cases)
        self.normal = np.array([collision.normal for collision in cases])
        v_rel = np.array([collision.v_rel for collision in cases])
        scale = np.linalg.norm(v_rel, axis=1, keepdims=True)
        self.lever = np.array([[collision.lever_a, collision.lever_b] for collision in cases])
        self.point = generator.uniform(-1, 1, (count, 2))
        self.position = self.point[:, None] - self.lever
        # B has any velocity, A one that gives the relative velocity at P
        size = np.linalg.norm(self.lever, axis=2) + 1e-3
        self.velocity = np.empty((count, 2, 3))
        self.velocity[:, :, 2] = generator.normal(size=(count, 2)) * scale / size
        self.velocity[:, 1, :2] = generator.normal(size=(count, 2)) * scale
        spins = spin_velocity(self.velocity[:, :, 2], self.lever)
        self.velocity[:, 0, :2] = v_rel + self.velocity[:, 1, :2] + spins[:, 1] - spins[:, 0]
        inverses = np.array([[[c.inv_mass_a, c.inv_inertia_a], [c.inv_mass_b, c.inv_inertia_b]] for c in cases])
        self.inverses = inverses
        self.e, self.mu, self.e_t = np.array([[c.restitution, c.friction, c.tangential_restitution] for c in cases]).T
        ends = self.point[:, None] + np.array([-0.5, 0.5])[:, None] * distance * self.normal[:, None]
        law = np.column_stack([np.full(count, RADIUS), self.e, self.mu, self.e_t])
        after, results = link_pairs(
            self.position,
            self.velocity,
            inverses,
            np.hstack([law, ends.reshape(count, 4)]),
            push_rate,
        )
        self.after = after
        self.depth, self.lost, self.hits = results.T

    def relative(self, velocity):
        """v_A − v_B at P, in the basis n̂, t̂."""
        at_point = velocity[:, :, :2] + spin_velocity(velocity[:, :, 2], self.lever)
        v = at_point[:, 0] - at_point[:, 1]
        tangent = np.column_stack([-self.normal[:, 1], self.normal[:, 0]])
        return np.column_stack([np.sum(v * self.normal, axis=1), np.sum(v * tangent, axis=1)])

    def speed(self):
        """The greatest speed that enters, for the size of rounding errors."""
        turning = np.abs(np.stack([self.velocity, self.after])[..., 2]) * np.linalg.norm(self.lever, axis=2)
        moving = np.linalg.norm(np.stack([self.velocity, self.after])[..., :2], axis=-1)
        return (turning + moving).max(axis=(0, 2))

    def impulse(self):
        """Change of B's momentum, or less A's where B is immovable."""
        change = self.after[:, :, :2] - self.velocity[:, :, :2]
        with np.errstate(divide="ignore", invalid="ignore"):
            momenta = change / self.inverses[:, :, :1]
        return np.where(self.inverses[:, 1, :1] > 0, momenta[:, 1], -momenta[:, 0])

    def energy(self, velocity):
        """Kinetic energy of both bodies."""
        mass, inertia = 1 / self.inverses[:, :, 0], 1 / self.inverses[:, :, 1]
        return np.sum(mass * np.sum(velocity[:, :, :2] ** 2, axis=2) + inertia * velocity[:, :, 2] ** 2, axis=1) / 2


def fixed_arguments(collision, velocity, surface, gap=-1e-3):
    """Arguments of `fixed_contact` for link B, and e_t."""
    inverses = (collision.inv_mass_b, collision.inv_inertia_b)
    law = (collision.restitution, collision.friction)
    levers = (*collision.normal, *collision.lever_b)
    return [gap, *levers, *surface, *inverses, *law, *velocity, collision.tangential_restitution]


class Fixed:
    """Collisions whose body A is immovable, resolved by `fixed_contact` with surfaces that move as given."""

    def __init__(self, cases, surface_speed=1.0, seed=0, gap=-1e-3):
        """Set up and resolve; the surface moves with `surface_speed` times the approaching speed."""
        generator = np.random.default_rng(seed)
        count = len(cases)
        v_rel = np.array([collision.v_rel for collision in cases])
        scale = np.linalg.norm(v_rel, axis=1)
        self.normal = np.array([collision.normal for collision in cases])
        self.lever = np.array([collision.lever_b for collision in cases])
        self.surface = surface_speed * scale[:, None] * generator.normal(size=(count, 2))
        self.velocity = np.empty((count, 3))
        self.velocity[:, 2] = generator.normal(size=count) * scale / (np.linalg.norm(self.lever, axis=1) + 1e-3)
        self.velocity[:, :2] = self.surface - v_rel - spin_velocity(self.velocity[:, 2], self.lever)
        self.inverses = np.array([[c.inv_mass_b, c.inv_inertia_b] for c in cases])
        arguments = zip(cases, self.velocity.tolist(), self.surface.tolist(), strict=True)
        results = fixed_contacts(np.array([fixed_arguments(*each, gap) for each in arguments]))
        self.after, self.lost, self.hits = results[:, :3], results[:, 3], results[:, 4]

    def impulse(self):
        """Change of the link's momentum."""
        return (self.after - self.velocity)[:, :2] / self.inverses[:, :1]

    def relative(self, velocity):
        """Velocity of the surface less that of the link at P, (N, 2)."""
        return self.surface - velocity[:, :2] - spin_velocity(velocity[:, 2], self.lever)

    def energy(self, velocity):
        """Kinetic energy of the link."""
        return (np.sum(velocity[:, :2] ** 2, axis=1) / self.inverses[:, 0]) / 2 + velocity[:, 2] ** 2 / self.inverses[
            :, 1
        ] / 2

    def speed(self):
        """The greatest speed that enters, for the size of rounding errors."""
        rates = np.stack([self.velocity, self.after])
        moving = np.linalg.norm(rates[..., :2], axis=-1)
        turning = np.abs(rates[..., 2]) * np.linalg.norm(self.lever, axis=1)
        return (moving + turning).max(axis=0) + np.linalg.norm(self.surface, axis=1)


def assert_reference_impulses(contact, cases):
    """Each contact is hit once, with the reference's impulse to 1e-12 of what enters."""
    expected = np.array([contact_equations.collision_impulse(*collision.arguments()) for collision in cases])
    # an impulse is seen as a change of a velocity, hence to the rounding error of that
    heaviest = np.array([1 / (collision.inv_mass_b or collision.inv_mass_a) for collision in cases])
    error = np.linalg.norm(contact.impulse() - expected, axis=1)
    assert np.all(error <= 1e-12 * (np.linalg.norm(expected, axis=1) + heaviest * contact.speed()))
    assert np.all(contact.hits == 1)


MANY = random_collisions(10_000, 1)
MANY_FIXED = random_collisions(10_000, 2, fixed=True)


@pytest.fixture(scope="module")
def pairs():
    """Ten thousand random collisions of two links."""
    return Pairs(MANY)


@pytest.fixture(scope="module")
def fixed():
    """Ten thousand random collisions with a moving surface."""
    return Fixed(MANY_FIXED)


# --- hand-worked cases ---


@pytest.mark.parametrize("name", HAND_CASES)
def test_two_links_by_hand(name):
    """Two links get the hand-worked impulse and its opposite, separating ones none."""
    collision, expected = HAND_CASES[name]
    pair = Pairs([collision])
    assert_allclose(pair.impulse()[0], expected, atol=1e-13)
    change = pair.after - pair.velocity
    for body, sign in ((0, -1), (1, 1)):
        lever = pair.lever[0, body]
        turning = sign * (lever[0] * expected[1] - lever[1] * expected[0]) * pair.inverses[0, body, 1]
        assert_allclose(change[0, body, 2], turning, atol=1e-13)
        assert_allclose(change[0, body, :2], sign * np.array(expected) * pair.inverses[0, body, 0], atol=1e-13)
    assert pair.hits[0] == approaches(collision)
    assert pair.depth[0] == pytest.approx(2 * RADIUS - DISTANCE, rel=1e-14)


@pytest.mark.parametrize("name", movable_floor_cases())
def test_link_on_surface_by_hand(name):
    """A link that meets an immovable body, at rest or moving, gets the hand-worked impulse."""
    collision, expected = HAND_CASES[name]
    for surface_speed in (0.0, 1.0):
        contact = Fixed([collision], surface_speed)
        assert_allclose(contact.impulse()[0], expected, atol=1e-13)
        lever = collision.lever_b
        turning = (lever[0] * expected[1] - lever[1] * expected[0]) * collision.inv_inertia_b
        assert_allclose(contact.after[0, 2] - contact.velocity[0, 2], turning, atol=1e-13)
        assert contact.hits[0] == 1


def test_loss_of_a_ball_by_hand():
    """A ball of 2 kg that falls with (3, −4) m/s and leaves with (0, 2) m/s loses 25 − 4 J."""
    contact = Fixed([replace(BALL, friction=1.0)], surface_speed=0.0)
    spinless = fixed_contacts(np.array([fixed_arguments(replace(BALL, friction=1.0), (3.0, -4.0, 0.0), (0.0, 0.0))]))
    assert_allclose(spinless[0], [0.0, 2.0, 0.0, 21.0, 1.0], atol=1e-14)
    assert contact.lost[0] == pytest.approx(21.0, rel=1e-14)


# --- what soft joints press into each other ---


@pytest.mark.parametrize("sign", [1, -1])
def test_overlapping_links_part_as_fast_as_they_are_pushed(sign):
    """Links that part more slowly than push_rate times their depth meet as if they approached by so much faster."""
    push_rate = 20.0
    cases = [replace(c, v_rel=(sign * c.v_rel[0], sign * c.v_rel[1])) for c in MANY[:2000]]
    pair = Pairs(cases, push_rate=push_rate)
    push = push_rate * pair.depth
    before, after = pair.relative(pair.velocity)[:, 0], pair.relative(pair.after)[:, 0]
    meets = before + push > 0
    assert_array_equal(pair.hits > 0, meets)
    assert meets.sum() > 500
    expected = np.where(meets, -pair.e * (before + push) - push, before)
    assert_allclose((after - expected) / (pair.speed() + push), 0, atol=1e-9)
    before, after = pair.energy(pair.velocity), pair.energy(pair.after)
    assert_allclose((before - after - pair.lost) / (before + after), 0, atol=1e-9)


# --- what is left alone ---


def test_separating_links_keep_their_velocities():
    """Overlapping circles that separate or graze keep their velocities to the bit, and lose no energy."""
    cases = [replace(c, v_rel=(-c.v_rel[0], -c.v_rel[1])) for c in MANY[:1000]]
    pair = Pairs(cases)
    assert_array_equal(pair.after, pair.velocity)
    assert not pair.hits.any() and not pair.lost.any()
    assert_allclose(pair.depth, 2 * RADIUS - DISTANCE, rtol=1e-13)
    contact = Fixed([replace(c, v_rel=(-c.v_rel[0], -c.v_rel[1])) for c in MANY_FIXED[:1000]])
    assert_array_equal(contact.after, contact.velocity)
    assert not contact.hits.any() and not contact.lost.any()


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


@pytest.mark.parametrize("gap", [0.0, 1e-300, 1e-3])
def test_link_above_surface_keeps_its_velocity(gap):
    """A circle that approaches a surface but does not overlap it keeps its velocity to the bit."""
    contact = Fixed(MANY_FIXED[:100], gap=gap)
    assert_array_equal(contact.after, contact.velocity)
    assert not contact.hits.any() and not contact.lost.any()


# --- laws that hold for all collisions ---


def test_links_agree_with_reference(pairs, fixed):
    """Two links, and a link on a surface, get the reference's impulse, to 1e-12 of all that enters."""
    assert_reference_impulses(pairs, MANY)
    assert_reference_impulses(fixed, MANY_FIXED)


def test_normal_restitution(pairs, fixed):
    """The normal relative velocity afterwards is −e times the one before."""
    before, after = pairs.relative(pairs.velocity), pairs.relative(pairs.after)
    assert_allclose((after[:, 0] + pairs.e * before[:, 0]) / pairs.speed(), 0, atol=1e-12)
    before, after = (np.sum(fixed.relative(v) * fixed.normal, axis=1) for v in (fixed.velocity, fixed.after))
    e = np.array([collision.restitution for collision in MANY_FIXED])
    assert_allclose((after + e * before) / fixed.speed(), 0, atol=1e-12)


def test_friction_cone(pairs):
    """|J_t| ≤ μ J_n always; some collisions stick inside the cone and some slide on its surface."""
    impulse = pairs.impulse()
    normal = np.sum(impulse * pairs.normal, axis=1)
    across = np.abs(pairs.normal[:, 0] * impulse[:, 1] - pairs.normal[:, 1] * impulse[:, 0])
    rounding = 1e-12 * pairs.speed() / pairs.inverses[:, 1, 0]
    assert np.all(normal > 0)
    assert np.all(across <= pairs.mu * normal + rounding)
    assert 1000 < np.count_nonzero(across > pairs.mu * normal - rounding) < 9000


def test_momenta_are_kept(pairs):
    """Two links keep their momentum, and their angular momentum about the origin."""
    mass, inertia = 1 / pairs.inverses[:, :, 0], 1 / pairs.inverses[:, :, 1]

    def momenta(velocity):
        linear = mass[:, :, None] * velocity[:, :, :2]
        orbital = pairs.position[:, :, 0] * linear[:, :, 1] - pairs.position[:, :, 1] * linear[:, :, 0]
        return np.sum(linear, axis=1), np.sum(orbital + inertia * velocity[:, :, 2], axis=1)

    before, after = momenta(pairs.velocity), momenta(pairs.after)
    scale = mass.sum(axis=1) * pairs.speed()
    assert_allclose((after[0] - before[0]) / scale[:, None], 0, atol=1e-13)
    reach = 1 + np.linalg.norm(pairs.lever, axis=2).max(axis=1)
    assert_allclose((after[1] - before[1]) / (scale * reach), 0, atol=1e-12)


def test_loss_is_change_of_kinetic_energy(pairs, fixed):
    """The loss returned is the change of kinetic energy; unless the surface moves, it is never negative."""
    for contact in (pairs, fixed):
        before, after = contact.energy(contact.velocity), contact.energy(contact.after)
        assert_allclose((before - after - contact.lost) / (before + after), 0, atol=1e-12)
    assert np.all(pairs.lost >= -1e-12 * pairs.energy(pairs.velocity))
    assert np.any(fixed.lost < -1e-3 * fixed.energy(fixed.velocity))
    at_rest = Fixed(MANY_FIXED, surface_speed=0.0)
    assert np.all(at_rest.lost >= -1e-12 * at_rest.energy(at_rest.velocity))
