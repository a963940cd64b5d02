"""The page that shows a walk in motion: its frame, with controls, and what it draws of a chain in an upright plane."""

import html
import json
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.pictures.style import BLUE

WIDTH: Final = 960
TALLEST: Final = 560
"""Greatest width and height of GIF and MP4 [pixels]."""
ENLARGEMENT: Final = 3
"""Pictures are drawn this many times larger and averaged down, because Pillow does not smooth edges."""

OUTER: Final = BLUE
INNER: Final = "#9CCBE6"
EDGE: Final = "#00385A"
"""Colours of outer links, of inner links and of their edges."""


@dataclass(frozen=True)
class Drawing:
    """What a page needs to draw a chain.

    Attributes:
        constants: program text after the data, with lines that end.
        program: functions, `draw` among them, which draws the frame of number `frame`.
        style: further rules of style.
        controls: further controls.
    """

    constants: str
    program: str
    style: str = ""
    controls: str = ""


def page(title: str, data: dict[str, Any], drawing: Drawing) -> str:
    """A page that loads nothing else.

    Args:
        title: plain text.
        data: numbers and lists, the constant `walk` of the program: `time` of each frame [µs], `slow`, and what the
            drawing needs.
        drawing: how a frame is drawn.
    """
    text = _PAGE.replace("{{style}}", drawing.style).replace("{{controls}}", drawing.controls)
    text = text.replace("{{constants}}", drawing.constants).replace("{{drawing}}", drawing.program)
    text = text.replace("{{title}}", html.escape(title))
    return text.replace("{{data}}", json.dumps(data, separators=(",", ":"), allow_nan=False))


def whole(values: NDArray[np.float64], parts: float = 1e4) -> Any:
    """Numbers in whole parts, as lists: lengths [m] in tenths of a millimetre."""
    return np.rint(values * parts).astype(int).tolist()


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
{{style}}</style>
</head>
<body>
<h1>{{title}}</h1>
<canvas id="stage" role="img" aria-label="The chain at the chosen time"></canvas>
<div class="controls">
  <button id="play" title="space">Play</button>
  <input id="slider" type="range" min="0" value="0" aria-label="frame" title="arrow keys: one frame">
  <output id="clock"></output>
  <select id="speed" aria-label="speed"></select>
{{controls}}</div>
<script>
"use strict";
const walk = {{data}};
{{constants}}const [canvas, play, slider, clock, speed] =
  ["stage", "play", "slider", "clock", "speed"].map(id => document.getElementById(id));
const pen = canvas.getContext("2d");
const last = walk.time.length - 1;
let frame = 0, moment = walk.time[0], playing = false, before = 0;

slider.max = last;
for (const slow of [...new Set([1, 2, 4, 8, 16, 32, 64, walk.slow])].sort((a, b) => a - b)) {
  const text = slow === 1 ? "real time" : slow > 1 ? slow + "× slower" : 1 / slow + "× faster";
  speed.add(new Option(text, slow, false, slow === walk.slow));
}

{{drawing}}function show(number) {
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

FLAT: Final = Drawing(
    constants="""const [left, right, bottom, top_] = walk.view;
""",
    program="""// Outline of a link from joint a to joint b: two circles and a waist.
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

""",
)
"""A chain in an upright plane, from the side."""
