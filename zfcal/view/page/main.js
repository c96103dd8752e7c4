// The page: listens to the server, keeps the time, and lets the parts draw.

import { describeTank, drawTank, fit, setTank, takeColours } from "./tank.js";
import { newest, now, takePose, takeStamps, then } from "./player.js";
import { showParameters } from "./parameters.js";
import { lastAt, showScore } from "./score.js";
import { showFaults, showFindings, showStages } from "./panels.js";
import { byId, calm, clock, dark, draw, entry, fill } from "./shapes.js";

const AGAIN_MS = 1500;
const SILENT_MS = 5000;
const STARTING_MS = 30000;
const GIVES_UP_MS = 600000;
const SPEEDS = [1, 2, 5, 10, 30];
const STAYS =
  "What you see stays; the page comes back by itself when zfcal watch --view runs again.";
const ENDS = "What you see stays; reload the page when zfcal watch --view runs again.";
const PLAY = "M5 3 L17 10 L5 17 Z";
const PAUSE = "M4 3 H8 V17 H4 Z M12 3 H16 V17 H12 Z";

const page = document.documentElement;
const seen = { trial: null, state: null, watch: null, events: [], faults: [], fresh: false };
const time = { mode: "replay", second: 0, isPlaying: false, speed: 1, isChosen: false };
let source = null;
let heardMs = 0;
let lostMs = null;
let isDirty = true;
let shown = "";

// The server.

function connect() {
  source?.close();
  heardMs = performance.now() + STARTING_MS - SILENT_MS;
  source = new EventSource("events");
  for (const [kind, take] of Object.entries(TAKES)) {
    source.addEventListener(kind, (event) => {
      heardMs = performance.now();
      lostMs = null;
      setLink(true);
      take(JSON.parse(event.data));
      isDirty = true;
    });
  }
  source.addEventListener("bye", () => lose("The command that serves this page has ended."));
  source.onerror = () => lose("The server of this page cannot be reached.");
}

function lose(because) {
  if (!source) return;
  source.close();
  source = null;
  // Not for ever: whoever has the port by then would hear the secret.
  lostMs ??= performance.now();
  const tries = performance.now() - lostMs < GIVES_UP_MS;
  page.dataset.tries = String(tries);
  setLink(false, because);
  if (tries) setTimeout(connect, AGAIN_MS);
}

function setLink(isOpen, because = "") {
  page.dataset.link = isOpen ? "open" : "gone";
  byId("alarm").hidden = isOpen && !seen.state?.gone;
  if (!isOpen) byId("alarm").textContent = `${because} ${page.dataset.tries === "false" ? ENDS : STAYS}`;
  sayLink();
}

const TAKES = {
  trial(found) {
    if (JSON.stringify(seen.trial) === JSON.stringify(found)) return;
    seen.trial = found;
    document.title = `${found.name} – zfcal`;
    byId("name").textContent = found.name;
    const robots = found.robots === 1 ? "1 robot" : `${found.robots} robots`;
    const facts = [`${found.fish} fish, ${robots}`, found.tank.name, `${found.fps} Hz`, found.source];
    byId("facts").textContent = facts.filter(Boolean).join(" · ");
    setTank(found.tank);
    fill(byId("keys"), [
      entry("fish", "fish", "fish"),
      ...(found.robots ? [entry("square", "robot", "robot"), entry("ring", "model", "its target")] : []),
      ...found.tank.zones.map((zone) => entry("bar", zone.colour, zone.name)),
    ]);
  },
  state(found) {
    seen.state = found;
    byId("alarm").hidden = !found.gone;
    if (found.gone) byId("alarm").textContent = "The trial cannot be found: its disk or folder is gone.";
    if (!time.isChosen) begin();
    showStages(found, seen.watch);
    showFindings(found.findings);
    showFaults(seen.faults, seen.events, found.problems);
    shown = "";
  },
  pose: takePose,
  stamps: takeStamps,
  watch(found) {
    seen.watch = found;
    if (seen.state) showStages(seen.state, found);
  },
  events(found) {
    seen.events = found;
    if (seen.state) showFaults(seen.faults, found, seen.state.problems);
  },
  faults(found) {
    seen.faults = found;
    if (seen.state) showFaults(found, seen.events, seen.state.problems);
    drawMarks();
  },
  beat({ fresh }) {
    const came = fresh && !seen.fresh;
    seen.fresh = fresh;
    byId("live").disabled = !fresh && newest() === null;
    if (came && !time.isChosen) goLive();
    sayLink();
  },
};

// The time.

/** Choose where to begin: with what happens now, else with the recording. */
function begin() {
  if (seen.fresh) goLive();
  else if (time.mode === "replay" && !time.isPlaying && seen.state.minutes.length) {
    time.second = Math.max(time.second, seen.state.minutes[0]);
    if (seen.state.whole && !calm.matches) play(true);
  }
}

const startOf = () => seen.state?.minutes[0] ?? 0;

function endOf() {
  const whole = seen.state?.minutes.length ? seen.state.minutes.at(-1) + 60 : 0;
  const grows = seen.state && !seen.state.whole && newest() !== null;
  return grows ? Math.max(newest(), whole - 60) : Math.max(whole, 0);
}

function goLive() {
  setMode("live");
  play(false);
}

function seek(second, isChosen = true) {
  time.isChosen ||= isChosen;
  setMode("replay");
  time.second = Math.min(endOf(), Math.max(startOf(), second));
  isDirty = true;
}

function setMode(mode) {
  time.mode = mode;
  page.dataset.mode = mode;
  byId("live").setAttribute("aria-pressed", String(mode === "live"));
  isDirty = true;
  sayLink();
}

function play(isPlaying) {
  if (isPlaying && time.mode === "live") seek(newest() ?? endOf());
  if (isPlaying && seen.state?.whole && time.second >= endOf() - 0.5) time.second = startOf();
  time.isPlaying = isPlaying;
  page.dataset.playing = String(isPlaying);
  byId("play").setAttribute("aria-label", isPlaying ? "Pause" : "Play");
  byId("play-shape").setAttribute("d", isPlaying ? PAUSE : PLAY);
  isDirty = true;
}

function setSpeed(speed) {
  time.speed = speed;
  byId("speed").value = String(speed);
}

function sayLink() {
  const isOpen = page.dataset.link === "open";
  const says = { live: seen.fresh ? "Live" : "Live, no new positions", replay: "Replay" }[time.mode];
  const gone = page.dataset.tries === "false" ? "Server gone, reload" : "Server gone, tries again";
  const text = isOpen ? says : page.dataset.link === "gone" ? gone : "Connecting";
  if (byId("link").textContent !== text) byId("link").textContent = text;
}

// What is drawn.

function frame(ms) {
  const passed = Math.min(0.25, (ms - (frame.last ?? ms)) / 1000);
  frame.last = ms;
  if (time.isPlaying) advance(passed);
  if (isDirty && (!calm.matches || ms - (frame.drawn ?? 0) > 450)) show(ms);
  requestAnimationFrame(frame);
}

function advance(passed) {
  time.second = Math.min(endOf(), time.second + passed * time.speed);
  if (time.second >= endOf() && seen.state?.whole) play(false);
  isDirty = true;
}

function show(ms) {
  frame.drawn = ms;
  isDirty = false;
  if (!seen.state || !seen.trial) return;
  const isLive = time.mode === "live";
  const second = isLive ? newest() ?? endOf() : time.second;
  const found = isLive ? now() : then(second, seen.state.minutes);
  if (found) show.last = found;
  else isDirty = true;
  // While a minute is on its way, what was there before stays.
  const { agents, target } = show.last ?? { agents: [], target: null };
  drawTank(agents, target);
  page.dataset.agents = String(agents.length);
  if (found && ms - (show.said ?? -1e9) > 3000) {
    describeTank(agents, target, second);
    show.said = ms;
  }
  showTime(second);
  const now_s = `${Math.floor(second)} ${endOf()} ${innerWidth} ${dark.matches}`;
  if (now_s !== shown) {
    shown = now_s;
    showScore(seen.state, second, endOf());
    showParameters(lastAt(seen.state.rounds, second), seen.trial.tank.zones);
    drawMarks();
  }
}

function showTime(second) {
  const bar = byId("time");
  [bar.min, bar.max, bar.value] = [startOf(), Math.ceil(endOf()), Math.round(second)];
  const text = `${clock(second)} of ${clock(endOf())}`;
  bar.setAttribute("aria-valuetext", text);
  byId("clock").textContent = `${clock(second)} / ${clock(endOf())}`;
  page.dataset.second = second.toFixed(2);
}

function drawMarks() {
  if (!seen.state) return;
  const [from, to] = [startOf(), Math.max(endOf(), startOf() + 1)];
  const x = (s) => (100 * (s - from)) / (to - from);
  const bar = (s, y, width, height, colour, opacity = 1) =>
    draw("rect", { x: x(s) - width / 2, y, width, height, fill: colour, opacity });
  byId("marks").setAttribute("viewBox", "0 0 100 10");
  byId("marks").replaceChildren(
    ...seen.state.minutes.map((s) => {
      const width = Math.max(0, Math.min(100, x(s + 60)) - x(s));
      return draw("rect", { x: x(s), y: 6, width, height: 3, fill: "fish", opacity: 0.35 });
    }),
    ...seen.state.rounds.filter((r) => r.end_s > 0).map((r) => bar(r.end_s, 2, 0.5, 7, "model")),
    ...seen.faults.filter((f) => !f.ended).map((f) => bar(f.time_s, 0, 0.5, 10, "warn")),
  );
}

// What people do.

byId("play").addEventListener("click", () => { time.isChosen = true; play(!time.isPlaying); });
byId("live").addEventListener("click", () => { time.isChosen = false; goLive(); });
byId("time").addEventListener("input", (event) => seek(Number(event.target.value)));
byId("speed").addEventListener("change", (event) => setSpeed(Number(event.target.value)));

const KEYS = {
  " ": () => { time.isChosen = true; play(!time.isPlaying); },
  ArrowLeft: (far) => seek(current() - (far ? 60 : 5)),
  ArrowRight: (far) => seek(current() + (far ? 60 : 5)),
  Home: () => seek(startOf()),
  End: () => seek(endOf()),
  "+": () => setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, SPEEDS.indexOf(time.speed) + 1)]),
  "-": () => setSpeed(SPEEDS[Math.max(0, SPEEDS.indexOf(time.speed) - 1)]),
  l: () => byId("live").click(),
};

const current = () => (time.mode === "live" ? newest() ?? endOf() : time.second);

addEventListener("keydown", (event) => {
  const { key, target, ctrlKey, altKey, metaKey, shiftKey } = event;
  const act = KEYS[key.length === 1 ? key.toLowerCase() : key];
  // A choice has keys of its own, and a button is pressed with the space bar.
  if (!act || ctrlKey || altKey || metaKey || target.matches("select")) return;
  if (key === " " && target.matches("button")) return;
  event.preventDefault();
  act(shiftKey);
});

addEventListener("resize", () => { fit(); isDirty = true; });
dark.addEventListener("change", () => { takeColours(); isDirty = true; });
setInterval(() => {
  if (source && performance.now() - heardMs > SILENT_MS) lose("The server of this page does not answer.");
}, 1000);

setMode("replay");
connect();
requestAnimationFrame(frame);
