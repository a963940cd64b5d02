"""The neighbour list: what it holds, in which order, for how long, and what happens when it is full."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import warpchain
from tests.oracle_model import contact_equations, motion_equations
from tests.oracle_model.circular_loop import circular_loop
from tests.support.folded_chains import chain_of_angles, folded_chain
from tests.support.kernels_under_test import LIST, SELF, ContactPass, Placed
from warpchain import Status
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.kernels.contacts.list_layout import list_layout

PAPER = preset("paper")
SOFT = preset("soft")
LENGTH = PAPER.link_length
SKIN = 2e-3


def at_rest(position):
    """A chain without motion, of Table 1's links."""
    return Placed(position, np.zeros_like(position), PAPER)


def pairs_within_reach(position, skin):
    """Pairs of joints (right ends) closer than 2r + skin + 2|C|, by trying all, in the documented order."""
    joints = motion_equations.link_ends(position, PAPER)[1]
    opening = np.linalg.norm(motion_equations.joint_opening(position, PAPER), axis=1).max()
    gaps = joints[:, None] - joints[None]
    near = np.linalg.norm(gaps, axis=2) < 2 * PAPER.circle_radius + skin + 2 * opening
    return sorted(map(tuple, np.argwhere(np.triu(near, 1)).tolist()), key=contact_equations.self_contact_order)


def touching_of(pairs, position):
    """Those of some joint pairs at which circles of two links overlap, sorted."""
    n = len(position)
    left, right = motion_equations.link_ends(position, PAPER)
    circles = [((j, right[j]), ((j + 1) % n, left[(j + 1) % n])) for j in range(n)]
    touching = [
        (p, q)
        for p, q in pairs
        for a, centre_a in circles[p]
        for b, centre_b in circles[q]
        if 2 <= (b - a) % n <= n - 2 and np.hypot(*(centre_b - centre_a)) < 2 * PAPER.circle_radius
    ]
    return sorted(set(touching))


def doubled_line(n, angle=0.3):
    """A chain drawn straight: n/2 links out, n/2 back over them."""
    return chain_of_angles(np.repeat([angle, angle + np.pi], n // 2), LENGTH)


def straight_heap(n, angle):
    """A chain drawn out and back along a line, with every fifth link or so turned round: joints share spots."""
    generator = np.random.default_rng(n)
    half = generator.choice([0.0, np.pi], n // 2, p=[0.8, 0.2])
    return chain_of_angles(np.concatenate([half, generator.permutation(half) + np.pi]) + angle, LENGTH)


LENGTHS = (4, 6, 8, 20, 60, 150, 1000)
STATES = {
    "loop": lambda n: circular_loop(n, PAPER, 0.0)[0],
    "crumpled": lambda n: folded_chain(n, n, LENGTH)[0],
    "flat pile": lambda n: folded_chain(n, n, LENGTH, tilt=0.1 if n <= 60 else 0.6)[0],
    "doubled line": doubled_line,
    "collinear": lambda n: straight_heap(n, 0.0),
    "collinear, upright": lambda n: straight_heap(n, np.pi / 2),
    "closed joints": lambda n: folded_chain(n, n, LENGTH, opening=0.0)[0],
}
PLACES = ((0.0, 0.0), (-3.7, -0.9), (-120.0, 40.0), (1e5, -2e5))


# --- what the list holds ---


@pytest.mark.parametrize("state", STATES)
def test_list_holds_the_pairs_within_reach(state):
    """It holds all pairs within reach and no others, in the documented order, wherever the chain lies."""
    for lengths, places in itertools.product((LENGTHS[:-1], LENGTHS[-1:]), PLACES):
        positions = [STATES[state](n) + np.array([*places, 0.0]) for n in lengths]
        contact_pass = ContactPass([at_rest(position) for position in positions], skin=SKIN)
        for world, (position, result) in enumerate(zip(positions, contact_pass.run(LIST), strict=True)):
            assert result["fits"]
            assert contact_pass.listed_pairs(world) == pairs_within_reach(position, SKIN)


@given(
    n=st.integers(2, 30).map(lambda half: 2 * half),
    seed=st.integers(0, 2**32 - 1),
    tilt=st.floats(0.1, 3.2),
    skin=st.one_of(st.floats(1e-6, 8e-3), st.just(0.1)),
    opening=st.sampled_from([0.0, 1e-8, 1e-5, 2e-4]),
    place=st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_no_heap_has_another_list(n, seed, tilt, skin, opening, place):
    """Hypothesis finds no heap whose list differs from that of all pairs, or misses a touching pair."""
    position = folded_chain(n, seed, LENGTH, tilt=tilt, opening=opening)[0] + [*place, 0.0]
    contact_pass = ContactPass([at_rest(position)], skin=skin)
    expected = pairs_within_reach(position, skin)
    (result,) = contact_pass.run(LIST)
    fits = len(expected) <= list_layout(contact_pass.columns).capacity
    assert result["fits"] == fits
    if fits:
        assert contact_pass.listed_pairs(0) == expected
        assert touching_of(expected, position) == contact_equations.touching_pairs(position, PAPER)


# --- how long it lasts ---


def moved_heap(n, seed, skin, fraction):
    """A heap before and after a move whose greatest displacement is `fraction` of skin/2 − |C|.

    Two straight arms of two links each join the halves of the heap, which lie across each other. The arms turn, so
    that the halves are shifted in opposite directions and every joint of one approaches some joints of the other.
    """
    generator = np.random.default_rng(seed)
    half, arm = generator.uniform(-np.pi, np.pi, n // 2 - 2), generator.uniform(-np.pi, np.pi)
    noise = generator.normal(size=(n, 3)) * [1e-5, 1e-5, 0.0]
    other_half = generator.permutation(half) + np.pi

    def heap(turn):
        arms = np.full(2, arm + turn)
        position = chain_of_angles(np.concatenate([half, arms, other_half, arms + np.pi]), LENGTH)
        return position - [*position[:, :2].mean(axis=0), 0.0] + noise

    def excess(turn):
        after = heap(turn)
        opening = np.linalg.norm(motion_equations.joint_opening(after, PAPER), axis=1).max()
        return greatest_move(heap(0.0), after) - fraction * (skin / 2 - opening)

    low, high = 0.0, 1.5
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(middle) < 0 else (low, middle)
    return heap(0.0), heap(low)


def greatest_move(before, after):
    """Greatest displacement of a joint, in m."""
    return np.linalg.norm(
        motion_equations.link_ends(after, PAPER)[1] - motion_equations.link_ends(before, PAPER)[1], axis=1
    ).max()


def test_list_stays_complete_while_it_lasts():
    """A list that is not stale holds every touching pair, and gives the velocities of a fresh one to the bit."""
    skin = 6e-3
    moves = [moved_heap(60, seed, skin, 0.99) for seed in range(40)]
    velocity = np.random.default_rng(0).normal(size=(60, 3)) * [1.0, 1.0, 2 / LENGTH]
    contact_pass = ContactPass([at_rest(before) for before, _ in moves], skin=skin)
    contact_pass.run(LIST)
    moved = [Placed(after, velocity, PAPER) for _, after in moves]
    contact_pass.place(moved)
    old = contact_pass.run(SELF)
    fresh_pass = ContactPass(moved, skin=skin)
    fresh = fresh_pass.run(LIST | SELF)
    far_before = 0
    for world, (before, after) in enumerate(moves):
        assert old[world]["slack"] > 0
        touching = contact_equations.touching_pairs(after, PAPER)
        assert touching_of(contact_pass.listed_pairs(world), after) == touching
        assert_array_equal(contact_pass.velocity(world), fresh_pass.velocity(world))
        for kind in ("self", "self_loss", "self_depth"):
            assert old[world][kind] == fresh[world][kind]
        joints = motion_equations.link_ends(before, PAPER)[1]
        gaps = [np.hypot(*(joints[q] - joints[p])) - 2 * PAPER.circle_radius for p, q in touching]
        far_before += sum(gap > 0.7 * skin for gap in gaps)
    assert far_before > 20, "the moves are too harmless to show anything"


def test_torn_chain_never_trusts_its_list():
    """If a joint is open by more than skin/2, the list is stale at once, although it was made just now."""
    position = folded_chain(20, 1, LENGTH, opening=1e-3)[0]
    contact_pass = ContactPass([at_rest(position)], skin=2e-3)
    (result,) = contact_pass.run(LIST)
    assert result["opening"] > 1e-3
    assert result["displacement"] == 0
    assert result["slack"] < 0
    assert contact_pass.listed_pairs(0) == pairs_within_reach(position, 2e-3)


# --- a full list ---


# --- whole runs ---


def run_pile(parameters, position, velocity, duration, *, poison=False, **settings):
    """A run on the floor through `Batch`: final state (n, 6), counts, losses and extremes."""
    n = len(position)
    batch = Batch(1, n, Options(method="bs32", **settings))
    batch.set_chain(0, parameters, n)
    batch.load(0, position, velocity, stop_time=duration, stop_status=Status.FINISHED)
    if poison:
        batch.scratch.fill_(np.nan)
        batch.lists.fill_(2**30)
    batch.run([0], batch.features(fixed_body="floor"))
    assert batch.status(0) == Status.FINISHED
    state = np.hstack([batch.position(0), batch.velocity(0)])
    return state, batch.counts(0), batch.losses(0), batch.extremes(0)


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
    run = {"gravity": False, "tolerance": 1e-3, "method": "rkf78", "contact_step": 2e-5}
    trajectory = warpchain.simulate(limber, position, velocity, 0.42 / rate, times=[0.0], **run)
    assert trajectory.status == Status.FINISHED
    assert trajectory.impulses["self"] > 0
    approach = 2 * LENGTH * rate
    assert trajectory.greatest_penetration["self"] < 1.5 * approach * 2e-5
