// Numbers and figures of the live page: statistics, histograms, and the cells of a sweep.
const number = (value, digits = 3) => (value === null ? "unknown" : String(Number(value.toPrecision(digits))));
const mean = list => list.reduce((sum, each) => sum + each, 0) / list.length;
const spread = list => Math.sqrt(list.reduce((sum, each) => sum + (each - mean(list)) ** 2, 0) / (list.length - 1));
const errorOf = list => (list.length < 2 ? 0 : spread(list) / Math.sqrt(list.length));
const average = list => (list.length < 2 ? "…" : `${number(mean(list), 4)} ± ${number(errorOf(list), 2)} m`);

const node = (tag, attributes, ...children) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
};
const label = (x, y, anchor, text) => node("text", { x, y, "text-anchor": anchor }, text);

// Histograms of several lists of numbers, and above them their means with standard errors.
function bars(lists) {
  const low = Math.min(...lists.flat()), wide = (Math.max(...lists.flat()) - low || 1e-3) / 15;
  const counts = lists.map(() => Array(16).fill(0)), width = 36 / lists.length, parts = [];
  lists.forEach((list, side) => list.forEach(dx => counts[side][Math.floor((dx - low) / wide)]++));
  const most = Math.max(...counts.flat()), at = dx => 40 * (dx - low) / wide;
  lists.forEach((list, side) => {
    const fill = `var(--${lists.length > 1 && side === 0 ? "red" : "blue"})`;
    counts[side].forEach((count, i) => {
      const height = 70 * count / most;
      parts.push(node("rect", { x: 40 * i + width * side, y: 80 - height, width, height, fill }));
    });
    const error = Math.max(errorOf(list), wide / 20), x = at(mean(list) - error);
    if (list.length) parts.push(node("rect", { x, y: 3, width: 80 * error / wide, height: 4, fill }));
  });
  const marks = [label(0, 96, "start", number(low) + " m"), label(640, 96, "end", number(low + 16 * wide) + " m")];
  const about = { viewBox: "0 0 640 100", role: "img", "aria-label": "Histogram of the distance walked" };
  return [node("svg", about, ...parts, ...marks)];
}

// A block of a sweep: a point for each cell, along the axis with the most values; a click on it chooses one of its walks.
function sweepFigure({ name, axes, units, cells }, choose) {
  const sizes = axes.map((_, i) => new Set(cells.map(cell => cell.at[i])).size), lines = new Map();
  const along = sizes.indexOf(Math.max(...sizes)), xOf = cell => Number(cell.at[along]) || 0;
  const [left, right] = [Math.min, Math.max].map(end => end(...cells.map(xOf)));
  const top = Math.max(...cells.map(cell => cell.mean));
  const place = cell => [50 + 560 * (xOf(cell) - left) / (right - left || 1), 280 - 250 * cell.mean / (top || 1)];
  const said = cell => axes.map((axis, i) => `${axis} = ${cell.at[i]} ${units[i]}`.trim());
  for (const cell of cells) {
    const key = said(cell).filter((_, i) => i !== along).join(", ");
    lines.set(key, [...(lines.get(key) ?? []), cell]);
  }
  const point = cell => {
    const text = `${said(cell).join(", ")}: Δx = ${number(cell.mean)} ± ${number(cell.error, 2)} m`;
    const [cx, cy] = place(cell), named = { tabindex: 0, role: "button", "aria-label": text };
    const title = node("title", {}, text + "; each click walks the next sample");
    const circle = node("circle", { cx, cy, r: 6, fill: "var(--blue)", ...named }, title);
    let next = 0;
    circle.onclick = () => choose(cell.walks[next++ % cell.walks.length]);
    circle.onkeydown = event => { if (event.key === "Enter") circle.onclick(); };
    return circle;
  };
  const parts = [...lines].flatMap(([key, list]) => [
    node("polyline", { points: list.map(place).join(" "), fill: "none", stroke: "var(--faint)" }),
    label(place(list.at(-1))[0], place(list.at(-1))[1] - 9, "end", key),
    ...list.map(point),
  ]);
  const unit = units[along] ?? "", title = label(330, 314, "middle", axes[along] ?? "");
  const marks = [label(50, 298, "start", `${left} ${unit}`), label(610, 298, "end", `${right} ${unit}`), title];
  const about = { viewBox: "0 0 640 320", role: "group", "aria-label": `${name}: mean distance` };
  return node("svg", about, ...parts, ...marks, label(50, 14, "start", `mean Δx, up to ${number(top)} m`));
}
