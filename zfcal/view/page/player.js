// Time: what was where at a moment, from whole minutes for replay and from what came live.

import { calm } from "./shapes.js";

const TRAIL_S = 2.5;
const FARTHEST_M = 0.15;
const MOVES_M = 0.004;
const KEPT = 8;
const RECENT_S = 15;
const REFRESH_MS = 2000;

const minutes = new Map();
let stamps = {};
let recent = [];

/** Take positions of now. */
export function takePose({ time_s, agents, target }) {
  if (recent.length && time_s < recent.at(-1).time) recent = [];
  const places = agents.map(([id, kind, x, y, heading, guess]) => ({ id, kind, x, y, heading, guess }));
  recent.push({ time: time_s, places, target });
  while (recent[0].time < time_s - RECENT_S) recent.shift();
}

/** Return the second of the newest positions; null before there are any. */
export const newest = () => (recent.length ? recent.at(-1).time : null);

/** Return what is there now. */
export function now() {
  return recent.length ? recentAt(recent.at(-1).time) : { agents: [], target: null };
}

/** Return what came live for a second, which no file that was fetched may hold yet. */
function recentAt(second) {
  const frames = recent.filter(({ time }) => time <= second && time >= second - TRAIL_S);
  if (!frames.length) return { agents: [], target: null };
  const { places, target } = frames.at(-1);
  const agents = places.map((agent) => {
    const trail = frames.flatMap(({ places: then }) => then.filter((a) => a.id === agent.id));
    return { ...agent, trail: joined(trail.map(({ x, y }) => [x, y])) };
  });
  return { agents: agents.map(headed), target };
}

/** Return what was there at a second; null while it is still being fetched. */
export function then(second, starts) {
  if (recent.length && recent[0].time <= second && second <= newest()) {
    const found = recentAt(second);
    if (found.agents.length) return found;
  }
  const begun = Math.floor(second / 60) * 60;
  // The end of the last minute is the beginning of none.
  const start = second === begun && !starts.includes(begun) ? begun - 60 : begun;
  if (!starts.includes(start)) return { agents: [], target: null };
  const next = starts[starts.indexOf(start) + 1];
  if (next !== undefined && second - start > 40) fetched(next);
  const minute = fetched(start);
  if (!minute) return null;
  const step = (second - start) * minute.hz;
  const agents = minute.agents.map((agent) => placeAt(agent, step, minute.hz)).filter(Boolean);
  return { agents: agents.map(headed), target: targetAt(minute.targets, second) };
}

/** Take for each minute the number that changes when its files do. */
export function takeStamps(found) {
  stamps = found;
}

/** Return a minute, null before it has come; one that has changed stays until the new one is there. */
function fetched(start) {
  const known = minutes.get(start);
  if (!known || (isOld(known, start) && performance.now() - known.ms > REFRESH_MS)) ask(start, known);
  return minutes.get(start).found;
}

const isOld = ({ isAsked, found, stamp }, start) =>
  !isAsked && (found === EMPTY || stamp !== stamps[start]);

function ask(start, known) {
  // The stamp is at most as new as what comes.
  const asked = { found: known?.found ?? null, stamp: stamps[start], ms: performance.now(), isAsked: true };
  minutes.delete(start);
  minutes.set(start, asked);
  while (minutes.size > KEPT) minutes.delete(minutes.keys().next().value);
  fetch(`minute/${start}`)
    .then((answer) => answer.json())
    .then((found) => { asked.found = found.agents ? found : asked.found ?? EMPTY; })
    .catch(() => { asked.stamp = null; })
    .finally(() => { asked.isAsked = false; });
}

/** Of a minute that cannot be read; which file that is stands among the messages. */
const EMPTY = { hz: 1, agents: [], targets: [] };

function placeAt(agent, step, hz) {
  const low = Math.min(Math.floor(step), agent.x.length - 1);
  if (agent.x[low] === null) return null;
  const part = calm.matches ? 0 : step - low;
  const between = (row) => mix(row[low], row[low + 1], part) / 1000;
  const trail = [];
  for (let i = Math.max(0, low - Math.round(TRAIL_S * hz)); i <= low; i += 1) {
    trail.push(agent.x[i] === null ? null : [agent.x[i] / 1000, agent.y[i] / 1000]);
  }
  const place = [between(agent.x), between(agent.y)];
  return {
    id: agent.agent,
    kind: agent.kind,
    x: place[0],
    y: place[1],
    heading: turned(agent.heading[low], agent.heading[low + 1], part),
    guess: agent.guess.includes(low),
    trail: joined([...trail, place]),
  };
}

const mix = (a, b, part) => (b === null || b === undefined ? a : a + (b - a) * part);

/** Return a heading in radians between two in milliradians, the short way round. */
function turned(a, b, part) {
  if (a === null) return null;
  if (b === null || b === undefined) return a / 1000;
  const full = 2000 * Math.PI;
  return (a + (((b - a + 1.5 * full) % full) - full / 2) * part) / 1000;
}

/** Return the trail since the last gap, or leap. */
function joined(trail) {
  let first = trail.length;
  while (first > 0 && trail[first - 1] !== null && !leaps(trail, first)) first -= 1;
  return trail.slice(first);
}

const leaps = (trail, i) =>
  i < trail.length && distance(trail[i], trail[i - 1]) > FARTHEST_M;

const distance = ([x, y], [u, v]) => Math.hypot(x - u, y - v);

/** Without a heading an agent looks where it swims. */
function headed(agent) {
  if (agent.heading !== null || agent.trail.length < 2) return agent;
  const from = agent.trail.findLast((place) => distance([agent.x, agent.y], place) > MOVES_M);
  return from ? { ...agent, heading: Math.atan2(agent.y - from[1], agent.x - from[0]) } : agent;
}

function targetAt(targets, second) {
  let found = null;
  for (const [time, x, y] of targets) {
    if (time > second) break;
    if (second - time < 2) found = [x / 1000, y / 1000];
  }
  return found;
}
