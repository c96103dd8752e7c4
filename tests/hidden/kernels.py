"""The second simulator's loops: where, what is seen, which way, how fast.

All of them stand in one file, so that the compiler's cache knows when one of
them has changed. Lengths are metres, times seconds, angles radians.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DT_S = 0.2
N_CELLS = 180
"""Headings are drawn from cells of two degrees, uniform within a cell."""
CELL_RAD = 2 * math.pi / N_CELLS
ANGLE = -math.pi + (np.arange(N_CELLS) + 0.5) * CELL_RAD
COS, SIN = np.cos(ANGLE), np.sin(ANGLE)
SHORT_M = 0.002
"""A displacement that is shorter has no heading on a recording."""

# One column of a plan's strengths per effect.
(
    ALIGNMENT, WALL_PERSISTENCE, GROUP_COHESION, INTERACTION_RANGE, REAR_BLIND_ZONE,
    LEADER_FOLLOWING, REACTION_DELAY, COLLECTIVE_DEPARTURE, PLACE_PREFERENCE, DIRECTIONAL_DRIFT,
    TURNING_BIAS, TURNING_MEMORY, SPEED_MATCHING, CROWDING, BURST_AND_COAST, SPEED_TURN_COUPLING,
    FREEZING, FATIGUE, HABITUATION, BOLDNESS, ROBOT_AVOIDANCE,
    WAXING_WALLS, STARTLE, SOUND, KEPT_DISTANCE, ONE_EYE, LIT_ROOM, N_EFFECTS,
) = range(28)  # fmt: skip

FREEZE_S = 3.0
FROZEN_M_S = 0.002
STARTLE_STEPS = 3
STARTLE_REST_STEPS = 15
DEPARTURE_STEPS = 15


class World(NamedTuple):
    """A tank: corners (corner, 2), and the strip's width."""

    outline: Floats
    corridor: Floats
    mouths: Floats
    wall_zone_m: float


class Law(NamedTuple):
    """Parameters by zone id, row 0 unused; ``speed`` holds shares of bins of 0.02 m/s."""

    kappa_0: Floats
    kappa_f: Floats
    alpha: Floats
    gamma: Floats
    speed: Floats
    scale_0: Floats
    scale_f: Floats
    fov_rad: float


class Plan(NamedTuple):
    """What is hidden: strengths (agent, effect), and where and who it touches."""

    strength: Floats
    place: Floats
    speaker: Floats
    compass_rad: float
    phase_rad: float
    bold: Floats
    robot: int


class Past(NamedTuple):
    """A run: states at 0 ... T, steps 0 ... T - 1, and the log densities of its steps.

    ``xy`` (T + 1, agent, 2), ``heading`` and ``zone`` (T + 1, agent); ``turn``,
    ``speed``, ``score`` (speed's normal score), ``frozen`` and ``startled`` (T, agent);
    ``log_heading`` and ``log_speed`` (T, agent); ``left`` (room, agent), step at which
    an agent last left a room.
    """

    xy: Floats
    heading: Floats
    zone: Ints
    turn: Floats
    speed: Floats
    score: Floats
    frozen: Ints
    startled: Ints
    log_heading: Floats
    log_speed: Floats
    left: Ints
    first: int


@njit(cache=True)
def wrap(angle):
    """Return an angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


@njit(cache=True)
def within(x, y, corners):
    """Tell whether a polygon holds a point, by crossings of a ray."""
    inside = False
    n = len(corners)
    for a in range(n):
        b = (a + 1) % n
        if (corners[a, 1] > y) != (corners[b, 1] > y):
            share = (y - corners[a, 1]) / (corners[b, 1] - corners[a, 1])
            if x < corners[a, 0] + share * (corners[b, 0] - corners[a, 0]):
                inside = not inside
    return inside


@njit(cache=True)
def nearest_on(x, y, corners):
    """Return distance to a polygon's border, the nearest point, and its side's direction."""
    best, at_x, at_y, along = math.inf, 0.0, 0.0, 0.0
    n = len(corners)
    for a in range(n):
        b = (a + 1) % n
        dx, dy = corners[b, 0] - corners[a, 0], corners[b, 1] - corners[a, 1]
        t = ((x - corners[a, 0]) * dx + (y - corners[a, 1]) * dy) / (dx * dx + dy * dy)
        t = min(1.0, max(0.0, t))
        px, py = corners[a, 0] + t * dx, corners[a, 1] + t * dy
        d = (x - px) ** 2 + (y - py) ** 2
        if d < best:
            best, at_x, at_y, along = d, px, py, math.atan2(dy, dx)
    return math.sqrt(best), at_x, at_y, along


@njit(cache=True)
def zone_of(x, y, world):
    """Return the zone id of a point."""
    if not within(x, y, world.outline):
        return 0
    if within(x, y, world.corridor):
        return 1
    return 2 if nearest_on(x, y, world.outline)[0] < world.wall_zone_m else 3


@njit(cache=True)
def clear_m(x, y, world):
    """Return a distance within which no other zone begins."""
    wall = nearest_on(x, y, world.outline)[0]
    door = nearest_on(x, y, world.corridor)[0] if len(world.corridor) else math.inf
    return min(wall, abs(wall - world.wall_zone_m), door)


@njit(cache=True)
def wall_rad(x, y, world):
    """Return the direction along the nearest wall."""
    d, px, py, along = nearest_on(x, y, world.outline)
    return along if d < 1e-9 else math.atan2(py - y, px - x) + math.pi / 2


@njit(cache=True)
def triangle_sr(a, b, c):
    """Return the solid angle of a triangle seen from the origin (Van Oosterom, Strackee)."""
    la, lb, lc = np.sqrt((a * a).sum()), np.sqrt((b * b).sum()), np.sqrt((c * c).sum())
    triple = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    ab, bc, ca = (a * b).sum(), (b * c).sum(), (c * a).sum()
    return 2 * abs(math.atan2(abs(triple), la * lb * lc + ab * lc + bc * la + ca * lb))


@njit(cache=True)
def body_sr(dx, dy, heading):
    """Return the solid angle of a body of 20 x 20 x 10 mm with its head at (dx, dy)."""
    c, s = math.cos(heading), math.sin(heading)
    third = 0.02 / 3
    points = np.empty((4, 3))
    points[0] = np.array([dx, dy, 0.0])
    points[1] = np.array([dx - 0.02 * c, dy - 0.02 * s, 0.0])
    points[2] = np.array([dx - third * c - 0.01 * s, dy - third * s + 0.01 * c, 0.0])
    points[3] = np.array([dx - third * c + 0.01 * s, dy - third * s - 0.01 * c, 0.0])
    a, b, widest = 0, 1, -1.0
    for p in range(4):
        for q in range(p + 1, 4):
            gap = abs(wrap(math.atan2(points[p, 1], points[p, 0])
                           - math.atan2(points[q, 1], points[q, 0])))  # fmt: skip
            if gap > widest:
                a, b, widest = p, q, gap
    top = np.array([dx - third * c, dy - third * s, 0.005])
    bottom = np.array([dx - third * c, dy - third * s, -0.005])
    return triangle_sr(points[a], top, points[b]) + triangle_sr(points[a], points[b], bottom)


@njit(cache=True)
def room_of(x, y):
    """Return the room of a point: 0 up left, 1 down right."""
    return 0 if y > x else 1


@njit(cache=True)
def seen_from(i, j, t, past, plan):
    """Return where agent i takes agent j to be, and its heading: now, or a moment ago."""
    delay = plan.strength[i, REACTION_DELAY] / DT_S
    back = min(int(delay), t)
    share = delay - int(delay) if back < t else 0.0
    a, b = past.xy[t - back, j], past.xy[max(t - back - 1, 0), j]
    x, y = (1 - share) * a[0] + share * b[0], (1 - share) * a[1] + share * b[1]
    return x, y, past.heading[t - back, j]


@njit(cache=True)
def attention(i, j, t, bearing, distance, past, plan):
    """Return the factor by which a hidden effect changes the weight of a neighbour."""
    s = plan.strength[i]
    factor = 1.0
    if s[INTERACTION_RANGE] > 0 and distance > s[INTERACTION_RANGE]:
        return 0.0
    if s[LEADER_FOLLOWING] > 0 and t > 0:
        pace = (past.speed[t - 1, j] - 0.08) / 0.03
        factor *= 2 / (1 + math.exp(-s[LEADER_FOLLOWING] * pace))
    if s[HABITUATION] > 0:
        factor *= max(0.0, 1 - s[HABITUATION] * max(0, t - past.first) * DT_S / 1800)
    if s[ROBOT_AVOIDANCE] > 0 and j == plan.robot:
        factor *= max(0.0, 1 - s[ROBOT_AVOIDANCE])
    if s[ONE_EYE] > 0 and wrap(bearing - past.heading[t, i]) < 0:
        factor *= 1 - s[ONE_EYE]
    return factor


@njit(cache=True)
def add_neighbours(i, t, law, past, plan, out):
    """Add the heading component of each neighbour in view; weights are solid angles."""
    x, y, phi = past.xy[t, i, 0], past.xy[t, i, 1], past.heading[t, i]
    zone = past.zone[t, i]
    kappa, scale, alpha = law.kappa_f[zone], law.scale_f[zone], law.alpha[zone]
    s = plan.strength[i]
    fov = law.fov_rad - s[REAR_BLIND_ZONE]
    for j in range(past.xy.shape[1]):
        if j == i:
            continue
        xj, yj, phi_j = seen_from(i, j, t, past, plan)
        dx, dy = xj - x, yj - y
        bearing, distance = math.atan2(dy, dx), math.hypot(dx, dy)
        if abs(wrap(bearing - phi)) > fov:
            continue
        sr = body_sr(dx, dy, phi_j)
        weight = alpha * sr * attention(i, j, t, bearing, distance, past, plan)
        away = 0.0
        if s[KEPT_DISTANCE] > 0 and 0.02 <= distance < 0.08:
            away = weight * s[KEPT_DISTANCE]
        elif s[ROBOT_AVOIDANCE] > 1 and j == plan.robot:
            away = alpha * sr * (s[ROBOT_AVOIDANCE] - 1)
            weight += away
        if distance < 0.02:
            bearing += math.pi
        c, d = math.cos(bearing), math.sin(bearing)
        for k in range(N_CELLS):
            cosine = COS[k] * c + SIN[k] * d
            if weight > away:
                out[k] += (weight - away) * scale * math.exp(kappa * (cosine - 1))
            if away > 0:
                out[k] += away * scale * math.exp(kappa * (-cosine - 1))


@njit(cache=True)
def company(i, t, past, reach_m):
    """Return the mean heading of the others within reach, as a vector, and how many."""
    c, s, n = 0.0, 0.0, 0
    for j in range(past.xy.shape[1]):
        d = math.hypot(
            past.xy[t, j, 0] - past.xy[t, i, 0], past.xy[t, j, 1] - past.xy[t, i, 1]
        )
        if j != i and d < reach_m:
            c, s, n = c + math.cos(past.heading[t, j]), s + math.sin(past.heading[t, j]), n + 1
    return c, s, n


@njit(cache=True)
def offset_of(i, t, past, plan):
    """Return by how much handedness and the last turn rotate the base heading."""
    s = plan.strength[i]
    offset = s[TURNING_BIAS]
    if s[TURNING_MEMORY] != 0 and t > 0 and abs(past.turn[t - 1, i]) < 1.2:
        offset += s[TURNING_MEMORY] * past.turn[t - 1, i]
    return offset


@njit(cache=True)
def add_mode(out, weight, mode_rad, kappa, scale):
    """Add one bell to the cells."""
    c, s = math.cos(mode_rad), math.sin(mode_rad)
    for k in range(N_CELLS):
        out[k] += weight * scale * math.exp(kappa * (COS[k] * c + SIN[k] * s - 1))


@njit(cache=True)
def add_base(i, t, world, law, past, plan, out):
    """Add what an agent does by itself: straight on in the centre, along the wall elsewhere."""
    s, zone, phi = plan.strength[i], past.zone[t, i], past.heading[t, i]
    kappa, scale = law.kappa_0[zone], law.scale_0[zone]
    offset = offset_of(i, t, past, plan)
    mean_rad, n = 0.0, 0
    if s[ALIGNMENT] > 0:
        c, d, n = company(i, t, past, 0.12)
        mean_rad = math.atan2(d, c)
    if zone == 3:
        if n > 0:
            offset += s[ALIGNMENT] * wrap(mean_rad - phi)
        add_mode(out, 1.0, phi + offset, kappa, scale)
        return
    along = wall_rad(past.xy[t, i, 0], past.xy[t, i, 1], world)
    lean = 0.0
    if s[WALL_PERSISTENCE] != 0:
        lean = s[WALL_PERSISTENCE] * np.sign(math.cos(along - phi))
    if n > 0:
        lean += s[ALIGNMENT] * math.cos(along - mean_rad)
    lean = min(0.98, max(-0.98, lean))
    ebb = 0.0
    if s[WAXING_WALLS] > 0:
        clock = max(0, t - past.first) * DT_S
        ebb = s[WAXING_WALLS] * (1 + math.sin(2 * math.pi * clock / 240 + plan.phase_rad)) / 2
        add_mode(out, ebb, phi + offset, kappa, scale)
    add_mode(out, (1 - ebb) * (1 + lean) / 2, along + offset, kappa, scale)
    add_mode(out, (1 - ebb) * (1 - lean) / 2, along + math.pi + offset, kappa, scale)


@njit(cache=True)
def head_for_group(i, t, past, plan, out):
    """Now and then aim within 60 degrees of the centroid of all others, the farther the oftener."""
    n = past.xy.shape[1]
    x, y = past.xy[t, i, 0], past.xy[t, i, 1]
    dx = (past.xy[t, :, 0].sum() - x) / max(n - 1, 1) - x
    dy = (past.xy[t, :, 1].sum() - y) / max(n - 1, 1) - y
    share = min(0.9, plan.strength[i, GROUP_COHESION] * (1 - math.exp(-math.hypot(dx, dy) / 0.2)))
    bearing, total = math.atan2(dy, dx), out.sum() * CELL_RAD
    for k in range(N_CELLS):
        gap = abs(wrap(ANGLE[k] - bearing))
        sector = (1 + math.cos(3 * gap)) * 3 / (2 * math.pi) if gap < math.pi / 3 else 0.0
        out[k] = (1 - share) * out[k] + share * total * sector


@njit(cache=True)
def departure_pull(i, t, past, plan):
    """Return how strongly a recent departure of another from this room still pulls."""
    if past.zone[t, i] == 1:
        return 0.0
    room, pull = room_of(past.xy[t, i, 0], past.xy[t, i, 1]), 0.0
    for j in range(past.xy.shape[1]):
        age = t - past.left[room, j]
        if j != i and 0 <= age < DEPARTURE_STEPS:
            pull = max(pull, plan.strength[i, COLLECTIVE_DEPARTURE] * (1 - age / DEPARTURE_STEPS))
    return pull


@njit(cache=True)
def lean_toward(out, weight, x, y, to_x, to_y):
    """Make directions toward a point up to 1 + weight times as likely as those away from it."""
    bearing = math.atan2(to_y - y, to_x - x)
    c, s = math.cos(bearing), math.sin(bearing)
    for k in range(N_CELLS):
        out[k] *= 1 + weight * (1 + COS[k] * c + SIN[k] * s) / 2


@njit(cache=True)
def fondness(x, y, place):
    """Return how much a place is liked: a hill 0.3 m wide."""
    return math.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / (2 * 0.15**2))


@njit(cache=True)
def weigh_landing(i, t, v, world, law, past, plan, pull, out):
    """Weigh each cell by the zone that it lands in, and by a liked place."""
    x, y, zone = past.xy[t, i, 0], past.xy[t, i, 1], past.zone[t, i]
    s, reach = plan.strength[i], v * DT_S
    clear = clear_m(x, y, world) > reach
    here = fondness(x, y, plan.place)
    for k in range(N_CELLS):
        to_x, to_y = x + reach * COS[k], y + reach * SIN[k]
        to = zone if clear else zone_of(to_x, to_y, world)
        gamma = law.gamma[zone, to]
        if to == 1 and zone != 1:
            gamma *= math.exp(s[BOLDNESS] * plan.bold[i]) * (1 + pull)
        if s[PLACE_PREFERENCE] != 0:
            climb = (fondness(to_x, to_y, plan.place) - here) / 0.05
            gamma *= min(5.0, max(0.05, 1 + s[PLACE_PREFERENCE] * climb))
        out[k] *= gamma


@njit(cache=True)
def heading_cells(i, t, v, world, law, past, plan, out):
    """Write the density of the next heading over the cells; return its total weight."""
    s = plan.strength[i]
    x, y = past.xy[t, i, 0], past.xy[t, i, 1]
    out[:] = 0.0
    add_base(i, t, world, law, past, plan, out)
    add_neighbours(i, t, law, past, plan, out)
    if s[GROUP_COHESION] > 0:
        head_for_group(i, t, past, plan, out)
    pull = departure_pull(i, t, past, plan) if s[COLLECTIVE_DEPARTURE] > 0 else 0.0
    if pull > 0:
        mouth = world.mouths[room_of(x, y)]
        lean_toward(out, pull, x, y, mouth[0], mouth[1])
    if s[SOUND] > 0 and t >= past.first and (t - past.first + 150) % 300 < 15:
        lean_toward(out, s[SOUND], x, y, 2 * x - plan.speaker[0], 2 * y - plan.speaker[1])
    weigh_landing(i, t, v, world, law, past, plan, pull, out)
    total = out.sum() * CELL_RAD
    if total > 0:
        for k in range(N_CELLS):
            out[k] /= total
    return total


@njit(cache=True)
def cell_of(theta):
    """Return the cell of a heading."""
    return min(N_CELLS - 1, max(0, int((theta + math.pi) / CELL_RAD)))


@njit(cache=True)
def speed_factor(i, t, past, plan):
    """Return the factor on the drawn speed: neighbours, time, light."""
    s, factor = plan.strength[i], 1.0
    x, y = past.xy[t, i, 0], past.xy[t, i, 1]
    if s[CROWDING] != 0:
        factor *= min(3.0, max(0.2, 1 + s[CROWDING] * company(i, t, past, 0.10)[2]))
    if s[FATIGUE] > 0:
        factor *= math.exp(-s[FATIGUE] * max(0, t - past.first) * DT_S / 1800)
    if s[LIT_ROOM] > 0 and past.zone[t, i] != 1 and room_of(x, y) == 0:
        factor *= 1 + s[LIT_ROOM]
    return factor


@njit(cache=True)
def pace_of_nearest(i, t, past):
    """Return the mean last speed of the two nearest others."""
    n = past.xy.shape[1]
    away = np.full(n, np.inf)
    for j in range(n):
        if j != i:
            away[j] = math.hypot(
                past.xy[t, j, 0] - past.xy[t, i, 0], past.xy[t, j, 1] - past.xy[t, i, 1]
            )
    near = np.argsort(away)[: min(2, n - 1)]
    total = 0.0
    for j in near:
        total += past.speed[t - 1, j]
    return total / len(near)


@njit(cache=True)
def draw_speed(i, t, law, past, plan, rng):
    """Return a speed, its log density and its normal score."""
    s, shares = plan.strength[i], law.speed[past.zone[t, i]]
    score, log_density = rng.normal(0.0, 1.0), 0.0
    if s[BURST_AND_COAST] > 0 and t > 0:
        r, last = s[BURST_AND_COAST], past.score[t - 1, i]
        score = r * last + math.sqrt(1 - r * r) * score
        off = (score - r * last) ** 2 / (1 - r * r)
        log_density += 0.5 * (score * score - off) - 0.5 * math.log(1 - r * r)
    u = 0.5 * (1 + math.erf(score / math.sqrt(2)))
    b = 0
    while b < 9 and u > shares[b]:
        u -= shares[b]
        b += 1
    v = 0.02 * (b + min(1.0, u / shares[b]))
    log_density += math.log(shares[b] / 0.02)
    factor = speed_factor(i, t, past, plan)
    v, log_density = v * factor, log_density - math.log(factor)
    if s[SPEED_MATCHING] > 0 and t > 0:
        w = s[SPEED_MATCHING]
        v = (1 - w) * v + w * pace_of_nearest(i, t, past)
        log_density -= math.log(1 - w)
    return v, log_density, score


@njit(cache=True)
def freeze(i, t, past, plan, rng):
    """Return whether an agent stands still in this step, and the log probability of that."""
    start = plan.strength[i, FREEZING] * DT_S
    was = t > 0 and past.frozen[t - 1, i] == 1
    chance = math.exp(-DT_S / FREEZE_S) if was else start
    still = rng.random() < chance
    return still, math.log(chance if still else 1 - chance)


@njit(cache=True)
def startle(i, t, past, plan, rng):
    """Return whether a startle begins or goes on, and the log probability of its beginning."""
    for back in range(1, STARTLE_REST_STEPS + 1):
        if t - back >= 0 and past.startled[t - back, i] == 1:
            begun = t - back
            return begun > t - STARTLE_STEPS, False, 0.0
    chance = plan.strength[i, STARTLE] * DT_S
    for j in range(past.xy.shape[1]):
        gap = math.hypot(past.xy[t, j, 0] - past.xy[t, i, 0], past.xy[t, j, 1] - past.xy[t, i, 1])
        if j != i and t > 0 and past.startled[t - 1, j] == 1 and gap < 0.15:
            chance = max(chance, 0.6)
    begins = rng.random() < chance
    return begins, begins, math.log(chance if begins else 1 - chance)


@njit(cache=True)
def go(i, t, theta, v, world, past, plan):
    """Move an agent: a current may carry it on, as long as it stays inside."""
    x = past.xy[t, i, 0] + v * DT_S * math.cos(theta)
    y = past.xy[t, i, 1] + v * DT_S * math.sin(theta)
    current = plan.strength[i, DIRECTIONAL_DRIFT] * DT_S
    if current > 0:
        to_x = x + current * math.cos(plan.compass_rad)
        to_y = y + current * math.sin(plan.compass_rad)
        if within(to_x, to_y, world.outline):
            dx, dy = to_x - past.xy[t, i, 0], to_y - past.xy[t, i, 1]
            carried = max(math.hypot(dx, dy) / DT_S, 1e-6)
            # The density of displacements in the plane is f(theta) f(v) / v.
            past.log_speed[t, i] += math.log(carried / max(v, 1e-6))
            x, y, theta, v = to_x, to_y, math.atan2(dy, dx), carried
    past.xy[t + 1, i, 0], past.xy[t + 1, i, 1] = x, y
    past.heading[t + 1, i], past.speed[t, i] = theta, v
    past.turn[t, i] = wrap(theta - past.heading[t, i])


@njit(cache=True)
def slow_in_turn(i, t, theta, v, world, past, plan):
    """Return the speed that is left in a turn."""
    kept = 1 - plan.strength[i, SPEED_TURN_COUPLING] * abs(wrap(theta - past.heading[t, i])) / math.pi
    x = past.xy[t, i, 0] + kept * v * DT_S * math.cos(theta)
    y = past.xy[t, i, 1] + kept * v * DT_S * math.sin(theta)
    if kept >= 1 or not within(x, y, world.outline):
        return v
    past.log_speed[t, i] -= math.log(kept)
    return kept * v


@njit(cache=True)
def stay(i, t, past):
    """Leave an agent where it is."""
    past.xy[t + 1, i] = past.xy[t, i]
    past.heading[t + 1, i], past.speed[t, i] = past.heading[t, i], 0.0


@njit(cache=True)
def stand(i, t, world, past, rng):
    """Let a frozen agent tremble by less than half a millimetre."""
    stay(i, t, past)
    v, theta = FROZEN_M_S * rng.random(), 2 * math.pi * rng.random() - math.pi
    x = past.xy[t, i, 0] + v * DT_S * math.cos(theta)
    y = past.xy[t, i, 1] + v * DT_S * math.sin(theta)
    if within(x, y, world.outline):
        past.xy[t + 1, i, 0], past.xy[t + 1, i, 1], past.speed[t, i] = x, y, v
    past.frozen[t, i] = 1
    past.log_speed[t, i] -= math.log(FROZEN_M_S)


@njit(cache=True)
def draw_heading(i, t, v, world, law, past, plan, rng, cells):
    """Return whether some direction is admissible, and one; its log density is noted."""
    if heading_cells(i, t, v, world, law, past, plan, cells) <= 0:
        return False, 0.0
    x, y = past.xy[t, i, 0], past.xy[t, i, 1]
    for _ in range(100):
        u, k = rng.random() / CELL_RAD, 0
        while k < N_CELLS - 1 and u > cells[k]:
            u -= cells[k]
            k += 1
        theta = -math.pi + (k + rng.random()) * CELL_RAD
        # A cell whose middle is inside may reach through the wall.
        to_x, to_y = x + v * DT_S * math.cos(theta), y + v * DT_S * math.sin(theta)
        if cells[k] > 0 and within(to_x, to_y, world.outline):
            past.log_heading[t, i] = math.log(cells[k])
            return True, theta
    return False, 0.0


@njit(cache=True)
def one_step(i, t, world, law, past, plan, rng, cells):
    """Move one agent by one step."""
    s, chance = plan.strength[i], 0.0
    if s[FREEZING] > 0:
        still, chance = freeze(i, t, past, plan, rng)
        past.log_speed[t, i] = chance
        if still:
            stand(i, t, world, past, rng)
            return
    flees = False
    if s[STARTLE] > 0:
        flees, begins, chance = startle(i, t, past, plan, rng)
        past.startled[t, i] = 1 if begins else 0
    for _ in range(50):
        v, log_density, score = draw_speed(i, t, law, past, plan, rng)
        if flees:
            v, log_density = 0.14 + 0.06 * rng.random(), -math.log(0.06)
        drawn, theta = draw_heading(i, t, v, world, law, past, plan, rng, cells)
        if drawn:
            past.log_speed[t, i], past.score[t, i] = chance + log_density, score
            v = slow_in_turn(i, t, theta, v, world, past, plan)
            go(i, t, theta, v, world, past, plan)
            return
    stay(i, t, past)


@njit(cache=True)
def note_departures(t, world, past):
    """Note the zones after a step, and who has just left a room."""
    for i in range(past.xy.shape[1]):
        x, y = past.xy[t + 1, i, 0], past.xy[t + 1, i, 1]
        past.zone[t + 1, i] = zone_of(x, y, world)
        if past.zone[t + 1, i] == 1 and past.zone[t, i] != 1:
            past.left[room_of(past.xy[t, i, 0], past.xy[t, i, 1]), i] = t + 1


@njit(cache=True)
def run(world, law, past, plan, rng):
    """Fill a run from uniform positions and headings."""
    low_x, high_x = world.outline[:, 0].min(), world.outline[:, 0].max()
    low_y, high_y = world.outline[:, 1].min(), world.outline[:, 1].max()
    n_steps, n = past.speed.shape
    cells = np.empty(N_CELLS)
    for i in range(n):
        zone = 0
        while zone == 0:
            x = low_x + (high_x - low_x) * rng.random()
            y = low_y + (high_y - low_y) * rng.random()
            zone = zone_of(x, y, world)
            past.xy[0, i, 0], past.xy[0, i, 1], past.zone[0, i] = x, y, zone
        past.heading[0, i] = 2 * math.pi * rng.random() - math.pi
    for t in range(n_steps):
        for i in range(n):
            one_step(i, t, world, law, past, plan, rng, cells)
        note_departures(t, world, past)


@njit(cache=True)
def log_base(step, agent, world, law, past, plan):
    """Return the log density of each taken heading under a law without effects; NaN at a graze."""
    cells, value = np.empty(N_CELLS), np.empty(len(step))
    for n in range(len(step)):
        t, i = step[n], agent[n]
        heading_cells(i, t, past.speed[t, i], world, law, past, plan, cells)
        k = cell_of(past.heading[t + 1, i])
        f = cells[k]
        if f <= 0:  # the cell's middle is outside, the heading itself was not
            f = max(cells[k - 1], cells[(k + 1) % N_CELLS])
        value[n] = math.log(f) if f > 0 else np.nan
    return value


@njit(cache=True)
def contexts(step, agent, world, law, past, n_angles):
    """Return what the base law asks of each step.

    The base direction, the neighbours' directions and solid angles (step, other), the
    landing zone at each of ``n_angles`` angles, and that of the step itself.
    """
    n, others = len(step), past.xy.shape[1] - 1
    base, toward, sr = np.empty(n), np.zeros((n, others)), np.zeros((n, others))
    land, landed = np.empty((n, n_angles), np.int8), np.empty(n, np.int64)
    for m in range(n):
        t, i = step[m], agent[m]
        x, y, zone = past.xy[t, i, 0], past.xy[t, i, 1], past.zone[t, i]
        base[m] = past.heading[t, i] if zone == 3 else wall_rad(x, y, world)
        c = 0
        for j in range(past.xy.shape[1]):
            dx, dy = past.xy[t, j, 0] - x, past.xy[t, j, 1] - y
            bearing = math.atan2(dy, dx)
            if j == i or abs(wrap(bearing - past.heading[t, i])) > law.fov_rad:
                continue
            toward[m, c] = bearing + (math.pi if math.hypot(dx, dy) < 0.02 else 0.0)
            sr[m, c] = body_sr(dx, dy, past.heading[t, j])
            c += 1
        reach = past.speed[t, i] * DT_S
        clear = clear_m(x, y, world) > reach
        for k in range(n_angles):
            a = -math.pi + (k + 0.5) * 2 * math.pi / n_angles
            to = zone if clear else zone_of(x + reach * math.cos(a), y + reach * math.sin(a), world)
            land[m, k] = to
        a = ANGLE[cell_of(past.heading[t + 1, i])]
        landed[m] = zone_of(x + reach * math.cos(a), y + reach * math.sin(a), world)
    return base, toward, sr, land, landed
