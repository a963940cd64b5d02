"""Chains laid along curves: closed joints, velocities that keep them closed, sense of rotation, errors."""

from typing import get_args

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from tests.support.presets import PAPER
from warpchain.chain.start_shapes import ellipse, lay_chain, stadium
from warpchain.chain.starts import SHAPES
from warpchain.inputs.starts import STARTS, StartWord

LENGTH = PAPER.link_length
RADIUS = PAPER.sprocket_radius + PAPER.circle_radius

CHAINS = [
    pytest.param(stadium(RADIUS), 60, id="stadium-60"),
    pytest.param(stadium(RADIUS), 180, id="stadium-180"),
    pytest.param(stadium(RADIUS), 30, id="stadium-tight"),
    pytest.param(ellipse(1.5), 4, id="ellipse-4"),
    pytest.param(ellipse(1.0), 6, id="circle-6"),
    pytest.param(ellipse(0.4), 60, id="ellipse-flat"),
    pytest.param(ellipse(8.0), 60, id="ellipse-slender"),
    pytest.param(ellipse(1.5), 300, id="ellipse-300"),
]


def joints(position):
    """Right ends of the links, (n, 2)."""
    return motion_equations.link_ends(position, PAPER)[1]


@pytest.mark.parametrize(("curve", "links"), CHAINS)
@pytest.mark.parametrize("phase", [0.0, 0.37])
def test_a_laid_chain_is_closed_and_runs_clockwise(curve, links, phase):
    """Joints are closed and stay so but for rounding; their mean speed is the given one; the loop runs clockwise."""
    position, velocity = lay_chain(curve, links, LENGTH, 2.5, phase)
    extent = np.abs(position[:, :2]).max()
    opening = np.linalg.norm(motion_equations.joint_opening(position, PAPER), axis=1)
    assert opening.max() < 20 * np.finfo(float).eps * extent * np.sqrt(links)
    rate = np.linalg.norm(motion_equations.joint_opening_rate(position, velocity, PAPER), axis=1)
    assert rate.max() < 1e-12 * 2.5 * links
    assert np.ptp(velocity[:, 2]) > 0 or links == 6  # only the circle turns as one body
    arm = joints(position) - position[:, :2]
    joint_velocity = velocity[:, :2] + velocity[:, 2:] * np.column_stack([-arm[:, 1], arm[:, 0]])
    assert np.linalg.norm(joint_velocity, axis=1).mean() == pytest.approx(2.5, rel=1e-12)
    x, y = joints(position).T
    assert np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) < 0
    assert velocity[np.argmax(position[:, 1]), 0] > 0 > velocity[np.argmin(position[:, 1]), 0]
    assert not lay_chain(curve, links, LENGTH)[1].any()


@pytest.mark.parametrize(("curve", "links"), CHAINS)
def test_velocities_are_the_motion_along_the_curve(curve, links):
    """The velocities are the derivative of the laid places with respect to the phase, by central differences."""
    # P(phase) is the same motion in another measure of time, so the fields are proportional
    ahead, behind = (lay_chain(curve, links, LENGTH, 0.0, 0.1 + change)[0] for change in (1e-6, -1e-6))
    _, velocity = lay_chain(curve, links, LENGTH, 2.0, 0.1)
    turn = ahead[:, 2] - behind[:, 2]
    moved = np.column_stack([ahead[:, :2] - behind[:, :2], turn - 2 * np.pi * np.round(turn / (2 * np.pi))])
    moved *= np.linalg.norm(velocity[:, :2]) / np.linalg.norm(moved[:, :2])
    for columns in (slice(0, 2), slice(2, 3)):
        within = 1e-4 * np.abs(velocity[:, columns]).max()
        assert_allclose(moved[:, columns], velocity[:, columns], rtol=0, atol=within)


@pytest.mark.parametrize("links", [60, 180])
def test_stadium_hangs_on_its_sprocket(links):
    """The joints of a hung chain lie on two half circles of the joint radius and on the verticals between them."""
    position, _ = lay_chain(stadium(RADIUS), links, LENGTH)
    x, y = joints(position).T
    upper = y >= 0
    assert_allclose(np.hypot(x, y)[upper], RADIUS, rtol=1e-12)
    assert np.abs(x).max() < RADIUS * (1 + 1e-12)
    lowest = y.min()
    straight = -lowest - RADIUS
    lower = y < -straight
    assert_allclose(np.hypot(x, y + straight)[lower], RADIUS, rtol=1e-2)
    between = ~upper & ~lower
    assert between.sum() > 0
    assert_allclose(np.abs(x)[between], RADIUS, rtol=1e-12)
    # chords are shorter than arcs, so the straights are a little longer than the circumference tells
    around = 2 * np.pi * RADIUS
    assert (links * LENGTH - around) / 2 < straight < (links * LENGTH - around) / 2 * 1.02


@pytest.mark.parametrize("aspect", [0.5, 1.0, 1.5, 3.0])
def test_ellipse_has_its_aspect(aspect):
    """The joints of an ellipse lie on one, its height over its width being the aspect, at the start and on the way."""
    for phase in (0.0, 0.3):
        position, _ = lay_chain(ellipse(aspect), 100, LENGTH, phase=phase)
        x, y = joints(position).T
        size = np.sqrt(x**2 * aspect + y**2 / aspect)
        assert_allclose(size, size[0], rtol=1e-12)


def test_phase_is_a_fraction_of_the_turn():
    """At phase 0 the first joint is at the top, at 1/2 at the bottom, and at 1 the chain lies as at 0."""
    first, half, turn = (joints(lay_chain(stadium(RADIUS), 60, LENGTH, phase=phase)[0]) for phase in (0.0, 0.5, 1.0))
    assert_allclose(first[0], [0.0, RADIUS], atol=1e-12)
    assert_allclose(half[0], [0.0, first[:, 1].min()], atol=1e-12)
    assert_allclose(turn, first, atol=1e-12)


def test_every_start_has_a_shape_or_a_sprocket() -> None:
    """The words that a user may write, and the shapes that chains without a sprocket are laid along, are one table."""
    assert {word for word, start in STARTS.items() if not start.on_sprocket} == SHAPES.keys()
    assert set(get_args(StartWord)) == STARTS.keys()
