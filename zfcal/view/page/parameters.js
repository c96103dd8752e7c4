// The parameters of a model with their intervals: a table for each zone, and for each effect.

import { byId, clock, draw, figure, fill, make, mark } from "./shapes.js";

const SAYS = {
  kappa_0: "keeps its direction",
  kappa_f: "aims at neighbours",
  alpha: "weight of neighbours",
};
const BY = {
  likelihood:
    "95 % intervals of the window's likelihood, outside of which what was published may lie",
  score: "95 % of the genomes that fit as well",
};

/** Show the parameters of a round; null for none. */
export function showParameters(round, zones) {
  if (!round) {
    byId("parameters-note").textContent = "There is no model yet.";
    byId("parameter-groups").replaceChildren();
    return;
  }
  byId("parameters-note").textContent = noteOf(round);
  const groups = new Map();
  for (const p of round.parameters) {
    const name = p.name.split(".")[0];
    groups.set(name, [...(groups.get(name) ?? []), p]);
  }
  const tables = [...groups].map(([name, rows]) => {
    const colour = zones.find((zone) => zone.name === name)?.colour ?? "group";
    const body = make("tbody", {}, ...rows.map((p) => rowOf(p, colour)));
    return make("div", {}, make("h3", {}, mark("bar", colour), name), make("table", {}, body));
  });
  fill(byId("parameter-groups"), tables);
}

function noteOf({ end_s, rule, by, parameters }) {
  const parts = [
    end_s ? `Model of the window to ${clock(end_s)}` : "The starting model",
    BY[by] ?? "no intervals",
  ];
  if (rule) parts[0] += `, published by the rule ${rule}`;
  if (parameters.some((p) => p.identified === false)) {
    parts.push("hollow: the window does not pin it down");
  }
  return `${parts.join("; ")}.`;
}

function rowOf(p, colour) {
  const [, key, to] = p.name.split(".");
  const name = make("code", {}, to ? `gamma → ${to}` : key);
  const said = SAYS[key] ? [` ${SAYS[key]}`] : [];
  const number = make("td", { class: "number" }, make("strong", {}, figure(p.value)));
  if (p.low !== null) {
    const interval = ` ${figure(p.low)} to ${figure(p.high)}`;
    number.append(make("span", { class: "muted small" }, interval));
  }
  return make("tr", {}, make("td", {}, name, ...said), make("td", {}, bar(p, colour)), number);
}

/** Return a scale with the interval and the value; without a known end it spans just these. */
function bar({ value, low, high, most, identified }, colour) {
  const from = most === null ? Math.min(value, low ?? value, 0) : 0;
  const to = most ?? (Math.max(value, high ?? value, 0) || 1);
  const x = (v) => Math.max(0, Math.min(100, (100 * (v - from)) / (to - from || 1)));
  const svg = draw("svg", {
    class: "interval",
    viewBox: "0 0 100 14",
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  svg.append(line("M0 7 H100", "edge", 2));
  if (low !== null) {
    const width = Math.max(1, x(high) - x(low));
    const opacity = identified ? 0.45 : 0.2;
    svg.append(draw("rect", { x: x(low), y: 4, width, height: 6, fill: colour, opacity }));
  }
  // A round dot, however wide the scale is drawn.
  svg.append(line(`M${x(value)} 7 h0.001`, colour, 10));
  if (identified === false) svg.append(line(`M${x(value)} 7 h0.001`, "card", 5));
  return svg;
}

const line = (d, colour, width) =>
  draw("path", {
    d,
    stroke: colour,
    fill: "none",
    "stroke-width": width,
    "stroke-linecap": "round",
    "vector-effect": "non-scaling-stroke",
  });
