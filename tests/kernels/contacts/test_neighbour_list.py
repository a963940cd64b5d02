"""The neighbour list: no contact is missed, whatever the heap, and no run depends on how long a list lasts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import warpchain
from tests.oracle_model import contact_equations, motion_equations
from tests.oracle_model.circular_loop import circular_loop
from tests.support.blocks_under_test import listed_pairs
from tests.support.folded_chains import chain_of_angles, folded_chain
from tests.support.kernels_under_test import FAR, LIST, SELF, ContactPass, Placed
from tests.support.presets import PAPER, SOFT
from warpchain import Status
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options

LENGTH = PAPER.link_length
SKIN = 2e-3


def straight_heap(n, angle):
    """A chain drawn out and back along a line, with every fifth link or so turned round: joints share spots."""
    generator = np.random.default_rng(n)
    half = generator.choice([0.0, np.pi], n // 2, p=[0.8, 0.2])
    return chain_of_angles(np.concatenate([half, generator.permutation(half) + np.pi]) + angle, LENGTH)


STATES = {
    "loop": lambda n: circular_loop(n, PAPER, 0.0)[0],
    "doubled line": lambda n: chain_of_angles(np.repeat([0.3, 0.3 + np.pi], n // 2), LENGTH),
    "collinear": lambda n: straight_heap(n, 0.0),
    "collinear, upright": lambda n: straight_heap(n, np.pi / 2),
    "flat pile": lambda n: folded_chain(n, n, LENGTH, tilt=0.1)[0],
    "torn": lambda n: folded_chain(n, n, LENGTH, opening=1e-3)[0],
}
PLACES = ((0.0, 0.0), (-3.7, -0.9), (-120.0, 40.0), (1e5, -2e5))


def assert_collides_as_reference(position, seed, skin=SKIN):
    """A pass over self-contacts leaves the velocities and the number of impulses of all pairs tried; that number.

    Circles that all but share a centre have a normal of rounding errors, so joints must be open.
    """
    velocity = np.random.default_rng(seed).normal(size=position.shape) * [1.0, 1.0, 2 / LENGTH]
    expected, counts = contact_equations.resolve_contacts(position, velocity, PAPER, floor=False)
    for far in (0, FAR):
        contact_pass = ContactPass([Placed(position, velocity, PAPER)], skin=skin)
        (result,) = contact_pass.run(LIST | SELF | far)
        assert result["fits"]
        assert result["self"] == counts["self"]
        assert_allclose(contact_pass.velocity(0), expected, rtol=0, atol=1e-7 * np.abs(velocity).max())
    return counts["self"]


@pytest.mark.parametrize("state", STATES)
def test_no_contact_is_missed(state):
    """Chains collide as if every pair were tried, in the documented order, wherever they lie."""
    hits = [
        assert_collides_as_reference(STATES[state](n) + np.array([*place, 0.0]), n)
        for n, place in zip((4, 6, 20, 60), PLACES, strict=True)
    ]
    assert sum(hits) > 10 or state == "loop"


@given(
    n=st.integers(2, 20).map(lambda half: 2 * half),
    seed=st.integers(0, 2**32 - 1),
    tilt=st.floats(0.1, 3.2),
    skin=st.floats(1e-6, 8e-3),
    opening=st.sampled_from([1e-5, 2e-4]),
    place=st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
@settings(max_examples=40, deadline=None, derandomize=True)
def test_no_heap_misses_a_contact(n, seed, tilt, skin, opening, place):
    """Hypothesis finds no heap that collides otherwise than if every pair were tried."""
    assert_collides_as_reference(
        folded_chain(n, seed, LENGTH, tilt=tilt, opening=opening)[0] + [*place, 0.0], seed, skin
    )


@pytest.mark.parametrize("far", [0, FAR])
@pytest.mark.parametrize("n", [6, 24, 60])
def test_slack_is_that_of_the_nearest_pair_that_is_not_listed(n, far):
    """All pairs within the reach are listed; joints may move by half of what the nearest other one is apart, less r."""
    position, velocity = folded_chain(n, n, LENGTH, opening=1e-6)
    contact_pass = ContactPass([Placed(position, velocity, PAPER)], skin=SKIN)
    (result,) = contact_pass.run(LIST | far)
    joints = motion_equations.link_ends(position, PAPER)[1]
    distance = np.linalg.norm(joints[:, None] - joints, axis=2)
    p, q = np.triu_indices(n, 2)
    p, q = p[q - p < n - 1], q[q - p < n - 1]  # links keep the others apart
    is_near = distance[p, q] < 2 * (PAPER.circle_radius + result["opening"]) + SKIN
    assert listed_pairs(contact_pass) == set(zip(p[is_near].tolist(), q[is_near].tolist(), strict=True))
    width = 2 * LENGTH if far else 2 * (PAPER.circle_radius + result["opening"]) + SKIN
    nearest = min(width, distance[p, q][~is_near].min())
    assert result["slack"] == pytest.approx(nearest / 2 - PAPER.circle_radius - result["opening"], abs=1e-8)


def test_list_of_a_wide_loop_lasts_longer():
    """A chain far from itself may move by millimetres: half of what next joints but one are apart, less a radius."""
    chain = Placed(*circular_loop(60, PAPER, 0.0), PAPER)
    slack = {far: ContactPass([chain], skin=SKIN).run(LIST | far)[0]["slack"] for far in (0, FAR)}
    assert slack[0] == pytest.approx(SKIN / 2, rel=1e-6)
    assert slack[FAR] == pytest.approx(LENGTH * np.cos(np.pi / 60) - PAPER.circle_radius, rel=1e-3)


# --- whole runs ---


def run_pile(parameters, position, velocity, duration, *, poison=False, **settings):
    """A run on the floor through `Batch`: final state (n, 6), counts, losses and extremes."""
    n = len(position)
    batch = Batch(1, n, Options(method="bs32", **settings))
    batch.worlds[0].set_chain(parameters, n)
    batch.worlds[0].load(position, velocity, stop_time=duration, stop_status=Status.FINISHED)
    if poison:
        batch.scratch.fill_(np.nan)
        batch.lists.fill_(2**30)
    batch.run([0], batch.features(fixed_body="floor"))
    assert batch.worlds[0].status == Status.FINISHED
    state = np.hstack([batch.worlds[0].position, batch.worlds[0].velocity])
    return state, batch.worlds[0].counts, batch.worlds[0].losses, batch.worlds[0].extremes


def assert_same_run(run, other):
    """Two runs agree to the bit in all but the number of lists made."""
    assert_array_equal(run[0], other[0])
    for mine, others in zip(run[1:], other[1:], strict=True):
        assert {k: v for k, v in mine.items() if k != "list_builds"} == {
            k: v for k, v in others.items() if k != "list_builds"
        }


def test_skin_changes_no_bit():
    """Where the steps are short anyway, a run does not depend on the skin: no list was ever incomplete."""
    position, velocity = folded_chain(40, 3, LENGTH, opening=1e-8)
    runs = [run_pile(PAPER, position, velocity, 1e-3, skin=skin) for skin in (2e-4, 2e-3, 8e-3)]
    builds = [counts["list_builds"] for _, counts, _, _ in runs]
    assert builds[0] > builds[1] > builds[2]
    assert runs[0][1]["self"] > 100
    for run in runs[1:]:
        assert_same_run(runs[0], run)


def test_run_reads_nothing_it_has_not_written():
    """A run on poisoned scratch and list memory ends in the same bits."""
    position, velocity = folded_chain(20, 4, LENGTH, opening=1e-6)
    clean, poisoned = (run_pile(SOFT, position, velocity, 1e-3, poison=poison) for poison in (False, True))
    assert clean[1]["self"] > 10
    assert_same_run(clean, poisoned)


def flattening_hexagon(lean, rate):
    """Six links: top and bottom lie flat, the sides bend outwards and fold, so that top and bottom meet."""
    angle = np.array([0.0, -lean, np.pi + lean, np.pi, np.pi - lean, lean])
    turn = -rate * np.array([0.0, -1.0, 1.0, 0.0, -1.0, 1.0])
    position = chain_of_angles(angle, LENGTH)
    step = LENGTH * turn[:, None] * np.column_stack([-np.sin(angle), np.cos(angle)])
    velocity = np.column_stack([np.cumsum(step, axis=0) - step / 2, turn])
    return position, velocity - [*velocity[:, :2].mean(axis=0), 0.0]


@pytest.mark.parametrize("lean", [0.24, 0.3, 0.38])
def test_depth_of_self_contacts_is_bounded_by_the_contact_step(lean):
    """However far a list's skin is used up, two circles sink in by no more than their way in a contact step."""
    limber = SOFT.with_values(
        {
            **{"joint_stiffness": 2e5, "joint_damping": 0.0, "circle_radius": 2e-3},
            **{"viscous_friction": 0.0, "coulomb_friction": 0.0, "friction_smoothing": 1.0},
        }
    )
    rate = 150.0
    position, velocity = flattening_hexagon(lean, rate)
    assert contact_equations.touching_pairs(position, limber) == []
    position[:, 1] += 0.5
    run = {"gravity": False, "tolerance": 1e-3, "method": "rkf78", "precision": "double", "contact_step": 2e-5}
    trajectory = warpchain.simulate(limber, position, velocity, 0.42 / rate, times=[0.0], **run)
    assert trajectory.status == Status.FINISHED
    assert trajectory.impulses["self"] > 0
    approach = 2 * LENGTH * rate
    assert trajectory.greatest_penetration["self"] < 1.5 * approach * 2e-5
