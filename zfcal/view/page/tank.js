// The tank on a canvas: zones, walls, fish, robot and target, and where they came from.

import { byId, calm, clock, dark } from "./shapes.js";

const FISH_M = 0.035;
const ROBOT_M = 0.045;

const canvas = byId("tank");
const context = canvas.getContext("2d");
let tank = null;
let zones = [];
let walls = null;
let scale = 1;
let colours = {};

/** Take the tank; it is drawn with the next agents. */
export function setTank(found) {
  tank = found;
  zones = found.zones.map((zone) => ({ ...zone, path: pathOf(zone.parts.flat()) }));
  walls = pathOf(found.walls);
  takeColours();
  fit();
}

/** Fit the canvas to its room on the page; return whether that changed it. */
export function fit() {
  if (!tank) return false;
  const [left, bottom, right, top] = tank.bounds;
  const margin = 0.02 * Math.max(right - left, top - bottom);
  const [width, height] = [right - left + 2 * margin, top - bottom + 2 * margin];
  const room = canvas.parentElement.clientWidth;
  const tallest = Math.max(240, innerHeight * (innerWidth < 992 ? 0.6 : 0.76));
  const css = Math.min(room / width, tallest / height);
  const ratio = devicePixelRatio || 1;
  const size = [Math.round(room * ratio), Math.round(css * height * ratio)];
  if (canvas.width === size[0] && canvas.height === size[1]) return false;
  [canvas.width, canvas.height] = size;
  canvas.style.height = `${css * height}px`;
  scale = css * ratio;
  const across = (room / css - width) / 2;
  context.setTransform(scale, 0, 0, -scale, (across + margin - left) * scale, (margin + top) * scale);
  return true;
}

/** Draw what is there: agents with their places, headings and trails, and the target. */
export function drawTank(agents, target) {
  if (!tank) return;
  context.save();
  context.resetTransform();
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.restore();
  drawGround();
  const robot = agents.find((agent) => agent.kind === "robot");
  if (target) drawTarget(target, robot);
  for (const agent of agents) drawTrail(agent);
  for (const agent of agents) (agent.kind === "robot" ? drawRobot : drawFish)(agent);
}

/** Say what is drawn, for those who do not see it. */
export function describeTank(agents, target, time) {
  const counts = zones.map((zone) => {
    const here = agents.filter((a) => a.kind === "fish" && isIn(zone, a)).length;
    return here ? `${here} in ${zone.name}` : "";
  });
  const fish = agents.filter((a) => a.kind === "fish").length;
  const robot = agents.find((a) => a.kind === "robot");
  const place = robot && zones.find((zone) => isIn(zone, robot));
  const parts = [
    `The tank from above at ${clock(time)}: ${fish} fish`,
    counts.filter(Boolean).join(", "),
    robot ? `the robot${place ? ` in ${place.name}` : ""}` : "",
    target ? "its target" : "",
  ];
  canvas.setAttribute("aria-label", parts.filter(Boolean).join("; "));
}

export function takeColours() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ink", "muted", "fish", "robot", "model", "ground", ...zones.map((z) => z.colour)];
  colours = Object.fromEntries(names.map((n) => [n, style.getPropertyValue(`--${n}`).trim()]));
}

function drawGround() {
  const pixel = (devicePixelRatio || 1) / scale;
  for (const zone of zones) {
    context.globalAlpha = dark.matches ? 0.24 : 0.2;
    context.fillStyle = colours[zone.colour];
    context.fill(zone.path, "evenodd");
  }
  context.globalAlpha = 1;
  context.strokeStyle = colours.ink;
  context.lineWidth = 2 * pixel;
  context.lineJoin = "round";
  context.stroke(walls);
  drawScale(pixel);
}

function drawScale(pixel) {
  const [left, bottom] = [tank.bounds[0], tank.bounds[1]];
  context.strokeStyle = colours.muted;
  context.lineWidth = 3 * pixel;
  context.beginPath();
  context.moveTo(left, bottom - 0.004);
  context.lineTo(left + 0.1, bottom - 0.004);
  if (!context.isPointInPath(walls, 0, 0)) context.stroke();
  context.save();
  context.translate(left, bottom + 0.008);
  context.scale(pixel, -pixel);
  context.fillStyle = colours.muted;
  context.font = "12px system-ui, sans-serif";
  context.fillText("10 cm", 0, 0);
  context.restore();
}

function drawTrail({ trail, kind }) {
  if (!trail || trail.length < 2 || calm.matches) return;
  context.strokeStyle = kind === "robot" ? colours.robot : colours.fish;
  context.lineWidth = 0.0035;
  context.lineCap = "round";
  for (let i = 1; i < trail.length; i += 1) {
    context.globalAlpha = 0.5 * (i / trail.length) ** 1.5;
    context.beginPath();
    context.moveTo(...trail[i - 1]);
    context.lineTo(...trail[i]);
    context.stroke();
  }
  context.globalAlpha = 1;
}

function at({ x, y, heading, guess }, size, body) {
  context.save();
  context.globalAlpha = guess ? 0.4 : 1;
  context.translate(x, y);
  context.rotate(heading ?? 0);
  context.scale(size, size);
  context.beginPath();
  body();
  context.restore();
}

function drawFish(fish) {
  at(fish, FISH_M, () => {
    if (fish.heading === null) {
      context.arc(0, 0, 0.25, 0, 2 * Math.PI);
    } else {
      context.moveTo(0.5, 0);
      context.bezierCurveTo(0.4, 0.24, 0.05, 0.24, -0.3, 0.05);
      context.lineTo(-0.55, 0.2);
      context.lineTo(-0.55, -0.2);
      context.lineTo(-0.3, -0.05);
      context.bezierCurveTo(0.05, -0.24, 0.4, -0.24, 0.5, 0);
    }
    outlined(colours.fish);
  });
}

function drawRobot(robot) {
  at(robot, ROBOT_M, () => {
    context.rect(-0.4, -0.28, 0.6, 0.56);
    context.moveTo(0.26, 0.28);
    context.lineTo(0.55, 0);
    context.lineTo(0.26, -0.28);
    context.closePath();
    outlined(colours.robot);
  });
}

function outlined(colour) {
  context.fillStyle = colour;
  context.strokeStyle = colours.ground;
  context.lineWidth = 0.06;
  context.stroke();
  context.fill();
}

function drawTarget([x, y], robot) {
  const pixel = (devicePixelRatio || 1) / scale;
  context.strokeStyle = colours.model;
  context.lineWidth = 2.2 * pixel;
  context.beginPath();
  context.arc(x, y, 0.014, 0, 2 * Math.PI);
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    context.moveTo(x + 0.008 * dx, y + 0.008 * dy);
    context.lineTo(x + 0.022 * dx, y + 0.022 * dy);
  }
  context.stroke();
  if (!robot) return;
  context.setLineDash([4 * pixel, 4 * pixel]);
  context.lineWidth = 1.3 * pixel;
  context.beginPath();
  context.moveTo(robot.x, robot.y);
  context.lineTo(x, y);
  context.stroke();
  context.setLineDash([]);
}

function isIn(zone, { x, y }) {
  context.save();
  context.resetTransform();
  const found = context.isPointInPath(zone.path, x, y, "evenodd");
  context.restore();
  return found;
}

function pathOf(rings) {
  const path = new Path2D();
  for (const ring of rings) {
    ring.forEach(([x, y], i) => (i ? path.lineTo(x, y) : path.moveTo(x, y)));
    path.closePath();
  }
  return path;
}
