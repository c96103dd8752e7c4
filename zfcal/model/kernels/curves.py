"""Effects whose strength goes by a cue, such as the time or the distance to the nearest.

A curve is a table of an effect's parameters at so many levels of its cue. The functions of effects
know nothing of it: at each call they are handed the row of their level.
"""

from __future__ import annotations

import math

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.state import (
    HX,
    HY,
    NEVER_S,
    PAST_HX,
    PAST_HY,
    SPEED,
    TIME,
    ZONE,
    Packed,
    X,
    Y,
)

# What a strength goes by; the last two are of the neighbour that is attended to.
NOTHING, BY_TIME, BY_SPEED, BY_TURN, BY_NEAREST, BY_NUMBER, BY_ZONE, BY_DISTANCE, BY_BEARING = (
    range(9)
)
LAST_CUE = BY_BEARING

# Columns of a curve: the cue, its first row of ``effects``, and its knots.
CUE, FIRST, KNOT, CURVE_COLUMNS = 0, 1, 2, 5

BETWEEN = 16
"""Levels from one knot to the next."""

LEVELS = 2 * BETWEEN + 1


@kernel
def nearest_other(state: Floats, i: int) -> int:
    """Return the nearest other agent, seen or not; -1 for nobody."""
    found, least = -1, NEVER_S
    for k in range(state.shape[1]):
        if k != i and state[ZONE, k] > 0.0:
            away = math.hypot(state[X, k] - state[X, i], state[Y, k] - state[Y, i])
            if away < least:
                found, least = k, away
    return found


@kernel
def cue_of(cue: int, state: Floats, sight: Floats, i: int, j: int) -> float:
    """Return what a strength goes by, of agent i.

    Parameters
    ----------
    state : ndarray, shape (row, agent)
    sight : ndarray, shape (agent * agent,)
        Solid angles.
    j
        The neighbour that is attended to; -1 for the nearest.
    """
    n = state.shape[1]
    if cue == BY_TIME:
        return state[TIME, i]
    if cue == BY_SPEED:
        return state[SPEED, i]
    if cue == BY_ZONE:
        return state[ZONE, i]
    if cue == BY_TURN:
        x, y = state[HX, i], state[HY, i]
        return _apart(state[PAST_HX, i], state[PAST_HY, i], x, y)
    if cue == BY_NUMBER:
        seen = 0.0
        for k in range(n):
            if k != i and sight[i * n + k] > 0.0:
                seen += 1.0
        return seen
    if j < 0 or cue == BY_NEAREST:
        j = nearest_other(state, i)
    if j < 0:
        return NEVER_S
    dx, dy = state[X, j] - state[X, i], state[Y, j] - state[Y, i]
    if cue == BY_BEARING:
        return _apart(state[HX, i], state[HY, i], dx, dy)
    return math.hypot(dx, dy)


@inlined
def _apart(x: float, y: float, to_x: float, to_y: float) -> float:
    """Return the angle between two vectors, from 0 to pi."""
    return abs(math.atan2(x * to_y - y * to_x, x * to_x + y * to_y))


@inlined
def level_of(value: float, low: float, middle: float, high: float) -> int:
    """Return the nearest level of a cue between its knots; beyond them it is at the last one."""
    if value < middle:
        share = (value - low) / (middle - low)
    else:
        share = 1.0 + (value - middle) / (high - middle)
    return math.floor(BETWEEN * min(2.0, max(0.0, share)) + 0.5)


@inlined
def parameters_at(
    packed: Packed, model: int, row: int, state: Floats, sight: Floats, i: int, j: int
) -> int:
    """Return the address of an effect's parameters, by its curve if it has one.

    Parameters
    ----------
    row
        Of ``packed.effects``.
    state, sight
        As `cue_of` takes them.
    i, j
        The agent, and the neighbour that is attended to; -1 for none.
    """
    if packed.curves.shape[1] > 0:
        curve = packed.curves[model, row]
        if curve[CUE] > 0.0:
            value = cue_of(int(curve[CUE]), state, sight, i, j)
            level = level_of(value, curve[KNOT], curve[KNOT + 1], curve[KNOT + 2])
            row = int(curve[FIRST]) + level
    return packed.effects[model, row].ctypes.data
