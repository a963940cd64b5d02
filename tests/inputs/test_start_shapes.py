"""Chains laid along curves: closed joints, velocities that keep them closed, sense of rotation, errors."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from tests.oracle_model.circular_loop import circular_loop
from warpchain import preset
from warpchain.inputs.start_shapes import ellipse, lay_chain, links_between, stadium

PAPER = preset("paper")
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
def test_joints_close_to_rounding(curve, links, phase):
    """Every joint of a laid chain is closed to some units in the last place of its coordinates."""
    position, _ = lay_chain(curve, links, LENGTH, 2.0, phase)
    assert position.shape == (links, 3)
    extent = np.abs(position[:, :2]).max()
    opening = np.linalg.norm(motion_equations.joint_opening(position, PAPER), axis=1)
    assert opening.max() < 20 * np.finfo(float).eps * extent * np.sqrt(links)


@pytest.mark.parametrize(("curve", "links"), CHAINS)
def test_velocities_keep_the_joints_closed(curve, links):
    """The circulating chain moves rigidly link by link: every joint opens at a rate that is rounding of its speed."""
    speed = 3.0
    position, velocity = lay_chain(curve, links, LENGTH, speed, 0.1)
    rate = np.linalg.norm(motion_equations.joint_opening_rate(position, velocity, PAPER), axis=1)
    assert rate.max() < 1e-12 * speed * links
    assert np.ptp(velocity[:, 2]) > 0 or links == 6  # only the circle turns as one body


@pytest.mark.parametrize(("curve", "links"), CHAINS)
def test_velocities_are_the_motion_along_the_curve(curve, links):
    """The velocities are the derivative of the laid places with respect to the phase, by central differences."""
    # P(phase) is the same motion in another measure of time, so the fields are proportional
    change = 1e-6
    ahead, _ = lay_chain(curve, links, LENGTH, 0.0, 0.1 + change)
    behind, _ = lay_chain(curve, links, LENGTH, 0.0, 0.1 - change)
    _, velocity = lay_chain(curve, links, LENGTH, 2.0, 0.1)
    turn = ahead[:, 2] - behind[:, 2]
    moved = np.column_stack([ahead[:, :2] - behind[:, :2], turn - 2 * np.pi * np.round(turn / (2 * np.pi))])
    moved *= np.linalg.norm(velocity[:, :2]) / np.linalg.norm(moved[:, :2])
    assert_allclose(moved[:, :2], velocity[:, :2], rtol=0, atol=1e-4 * np.abs(velocity[:, :2]).max())
    assert_allclose(moved[:, 2], velocity[:, 2], rtol=0, atol=1e-4 * np.abs(velocity[:, 2]).max())


@pytest.mark.parametrize(("curve", "links"), CHAINS)
def test_mean_speed_of_the_joints_is_the_given_one(curve, links):
    """The joints' mean speed is what was asked for, and speed 0 is exact rest."""
    _, at_rest = lay_chain(curve, links, LENGTH)
    assert not at_rest.any()
    position, velocity = lay_chain(curve, links, LENGTH, 2.5)
    arm = joints(position) - position[:, :2]
    joint_velocity = velocity[:, :2] + velocity[:, 2:] * np.column_stack([-arm[:, 1], arm[:, 0]])
    assert np.linalg.norm(joint_velocity, axis=1).mean() == pytest.approx(2.5, rel=1e-12)


@pytest.mark.parametrize(("curve", "links"), CHAINS)
def test_links_run_and_turn_clockwise(curve, links):
    """Links are numbered clockwise, and a positive speed carries them on: towards +x at the top."""
    position, velocity = lay_chain(curve, links, LENGTH, 2.0)
    x, y = joints(position).T
    area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2
    assert area < 0
    assert position[-1, 2] - position[0, 2] == pytest.approx(-2 * np.pi, abs=4 * np.pi / links + 1)
    assert velocity[np.argmax(position[:, 1]), 0] > 0
    assert velocity[np.argmin(position[:, 1]), 0] < 0
    along = velocity[:, 0] * np.cos(position[:, 2]) + velocity[:, 1] * np.sin(position[:, 2])
    assert along.mean() > 0


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


def test_circle_is_the_regular_polygon():
    """An ellipse of aspect 1 is the regular polygon of the closed form, turning at its rate."""
    links, speed = 20, 2.0
    position, velocity = lay_chain(ellipse(1.0), links, LENGTH, speed)
    polygon, turning = circular_loop(links, PAPER, -speed)
    assert_allclose(np.hypot(*position[:, :2].T), np.hypot(*polygon[:, :2].T), rtol=1e-12)
    assert_allclose(velocity[:, 2], turning[:, 2], rtol=1e-10)


def test_phase_is_a_fraction_of_the_turn():
    """At phase 0 the first joint is at the top, at 1/2 at the bottom, and at 1 the chain lies as at 0."""
    first, half, turn = (joints(lay_chain(stadium(RADIUS), 60, LENGTH, phase=phase)[0]) for phase in (0.0, 0.5, 1.0))
    assert_allclose(first[0], [0.0, RADIUS], atol=1e-12)
    assert_allclose(half[0], [0.0, first[:, 1].min()], atol=1e-12)
    assert_allclose(turn, first, atol=1e-12)


def test_links_span_their_joints():
    """Links between given joints and rates have those ends, and those ends' velocities."""
    angle = -np.linspace(0, 2 * np.pi, 8, endpoint=False)
    places = LENGTH / (2 * np.sin(np.pi / 8)) * np.column_stack([np.cos(angle), np.sin(angle)])
    rates = 7.0 * np.column_stack([-places[:, 1], places[:, 0]]) + [1.0, -2.0]
    position, velocity = links_between(places, rates)
    left, right = motion_equations.link_ends(position, PAPER)
    assert_allclose(right, places, atol=1e-16)
    assert_allclose(left, np.roll(places, 1, axis=0), atol=1e-16)
    assert_allclose(velocity[:, 2], 7.0, rtol=1e-12)
    assert_allclose(velocity[:, :2], (rates + np.roll(rates, 1, axis=0)) / 2, rtol=1e-12)


@pytest.mark.parametrize("links", [4, 16, 28])
def test_chain_too_short_for_its_sprocket_is_refused(links):
    """A chain that does not reach round the half circles is an error that says so, never a chain that is not closed."""
    with pytest.raises(ValueError, match=f"a closed chain of {links} links of {LENGTH} m does not fit this curve"):
        lay_chain(stadium(RADIUS), links, LENGTH)
