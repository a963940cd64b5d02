"""The moving page of a chain whose plane tilts: its data, and the program that draws it from any side."""

from dataclasses import asdict
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.pictures.player_page import EDGE, INNER, OUTER, Drawing, whole
from warpchain.pictures.room import CORNER, center_in_room, check_room, floor_of, planes, room_box
from warpchain.pictures.room_stage import INNER_WALL, OUTER_WALL
from warpchain.pictures.walk_shape import TiltingWalk


def room_data(walk: TiltingWalk, frames: NDArray[np.int_]) -> dict[str, Any]:
    """What the page draws.

    A frame is the mean of its joints, two unit vectors in its plane, and the joints along these from the mean: lengths
    in whole tenths of a millimetre, unit vectors in hundred-thousandths. So a page is hardly larger than one of a chain
    in an upright plane, about 1 MB with 60 links and 2,000 frames.

    Args:
        walk: a walk with frames whose plane tilts.
        frames: numbers of the frames on the page.

    Raises:
        ValueError: joints in the room are missing for some frames, or broken.
    """
    joints, times, parameters = check_room(walk), walk.frame_time[frames], walk.setup.parameters
    low, high = room_box(walk, joints)
    floor = floor_of(low, high)
    middles, axes = planes(joints[frames])
    local = (joints[frames] - middles[:, None]) @ np.swapaxes(axes, 1, 2)
    center = np.stack([np.interp(times, walk.time, row) for row in center_in_room(walk).T], axis=1)
    sprocket = walk.sprocket_center
    return {
        "time": whole(times, 1e6),
        "joints": whole(local.reshape(len(frames), -1)),
        "middle": whole(middles),
        "axes": whole(axes.reshape(len(frames), 6), 1e5),
        "center": whole(center),
        "radius": parameters.circle_radius * 1e4,
        "half_width": parameters.half_width * 1e4,
        "sprocket": None if sprocket is None else whole(np.array([*sprocket, walk.sprocket_radius])),
        "low": whole(low),
        "high": whole(high),
        "floor": asdict(floor),
        "view": list(CORNER),
        "colors": {
            "inner": INNER,
            "outer": OUTER,
            "edge": EDGE,
            "inner_wall": INNER_WALL,
            "outer_wall": OUTER_WALL,
        },
    }


ROOM: Final = Drawing(
    constants="""const views = {
  corner: walk.view, side: [0, 0], front: [90, 0], above: [0, 90],
};
let [azimuth, elevation] = walk.view; // degrees: about the vertical, from the side to the front; above the floor
""",
    style="""canvas { touch-action: none; cursor: grab; }
canvas:active { cursor: grabbing; }
:root { --grid: #c8c8c8; --shadow: #bdbdbd; }
@media (prefers-color-scheme: dark) { :root { --grid: #4a4f58; --shadow: #1f2227; } }
""",
    controls="""  <select id="view" aria-label="view" title="drag the picture or press shift and an arrow key: turn it">
    <option value="corner">from the corner</option>
    <option value="side">from the side</option>
    <option value="front">from the front</option>
    <option value="above">from above</option>
    <option value="turned" hidden>turned</option>
  </select>
""",
    program="""const view = document.getElementById("view");
canvas.title = "drag: turn";

// Corners of a link's outline, anticlockwise: half lengths along it, radii along it and across it.
const corners = [];
for (const end of [1, -1]) {
  for (let k = -4; k <= 4; k++) {
    const turn = k * Math.PI / 8;
    corners.push([end, end * Math.cos(turn), end * Math.sin(turn)]);
  }
  for (const ramp of [2 / 3, 1 / 3, 0, -1 / 3, -2 / 3]) {
    corners.push([end * ramp, 0, end * (0.62 + 0.38 * ramp * ramp)]);
  }
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// How the room is seen: unit vectors to the right, up, and towards the viewer.
function directions(azimuth, elevation) {
  const a = azimuth * Math.PI / 180, b = elevation * Math.PI / 180;
  const [sa, ca, sb, cb] = [Math.sin(a), Math.cos(a), Math.sin(b), Math.cos(b)];
  return { right: [ca, 0, -sa], up: [-sa * sb, cb, -ca * sb], toward: [sa * cb, sb, ca * cb] };
}

// Least and greatest right and up of the walk and its floor.
function bounds({ right, up }) {
  const { low, high, floor } = walk, points = [];
  for (const x of floor.ends_x) for (const z of floor.ends_z) points.push([x * 1e4, 0, z * 1e4]);
  for (const x of [low[0], high[0]]) for (const z of [low[2], high[2]]) points.push([x, high[1], z]);
  const across = points.map(p => dot(p, right)), along = points.map(p => dot(p, up));
  return [Math.min(...across), Math.max(...across), Math.min(...along), Math.max(...along)];
}

function draw() {
  const style = getComputedStyle(document.documentElement);
  const color = name => style.getPropertyValue("--" + name);
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth;
  const [beside, below, above] = [Math.min(48, width / 12), 48, 8];
  const first = bounds(directions(...walk.view));
  const tall = (width - 2 * beside) * (first[3] - first[2]) / (first[1] - first[0]) + below + above;
  const height = Math.min(tall, 0.75 * window.innerHeight);
  canvas.style.height = height + "px";
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const seen = directions(azimuth, elevation), { right, up, toward } = seen;
  const [left, end, bottom, top_] = bounds(seen);
  const scale = Math.min((width - 2 * beside) / (end - left), (height - below - above) / (top_ - bottom));
  const shiftX = (width - scale * (left + end)) / 2;
  const shiftY = (height - below + above + scale * (bottom + top_)) / 2;
  // Lengths in the room are tenths of a millimetre, those in the picture pixels.
  const place = p => [shiftX + scale * dot(p, right), shiftY - scale * dot(p, up)];
  const line = (points, closed) => {
    pen.beginPath();
    for (const p of points) pen.lineTo(...place(p));
    if (closed) pen.closePath();
  };
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.lineJoin = "round";
  pen.lineWidth = 1;
  drawFloor(place, line, toward, scale, color);

  const [ox, oy, oz] = walk.middle[frame], axes = walk.axes[frame].map(part => part / 1e5);
  const e1 = axes.slice(0, 3), e2 = axes.slice(3);
  const joints = walk.joints[frame], size = joints.length;
  const shadow = [];
  for (let i = 0; i < size; i += 2) {
    const [x, y] = [joints[i], joints[i + 1]];
    shadow.push([ox + x * e1[0] + y * e2[0], 0, oz + x * e1[2] + y * e2[2]]);
  }
  pen.strokeStyle = color("shadow");
  pen.lineWidth = Math.max(1, walk.half_width * scale);
  line(shadow, true);
  pen.stroke();
  drawChain([ox, oy, oz], e1, e2, joints, place, seen, scale);

  pen.lineWidth = 1;
  pen.strokeStyle = pen.fillStyle = color("ink");
  line(walk.center.slice(0, frame + 1), false);
  pen.stroke();
  pen.beginPath();
  pen.arc(...place(walk.center[frame]), 4, 0, 2 * Math.PI);
  pen.fill();
  clock.textContent = (walk.time[frame] / 1e6).toFixed(3) + " s";
  slider.value = frame;
}

// The floor with its grid, numbers along the two edges nearest to the viewer, and the sprocket.
function drawFloor(place, line, toward, scale, color) {
  const { x, z, spacing, ends_x: [x0, x1], ends_z: [z0, z1] } = walk.floor;
  const point = (a, b) => [a * 1e4, 0, b * 1e4];
  pen.fillStyle = color("ground");
  line([point(x0, z0), point(x1, z0), point(x1, z1), point(x0, z1)], true);
  pen.fill();
  pen.strokeStyle = color("grid");
  for (const a of x) { line([point(a, z0), point(a, z1)], false); pen.stroke(); }
  for (const b of z) { line([point(x0, b), point(x1, b)], false); pen.stroke(); }
  if (toward[1] < 0.02) { // seen from its edge
    pen.strokeStyle = color("ink");
    line([point(x0, z0), point(x1, z0), point(x1, z1), point(x0, z1)], true);
    pen.stroke();
  }
  pen.fillStyle = color("ink");
  pen.font = "13px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const nearZ = toward[2] >= -1e-9 ? z1 : z0, nearX = toward[0] >= -1e-9 ? x1 : x0;
  const farZ = z0 + z1 - nearZ, farX = x0 + x1 - nearX;
  label("x", x, a => point(a, nearZ), [x0, x1], point((x0 + x1) / 2, farZ));
  label("z", z, b => point(nearX, b), [z0, z1], point(farX, (z0 + z1) / 2));

  function label(name, marks, spot, ends, opposite) {
    const [first, last] = ends.map(end => place(spot(end))), far = place(opposite);
    const size = Math.hypot(last[0] - first[0], last[1] - first[1]);
    if (size < 0.2 * scale * (ends[1] - ends[0]) * 1e4) return; // this edge points to the viewer
    const middle = [(first[0] + last[0]) / 2, (first[1] + last[1]) / 2];
    let [ux, uy] = [middle[0] - far[0], middle[1] - far[1]];
    const length = Math.hypot(ux, uy);
    [ux, uy] = length < 1 ? [0, 1] : [ux / length, uy / length];
    const every = Math.ceil(44 / (size * spacing / (ends[1] - ends[0])));
    for (const mark of marks) {
      if (Math.round(mark / spacing) % every) continue;
      const [px, py] = place(spot(mark));
      pen.fillText(mark + " m", px + 26 * ux, py + 14 * uy);
    }
    pen.fillText(name, Math.max(6, Math.min(canvas.clientWidth - 6, middle[0] + 64 * ux)), middle[1] + 32 * uy);
  }

  if (!walk.sprocket) return;
  const [sx, sy, radius] = walk.sprocket, circle = [];
  for (let k = 0; k < 100; k++) {
    circle.push([sx + radius * Math.cos(k * Math.PI / 50), sy + radius * Math.sin(k * Math.PI / 50), 0]);
  }
  pen.strokeStyle = color("faint");
  line(circle, true);
  pen.stroke();
  line([[sx, sy, 0], [sx, 0, 0]], false);
  pen.stroke();
}

// Links as flat bodies, those behind first: the parts of the wall that can be seen, then the face.
function drawChain(middle, e1, e2, joints, place, { right, up, toward }, scale) {
  const [a1, b1, c1] = [right, up, toward].map(axis => dot(axis, e1));
  const [a2, b2, c2] = [right, up, toward].map(axis => dot(axis, e2));
  const normal = [e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]];
  const half = walk.half_width * (dot(normal, toward) < 0 ? -1 : 1);
  const [mx, my] = place(middle), face = [mx + scale * half * dot(normal, right), my - scale * half * dot(normal, up)];
  const back = [2 * (mx - face[0]), 2 * (my - face[1])];
  const links = [], size = joints.length;
  for (let i = 0; i < size; i += 2) {
    const k = (i + size - 2) % size;
    const dx = (joints[i] - joints[k]) / 2, dy = (joints[i + 1] - joints[k + 1]) / 2;
    const [x, y] = [joints[k] + dx, joints[k + 1] + dy], outer = i % 4 === 2;
    // Outer links cover their neighbours, which are at most one link further back or forward.
    links.push({ x, y, dx, dy, outer, depth: x * c1 + y * c2 + (outer ? 2 * Math.hypot(dx, dy) : 0) });
  }
  links.sort((one, other) => one.depth - other.depth);
  pen.lineWidth = 0.6;
  pen.strokeStyle = walk.colors.edge;
  for (const { x, y, dx, dy, outer } of links) {
    const unit = walk.radius / Math.hypot(dx, dy);
    const flat = corners.map(([half, along, across]) => {
      const [p, q] = [half + along * unit, across * unit];
      return [x + p * dx - q * dy, y + p * dy + q * dx];
    });
    const spots = flat.map(([u, v]) => [face[0] + scale * (u * a1 + v * a2), face[1] - scale * (u * b1 + v * b2)]);
    pen.fillStyle = outer ? walk.colors.outer_wall : walk.colors.inner_wall;
    pen.beginPath();
    flat.forEach(([u, v], j) => {
      const next = (j + 1) % flat.length;
      if ((flat[next][1] - v) * c1 - (flat[next][0] - u) * c2 <= 1e-6) return;
      const [p, q] = [spots[j], spots[next]];
      pen.moveTo(...p);
      pen.lineTo(...q);
      pen.lineTo(q[0] + back[0], q[1] + back[1]);
      pen.lineTo(p[0] + back[0], p[1] + back[1]);
      pen.closePath();
    });
    pen.fill();
    pen.fillStyle = outer ? walk.colors.outer : walk.colors.inner;
    pen.beginPath();
    for (const spot of spots) pen.lineTo(...spot);
    pen.closePath();
    pen.fill();
    pen.stroke();
  }
}

function turn(across, along) {
  azimuth = (azimuth + across + 540) % 360 - 180;
  elevation = Math.max(0, Math.min(90, elevation + along));
  view.value = "turned";
  draw();
}

let held = null; // the pointer that turns the picture, and where it was last
canvas.onpointerdown = event => {
  if (held || event.button !== 0) return;
  held = { id: event.pointerId, x: event.clientX, y: event.clientY };
  canvas.setPointerCapture(event.pointerId);
};
canvas.onpointermove = event => {
  if (!held || event.pointerId !== held.id) return;
  turn((held.x - event.clientX) / 3, (event.clientY - held.y) / 3);
  held = { id: held.id, x: event.clientX, y: event.clientY };
};
canvas.onpointerup = canvas.onpointercancel = event => { if (held && event.pointerId === held.id) held = null; };
canvas.ondblclick = () => { view.value = "corner"; view.onchange(); };
view.onchange = () => { [azimuth, elevation] = views[view.value] || [azimuth, elevation]; draw(); };
window.addEventListener("keydown", event => {
  const step = { ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[event.key];
  if (!step || !event.shiftKey) return;
  turn(...step);
  event.preventDefault();
  event.stopImmediatePropagation();
}, true);

""",
)
"""A chain in the room, from any side above the floor."""
