// Stages, faults, messages and findings, in words.

import { byId, clock, fill, make } from "./shapes.js";

const NAMES = { track: "Track", analyse: "Analyse", calibrate: "Calibrate" };
const WARNS = new Set(["failed", "unfinished", "left-out", "skipped", "gone"]);

/** Show what each stage is at: as the watch says, or as the files do. */
export function showStages(state, watch) {
  const rows = Object.entries(NAMES).map(([name, title]) => {
    const told = watch?.stages[name];
    const last = told?.last_s ?? state.last[name];
    const done = last ? clock(last) : "–";
    const head = make("th", { scope: "row" }, title);
    return make("tr", {}, head, doing(told), make("td", { class: "number" }, done));
  });
  fill(byId("stage-rows"), rows);
  const notes = [];
  if (!watch) notes.push("No stage runs here; the times are those of the files.");
  const lag = watch?.lag_s ?? null;
  if (lag !== null) notes.push(`The last round came ${Math.round(lag)} s after its tracks.`);
  if (state.skipped.length) notes.push(`Windows passed over: ${state.skipped.length}.`);
  byId("stages-note").textContent = notes.join(" ");
}

function doing(told) {
  if (!told) return make("td", { class: "muted" }, "not here");
  if (told.problem) return make("td", { class: "bad" }, "fails, tries again");
  if (told.now_s === null && !told.done) return make("td", { class: "muted" }, "waits");
  const words = told.now_s === null ? "works" : `window to ${clock(told.now_s)}`;
  if (!told.total) return make("td", {}, words);
  const label = `${told.done} of ${told.total}`;
  return make("td", {}, words, make("progress", { max: told.total, value: told.done, "aria-label": label }));
}

/** Show what befell the robot, the files and the stages, the newest first. */
export function showFaults(faults, events, problems) {
  const rows = [
    ...problems.map((text) => row("file", text, true)),
    ...events.filter((e) => WARNS.has(e.event)).map((e) => row("watch", messageOf(e), true)).reverse(),
    ...faults.map((f) => row(clock(f.time_s), f.ended ? `Over: ${f.says}` : f.says, !f.ended)).reverse(),
  ];
  fill(byId("fault-rows"), rows.length ? rows : [make("li", { class: "muted" }, "None.")]);
}

function row(time, text, isBad) {
  return make("li", {}, make("time", {}, time), make("span", isBad ? { class: "bad" } : {}, text));
}

function messageOf(event) {
  if (event.event === "skipped") {
    return `The window to ${clock(event.window_end_s)} is passed over. ${event.because}`;
  }
  const from = event.stage ? `${NAMES[event.stage]}: ` : "";
  return `${from}${event.problem ?? event.because ?? event.event}`;
}

/** Show what the last diagnosis found. */
export function showFindings(findings) {
  byId("verdict").textContent = findings ? findings.verdict : "No diagnosis yet.";
  const effects = findings ? findings.effects : [];
  fill(byId("effects"), effects.map(effectOf));
}

function effectOf({ name, says, p }) {
  const chance = p < 0.001 ? "p < 0.001" : `p = ${p?.toFixed(3)}`;
  const said = p === null ? [] : [make("span", { class: "muted" }, ` ${chance}`)];
  return make("li", {}, make("strong", {}, name), `: ${says}`, ...said);
}
