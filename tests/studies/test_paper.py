"""The study of the paper: its statistics, rules and reduction, and that its page is made of the committed numbers."""

import json
import shutil
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from studies.common import at_rest
from studies.paper import further, impacts, reduction, run, statistics
from tests.support.made_sweeps import make_sweep
from warpchain import InputError, Status
from warpchain.sweeps.plan import PlannedWalk, load_sweep

REFERENCE, HALVED = 9.809, 4.9


def samples(seed: int, shape: tuple[int, ...], mean: float) -> Any:
    """Gaussian distances with a scatter of a tenth."""
    return np.random.default_rng(seed).normal(mean, 0.1, shape)


@pytest.mark.parametrize("is_paired", [True, False])
def test_signs_are_those_of_t_tests(is_paired: bool) -> None:
    """A cell rises or falls just where SciPy's paired test, or Welch's, has p < 0.05; failed walks take no part."""
    before, after = samples(1, (40, 12), 1.0), 1.05 + 3 * (samples(4, (40, 24), 1.0) - 1.0)
    if is_paired:
        after = before + samples(2, (40, 12), 0.06)
    after[3, 5] = before[7, 2] = np.nan
    effect = (statistics.paired if is_paired else statistics.unpaired)(after, before)
    test = stats.ttest_rel if is_paired else partial(stats.ttest_ind, equal_var=False)
    tests = test(after, before, axis=-1, nan_policy="omit")
    expected = np.where(tests.pvalue < 0.05, np.sign(tests.statistic), 0)
    assert effect.sign.tolist() == expected.tolist() and 0 < np.count_nonzero(expected) < 40
    assert effect.lost == 2 and (effect.pairs < 12).sum() == 1 + is_paired


def made(folder: Path, name: str = "paper_claims", **changes: Any) -> Any:
    """A sweep of four cells in which half of the gravity lets chains walk a fifth further, and one walk fails."""

    def outcome(walk: PlannedWalk) -> float | Status:
        if walk.index == 0:
            return Status.TIME_LIMIT
        scatter = 0.01 * walk.sample
        factor = 1.2 if walk.setup.parameters.gravity == HALVED else 1.0
        return factor * (walk.setup.scene.frequency / 10 + scatter)

    content = {
        "version": 1,
        "name": name,
        "seed": 1,
        "preset": "soft",
        "samples": 6,
        "same_samples_along": ["gravity"],
        "grid": {"links": [60, 180], "frequency": [10, 20], "gravity": [HALVED, REFERENCE]},
    }
    return make_sweep(folder, content | changes, outcome)


def test_reduction_finds_what_was_put_in(tmp_path: Path) -> None:
    """Effects of a made sweep are those that were put in, against the value of Table 1, without the failed walk."""
    result = made(tmp_path / "made")
    block = result.blocks["main"]
    found = reduction.effects_of(result, block, "gravity", at_rest(block))
    assert found["reference"] == REFERENCE
    (change,) = found["values"]
    effect = statistics.Effect.of(reduction.rounded(change))
    assert change["value"] == HALVED and effect.lost == 1
    assert effect.pairs.tolist() == [[5, 6], [6, 6]]
    assert effect.relative == pytest.approx(0.2) and effect.half_width == pytest.approx(0.0, abs=1e-9)
    assert effect.sign.tolist() == [[1, 1], [1, 1]]


def test_terms_explain_no_more_than_they_can() -> None:
    """Linear terms do not explain a square, and half of what is half noise; terms of noise explain nothing."""
    random = np.random.default_rng(1)
    x, noise = random.normal(size=(2, 2000))
    assert further.explained(x**2, [x]) < 0.02 and further.explained(x**2, [x, x**2]) > 0.999
    assert further.explained(x + noise, [x]) == pytest.approx(0.5, abs=0.05)
    assert further.explained(noise, list(random.normal(size=(50, 2000)))) == pytest.approx(0, abs=0.02)


def turning_ellipse(time: float, width: float, height: float, speed: float) -> Any:
    """Joints of a loop of 120 links that runs along an ellipse, clockwise, shape (120, 2)."""
    fine = np.linspace(0, 2 * np.pi, 20_001)
    curve = np.stack([-0.5 * width * np.sin(fine), 0.5 * height * np.cos(fine)], axis=1)[::-1]
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(curve, axis=0).T)))
    places = (np.arange(120) / 120 * along[-1] + speed * time) % along[-1]
    return np.stack([np.interp(places, along, column) for column in curve.T], axis=1)


def test_first_impact_finds_what_was_put_in() -> None:
    """A made loop falls, touches the floor every 8 ms for 32 ms, and rises wider, lower and slower."""
    radius, interval = 0.0042, 0.002
    time = np.arange(200) * interval
    falls, touches = time < 0.1, (time >= 0.1) & (time < 0.14)
    frames = []
    for now, before, touch in zip(time, falls, touches, strict=True):
        loop = turning_ellipse(now, 0.2, 0.5, 8.0) if before else turning_ellipse(now, 0.22, 0.45, 7.2)
        gap = 0.5 * (0.1 - now) if before else 0.0 if touch and round(now / interval) % 4 == 2 else 0.001
        if not before and not touch:
            gap = 0.5 * (now - 0.138)
        loop += (now, radius + gap - loop[:, 1].min())
        frames.append(loop)
    parameters = SimpleNamespace(circle_radius=radius)
    walk = SimpleNamespace(frame_joints=np.array(frames), frame_time=time, setup=SimpleNamespace(parameters=parameters))
    impact = impacts.first_impact(walk)
    assert impact.area == pytest.approx(0.22 * 0.45 / (0.2 * 0.5) - 1, abs=2e-3)
    assert (impact.width, impact.height) == (pytest.approx(0.1, abs=2e-3), pytest.approx(-0.1, abs=2e-3))
    assert impact.speed == pytest.approx(-0.1, abs=5e-3)
    assert 0.034 <= impact.duration <= 0.05
    walk.frame_joints = np.array(frames)[touches.argmax() :]
    walk.frame_time = time[touches.argmax() :]
    assert impacts.first_impact(walk) is None


def test_the_page_is_made_of_the_committed_numbers(tmp_path: Path) -> None:
    """The command writes the committed page from the committed numbers, and draws every figure but that of loops."""
    (tmp_path / "results").mkdir()
    shutil.copy(run.FOLDER / run.RESULTS, tmp_path / run.RESULTS)
    run.make([], tmp_path)
    page = (run.FOLDER / "README.md").read_text(encoding="utf-8")
    assert (tmp_path / "README.md").read_text(encoding="utf-8") == page, "run python -m studies.paper.run"
    drawn = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert drawn == {"distances", "effects", "friction", "strands"}
    with pytest.raises((InputError, OSError)):
        run.make([tmp_path], tmp_path)


def test_the_committed_numbers_are_those_of_the_sweeps() -> None:
    """What the numbers' sweeps vary and draw is what today's sweep files do, with as many samples."""
    numbers = json.loads((run.FOLDER / run.RESULTS).read_text(encoding="utf-8"))
    for name in reduction.SWEEPS:
        sweep = load_sweep(run.FOLDER / f"sweeps/{name}.yaml")
        assert numbers[name]["sweep"] == reduction.content_digest(sweep.canonical()), name
        assert numbers[name]["samples"] == {block.name: block.samples for block in sweep.blocks}
