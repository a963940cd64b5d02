"""Rollers of a tilting chain at the floor: against the reference in NumPy, and the law's properties."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import tilting_contacts, tilting_plane
from tests.oracle_model.tilting_plane import Plane
from tests.support.presets import PAPER
from tests.support.tilted_chains import tilted_heap
from tests.support.tilting_under_test import floor_pass

HEAPS = range(150)
"""Seeds; every third heap is almost or exactly upright, every third almost or exactly flat, and a third have h = 0."""


@pytest.fixture(scope="module")
def passes():
    """Heaps (position, velocity, plane, parameters), and what a pass of the kernel leaves of each."""
    found = []
    for seed in HEAPS:
        position, velocity, plane, parameters, half_width = tilted_heap(seed, PAPER)
        heap = position, velocity, plane, parameters.with_values({"half_width": half_width})
        found.append((heap, floor_pass(*heap)))
    return found


def moved(plane, outcome):
    """The plane with the speeds after a pass."""
    return Plane(outcome.rates[0], outcome.rates[1:], plane.x, plane.y, plane.origin)


def test_pass_equals_reference(passes):
    """Velocities, the plane's rates, losses, number of impulses and gap are the reference's to rounding."""
    impulses = []
    for heap, outcome in passes:
        *state, parameters = heap
        expected = tilting_contacts.resolve_tilting_floor(*heap, half_width=parameters.half_width)
        scale = np.abs(expected.velocity).max(axis=0)
        assert_allclose(outcome.velocity / scale, expected.velocity / scale, rtol=0, atol=1e-13)
        assert_allclose(outcome.rates, expected.plane.rates, rtol=1e-13, atol=1e-13)
        loss = sum(impulse.loss for impulse in expected.impulses) + expected.merging_loss
        assert outcome.loss == pytest.approx(loss, abs=1e-14)
        assert outcome.impulses == len(expected.impulses)
        gap = tilting_plane.floor_gap(state[0], state[2], parameters, half_width=parameters.half_width)
        assert outcome.gap == pytest.approx(gap, abs=1e-15)
        impulses.append(outcome.impulses)
    assert sum(impulses) > 500
    assert max(impulses) >= 20
    assert 0 in impulses


def test_pushing_floor_does_the_work_that_is_booked():
    """With a floor that pushes out what has sunk in, energy changes by what is booked, in planes that lean too."""
    gains = 0
    for seed in range(100):
        position, velocity, plane, parameters, _ = tilted_heap(seed, PAPER)
        slow = 1e-3 * velocity
        outcome = floor_pass(position, slow, plane, parameters, 2000.0)
        before, after = (
            tilting_plane.tilting_kinetic_energy(position, *state, parameters, half_width=parameters.half_width)
            for state in ((slow, plane), (outcome.velocity, moved(plane, outcome)))
        )
        assert before - after == pytest.approx(outcome.loss, abs=1e-12 * (before + after))
        gains += after > before
    assert gains > 20
