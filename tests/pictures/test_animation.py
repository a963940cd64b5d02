"""Moving pictures of walks."""

import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

from tests.support.made_tilting_walks import make_tilting_walk
from tests.support.made_walks import make_unreleased, make_walk
from warpchain.pictures.animation import Film, animate


def data_of(path: Path) -> dict[str, Any]:
    """The numbers on a page."""
    found = re.search(r"const walk = (\{.*\});\n", path.read_text(encoding="utf-8"))
    assert found is not None
    data: dict[str, Any] = json.loads(found.group(1))
    return data


@pytest.mark.parametrize(
    ("fps", "slow", "count"),
    [
        (10, 5, 41),  # one picture per frame
        (30, 4, 41),  # more pictures than frames: each frame once
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


@pytest.mark.parametrize("make", [make_walk, make_tilting_walk])
def test_gif_draws_the_chain_where_it_is(make: Any, tmp_path: Path) -> None:
    """In each picture the blue of the links is about the centre of the joints; the size suits video."""
    walk = make()
    animate(walk, tmp_path / "walk.gif", fps=10, slow=5 if make is make_walk else 4)
    with Image.open(tmp_path / "walk.gif") as gif:
        pictures = [np.asarray(picture.convert("RGB")).astype(int) for picture in ImageSequence.Iterator(gif)]
    height, width, _ = pictures[0].shape
    assert len(pictures) == 41 and height % 2 == width % 2 == 0 and height <= 560 and width <= 960
    blue = [np.argwhere(picture[..., 2] - picture[..., 0] > 60).mean(axis=0) for picture in pictures]
    joints = walk.frame_joints if walk.joints_lab is None else walk.joints_lab[..., :2]
    for pixels, places in zip(np.transpose(blue)[::-1] * [[1], [-1]], joints.mean(axis=1).T, strict=True):
        assert np.corrcoef(pixels, places)[0, 1] > 0.9


def test_a_chain_that_flies_high_has_room_for_title_and_marks(tmp_path: Path) -> None:
    """The picture is as broad as it is high, and the marks of the floor reach over most of it."""
    walk = make_walk()
    joints = walk.frame_joints + np.linspace(0.0, 5.0, len(walk.frame_time))[:, None, None] * [0.0, 1.0]
    high = replace(walk, frame_joints=joints)
    width, height = Film(high).figure.get_size_inches()
    assert width >= height
    animate(high, tmp_path / "walk.html")
    marks = data_of(tmp_path / "walk.html")["marks"]
    assert len(marks) <= 10 and 3.0 < np.ptp(marks) < 6.0


@pytest.mark.parametrize("make", [make_walk, make_tilting_walk])
def test_html_is_complete_in_itself(make: Any, tmp_path: Path) -> None:
    """The page loads nothing, and holds the joints to a tenth of a millimetre, the times to a microsecond."""
    walk = make()
    animate(walk, tmp_path / "walk.html", slow=3)
    page = (tmp_path / "walk.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|//cdn|\bsrc\s*=|\bhref\s*=|@import|\burl\(|\bfetch\(|\bimport\b|{{", page)
    data = data_of(tmp_path / "walk.html")
    expected = walk.frame_joints if walk.joints_lab is None else walk.joints_lab[..., :2]
    joints = np.array(data["joints"]).reshape(expected.shape) * 1e-4
    assert np.max(np.abs(joints - expected)) <= 0.5e-4 * (1 + 1e-9)
    np.testing.assert_allclose(np.array(data["time"]) * 1e-6, walk.frame_time, atol=5e-7)
    assert data["slow"] == 3 and data["sprocket"] == [0, round(1e4 * walk.sprocket_center[1]), 556]
    seen = "" if walk.joints_lab is None else ", from the side"
    own = "" if walk.joints_lab is None else "plane tilting, "
    assert f"<title>30 links, 15 Hz, preset soft, {own}sampled values: \u0394x = {walk.dx:.3f} m{seen}</title>" in page


def test_mp4_frames(tmp_path: Path) -> None:
    """With the video extra an MP4 has a picture per tick of its clock, and its last one for 1.5 s."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    animate(make_tilting_walk(), tmp_path / "walk.mp4", fps=20, slow=2)
    assert ffmpeg.count_frames_and_secs(str(tmp_path / "walk.mp4"))[0] == 41 + 30


@pytest.mark.parametrize("program", ["exit 1", "cat > /dev/null; exit 1"])
def test_a_film_that_was_not_written_to_its_end_is_not_kept(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """ffmpeg may fail as it is fed, or at its end, on a full disk for one; the older film stays."""
    ffmpeg, path = tmp_path / "ffmpeg", tmp_path / "walk.mp4"
    ffmpeg.write_text(f"#!/bin/sh\n{program}\n")
    ffmpeg.chmod(0o755)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", SimpleNamespace(get_ffmpeg_exe=lambda: str(ffmpeg)))
    path.write_bytes(b"old")
    with pytest.raises(OSError, match=r"^.*walk\.mp4: cannot be written \(ffmpeg ended early\); check the disk$"):
        animate(make_walk(), path, fps=10, slow=1)
    assert path.read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 2
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("walk.avi", {}, "unknown file format"),
        ("walk.gif", {"fps": 0}, "fps: expected at least 1, got 0"),
        ("walk.html", {"slow": math.inf}, "slow: expected a finite number, got inf"),
        ("walk.gif", {"fps": 51}, "fps: expected at most 50, got 51"),
        ("walk.gif", {"fps": "a"}, "^fps: expected a number, got 'a'"),
        ("walk.gif", {"slow": 1e4}, r"walk\.gif: 266667 pictures are too many; lower fps or slow; a GIF has 1200 at"),
        ("walk.gif", {"slow": 1e10}, r"walk\.gif: 2\.66667e11 pictures are too many"),
        ("walk.gif", {"slow": 1e308}, r"walk\.gif: inf pictures are too many"),
        ("walk.mp4", {"slow": 1e308}, r"walk\.mp4: inf pictures are too many; .* an MP4 100000$"),
        ("walk.mp4", {"fps": 1e300, "slow": 1e-300}, r"walk\.mp4: 1\.5e300 pictures are too many"),
        ("walk.gif", {"walk": make_unreleased()}, "no frames; it was not released"),
        ("walk.gif", {"walk": make_walk(frame_joints=np.full((41, 30, 2), math.nan))}, "not all finite numbers"),
    ],
)
def test_what_makes_no_film_is_refused(name: str, settings: dict[str, Any], message: str, tmp_path: Path) -> None:
    """Unknown suffixes, impossible speeds, and walks without whole frames, before anything is written."""
    with pytest.raises(ValueError, match=message):
        animate(**{"walk": make_walk(), "path": tmp_path / name} | settings)
    assert not list(tmp_path.iterdir())
