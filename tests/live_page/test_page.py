"""The live page in a real browser."""

import json
import math
import re
import shlex
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.browser import Page, browser  # noqa: F401
from tests.support.command_line import Command
from warpchain.live_page.page import FIRST, STAIRS
from warpchain.live_page.server import LiveServer

SMALL = "#links=40&preset=soft&start=ellipse"
"""A walk that takes a tenth of a second."""
OVER = "/^(Δx|No walk|[a-z ]+: )/.test($('said').textContent)"


@pytest.fixture(scope="module")
def server() -> Iterator[LiveServer]:
    """A server in this process."""
    server = LiveServer()
    server.start()
    yield server
    server.close()


@pytest.fixture
def page(browser: Page, server: LiveServer) -> Iterator[Page]:  # noqa: F811
    """The page with a small walk, over, at 1280 pixels; at the end no script has failed."""
    browser.size(1280)
    browser.errors.clear()
    shown(browser, server.url + SMALL)
    yield browser
    assert browser.errors == []


def shown(page: Page, address: str) -> None:
    """Open an address and wait until its walk is over."""
    page.open(address)
    page.wait(OVER)


def given(page: Page, name: str, value: object, field: str = "field-") -> str:
    """Set a control as a user does, and wait for what is said then."""
    page.do(f"$('said').textContent = ''; $('{field}{name}').value = {json.dumps(value)}")
    page.do(f"$('{field}{name}').dispatchEvent(new Event('change'))")
    page.wait(OVER)
    return str(page.do("$('said').textContent"))


def distance(text: str) -> float:
    """The distance that is said."""
    found = re.match(r"Δx = (\S+) m", text)
    assert found is not None, text
    return float(found[1])


def rounded(value: float) -> float:
    """A distance as it is said."""
    return float(f"{value:.4g}")


def test_the_first_chain_moves(browser: Page, server: LiveServer) -> None:  # noqa: F811
    """The page plays the walk of its address, frame after frame, and says what `warpchain.walk` finds."""
    browser.size(1280)
    shown(browser, server.url)
    browser.do("player.toggle(false); player.show(0); $('play').click()")  # it may be over already
    browser.wait("player.playing && player.frame > 3")
    walk = warpchain.walk(**FIRST)
    assert distance(browser.do("$('said').textContent")) == rounded(walk.dx)
    assert browser.do(
        "new Set([...document.querySelectorAll('#numbers th')].map(e => e.textContent)).has('joint friction')"
    )
    assert browser.do("player.walk.time.length") == pytest.approx(walk.walk_time / 4e-3, abs=2)


def test_a_slider_and_its_address(page: Page, server: LiveServer) -> None:
    """Another value is another walk; the set-up stands in the address, and the address gives the same walk."""
    before = page.do("$('said').textContent")
    after = given(page, "floor_friction", "0.5", "range-")
    assert after != before and page.do("$('field-floor_friction').value") == "0.5"
    setup = {"links": 40, "preset": "soft", "start": "ellipse", "floor_friction": 0.5}
    assert distance(after) == rounded(warpchain.walk(**setup).dx)  # type: ignore[arg-type]
    given(page, "seed", "7")
    address, said = page.do("location.href"), page.do("$('said').textContent")
    assert distance(said) == rounded(warpchain.walk(**setup, seed=7).dx)  # type: ignore[arg-type]
    joints = page.do("player.walk.joints")
    shown(page, address)
    assert page.do("$('said').textContent") == said and page.do("player.walk.joints") == joints
    assert page.do("[$('field-seed').value, $('field-preset').value, $('field-links').value]") == ["7", "soft", "40"]


def test_a_refusal_stands_beside_its_control(page: Page) -> None:
    """The words are the package's; the next possible value takes them away."""
    for name, value in {"links": "31", "frequency": "-1", "clearance": "-5", "floor": "[[0, 0]]", "seed": "-1"}.items():
        with pytest.raises(warpchain.InputError) as refused:
            warpchain.walk(**{name: json.loads(value)})
        before = page.do(f"$('field-{name}').value")
        given(page, name, value)
        assert page.do(f"$('no-{name}').textContent") == str(refused.value)
        assert page.do(f"$('field-{name}').getAttribute('aria-describedby')") == f"no-{name}"
        if name == "floor" or name == "seed":
            before = {"floor": "flat", "seed": ""}[name]
        assert given(page, name, before).startswith("Δx") and page.do(f"$('no-{name}').textContent") == ""


def test_what_runs_is_ended_by_the_next_slider(page: Page) -> None:
    """Ten clicks a second: what is shown at the end is the last set-up."""
    for friction in range(10):
        page.do(f"$('range-floor_friction').value = {0.1 + friction / 50}")
        page.do("$('range-floor_friction').dispatchEvent(new Event('change'))")
        page.wait("true")
    page.do("$('said').textContent = ''")
    page.wait(OVER)
    walk = warpchain.walk(links=40, preset="soft", start="ellipse", floor_friction=0.28)
    assert distance(page.do("$('said').textContent")) == rounded(walk.dx)


def test_samples_of_two_sides(page: Page) -> None:
    """Mean, standard error and the difference of equal samples are those of the walks of the library."""

    def sampled() -> list[list[float]]:
        page.do("$('more').click()")
        page.wait("$('more').disabled === false && samples.length")
        text = page.do("$('statistics').textContent")
        return [[float(part) for part in each] for each in re.findall(r"(-?[\d.]+) ± ([\d.e-]+) m", text)]

    setup: dict[str, Any] = {"links": 40, "preset": "soft", "start": "ellipse"}
    one = np.array([warpchain.walk(**setup, seed=seed).dx for seed in range(12)])
    ((mean, error),) = sampled()
    assert mean == pytest.approx(one.mean(), rel=1e-3) and error == pytest.approx(one.std(ddof=1) / 12**0.5, rel=0.05)
    page.do("$('said').textContent = ''; $('compare').click()")
    page.wait(OVER)
    given(page, "floor_friction", "0.5")
    two = np.array([warpchain.walk(**setup, floor_friction=0.5, seed=seed).dx for seed in range(12)])
    apart = two - one
    for (mean, error), values in zip(sampled(), (one, two, apart), strict=True):
        assert mean == pytest.approx(values.mean(), rel=2e-3, abs=1e-4)
        assert error == pytest.approx(values.std(ddof=1) / 12**0.5, rel=0.05)
    assert page.do("document.querySelectorAll('#histogram rect').length") > 12
    assert page.do("$('side-a').hidden") is False and page.do("other.walk.joints.length") > 10
    shown(page, page.do("location.href"))
    assert page.do("sideA.links") == 40 and page.do("setup.floor_friction") == 0.5


def test_samples_are_cancelled(page: Page, server: LiveServer) -> None:
    """The bar shows how far they are; a button, or another set-up, ends them, and none comes after that."""
    for ending in ("$('cancel').click()", "$('reset').click()"):
        shown(page, f"{server.url}{SMALL}&frequency=12")
        page.do("$('more').click()")
        page.wait("samples.length >= 1")
        assert page.do("[$('cancel').hidden, $('bar').hidden, $('bar').value > 0]") == [False, False, True]
        page.do(f"$('said').textContent = ''; {ending}")
        page.wait("$('cancel').hidden && !$('more').disabled")
        count = page.do("samples.length")
        page.do("new Promise(done => setTimeout(done, 300))")
        assert page.do("samples.length") == count < 12
    page.wait(OVER)
    assert page.do("document.querySelectorAll('.refusal:not(:empty), .problem:not(:empty)').length") == 0


def test_a_lesson(page: Page) -> None:
    """Friction, length, slope, stairs and a pushed link, one after the other on one page."""
    told = [
        given(page, "floor_friction", "0.3", "range-"),
        given(page, "links", "60", "range-"),
        given(page, "slope", "6"),
    ]
    page.do("$('said').textContent = ''; $('shape').value = 'stairs'; $('shape').dispatchEvent(new Event('change'))")
    page.wait(OVER)
    assert page.do("$('no-slope').textContent").startswith("scene.slope: not possible with a profile")
    told.append(given(page, "slope", "0"))
    page.do("player.toggle(false); player.show(30); $('said').textContent = ''; $('push-do').click()")
    page.wait(OVER)
    told.append(page.do("$('said').textContent"))
    assert len({distance(text) for text in told}) == 5 and page.do("Boolean(ghost)")
    setup: dict[str, Any] = {"links": 60, "preset": "soft", "start": "ellipse", "floor_friction": 0.3}
    assert distance(told[3]) == rounded(warpchain.walk(**setup, floor=STAIRS).dx)


def test_a_pushed_link(page: Page) -> None:
    """A drag on a paused picture pushes the link, as the form does; the Python lines make the same walk."""
    page.do("player.toggle(false); player.show(20)")
    x, y = page.do(
        "(() => { const box = $('stage').getBoundingClientRect(), to = player.layout,"
        " [x, y] = middle(player.walk.joints[player.frame], 6);"
        " return [box.left + to.shift + (x - to.left) * to.scale, box.top + (to.top - y) * to.scale]; })()"
    )
    page.mouse("Moved", x, y)
    page.mouse("Pressed", x, y)
    page.mouse("Moved", x + 80, y - 20)
    page.do("$('said').textContent = ''")
    page.mouse("Released", x + 80, y - 20)
    page.wait(OVER)
    ((time, link, across, up),) = page.do("setup.push")
    assert link == 6 and across > 0.002 and 0 < up < across and time == pytest.approx(0.08, abs=1e-3)
    assert page.do("ghost.time[0]") == 0 and page.do("player.walk.time[0]") == pytest.approx(8e4, abs=1e3)
    names: dict[str, Any] = {}
    exec(page.do("$('line-python').textContent"), names)
    assert distance(page.do("$('said').textContent")) == rounded(names["walk"].dx)
    page.do("player.toggle(false); player.show(player.last); $('said').textContent = ''; $('push-do').click()")
    page.wait(OVER)
    assert page.do("setup.push.length") == 2 and page.do("$('said').textContent").startswith("Δx")
    page.do("$('said').textContent = ''; $('push-undo').click()")
    page.wait(OVER)
    assert page.do("setup.push.length") == 1


def test_a_floor_that_is_drawn(page: Page) -> None:
    """A stroke over the picture becomes the floor, level at its ends; stairs are one of the shapes."""
    page.do("$('draw').click()")
    left, top, wide, high = page.do(
        "(({left, top, width, height}) => [left, top, width, height])($('stage').getBoundingClientRect())"
    )
    for number in range(21):
        kind = "Pressed" if number == 0 else "Moved"
        page.mouse(
            kind, left + wide * (0.5 + number / 100), top + high * (0.85 - 0.1 * math.sin(number / 20 * math.pi))
        )
    page.do("$('said').textContent = ''")
    page.mouse("Released", left + wide * 0.7, top + high * 0.85)
    page.wait(OVER)
    floor = np.array(page.do("setup.floor"))
    assert (
        page.do("$('said').textContent").startswith("Δx") and len(floor) > 10 and page.do("$('shape').value") == "drawn"
    )
    assert floor[[0, 1, -2, -1], 1].tolist() == [0.0] * 4 and floor[2:-2, 1].argmax() not in (0, len(floor) - 5)
    given(page, "shape", "stairs", "")
    assert page.do("setup.floor") == STAIRS


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"floor_friction": 0.3, "seed": 3},
        {"floor": STAIRS},
        {"plane": "tilting", "tilt": 0.1, "lateral_speed": -0.5},
    ],
)
def test_the_lines_make_the_same_walk(more: dict[str, Any], page: Page, server: LiveServer, command: Command) -> None:
    """Python lines, command line and YAML file; a plane that tilts is shown from the side."""
    parts = "&".join(f"{name}={value if isinstance(value, str) else json.dumps(value)}" for name, value in more.items())
    shown(page, f"{server.url}{SMALL}&{parts}")
    wanted = warpchain.walk(links=40, preset="soft", start="ellipse", **more).dx
    names: dict[str, Any] = {}
    exec(page.do("$('line-python').textContent"), names)
    assert names["walk"].dx == wanted and distance(page.do("$('said').textContent")) == rounded(wanted)
    answer = command(*shlex.split(page.do("$('line-command').textContent"))[1:], "--json")
    assert json.loads(answer.out)["dx"] == wanted
    text = page.do("$('line-yaml').textContent")
    page.do("$('lines').open = true")
    page.do("document.addEventListener('copy', () => { window.copied = getSelection().toString(); })")
    page.do("[...document.querySelectorAll('#lines button')].at(-1).focus()")
    page.key("Enter")
    assert page.do("copied").strip() == text.strip()
    Path("FILE.yaml").write_text(text)
    answer = command(*shlex.split(text.partition("\n")[0])[2:], "--json")
    assert json.loads(answer.out)["dx"] == wanted


def test_keys_focus_and_a_phone(page: Page, tmp_path: Path) -> None:
    """Everything is reached by Tab, sliders move by arrows, s adds samples; at 390 pixels nothing is cut off."""
    reached = set()
    for _ in range(80):
        page.key("Tab")
        reached.add(page.do("document.activeElement.id"))
        assert page.do("document.activeElement === document.body || document.activeElement.matches(':focus-visible')")
    names = ("links", "frequency", "floor_friction", "floor_restitution", "clearance", "slope", "charm_mass", "tilt")
    assert {f"range-{name}" for name in names} | {f"field-{name}" for name in names} <= reached
    assert {"play", "slider", "speed", "more", "compare", "shape", "draw", "reset", "field-start"} <= reached
    page.do("$('said').textContent = ''; $('range-links').focus()")
    page.key("ArrowRight")
    page.wait(OVER)
    assert page.do("setup.links") == 42
    page.do("document.activeElement.blur()")
    page.key("s", "KeyS")
    page.wait("samples.length === 12")
    page.size(390, 844)
    assert page.do("document.documentElement.scrollWidth") <= 390
    controls = "[...document.querySelectorAll('button, select, input')].filter(each => each.offsetWidth)"
    assert max(page.do(f"{controls}.map(each => each.getBoundingClientRect().right)")) <= 390


COLORS = """(() => {
  const isClear = e => /, 0\\)$/.test(getComputedStyle(e).backgroundColor);
  const behind = e => (e.parentElement && isClear(e) ? behind(e.parentElement) : getComputedStyle(e).backgroundColor);
  const hasText = e => e.offsetWidth && [...e.childNodes].some(node => node.nodeType === 3 && node.data.trim());
  const found = [...document.querySelectorAll("body *")].filter(hasText);
  return found.map(e => [e.tagName + e.id, getComputedStyle(e).color, behind(e)]);
})()"""
"""Of each element with text: its name, its colour, and the colour behind it."""


def luminance(color: str) -> float:
    """Relative luminance of a colour, as WCAG defines it."""
    parts = [int(part) / 255 for part in re.findall(r"\d+", color)[:3]]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_contrast_and_motion(scheme: str, page: Page, server: LiveServer) -> None:
    """Every text has a contrast of 4.5 with what is behind it (WCAG AA); reduced motion gives a still picture."""
    features = [
        {"name": "prefers-color-scheme", "value": scheme},
        {"name": "prefers-reduced-motion", "value": "reduce"},
    ]
    page.call("Emulation.setEmulatedMedia", features=features)
    shown(page, server.url + SMALL)
    assert page.do("[player.playing, player.frame]") == [False, 0]
    page.do("document.querySelectorAll('details').forEach(each => { each.open = true; })")
    page.do("document.querySelectorAll('.refusal').forEach(each => { each.textContent = 'no'; })")
    pairs = page.do(COLORS)
    page.call("Emulation.setEmulatedMedia", features=[])
    assert len(pairs) > 60
    for name, front, back in pairs:
        high, low = sorted((luminance(front), luminance(back)), reverse=True)
        assert (high + 0.05) / (low + 0.05) >= 4.5, (name, front, back)


def test_a_server_that_has_ended(browser: Page) -> None:  # noqa: F811
    """The page says so, and what to do; nothing hangs."""
    server = LiveServer()
    threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
    shown(browser, server.url + SMALL)
    server.close()
    given(browser, "links", "42")
    assert "start `warpchain live` again" in browser.do("$('problem').textContent")
