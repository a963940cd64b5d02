"""The page without a server, sweeps on the live page, and what notebooks show."""

import html
import json
import re
import subprocess
import urllib.request
from pathlib import Path
from typing import Any

import pytest

import warpchain
from tests.live_page.test_page import OVER, distance, rounded, shown
from tests.support.browser import Page, browser  # noqa: F401
from tests.support.command_line import Command
from tests.support.made_walks import make_unreleased, make_walk
from warpchain.live_page import export
from warpchain.live_page.page import FIRST
from warpchain.live_page.server import LiveServer

SWEEP: dict[str, Any] = {
    "version": 1,
    "name": "small",
    "preset": "soft",
    "scene": {"start": "ellipse"},
    "grid": {"links": [40, 44], "frequency": [5, 8, 11]},
    "samples": 2,
    "seed": 5,
}


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[Any]]:
    """Axes of a page of two walks."""
    axes = {"links": [40], "frequency": [15], "floor": ["flat", "slope"]}
    monkeypatch.setattr(export, "AXES", axes)
    return axes


def test_a_page_without_a_server(few: dict[str, Any], command: Command, tmp_path: Path, browser: Page) -> None:  # noqa: F811
    """It loads nothing, plays from a file, says what the library finds, and keeps its choice in the address."""
    answer = command("live", "--export", "site")
    assert (answer.status, answer.out) == (0, "site/index.html\n")
    text = (tmp_path / "site/index.html").read_text(encoding="utf-8")
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)|\bsrc\s*=|\bhref\s*=|@import|\burl\(|{{", text)
    browser.size(390, 844)
    browser.errors.clear()
    shown(browser, (tmp_path / "site/index.html").as_uri())
    walks = {
        name: warpchain.walk(**FIRST | {"links": 40} | more) for name, more in (("flat", {}), ("slope", {"slope": 6}))
    }
    assert distance(browser.do("$('said').textContent")) == rounded(walks["flat"].dx)
    frame = browser.do("player.toggle(false), player.show(0), player.frame")
    browser.do("$('play').click()")
    browser.wait(f"player.frame > {frame}")
    assert browser.do("document.documentElement.scrollWidth") <= 390
    browser.do("$('floor').value = 1; $('said').textContent = ''; $('floor').dispatchEvent(new Event('change'))")
    browser.wait(OVER)
    assert distance(browser.do("$('said').textContent")) == rounded(walks["slope"].dx)
    shown(browser, browser.do("location.href"))
    assert distance(browser.do("$('said').textContent")) == rounded(walks["slope"].dx)
    joints = walks["slope"].frame_joints
    ends = browser.do("[player.walk.joints[0], player.walk.joints.at(-1)]")
    for found, frame in zip(ends, (joints[0], joints[-1]), strict=True):
        assert abs(frame.ravel() * 1e4 - found).max() < 20.0 and browser.errors == []


def test_equal_exports_have_equal_bytes(few: dict[str, Any], tmp_path: Path) -> None:
    """The page of today is that of tomorrow; another's file of its name is not replaced."""
    pages = [export.export_page(tmp_path / name).read_bytes() for name in "ab"]
    assert pages[0] == pages[1] == export.export_page(tmp_path / "a").read_bytes()
    (tmp_path / "c").mkdir()
    (tmp_path / "c/index.html").write_text("<!DOCTYPE html><title>my own</title>")
    with pytest.raises(OSError, match="has written"):
        export.export_page(tmp_path / "c")
    assert "my own" in (tmp_path / "c/index.html").read_text()


@pytest.mark.slow
@pytest.mark.thorough
def test_the_whole_page_without_a_server(tmp_path: Path) -> None:
    """Some 40 walks, in at most 3 MB; `.ci/run` asks that of the page that the documentation site has."""
    page = export.export_page(tmp_path)
    subprocess.run([Path(__file__).parents[2] / ".ci/live_page", page], check=True)


def test_a_cell_of_a_sweep_walks(tmp_path: Path, browser: Page) -> None:  # noqa: F811
    """Each cell is a point with its mean; a click, or Enter, walks its samples one after the other, to the bit."""
    result = warpchain.sweep(SWEEP, tmp_path / "small")
    server = LiveServer(0, tmp_path / "small")
    server.start()
    try:
        browser.size(1280)
        shown(browser, server.url)
        labels = browser.do("[...document.querySelectorAll('circle')].map(each => each.getAttribute('aria-label'))")
        means = result.statistics("dx").mean
        assert len(labels) == 6
        assert f"links = 40, frequency = 8 Hz: Δx = {float(f'{means[0, 1]:.3g}'):g}" in labels[1]
        for sample in (0, 1):
            browser.do(
                "$('said').textContent = ''; document.querySelectorAll('circle')[1].dispatchEvent(new Event('click'))"
            )
            browser.wait(OVER)
            assert distance(browser.do("$('said').textContent")) == rounded(result.dx[0, 1, sample])
            assert browser.do("[$('field-links').value, $('field-frequency').value]") == ["40", "8"]
            names: dict[str, Any] = {}
            exec(browser.do("$('line-python').textContent"), names)
            assert names["walk"].dx == result.dx[0, 1, sample]
        browser.do("$('said').textContent = ''; $('field-floor_friction').value = 0.5")
        browser.do("$('field-floor_friction').dispatchEvent(new Event('change'))")
        browser.wait(OVER)
        exec(browser.do("$('line-python').textContent"), names)
        assert names["walk"].setup.parameters.floor_friction == 0.5 and names["walk"].setup.scene.frequency == 8
        assert names["walk"].setup.scene.phase == result.phase_drawn[0, 1, 1]
        assert distance(browser.do("$('said').textContent")) == rounded(names["walk"].dx)
        for beside in ({"seed": 1}, {"preset": "soft"}, {"links": 31}):
            with pytest.raises(warpchain.InputError, match=r"^(index|scene\.links): "):
                server.walker.setup({"index": 1, **beside})
        with pytest.raises(
            warpchain.InputError, match=r"^index: expected a number in the column index, at most 11, got 99"
        ):
            server.walker.setup({"index": 99})
    finally:
        server.close()


def test_what_a_notebook_shows(tmp_path: Path, browser: Page) -> None:  # noqa: F811
    """A walk has its player, and the picture for who sees no frames; without frames there is just the text."""
    walk = make_walk()
    page = walk._repr_html_()
    assert page.count("<iframe") == 1 and "data:image/png;base64," in page and "at_rest" in page
    assert "<iframe" not in make_unreleased()._repr_html_()
    (tmp_path / "cell.html").write_text(f"<!DOCTYPE html><meta charset=utf-8><body>{page}", encoding="utf-8")
    browser.size(1000)
    browser.errors.clear()
    browser.open((tmp_path / "cell.html").as_uri())
    inner = "document.querySelector('iframe').contentWindow"
    browser.wait(f"{inner}.eval('player.frame') > 2")
    assert browser.do(f"{inner}.eval('player.walk.joints.length')") == 41 and browser.errors == []


def test_the_page_in_a_notebook() -> None:
    """`warpchain.live()` shows the page in a frame, with an address that works until it is closed."""
    page = warpchain.live()
    found = re.search(r'src="([^"]+)"', page._repr_html_())
    assert found is not None and html.unescape(found[1]) == page.url and page.url in repr(page)
    with urllib.request.urlopen(page.url) as answer:
        assert b"A walking roller chain" in answer.read()
    page.close()
    with pytest.raises(OSError):
        urllib.request.urlopen(page.url, timeout=2)


def test_the_command_opens_what_it_is_given(command: Command, tmp_path: Path) -> None:
    """What is no sweep, a port that is no number, or an export beside a folder is refused in one line."""
    for arguments, told in (
        (["nothing"], "error: nothing: "),
        (["--port", "x"], "error: Invalid value for '--port'"),
        (["--export", "site", "nothing"], "error: --export: "),
    ):
        answer = command("live", *arguments)
        assert answer.status == 2 and answer.err.startswith(told) and answer.err.count("\n") == 1
    assert json.dumps(sorted(path.name for path in tmp_path.iterdir())) == "[]"
