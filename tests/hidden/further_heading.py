"""Further forms of effects on headings: attention, base, modes, leanings, zones.

Each function returns what leaves a law without these forms as it is where no strength is
set. What a form is for is said in `hidden.further`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hidden.geometry import wall_rad, wrap
from hidden.states import (
    ALTERNATION,
    BEND,
    BOLD_CENTRE,
    CENTROID,
    DT_S,
    FLEE_ROBOT,
    FLOW,
    HOME,
    LEAKY_TURN,
    NEAREST_HEADING,
    ONE_LEADER,
    QUORUM,
    RANGE_DECAY,
    REAR_CARDIOID,
    RECENT_SENSE,
    REGAIN,
    SIDES,
    SNAPSHOT,
    SUDDEN_HABITUATION,
)
from hidden.surroundings import (
    add_wide,
    bearing_rad,
    centroid_of,
    clock_s,
    company,
    favour_left,
    gap_m,
    n_leavers,
    nearest_of,
    room_of,
    tilt,
)

_REMEMBERED_STEPS = 15
_SLIGHT_RAD = 0.3
_WIDE = 4.0


@njit(cache=True)
def leader_of(past, plan):
    """Return the fish that leads all others, drawn by the seed."""
    n_fish = plan.robot if plan.robot >= 0 else past.xy.shape[1]
    return min(n_fish - 1, int(plan.constants[ONE_LEADER, 0] * n_fish))


@njit(cache=True)
def further_attention(i, j, t, bearing, distance, past, plan):
    """Return the factor by which further forms change the weight of a neighbour."""
    s, c, factor = plan.strength[i], plan.constants, 1.0
    off_axis = abs(wrap(bearing - past.heading[t, i]))
    if s[RANGE_DECAY] > 0:
        factor *= math.exp(-s[RANGE_DECAY] * distance)
    if s[REAR_CARDIOID] > 0:
        factor *= ((1 + math.cos(off_axis)) / 2) ** s[REAR_CARDIOID]
    if s[ONE_LEADER] > 0 and j == leader_of(past, plan):
        factor *= 1 + s[ONE_LEADER]
    if s[SUDDEN_HABITUATION] > 0 and clock_s(t, past) > c[SUDDEN_HABITUATION, 0]:
        factor *= max(0.0, 1 - s[SUDDEN_HABITUATION])
    return factor


@njit(cache=True)
def late_bearing(i, j, t, past, plan):
    """Return the share of an attraction that goes to where another was, and that bearing."""
    s, c = plan.strength[i], plan.constants
    lag = int(c[SNAPSHOT, 0])
    if s[SNAPSHOT] > 0 and t >= lag:
        return s[SNAPSHOT], bearing_rad(i, j, t - lag, past)
    return 0.0, 0.0


@njit(cache=True)
def further_offset(i, t, past, plan):
    """Return by how much further forms rotate the base heading."""
    s, offset = plan.strength[i], 0.0
    if s[LEAKY_TURN] > 0:
        total, weights = 0.0, 0.0
        for age in range(min(t, _REMEMBERED_STEPS)):
            weight = math.exp(-age * DT_S / plan.constants[LEAKY_TURN, 0])
            total += weight * min(1.2, max(-1.2, past.turn[t - 1 - age, i]))
            weights += weight
        offset += s[LEAKY_TURN] * total / max(weights, 1e-9)
    if s[BEND] > 0 and past.zone[t, i] == 3:
        offset += s[BEND] * math.sin(plan.compass_rad - past.heading[t, i])
    return offset


@njit(cache=True)
def further_lean(i, t, along, world, past, plan):
    """Return by how much further forms prefer a sense of travel along a wall."""
    s, lean = plan.strength[i], 0.0
    if s[RECENT_SENSE] > 0:
        total, weights = 0.0, 0.0
        for age in range(min(t + 1, _REMEMBERED_STEPS)):
            then = t - age
            if past.zone[then, i] == 3:
                break
            weight = math.exp(-age * DT_S / plan.constants[RECENT_SENSE, 0])
            wall = wall_rad(past.xy[then, i, 0], past.xy[then, i, 1], world)
            total += weight * np.sign(math.cos(wall - past.heading[then, i]))
            weights += weight
        lean += s[RECENT_SENSE] * total / max(weights, 1e-9)
    if s[BEND] > 0:
        lean += s[BEND] * math.cos(along - plan.compass_rad)
    return lean


@njit(cache=True)
def add_social_modes(i, t, past, plan, out):
    """Add what further forms draw a fish to, or from: a centroid, a robot."""
    s, c = plan.strength[i], plan.constants
    if s[CENTROID] > 0:
        away, bearing = centroid_of(i, t, past)
        add_wide(out, s[CENTROID] * away / (away + c[CENTROID, 0]), bearing, c[CENTROID, 1])
    if s[FLEE_ROBOT] > 0 and plan.robot >= 0:
        near = 1 - gap_m(i, plan.robot, t, past) / c[FLEE_ROBOT, 0]
        away_rad = bearing_rad(i, plan.robot, t, past) + math.pi
        add_wide(out, s[FLEE_ROBOT] * near, away_rad, c[FLEE_ROBOT, 1])


@njit(cache=True)
def add_places(i, t, world, past, plan, out):
    """Add the door to which further forms draw a fish."""
    s, c, zone = plan.strength[i], plan.constants, past.zone[t, i]
    x, y = past.xy[t, i, 0], past.xy[t, i, 1]
    if s[QUORUM] > 0 and zone != 1:
        share = n_leavers(i, t, past, c[QUORUM, 0]) / max(past.xy.shape[1] - 1, 1)
        door = world.mouths[room_of(x, y)]
        add_wide(out, s[QUORUM] * share, math.atan2(door[1] - y, door[0] - x), _WIDE)


@njit(cache=True)
def lean_further(i, t, past, plan, out):
    """Weigh the cells by what further forms favour or avoid, whatever the base does."""
    s, c, phi = plan.strength[i], plan.constants, past.heading[t, i]
    x, y, zone = past.xy[t, i, 0], past.xy[t, i, 1], past.zone[t, i]
    nearest, away = nearest_of(i, t, past)
    if s[FLOW] > 0:
        to_x, to_y, n = company(i, t, past, c[FLOW, 0])
        tilt(out, s[FLOW] * math.hypot(to_x, to_y) / max(n, 1), math.atan2(to_y, to_x))
    if s[NEAREST_HEADING] > 0 and nearest >= 0:
        weight = s[NEAREST_HEADING] * math.exp(-away / c[NEAREST_HEADING, 0])
        tilt(out, weight, past.heading[t, nearest])
    if s[REGAIN] > 0 and nearest >= 0 and away > c[REGAIN, 0]:
        tilt(out, s[REGAIN], bearing_rad(i, nearest, t, past))
    if s[HOME] > 0 and zone != 1 and room_of(x, y) == room_of(plan.place[0], plan.place[1]):
        tilt(out, s[HOME], math.atan2(plan.place[1] - y, plan.place[0] - x))
    if s[SIDES] > 0:
        favour_left(out, s[SIDES], phi)
    if s[ALTERNATION] > 0 and t > 0:
        favour_left(out, -s[ALTERNATION] * math.tanh(past.turn[t - 1, i] / _SLIGHT_RAD), phi)


@njit(cache=True)
def zone_factor(i, to, plan):
    """Return the factor by which further forms change the attraction of a zone."""
    if to == 3 and plan.strength[i, BOLD_CENTRE] > 0:
        return math.exp(plan.strength[i, BOLD_CENTRE] * plan.bold[i])
    return 1.0
