"""Moving pictures of a walk: GIF, MP4, or a page with a player for the browser."""

import html
import importlib
import itertools
import json
import math
import os
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.files import checked_output, replacing, write_whole
from warpchain.pictures.style import BLUE, FAINT, GROUND, INK
from warpchain.pictures.walk_figures import center_at, check_frames, extent, link_outlines
from warpchain.pictures.walk_shape import Walk, setting

if TYPE_CHECKING:
    from PIL.Image import Image

Array = NDArray[np.float64]

_WIDTH: Final = 960
_TALLEST: Final = 560
"""Greatest width and height of GIF and MP4 [pixels]."""
_ENLARGEMENT: Final = 3
"""Pictures are drawn this many times larger and averaged down, because Pillow does not smooth edges."""

_OUTER: Final = BLUE
_INNER: Final = "#9CCBE6"
_EDGE: Final = "#00385A"

_HOLD: Final = 1.5
"""Time for which GIF and MP4 show their last picture [s]."""
_GIF_PICTURES: Final = 1200
"""Most pictures of a GIF: all are in memory at once, 0.5 MB each."""
_PLAYER_FRAMES: Final = 2000
"""Most frames of a page, which then has about 1 MB with 60 links."""


def animate(walk: Walk, path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
    """Write a moving picture of a walk; the suffix of `path` gives the format: .gif, .mp4 or .html.

    If there are more pictures than frames, each frame is shown until the next one.

    Args:
        walk: a walk with frames.
        path: the file to write, whole or not at all; an older one is replaced. A .html file loads nothing else, and
            has play, pause, speed and a slider.
        fps: pictures per second of playing time; in a .html file the browser decides.
        slow: playing time per simulated time; in a .html file the value at the start.

    Raises:
        ValueError: the suffix is unknown, the walk has no frames or broken ones, fps or slow is not positive, or a
            GIF would have too many pictures, in all or per second: viewers slow down over 50.
        ImportError: an .mp4 is asked for and `imageio-ffmpeg` is not installed.
        OSError: the file cannot be written, or something else than a regular file is there.
    """
    suffix = Path(path).suffix.lower()
    writers = {".gif": _write_gif, ".mp4": _write_mp4, ".html": _write_html}
    if suffix not in writers:
        raise ValueError(f"{path}: unknown kind of picture; give a name that ends in .gif, .mp4 or .html")
    for name, value in (("fps", fps), ("slow", slow)):
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name}: {value} is not a positive number; give one such as 30")
    if suffix == ".gif" and fps > 50:
        raise ValueError(f"fps: {fps} is too fast for a GIF; give at most 50")
    check_frames(walk)
    writers[suffix](walk, checked_output(path), fps, slow)


def _chosen_frames(walk: Walk, fps: float, slow: float) -> list[int]:
    """Number of the frame that each picture shows: the last one recorded by then. Pictures come at a constant rate."""
    start, end = walk.frame_time[0], walk.frame_time[-1]
    marks = start + np.arange(math.floor((end - start) * fps * slow + 1e-6) + 1) / (fps * slow)
    chosen: list[int] = (np.searchsorted(walk.frame_time, marks + 1e-9, side="right") - 1).tolist()
    return chosen if chosen[-1] == len(walk.frame_time) - 1 else [*chosen, len(walk.frame_time) - 1]


def _write_gif(walk: Walk, path: Path, fps: float, slow: float) -> None:
    """Write each frame once; durations are hundredths of a second, rounded so that errors do not add up."""
    from PIL import Image

    chosen = _chosen_frames(walk, fps, slow)
    pictures = [frame for frame, _ in itertools.groupby(chosen)]
    repeats = [len(list(group)) for _, group in itertools.groupby(chosen)]
    if len(pictures) > _GIF_PICTURES:
        raise ValueError(f"{path}: {len(pictures)} pictures are too many for a GIF; lower fps or slow, or give .mp4")
    ends = np.rint(np.cumsum([0, *repeats]) * 100 / fps)
    durations = [int(hundredths) * 10 for hundredths in np.diff(ends)]
    durations[-1] = int(_HOLD * 1000)
    stage = _Stage(walk)
    # One palette for all, from the first, the middle and the last picture; otherwise each picture has its own.
    samples = [np.asarray(stage.picture(pictures[round(part * (len(pictures) - 1))])) for part in (0, 0.5, 1)]
    palette = Image.fromarray(np.concatenate(samples)).quantize(48, dither=Image.Dither.NONE)
    reduced = (stage.picture(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in pictures)
    with replacing(path) as part:
        first = next(reduced)
        first.save(part, format="GIF", save_all=True, append_images=reduced, duration=durations, loop=0)


def _write_mp4(walk: Walk, path: Path, fps: float, slow: float) -> None:
    try:
        ffmpeg = importlib.import_module("imageio_ffmpeg")
    except ImportError:
        raise ImportError(f"{path}: MP4 needs imageio-ffmpeg; pip install 'warpchain[video]'") from None
    stage = _Stage(walk)
    chosen = _chosen_frames(walk, fps, slow)
    chosen += chosen[-1:] * round(_HOLD * fps)
    # imageio-ffmpeg lets the lines of ffmpeg through to the terminal, and hides how it ends.
    coding = {"fps": fps, "quality": 8, "macro_block_size": 2, "ffmpeg_log_level": "quiet"}
    with replacing(path) as part:
        try:
            with closing(ffmpeg.write_frames(str(part), stage.size, **coding)) as writer:
                writer.send(None)
                for frame, group in itertools.groupby(chosen):
                    content = stage.picture(frame).tobytes()
                    for _ in group:
                        writer.send(content)
        except OSError as error:
            raise OSError("ffmpeg ended early") from error
        if not _is_whole_mp4(part):
            raise OSError("ffmpeg did not write it to the end")


def _is_whole_mp4(path: Path) -> bool:
    """Whether the boxes of an MP4 fill its file and the index, which is written last, is among them."""
    kinds, place, end = [], 0, path.stat().st_size
    with path.open("rb") as content:
        while place < end:
            content.seek(place)
            size, kind = int.from_bytes(content.read(4)), content.read(4)
            if size == 1:  # the size does not fit and follows in 8 bytes
                size = int.from_bytes(content.read(8))
            kinds.append(kind)
            place += max(size, 8)
    return place == end and b"moov" in kinds


@dataclass(frozen=True)
class _View:
    """The part of the plane that is shown, and the marks on the floor [m]."""

    left: float
    right: float
    bottom: float
    top: float
    marks: tuple[float, ...]


def _view(walk: Walk) -> _View:
    """The whole walk, with a strip of floor for the marks."""
    left, right, top = extent(walk)
    spacing = next((step for step in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if (right - left) / step <= 9), 10.0)
    numbers = range(math.ceil(left / spacing), math.floor(right / spacing) + 1)
    bottom = -0.045 * max(right - left, top)
    return _View(left, right, bottom, top, tuple(round(number * spacing, 6) for number in numbers))


class _Stage:
    """Draws the frames of one walk, all to the same scale.

    Attributes:
        size: width and height of a picture in pixels, even numbers for video.
    """

    def __init__(self, walk: Walk) -> None:
        from PIL import ImageFont

        view = _view(walk)
        width, height = view.right - view.left, view.top - view.bottom
        self._walk, self._view = walk, view
        self._scale = min(_WIDTH / width, _TALLEST / height)
        self.size = 2 * round(self._scale * width / 2), 2 * round(self._scale * height / 2)
        self._font = ImageFont.load_default(16)
        self._backdrop = self._draw_backdrop()
        self._center = self._pixels(walk.center)

    def _pixels(self, points: Array) -> Array:
        """Pixels in the enlarged picture of points x, y [m], both of shape (…, 2)."""
        scale = self._scale * _ENLARGEMENT
        return np.asarray((points - (self._view.left, self._view.top)) * (scale, -scale))

    def _draw_backdrop(self) -> "Image":
        """What never moves, enlarged."""
        from PIL import Image, ImageDraw

        width, height = (_ENLARGEMENT * side for side in self.size)
        backdrop = Image.new("RGB", (width, height), "white")
        draw = ImageDraw.Draw(backdrop)
        if self._walk.sprocket_center is not None:
            center = tuple(self._pixels(self._walk.sprocket_center))
            radius = self._walk.sprocket_radius * self._scale * _ENLARGEMENT
            draw.circle(center, radius, outline=FAINT, width=_ENLARGEMENT)
            draw.circle(center, 2 * _ENLARGEMENT, fill=FAINT)
        floor = self._pixels(np.zeros(2))[1]
        draw.rectangle((0, floor, width, height), fill=GROUND)
        draw.line((0, floor, width, floor), fill=INK, width=_ENLARGEMENT)
        for mark in self._view.marks:
            x = self._pixels(np.array([mark, 0.0]))[0]
            draw.line((x, floor, x, floor + 6 * _ENLARGEMENT), fill=INK, width=_ENLARGEMENT)
        return backdrop

    def picture(self, frame: int) -> "Image":
        """One frame in colour: the chain, the path of its centre of mass so far, time and marks."""
        from PIL import ImageDraw

        image = self._backdrop.copy()
        draw = ImageDraw.Draw(image)
        joints, radius = self._walk.frame_joints[frame], self._walk.setup.parameters.circle_radius
        rim = min(0.7 / self._scale, radius / 2)
        for parity, fill in ((0, _INNER), (1, _OUTER)):
            for size, color in ((radius, _EDGE), (radius - rim, fill)):
                for outline in self._pixels(link_outlines(joints, size)[parity::2]):
                    draw.polygon(outline.ravel().tolist(), fill=color)
        moment = self._walk.frame_time[frame]
        path = self._center[: max(1, int(np.searchsorted(self._walk.time, moment, side="right")))]
        draw.line(path.ravel().tolist(), fill=INK, width=_ENLARGEMENT)
        x, y = path[-1]
        draw.circle((x, y), 3.5 * _ENLARGEMENT, fill=INK)
        image = image.reduce(_ENLARGEMENT)
        draw = ImageDraw.Draw(image)
        draw.text((self.size[0] - 12, 10), f"{moment:.3f} s", fill=INK, font=self._font, anchor="rt")
        for mark in self._view.marks:
            x, y = self._pixels(np.array([mark, 0.0])) / _ENLARGEMENT
            draw.text((x, y + 9), f"{mark:g} m", fill=INK, font=self._font, anchor="mt")
        return image


def _write_html(walk: Walk, path: Path, fps: float, slow: float) -> None:
    write_whole(path, player(walk, slow))


def player(walk: Walk, slow: float = 4.0) -> str:
    """A page with the frames and a player: lengths in whole tenths of a millimetre, times in microseconds.

    Args:
        walk: a walk with frames.
        slow: playing time per simulated time at the start.

    Raises:
        ValueError: the walk has no frames or broken ones.
    """
    check_frames(walk)
    count = min(len(walk.frame_time), _PLAYER_FRAMES)
    frames = np.rint(np.linspace(0, len(walk.frame_time) - 1, count)).astype(int)
    times, view, sprocket = walk.frame_time[frames], _view(walk), walk.sprocket_center
    title = setting(walk) + (f": \u0394x = {walk.dx:.3f} m" if math.isfinite(walk.dx) else "")
    data: dict[str, Any] = {
        "time": np.rint(times * 1e6).astype(int).tolist(),
        "joints": _tenths(walk.frame_joints[frames].reshape(count, -1)),
        "center": _tenths(center_at(walk, times)),
        "radius": walk.setup.parameters.circle_radius * 1e4,
        "sprocket": None if sprocket is None else _tenths(np.array([*sprocket, walk.sprocket_radius])),
        "view": _tenths(np.array([view.left, view.right, view.bottom, view.top])),
        "marks": list(view.marks),
        "slow": slow,
        "colors": {"inner": _INNER, "outer": _OUTER, "edge": _EDGE},
    }
    page = _PAGE.replace("{{title}}", html.escape(title))
    return page.replace("{{data}}", json.dumps(data, separators=(",", ":"), allow_nan=False))


def _tenths(lengths: Array) -> Any:
    """Lengths [m] in whole tenths of a millimetre, as lists."""
    return np.rint(lengths * 1e4).astype(int).tolist()


_PAGE: Final = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{title}}</title>
<style>
:root { color-scheme: light dark; --paper: #fff; --ink: #222; --faint: #888; --ground: #e3e3e3; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #16181c; --ink: #e8e8e8; --faint: #8a8f98; --ground: #33373e; }
}
body { margin: 0 auto; max-width: 1100px; padding: 1rem; background: var(--paper); color: var(--ink);
       font: 16px/1.4 system-ui, sans-serif; }
h1 { font-size: 1.1rem; margin: 0 0 .5rem; }
canvas { display: block; width: 100%; }
.controls { display: flex; flex-wrap: wrap; gap: .75rem; align-items: center; margin-top: .75rem; }
input { flex: 1 1 12rem; accent-color: #0072b2; }
button, select { font: inherit; padding: .25rem .6rem; min-width: 5.5rem; }
output { font-variant-numeric: tabular-nums; min-width: 4.5rem; text-align: right; }
</style>
</head>
<body>
<h1>{{title}}</h1>
<canvas id="stage" role="img" aria-label="The chain at the chosen time"></canvas>
<div class="controls">
  <button id="play" title="space">Play</button>
  <input id="slider" type="range" min="0" value="0" aria-label="frame" title="arrow keys: one frame">
  <output id="clock"></output>
  <select id="speed" aria-label="speed"></select>
</div>
<script>
"use strict";
const walk = {{data}};
const [left, right, bottom, top_] = walk.view;
const [canvas, play, slider, clock, speed] =
  ["stage", "play", "slider", "clock", "speed"].map(id => document.getElementById(id));
const pen = canvas.getContext("2d");
const last = walk.time.length - 1;
let frame = 0, moment = walk.time[0], playing = false, before = 0;

slider.max = last;
for (const slow of [...new Set([1, 2, 4, 8, 16, 32, 64, walk.slow])].sort((a, b) => a - b)) {
  const text = slow === 1 ? "real time" : slow > 1 ? slow + "× slower" : 1 / slow + "× faster";
  speed.add(new Option(text, slow, false, slow === walk.slow));
}

// Outline of a link from joint a to joint b: two circles and a waist.
function trace(ax, ay, bx, by, radius) {
  const turn = Math.atan2(by - ay, bx - ax), half = Math.PI / 2;
  const waist = 0.24 * radius, nx = -Math.sin(turn) * waist, ny = Math.cos(turn) * waist;
  const mx = (ax + bx) / 2, my = (ay + by) / 2;
  pen.beginPath();
  pen.arc(bx, by, radius, turn - half, turn + half);
  pen.quadraticCurveTo(mx + nx, my + ny, ax - Math.sin(turn) * radius, ay + Math.cos(turn) * radius);
  pen.arc(ax, ay, radius, turn + half, turn + 3 * half);
  pen.quadraticCurveTo(mx - nx, my - ny, bx + Math.sin(turn) * radius, by - Math.cos(turn) * radius);
  pen.fill();
  pen.stroke();
}

function draw() {
  const style = getComputedStyle(document.documentElement);
  const color = name => style.getPropertyValue("--" + name);
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth;
  const scale = Math.min(width / (right - left), 0.75 * window.innerHeight / (top_ - bottom));
  canvas.style.height = scale * (top_ - bottom) + "px";
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(scale * (top_ - bottom) * ratio);
  const shift = (width - scale * (right - left)) / 2;
  // From here on lengths are tenths of a millimetre and y points up.
  pen.setTransform(scale * ratio, 0, 0, -scale * ratio, (shift - left * scale) * ratio, top_ * scale * ratio);
  const hair = 1 / scale, wide = width / scale;
  pen.lineWidth = hair;
  pen.strokeStyle = color("faint");
  pen.beginPath();
  if (walk.sprocket) pen.arc(...walk.sprocket, 0, 2 * Math.PI);
  pen.stroke();
  pen.fillStyle = color("ground");
  pen.fillRect(left - wide, bottom, 3 * wide, -bottom);
  pen.fillStyle = color("ink");
  pen.fillRect(left - wide, -hair / 2, 3 * wide, hair);
  for (const mark of walk.marks) pen.fillRect(mark * 1e4 - hair / 2, -6 * hair, hair, 6 * hair);

  const joints = walk.joints[frame], size = joints.length;
  pen.strokeStyle = walk.colors.edge;
  for (const parity of [0, 2]) {
    pen.fillStyle = parity ? walk.colors.outer : walk.colors.inner;
    for (let i = parity; i < size; i += 4) {
      const k = (i + size - 2) % size;
      trace(joints[k], joints[k + 1], joints[i], joints[i + 1], walk.radius);
    }
  }
  pen.strokeStyle = pen.fillStyle = color("ink");
  pen.beginPath();
  for (let i = 0; i <= frame; i++) pen.lineTo(...walk.center[i]);
  pen.stroke();
  pen.beginPath();
  pen.arc(...walk.center[frame], 4 * hair, 0, 2 * Math.PI);
  pen.fill();

  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.font = "13px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "top";
  const place = mark => shift + (mark * 1e4 - left) * scale;
  for (const mark of walk.marks) pen.fillText(mark + " m", place(mark), top_ * scale + 9);
  clock.textContent = (walk.time[frame] / 1e6).toFixed(3) + " s";
  slider.value = frame;
}

function show(number) {
  frame = Math.max(0, Math.min(last, number));
  moment = walk.time[frame];
  draw();
}

function toggle(on) {
  playing = on;
  play.textContent = on ? "Pause" : "Play";
  if (on && frame === last) show(0);
  before = performance.now();
  if (on) requestAnimationFrame(tick);
}

function tick(now) {
  if (!playing) return;
  moment += 1000 * Math.max(0, now - before) / Number(speed.value);
  before = now;
  while (frame < last && walk.time[frame + 1] <= moment) frame++;
  draw();
  if (frame < last) requestAnimationFrame(tick);
  else toggle(false);
}

play.onclick = () => toggle(!playing);
slider.oninput = () => { toggle(false); show(Number(slider.value)); };
window.onresize = draw;
new ResizeObserver(draw).observe(canvas.parentElement); // a frame may get its size after the first drawing
window.onkeydown = event => {
  const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (event.target === speed || event.target === play) return;
  if (event.key === " ") toggle(!playing);
  else if (step) { toggle(false); show(frame + step); }
  else return;
  event.preventDefault();
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
show(0);
toggle(!matchMedia("(prefers-reduced-motion: reduce)").matches);
</script>
</body>
</html>
"""
