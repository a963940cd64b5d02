"""The study of films makes its tables and figures of made banks, whose chains nobody simulated."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from studies.films import calibration, drawing, run
from tests.support.made_films import films_of, made_bank
from warpchain import InputError, films

EXPERIMENTS = ((60, 5.0), (60, 20.0))


@pytest.fixture(scope="module")
def banks() -> tuple[films.Bank, films.Bank]:
    """A bank, and hidden chains."""
    return made_bank(80, 1, experiments=EXPERIMENTS), made_bank(40, 2, experiments=EXPERIMENTS)


def test_calibration_tells_a_bank_that_knows_from_one_that_does_not(banks: tuple[films.Bank, films.Bank]) -> None:
    """Hidden chains as the bank's are covered; if the floor was 5 mm lower than any camera's error, they are not."""
    bank, truths = banks
    good = calibration.calibrate(bank, truths, run.PAIR)
    assert good.refused < 0.2 and (good.coverage(1.96) > 0.8).all() and (np.abs(good.bias) < 0.6).all()
    wide = calibration.calibrate(bank, truths, run.PAIR, shared=np.array([0, 0, 0, 0, -0.004, 0.004, 0, 0, 0]))
    assert wide.refused > 0.5 or wide.coverage(1.96)[1] < 0.5
    assert "2 films: 5, 20 Hz" in run.SETS and len(list(run.calibration_rows(good))) == 3


def test_tables_and_figures_are_made(banks: tuple[films.Bank, films.Bank], tmp_path: Path) -> None:
    """Of both experiments, of the friction lines, of the coverage and of a posterior."""
    bank, truths = banks
    assert [line[:16] for line in run.lines_table({"made": bank}).splitlines()[2:]] == [
        "| made | 60/5 | ",
        "| made | 60/20 |",
    ]
    found = calibration.calibrate(bank, truths, run.SETS["1 film: 20 Hz"])
    drawing.coverage_figure({"1 film": found}).savefig(tmp_path / "coverage.png")
    answer = bank.posterior(films_of(bank, 0, 1, films.Camera(), 0)[:1])
    drawing.corner(answer).savefig(tmp_path / "corner.png")
    assert min(path.stat().st_size for path in tmp_path.iterdir()) > 10_000


def test_the_hidden_chain_is_in_its_films() -> None:
    """The committed films are read, their friction line is that of the hidden chain."""
    folder = run.FOLDER / "hidden"
    truth = yaml.safe_load((folder / "truth.yaml").read_text(encoding="utf-8"))
    seen = films.read(folder / "60_links_20_Hz.txt", links=60, frequency=20.0, unit="mm", speed=7.648)
    line = films.friction_line(seen)
    assert drawing.line_figure(line).axes[0].get_legend_handles_labels()[1][0].startswith("$μ$ = ")
    assert abs(line.friction - truth["floor_friction"]) < 3 * line.error < 0.02


def test_dropped_frames_are_seen_in_the_fall() -> None:
    """Every tenth frame gone and the rest renumbered, as phones and programs do: 0.281 ± 0.002, once, for 0.231."""
    path = run.FOLDER / "hidden/60_links_20_Hz.txt"
    seen = films.read(path, links=60, frequency=20.0, unit="mm", speed=7.648)
    refused = 0
    for first in range(10):
        kept = np.arange(len(seen.time)) % 10 != first
        center, time = seen.center[kept], np.arange(kept.sum()) / 240
        before = np.count_nonzero(kept[seen.time < 0])
        dropped = replace(seen, time=time - time[before] + seen.time[kept][before], center=center)
        try:
            films.friction_line(dropped)
        except InputError as error:
            assert re.match(r"film: it falls with 1[012]\.\d ± 0\.\d m/s² from .* frames were dropped", str(error))
            refused += 1
    assert refused == 10
