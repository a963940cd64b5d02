// The page of `warpchain live`. A set-up is a mapping of names to values, see asked_walks.py; it stands behind the # of the address.
const $ = id => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const CONTROLS = { // field: label, least, greatest and step of its slider; or words to choose among
  Chain: {
    links: ["links", 30, 180, 2], coulomb_friction: ["friction in the joints", 0, 5e-4, 1e-5],
    charm_mass: ["mass of a charm", 0, 0.03, 0.001], charm_link: ["link that carries it", 0, 179, 1],
    preset: ["preset", "paper", "soft"],
  },
  Sprocket: {
    frequency: ["frequency", 1, 30, 0.5], clearance: ["clearance from the floor", 0, 0.1, 0.001],
    start: ["start", "spinning", "rest", "ellipse"], seed: ["seed of a random sample (empty: Table 1's means)"],
  },
  Floor: {
    floor_friction: ["friction", 0, 1, 0.01], floor_restitution: ["restitution", 0, 1, 0.01], slope: ["slope, downhill", -20, 20, 0.5],
    floor: ["profile"],
  },
  "Plane of the chain": {
    plane: ["plane", "fixed", "tilting"], tilt: ["tilt at the release", -0.3, 0.3, 0.01], lateral_speed: ["speed sideways", -1, 1, 0.05],
  },
};
const DEFAULTS = { preset: "paper", seed: null };
const token = new URLSearchParams(location.search).get("token");
const player = new Player($("stage"), { play: $("play"), slider: $("slider"), clock: $("clock"), speed: $("speed") });
const other = new Player($("stage-a"));
let setup = {}, sideA = null, ghost = null, arrow = null, stroke = null, samples = [], values = {}, asking = null, sampling = null;
$("speed").value = 4;

const isOf = (name, kind) => Object.values(CONTROLS).some(group => name in group && typeof group[name][1] === kind);
const unitOf = name => !(name in about.fields) || about.fields[name].unit === "1" ? "" : about.fields[name].unit;
const number = (value, digits = 3) => value === null || value === undefined ? "unknown" : Number(value.toPrecision(digits)).toString();
const written = value => typeof value === "string" ? value : JSON.stringify(value);
const read = text => { try { return JSON.parse(text); } catch { return text; } };
const pairs = given => Object.entries(given).map(([name, value]) => `${name} = ${written(value)}`).join(", ");

// The address and the set-ups

function readAddress() {
  const given = Object.fromEntries([...new URLSearchParams(location.hash.slice(1))].map(([name, text]) => [name, read(text)]));
  sideA = given.A || null;
  delete given.A;
  setup = Object.keys(given).length ? given : { ...about.first };
}

function writeAddress() {
  const parts = Object.entries({ ...setup, ...(sideA && { A: sideA }) }).map(([name, value]) => [name, written(value)]);
  history.replaceState(null, "", location.pathname + location.search + "#" + new URLSearchParams(parts));
}

// Messages of the server, one a line; throws an AbortError if `signal` does.
async function ask(path, content, signal, take) {
  const headers = { "Content-Type": "application/json", "X-Token": token };
  const answer = await fetch(path, { method: "POST", headers, body: JSON.stringify(content), signal }).catch(error => {
    throw error.name === "AbortError" ? error : new Error("The server has ended; start `warpchain live` again.");
  });
  if (!answer.ok) throw new Error(await answer.text());
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "", isOver = false;
  for (let part; !(part = await reader.read()).done;) {
    const lines = (rest + part.value).split("\n");
    rest = lines.pop();
    for (const message of lines.map(JSON.parse)) {
      if (message.error) throw new Error(message.error);
      isOver ||= "end" in message;
      take(message);
    }
  }
  if (!isOver) throw new Error("The server broke off; its terminal says why.");
}

// What was refused stands beside its control; what has none, at the top.
function refuse(error) {
  if (error.name === "AbortError") return;
  const name = /^(?:\w+\.)?(\w+)/.exec(error.message)?.[1], place = $("no-" + name) || $("problem");
  place.textContent = error.message;
  if (name === "push") $("push").open = true;
  $("said").textContent = "No walk: see what is refused.";
}

function clear() {
  for (const element of document.querySelectorAll(".refusal, .problem")) element.textContent = "";
}

// One walk

function takeWalk(stage, show) {
  const began = performance.now();
  return message => {
    if (message.first) stage.load({ ...message.first, isWhole: false });
    if (message.first && !window.firstFrame) window.firstFrame = performance.now();
    if (message.first) window.lastDelay = performance.now() - began;
    if (message.more) stage.append(message.more);
    if (message.phase && show) $("said").textContent = message.phase === "compile"
      ? "Kernels are being loaded; the first time they are compiled, which takes up to a minute." : `Computing: ${message.phase}, ${number(message.time)} s`;
    if (!message.end) return;
    if (message.whole && !message.first) {
      const { time, joints, center, ...scenery } = message.whole;
      if (stage.walk && !stage.walk.isWhole) stage.append({ ...scenery, isWhole: true });
      else stage.load(message.whole);
    }
    if (show) tell(message.end);
  };
}

function start(keepsGhost = false) {
  asking?.abort();
  sampling?.abort();
  asking = new AbortController();
  if (!keepsGhost) ghost = null;
  samples = [];
  clear();
  drawSamples();
  writeAddress();
  if (player.walk) player.walk.isWhole = true; // no more of the one before
  ask("/walk", setup, asking.signal, takeWalk(player, true)).catch(refuse);
}

function startA() {
  for (const id of ["side-a", "name-b"]) $(id).hidden = !sideA;
  $("compare").textContent = sideA ? "A/B: only one" : "A/B: keep this as A";
  $("compare").setAttribute("aria-pressed", Boolean(sideA));
  if (sideA) {
    $("about-a").textContent = pairs(sideA);
    other.load = function (walk) { Player.prototype.load.call(this, walk); };
    ask("/walk", sideA, null, takeWalk(other, false)).catch(refuse);
  }
}

// Results of a walk, the values of its controls, and lines that make it again.
function tell(end) {
  const lost = Object.entries(end.energy).filter(([, value]) => value !== null && value !== 0);
  $("said").textContent = end.dx === null ? `${end.status}: ${end.sentence}` : `Δx = ${number(end.dx, 4)} m, ${end.status}, ${end.bounces} bounces` +
    (end.fell_over === 1 ? ", fell over" : "") + end.warnings.map(text => "; " + text).join("");
  $("about-b").textContent = pairs(setup);
  const rows = [["walk time", number(end.walk_time, 4) + " s"], ["computed in", number(end.wall_time, 2) + " s"],
    ...lost.map(([name, value]) => [name.replaceAll("_", " "), number(value) + " J"])];
  $("numbers").tBodies[0].replaceChildren(...rows.map(([name, text]) => make("tr", {}, make("th", { scope: "row", textContent: name }), make("td", { textContent: text }))));
  const texts = Object.entries({ Python: end.python, "Command line": end.command, YAML: end.yaml }).filter(([, text]) => text);
  $("lines").replaceChildren($("lines").firstElementChild, ...texts.flatMap(([name, text]) => {
    const copy = make("button", { textContent: `Copy ${name}`, onclick: () => navigator.clipboard.writeText(text) });
    return [make("pre", { textContent: text, id: "line-" + name.split(" ")[0] }), copy];
  }));
  values = { ...end.values, seed: end.seed };
  showValues();
}

// Controls

function change(name, value) {
  if (value === null || value === "") delete setup[name];
  else setup[name] = value;
  delete setup.push; // its time and link were of another walk
  start();
}

function showValues() {
  for (const name of Object.values(CONTROLS).flatMap(Object.keys)) {
    const value = name in setup ? setup[name] : name in values ? values[name] : about.fields[name]?.default ?? DEFAULTS[name];
    for (const id of ["range-", "field-"]) if ($(id + name)) $(id + name).value = name === "floor" && value !== "flat" ? JSON.stringify(value) : value ?? "";
  }
  const floor = JSON.stringify(setup.floor ?? "flat");
  if ($("shape")) $("shape").value = floor === '"flat"' ? "flat" : floor === JSON.stringify(about.stairs) ? "stairs" : "drawn";
}

function buildControls() {
  for (const [title, group] of Object.entries(CONTROLS)) {
    const set = make("fieldset", {}, make("legend", { textContent: title }));
    for (const [name, [label, ...limits]] of Object.entries(group)) {
      const id = "field-" + name, unit = unitOf(name), hint = about.fields[name]?.text || "";
      const common = { id, title: hint, onchange: event => change(name, limits.length && isOf(name, "string") ? event.target.value : read(event.target.value)) };
      let fields;
      if (name === "floor") fields = floorControls(common);
      else if (typeof limits[0] === "string") fields = [make("select", common, ...limits.map(word => new Option(word)))];
      else {
        const [min, max, step] = limits;
        fields = [make("input", { ...common, type: "number", step: "any" }), make("span", { className: "unit", textContent: unit })];
        if (limits.length) {
          const range = make("input", { ...common, id: "range-" + name, type: "range", min, max, step, ariaLabel: label });
          range.oninput = () => { fields[1].value = range.value; };
          fields.unshift(range);
        } else fields.unshift(make("span"));
      }
      for (const field of fields) field.setAttribute("aria-describedby", "no-" + name);
      const refusal = make("p", { className: "refusal", id: "no-" + name });
      refusal.setAttribute("role", "alert");
      set.append(make("div", { className: "control" }, make("label", { htmlFor: id, textContent: label }), ...fields, refusal));
    }
    $("setup").append(set);
  }
  $("setup").append(make("button", { type: "button", textContent: "Reset", onclick: () => { setup = { ...about.first }; values = {}; start(); } }));
  $("setup").onsubmit = event => event.preventDefault();
}

function floorControls(common) {
  const shape = make("select", { id: "shape", ariaLabel: "shape of the floor" }, ...["flat", "stairs", "drawn"].map(word => new Option(word)));
  shape.onchange = () => {
    if (shape.value !== "drawn") change("floor", shape.value === "flat" ? null : about.stairs);
    else $("draw").click();
  };
  const draw = make("button", { id: "draw", type: "button", textContent: "Draw it on the picture" });
  draw.onclick = () => { player.toggle(false); stroke = []; $("stage").classList.add("grab"); $("said").textContent = "Drag over the picture: the line is the new floor."; };
  return [make("textarea", { ...common, rows: 2 }), shape, draw];
}

// A pushed link, a drawn floor

function nearestLink([x, y]) {
  const joints = player.walk.joints[player.frame], count = joints.length / 2;
  const middle = i => { const k = (i + count - 1) % count; return [(joints[2 * i] + joints[2 * k]) / 2, (joints[2 * i + 1] + joints[2 * k + 1]) / 2]; };
  const far = [...Array(count).keys()].map(i => Math.hypot(middle(i)[0] - x, middle(i)[1] - y)), link = far.indexOf(Math.min(...far));
  return far[link] < 200 ? { link, from: middle(link) } : null;
}

function push(link, x, y) { // N s
  const time = player.walk.time[player.frame] / 1e6;
  ghost = player.walk;
  setup.push = [...(setup.push || []), [time, link, x, y]];
  start(true);
}

$("stage").onpointerdown = event => {
  if (!player.walk || about.walks) return;
  const place = player.place(event), hit = nearestLink(place);
  if (stroke) stroke.push(place);
  else if (player.playing) player.toggle(false);
  else if (hit) [arrow, $("push-link").value] = [{ ...hit, to: place }, hit.link];
  else return;
  if (stroke || arrow) $("stage").setPointerCapture(event.pointerId);
  event.preventDefault();
};
$("stage").onpointermove = event => {
  if (arrow) arrow.to = player.place(event);
  else if (stroke?.length) stroke.push(player.place(event));
  else return $("stage").classList.toggle("grab", Boolean(stroke || (player.walk && !player.playing && nearestLink(player.place(event)))));
  player.draw();
};
$("stage").onpointerup = () => {
  if (arrow) {
    const { link, from, to } = arrow, impulse = [0, 1].map(i => Math.round((to[i] - from[i]) / 50) / 1e3); // N s: 0.2 for a metre
    arrow = null;
    if (impulse.some(part => part)) push(link, ...impulse);
    else player.draw();
  } else if (stroke?.length) {
    const points = [];
    for (const [x, y] of stroke.map(place => place.map(part => Math.round(part / 10) / 1e3)).sort((a, b) => a[0] - b[0]))
      if (!points.length || x - points.at(-1)[0] >= 0.02) points.push([x, y]);
    stroke = null;
    const [first, last] = [points[0], points.at(-1)];
    change("floor", [[first[0] - 0.2, 0], [first[0] - 0.1, 0], ...points, [last[0] + 0.1, 0], [last[0] + 0.2, 0]].map(point => point.map(part => Math.round(part * 1e3) / 1e3)));
  }
  $("stage").classList.remove("grab");
};

player.below = hair => {
  const pen = player.pen;
  pen.globalAlpha = 0.35;
  for (const { path, side } of samples) {
    pen.strokeStyle = colorOf(side && sideA ? "red" : "blue");
    player.line(path);
  }
  if (ghost) player.chain(ghost.joints[player.frameAt(player.moment, ghost)], ghost.radii, { inner: "#bbb", outer: "#999", edge: "#777" });
  pen.globalAlpha = 1;
  pen.lineWidth = hair;
};
player.above = hair => {
  const pen = player.pen, places = arrow ? [arrow.from, arrow.to] : stroke || [];
  if (!places.length) return;
  pen.strokeStyle = colorOf("red");
  pen.lineWidth = 3 * hair;
  player.line(places);
  if (!arrow) return;
  const turn = Math.atan2(arrow.to[1] - arrow.from[1], arrow.to[0] - arrow.from[0]);
  for (const side of [2.6, -2.6]) player.line([arrow.to, [arrow.to[0] + 12 * hair * Math.cos(turn + side), arrow.to[1] + 12 * hair * Math.sin(turn + side)]]);
};
player.shown = moment => { if (sideA && other.walk) { other.frame = other.frameAt(moment); other.draw(); } };

// Samples: the same seeds for each set-up

async function more() {
  const sides = [setup, ...(sideA ? [sideA] : [])].map(({ seed, push: _, ...given }) => given), first = Math.max(-1, ...samples.map(each => each.seed)) + 1;
  sampling?.abort();
  sampling = new AbortController();
  const wanted = 12 * sides.length, { signal } = sampling;
  let done = 0;
  const busy = on => { $("bar").hidden = $("cancel").hidden = !on; $("more").disabled = on; };
  busy(true);
  $("bar").value = 0;
  try {
    await ask("/samples", { setups: sides, first, count: 12 }, signal, ({ sample }) => {
      if (!sample || signal.aborted) return;
      samples.push(sample);
      $("bar").value = ++done / wanted;
      drawSamples();
    });
  } catch (error) { refuse(error); }
  if (sampling.signal === signal) busy(false);
}

const mean = list => list.reduce((sum, each) => sum + each, 0) / list.length;
const spread = list => Math.sqrt(list.reduce((sum, each) => sum + (each - mean(list)) ** 2, 0) / (list.length - 1));
const average = list => list.length < 2 ? "" : `${number(mean(list))} ± ${number(spread(list) / Math.sqrt(list.length), 2)} m`;

function drawSamples() {
  const sides = (sideA ? [1, 0] : [0]).map(side => samples.filter(each => each.side === side));
  const texts = sides.map((list, i) => {
    const rested = list.map(each => each.dx).filter(dx => dx !== null);
    return `${sideA ? "AB"[i] + ": " : ""}${list.length} samples, Δx = ${average(rested) || "…"}` + (rested.length > 1 ? ` (standard deviation ${number(spread(rested), 2)} m)` : "") +
      (rested.length < list.length ? `, ${list.length - rested.length} without Δx` : "");
  });
  if (sideA) {
    const earlier = new Map(sides[0].map(each => [each.seed, each.dx]));
    const apart = sides[1].filter(each => each.dx !== null && (earlier.get(each.seed) ?? null) !== null).map(each => each.dx - earlier.get(each.seed));
    if (apart.length > 1) texts.push(`B − A = ${average(apart)} over ${apart.length} equal samples`);
  }
  $("statistics").textContent = samples.length ? texts.join("; ") + ". Errors are standard errors of the mean." : "";
  const canvas = $("histogram"), known = samples.map(each => each.dx).filter(dx => dx !== null);
  canvas.hidden = known.length < 2;
  player.draw();
  if (canvas.hidden) return;
  const ratio = window.devicePixelRatio || 1, pen = canvas.getContext("2d"), width = canvas.width = canvas.clientWidth * ratio, height = canvas.height = 110 * ratio;
  const [low, high] = [Math.min(...known), Math.max(...known)], bins = 16, wide = (high - low || 0.01) / bins, x = dx => ((dx - low) / wide + 0.5) * width / (bins + 1.5);
  const counts = sides.map(list => list.reduce((found, { dx }) => { if (dx !== null) found[Math.min(bins, Math.floor((dx - low) / wide))]++; return found; }, Array(bins + 1).fill(0)));
  canvas.setAttribute("aria-label", "Histogram: " + $("statistics").textContent);
  counts.forEach((row, i) => {
    pen.fillStyle = colorOf(sideA && i === 0 ? "red" : "blue");
    row.forEach((count, bin) => pen.fillRect(x(low + bin * wide) + i * 0.4 * width / bins, (height - 22 * ratio) * (1 - count / Math.max(...counts.flat())), width / bins * (sideA ? 0.4 : 0.8), count / Math.max(...counts.flat()) * (height - 22 * ratio)));
  });
  pen.fillStyle = colorOf("ink");
  pen.font = `${12 * ratio}px system-ui, sans-serif`;
  pen.fillText(number(low) + " m", 0, height - 6 * ratio);
  pen.textAlign = "right";
  pen.fillText(number(high) + " m", width, height - 6 * ratio);
}

// A sweep: a point for each cell

function buildSweep() {
  const NS = "http://www.w3.org/2000/svg", node = (tag, attributes, text = "") => {
    const element = document.createElementNS(NS, tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.textContent = text;
    return element;
  };
  $("sweep").hidden = false;
  $("sweep").append(make("h2", { textContent: about.sweep.name }));
  for (const { name, axes, units, cells } of about.sweep.blocks) {
    const sizes = axes.map((_, i) => new Set(cells.map(cell => cell.at[i])).size), along = sizes.indexOf(Math.max(...sizes));
    const found = cells.filter(cell => cell.mean !== null), xs = found.map(cell => Number(cell.at[along]) || 0);
    if (!found.length || along < 0) continue;
    const [left, right, top] = [Math.min(...xs), Math.max(...xs), Math.max(...found.map(cell => cell.mean + (cell.error || 0)))], lines = new Map();
    const svg = node("svg", { viewBox: "0 0 640 320", role: "group", "aria-label": `${name}: mean distance against ${axes[along]}` });
    const place = (x, y) => [50 + 560 * (x - left) / (right - left || 1), 280 - 250 * y / (top || 1)];
    for (const cell of found) {
      const key = pairs(Object.fromEntries(axes.map((axis, i) => [axis, cell.at[i]]).filter((_, i) => i !== along)));
      if (!lines.has(key)) lines.set(key, []);
      lines.get(key).push(cell);
    }
    [...lines].forEach(([key, list], i) => {
      const color = `hsl(${i * 360 / lines.size} 65% 40%)`, points = list.map(cell => place(Number(cell.at[along]) || 0, cell.mean));
      svg.append(node("polyline", { points: points.join(" "), fill: "none", stroke: color, "stroke-width": 1.5 }));
      svg.append(node("text", { x: points.at(-1)[0], y: points.at(-1)[1] - 8, "text-anchor": "end" }, key));
      list.forEach((cell, k) => {
        const label = `${axes.map((axis, j) => `${axis} = ${cell.at[j]} ${units[j]}`).join(", ")}: Δx = ${number(cell.mean)} ± ${number(cell.error, 2)} m`;
        const point = node("circle", { cx: points[k][0], cy: points[k][1], r: 6, fill: color, tabindex: 0, role: "button", "aria-label": label });
        let next = 0;
        point.onclick = () => { setup = { index: cell.walks[next++ % cell.walks.length] }; start(); };
        point.onkeydown = event => { if (event.key === "Enter") point.onclick(); };
        point.append(node("title", {}, label + ". Each click walks the next sample."));
        svg.append(point);
      });
    });
    for (const [x, anchor] of [[left, "start"], [right, "end"]]) svg.append(node("text", { x: place(x, 0)[0], y: 298, "text-anchor": anchor }, `${x} ${units[along]}`));
    svg.append(node("text", { x: 330, y: 314, "text-anchor": "middle" }, axes[along]), node("text", { x: 50, y: 24 }, `mean Δx; the top is ${number(top)} m`));
    $("sweep").append(svg);
  }
}

// A page without a server: walks that it brings along

async function unpack(name) {
  const bytes = Uint8Array.from(atob($(name).textContent), letter => letter.charCodeAt(0));
  const walk = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json();
  for (let i = 1; i < walk.whole.joints.length; i++) walk.whole.joints[i] = walk.whole.joints[i].map((change, k) => change + walk.whole.joints[i - 1][k]);
  return walk;
}

function buildChoices() {
  document.body.classList.add("exported");
  const axes = Object.entries(about.walks), choice = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  const update = async () => {
    location.replace("#" + new URLSearchParams(axes.map(([name]) => [name, $(name).value])));
    setup = Object.fromEntries(axes.map(([name, list]) => [name, list[$(name).value]]));
    const found = await unpack("walk-" + axes.map(([name]) => $(name).value).join("-"));
    player.load(found.whole, $("labels"));
    tell(found.end);
  };
  for (const [name, list] of axes) {
    const select = make("select", { id: name, onchange: update }, ...list.map((value, i) => new Option(`${value} ${unitOf(name)}`, i)));
    select.value = choice[name] in list ? choice[name] : Math.min(1, list.length - 1);
    $("setup").append(make("div", { className: "control" }, make("label", { htmlFor: name, textContent: name }), select));
  }
  update().catch(refuse);
}

window.onkeydown = event => {
  const key = { s: "more", a: "compare" }[event.key];
  if (key && !about.walks && !event.ctrlKey && !event.metaKey && !event.altKey && !event.target.closest("input, select, textarea")) $(key).click();
  else player.onKey(event);
};
if (about.walks) buildChoices();
else {
  $("more").onclick = more;
  $("cancel").onclick = () => sampling?.abort();
  $("compare").onclick = () => { sideA = sideA ? null : { ...setup }; samples = []; startA(); start(); };
  $("push-do").onclick = () => { player.toggle(false); push(Number($("push-link").value), ...["x", "y"].map(axis => Number($("push-" + axis).value) / 1e3)); };
  $("push-undo").onclick = () => { if (setup.push?.pop() && !setup.push.length) delete setup.push; start(); };
  window.onhashchange = () => { readAddress(); startA(); start(); };
  if (about.sweep) buildSweep();
  buildControls();
  readAddress();
  showValues();
  startA();
  start();
}
