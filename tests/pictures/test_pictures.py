"""Figures and moving pictures of walks."""

import itertools
import json
import math
import os
import re
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from PIL import Image, ImageSequence

from tests.support.made_walks import make_unreleased, make_walk
from warpchain.pictures.animation import animate
from warpchain.pictures.film import Film
from warpchain.pictures.room import link_outlines
from warpchain.pictures.walk_figures import figure5, film_strip
from warpchain.status import Status
from warpchain.walks.walk_result import WalkResult

# Figures


def test_figure5_draws_the_series() -> None:
    """The lines of Figure 5 are the walks' series themselves, over a shared time axis."""
    walks = [make_walk(), make_walk(links=34, center=2 * make_walk().center)]
    figure = figure5(walks)
    height, speed = figure.axes
    for walk, upper, lower in zip(walks, height.lines, speed.lines, strict=True):
        np.testing.assert_array_equal(upper.get_xydata(), np.stack([walk.time, walk.center[:, 1]], axis=1))
        np.testing.assert_array_equal(lower.get_xdata(), walk.time)
        np.testing.assert_array_equal(lower.get_ydata(), walk.center_velocity[:, 0])
        assert upper.get_color() == lower.get_color()
    assert height.get_shared_x_axes().joined(height, speed)
    legend = height.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["n = 30, ν = 15 Hz", "n = 34, ν = 15 Hz"]
    assert "/ m" in height.get_ylabel() and "/ (m/s)" in speed.get_ylabel() and "/ s" in speed.get_xlabel()


def test_figure5_legend_names_each_label_once() -> None:
    """Walks of one label share a colour and a legend entry."""
    figure = figure5([make_walk()] * 3, labels=["a", "b", "a"])
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["a", "b"]
    first, second, third = (line.get_color() for line in figure.axes[0].lines)
    assert first == third != second


def test_figure5_refusals() -> None:
    """No walk, a walk without release and a wrong number of labels are refused."""
    with pytest.raises(ValueError, match="walks: empty"):
        figure5([])
    with pytest.raises(ValueError, match=r"walks\[1\]: it has no time series\. The chain did not circulate"):
        figure5([make_walk(), make_unreleased()])
    with pytest.raises(ValueError, match="labels: 2 for 1 walks"):
        figure5([make_walk()], labels=["a", "b"])


def test_film_strip_shows_the_walk(tmp_path: Path) -> None:
    """The strip holds the chosen number of chains to scale, the path of their centre and the distance."""
    walk = make_walk()
    figure = film_strip(walk, count=7)
    strip, *close_ups = figure.axes
    assert len([child for child in strip.collections if isinstance(child, PolyCollection)]) == 3 * 7
    assert any(np.array_equal(line.get_xydata(), walk.center) for line in strip.lines)
    assert "$\\Delta x$ = 0.640 m" in [text.get_text() for text in strip.texts]
    halo, inner, outer = strip.collections[:3]
    drawn = np.stack([np.asarray(path.vertices)[:-1] for path in halo.get_paths()])
    outlines = link_outlines(walk.frame_joints[0], 4.2e-3)
    np.testing.assert_allclose(drawn, outlines, atol=1e-12)
    for links, layer in ((outlines[0::2], inner), (outlines[1::2], outer)):
        first = np.asarray(layer.get_paths()[0].vertices)[:-1]
        np.testing.assert_allclose(first, links[0], atol=1e-12)
    pale, dark = (np.array(layer.get_facecolor()) for layer in (inner, outer))
    assert np.all(pale[0, :3] > dark[0, :3])
    assert [axes.get_title("left").split("  ")[1] for axes in close_ups] == [
        "first touch, 0.140 s",
        "collapse, 0.540 s",
        "first self-contact, 0.660 s",
        "rest, 0.800 s",
    ]
    figure.savefig(tmp_path / "strip.png", dpi=50)
    for axes in figure.axes:
        box = axes.get_window_extent()
        shown = axes.viewLim
        assert box.width / shown.width == pytest.approx(box.height / shown.height, rel=1e-6)


def test_film_strip_labels_fit(tmp_path: Path) -> None:
    """Nothing that a film strip writes is cut off at the edge of the paper, or runs into another panel."""
    figure = film_strip(make_walk())
    figure.savefig(tmp_path / "strip.png", dpi=50)
    paper = figure.bbox
    boxes = [box for axes in figure.axes if (box := axes.get_tightbbox()) is not None]
    assert len(boxes) == 5
    for box in boxes:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= paper.x1 and box.y1 <= paper.y1
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_film_strip_of_a_failed_walk() -> None:
    """A walk that did not rest gets no distance, and its last close-up is the end, not rest."""
    figure = film_strip(make_walk(status=Status.TIME_LIMIT, dx=math.nan, sprocket_height=math.nan))
    assert not any("Delta" in text.get_text() for text in figure.axes[0].texts)
    assert "end" in figure.axes[-1].get_title("left")


def test_film_strip_of_one_frame() -> None:
    """One frame is enough for a strip."""
    walk = make_walk()
    film_strip(make_walk(frame_time=walk.frame_time[:1], frame_joints=walk.frame_joints[:1])).draw_without_rendering()


@pytest.mark.parametrize("draw", [film_strip, lambda walk: animate(walk, "walk.gif")])
def test_pictures_need_whole_frames(draw: Callable[[WalkResult], Any]) -> None:
    """A walk without frames, or with broken ones, is refused with what happened to it."""
    with pytest.raises(ValueError, match=r"no frames \(not_steady\); run it again with a frame_interval"):
        draw(make_unreleased())
    broken = make_walk().frame_joints.copy()
    broken[-1, 3] = math.nan
    with pytest.raises(ValueError, match="not all finite numbers"):
        draw(make_walk(status=Status.NOT_FINITE, frame_joints=broken))


def test_plot_chooses_the_figure() -> None:
    """`plot` makes either figure, into a figure of the caller's if given, and refuses other kinds."""
    from matplotlib.figure import Figure

    walk, own = make_walk(), Figure()
    assert walk.plot(figure=own) is own and len(own.axes) == 2
    assert len(walk.plot("film_strip").axes) == 5
    with pytest.raises(ValueError, match="kind: 'pie' is unknown"):
        walk.plot("pie")  # type: ignore[arg-type]


def test_link_outlines_are_two_circles() -> None:
    """Outlines lie within `radius` of their link's axis and reach exactly that far beyond its joints."""
    joints, radius = make_walk().frame_joints[0], 4.2e-3
    outlines = link_outlines(joints, radius)
    for corners, right, left in zip(outlines, joints, np.roll(joints, 1, axis=0), strict=True):
        along = (right - left) / np.hypot(*(right - left))
        across = np.array([-along[1], along[0]])
        assert np.max((corners - right) @ along) == pytest.approx(radius)
        assert np.min((corners - left) @ along) == pytest.approx(-radius)
        assert np.max(np.abs((corners - left) @ across)) == pytest.approx(radius)
        near = np.minimum(*(np.hypot(*(corners - joint).T) for joint in (left, right)))
        assert np.sum(np.isclose(near, radius)) >= 18


# Moving pictures


@pytest.mark.parametrize(
    ("fps", "slow", "count"),
    [
        (10, 5, 41),  # one picture per frame
        (30, 4, 41),  # more pictures than frames: each frame once
        (10, 2, 17),  # fewer
    ],
)
def test_gif_frames_and_times(fps: float, slow: float, count: int, tmp_path: Path) -> None:
    """A GIF has the right number of pictures, and lasts `slow` times as long as the walk, then rests."""
    animate(make_walk(), tmp_path / "walk.gif", fps=fps, slow=slow)
    with Image.open(tmp_path / "walk.gif") as gif:
        durations = [picture.info["duration"] for picture in ImageSequence.Iterator(gif)]
    assert len(durations) == count
    assert durations[-1] == 1500
    assert sum(durations[:-1]) == pytest.approx(800 * slow, abs=1000 / fps)
    assert [entry.name for entry in tmp_path.iterdir()] == ["walk.gif"]


def test_gif_draws_the_chain(tmp_path: Path) -> None:
    """The first picture shows outer links darker than inner ones, and paper inside their loop."""
    walk = make_walk()
    animate(walk, tmp_path / "walk.gif", fps=10, slow=5)
    film = Film(walk)
    with Image.open(tmp_path / "walk.gif") as gif:
        assert gif.size == film.size
        pixels = np.asarray(gif.convert("RGB")).astype(int)
    joints = walk.frame_joints[0]

    def brightness(place: np.ndarray) -> int:
        x, y = film._canvas.figure.axes[0].transData.transform(place)
        return int(pixels[int(film.size[1] - y), int(x)].sum())

    middles = [brightness(middle) for middle in (joints + np.roll(joints, 1, axis=0)) / 2]
    assert np.median(middles[0::2]) > 450 > 400 > max(middles[1::2])
    assert brightness(joints.mean(axis=0) + 0.015) > 700


def test_gif_size_limit(tmp_path: Path) -> None:
    """A GIF too long to hold in memory is refused before the first picture is drawn."""
    walk = make_walk()
    time = np.linspace(0.0, 20.0, 2001)
    long = make_walk(frame_time=time, frame_joints=np.resize(walk.frame_joints, (2001, 30, 2)))
    with pytest.raises(ValueError, match="pictures are too many for a GIF; lower fps or slow"):
        animate(long, tmp_path / "walk.gif", fps=50, slow=8)
    assert not list(tmp_path.iterdir())


def test_html_is_complete_in_itself(tmp_path: Path) -> None:
    """The page loads nothing, and holds the joints to a tenth of a millimetre, the times to a microsecond."""
    walk = make_walk()
    animate(walk, tmp_path / "walk.html", slow=3)
    page = (tmp_path / "walk.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|//cdn|\bsrc\s*=|\bhref\s*=|@import|\burl\(|\bfetch\(|\bimport\b|{{", page)
    found = re.search(r"const walk = (\{.*\});\n", page)
    assert found is not None
    data = json.loads(found.group(1))
    joints = np.array(data["joints"]).reshape(walk.frame_joints.shape) * 1e-4
    assert np.max(np.abs(joints - walk.frame_joints)) <= 0.5e-4 * (1 + 1e-9)
    np.testing.assert_allclose(np.array(data["time"]) * 1e-6, walk.frame_time, atol=5e-7)
    assert data["slow"] == 3 and data["sprocket"] == [0, 1000, 556]
    assert "<title>30 links, 15 Hz: \u0394x = 0.640 m</title>" in page


def test_html_thins_long_recordings(tmp_path: Path) -> None:
    """A page holds at most 2,000 frames, evenly chosen, the first and the last among them."""
    joints = np.resize(make_walk().frame_joints, (5001, 30, 2))
    walk = make_walk(frame_time=np.linspace(0.0, 0.8, 5001), frame_joints=joints)
    animate(walk, tmp_path / "walk.html")
    found = re.search(r'"time":(\[[^]]*\])', (tmp_path / "walk.html").read_text(encoding="utf-8"))
    assert found is not None
    times = json.loads(found.group(1))
    assert len(times) == 2000 and times[0] == 0 and times[-1] == 800_000
    assert set(np.diff(np.rint(np.array(times) / 160))) <= {2, 3}


def test_mp4_without_encoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the video extra an MP4 is refused in one line that says what to install."""
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ImportError, match=r"pip install 'warpchain\[video\]'") as caught:
        animate(make_walk(), tmp_path / "walk.mp4")
    assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("written", "is_whole"),
    [
        (b"\0\0\0\x08ftyp" + b"\0\0\0\x0cmdat1234" + b"\0\0\0\x08moov", True),
        (b"\0\0\0\x08ftyp" + b"\0\0\0\x01mdat\0\0\0\0\0\0\0\x141234" + b"\0\0\0\x08moov", True),
        (b"\0\0\0\x08ftyp" + b"\0\0\0\x0cmdat1234", False),
        (b"\0\0\0\x08ftyp" + b"\0\0\0\x0cmdat1234" + b"\0\0\0\x09moov", False),
        (b"\0\0\0\x08ftyp" + b"\0\0\0\x0cmdat12", False),
        (b"", False),
        (None, False),
    ],
)
def test_a_film_that_was_not_written_to_its_end_is_not_kept(
    written: bytes | None, is_whole: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ffmpeg may die without a word, on a full disk for one, or as it is fed (None); the older film stays."""

    def write_frames(path: str, *_: object, **__: object) -> Generator[None, bytes, None]:
        try:
            while True:
                yield
                if written is None:
                    raise OSError("[Errno 32] Broken pipe\n\nFFMPEG COMMAND:\n...")
        finally:
            Path(path).write_bytes(written or b"")

    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", SimpleNamespace(write_frames=write_frames))
    path = tmp_path / "walk.mp4"
    path.write_bytes(b"old")
    if is_whole:
        animate(make_walk(), path)
    else:
        with pytest.raises(OSError, match=r"^.*walk\.mp4: cannot be written \(ffmpeg [^\n]*\); see to the disk$"):
            animate(make_walk(), path)
    assert path.read_bytes() == (written if is_whole else b"old") and list(tmp_path.iterdir()) == [path]


def test_mp4_frames(tmp_path: Path) -> None:
    """With the video extra an MP4 has a picture per tick of its clock, and its last one for 1.5 s."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    animate(make_walk(), tmp_path / "walk.mp4", fps=20, slow=2)
    assert ffmpeg.count_frames_and_secs(str(tmp_path / "walk.mp4"))[0] == 33 + 30


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        (
            "walk.avi",
            {},
            r"walk\.avi: unknown kind of picture; give a name that ends in \.gif, \.mp4 or \.html",
        ),
        ("walk.gif", {"fps": 0}, "fps: 0 is not a positive number"),
        ("walk.html", {"slow": math.nan}, "slow: nan is not a positive number"),
        ("walk.gif", {"fps": 60}, "fps: 60 is too fast for a GIF"),
        ("walk.gif", {"fps": 0.001}, "fps: 0.001 is too slow for a GIF; give 0.002 to 50"),
        ("walk.gif", {"slow": 1e6, "fps": 0.01}, "slow: 1000000.0 shows a picture for more than 500 s"),
    ],
)
def test_animation_refusals(name: str, settings: dict[str, float], message: str, tmp_path: Path) -> None:
    """Unknown suffixes and impossible speeds are refused before anything is written."""
    with pytest.raises(ValueError, match=message):
        animate(make_walk(), tmp_path / name, **settings)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["walk.gif", "walk.html"])
def test_interrupted_animation_keeps_old_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Moving pictures, too, are written whole or not at all."""
    path = tmp_path / name
    path.write_text("old")

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="cannot be written"):
        animate(make_walk(), path)
    assert path.read_text() == "old" and [entry.name for entry in tmp_path.iterdir()] == [name]
