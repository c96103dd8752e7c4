// S of each round against its ceiling: in numbers, as a picture, and in words.

import { byId, clock, draw, entry, fill } from "./shapes.js";

const MODEL = "model-vs-control";
const ROBOT = "robot-vs-fish";
const LEVELS = [0, 0.2, 0.4, 0.6, 0.8, 1];
const PAD = { left: 30, right: 10, top: 8, bottom: 22 };

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
  byId("s-of").textContent = has ? `ceiling ${found.ceiling.toFixed(3)}` : found ? "no ceiling" : "";
  const parts = [];
  if (has) parts.push(`S of the window to ${clock(found.end_s)}: ${found.says}`);
  else if (!found) parts.push(n ? "No model was there yet" : "No model has been calibrated yet");
  if (robot) parts.push(`robot among fish: ${withCeiling(robot, 3)}`);
  byId("s-note").textContent = `${parts.join("; ")}.`;
}

const withCeiling = ({ value, ceiling, says }, digits) =>
  value.toFixed(digits) + (ceiling === null ? "" : ` (ceiling ${ceiling.toFixed(digits)}, ${says})`);

function showRounds({ model, robot, skipped }, second, end) {
  const svg = byId("rounds");
  const [width, height] = [svg.clientWidth, svg.clientHeight];
  if (!width) return;
  const x = (s) => PAD.left + (s / end) * (width - PAD.left - PAD.right);
  const y = (v) => PAD.top + (1 - v) * (height - PAD.top - PAD.bottom);
  const floor = height - PAD.bottom;
  const marks = [
    ...LEVELS.flatMap((v) => [
      stroke(`M${PAD.left} ${y(v)} H${width - PAD.right}`, "grid", 1),
      text(PAD.left - 6, y(v) + 4, v.toFixed(1), "end"),
    ]),
    ...minutesOf(end).map((s) => text(x(s), height - 6, `${s / 60}`, "middle")),
    text(width - PAD.right, height - 6, "min", "end"),
    ...ceilingOf(model, x, y),
    line(robot, x, y, "robot"),
    line(model, x, y, "model"),
    ...robot.map((r) => point(r, `M${x(r.end_s) - 3} ${y(r.value) - 3} h6 v6 h-6 Z`, "robot")),
    ...model.map((r) => point(r, `M${x(r.end_s)} ${y(r.value) - 5.5} l5 9 h-10 Z`, "model")),
    ...skipped.map((s) => stroke(`M${x(s) - 4} ${floor - 9} l8 8 m0 -8 l-8 8`, "muted", 2)),
    stroke(`M${x(Math.min(second, end))} ${PAD.top} V${floor}`, "ink", 1.2),
  ];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren(...marks.filter(Boolean));
  svg.setAttribute("aria-label", inWords(model));
  fill(byId("score-keys"), [
    entry("triangle", "model", "S of the model"),
    entry("dash", "band", "its ceiling, and 95 % of what that is the mean of"),
    ...(robot.length ? [entry("square", "robot", "S of the robot among fish")] : []),
    ...(model.some((r) => r.above)
      ? [entry("hollow triangle", "model", "above the range of its ceiling: fits chance")]
      : []),
    ...(robot.some((r) => r.above)
      ? [entry("hollow square", "robot", "above the range of its ceiling")]
      : []),
    ...(skipped.length ? [entry("cross", "muted", "window passed over")] : []),
  ]);
}

const shape = (d, colour, opacity = 1) => draw("path", { d, fill: colour, opacity });
// Hollow above the range of the ceiling: filled with the panel's ground, so that no line shows through.
const point = ({ above }, d, colour) =>
  above
    ? draw("path", { d, fill: "card", stroke: colour, "stroke-width": 1.6, class: "above" })
    : shape(d, colour);
const stroke = (d, colour, width, more = {}) =>
  draw("path", { d, stroke: colour, fill: "none", "stroke-width": width, ...more });
const text = (x, y, said, anchor) => draw("text", { x, y, "text-anchor": anchor }, said);

function minutesOf(end) {
  const step = [1, 2, 5, 10, 20, 30, 60, 120, 300].find((m) => end / 60 / m <= 7) ?? 600;
  const found = [];
  for (let s = 0; s <= end * 0.93; s += 60 * step) found.push(s);
  return found;
}

const path = (points) => points.map(([x, y], i) => `${i ? "L" : "M"}${x} ${y}`).join("");

function line(rows, x, y, colour) {
  if (rows.length < 2) return null;
  return stroke(path(rows.map((r) => [x(r.end_s), y(r.value)])), colour, 1.6, { opacity: 0.75 });
}

function ceilingOf(model, x, y) {
  const known = model.filter((r) => r.ceiling !== null);
  const banded = known.filter((r) => r.low !== null && r.high !== null);
  if (!known.length) return [];
  const up = banded.map((r) => [x(r.end_s), y(r.high)]);
  const down = banded.map((r) => [x(r.end_s), y(r.low)]).reverse();
  const points = known.map((r) => [x(r.end_s), y(r.ceiling)]);
  // A line of one point is seen by its round end.
  const d = points.length === 1 ? `M${points[0].join(" ")} h0.01` : path(points);
  return [
    banded.length ? shape(`${path([...up, ...down])}Z`, "band", 0.2) : null,
    stroke(d, "band", points.length === 1 ? 7 : 2.2, {
      "stroke-dasharray": points.length === 1 ? "none" : "6 4",
      "stroke-linecap": points.length === 1 ? "round" : "butt",
    }),
  ];
}

function inWords(model) {
  if (!model.length) return "No rounds yet";
  const said = model.map((r) => `${clock(r.end_s)}: ${withCeiling(r, 2)}`);
  const hollow = model.some((r) => r.above) ? " Hollow marks are above the range of the ceiling." : "";
  return `S of the model and its ceiling by the end of each window. ${said.join("; ")}.${hollow}`;
}
