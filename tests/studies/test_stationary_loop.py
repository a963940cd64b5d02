"""The study of the stationary loop: its balances and the theory of its shape, on a simulated loop."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import warpchain
from studies.common import with_tables
from studies.stationary_loop import run, starts
from studies.stationary_loop.theory import bending_inertia, catenary_between, imbalances, moment, predict


@cache
def held_walk() -> warpchain.WalkResult:
    """60 links, held on their sprocket at 20 Hz for 25 s."""
    return warpchain.walk(
        frequency=20.0, preset="soft", start="spinning", steady_time=25.0, steady_tolerance=1.0, walk_limit=1e-3
    )


@pytest.mark.parametrize("friction", [1.0, 0.5])
def test_theory_balances(friction: float) -> None:
    """Forces on every part from the first end on add up to its weight, and so do moments; it has the loop's ends."""
    loop = held_walk().mean_loop()
    changes = {name: friction * getattr(loop.parameters, name) for name in ("viscous_friction", "coulomb_friction")}
    p = loop.parameters.with_values(changes | {"friction_smoothing": 1.0})
    found = predict(loop, changes | {"friction_smoothing": 1.0})
    tangent = np.stack([-np.cos(found.angle), np.sin(found.angle)], axis=1)
    normal = np.stack([np.sin(found.angle), np.cos(found.angle)], axis=1)
    force = found.effective_tension[:, None] * tangent + found.shear[:, None] * normal
    way = found.s - found.s[0]
    weight = np.stack([0 * way, loop.density * p.gravity * way], axis=1)
    np.testing.assert_allclose(force - force[0], weight, atol=1e-3)
    bending, slope = (np.gradient(values, found.s) for values in (found.curvature, found.moment))
    left = (slope + found.shear - bending_inertia(loop) * loop.speed**2 * bending)[2:-2]
    assert np.abs(left).max() < 0.02 * np.abs(found.shear).max()
    rubbing = moment(p, p.link_length * loop.speed * bending, 1.0)
    np.testing.assert_allclose(found.moment, rubbing, atol=0.02 * moment(p, 60.0, 1.0))
    ends = np.interp([loop.free[0] + p.link_length, loop.free[1] - p.link_length], loop.s, loop.position[:, 0])
    np.testing.assert_allclose(found.position[[0, -1], 0], ends, atol=1e-6)


def test_a_simulated_loop_balances() -> None:
    """On the mean loop of a held chain force, shear and moment balance, and joints rub as the curve turns them."""
    found = imbalances(held_walk().mean_loop())
    for name, rms, greatest in (("force", 0.02, 1), ("normal", 0.04, 1), ("moment", 0.02, 0.06), ("friction", 0.01, 1)):
        assert found[name][0] < rms and found[name][1] < greatest


def test_a_simulated_loop_is_what_theory_predicts() -> None:
    """Shape to 1 mm, bottom curvature to 2 %, the kink's to 5 % and its place to 3 mm."""
    loop = held_walk().mean_loop()
    found, kink = predict(loop), loop.kink()
    steps = np.diff(found.position, axis=0)
    assert np.hypot(*steps.T).sum() == pytest.approx(np.ptp(found.s), rel=1e-4)
    simulated = np.stack([np.interp(found.angle, loop.angle, loop.position[:, axis]) for axis in (0, 1)], axis=1)
    bottom = np.abs(found.s) < 0.05  # where φ grows all the time
    np.testing.assert_allclose(found.position[bottom], simulated[bottom], atol=1e-3)
    assert np.interp(0.0, found.s, found.curvature) == pytest.approx(loop.bottom_curvature, rel=0.02)
    dip = int(np.argmin(np.where(np.abs(found.s) < 0.18, found.curvature, np.inf)))
    assert found.curvature[dip] == pytest.approx(kink.dip, rel=0.05)
    assert found.s[dip] == pytest.approx(kink.dip_at, abs=3e-3)
    assert kink.dip < -9.0 and kink.dip_at > 0.1  # it stands after the lowest point
    off = np.abs(np.interp(found.s, loop.s, loop.effective_tension) - found.effective_tension)
    edge = 4 * loop.parameters.link_length
    assert off[(found.s > loop.free[0] + edge) & (found.s < loop.free[1] - edge)].max() < 0.05


def test_figures_have_theory_and_kinks(tmp_path: Path) -> None:
    """The figure of a loop has two lines more in each panel; kinks of a sweep are drawn by links and frequency."""
    walk = held_walk()
    pairs = zip(run.draw(walk).axes, walk.plot("loop").axes, strict=True)
    assert [len(axes.lines) - len(plain.lines) for axes, plain in pairs] == [2, 2, 2]
    frames = {"series": True, "frames": {"samples": [0], "before": 0.2}}
    grid = {"links": [40], "frequency": [12.0, 14.0]}
    settings = {"preset": "soft", "scene": {"start": "spinning", "extra_hold": 0.5, "walk_limit": 0.05}}
    result = warpchain.sweep(grid=grid, samples=1, record=frames, out=tmp_path / "kinks", progress=False, **settings)
    assert [line.get_xdata().tolist() for line in run.draw_kinks(result).axes[1].lines] == [[12.0, 14.0]]


def test_the_catenary_is_one() -> None:
    """Between uneven ends: of the length asked for, with T_e cos φ constant, T_e κ = ρ g cos φ and κ the slope of φ."""
    first, last = np.array([0.06, 0.01]), np.array([-0.055, -0.02])
    for length in (0.125, 0.5, 2.0):
        found = catenary_between(first, last, length, 2.5)
        np.testing.assert_allclose(found.position[[0, -1]], [first, last], atol=1e-12)
        steps = np.hypot(*np.diff(found.position, axis=0).T)
        assert steps.sum() == pytest.approx(length, rel=1e-4) and np.ptp(found.s) == pytest.approx(length)
        horizontal = found.effective_tension * np.cos(found.angle)
        np.testing.assert_allclose(horizontal, horizontal[0], rtol=1e-12)
        np.testing.assert_allclose(found.effective_tension * found.curvature, 2.5 * np.cos(found.angle))
        np.testing.assert_allclose(np.gradient(found.angle, found.s)[1:-1], found.curvature[1:-1], rtol=3e-2)
    with pytest.raises(ValueError, match="does not reach"):
        catenary_between(first, last, 0.1, 2.5)


def test_the_page_has_the_tables_of_the_starts() -> None:
    """They are rendered from the committed rows."""
    page = starts.PAGE.read_text(encoding="utf-8")
    assert with_tables(page, starts.tables(starts.read())) == page, (
        "out of date; run python -m studies.stationary_loop.starts"
    )


def test_what_is_drawn_is_taken_from_distances_and_their_difference_is_left() -> None:
    """Of two blocks whose Δx is linear in what they drew, 2 % apart, only these 2 % are left."""
    random, cells = np.random.default_rng(1), {}
    for block, dx in (("rest", 1.0), ("spinning", 1.02)):
        radius, phase = random.normal(0.5 * (block == "rest"), 1, 50), random.random(50)
        found = dx + 0.1 * radius + 0.2 * np.cos(2 * np.pi * phase)
        cells[block, 60, 20.0, 0.0] = {"dx": found, "radius_drawn": radius, "phase_drawn": phase}
    rest, spinning = starts.with_draws_held(cells).values()
    np.testing.assert_allclose(spinning - rest, 0.02, atol=1e-12)
