// The page of `warpchain live`. A set-up is a mapping of names to values, see asked_walks.py; it stands in the address
// behind the #. Of `about`: fields by name, the first set-up, stairs, a sweep or null, and the axes of a page without a
// server or null.
const CONTROLS = { // field: label, least, greatest and step of its slider; or words to choose among
  Chain: {
    links: ["links", 30, 180, 2], coulomb_friction: ["friction in the joints", 0, 5e-4, 1e-5],
    charm_mass: ["mass of a charm", 0, 0.03, 0.001], charm_link: ["link that carries the charm", 0, 179, 1],
    preset: ["preset", "paper", "soft"],
  },
  Sprocket: {
    frequency: ["frequency", 1, 30, 0.5], clearance: ["clearance from the floor", 0, 0.1, 0.001],
    start: ["start", "spinning", "rest", "ellipse"], seed: ["seed of a random sample (empty: means)"],
  },
  Floor: {
    floor_friction: ["friction", 0, 1, 0.01], floor_restitution: ["restitution", 0, 1, 0.01],
    slope: ["slope, downhill", -20, 20, 0.5], floor: ["profile"],
  },
  "Plane of the chain": {
    plane: ["plane", "fixed", "tilting"], tilt: ["tilt at the release", -0.3, 0.3, 0.01],
    lateral_speed: ["speed sideways at the release", -1, 1, 0.05],
  },
};
const NAMES = Object.values(CONTROLS).flatMap(Object.keys), WORDS = ["preset", "start", "plane"];
const PUSH = 2e-5; // N s for a tenth of a millimetre of the arrow: 0.2 N s for a metre
const NEAR = 200; // tenths of a millimetre within which a link is meant
const $ = id => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const token = new URLSearchParams(location.search).get("token");
const player = new Player($("stage"), { play: $("play"), slider: $("slider"), clock: $("clock"), speed: $("speed") });
const other = new Player($("stage-a")); // of side A; it follows the first one
let setup = {}, sideA = null, values = {}, ghost = null, samples = [];
let arrow = null, stroke = null; // what the mouse draws: a push, or a floor
let asking = null, sampling = null; // what can be aborted

// Texts
const unitOf = name => about.fields[name]?.unit ?? "";
const written = value => (typeof value === "string" ? value : JSON.stringify(value));
const read = text => { try { return JSON.parse(text); } catch { return text; } };
const isStairs = floor => written(floor) === written(about.stairs);
const shapeOf = floor => (!Array.isArray(floor) ? floor : isStairs(floor) ? "stairs" : "drawn");
const described = given => Object.entries(given)
  .map(([name, value]) => `${name} = ${name === "floor" ? shapeOf(value) : written(value)}`).join(", ");

// The address
function readAddress() {
  const parts = [...new URLSearchParams(location.hash.slice(1))].map(([name, text]) => [name, read(text)]);
  const { A = null, ...given } = Object.fromEntries(parts);
  sideA = A;
  setup = Object.keys(given).length ? given : { ...about.first };
}

function writeAddress() {
  const parts = Object.entries({ ...setup, ...(sideA && { A: sideA }) }).map(([name, value]) => [name, written(value)]);
  history.replaceState(null, "", location.pathname + location.search + "#" + new URLSearchParams(parts));
}

// The server
// Ask for something, and take each message, one a line; a refusal is an error, and so is an end before the end.
async function ask(path, content, { signal }, take) {
  const headers = { "Content-Type": "application/json", "X-Token": token };
  const lost = new Error("The server has ended: see its terminal, or start `warpchain live` again.");
  const answer = await fetch(path, { method: "POST", headers, body: JSON.stringify(content), signal }).catch(error => {
    throw signal.aborted ? error : lost;
  });
  if (!answer.ok) throw new Error(await answer.text());
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "", isOver = false;
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    const lines = (rest + part.value).split("\n");
    rest = lines.pop();
    for (const message of lines.map(JSON.parse)) {
      if (message.error) throw new Error(message.error);
      isOver ||= "end" in message;
      if (!signal.aborted) take(message);
    }
  }
  if (!isOver) throw lost;
}

// What is refused is said beside its control, or at the top if it has none.
function refuse(error) {
  if (error.name === "AbortError") return;
  const name = /^(?:\w+\.)?(\w+)/.exec(error.message)?.[1];
  ($("no-" + name) || $("problem")).textContent = error.message;
  if (name === "push") $("push").open = true;
  $("said").textContent = "No walk: see what is refused.";
}

// What a player does with the messages of a walk; `tell` takes its end, `note` how far it is.
function shownBy(stage, tell, note) {
  const asked = performance.now();
  let hasBegun = false;
  return ({ phase, first, more, whole, end }) => {
    const begun = first ? { ...first, isWhole: false } : hasBegun ? null : whole;
    if (begun) {
      hasBegun = true;
      stage.load(begun);
      stage.delay = performance.now() - asked;
    } else if (whole) {
      const { time: _, joints: __, center: ___, ...scenery } = whole;
      stage.append({ ...scenery, isWhole: true });
    }
    if (more) stage.append(more);
    if (phase) note(phase);
    if (end) tell(end);
  };
}

function start(kept = null) {
  asking?.abort();
  sampling?.abort();
  asking = new AbortController();
  [ghost, samples] = [kept, []];
  for (const element of document.querySelectorAll(".refusal, .problem")) element.textContent = "";
  if (player.walk) player.walk.isWhole = true; // it gets no more frames
  writeAddress();
  showSamples();
  const note = phase => {
    const loading = "Kernels are being loaded; the first time they are compiled, which takes up to a minute.";
    const text = phase === "compile" ? loading : `Computing: ${phase} …`;
    if ($("said").textContent !== text) $("said").textContent = text; // it is read aloud
  };
  ask("/walk", setup, asking, shownBy(player, tell, note)).catch(refuse);
}

function startA() {
  for (const id of ["side-a", "name-b"]) $(id).hidden = !sideA;
  $("compare").textContent = sideA ? "A/B: leave A" : "A/B: keep this as A";
  $("compare").setAttribute("aria-pressed", Boolean(sideA));
  if (!sideA) return;
  $("about-a").textContent = described(sideA);
  ask("/walk", sideA, new AbortController(), shownBy(other, () => {}, () => {})).catch(refuse);
}

// Results of a walk, the values of its controls, and the lines that make it again.
function tell(end) {
  const fell = end.fell_over === 1 ? ", fell over" : "", warnings = end.warnings.map(text => "; " + text).join("");
  const status = end.status.replaceAll("_", " ");
  $("said").textContent = end.dx === null ? `${status}: ${end.sentence}`
    : `Δx = ${number(end.dx, 4)} m, ${status} after ${end.bounces} bounces${fell}${warnings}`;
  $("about-b").textContent = described(setup);
  const energies = Object.entries(end.energy).filter(([, value]) => value), rows = [["walk time", end.walk_time, "s"]];
  if (end.wall_time) rows.push(["computed in", end.wall_time, "s"]);
  rows.push(...energies.map(([name, value]) => [name.replaceAll("_", " "), value, "J"]));
  $("numbers").tBodies[0].replaceChildren(...rows.map(([name, value, unit]) => make("tr", {},
    make("th", { scope: "row", textContent: name }), make("td", { textContent: `${number(value)} ${unit}` }))));
  const texts = [["python", end.python], ["command", end.command], ["yaml", end.yaml]].filter(([, text]) => text);
  $("lines").replaceChildren($("lines").firstElementChild, ...texts.flatMap(([name, text]) => [
    make("pre", { id: "line-" + name, textContent: text }),
    make("button", { textContent: `Copy ${name}`, onclick: () => copy("line-" + name) }),
  ]));
  values = { ...end.values, seed: end.seed };
  showValues();
}

// By the selection, as the clipboard's own interface is missing where pages come by plain HTTP or are in a frame.
function copy(id) {
  getSelection().selectAllChildren($(id));
  document.execCommand("copy");
}

// Controls
function change(name, value) {
  if (value === null || value === "") delete setup[name];
  else setup[name] = value;
  delete setup.push; // its time and its link are those of another walk
  start();
}

function showValues() {
  for (const name of NAMES) {
    const value = setup[name] ?? values[name] ?? about.fields[name]?.default ?? "";
    for (const field of [$("range-" + name), $("field-" + name)]) if (field) field.value = written(value);
    if (name === "floor" && $("shape")) $("shape").value = shapeOf(value);
  }
}

function buildControls() {
  for (const [title, group] of Object.entries(CONTROLS)) {
    const rows = Object.entries(group).map(([name, [label, ...limits]]) => {
      const refusal = make("p", { className: "refusal", id: "no-" + name });
      refusal.setAttribute("role", "alert");
      const fields = fieldsOf(name, label, limits);
      for (const field of fields) field.setAttribute("aria-describedby", refusal.id);
      const head = make("label", { htmlFor: "field-" + name, textContent: label });
      return make("div", { className: "control" }, head, ...fields, refusal);
    });
    $("setup").append(make("fieldset", {}, make("legend", { textContent: title }), ...rows));
  }
  const reset = () => { [setup, values] = [{ ...about.first }, {}]; start(); };
  $("setup").append(make("button", { id: "reset", type: "button", textContent: "Reset", onclick: reset }));
  $("setup").onsubmit = event => event.preventDefault();
}

function fieldsOf(name, label, limits) {
  const common = { id: "field-" + name, title: about.fields[name]?.text ?? "" };
  if (WORDS.includes(name)) {
    const onchange = event => change(name, event.target.value);
    return [make("select", { ...common, onchange }, ...limits.map(word => new Option(word)))];
  }
  common.onchange = event => change(name, read(event.target.value));
  if (name === "floor") return [make("textarea", { ...common, rows: 2 }), ...shapes()];
  const field = make("input", { ...common, type: "number", step: "any" }), [min, max, step] = limits;
  const unit = make("span", { className: "unit", textContent: unitOf(name) });
  if (!limits.length) return [make("span"), field, unit];
  const range = make("input", { ...common, id: "range-" + name, type: "range", min, max, step, ariaLabel: label });
  range.oninput = () => { field.value = range.value; };
  return [range, field, unit];
}

function shapes() {
  const draw = make("button", { id: "draw", type: "button", textContent: "Draw it on the picture" });
  draw.onclick = () => {
    player.toggle(false);
    stroke = [];
    $("stage").classList.add("grab");
    $("said").textContent = "Drag over the picture: the line becomes the floor.";
  };
  const onchange = ({ target: { value } }) => {
    if (value === "drawn") draw.onclick();
    else change("floor", value === "flat" ? null : about.stairs);
  };
  const options = ["flat", "stairs", "drawn"].map(word => new Option(word));
  const shape = make("select", { id: "shape", ariaLabel: "shape of the floor", onchange }, ...options);
  return [shape, draw];
}

// The mouse on the picture: it pushes a link of a paused walk, or draws a floor
function middle(joints, link) {
  const one = 2 * link, before = (one + joints.length - 2) % joints.length;
  return [(joints[one] + joints[before]) / 2, (joints[one + 1] + joints[before + 1]) / 2];
}

function linkAt([x, y]) {
  const joints = player.walk.joints[player.frame];
  const apart = ([u, v]) => Math.hypot(u - x, v - y);
  const far = player.walk.radii.map((_, link) => apart(middle(joints, link)));
  const link = far.indexOf(Math.min(...far));
  return far[link] < NEAR ? { link, from: middle(joints, link), to: [x, y] } : null;
}

function push(link, x, y) {
  const { walk, frame } = player, slip = frame === 0 ? 1 : -1; // times are rounded; so it lies within the walk
  setup.push = [...(setup.push ?? []), [(walk.time[frame] + slip) / 1e6, link, x, y]];
  start(walk);
}

// The floor along a stroke, between level ends.
function floorOf(places) {
  const points = [], rounded = place => place.map(part => Math.round(part * 1e3) / 1e3);
  for (const [x, y] of places.map(place => rounded(place.map(part => part / 1e4))).sort((a, b) => a[0] - b[0]))
    if (!points.length || x - points.at(-1)[0] >= 0.01) points.push([x, y]);
  const [[left], [right]] = [points[0], points.at(-1)];
  const ends = [[left - 0.2, 0], [left - 0.1, 0], [right + 0.1, 0], [right + 0.2, 0]].map(rounded);
  return [...ends.slice(0, 2), ...points, ...ends.slice(2)];
}

function useMouse(canvas) {
  canvas.onpointerdown = event => {
    if (!player.walk) return;
    if (stroke) stroke.push(player.place(event));
    else if (player.playing) player.toggle(false);
    else arrow = linkAt(player.place(event));
    if (!stroke && !arrow) return;
    if (arrow) $("push-link").value = arrow.link;
    canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
  };
  canvas.onpointermove = event => {
    if (!player.walk) return;
    const place = player.place(event);
    if (arrow) arrow.to = place;
    else if (stroke?.length) stroke.push(place);
    canvas.classList.toggle("grab", Boolean(stroke || arrow || (!player.playing && linkAt(place))));
    if (stroke || arrow) player.draw();
  };
  canvas.onpointerup = () => {
    const [drawn, pushed] = [stroke, arrow];
    if (drawn?.length) stroke = null;
    arrow = null;
    if (drawn?.length) change("floor", floorOf(drawn));
    if (!pushed) return;
    const impulse = pushed.to.map((part, i) => Math.round((part - pushed.from[i]) * PUSH * 1e4) / 1e4);
    if (impulse.some(part => part)) push(pushed.link, ...impulse);
    else player.draw();
  };
  canvas.onpointercancel = () => { stroke = arrow = null; player.draw(); };
}

player.below = hair => {
  const pen = player.pen;
  pen.globalAlpha = 0.35;
  for (const { path, side } of samples) {
    pen.strokeStyle = colorOf(side ? "red" : "blue");
    player.line(path);
  }
  const colors = { inner: "#bbb", outer: "#999", edge: "#777" };
  if (ghost) player.chain(ghost.joints[player.frameAt(player.moment, ghost)], ghost.radii, colors);
  pen.globalAlpha = 1;
  pen.lineWidth = hair;
};
player.above = hair => {
  player.pen.strokeStyle = colorOf("red");
  player.pen.lineWidth = 3 * hair;
  if (stroke) player.line(stroke);
  if (!arrow) return;
  const { from, to } = arrow, turn = Math.atan2(to[1] - from[1], to[0] - from[0]);
  const beside = angle => [to[0] + 12 * hair * Math.cos(turn + angle), to[1] + 12 * hair * Math.sin(turn + angle)];
  player.line([from, to, beside(2.6), to, beside(-2.6)]);
};
player.shown = moment => {
  if (!sideA || !other.walk) return;
  other.frame = other.frameAt(moment);
  other.draw();
};

// Samples: walks of the same seeds for each side
async function more() {
  const sides = [setup, ...(sideA ? [sideA] : [])].map(({ seed: _, push: __, ...given }) => given);
  const first = Math.max(-1, ...samples.map(each => each.seed)) + 1, mine = new AbortController();
  const seeds = Array.from({ length: 12 }, (_, i) => first + i);
  sampling = mine;
  const isBusy = on => { $("bar").hidden = $("cancel").hidden = !on; $("more").disabled = on; };
  isBusy(true);
  $("bar").value = 0;
  const run = (seed, side) => ask("/sample", { ...sides[side], seed }, mine, ({ end, path }) => {
    samples.push({ seed, side, path, dx: end.dx });
    $("bar").value += 1 / (seeds.length * sides.length);
    showSamples();
  });
  await Promise.all(seeds.flatMap(seed => sides.map((_, side) => run(seed, side)))).catch(refuse);
  mine.abort(); // the others, if one is refused
  if (sampling === mine) isBusy(false);
}

function showSamples() {
  const sides = (sideA ? [1, 0] : [0]).map(side => samples.filter(each => each.side === side));
  const known = sides.map(side => side.map(each => each.dx).filter(dx => dx !== null));
  const texts = sides.map((side, i) => {
    const lost = side.length - known[i].length, name = sideA ? "AB"[i] + ": " : "";
    return `${name}${side.length} samples, Δx = ${average(known[i])}${lost ? `, ${lost} without Δx` : ""}`;
  });
  if (sideA) {
    const earlier = new Map(sides[0].map(each => [each.seed, each.dx]));
    const pairs = sides[1].map(each => [each.dx, earlier.get(each.seed) ?? null]).filter(pair => !pair.includes(null));
    texts.push(`B − A = ${average(pairs.map(([b, a]) => b - a))} over ${pairs.length} pairs of equal samples`);
  }
  $("statistics").textContent = samples.length ? texts.join("; ") + ". Errors are standard errors of the mean." : "";
  $("histogram").replaceChildren(...(known.flat().length > 1 ? bars(known) : []));
  player.draw();
}

// A page without a server: walks that it brings along
async function unpacked(name) {
  const bytes = Uint8Array.from(atob(JSON.parse($("walks").textContent)[name]), letter => letter.charCodeAt(0));
  const walk = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json();
  walk.whole.joints.forEach((joints, i, all) => { if (i) all[i] = joints.map((part, k) => part + all[i - 1][k]); });
  return walk;
}

function buildChoices() {
  document.body.classList.add("exported");
  const axes = Object.entries(about.walks), given = new URLSearchParams(location.hash.slice(1));
  const update = async () => {
    const places = axes.map(([name]) => $(name).value);
    history.replaceState(null, "", "#" + new URLSearchParams(axes.map(([name], i) => [name, places[i]])));
    setup = Object.fromEntries(axes.map(([name, list], i) => [name, list[places[i]]]));
    const { whole, end } = await unpacked(places.join("-"));
    player.load(whole);
    tell(end);
  };
  for (const [name, list] of axes) {
    const options = list.map((value, i) => new Option(`${value} ${unitOf(name)}`, i));
    const select = make("select", { id: name, onchange: update }, ...options);
    select.value = given.get(name) in list ? given.get(name) : 0;
    const label = make("label", { htmlFor: name, textContent: name });
    $("setup").append(make("div", { className: "control" }, label, select));
  }
  update().catch(refuse);
}

function buildLive() {
  $("more").onclick = more;
  $("cancel").onclick = () => sampling?.abort();
  $("compare").onclick = () => { sideA = sideA ? null : { ...setup }; startA(); start(); };
  $("push-do").onclick = () => {
    player.toggle(false);
    push(Number($("push-link").value), ...["x", "y"].map(axis => Number($("push-" + axis).value) / 1e3));
  };
  $("push-undo").onclick = () => { if (setup.push?.pop() && !setup.push.length) delete setup.push; start(); };
  window.onhashchange = () => { readAddress(); startA(); start(); };
  const choose = index => { setup = { index }; start(); };
  $("sweep").append(...(about.sweep ?? []).map(block => sweepFigure(block, choose)));
  useMouse($("stage"));
  buildControls();
  readAddress();
  showValues();
  startA();
  start();
}

window.onkeydown = event => {
  const button = about.walks ? null : $({ s: "more", a: "compare" }[event.key]);
  const isTyped = event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select, textarea");
  if (button && !isTyped) button.click();
  else player.onKey(event);
};
$("speed").value = 4;
if (about.walks) buildChoices();
else buildLive();
