"""The density of the next heading: what an agent does by itself, its neighbours, the zones.

Lengths are metres, times seconds, angles radians.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hidden.further_heading import (
    add_places,
    add_social_modes,
    further_attention,
    further_lean,
    further_offset,
    late_bearing,
    lean_further,
    zone_factor,
)
from hidden.geometry import body_sr, clear_m, wall_rad, wrap, zone_of
from hidden.states import (
    ALIGNMENT,
    ANGLE,
    BLIND_RAD,
    BOLDNESS,
    CELL_RAD,
    COLLECTIVE_DEPARTURE,
    COS,
    DEPARTURE_STEPS,
    DT_S,
    FELT_M,
    GROUP_COHESION,
    HABITUATION,
    INTERACTION_RANGE,
    KEPT_DISTANCE,
    LATE_STEPS,
    LEADER_FOLLOWING,
    N_CELLS,
    ONE_EYE,
    PLACE_PREFERENCE,
    REACTION_DELAY,
    REAR_BLIND_ZONE,
    ROBOT_AVOIDANCE,
    SIN,
    SOUND,
    TURNING_BIAS,
    TURNING_MEMORY,
    WALL_PERSISTENCE,
    WAXING_WALLS,
)
from hidden.surroundings import add_mode, company, lean_toward, room_of


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
    if s[REAR_BLIND_ZONE] > 0:
        off_axis = abs(wrap(bearing - past.heading[t, i]))
        factor *= 1 - s[REAR_BLIND_ZONE] / (1 + math.exp(-(off_axis - BLIND_RAD) / 0.1))
    if s[ONE_EYE] > 0 and wrap(bearing - past.heading[t, i]) < 0:
        factor *= 1 - s[ONE_EYE]
    if plan.further:
        factor *= further_attention(i, j, t, bearing, distance, past, plan)
    return factor


@njit(cache=True)
def add_neighbour(i, j, t, law, past, plan, out):
    """Add the heading component of one neighbour if it is in view; its weight is a solid angle."""
    x, y, phi = past.xy[t, i, 0], past.xy[t, i, 1], past.heading[t, i]
    zone, s = past.zone[t, i], plan.strength[i]
    kappa, scale, alpha = law.kappa_f[zone], law.scale_f[zone], law.alpha[zone]
    dx, dy = past.xy[t, j, 0] - x, past.xy[t, j, 1] - y
    bearing, distance = math.atan2(dy, dx), math.hypot(dx, dy)
    if abs(wrap(bearing - phi)) > law.fov_rad:
        return
    sr = body_sr(dx, dy, past.heading[t, j])
    weight = alpha * sr * attention(i, j, t, bearing, distance, past, plan)
    away = 0.0
    if s[KEPT_DISTANCE] > 0 and 0.02 <= distance < 0.08:
        away = weight * max(0.0, s[KEPT_DISTANCE] - 1)
        weight = weight * max(0.0, 1 - s[KEPT_DISTANCE]) + away
    elif s[ROBOT_AVOIDANCE] > 1 and j == plan.robot:
        away = alpha * sr * (s[ROBOT_AVOIDANCE] - 1)
        weight += away
    if s[REACTION_DELAY] > 0 and distance > FELT_M and t >= LATE_STEPS:
        then = past.xy[t - LATE_STEPS, j]
        late = s[REACTION_DELAY] * weight
        add_mode(out, late, math.atan2(then[1] - y, then[0] - x), kappa, scale)
        weight -= late
    if plan.further:
        share, felt_rad = late_bearing(i, j, t, past, plan)
        add_mode(out, share * weight, felt_rad, kappa, scale)
        weight -= share * weight
    if distance < 0.02:
        bearing += math.pi
    add_mode(out, weight - away, bearing, kappa, scale)
    add_mode(out, away, bearing + math.pi, kappa, scale)


@njit(cache=True)
def offset_of(i, t, past, plan):
    """Return by how much handedness and the last turn rotate the base heading."""
    s = plan.strength[i]
    offset = s[TURNING_BIAS]
    if s[TURNING_MEMORY] != 0 and t > 0 and abs(past.turn[t - 1, i]) < 1.2:
        offset += s[TURNING_MEMORY] * past.turn[t - 1, i]
    return offset


@njit(cache=True)
def add_base(i, t, world, law, past, plan, out):
    """Add what an agent does by itself: straight on in the centre, along the wall elsewhere."""
    s, zone, phi = plan.strength[i], past.zone[t, i], past.heading[t, i]
    kappa, scale = law.kappa_0[zone], law.scale_0[zone]
    offset = offset_of(i, t, past, plan)
    if plan.further:
        offset += further_offset(i, t, past, plan)
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
    if plan.further:
        lean += further_lean(i, t, along, world, past, plan)
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
    """Favour a sector about the centroid of all others, seen or not, the more the farther."""
    n = past.xy.shape[1]
    x, y = past.xy[t, i, 0], past.xy[t, i, 1]
    dx = (past.xy[t, :, 0].sum() - x) / max(n - 1, 1) - x
    dy = (past.xy[t, :, 1].sum() - y) / max(n - 1, 1) - y
    weight = plan.strength[i, GROUP_COHESION] * (1 - math.exp(-math.hypot(dx, dy) / 0.2))
    bearing = math.atan2(dy, dx)
    for k in range(N_CELLS):
        gap = abs(wrap(ANGLE[k] - bearing))
        if gap < math.pi / 2:
            out[k] *= 1 + weight * (1 + math.cos(2 * gap)) / 2


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
def approach_door(i, x, y, world, plan, out):
    """Let the bold lean to a door within 15 cm, and the shy away from it."""
    mouth, zest = world.mouths[room_of(x, y)], plan.strength[i, BOLDNESS] * plan.bold[i]
    if math.hypot(mouth[0] - x, mouth[1] - y) < 0.15:
        sign = 1.0 if zest > 0 else -1.0
        to_x, to_y = x + sign * (mouth[0] - x), y + sign * (mouth[1] - y)
        lean_toward(out, math.exp(abs(zest)) - 1, x, y, to_x, to_y)


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
    liking = np.ones(4)
    if plan.further:
        for to in range(1, 4):
            liking[to] = zone_factor(i, to, plan)
    for k in range(N_CELLS):
        to_x, to_y = x + reach * COS[k], y + reach * SIN[k]
        to = zone if clear else zone_of(to_x, to_y, world)
        gamma = law.gamma[zone, to] * liking[to]
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
    for j in range(past.xy.shape[1]):
        if j != i:
            add_neighbour(i, j, t, law, past, plan, out)
    if plan.further:
        add_social_modes(i, t, past, plan, out)
        add_places(i, t, world, past, plan, out)
        lean_further(i, t, past, plan, out)
    if s[GROUP_COHESION] > 0:
        head_for_group(i, t, past, plan, out)
    pull = departure_pull(i, t, past, plan) if s[COLLECTIVE_DEPARTURE] > 0 else 0.0
    if pull > 0:
        mouth = world.mouths[room_of(x, y)]
        lean_toward(out, pull, x, y, mouth[0], mouth[1])
    if s[BOLDNESS] > 0 and past.zone[t, i] != 1:
        approach_door(i, x, y, world, plan, out)
    if s[SOUND] > 0 and t >= past.first and (t - past.first + 150) % 300 < 15:
        lean_toward(out, s[SOUND], x, y, 2 * x - plan.speaker[0], 2 * y - plan.speaker[1])
    weigh_landing(i, t, v, world, law, past, plan, pull, out)
    total = out.sum() * CELL_RAD
    if total > 0:
        for k in range(N_CELLS):
            out[k] /= total
    return total
