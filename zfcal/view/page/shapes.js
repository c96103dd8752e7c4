// Small parts of pictures that several panels share, and how times are written.

const NS = "http://www.w3.org/2000/svg";

export const calm = matchMedia("(prefers-reduced-motion: reduce)");
export const dark = matchMedia("(prefers-color-scheme: dark)");

export const byId = (id) => document.getElementById(id);

/** Return a new element of HTML; what it holds is text or other elements. */
export function make(name, attributes = {}, ...content) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...content);
  return element;
}

/** Return a new element of SVG; colours are names of the page's variables. */
export function draw(name, attributes = {}, ...content) {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "fill" || key === "stroke") element.style[key] = paint(value);
    else element.setAttribute(key, value);
  }
  element.append(...content);
  return element;
}

const paint = (name) => (name === "none" ? name : `var(--${name})`);

/** Return a time of the trial, such as 12:05. */
export function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds + 1e-6));
  const pad = (n) => String(n).padStart(2, "0");
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return h ? `${h}:${pad(m)}:${pad(s)}` : `${m}:${pad(s)}`;
}

/** Return a number as people read it. */
export function figure(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3);
}

const line = (d, colour, width, more = {}) =>
  draw("path", { d, stroke: colour, fill: "none", "stroke-width": width, ...more });

const KEYS = {
  triangle: (c) => draw("path", { d: "M9 2 L15 12 L3 12 Z", fill: c }),
  square: (c) => draw("rect", { x: 4, y: 2, width: 10, height: 10, fill: c }),
  "hollow triangle": (c) => line("M9 3 L14 11.5 L4 11.5 Z", c, 1.6),
  "hollow square": (c) => line("M5 3 h8 v8 h-8 Z", c, 1.6),
  fish: (c) => draw("path", { d: "M2 7 C7 1 13 2 15 7 C13 12 7 13 2 7 Z", fill: c }),
  ring: (c) => draw("circle", { cx: 9, cy: 7, r: 5, fill: "none", stroke: c, "stroke-width": 2 }),
  bar: (c) => draw("rect", { x: 1, y: 2, width: 16, height: 10, rx: 2, fill: c, opacity: 0.45 }),
  dash: (c) => line("M0 7 H18", c, 2.5, { "stroke-dasharray": "5 3" }),
  cross: (c) => line("M5 3 L13 11 M13 3 L5 11", c, 2),
};

/** Return a picture of a mark, for a key. */
export const mark = (kind, colour) =>
  draw("svg", { viewBox: "0 0 18 14", "aria-hidden": "true" }, KEYS[kind](colour));

/** Return an entry of a key. */
export const entry = (kind, colour, label) => make("li", {}, mark(kind, colour), label);

/** Put children in the place of those that are there, unless they say the same. */
export function fill(parent, children) {
  const said = children.map((child) => child.outerHTML).join("");
  if (parent.innerHTML !== said) parent.replaceChildren(...children);
}
