"""The second simulator's loops: where, what is seen, which way, how fast.

Lengths are metres, times seconds, angles radians.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hidden.geometry import body_sr, clear_m, wall_rad, within, wrap, zone_of
from hidden.states import (
    ALIGNMENT,
    ANGLE,
    BLIND_RAD,
    BOLDNESS,
    BURST_AND_COAST,
    CELL_RAD,
    COLLECTIVE_DEPARTURE,
    COS,
    CROWDING,
    DEPARTURE_STEPS,
    DIRECTIONAL_DRIFT,
    DT_S,
    FATIGUE,
    FELT_M,
    FREEZE_S,
    FREEZING,
    FROZEN_M_S,
    GROUP_COHESION,
    HABITUATION,
    INTERACTION_RANGE,
    KEPT_DISTANCE,
    LATE_STEPS,
    LEADER_FOLLOWING,
    LIT_ROOM,
    N_CELLS,
    ONE_EYE,
    PLACE_PREFERENCE,
    REACTION_DELAY,
    REAR_BLIND_ZONE,
    ROBOT_AVOIDANCE,
    SIN,
    SOUND,
    SPEED_MATCHING,
    SPEED_TURN_COUPLING,
    STARTLE,
    STARTLE_REST_STEPS,
    STARTLE_STEPS,
    TURNING_BIAS,
    TURNING_MEMORY,
    WALL_PERSISTENCE,
    WAXING_WALLS,
)


@njit(cache=True)
def room_of(x, y):
    """Return the room of a point: 0 up left, 1 down right."""
    return 0 if y > x else 1


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
    return factor


@njit(cache=True)
def add_mode(out, weight, mode_rad, kappa, scale):
    """Add one bell to the cells."""
    if weight <= 0:
        return
    c, s = math.cos(mode_rad), math.sin(mode_rad)
    for k in range(N_CELLS):
        out[k] += weight * scale * math.exp(kappa * (COS[k] * c + SIN[k] * s - 1))


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
    if distance < 0.02:
        bearing += math.pi
    add_mode(out, weight - away, bearing, kappa, scale)
    add_mode(out, away, bearing + math.pi, kappa, scale)


@njit(cache=True)
def company(i, t, past, reach_m):
    """Return the mean heading of the others within reach, as a vector, and how many."""
    c, s, n = 0.0, 0.0, 0
    for j in range(past.xy.shape[1]):
        d = math.hypot(past.xy[t, j, 0] - past.xy[t, i, 0], past.xy[t, j, 1] - past.xy[t, i, 1])
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
def lean_toward(out, weight, x, y, to_x, to_y):
    """Make directions toward a point up to 1 + weight times as likely as those away from it."""
    bearing = math.atan2(to_y - y, to_x - x)
    c, s = math.cos(bearing), math.sin(bearing)
    for k in range(N_CELLS):
        out[k] *= 1 + weight * (1 + COS[k] * c + SIN[k] * s) / 2


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
    for j in range(past.xy.shape[1]):
        if j != i:
            add_neighbour(i, j, t, law, past, plan, out)
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
def normal_share(score):
    """Return the share of a normal law below a score."""
    return 0.5 * (1 + math.erf(score / math.sqrt(2)))


@njit(cache=True)
def normal_score(share):
    """Return the score below which a share of a normal law lies, by halving."""
    low, high = -9.0, 9.0
    for _ in range(40):
        middle = (low + high) / 2
        if normal_share(middle) < share:
            low = middle
        else:
            high = middle
    return (low + high) / 2


@njit(cache=True)
def draw_speed(i, t, law, past, plan, rng):
    """Return a speed, its normal score, and what the effects made of the raw draw.

    The speed is ``scale`` times the raw draw plus ``shift``.
    """
    s, shares = plan.strength[i], law.speed[past.zone[t, i]]
    score = rng.normal(0.0, 1.0)
    if s[BURST_AND_COAST] > 0 and t > 0:
        r = s[BURST_AND_COAST]
        score = r * past.score[t - 1, i] + math.sqrt(1 - r * r) * score
    u, b = normal_share(score), 0
    while b < 9 and u > shares[b]:
        u -= shares[b]
        b += 1
    scale, shift = speed_factor(i, t, past, plan), 0.0
    if s[SPEED_MATCHING] > 0 and t > 0:
        scale *= 1 - s[SPEED_MATCHING]
        shift = s[SPEED_MATCHING] * pace_of_nearest(i, t, past)
    return scale * 0.02 * (b + min(1.0, u / shares[b])) + shift, score, scale, shift


@njit(cache=True)
def speed_bin(v):
    """Return the bin of a speed: below 2.5 mm/s, up to 2 cm/s, and every 2 cm/s from there."""
    if v < 0.02:
        return 0 if v < 0.0025 else 1
    return 1 + min(38, int(v / 0.02))


@njit(cache=True)
def share_below(v, i, t, scale, shift, law, past, plan):
    """Return the probability of a lower speed, given all that came before."""
    shares, raw = law.speed[past.zone[t, i]], (v - shift) / scale / 0.02
    below = 0.0
    for b in range(10):
        below += shares[b] * min(1.0, max(0.0, raw - b))
    r = plan.strength[i, BURST_AND_COAST]
    if r > 0 and t > 0 and 0 < below < 1:
        below = (normal_score(below) - r * past.score[t - 1, i]) / math.sqrt(1 - r * r)
        return normal_share(below)
    return below


@njit(cache=True)
def note_speed(i, t, scale, shift, law, past, plan):
    """Add the log probability of the bin that a speed is in.

    Of the bin, not of the speed: the edges of the speeds' histogram are sharp, and what
    an effect does to them could be seen by nobody.
    """
    b = speed_bin(past.speed[t, i])
    low = 0.0 if b == 0 else (0.0025 if b == 1 else 0.02 * (b - 1))
    high = 0.0025 if b == 0 else 0.02 * b
    mass = share_below(high, i, t, scale, shift, law, past, plan)
    mass -= share_below(low, i, t, scale, shift, law, past, plan)
    past.log_speed[t, i] += math.log(max(mass, 1e-4))


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
        v, score, scale, shift = draw_speed(i, t, law, past, plan, rng)
        if flees:
            v = 0.14 + 0.06 * rng.random()
        drawn, theta = draw_heading(i, t, v, world, law, past, plan, rng, cells)
        if drawn:
            past.log_speed[t, i], past.score[t, i] = chance, score
            kept = kept_in_turn(i, t, theta, v, world, past, plan)
            shift = kept * shift + go(i, t, theta, kept * v, world, past, plan)
            if flees:
                past.log_speed[t, i] -= math.log(3)  # one bin in three
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
