"""The page docs/paper.md: its statistics, its rules, its reduction, and that it is made of the committed numbers."""

import dataclasses
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.docs.code_blocks import ROOT
from tests.support.made_sweeps import make_sweep
from warpchain.inputs.validation import InputError
from warpchain.inputs.yaml_files import read_yaml
from warpchain.status import Status
from warpchain.sweeps.plan import PlannedWalk, load_sweep

stats = pytest.importorskip("scipy.stats", reason="the extra `scipy` has it")

REFERENCE, HALVED = 9.809, 4.9


@pytest.fixture(scope="module", autouse=True)
def docs_on_the_path() -> Iterator[None]:
    """Modules beside the page are imported as its command imports them."""
    sys.path.insert(0, str(ROOT / "docs"))
    yield
    sys.path.remove(str(ROOT / "docs"))


def part(name: str) -> ModuleType:
    """A module of docs/paper_page/."""
    return importlib.import_module(f"paper_page.{name}")


def samples(seed: int, shape: tuple[int, ...], mean: float) -> Any:
    """Gaussian distances with a scatter of a tenth."""
    return np.random.default_rng(seed).normal(mean, 0.1, shape)


def test_paired_signs_are_those_of_a_paired_t_test() -> None:
    """A cell rises or falls just where SciPy's paired t test has p < 0.05; walks that failed take no part."""
    before = samples(1, (40, 12), 1.0)
    after = before + samples(2, (40, 12), 0.06)
    after[3, 5] = before[7, 2] = np.nan
    effect = part("statistics").paired(after, before)
    tests = stats.ttest_rel(after, before, axis=-1, nan_policy="omit")
    expected = np.where(tests.pvalue < 0.05, np.sign(tests.statistic), 0)
    assert effect.sign.tolist() == expected.tolist() and 0 < np.count_nonzero(expected) < 40
    assert effect.lost == 2 and effect.pairs.tolist() == [11 if cell in (3, 7) else 12 for cell in range(40)]


def test_unpaired_signs_are_those_of_welchs_test() -> None:
    """The same for independent samples of different size and scatter."""
    before, after = samples(3, (40, 24), 1.0), 1.05 + 3 * (samples(4, (40, 12), 1.0) - 1.0)
    effect = part("statistics").unpaired(after, before)
    tests = stats.ttest_ind(after, before, axis=-1, equal_var=False)
    expected = np.where(tests.pvalue < 0.05, np.sign(tests.statistic), 0)
    assert effect.sign.tolist() == expected.tolist() and 0 < np.count_nonzero(expected) < 40


@pytest.mark.parametrize("name", ["paired", "unpaired"])
def test_intervals_cover_the_truth(name: str) -> None:
    """Of 4000 intervals of a ratio of means 95 % hold it, to three standard errors; so do those of means of cells."""
    cells, ratio = 4000, 1.3
    before = samples(5, (cells, 16), 1.0)
    after = ratio * (before if name == "paired" else samples(6, (cells, 16), 1.0)) + samples(7, (cells, 16), 0.0)
    effect = getattr(part("statistics"), name)(after, before)
    covered = np.abs(effect.relative - (ratio - 1)) <= effect.half_width
    assert abs(covered.mean() - 0.95) < 3 * (0.95 * 0.05 / cells) ** 0.5
    means = [
        part("statistics").summary(
            part("statistics").Effect(
                *(each[cut] for each in (effect.relative, effect.half_width, effect.sign)), effect.pairs[cut], 0
            )
        )
        for cut in np.split(np.arange(cells), 200)
    ]
    covered = np.array([abs(found.mean - (ratio - 1)) <= found.half_width for found in means])
    assert abs(covered.mean() - 0.95) < 3 * (0.95 * 0.05 / len(means)) ** 0.5


def test_typical_effect_is_free_of_noise() -> None:
    """The typical effect of cells that differ by ±10 % is 10 %, and of noise alone it is far below the noise."""
    before = samples(8, (400, 16), 1.0)
    noise = samples(9, (400, 16), 0.0)
    signs = np.where(np.arange(400) % 2, 1.1, 0.9)[:, np.newaxis]
    of_signs, of_noise = (
        part("statistics").summary(part("statistics").paired(factor * before + noise, before)).typical
        for factor in (signs, 1.0)
    )
    assert of_signs == pytest.approx(0.1, rel=0.05)
    assert of_noise < 0.5 * 0.1 / 4


def test_cells_without_two_pairs_are_left_out() -> None:
    """A cell with one pair, or none, has no interval, no sign, and is in no summary."""
    before = samples(10, (3, 4), 1.0)
    after = 2 * before
    after[1, 1:] = after[2] = np.nan
    effect = part("statistics").paired(after, before)
    found = part("statistics").summary(effect)
    assert (found.cells, found.rises, found.falls) == (1, 1, 0) and found.mean == pytest.approx(1.0)
    assert part("statistics").exceeding(effect, 0.5) == 1 and part("statistics").exceeding(effect, 1.5) == 0


def test_verdicts_follow_their_rules() -> None:
    """Each rule gives each of its verdicts at its bounds."""
    rules = part("verdicts")
    agrees, in_part, differs, left_open = rules.Verdict
    directions = {
        (15, 3): agrees,
        (14, 3): in_part,
        (15, 4): in_part,
        (4, 20): differs,
        (20, 10): in_part,
        (3, 0): differs,
        (0, 30): differs,
    }
    for (with_claim, against), verdict in directions.items():
        assert rules.direction(with_claim, against, 30) is verdict
    for exceeding, verdict in {0: agrees, 3: agrees, 4: in_part, 15: in_part, 16: differs}.items():
        assert rules.smallness(exceeding, 30) is verdict
    assert rules.direction(0, 0, 0) is rules.share(0, 0) is left_open
    assert rules.together([agrees, agrees]) is agrees and rules.together([agrees, differs]) is in_part


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
    reduction = part("reduction")
    result = made(tmp_path / "made")
    block = result.blocks["main"]
    found = reduction.effects(
        reduction.at_rest(block), block, "gravity", reduction._reference(result, block, "gravity")
    )
    assert found["reference"] == REFERENCE
    (change,) = found["values"]
    effect = reduction.effect_of(reduction.rounded(change))
    assert change["value"] == HALVED and effect.lost == 1
    assert effect.pairs.tolist() == [[5, 6], [6, 6]]
    assert effect.relative == pytest.approx(0.2) and effect.half_width == pytest.approx(0.0, abs=1e-9)
    assert effect.sign.tolist() == [[1, 1], [1, 1]]


def test_a_sweep_that_is_not_complete_is_refused(tmp_path: Path) -> None:
    """Foreign sweeps, and sweeps that have not ended, are refused by name."""
    reduction = part("reduction")
    with pytest.raises(InputError, match=r"^other: no sweep of this page"):
        reduction.reduced(made(tmp_path / "other", name="other"))
    content = made(tmp_path / "known").sweep
    unfinished = make_sweep(tmp_path / "unfinished", content, lambda walk: 1.0 if walk.index else None)
    with pytest.raises(InputError, match=r"^paper_claims: 1 walks are missing"):
        reduction.reduced(unfinished)


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
    impact = part("impacts").first_impact(walk)
    assert impact.area == pytest.approx(0.22 * 0.45 / (0.2 * 0.5) - 1, abs=2e-3)
    assert (impact.width, impact.height) == (pytest.approx(0.1, abs=2e-3), pytest.approx(-0.1, abs=2e-3))
    assert impact.speed == pytest.approx(-0.1, abs=5e-3)
    assert 0.034 <= impact.duration <= 0.05
    walk.frame_joints = np.array(frames)[touches.argmax() :]
    walk.frame_time = time[touches.argmax() :]
    assert part("impacts").first_impact(walk) is None


def test_an_outline_that_only_turns_has_not_moved() -> None:
    """A loop that runs on along itself by whole links keeps its outline; one that is shifted by a tenth does not."""
    loop = turning_ellipse(0.0, 0.3, 0.3, 1.0)
    moved = part("impacts")._moved
    assert moved(loop, np.roll(loop, 17, axis=0)) < 1e-12
    assert moved(loop, np.roll(loop, 17, axis=0) + np.array([0.03, 0.0])) == pytest.approx(0.03, rel=1e-6)


def cells_reduced(content: Any) -> Any:
    """The content of a shipped sweep with four cells and two samples."""
    small = dict(content)
    if "grid" in small:
        small["grid"] = dict(small["grid"]) | {"links": [60, 180], "frequency": [10, 20]}
    if "samples" in small:
        small["samples"] = 2
    if "blocks" in small:
        small["blocks"] = [cells_reduced(block) for block in small["blocks"]]
    return small


def test_self_contacts_are_counted_and_compared(tmp_path: Path) -> None:
    """Walks that touch themselves before the third bounce, and walk half as far, are counted so and found so."""
    reduction = part("reduction")
    content = {
        "version": 1,
        "name": "paper_claims",
        "seed": 2,
        "preset": "soft",
        "samples": 8,
        "same_samples_along": ["start"],
        "grid": {"links": [60, 180], "frequency": [10, 20], "start": ["rest", "spinning", "ellipse"]},
    }

    def is_early(walk: PlannedWalk) -> bool:
        return walk.setup.scene.links == 180 and walk.setup.scene.start == "rest" and walk.sample % 2 == 0

    def outcome(walk: PlannedWalk) -> float:
        return walk.setup.scene.frequency * (1.0 if is_early(walk) else 2.0) * (1 + 0.001 * (walk.sample // 2))

    result = make_sweep(tmp_path / "made", content, outcome)
    block = result.blocks["main"]
    early = np.zeros(block.shape, bool)
    early[1, :, 0, ::2] = True
    touches = np.where(early, 2, 5)
    touches[0, 0, 2, 3] = -1
    columns = block.columns | {reduction.CONTACT: touches, reduction.COLLAPSE: touches + 1}
    found = reduction.starts(dataclasses.replace(block, columns=columns))
    short, long = found["rest"]["by_links"]
    assert (short["contact"], long["contact"]) == ([0, 0, 0, 0, 16, 0], [0, 0, 8, 0, 8, 0])
    assert long["collapse"] == [0, 0, 0, 8, 8, 0] and found["ellipse"]["by_links"][0]["contact"][-1] == 1
    assert "early_over_late" not in short
    ratio = reduction.effect_of(long["early_over_late"])
    assert float(ratio.relative) == pytest.approx(-0.5, abs=1e-9) and int(ratio.sign) == -1
    delay = reduction.effect_of(found["delay"])
    assert delay.relative[1] == pytest.approx([5 / 3.5 - 1] * 2) and delay.lost == 1
    faster = reduction.effect_of(found["rest"]["faster"])
    assert faster.relative == pytest.approx(1.0) and faster.sign.tolist() == [[1], [1]]


@pytest.mark.slow
def test_the_command_makes_page_numbers_and_figures(tmp_path: Path) -> None:
    """Sweeps in, page out: the numbers are enough to write the page again; foreign folders end in one line."""
    folders = []
    for name in ("paper_claims", "paper_joints", "paper_tolerance"):
        folders.append(tmp_path / name)
        make_sweep(folders[-1], cells_reduced(read_yaml(ROOT / f"sweeps/{name}.yaml")))
    folders.append(tmp_path / "paper_shapes")
    warpchain.sweep(cells_reduced(read_yaml(ROOT / "sweeps/paper_shapes.yaml")), folders[-1], progress=False)
    out = tmp_path / "out"

    def command(*words: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, ROOT / "docs/paper_claims.py", *words, "-o", out],
            capture_output=True,
            encoding="utf-8",
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )

    done = command(*folders)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    text = (out / "paper.md").read_text(encoding="utf-8")
    assert "{{" not in text and "nan" not in text
    drawn = {path.stem for path in (out / "figures").iterdir()}
    assert drawn == {f"paper_{name}" for name in ("distances", "effects", "friction", "impacts", "self_contacts")}
    (out / "paper.md").unlink()
    assert command().returncode == 0 and (out / "paper.md").read_text(encoding="utf-8") == text
    refused = command(tmp_path)
    assert refused.returncode == 2 and len(refused.stderr.splitlines()) == 1


def test_the_page_is_made_of_the_committed_numbers() -> None:
    """docs/paper.md is what `python docs/paper_claims.py` writes from docs/results/paper_claims.json."""
    numbers = json.loads((ROOT / "docs/results/paper_claims.json").read_text(encoding="utf-8"))
    text = part("page").page(numbers)
    assert (ROOT / "docs/paper.md").read_text(encoding="utf-8") == text, "run python docs/paper_claims.py"


def test_the_committed_numbers_are_those_of_the_shipped_sweeps() -> None:
    """What the numbers' sweeps vary and draw is what today's sweep files do, with as many samples."""
    numbers = json.loads((ROOT / "docs/results/paper_claims.json").read_text(encoding="utf-8"))
    for name in part("reduction").SWEEPS:
        sweep = load_sweep(ROOT / f"sweeps/{name}.yaml")
        assert numbers[name]["sweep"] == part("reduction").content_digest(sweep.canonical()), name
        assert numbers[name]["samples"] == {block.name: block.samples for block in sweep.blocks}
