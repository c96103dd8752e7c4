// S of each round against its ceiling, and the parameters with their intervals.

import { byId, clock, draw, entry, figure, fill, make, mark } from "./shapes.js";

const MODEL = "model-vs-control";
const ROBOT = "robot-vs-fish";
const PAD = { left: 30, right: 10, top: 8, bottom: 22 };
const SAYS = {
  kappa_0: "keeps its direction",
  kappa_f: "aims at neighbours",
  alpha: "weight of neighbours",
};

/** Return the last of rows that was there at a second. */
export const lastAt = (rows, second) => rows.filter((row) => row.end_s <= second).at(-1);

/** Show S at a second, and over the whole trial. */
export function showScore(state, second, end) {
  const model = state.scores.filter((row) => row.compared === MODEL);
  const robot = state.scores.filter((row) => row.compared === ROBOT);
  showNumbers(lastAt(model, second), lastAt(robot, second), model.length);
  showRounds({ model, robot, skipped: state.skipped }, second, Math.max(end, 60));
}

function showNumbers(found, robot, n) {
  byId("s").textContent = found ? found.value.toFixed(3) : "–";
  const has = found && found.ceiling !== null;
  byId("s-of").textContent = has ? `of ${found.ceiling.toFixed(3)}` : found ? "no ceiling" : "";
  const parts = [];
  if (has) parts.push(`S of the window to ${clock(found.end_s)}, ${Math.round((100 * found.value) / found.ceiling)} % of its ceiling`);
  else if (!found) parts.push(n ? "No model was there yet" : "No model has been calibrated yet");
  if (robot) parts.push(`robot among fish: ${robot.value.toFixed(3)}${robot.ceiling === null ? "" : ` of ${robot.ceiling.toFixed(3)}`}`);
  byId("s-note").textContent = `${parts.join("; ")}.`;
}

function showRounds({ model, robot, skipped }, second, end) {
  const svg = byId("rounds");
  const [width, height] = [svg.clientWidth, svg.clientHeight];
  if (!width) return;
  const values = [...model, ...robot].flatMap((r) => [r.value, r.low, r.ceiling]).filter((v) => v !== null);
  const least = Math.max(0, Math.floor(10 * Math.min(0.7, ...values) - 0.2) / 10);
  const x = (s) => PAD.left + (s / end) * (width - PAD.left - PAD.right);
  const y = (v) => PAD.top + ((1 - v) / (1 - least)) * (height - PAD.top - PAD.bottom);
  const floor = height - PAD.bottom;
  const marks = [
    ...levels(least).flatMap((v) => [
      draw("path", { d: `M${PAD.left} ${y(v)} H${width - PAD.right}`, stroke: "grid", fill: "none" }),
      text(PAD.left - 6, y(v) + 4, v.toFixed(1), "end"),
    ]),
    ...minutesOf(end).map((s) => text(x(s), height - 6, `${s / 60}`, "middle")),
    text(width - PAD.right, height - 6, "min", "end"),
    ...ceilingOf(model, x, y),
    line(robot, x, y, "robot"),
    line(model, x, y, "model"),
    ...robot.map((r) => draw("rect", { x: x(r.end_s) - 3, y: y(r.value) - 3, width: 6, height: 6, fill: "robot" })),
    ...model.map((r) => draw("path", { d: `M${x(r.end_s)} ${y(r.value) - 5.5} l5 9 h-10 Z`, fill: "model" })),
    ...skipped.map((s) => draw("path", { d: `M${x(s) - 4} ${floor - 9} l8 8 m0 -8 l-8 8`, stroke: "muted", fill: "none", "stroke-width": 2 })),
    draw("path", { d: `M${x(Math.min(second, end))} ${PAD.top} V${floor}`, stroke: "ink", fill: "none", "stroke-width": 1.2 }),
  ];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren(...marks.filter(Boolean));
  svg.setAttribute("aria-label", inWords(model));
  fill(byId("score-keys"), [
    entry("triangle", "model", "S of the model"),
    entry("dash", "band", "its ceiling, and 95 % of what that is the mean of"),
    ...(robot.length ? [entry("square", "robot", "S of the robot among fish")] : []),
    ...(skipped.length ? [entry("cross", "muted", "window passed over")] : []),
  ]);
}

const text = (x, y, said, anchor) => draw("text", { x, y, "text-anchor": anchor }, said);

function levels(least) {
  const step = 1 - least > 0.5 ? 0.2 : 0.1;
  const found = [];
  for (let v = 1; v >= least - 1e-9; v -= step) found.push(v);
  return found;
}

function minutesOf(end) {
  const step = [1, 2, 5, 10, 20, 30, 60, 120, 300].find((m) => end / 60 / m <= 7) ?? 600;
  const found = [];
  for (let s = 0; s <= end * 0.93; s += 60 * step) found.push(s);
  return found;
}

function line(rows, x, y, colour) {
  if (rows.length < 2) return null;
  const d = rows.map((r, i) => `${i ? "L" : "M"}${x(r.end_s)} ${y(r.value)}`).join("");
  return draw("path", { d, stroke: colour, fill: "none", "stroke-width": 1.6, opacity: 0.75 });
}

function ceilingOf(model, x, y) {
  const known = model.filter((r) => r.ceiling !== null);
  const banded = known.filter((r) => r.low !== null && r.high !== null);
  if (!known.length) return [];
  const up = banded.map((r) => `${x(r.end_s)} ${y(r.high)}`);
  const down = banded.map((r) => `${x(r.end_s)} ${y(r.low)}`).reverse();
  const d = known.map((r, i) => `${i ? "L" : "M"}${x(r.end_s)} ${y(r.ceiling)}`).join("");
  return [
    banded.length ? draw("path", { d: `M${[...up, ...down].join("L")}Z`, fill: "band", opacity: 0.2 }) : null,
    draw("path", { d, stroke: "band", fill: "none", "stroke-width": 2.2, "stroke-dasharray": "6 4" }),
    ...(known.length === 1 ? [draw("circle", { cx: x(known[0].end_s), cy: y(known[0].ceiling), r: 3, fill: "band" })] : []),
  ];
}

function inWords(model) {
  if (!model.length) return "No rounds yet";
  const said = model.map((r) => `${clock(r.end_s)}: ${r.value.toFixed(2)}${r.ceiling === null ? "" : ` of ${r.ceiling.toFixed(2)}`}`);
  return `S of the model and its ceiling by the end of each window. ${said.join("; ")}`;
}

/** Show the parameters of a round: one table for each zone, and for each effect. */
export function showParameters(round, zones) {
  if (!round) {
    byId("parameters-note").textContent = "There is no model yet.";
    byId("parameter-groups").replaceChildren();
    return;
  }
  const from = round.end_s ? `Model of the window to ${clock(round.end_s)}` : "The starting model";
  const rule = round.rule ? `, published by the rule ${round.rule}` : "";
  const by = { likelihood: "; 95 % intervals of the window's likelihood, outside of which what was published may lie", score: "; 95 % of the genomes that fit as well" }[round.by] ?? "; no intervals";
  const open = round.parameters.some((p) => p.identified === false) ? "; hollow: the window does not pin it down" : "";
  byId("parameters-note").textContent = `${from}${rule}${by}${open}.`;
  const groups = new Map();
  for (const p of round.parameters) {
    const name = p.name.split(".")[0];
    groups.set(name, [...(groups.get(name) ?? []), p]);
  }
  const tables = [...groups].map(([name, rows]) => {
    const colour = zones.find((zone) => zone.name === name)?.colour ?? "group";
    return make("div", {}, make("h3", {}, mark("bar", colour), name),
      make("table", {}, make("tbody", {}, ...rows.map((p) => parameterRow(p, colour)))));
  });
  fill(byId("parameter-groups"), tables);
}

function parameterRow(p, colour) {
  const [, key, to] = p.name.split(".");
  const said = to ? `attraction to ${to}` : SAYS[key] ?? "";
  const label = make("td", {}, make("code", {}, to ? `gamma → ${to}` : key), ...(to || !said ? [] : [` ${said}`]));
  const interval = p.low === null ? "" : `${figure(p.low)} to ${figure(p.high)}`;
  return make("tr", { title: said }, label, make("td", {}, bar(p, colour)),
    make("td", { class: "number" }, make("strong", {}, figure(p.value)), ...(interval ? [make("span", { class: "muted small" }, ` ${interval}`)] : [])));
}

function bar({ value, low, high, most, identified }, colour) {
  const [from, to] = most === null ? [Math.min(value, low ?? value, 0), Math.max(value, high ?? value, 0) || 1] : [0, most];
  const x = (v) => Math.max(0, Math.min(100, (100 * (v - from)) / (to - from || 1)));
  const svg = draw("svg", { class: "interval", viewBox: "0 0 100 14", preserveAspectRatio: "none", "aria-hidden": "true" });
  svg.append(draw("path", { d: "M0 7 H100", stroke: "edge", fill: "none", "stroke-width": 2, "vector-effect": "non-scaling-stroke" }));
  if (low !== null) svg.append(draw("rect", { x: x(low), y: 4, width: Math.max(1, x(high) - x(low)), height: 6, fill: colour, opacity: identified ? 0.45 : 0.2 }));
  svg.append(draw("path", { d: `M${x(value)} 7 h0.001`, stroke: colour, fill: "none", "stroke-width": 10, "stroke-linecap": "round", "vector-effect": "non-scaling-stroke" }));
  if (identified === false) svg.append(draw("path", { d: `M${x(value)} 7 h0.001`, stroke: "card", fill: "none", "stroke-width": 5, "stroke-linecap": "round", "vector-effect": "non-scaling-stroke" }));
  return svg;
}
