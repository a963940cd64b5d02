"use strict";
// Of a `walk`: time of each frame in µs; joints, center, radii of the links, sprocket at the release (x, y, radius), its
// places in the frames that it is in, and view (left, right, bottom, top) in tenths of a millimetre; marks on the floor
// in m, and its heights there; floor, its profile; stretches of it with coefficients of their own (colour, label, faces);
// colors; isWhole, false while more frames are to come.
const colorOf = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name);

// Draws a walk on a canvas and plays it. `controls` are elements: play, slider, clock, speed; without them another
// player leads.
class Player {
  constructor(canvas, controls = {}) {
    Object.assign(this, controls, { canvas, pen: canvas.getContext("2d"), walk: null });
    Object.assign(this, { frame: 0, moment: 0, playing: false });
    this.below = this.above = () => {}; // draw more, in the units of the walk, before and after the chain
    this.shown = () => {}; // is told of each moment that is shown
    if (this.play) {
      this.play.onclick = () => this.toggle(!this.playing);
      this.slider.oninput = () => { this.toggle(false); this.show(Number(this.slider.value)); };
      for (const slow of [1, 2, 4, 8, 16, 32, 64]) this.offer(slow);
    }
    // a frame may get its size after the first drawing
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
    window.addEventListener("resize", () => this.draw());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  // A speed to choose, among the others in order.
  offer(slow) {
    const text = slow === 1 ? "real time" : slow > 1 ? slow + "× slower" : 1 / slow + "× faster";
    const options = [...this.speed.options];
    if (options.some(option => Number(option.value) === slow)) return;
    this.speed.add(new Option(text, slow), options.find(option => Number(option.value) > slow) || null);
  }

  get last() { return this.walk.time.length - 1; }

  // Show a walk from its beginning; play it unless the reader wants little motion.
  load(walk, labels) {
    this.walk = { isWhole: true, ...walk };
    if (labels) labels.replaceChildren(...walk.stretches.map(([color, label]) => {
      const text = document.createElement("span");
      text.textContent = "▬ " + label + "  ";
      text.style.color = color;
      return text;
    }));
    if (this.slider) this.slider.max = this.last;
    this.show(0);
    if (this.play) this.toggle(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  // More frames of a walk that is still being computed.
  append({ time = [], joints = [], center = [], ...rest }) {
    Object.assign(this.walk, rest);
    this.walk.time.push(...time);
    this.walk.joints.push(...joints);
    this.walk.center.push(...center);
    if (this.slider) this.slider.max = this.last;
    this.draw();
  }

  // Pixels of the canvas for a tenth of a millimetre, and what is to the left of the picture.
  get layout() {
    const [left, right, bottom, top] = this.walk.view, width = this.canvas.clientWidth;
    const scale = Math.min(width / (right - left), 0.75 * window.innerHeight / (top - bottom));
    const height = scale * Math.max(top - bottom, top + 28 / scale); // below the floor there is room for its marks
    const shift = (width - scale * (right - left)) / 2;
    return { left, right, bottom: top - height / scale, top, scale, height, shift };
  }

  // Where a pointer is, in tenths of a millimetre.
  place(event) {
    const { left, top, scale, shift } = this.layout, box = this.canvas.getBoundingClientRect();
    return [(event.clientX - box.left - shift) / scale + left, top - (event.clientY - box.top) / scale];
  }

  // A link from joint a to joint b: two circles and a waist.
  link(ax, ay, bx, by, radius) {
    const pen = this.pen, turn = Math.atan2(by - ay, bx - ax), half = Math.PI / 2;
    const x = -Math.sin(turn) * radius, y = Math.cos(turn) * radius, mx = (ax + bx) / 2, my = (ay + by) / 2;
    pen.beginPath();
    pen.arc(bx, by, radius, turn - half, turn + half);
    pen.quadraticCurveTo(mx + 0.24 * x, my + 0.24 * y, ax + x, ay + y);
    pen.arc(ax, ay, radius, turn + half, turn + 3 * half);
    pen.quadraticCurveTo(mx - 0.24 * x, my - 0.24 * y, bx - x, by - y);
    pen.fill();
    pen.stroke();
  }

  // A chain with these joints; outer links cover inner ones.
  chain(joints, radii, colors) {
    this.pen.strokeStyle = colors.edge;
    for (const parity of [0, 2]) {
      this.pen.fillStyle = parity ? colors.outer : colors.inner;
      for (let i = parity, size = joints.length; i < size; i += 4) {
        const k = (i + size - 2) % size;
        this.link(joints[k], joints[k + 1], joints[i], joints[i + 1], radii[i / 2]);
      }
    }
  }

  line(places) {
    this.pen.beginPath();
    for (const place of places) this.pen.lineTo(...place);
    this.pen.stroke();
  }

  draw() {
    if (!this.walk) return;
    const { walk, canvas, pen, frame } = this, ratio = window.devicePixelRatio || 1, width = canvas.clientWidth;
    const { left, bottom, top, scale, height, shift } = this.layout;
    canvas.style.height = height + "px";
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    // From here on lengths are tenths of a millimetre and y points up.
    pen.setTransform(scale * ratio, 0, 0, -scale * ratio, (shift - left * scale) * ratio, top * scale * ratio);
    const hair = pen.lineWidth = 1 / scale;
    pen.strokeStyle = colorOf("faint");
    pen.beginPath();
    if (walk.sprocket) pen.arc(...walk.sprocket, 0, 2 * Math.PI);
    pen.setLineDash([4 * hair, 3 * hair]);
    pen.stroke();
    pen.setLineDash([]);
    pen.fillStyle = colorOf("ground");
    pen.beginPath();
    if (frame < walk.places.length) pen.arc(...walk.places[frame], walk.sprocket[2], 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
    const floor = walk.floor, end = floor.length - 1;
    pen.beginPath();
    for (const place of [[floor[0][0], bottom], ...floor, [floor[end][0], bottom]]) pen.lineTo(...place);
    pen.fill();
    pen.strokeStyle = pen.fillStyle = colorOf("ink");
    this.line(floor);
    pen.lineWidth = 4 * hair;
    for (const [color, , faces] of walk.stretches) {
      pen.strokeStyle = color;
      for (const face of faces) this.line(face);
    }
    pen.lineWidth = hair;
    walk.marks.forEach((mark, i) => pen.fillRect(mark * 1e4 - hair / 2, walk.heights[i] - 6 * hair, hair, 6 * hair));
    this.below(hair);
    this.chain(walk.joints[frame], walk.radii, walk.colors);
    pen.strokeStyle = pen.fillStyle = colorOf("ink");
    this.line(walk.center.slice(0, frame + 1));
    pen.beginPath();
    pen.arc(...walk.center[frame], 4 * hair, 0, 2 * Math.PI);
    pen.fill();
    this.above(hair);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = colorOf("ink");
    pen.font = "13px system-ui, sans-serif";
    [pen.textAlign, pen.textBaseline] = ["center", "top"];
    // As many labels as do not touch, legible where a slope or a stair passes below them.
    const marks = walk.marks, every = Math.ceil(60 / ((marks[1] - marks[0]) * 1e4 * scale)) || 1;
    [pen.lineWidth, pen.strokeStyle, pen.lineJoin] = [4, colorOf("ground"), "round"];
    for (const mark of marks.filter((_, i) => i % every === 0)) {
      const text = mark + " m", half = pen.measureText(text).width / 2, x = shift + (mark * 1e4 - left) * scale;
      const place = [text, Math.max(half, Math.min(width - half, x)), height - 18]; // nothing is cut off at the edges
      pen.strokeText(...place);
      pen.fillText(...place);
    }
    if (this.clock) this.clock.textContent = (walk.time[frame] / 1e6).toFixed(3) + " s";
    if (this.slider) this.slider.value = frame;
    this.shown(this.moment);
  }

  // The last frame of a walk at a moment [µs].
  frameAt(moment, walk = this.walk, from = 0) {
    let frame = from;
    while (frame < walk.time.length - 1 && walk.time[frame + 1] <= moment) frame++;
    return frame;
  }

  show(number) {
    this.frame = Math.max(0, Math.min(this.last, number));
    this.moment = this.walk.time[this.frame];
    this.draw();
  }

  toggle(on) {
    this.playing = on;
    this.play.textContent = on ? "Pause" : "Play";
    if (on && this.frame === this.last && this.walk.isWhole) this.show(0);
    this.before = performance.now();
    cancelAnimationFrame(this.next);
    if (on) this.next = requestAnimationFrame(now => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    this.moment += 1000 * Math.max(0, now - this.before) / Number(this.speed.value);
    this.before = now;
    this.frame = this.frameAt(this.moment, this.walk, this.frame);
    const isOver = this.frame === this.last;
    if (isOver && !this.walk.isWhole) this.moment = this.walk.time[this.frame]; // wait for what is being computed
    this.draw();
    if (!isOver || !this.walk.isWhole) this.next = requestAnimationFrame(later => this.tick(later));
    else this.toggle(false);
  }

  // Arrow keys step, the space bar plays; where these keys have a meaning of their own, they keep it.
  onKey(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const own = event.target.closest("input, select, button, textarea, summary, a, [role=button]");
    if (!this.walk || (own && own !== this.slider) || !(step || event.key === " ")) return;
    this.toggle(step ? false : !this.playing);
    if (step) this.show(this.frame + step);
    event.preventDefault();
  }
}
