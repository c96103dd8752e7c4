"""What the kernels work on: the packed models, the agents, and what they see."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.curves import (
    BY_BEARING,
    BY_DISTANCE,
    BY_NEAREST,
    BY_NUMBER,
    BY_SPEED,
    BY_TIME,
    BY_TURN,
    BY_ZONE,
    CUE,
    FIRST,
    KNOT,
    level_of,
)

# Rows of the state, each with a number per agent; what effects may ask stands below.
X, Y, HX, HY, SPEED, ZONE, WALL, TAU_X, TAU_Y, TIME, CLEAR = range(11)
PAST_HX, PAST_HY, KIND, TRAIT, FOLLOWS = range(11, 16)
ROOM, MOUTH_X, MOUTH_Y, MOUTH_M, LEFT_S, LEFT_AT_S, LEFT_FROM = range(16, 23)
EXIT, DT_S, LATELY, STATES = range(23, 27)
"""State of an agent; rows from PAST_HX on are kept only where a model has effects.

X, Y: metres. HX, HY: unit vector of the heading. SPEED: m/s of the step that led here.
ZONE: id; 0 for an agent that is not there. WALL: metres to the wall; TAU: unit vector
along it. TIME: seconds since the trial's start. CLEAR: metres to the nearest border.
PAST_H: the heading one step ago. KIND: 0 fish, 1 robot. TRAIT: what is lasting about an
individual, with mean 0 and standard deviation 1 over a group. FOLLOWS: 1 where the zone
follows walls. ROOM: its number, 0 between rooms and in an arena without. MOUTH: unit
vector toward the room's way out, and metres to it. LEFT_S: seconds since another agent
that is still away left this room. LEFT_AT_S, LEFT_FROM: when this agent last left a
room, and which. EXIT: id of the zone between the rooms, 0 in an arena without. DT_S: the
step, in seconds. LATELY: mean of the speeds, which fades over two seconds, in m/s; 0 where
none is known.
"""

NEVER_S = 1e9
LAG_MAX = 10
"""Steps by which a response can lag."""

# Columns of a zone's parameters.
KAPPA_BASE, KAPPA_F, ALPHA, ZONE_COLUMNS = range(4)

# What is late of what agents see: which share; beyond which distance; whether who is seen, and
# how large, is late too, or the direction alone; whether it is seen from where the agent itself
# was; and whether the direction away from who is too near is late as well.
LATE_SHARE, LATE_FELT_M, LATE_WHOLE, LATE_PART, LATE_THEN, LATE_NEAR, LATE_COLUMNS = range(7)

# Laws of a zone's tables of von Mises draws.
LAW_BASE, LAW_F, LAWS = range(3)


TABLE = 0.0
"""In place of a sampler's constant: the zone's own table serves."""

GRID = 360
"""Angles of the numeric density, -pi to pi, unless asked otherwise."""


SECTORS = 32
"""Of the circle, for headings that draws from the mixture hardly ever hit."""
SECTOR_ROWS = 3


class Packed(NamedTuple):
    """A population of models in arrays; zone ids index the second axis, 0 is void.

    Attributes
    ----------
    zones : ndarray, shape (model, zone + 1, 3)
        Columns KAPPA_BASE, KAPPA_F, ALPHA.
    turns : ndarray, shape (model, zone + 1, 2, 3, 66)
        Tables of `zfcal.model.kernels.staircase` for LAW_BASE and LAW_F.
    gamma : ndarray, shape (model, zone + 1, zone + 1)
        Rows scaled to a maximum of one; attraction to void is zero.
    speed_take, speed_other : ndarray, shape (model, zone + 1, bin)
        Alias tables (Walker 1977) of the speed histograms.
    cos_fov : ndarray, shape (model,)
    dt_s
        The step, the same for all.
    lags : ndarray of int64, shape (model,)
        Steps by which agents respond late, the begun one counted: others are seen where they were.
    lates : ndarray, shape (model, LATE_COLUMNS)
        Columns LATE_SHARE, LATE_FELT_M (m), LATE_WHOLE, LATE_PART, the share of the begun step,
        LATE_THEN and LATE_NEAR.
    clock_s : ndarray, shape (2,)
        Time of the trial at the first sample, and seconds of the trial in a second
        that is simulated; for effects that change over a trial.
    components, factors, speeds, sights, rotations, whole_rotations : ndarray of int64, \
shape (hook, 2)
        Address of an effect's function and its row of ``effects``.
    effects : ndarray, shape (model, effect, 8)
        Parameters of the effects; further rows are those of levels of a curve.
    curves : ndarray, shape (model, effect, 5), or (model, 0, 5) without any
        By what the strength of an effect goes: see `zfcal.model.kernels.curves`.
    """

    zones: Floats
    turns: Floats
    gamma: Floats
    speed_take: Floats
    speed_other: Ints
    cos_fov: Floats
    dt_s: float
    lags: Ints
    lates: Floats
    clock_s: Floats
    components: Ints
    factors: Ints
    speeds: Ints
    sights: Ints
    rotations: Ints
    whole_rotations: Ints
    effects: Floats
    curves: Floats


@inlined
def has_effects(packed: Packed) -> bool:
    """Tell whether the models have effects, which may ask what each agent sees."""
    return packed.effects.shape[1] > 0


class Work(NamedTuple):
    """Room for one step, made once: nothing is allocated in the loop.

    Attributes
    ----------
    moves : ndarray, shape (agent, 4)
        Unit vector x and y of the next heading, landing zone, speed.
    parts : ndarray, shape (2 agents + components, 5)
        The heading mixture of one agent.
    zones : ndarray, shape (agent,)
        Zone ids before the step.
    grid_x, grid_y, values, density : ndarray, shape (angle + 1,)
        Unit vectors of the grid's angles, and densities on it.
    past : ndarray, shape (LAG_MAX + 2, 4, agent)
        Where all were at former steps, see `look_back`; the last row is for between two of them.
    steps : ndarray, shape (1,)
        Steps done since the start, for models that respond late.
    spin : ndarray, shape (2,)
        Cosine and sine of the angle by which effects turn an agent's base directions.
    late : ndarray, shape (agent * agent, 3)
        Of what is late: its share of the solid angle, and the unit vector.
    sectors : ndarray, shape (3, SECTORS)
        Unit vector x and y of the middle of each, and a bound of the heading law.
    laws : ndarray, shape (2 agents + components + 2, 4)
        Unit vector x and y, kappa, and weight over integral, of each law of a mixture.
    """

    moves: Floats
    parts: Floats
    zones: Floats
    grid_x: Floats
    grid_y: Floats
    values: Floats
    density: Floats
    past: Floats
    steps: Floats
    spin: Floats
    late: Floats
    sectors: Floats
    laws: Floats


@kernel
def make_work(n: int, n_components: int, grid: int) -> Work:
    """Return room for n agents, so many components of effects, and a grid of angles."""
    angles = np.linspace(-math.pi, math.pi, grid + 1)
    sectors = np.zeros((SECTOR_ROWS, SECTORS))
    for s in range(SECTORS):
        middle = (2 * s + 1) * math.pi / SECTORS
        sectors[0, s], sectors[1, s] = math.cos(middle), math.sin(middle)
    return Work(
        np.zeros((n, 4)), np.zeros((2 * n + n_components, 5)), np.zeros(n),
        np.cos(angles), np.sin(angles), np.zeros(grid + 1), np.zeros(grid + 1),
        np.zeros((LAG_MAX + 2, 4, n)), np.zeros(1), np.array([1.0, 0.0]),
        np.zeros((n * n, 3)), sectors, np.zeros((2 * n + n_components + 2, 4)),
    )  # fmt: skip


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
def goes_by_each(packed: Packed, model: int, row: int) -> bool:
    """Tell whether the strength of an effect on sight goes by each neighbour by itself."""
    return packed.curves.shape[1] > 0 and packed.curves[model, row, CUE] >= BY_DISTANCE


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


@inlined
def splits(model: int, packed: Packed) -> bool:
    """Tell whether some of what agents see is late, and some is not."""
    late = packed.lates[model]
    return packed.lags[model] > 0 and (late[LATE_SHARE] < 1.0 or late[LATE_WHOLE] == 0.0)


@inlined
def sight_row(n: int, packed: Packed) -> int:
    """Return how many pairs an agent's row of `Sight` has; effects find the agent itself there."""
    return n if has_effects(packed) else n - 1
