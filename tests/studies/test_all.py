"""All studies by one command: what they run, with which numerics they were computed, and that pages say so."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

import warpchain
from studies import all as every
from studies import numerics
from studies.common import read_columns, write_rows
from tests.support.made_sweeps import SMALL, make_sweep
from warpchain.sweeps.plan import load_sweep
from warpchain.version import NUMERICS_VERSION

STUDIES: dict[str, Any] = yaml.safe_load(numerics.TABLE.read_text(encoding="utf-8"))
FOLDER = numerics.TABLE.parent


def options_of(step: every.Step) -> dict[str, int]:
    """Seed and samples with which a step replaces those of its file."""
    words = step.arguments
    return {name: int(words[words.index(f"--{name}") + 1]) for name in ("seed", "samples") if f"--{name}" in words}


def test_every_sweep_of_every_study_is_run_with_the_walks_that_the_table_says() -> None:
    """Folders with a page are the studies; every file of a sweep is run, has so many walks and an expected time."""
    assert {path.parent.name for path in FOLDER.glob("*/README.md")} == STUDIES.keys()
    sweeps = [step for step in every.steps([]) if step.walks]
    assert {path.resolve() for path in FOLDER.glob("*/sweeps/*.yaml")} <= {
        Path(step.arguments[2]).resolve() for step in sweeps
    }
    times = every.read_times()
    for step in sweeps:
        assert load_sweep(numerics.ROOT / step.arguments[2], **options_of(step)).walk_count == step.walks, step.name
        assert step.expected(times)[0] > 0, step.name
    seeds = [(step.study, step.arguments[2], options_of(step).get("seed")) for step in sweeps]
    assert len(set(seeds)) == len(seeds)


def test_the_changelog_knows_the_numerics_of_the_package() -> None:
    """Its newest version is the package's, and each older one down to the oldest result has a row."""
    assert numerics.today() == NUMERICS_VERSION
    oldest = min(version for study in STUDIES for version in numerics.of_study(study))
    assert sorted(numerics.effects()) == list(range(min(numerics.effects()), NUMERICS_VERSION + 1))
    assert oldest in numerics.effects()


@pytest.mark.parametrize("study", STUDIES)
def test_a_page_says_that_walks_have_changed_since(study: str) -> None:
    """A page whose walks have changed beyond their scatter has the line that says so, and no other page has one."""
    page = (FOLDER / study / "README.md").read_text(encoding="utf-8")
    assert numerics.with_line(study, page) == page, f"out of date; run python -m studies.numerics {study}"


def test_readme_says_with_which_numerics_the_paper_was_tested() -> None:
    """Its agreement with the paper has the versions of the paper's page, while walks have changed since."""
    text = (numerics.ROOT / "README.md").read_text(encoding="utf-8")
    if numerics.line("paper"):
        *earlier, last = map(str, sorted(numerics.of_study("paper")))
        assert f"with numerics {', '.join(earlier)} and {last}" in text


@pytest.mark.parametrize(
    ("effect", "is_beyond"),
    [
        ("−0.002 ± 0.010 % (12,800 walks); single walks change", False),
        ("−0.08 ± 0.07 %", False),
        ("none for Table 1's chain", False),
        ("in the last digits of tilting walks", False),
        ("−0.15 ± 0.07 %", True),
        ("none for Table 1's chain; up to 9 % for heavy chains", True),
        ("−0.3 % for slow long chains", True),
        ("only walks that ended too early", True),
        ("all others −0.003 ± 0.008 % (ellipse)", False),
    ],
)
def test_effects_are_told_apart(effect: str, is_beyond: bool) -> None:
    """What is within two standard errors, or said to be none, makes no result stale; everything else does."""
    assert numerics.is_beyond_scatter(effect) == is_beyond


def test_a_version_that_changes_walks_makes_pages_stale(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a version that changes Δx every page needs another line; after one that changes none no page does."""
    before, known, new = {study: numerics.line(study) for study in STUDIES}, numerics.effects(), NUMERICS_VERSION + 1
    monkeypatch.setattr(numerics, "effects", lambda: {new: "+0.001 ± 0.010 %", **known})
    assert {study: numerics.line(study) for study in STUDIES} == before
    monkeypatch.setattr(numerics, "effects", lambda: {new: "−1 % for all", **known})
    stale = [study for study in STUDIES if before[study]]
    assert all(f" and {new} have [changed" in " ".join(numerics.line(study).split()) for study in stale)
    assert all(str(new) in numerics.line(study) for study in STUDIES)


def test_files_of_results_say_what_they_are_of(tmp_path: Path) -> None:
    """Numerics and seed of a sweep stand in the first line, which readers leave out; a file without is refused."""
    result = make_sweep(tmp_path / "sweep", SMALL)
    write_rows(tmp_path / "rows.csv", [{"links": 60, "dx": 0.5}], result)
    first = (tmp_path / "rows.csv").read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith(f"# numerics {NUMERICS_VERSION}; seed 6; python -m ")
    assert numerics.of_file(tmp_path / "rows.csv") == {NUMERICS_VERSION}
    assert read_columns(tmp_path / "rows.csv")["dx"].tolist() == [0.5]
    (tmp_path / "bare.csv").write_text("links,dx\n60,0.5\n", encoding="utf-8")
    with pytest.raises(ValueError, match="numerics N"):
        numerics.of_file(tmp_path / "bare.csv")


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A checkout whose only study has a sweep of two short walks and a command that counts them."""
    folder = tmp_path / "checkout/studies/small"
    (folder / "sweeps").mkdir(parents=True)
    for name in ("common.py", "numerics.py"):
        shutil.copy(FOLDER / name, folder.parent)
    shutil.copy(numerics.ROOT / "CHANGELOG.md", tmp_path / "checkout")
    (folder / "README.md").write_text("# Small\n\n## Findings\n\nNone yet.\n", encoding="utf-8")
    sweep = {"version": 1, "name": "tiny", "seed": 3, "preset": "soft", "samples": 2}
    sweep |= {"scene": {"start": "ellipse", "links": 30, "walk_limit": 0.05}}
    (folder / "sweeps/tiny.yaml").write_text(yaml.safe_dump(sweep), encoding="utf-8")
    (folder / "count.py").write_text(
        "import sys, warpchain\n"
        "from pathlib import Path\n"
        "from studies.common import write_rows\n"
        "result = warpchain.load(sys.argv[1])\n"
        "path = Path(__file__).parent / 'results/count.csv'\n"
        "write_rows(path, [{'walks': result.walk_count}], result)\n"
        "sys.exit(Path('fails').exists())\n",
        encoding="utf-8",
    )
    table = folder.parent / "all.yaml"
    content = {"small": {"sweeps": {"tiny": {"walks": 2}}, "commands": ["studies.small.count tiny"]}}
    table.write_text(yaml.safe_dump(content), encoding="utf-8")
    times = folder.parent / "times.csv"
    times.write_text(
        "# Times\nstudy,step,walks,device,devices,seconds,numerics\nsmall,old,1,CPU,1,1,17\n", encoding="utf-8"
    )
    for name, value in (("TABLE", table), ("ROOT", tmp_path / "checkout")):
        monkeypatch.setattr(numerics, name, value)
    monkeypatch.setattr(every, "TIMES", times)
    yield tmp_path / "checkout"


def test_a_study_runs_resumes_and_keeps_its_times(small: Path, tmp_path: Path) -> None:
    """After a command has failed the sweep is not run again; rows of results, times and the page's line are there."""
    runs, rows = tmp_path / "runs", small / "studies/small/results/count.csv"
    (small / "fails").touch()
    with pytest.raises(warpchain.InputError, match="failed: small at"):
        every.main(runs=runs)
    began = json.loads((runs / "ended.json").read_text(encoding="utf-8"))
    assert [row["step"] for row in began.values()] == ["tiny"] and next(iter(began.values()))["walks"] == 2
    with pytest.raises(warpchain.InputError, match="already exists; use --resume"):
        every.main(runs=runs)
    (small / "fails").unlink()
    every.main(runs=runs, resume=True)
    ended = json.loads((runs / "ended.json").read_text(encoding="utf-8"))
    assert began.items() <= ended.items() and len(ended) == 2
    first = f"# numerics {NUMERICS_VERSION}; seed 3; python -m studies.small.count tiny\nwalks\n2\n"
    assert rows.read_text(encoding="utf-8") == first
    assert every.read_times().index.tolist() == ["old", "tiny", "studies.small.count tiny"]
    assert "Computed with" not in (small / "studies/small/README.md").read_text(encoding="utf-8")
    with pytest.raises(warpchain.InputError, match="unknown name large"):
        every.main(only=["large"], show=True)


def test_the_list_runs_nothing() -> None:
    """The command prints all studies, walks and the sum of their times."""
    command = [sys.executable, "-m", "studies.all", "--list", "--only", "charm"]
    shown = subprocess.run(command, cwd=numerics.ROOT, capture_output=True, text=True, check=True).stdout
    assert "| charm | charm | 10,200 | 14 |" in shown and "10,200 walks, 0 min of one GPU" in shown
