"""The second simulator's loops: who freezes, darts or crawls, and how all agents move.

Lengths are metres, times seconds, angles radians.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hidden.geometry import body_sr, clear_m, wall_rad, within, wrap, zone_of
from hidden.heading import heading_cells
from hidden.speeds import draw_speed, note_speed, speed_bin
from hidden.states import (
    ANGLE,
    CELL_RAD,
    CRAWL,
    CRAWL_M_S,
    DIRECTIONAL_DRIFT,
    DT_S,
    FREEZE_S,
    FREEZING,
    FROZEN_M_S,
    N_CELLS,
    SHY_FREEZE,
    SPEED_TURN_COUPLING,
    STARTLE,
    STARTLE_REST_STEPS,
    STARTLE_STEPS,
)
from hidden.surroundings import cell_of, room_of


@njit(cache=True)
def bout(i, t, state, starts_hz, mean_s, past, rng):
    """Return whether a bout begins or goes on, and the log probability of that."""
    was = t > 0 and past.frozen[t - 1, i] == state
    chance = math.exp(-DT_S / mean_s) if was else starts_hz * DT_S
    on = rng.random() < chance
    return on, math.log(chance if on else 1 - chance)


@njit(cache=True)
def rests(i, t, past, plan, rng):
    """Return whether an agent stands still in this step, and the log probability of that."""
    s, still, chance = plan.strength[i], False, 0.0
    if s[FREEZING] > 0:
        still, chance = bout(i, t, 1, s[FREEZING], FREEZE_S, past, rng)
    if not still and s[SHY_FREEZE] > 0 and plan.bold[i] < 0:
        mean_s = plan.constants[SHY_FREEZE, 0]
        still, noted = bout(i, t, 1, s[SHY_FREEZE], mean_s, past, rng)
        chance += noted
    return still, chance


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
    """Move an agent and return the speed that it gains from a current.

    The current carries it on as long as it stays inside.
    """
    along = 0.0
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
            past.log_heading[t, i] += math.log(carried / max(v, 1e-6))
            x, y, theta, v = to_x, to_y, math.atan2(dy, dx), carried
            along = current / DT_S * math.cos(plan.compass_rad - theta)
    past.xy[t + 1, i, 0], past.xy[t + 1, i, 1] = x, y
    past.heading[t + 1, i], past.speed[t, i] = theta, v
    past.turn[t, i] = wrap(theta - past.heading[t, i])
    return along


@njit(cache=True)
def kept_in_turn(i, t, theta, v, world, past, plan):
    """Return the share of the speed that is left in a turn."""
    turn = abs(wrap(theta - past.heading[t, i]))
    kept = 1 - plan.strength[i, SPEED_TURN_COUPLING] * turn / math.pi
    x = past.xy[t, i, 0] + kept * v * DT_S * math.cos(theta)
    y = past.xy[t, i, 1] + kept * v * DT_S * math.sin(theta)
    return kept if within(x, y, world.outline) else 1.0


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
    s = plan.strength[i]
    still, chance = rests(i, t, past, plan, rng)
    if chance != 0:
        past.log_speed[t, i] = chance
    if still:
        stand(i, t, world, past, rng)
        return
    creeps = False
    if s[CRAWL] > 0:
        creeps, noted = bout(i, t, 2, s[CRAWL], plan.constants[CRAWL, 0], past, rng)
        chance += noted
        past.frozen[t, i] = 2 if creeps else 0
    flees = False
    if s[STARTLE] > 0:
        flees, begins, chance = startle(i, t, past, plan, rng)
        past.startled[t, i] = 1 if begins else 0
    for _ in range(50):
        v, score, scale, shift = draw_speed(i, t, law, past, plan, rng)
        if flees:
            v = 0.14 + 0.06 * rng.random()
        elif creeps:
            v = CRAWL_M_S * rng.random()
        drawn, theta = draw_heading(i, t, v, world, law, past, plan, rng, cells)
        if drawn:
            past.log_speed[t, i], past.score[t, i] = chance, score
            kept = kept_in_turn(i, t, theta, v, world, past, plan)
            shift = kept * shift + go(i, t, theta, kept * v, world, past, plan)
            if flees:
                past.log_speed[t, i] -= math.log(3)  # one bin in three
            elif creeps:
                slowest = 0.0025 / CRAWL_M_S
                slow = speed_bin(past.speed[t, i]) == 0
                past.log_speed[t, i] += math.log(slowest if slow else 1 - slowest)
            else:
                note_speed(i, t, kept * scale, shift, law, past, plan)
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
