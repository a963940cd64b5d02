"""The loop on its sprocket: its mean against curves that are known, its balances, and the theory of its shape."""

import dataclasses
import sys
from functools import cache

import numpy as np
import pytest
from matplotlib.figure import Figure

import warpchain
from tests.support.made_walks import make_walk
from warpchain.inputs.parameters import preset
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.loop.before_release import BeforeRelease
from warpchain.loop.stationary_loop import (
    LoopParameters,
    StationaryLoop,
    average_frames,
    average_loop,
    find_kink,
    imbalances,
    periodic_slope,
)
from warpchain.loop.theory import (
    End,
    NoSolutionError,
    catenary,
    catenary_between,
    predict,
    solve,
)
from warpchain.pictures.loop_figure import WITHOUT_SCIPY, loop_figure
from warpchain.walks.walk_result import WalkResult

SOFT = preset("soft")
LENGTH = SOFT.link_length
RATE = 591.3  # links a second


def frames_of(joints: np.ndarray, forces: np.ndarray | None = None) -> BeforeRelease:
    """Frames (f, n, 2), 2 ms apart, without moments and, unless given, without forces."""
    time = 2e-3 * (np.arange(len(joints)) - len(joints))
    return BeforeRelease(
        time=time,
        center=np.zeros((len(time), 2)),
        center_velocity=np.zeros((len(time), 2)),
        frame_time=time,
        frame_joints=joints,
        frame_forces=np.zeros_like(joints) if forces is None else forces,
        frame_moments=np.zeros(joints.shape[:2]),
    )


def average(before: BeforeRelease, top: float) -> StationaryLoop:
    """The mean loop of frames whose highest joints pass at some height [m] over the origin, where a sprocket ends."""
    parameters = dataclasses.replace(LoopParameters.of(SOFT), gravity=0.0)
    return average_frames(before, parameters, np.array([0.0, top - 0.01]), 0.01)


def make_ring(links: int, frames: int = 100) -> tuple[BeforeRelease, float, float]:
    """A regular polygon that turns clockwise without gravity; its radius [m] and the tension in its joints [N].

    Links of mass m at the apothem a turn at Ω: 2 F sin(π/n) = m a Ω², F along the circle through the joints.
    """
    radius = LENGTH / (2 * np.sin(np.pi / links))
    turning = 2 * np.pi * RATE / links
    moved = RATE * 2e-3 * (np.arange(frames) - frames)
    angle = -2 * np.pi * (np.arange(links) + moved[:, None]) / links
    radial = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    mass = (SOFT.inner_mass + SOFT.outer_mass) / 2
    tension = mass * radius * np.cos(np.pi / links) * turning**2 / (2 * np.sin(np.pi / links))
    along = np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
    return frames_of(radius * radial, tension * along), radius, tension


@cache
def held_walk() -> WalkResult:
    """60 links, held on their sprocket at 20 Hz for 25 s."""
    return warpchain.walk(
        frequency=20.0,
        preset="soft",
        start="spinning",
        steady_time=25.0,
        steady_tolerance=1.0,
        walk_limit=1e-3,
    )


def test_a_ring_has_its_radius_speed_and_tension() -> None:
    """A turning polygon: curvature 1/R, tension as momentum wants it, nothing beyond that, no shear, no spread."""
    before, radius, tension = make_ring(30)
    loop = average(before, radius)
    np.testing.assert_allclose(loop.curvature, 1 / radius, rtol=1e-9)
    np.testing.assert_allclose(loop.bending, 0.0, atol=1e-6 / radius)
    np.testing.assert_allclose(loop.tension, tension, rtol=1e-9)
    assert loop.speed == pytest.approx(LENGTH * RATE, rel=1e-9)
    assert loop.length == pytest.approx(2 * np.pi * radius, rel=1e-9)
    # cot is expanded to second order: 2π/n to the fourth over 720 is left
    np.testing.assert_allclose(loop.effective_tension, 0.0, atol=1.1 * (2 * np.pi / 30) ** 4 / 720 * tension)
    np.testing.assert_allclose(loop.shear, 0.0, atol=1e-9 * tension)
    np.testing.assert_allclose(loop.angle, loop.s / radius, atol=1e-9)
    assert loop.spread.max() < 3e-6 * radius
    assert abs(np.interp(0.0, loop.s, loop.position[:, 0])) < 1e-6


def test_an_ellipse_has_its_curvature() -> None:
    """Joints that follow an ellipse: curvature at bottom and flank, and its slope, are the ellipse's."""
    links, speed = 120, LENGTH * RATE
    shape = ellipse(1.5)
    phases = (0.382 * np.arange(200)) % 1.0
    joints = []
    for number, phase in enumerate(phases):
        position, _ = lay_chain(shape, links, LENGTH, speed, float(phase))
        half = LENGTH / 2 * np.stack([np.cos(position[:, 2]), np.sin(position[:, 2])], axis=1)
        ends = position[:, :2] + half
        joints.append(np.roll(ends, -number, axis=0))
    middle = np.mean(joints[0], axis=0)
    frames = np.array(joints) - middle
    a, b = np.ptp(frames[..., 1]) / 2, np.ptp(frames[..., 0]) / 2
    loop = average(frames_of(frames), a)
    assert a / b == pytest.approx(1.5, rel=1e-3)
    assert loop.bottom_curvature == pytest.approx(a / b**2, rel=1e-3)
    flank = np.interp(-np.pi / 2, loop.angle, loop.curvature)
    assert flank == pytest.approx(b / a**2, rel=1e-3)
    slope = periodic_slope(loop.curvature, loop.length)
    np.testing.assert_allclose(loop.bending, slope, atol=2e-2 * np.abs(slope).max())
    np.testing.assert_allclose(loop.s[len(loop.s) // 2], 0.0, atol=1e-12)


def test_what_makes_no_mean_loop_is_refused() -> None:
    """Too few frames, a loop that stands, runs backwards or is nowhere free, and a walk without frames of the time."""
    before, radius, _ = make_ring(30)
    few = frames_of(before.frame_joints[:5])
    with pytest.raises(ValueError, match="5 frames are too few"):
        average(few, radius)
    with pytest.raises(ValueError, match="does not run clockwise"):
        average(frames_of(before.frame_joints[::-1]), radius)
    with pytest.raises(ValueError, match="hardly moves"):
        average(frames_of(np.repeat(before.frame_joints[:1], 20, axis=0)), radius)
    with pytest.raises(ValueError, match="no free part"):
        average_frames(before, LoopParameters.of(SOFT), np.zeros(2), radius)
    for kind in (loop_figure, average_loop):
        with pytest.raises(ValueError, match="record_before"):
            kind(make_walk())


def test_the_catenary_is_one() -> None:
    """Between uneven ends: on y = c cosh((x − x₀)/c) + y₀, of the length asked for, with T_e κ = ρ g cos φ."""
    parameters = LoopParameters.of(SOFT)
    ends = End(0.06, 0.01, -1.5, 0.0), End(-0.055, -0.02, 1.5, 0.0)
    for length in (0.125, 0.5, 2.0):
        found = catenary_between(ends, length, parameters)
        for place, end in ((0, ends[0]), (-1, ends[1])):
            np.testing.assert_allclose(found.position[place], (end.x, end.y), atol=1e-12)
        steps = np.hypot(*np.diff(found.position, axis=0).T)
        assert steps.sum() == pytest.approx(length, rel=1e-4) and found.length == pytest.approx(length)
        weight = parameters.density * parameters.gravity
        horizontal = found.effective_tension * np.cos(found.angle)
        np.testing.assert_allclose(horizontal, horizontal[0], rtol=1e-12)
        np.testing.assert_allclose(found.effective_tension * found.curvature, weight * np.cos(found.angle))
        np.testing.assert_allclose(np.gradient(found.angle, found.s)[1:-1], found.curvature[1:-1], rtol=3e-2)
    with pytest.raises(NoSolutionError, match="does not reach"):
        catenary_between(ends, 0.1, parameters)


def test_theory_without_friction_and_inertia_is_the_catenary() -> None:
    """The boundary value problem's solution is the closed form's to 1e-6 of its length, from a poor guess."""
    bare = dataclasses.replace(LoopParameters.of(SOFT), inertia=0.0, viscous_friction=0.0, coulomb_friction=0.0)
    ends = End(0.06, 0.01, -1.3, 0.0), End(-0.055, 0.0, 1.3, 0.0)
    expected = catenary_between(ends, 0.5, bare)
    poor = catenary_between(ends, 0.4, bare)
    rows = (*poor.position.T, poor.angle, poor.curvature, poor.shear, poor.effective_tension, poor.shear)
    found = solve(ends, np.stack(rows)[:, ::4], 0.5, bare, 7.5)
    np.testing.assert_allclose(found.position, expected.position, atol=1e-6 * 0.5)
    np.testing.assert_allclose(found.effective_tension, expected.effective_tension, rtol=1e-5)
    np.testing.assert_allclose(found.s, expected.s, atol=1e-4)


@pytest.mark.parametrize("change", [{}, {"inertia": 0.0}, {"coulomb_friction": 0.0}], ids=str)
def test_theory_fulfils_its_balances(change: dict[str, float]) -> None:
    """Force and moment of a predicted loop balance along the arc, by finite differences; its ends are those given."""
    loop = average_loop(held_walk())
    parameters = dataclasses.replace(loop.parameters, friction_smoothing=3.0, **change)
    found = predict(loop, parameters)
    step = found.s[1] - found.s[0]
    across = np.gradient(found.shear, step) + found.effective_tension * found.curvature
    across -= parameters.density * parameters.gravity * np.cos(found.angle)
    assert np.abs(across[2:-2]).max() < 0.01 * np.abs(found.effective_tension * found.curvature).max()
    turned = parameters.inertia * loop.speed**2 * np.gradient(found.curvature, step)
    rest = np.gradient(found.moment, step) + found.shear - turned
    assert np.abs(rest[2:-2]).max() < 0.02 * np.abs(found.shear).max()
    vertical = found.effective_tension * np.sin(found.angle) + found.shear * np.cos(found.angle)
    weight = parameters.density * parameters.gravity * found.length
    assert vertical[-1] - vertical[0] == pytest.approx(weight, rel=1e-3)
    inset = LENGTH
    for place, s in ((0, loop.free[0] + inset), (-1, loop.free[1] - inset)):
        end = End.of(loop, s)
        np.testing.assert_allclose(found.position[place], (end.x, end.y), atol=1e-6)
        assert found.angle[place] == pytest.approx(end.angle, abs=1e-6)


def test_a_simulated_loop_balances() -> None:
    """On the mean loop of a held chain force, shear and moment balance, and joints rub as the curve turns them."""
    found = imbalances(average_loop(held_walk()))
    assert found["force"].rms < 0.02
    assert found["normal"].rms < 0.04
    assert found["moment"].rms < 0.02 and found["moment"].greatest < 0.06
    assert found["friction"].rms < 0.01


def test_a_simulated_loop_is_what_theory_predicts() -> None:
    """Shape to 1 mm, bottom curvature to 2 %, the kink's to 5 % and its place to 3 mm; the catenary is none of it."""
    loop = average_loop(held_walk())
    found, kink = predict(loop), find_kink(loop)
    steps = np.diff(found.position, axis=0)
    assert np.hypot(*steps.T).sum() == pytest.approx(found.length, rel=1e-4)
    simulated = np.stack([np.interp(found.angle, loop.angle, loop.position[:, axis]) for axis in (0, 1)], axis=1)
    bottom = np.abs(found.s) < 0.05  # where φ grows all the time
    np.testing.assert_allclose(found.position[bottom], simulated[bottom], atol=1e-3)
    assert np.interp(0.0, found.s, found.curvature) == pytest.approx(loop.bottom_curvature, rel=0.02)
    dip = int(np.argmin(np.where(np.abs(found.s) < 0.18, found.curvature, np.inf)))
    assert found.curvature[dip] == pytest.approx(kink.dip, rel=0.05)
    assert found.s[dip] == pytest.approx(kink.dip_at, abs=3e-3)
    assert kink.dip < -9.0 and kink.dip_at > 0.1  # it stands after the lowest point
    off = np.abs(np.interp(found.s, loop.s, loop.effective_tension) - found.effective_tension)
    assert off[(found.s > loop.free[0] + 4 * LENGTH) & (found.s < loop.free[1] - 4 * LENGTH)].max() < 0.05
    assert catenary(loop).curvature.max() > 1.8 * loop.bottom_curvature


def test_the_figure_of_a_loop() -> None:
    """Three panels; the line of the mean loop is closed and the loop's own, and there are theory and catenary."""
    walk = held_walk()
    loop = average_loop(walk)
    figure = walk.plot("loop")
    assert isinstance(figure, Figure)
    shape, bend, pull = figure.axes
    lines = {tuple(line.get_xydata().shape): line for line in shape.lines}
    np.testing.assert_allclose(lines[len(loop.s) + 1, 2].get_xydata()[:-1], loop.position - loop.center)
    names = [text.get_text() for text in bend.get_legend().get_texts()]
    assert names == ["catenary, as long", "simulation, mean", "theory"]
    assert len(bend.lines) == 4 and len(pull.lines) == 3
    assert "/ m$^{-1}$" in bend.get_ylabel() and "/ N" in pull.get_ylabel() and "/ m" in pull.get_xlabel()


def test_without_scipy_the_figure_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is drawn without theory, with a note; the theory itself is refused with the remedy."""
    monkeypatch.setitem(sys.modules, "scipy.integrate", None)
    _, bend, pull = held_walk().plot("loop").axes
    assert bend.get_legend().get_title().get_text() == WITHOUT_SCIPY
    assert len(bend.lines) == 3 and len(pull.lines) == 2
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'warpchain\[scipy\]'"):
        predict(average_loop(held_walk()))
