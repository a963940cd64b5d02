"""The report of a sweep: what it says, that it stands alone, and that a browser shows it."""

import html
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.command_line import Command
from tests.support.made_sweeps import FIGURE_6, SMALL, distance, make_sweep
from tests.support.made_walks import make_unreleased, make_walk
from warpchain.inputs.validation import InputError
from warpchain.reports import sweep_page
from warpchain.reports.sweep_page import write_report
from warpchain.results.sweep_result import load
from warpchain.results.walk_result import WalkResult
from warpchain.status import Status
from warpchain.sweeps.plan import PlannedWalk, load_sweep

CONTENT = SMALL | {"options": {"method": "explicit"}, "distributions": {"gravity": {"uniform": [9.0, 10.0]}}}


def flawed(walk: PlannedWalk) -> float | Status | None:
    """Two failures, and a walk that has not been run yet."""
    return {3: Status.TIME_LIMIT, 13: Status.NOT_FINITE, 17: None}.get(walk.index, distance(walk))


def test_walks_that_ended_as_planned_are_no_failures(tmp_path: Path, command: Command) -> None:
    """`finished` and `distance_limit` are no failures in page and table; plot says what can be drawn of them."""
    content = FIGURE_6 | {"samples": 1, "blocks": [{"name": "only", "grid": {"frequency": [10, 20]}}]}
    ends = {0: Status.FINISHED, 1: Status.DISTANCE_LIMIT}
    directory = tmp_path / "sweep"
    make_sweep(directory, content, lambda walk: ends[walk.index])
    write_report(directory, tmp_path / "page.html")
    document = Document((tmp_path / "page.html").read_text())
    assert document.texts["failed-walks"].strip().endswith("None.")
    head, *rows = document.rows["cells"]
    assert [dict(zip(head, row, strict=True))["failed"] for row in rows] == ["0", "0"]
    assert [dict(zip(head, row, strict=True))["ended as asked"] for row in rows] == ["1", "1"]
    answer = command("info", str(directory))
    assert answer.status == 0 and "ended as asked" in answer.out
    with pytest.raises(InputError, match="no walk has this quantity; use another"):
        load(directory).plot()


class Document:
    """Text of a page by section, rows of its tables, its images and frames."""

    def __init__(self, page: str) -> None:
        """Parse a page."""
        sections = dict(re.findall(r'<section id="([^"]*)">(.*?)</section>', page, re.DOTALL))
        self.texts = {name: _text(given) for name, given in sections.items()}
        self.rows = {
            name: [
                [_text(cell) for cell in re.findall(r"<t[dh]\b[^>]*>(.*?)</t[dh]>", row, re.DOTALL)]
                for row in re.findall(r"<tr\b[^>]*>(.*?)</tr>", given, re.DOTALL)
            ]
            for name, given in sections.items()
        }
        self.images = re.findall(r'<img alt="[^"]+"[^>]* src="([^"]*)"', page)
        self.frames = list(map(html.unescape, re.findall(r'<iframe[^>]* srcdoc="([^"]*)"', page)))


def _text(content: str) -> str:
    """What HTML says, without its elements."""
    return html.unescape(re.sub(r"<[^>]*>", "", content))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep with failures, not yet complete."""
    path: Path = tmp_path_factory.mktemp("report") / "sweep"
    make_sweep(path, CONTENT, flawed)
    return path


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the figures, which take most of the time."""
    monkeypatch.setattr(sweep_page, "figures", lambda result: [])


@pytest.fixture(scope="module")
def page(folder: Path) -> str:
    """Its report, without an animation."""
    path = folder.parent / "report.html"
    write_report(folder, path)
    return path.read_text(encoding="utf-8")


def with_walk(monkeypatch: pytest.MonkeyPatch, made: Callable[..., WalkResult], **changes: Any) -> list[Any]:
    """Let run_walk give a made-up walk; the setups it is asked for."""
    asked: list[Any] = []

    def run_walk(setup: Any, *, frame_interval: float, **more: Any) -> WalkResult:
        assert frame_interval > 0
        asked.append(setup)
        return made(**changes)

    monkeypatch.setattr("warpchain.results.one_walk.run_walk", run_walk)
    return asked


# What it says


def test_cells(folder: Path, page: str) -> None:
    """Every cell of every block is in a table, with its mean, spread and counts."""
    rows = Document(page).rows["cells"]
    assert rows[0] == ["n", "ν / Hz", "mean Δx / m", "s.d. / m", "s.e. / m", "at rest", "failed"]
    assert len(rows) == 2 + 4 + 2
    dx = load(folder).blocks["rest"].dx
    sample = dx[0, 1, 1:]
    mean, sd = sample.mean(), sample.std(ddof=1)
    assert rows[2] == ["60", "20", f"{mean:.4f}*", f"{sd:.4f}", f"{sd / 2**0.5:.4f}", "2", "1"]
    assert rows[5][-1] == "not run yet" and rows[7][-3:] == ["2", "0", "1"]


def test_failed_walks(page: str) -> None:
    """Each failed walk is named with its block, cell and sample, under what its status means."""
    document = Document(page)
    assert document.rows["failed-walks"] == [
        ["walk", "block", "cell", "sample"],
        ["1", "rest", "n = 60, ν = 20 Hz", "0"],
        ["walk", "block", "cell", "sample"],
        ["10", "ellipse", "n = 120, ν = 10 Hz", "1"],
    ]
    for status in (Status.TIME_LIMIT, Status.NOT_FINITE):
        assert f"{status.label}: 1" in document.texts["failed-walks"]
        assert status.sentence in document.texts["failed-walks"]
    assert Status.NOT_STEADY.sentence not in document.texts["failed-walks"]


def test_sweep_can_be_run_again(folder: Path, page: str) -> None:
    """The file on the page gives the same sweep, and the digest stands under provenance."""
    text = re.search(r"<pre>(.*?)</pre>", page, re.DOTALL)
    assert text
    again = load_sweep(yaml.safe_load(html.unescape(text[1])))
    provenance = dict(Document(page).rows["provenance"])
    assert again.digest() == load(folder).provenance["digest"] == provenance["digest"]
    assert again.name == CONTENT["name"] and provenance["seed"] == "6"
    assert '"warp-lang": "1.' in provenance["versions"]


# One walk in motion


@pytest.mark.usefixtures("no_figures")
def test_walk_is_run_again(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The chosen walk is run from its planned setup, shown in a player, and compared with the sweep's."""
    result = load(folder)
    dx = float(result.blocks["ellipse"].dx[0, 1, 0])
    asked = with_walk(monkeypatch, make_walk, dx=dx)
    write_report(folder, tmp_path / "report.html", animation_of=5)
    document = Document((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert asked == [load_sweep(result.sweep).walk(5).setup]
    text = document.texts["one-walk"]
    assert f"Walk 5 (block ellipse, n = 120, ν = 20 Hz, sample 0), run again for this page: Δx = {dx:.4f} m" in text
    assert "The sweep has the same, bit for bit." in text
    assert len(document.images) == 2
    (player,) = document.frames
    assert player.startswith("<!DOCTYPE html>") and "getElementById" in player
    drawn = {row[0]: row[1:] for row in document.rows["one-walk"]}
    assert drawn["gravity"] == [f"{result.blocks['ellipse'].gravity_drawn[0, 1, 0]:g}", "m/s²"]


@pytest.mark.parametrize(
    ("index", "dx", "text"),
    [(0, 9.0, "another result, Δx = "), (1, 9.0, "another result, time_limit"), (17, 9.0, "has not run it yet")],
)
@pytest.mark.usefixtures("no_figures")
def test_another_result_is_admitted(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, index: int, dx: float, text: str
) -> None:
    """If the walk came out otherwise than in the sweep, or was never run there, the page says so."""
    with_walk(monkeypatch, make_walk, dx=dx)
    write_report(folder, tmp_path / "report.html", animation_of=index)
    assert text in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("no_figures")
def test_walk_without_pictures(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A failed walk that can't be shown leaves the reason in its place."""
    with_walk(monkeypatch, make_unreleased)
    write_report(folder, tmp_path / "report.html", animation_of=13)
    document = Document((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "No moving picture: walk: it has no frames" in document.texts["one-walk"]
    assert not document.frames and not document.images


@pytest.mark.usefixtures("no_figures")
def test_a_walk_is_run_again_on_another_device(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    """With --device the walk is that of the sweep but for where it runs; without --walk there is nothing to run."""
    asked = with_walk(monkeypatch, make_walk)
    for arguments in (["--walk", "15"], ["--walk", "15", "--device", "cuda:1"]):
        assert command("report", str(folder), "-o", "report.html", *arguments).status == 0
    there, here = asked[1], asked[0]
    assert (here.options.device, there.options.device) == ("cpu", "cuda:1")
    assert (here.scene, here.parameters) == (there.scene, there.parameters)
    Path("report.html").unlink()
    assert command("report", str(folder), "-o", "report.html", "--device", "cpu").status == 2
    assert not list(tmp_path.iterdir())


# The file


@pytest.mark.usefixtures("no_figures")
def test_report_stands_alone(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No address of anything outside is in the page, the player included, and the browser is told to load nothing."""
    with_walk(monkeypatch, make_walk)
    write_report(folder, tmp_path / "report.html", animation_of=0)
    page = html.unescape((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert not re.findall(r"https?:|ftp:|@import|url\(|<link|<script[^>]*src|\bfetch\(|XMLHttp|\bimport\(", page)
    sources = re.findall(r'\b(?:src|href|action|data|poster)="([^"]*)"', page)
    assert sources and all(source.startswith(("data:image/png;base64,", "#")) for source in sources)
    assert "default-src 'none'" in page


def test_report_is_the_same_each_time(folder: Path, page: str, tmp_path: Path) -> None:
    """A folder gives the same bytes each time, and an older report is replaced."""
    (tmp_path / "report.html").write_text(page[: len(page) // 2], encoding="utf-8")
    write_report(folder, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page


@pytest.mark.parametrize("content", ["", "old", "<!DOCTYPE html>\n<html>my own page</html>", None])
def test_a_report_replaces_reports_only(folder: Path, tmp_path: Path, content: str | None) -> None:
    """A page of another writer, the player of an animation (None) or any other file is refused and stays."""
    target = tmp_path / "index.html"
    if content is None:
        make_walk().animate(target)
    else:
        target.write_text(content, encoding="utf-8")
    before = target.read_bytes()
    with pytest.raises(
        OSError, match=r"index\.html: already exists and is not a page that warpchain report has written; use"
    ):
        write_report(folder, target)
    assert target.read_bytes() == before and list(tmp_path.iterdir()) == [target]
