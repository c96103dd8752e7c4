"""Many small groups abreast: one step of all of them, phase by phase.

A processor that waits for one agent's random choice, and guesses wrongly what
follows from it, loses more time than the choice itself takes. So here all agents
of many simulations take each phase of a step together: what they see, their
speeds, then headings, round by round, for those that have none yet. The law is
that of `zfcal.model.kernels.heading`, which also decides the rare cases.

Agent i of lane m (one lane is one simulation) has the slot ``i * lanes + m``.
Its random numbers depend on its key, the step and the draw alone, so a
simulation gives the same whatever lanes stand beside it.

Solid angles and weights are in single precision: a relative error below 1e-5,
much less than what a neighbour's measured outline is worth.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zfcal.model.compiled import inlined, kernel, lean
from zfcal.model.geometry import ASK, FINE, Tank, zone_exact
from zfcal.model.kernels.heading import (
    REDRAWS,
    REJECTIONS,
    draw_exact,
    draw_from_grid,
    draw_speed,
    gather,
    stay,
)
from zfcal.model.kernels.perception import HEIGHT_M, LENGTH_M, REPULSION_M, WIDTH_M, Sight
from zfcal.model.kernels.random import seeded, sine, word_at
from zfcal.model.kernels.staircase import COLUMNS, HEIGHT, OTHER, ROWS, STEPS, TAKE
from zfcal.model.kernels.world import (
    ALPHA,
    HX,
    HY,
    KAPPA_BASE,
    KAPPA_F,
    LAWS,
    ZONE,
    ZONE_COLUMNS,
    Packed,
    Work,
    X,
    Y,
    look,
    settle,
)

_TO_UNIT = 1.0 / (1 << 53)
_TO_UNIT_32 = 1.0 / (1 << 32)
_LOW = np.uint64(0xFFFFFFFF)

# Random words of an agent's step: two for the speed, three for each draw, one seed for the rest.
_PER_STEP = 1024
_SPEED_WORDS = 2
_DRAW_WORDS = 3
_SEED_WORD = 1000

# Where laws and their rows are in the flat tables of turns.
_LAW = ROWS * COLUMNS
_ZONE_LAWS = LAWS * _LAW

_REPULSION_M2 = REPULSION_M**2
_NOWHERE_M2 = 1e-200

# Columns of what a draw asks of a slot: place, direction of the base law, metres to go, the
# largest attraction within reach, the mixture's weight, and 2 where the base has two directions.
_X, _Y, _BASE_X, _BASE_Y, _REACH, _BEST, _TOTAL, _FLIP, _ASKED = range(9)

_SINGLE = np.float32
_BACK, _TAIL = _SINGLE(LENGTH_M / 3.0), _SINGLE(LENGTH_M - LENGTH_M / 3.0)
_OUT, _UP = _SINGLE(WIDTH_M / 2.0), _SINGLE(HEIGHT_M / 2.0)
_UP2 = _SINGLE((HEIGHT_M / 2.0) ** 2)
_ZERO, _ONE, _FOUR, _TINY = _SINGLE(0.0), _SINGLE(1.0), _SINGLE(4.0), _SINGLE(1e-30)
_PI, _HALF_PI = _SINGLE(math.pi), _SINGLE(math.pi / 2.0)

# Arc tangent on [0, 1], error below 2e-8 (Abramowitz and Stegun 1964, 4.4.49).
_T1, _T2, _T3, _T4 = (
    _SINGLE(-0.3333314528), _SINGLE(0.1999355085), _SINGLE(-0.1420889944), _SINGLE(0.1065626393),
)  # fmt: skip
_T5, _T6, _T7, _T8 = (
    _SINGLE(-0.0752896400), _SINGLE(0.0429096138), _SINGLE(-0.0161657367), _SINGLE(0.0028662257),
)  # fmt: skip

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Words = NDArray[np.uint64]


class Flock(NamedTuple):
    """Agents of all lanes, and room for their step; by slot unless said otherwise.

    Attributes
    ----------
    x, y : ndarray, shape (2 * slot,)
        Metres; twice, so that slot ``s + d * lanes`` is the d-th next agent of s.
    sx, sy, shx, shy : ndarray of float32, shape (2 * slot,)
        Place and heading in single precision, likewise twice.
    hx, hy, tau_x, tau_y
        Unit vectors of the heading and along the wall.
    wall, speed
        Metres to the wall; m/s of the step that led here.
    zone, before, model : ndarray of int64
        Zone ids now and before the step; which model drives it.
    key : ndarray of uint64
        Of the random numbers.
    cos_fov, alpha : ndarray of float32
    weight : ndarray of float32, shape (agent, slot)
        Row d: of the next agent but d, in the mixture; the base has one.
    total : ndarray of float32
        Sum of these.
    asked : ndarray, shape (slot * 8,)
        What a draw asks, at one place in memory.
    tables : ndarray of int64, shape (slot * 2,)
        Where the zone's laws and attractions start in the flat tables.
    to_x, to_y, to_hx, to_hy, to_zone
        After the step.
    pending, column : ndarray of int64
        Slots without a heading; bins to be counted.
    """

    x: Floats
    y: Floats
    sx: Singles
    sy: Singles
    shx: Singles
    shy: Singles
    hx: Floats
    hy: Floats
    tau_x: Floats
    tau_y: Floats
    wall: Floats
    speed: Floats
    zone: Ints
    before: Ints
    model: Ints
    key: Words
    cos_fov: Singles
    alpha: Singles
    weight: Singles
    total: Singles
    asked: Floats
    tables: Ints
    to_x: Floats
    to_y: Floats
    to_hx: Floats
    to_hy: Floats
    to_zone: Ints
    pending: Ints
    column: Ints


@kernel
def make_flock(n: int, lanes: int) -> Flock:
    """Return room for so many agents in each of so many lanes.

    There are more slots than agents: what is left beside whole vectors costs far more,
    and might be rounded otherwise.
    """
    z = (n * lanes + 31) // 32 * 32
    single = np.float32
    return Flock(
        np.zeros(2 * z), np.zeros(2 * z), np.zeros(2 * z, single), np.zeros(2 * z, single),
        np.zeros(2 * z, single), np.zeros(2 * z, single), np.zeros(z), np.zeros(z), np.zeros(z),
        np.zeros(z), np.zeros(z), np.zeros(z), np.zeros(z, np.int64), np.zeros(z, np.int64),
        np.zeros(z, np.int64), np.zeros(z, np.uint64), np.zeros(z, single), np.zeros(z, single),
        np.zeros(n * z, single), np.zeros(z, single), np.zeros(_ASKED * z),
        np.zeros(2 * z, np.int64), np.zeros(z), np.zeros(z), np.zeros(z),
        np.zeros(z), np.zeros(z, np.int64), np.zeros(z, np.int64), np.zeros(z, np.int64),
    )  # fmt: skip


@lean
def repeat(size: int, flock: Flock) -> None:
    """Write places and headings in single precision, and what stands twice."""
    x, y, sx, sy, shx, shy = flock.x, flock.y, flock.sx, flock.sy, flock.shx, flock.shy
    # One array is written in each loop: with more the compiler gives up on vectors.
    for s in range(size):
        x[size + s] = x[s]
    for s in range(size):
        y[size + s] = y[s]
    for s in range(2 * size):
        sx[s] = x[s]
    for s in range(2 * size):
        sy[s] = y[s]
    for s in range(size):
        shx[s] = flock.hx[s]
    for s in range(size):
        shy[s] = flock.hy[s]
    for s in range(size):
        shx[size + s] = shx[s]
    for s in range(size):
        shy[size + s] = shy[s]


@lean
def find_tables(size: int, flock: Flock, packed: Packed) -> None:
    """Write where each slot finds what belongs to its model and zone."""
    zones, table = packed.zones.shape[1], packed.zones.reshape(-1)
    for s in range(size):
        at = flock.model[s] * zones + flock.zone[s]
        flock.alpha[s] = table[np.uintp(ZONE_COLUMNS * at + ALPHA)]
        flock.tables[2 * s] = at * _ZONE_LAWS
        flock.tables[2 * s + 1] = at * zones


@lean
def observe(n: int, lanes: int, flock: Flock) -> None:
    """Write the weights of the neighbours in each agent's mixture, and their sum."""
    slots = flock.zone.size
    total, sx, sy, shx, shy = flock.total, flock.sx, flock.sy, flock.shx, flock.shy
    for s in range(slots):
        total[s] = _ZERO
    for d in range(1, n):
        other, weight = d * lanes, flock.weight[(d - 1) * slots : d * slots]
        _weigh(
            slots, (sx[other:], sy[other:], shx[other:], shy[other:]), (sx, sy, shx, shy),
            flock.alpha, flock.cos_fov, weight,
        )  # fmt: skip
        for s in range(slots):
            total[s] += weight[s]


@lean
def _weigh(
    slots: int, others: tuple[Singles, Singles, Singles, Singles],
    own: tuple[Singles, Singles, Singles, Singles], alpha: Singles, cos_fov: Singles,
    weight: Singles,
) -> None:  # fmt: skip
    """Write solid angle times alpha; the angle is that of `perception.see_first`.

    All is set in the frame of the other's body, where its corners are at known
    places. The triangles span directions, so the two corners that are farthest
    apart in azimuth serve as unit vectors.
    """
    ox, oy, ohx, ohy = others
    x, y, hx, hy = own
    for s in range(slots):
        dx, dy = ox[s] - x[s], oy[s] - y[s]
        along, across = dx * ohx[s] + dy * ohy[s], dy * ohx[s] - dx * ohy[s]
        top = along - _BACK
        end, left, right = top - _TAIL, across + _OUT, across - _OUT
        across2, top2 = across * across, top * top
        away = math.sqrt(along * along + across2)
        per = _ONE / (away + _TINY)
        u0, v0 = along * per, across * per
        per = _ONE / (math.sqrt(end * end + across2) + _TINY)
        u1, v1 = end * per, across * per
        per = _ONE / (math.sqrt(top2 + left * left) + _TINY)
        u2, v2 = top * per, left * per
        per = _ONE / (math.sqrt(top2 + right * right) + _TINY)
        u3, v3 = top * per, right * per
        best, au, av, bu, bv = u0 * u1 + v0 * v1, u0, v0, u1, v1
        cosine = u0 * u2 + v0 * v2
        wider = cosine < best
        best, bu, bv = cosine if wider else best, u2 if wider else bu, v2 if wider else bv
        cosine = u0 * u3 + v0 * v3
        wider = cosine < best
        best, bu, bv = cosine if wider else best, u3 if wider else bu, v3 if wider else bv
        cosine = u1 * u2 + v1 * v2
        wider = cosine < best
        best, bu, bv = cosine if wider else best, u2 if wider else bu, v2 if wider else bv
        au, av = u1 if wider else au, v1 if wider else av
        cosine = u1 * u3 + v1 * v3
        wider = cosine < best
        best, bu, bv = cosine if wider else best, u3 if wider else bu, v3 if wider else bv
        au, av = u1 if wider else au, v1 if wider else av
        cosine = u2 * u3 + v2 * v3
        wider = cosine < best
        best, bu, bv = cosine if wider else best, u3 if wider else bu, v3 if wider else bv
        au, av = u2 if wider else au, v2 if wider else av
        tip = math.sqrt(top2 + across2 + _UP2)
        above = _UP * abs(au * bv - av * bu)
        below = tip + tip * best + (au + bu) * top + (av + bv) * across
        # The arc tangent of their quotient, from 0 to pi, without a branch.
        flat = abs(below)
        q = min(above, flat) / max(above, flat, _TINY)
        t = q * q
        turn = _T4 + t * (_T5 + t * (_T6 + t * (_T7 + t * _T8)))
        turn = q * (_ONE + t * (_T1 + t * (_T2 + t * (_T3 + t * turn))))
        turn = _HALF_PI - turn if above > flat else turn
        turn = _PI - turn if below < _ZERO else turn
        seen = (dx * hx[s] + dy * hy[s] >= away * cos_fov[s]) & (away > _ZERO)
        weight[s] = _FOUR * turn * alpha[s] if seen else _ZERO


@lean
def draw_speeds(step: int, size: int, flock: Flock, packed: Packed, tank: Tank) -> None:
    """Draw all speeds, and gather what draws of the heading ask."""
    gamma, near_m = packed.gamma.reshape(-1), tank.near_m.reshape(-1)
    take, other = packed.speed_take.reshape(-1), packed.speed_other.reshape(-1)
    zones, columns = packed.zones.shape[1], tank.cells.shape[1]
    bins = packed.speed_take.shape[2]
    bin_m_s = (tank.speed_high - tank.speed_low) / bins
    asked, count = flock.asked, step * _PER_STEP
    for s in range(size):
        zone, gain, key = flock.zone[s], flock.tables[2 * s + 1], flock.key[s]
        place = bins * _TO_UNIT * (word_at(key, count) >> np.uint64(11))
        column = int(place)
        at = np.uintp(bins * (flock.model[s] * zones + zone) + column)
        # By arithmetic: a branch on what is random would be foreseen by no processor.
        column += (other[at] - column) * (place - column >= take[at])
        share = _TO_UNIT * (word_at(key, count + 1) >> np.uint64(11))
        speed = tank.speed_low + bin_m_s * (column + share)
        reach = speed * packed.dt_s
        x, y = flock.x[s], flock.y[s]
        at = int((y - tank.y0_m) * tank.per_m) * columns + int((x - tank.x0_m) * tank.per_m)
        best = 0.0
        for z in range(1, zones):
            value = gamma[np.uintp(gain + z)]
            best = max(best, value if near_m[np.uintp(zones * at + z)] <= reach else 0.0)
        follows = tank.follows[np.uintp(zone)]
        flock.speed[s] = speed
        r = _ASKED * s
        asked[r + _X], asked[r + _Y] = x, y
        asked[r + _BASE_X] = flock.tau_x[s] if follows else flock.hx[s]
        asked[r + _BASE_Y] = flock.tau_y[s] if follows else flock.hy[s]
        asked[r + _REACH], asked[r + _BEST] = reach, best
        asked[r + _TOTAL] = 1.0 + flock.total[s]
        asked[r + _FLIP] = 2.0 if follows else 0.0


@inlined
def _centre(
    s: int, words: tuple[np.uint64, np.uint64], n: int, lanes: int, flock: Flock
) -> tuple[float, float, int]:
    """Draw a component; return its unit vector, and 1 if it is a neighbour's, 0 if the base's."""
    asked, slots, r = flock.asked, flock.zone.size, np.uintp(_ASKED * s)
    level = (words[0] >> np.uint64(32)) * _TO_UNIT_32 * asked[r + np.uintp(_TOTAL)] - 1.0
    part = 0
    for k in range(n - 1):
        part += level >= 0.0
        level -= flock.weight[np.uintp(k * slots + s)]
    social = min(part, 1)
    # The offset of an agent to itself is zero: the base's direction is added without a branch.
    at, base = np.uintp(s + part * lanes), 1.0 - social
    dx = flock.x[at] - asked[r + np.uintp(_X)] + base * asked[r + np.uintp(_BASE_X)]
    dy = flock.y[at] - asked[r + np.uintp(_Y)] + base * asked[r + np.uintp(_BASE_Y)]
    away2 = dx * dx + dy * dy
    side = 1.0 if away2 >= _REPULSION_M2 else -1.0
    side -= base * asked[r + np.uintp(_FLIP)] * (words[1] & np.uint64(1))
    side /= math.sqrt(max(away2, _NOWHERE_M2))
    return side * dx, side * dy, social


@inlined
def _turn(
    law: int, kappa_at: int, words: tuple[np.uint64, np.uint64], packed: Packed
) -> tuple[float, float, bool]:
    """Return cosine and sine of a turn under the staircase, and whether it is accepted.

    As `staircase.staircase_turn`, a single time.
    """
    turns = packed.turns.reshape(-1)
    width = turns[np.uintp(law + HEIGHT * COLUMNS + STEPS + 1)]
    place = (STEPS + 1) * _TO_UNIT * (words[0] >> np.uint64(11))
    step = int(place)
    other = int(turns[np.uintp(law + OTHER * COLUMNS + step)])
    step += (other - step) * (place - step >= turns[np.uintp(law + TAKE * COLUMNS + step)])
    height = turns[np.uintp(law + step)]
    wide, below = width, turns[np.uintp(law + step + 1)]
    if step == STEPS:
        wide, below = math.pi - STEPS * width, 0.0
    share = (words[1] >> np.uint64(32)) * _TO_UNIT_32
    half = sine(0.5 * (step * width + wide * share))
    cosine = 1.0 - 2.0 * half * half
    level = height * ((words[1] & _LOW) * _TO_UNIT_32)
    good = level < below
    if not good:
        kappa = packed.zones.reshape(-1)[np.uintp(kappa_at)]
        good = level < math.exp(kappa * (cosine - 1.0))
    side = 2.0 * half * math.sqrt(max(0.0, 1.0 - half * half))
    return cosine, -side if words[0] & np.uint64(2) else side, good


@inlined
def _land(x: float, y: float, tank: Tank) -> int:
    """Return the zone id of a place, as `geometry.zone_of` does."""
    rows, columns = tank.cells.shape
    u, v = (x - tank.x0_m) * tank.per_m, (y - tank.y0_m) * tank.per_m
    within = (u >= 0.0) & (u < columns) & (v >= 0.0) & (v < rows)
    row, column = int(min(max(v, 0.0), rows - 1.0)), int(min(max(u, 0.0), columns - 1.0))
    at = np.uintp(row * columns + column)
    zone = int(tank.cells.reshape(-1)[at]) * within
    if zone == ASK:
        part = int(FINE * (v - row)) * FINE + int(FINE * (u - column))
        zone = int(tank.fine[np.uintp(tank.fine_at.reshape(-1)[at] + part)])
        if zone == ASK:
            zone = zone_exact(x, y, tank)
    return zone


@inlined
def _draw(
    s: int, count: int, sizes: tuple[int, int], flock: Flock, packed: Packed, tank: Tank
) -> tuple[float, float, float, float, int, bool]:
    """Draw once for a slot: place x, y, heading x, y, zone, and whether it is accepted."""
    asked, tables, r, key = flock.asked, flock.tables, np.uintp(_ASKED * s), flock.key[np.uintp(s)]
    first, second, third = word_at(key, count), word_at(key, count + 1), word_at(key, count + 2)
    cx, cy, social = _centre(s, (first, second), sizes[0], sizes[1], flock)
    law = tables[np.uintp(2 * s)]
    kappa_at = ZONE_COLUMNS * (law // _ZONE_LAWS) + KAPPA_BASE + (KAPPA_F - KAPPA_BASE) * social
    cosine, side, good = _turn(law + _LAW * social, kappa_at, (second, third), packed)
    hx, hy = cx * cosine - cy * side, cx * side + cy * cosine
    reach = asked[r + np.uintp(_REACH)]
    x, y = asked[r + np.uintp(_X)] + reach * hx, asked[r + np.uintp(_Y)] + reach * hy
    zone = _land(x, y, tank)
    level = (first & _LOW) * _TO_UNIT_32 * asked[r + np.uintp(_BEST)]
    attraction = packed.gamma.reshape(-1)[np.uintp(tables[np.uintp(2 * s + 1)] + zone)]
    return x, y, hx, hy, zone, good & (level < attraction)


@lean
def draw_headings(
    step: int, sizes: tuple[int, int], flock: Flock, packed: Packed, tank: Tank
) -> int:
    """Draw until all have a heading, or 200 times; return how many are left in ``pending``.

    Those that have nowhere to go at their speed are not among them.
    """
    pending, found = flock.pending, 0
    to_x, to_y, to_hx, to_hy = flock.to_x, flock.to_y, flock.to_hx, flock.to_hy
    for s in range(sizes[0] * sizes[1]):
        pending[found] = s
        found += flock.asked[_ASKED * s + _BEST] > 0.0
    count = step * _PER_STEP + _SPEED_WORDS
    for k in range(REJECTIONS):
        left = 0
        for p in range(found):
            s = pending[p]
            x, y, hx, hy, zone, good = _draw(s, count + _DRAW_WORDS * k, sizes, flock, packed, tank)
            # What is rejected is written over by the next draw.
            at = np.uintp(s)
            to_x[at], to_y[at], to_hx[at], to_hy[at] = x, y, hx, hy
            flock.to_zone[at] = zone
            pending[left] = s
            left += 1 - good
        found = left
        if found == 0:
            break
    return found


@lean
def nowhere(size: int, flock: Flock) -> int:
    """Write those into ``pending`` that have nowhere to go at their speed; return how many."""
    found = 0
    for s in range(size):
        flock.pending[found] = s
        found += flock.asked[_ASKED * s + _BEST] == 0.0
    return found


@kernel
def decide_alone(
    step: int, s: int, rejected: bool, sizes: tuple[int, int], flock: Flock, packed: Packed,
    tank: Tank, state: Floats, sight: Sight, work: Work,
) -> None:  # fmt: skip
    """Let one agent decide as `heading.draw_move` does, from its first speed on.

    Parameters
    ----------
    rejected
        Its draws were rejected: the grid decides first. Else it has nowhere to go
        at the speed that it has.
    """
    n, lanes = sizes
    i, model = s // lanes, flock.model[s]
    for j in range(n):
        other = j * lanes + s % lanes
        state[X, j], state[Y, j] = flock.x[other], flock.y[other]
        state[HX, j], state[HY, j] = flock.hx[other], flock.hy[other]
        state[ZONE, j] = flock.zone[other]
    settle(i, state, tank)
    look(state, model, packed, sight)
    random = seeded(word_at(flock.key[s], step * _PER_STEP + _SEED_WORD))
    parts, total = gather(i, state, model, packed, sight, work)
    work.moves[i, 3] = flock.speed[s]
    drawn = False
    if rejected:
        drawn = draw_from_grid(i, flock.speed[s], state, model, packed, tank, sight, random, work)
    for _ in range(REDRAWS):
        if drawn:
            break
        speed = draw_speed(i, state, model, packed, tank, random)
        work.moves[i, 3] = speed
        drawn = draw_exact(i, speed, state, model, packed, tank, sight, random, work, parts, total)
    if not drawn:
        stay(i, state, work)
    flock.speed[s] = work.moves[i, 3]
    flock.to_hx[s], flock.to_hy[s] = work.moves[i, 0], work.moves[i, 1]
    flock.to_zone[s] = int(work.moves[i, 2])
    flock.to_x[s] = flock.x[s] + flock.speed[s] * packed.dt_s * work.moves[i, 0]
    flock.to_y[s] = flock.y[s] + flock.speed[s] * packed.dt_s * work.moves[i, 1]
