"""The study of videos makes its tables and figures of made training_sets, whose chains nobody simulated."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from studies.video import calibration, drawing, run
from tests.support.made_videos import made_training_set, videos_of
from warpchain import InputError, video

EXPERIMENTS = ((60, 5.0), (60, 20.0))


@pytest.fixture(scope="module")
def training_sets() -> tuple[video.TrainingSet, video.TrainingSet]:
    """A training set, and hidden chains."""
    return made_training_set(80, 1, experiments=EXPERIMENTS), made_training_set(40, 2, experiments=EXPERIMENTS)


def test_calibration_tells_a_training_set_that_knows_from_one_that_does_not(
    training_sets: tuple[video.TrainingSet, video.TrainingSet],
) -> None:
    """Chains like the training set's are covered; with a floor 5 mm too low, beyond a camera's error, they are not."""
    training, truths = training_sets
    good = calibration.calibrate(training, truths, run.PAIR)
    assert good.refused < 0.2 and (good.coverage(1.96) > 0.8).all() and (np.abs(good.bias) < 0.6).all()
    wide = calibration.calibrate(training, truths, run.PAIR, shared=np.array([0, 0, 0, 0, -0.004, 0.004, 0, 0, 0]))
    assert wide.refused > 0.5 or wide.coverage(1.96)[1] < 0.5
    assert "2 videos: 5, 20 Hz" in run.SETS and len(list(run.calibration_rows(good))) == 3


def test_tables_and_figures_are_made(
    training_sets: tuple[video.TrainingSet, video.TrainingSet], tmp_path: Path
) -> None:
    """Of both experiments, of the friction lines, of the coverage and of a posterior."""
    training, truths = training_sets
    assert [line[:16] for line in run.lines_table({"made": training}).splitlines()[2:]] == [
        "| made | 60/5 | ",
        "| made | 60/20 |",
    ]
    found = calibration.calibrate(training, truths, run.SETS["1 video: 20 Hz"])
    drawing.coverage_figure({"1 video": found}).savefig(tmp_path / "coverage.png")
    answer = training.posterior(videos_of(training, 0, 1, video.Camera(), 0)[:1])
    drawing.corner(answer).savefig(tmp_path / "corner.png")
    assert min(path.stat().st_size for path in tmp_path.iterdir()) > 10_000


def test_the_hidden_chain_is_in_its_video() -> None:
    """The committed videos are read, their friction line is that of the hidden chain."""
    folder = run.FOLDER / "hidden"
    truth = yaml.safe_load((folder / "truth.yaml").read_text(encoding="utf-8"))
    seen = video.read(folder / "60_links_20_Hz.txt", links=60, frequency=20.0, unit="mm", speed=7.648)
    line = video.friction_line(seen)
    assert drawing.line_figure(line).axes[0].get_legend_handles_labels()[1][0].startswith("$μ$ = ")
    assert abs(line.friction - truth["floor_friction"]) < 3 * line.error < 0.02


def test_dropped_frames_are_seen_in_the_fall() -> None:
    """Every tenth frame gone and the rest renumbered, as phones and programs do: 0.281 ± 0.002, once, for 0.231."""
    path = run.FOLDER / "hidden/60_links_20_Hz.txt"
    seen = video.read(path, links=60, frequency=20.0, unit="mm", speed=7.648)
    refused = 0
    for first in range(10):
        kept = np.arange(len(seen.time)) % 10 != first
        center, time = seen.center[kept], np.arange(kept.sum()) / 240
        before = np.count_nonzero(kept[seen.time < 0])
        dropped = replace(seen, time=time - time[before] + seen.time[kept][before], center=center)
        try:
            video.friction_line(dropped)
        except InputError as error:
            assert re.match(r"video: .* got 1[012]\.\d ± 0\.\d m/s² from .* dropped frames", str(error))
            refused += 1
    assert refused == 10
