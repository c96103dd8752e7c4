"""Formulas that the hooks of several effects share; compiled into each of them."""

from __future__ import annotations

import math
from typing import Any

from zfcal.model.effects.base import Company
from zfcal.model.kernels.compiled import inlined
from zfcal.model.kernels.state import (
    EXIT,
    FOLLOWS,
    HX,
    HY,
    MOUTH_M,
    MOUTH_X,
    MOUTH_Y,
    TAU_X,
    TAU_Y,
    ZONE,
    X,
    Y,
)

SPEED_M_S = 0.07
"""A middling speed of a zebrafish: about where measured histograms have their mean."""

SLOWEST_M_S = 0.005
"""A lower speed counts as this one where a ratio of speeds is asked."""

MOST_TIMES = 3.0
"""An effect on speed at most so many times speeds up or slows down."""

RAD_PER_STRENGTH = 0.1
"""Where fish turn to something: by so much per strength, times the sine of the angle to it."""

_EDGE = 8.0
_SENSE = 3.0
_PER_SENSE = 1.0 / math.tanh(_SENSE)
_MOUTH_REACH_M = 0.1

Hooked = Any
"""A pointer to numbers, as hooks are given it."""


@inlined
def tilt(strength: float, cue: float, most: float) -> float:
    """Return ``exp(strength * cue)`` over its largest value, for a cue in [-most, most]."""
    return math.exp(strength * cue - abs(strength) * most)


@inlined
def beyond(value: float, limit: float) -> float:
    """Return a step from 0 to 1 at a limit, half of it at the limit itself.

    It rises from a tenth to nine tenths between 0.76 and 1.32 of the limit, so that a fit
    finds the limit by its slope.
    """
    ratio = (value / limit) ** _EDGE
    return ratio / (1.0 + ratio)


@inlined
def sense_along(cosine: float) -> float:
    """Return the sense of travel along a line from a heading's cosine with it, in [-1, 1].

    Nearly its sign: headings within 45 degrees of the line are all but the same.
    """
    # A hyperbolic tangent, several times as fast as that of the mathematical library.
    return _PER_SENSE * (2.0 / (1.0 + math.exp(-2.0 * _SENSE * cosine)) - 1.0)


@inlined
def leftward(state: Hooked, n: int, i: int, ux: float, uy: float, along_walls: float) -> float:
    """Return how far a heading is to the left of where the base law has it, in [-1, 1].

    Parameters
    ----------
    along_walls
        0: to the left of the present heading everywhere. 1: where fish follow walls, to
        the left of the nearer sense along the wall.
    """
    if along_walls > 0.0 and state[FOLLOWS * n + i] > 0.0:
        tau_x, tau_y = state[TAU_X * n + i], state[TAU_Y * n + i]
        return 2.0 * (tau_x * uy - tau_y * ux) * (tau_x * ux + tau_y * uy)
    hx, hy = state[HX * n + i], state[HY * n + i]
    return hx * uy - hy * ux


@inlined
def turn_to(state: Hooked, n: int, i: int, x: float, y: float) -> float:
    """Return the sine of the angle from the heading to a unit vector; 0 along walls."""
    return 0.0 if state[FOLLOWS * n + i] > 0.0 else sine_to(state, n, i, x, y)


@inlined
def sine_to(state: Hooked, n: int, i: int, x: float, y: float) -> float:
    """Return the sine of the angle from the heading to a unit vector, along walls too."""
    return float(state[HX * n + i] * y - state[HY * n + i] * x)


@inlined
def of_base(turning: float) -> bool:
    """Return whether the base's directions turn, but not those to neighbours."""
    return 0.0 < turning <= 1.0


@inlined
def mouth_is_near(state: Hooked, n: int, i: int) -> bool:
    """Tell whether a step of an agent could lead out of its room."""
    return state[MOUTH_M * n + i] < _MOUTH_REACH_M


@inlined
def way_out(
    state: Hooked, n: int, i: int, move: tuple[float, float, int], heading_share: float
) -> float:
    """Return how much a move is one out of the agent's room, in [-1, 1].

    Parameters
    ----------
    move
        Unit vector x and y of the heading, and the landing zone.
    heading_share
        Share of the cosine with the direction of the mouth; the rest is 1 for a step
        that ends in the zone between the rooms, -1 for one that could and does not.
    """
    ux, uy, landing = move
    cosine = ux * state[MOUTH_X * n + i] + uy * state[MOUTH_Y * n + i]
    crossing = 0.0
    if mouth_is_near(state, n, i):
        crossing = 1.0 if landing == state[EXIT * n + i] else -1.0
    return heading_share * cosine + (1.0 - heading_share) * crossing


@inlined
def apart(state: Hooked, n: int, i: int, j: int) -> float:
    """Return the distance between two agents, in metres."""
    dx, dy = state[X * n + j] - state[X * n + i], state[Y * n + j] - state[Y * n + i]
    return math.sqrt(dx * dx + dy * dy)


@inlined
def cut(value: float, low: float, high: float) -> float:
    """Return a value within limits."""
    return min(high, max(low, value))


@inlined
def times_faster(exponent: float) -> float:
    """Return ``exp(exponent)`` within a third and three."""
    return cut(math.exp(cut(exponent, -10.0, 10.0)), 1.0 / MOST_TIMES, MOST_TIMES)


@inlined
def log_speed(speed_m_s: float, usual_m_s: float) -> float:
    """Return the logarithm of a speed over the usual one; the slowest count as 5 mm/s."""
    return math.log(max(speed_m_s, SLOWEST_M_S) / usual_m_s)


@inlined
def quickness(speed_m_s: float) -> float:
    """Return how far a speed is from 0.07 m/s, in units of 0.05 m/s, in [-1.4, 2]; 0 if unknown."""
    if not speed_m_s >= 0.0:
        return 0.0
    return cut((speed_m_s - SPEED_M_S) / 0.05, -1.4, 2.0)


@inlined
def nearest_seen(state: Hooked, sight: Hooked, n: int, i: int) -> int:
    """Return the nearest agent that agent i sees, -1 if it sees none."""
    found, least = -1, math.inf
    for j in range(n):
        if sight[i * n + j] > 0.0:
            away = apart(state, n, i, j)
            if away < least:
                found, least = j, away
    return found


@inlined
def seen_by_rank(state: Hooked, sight: Hooked, n: int, i: int, rank: float) -> int:
    """Return who is so many-th nearest, from one on, of those that agent i sees; -1 for nobody."""
    found, last, last_j = -1, -1.0, -1
    if rank >= n:  # There are not so many others, whoever is in sight.
        return -1
    for _ in range(int(rank)):
        found, least = -1, math.inf
        for j in range(n):
            if sight[i * n + j] > 0.0:
                away = apart(state, n, i, j)
                after = away > last or (away == last and j > last_j)
                if after and away < least:
                    found, least = j, away
        if found < 0:
            return -1
        last, last_j = least, found
    return found


@inlined
def nearest_agent(state: Hooked, n: int, i: int) -> int:
    """Return the nearest other agent, seen or not; -1 for nobody."""
    found, least = -1, math.inf
    for j in range(n):
        if j != i and state[ZONE * n + j] > 0.0:
            away = apart(state, n, i, j)
            if away < least:
                found, least = j, away
    return found


@inlined
def foremost_agent(state: Hooked, n: int, i: int, reach_m: float) -> int:
    """Return who is most straight ahead, seen or not; -1 if that one is farther, or behind."""
    found, most = -1, 0.0
    for j in range(n):
        if j != i and state[ZONE * n + j] > 0.0:
            x, y = state[X * n + j] - state[X * n + i], state[Y * n + j] - state[Y * n + i]
            ahead = state[HX * n + i] * x + state[HY * n + i] * y
            cosine = ahead / max(math.hypot(x, y), 1e-9)
            if cosine > most:
                found, most = j, cosine
    return found if found >= 0 and apart(state, n, i, found) < reach_m else -1


def needs_neighbour(company: Company) -> str | None:
    """Return what a recording lacks for an effect between neighbours."""
    return None if company.n_fish + company.n_robots > 1 else "a neighbour"
