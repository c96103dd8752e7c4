"""One agent's next move: the heading density of the model and two ways to draw from it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel, lean
from zfcal.model.kernels.geometry import Tank, best_within, zone_of
from zfcal.model.kernels.hooks import call_speed
from zfcal.model.kernels.mixture import gather, spun, tilt, toward_one, weigh
from zfcal.model.kernels.perception import Sight
from zfcal.model.kernels.random import next_word, uniform, vonmises_turn
from zfcal.model.kernels.sectors import draw_in_sectors, open_sectors
from zfcal.model.kernels.staircase import staircase_turn
from zfcal.model.kernels.state import (
    CLEAR,
    HX,
    HY,
    KAPPA_BASE,
    KAPPA_F,
    LAW_BASE,
    LAW_F,
    PAST_HX,
    PAST_HY,
    SPEED,
    TABLE,
    TAU_X,
    TAU_Y,
    ZONE,
    Packed,
    Work,
    X,
    Y,
    has_effects,
    parameters_at,
)

REJECTIONS = 200
PATIENCE = 12
"""Draws from the mixture before its law is bounded in sectors, which costs as much as twenty."""
REDRAWS = 50

Random = NDArray[np.uint64]


@inlined
def draw_speed(
    i: int, state: Floats, model: int, packed: Packed, tank: Tank, random: Random
) -> float:
    """Return a speed from the histogram of the agent's zone, in m/s."""
    zone = int(state[ZONE, i])
    place = 10.0 * uniform(random)
    column = int(place)
    other = packed.speed_other[model, zone, column]
    column = other if place - column >= packed.speed_take[model, zone, column] else column
    share = (column + uniform(random)) / 10.0
    return tank.speed_low + (tank.speed_high - tank.speed_low) * share


@kernel
def density_on_grid(
    i: int, speed: float, state: Floats, model: int, packed: Packed, tank: Tank, sight: Sight,
    work: Work,
) -> None:  # fmt: skip
    """Write the unscaled heading density at -pi, ..., pi into ``work.density``.

    Zero where the landing point is outside. Each von Mises density is scaled by
    its own sum over the grid, which for a smooth periodic function is exact.
    """
    count, _ = gather(i, state, model, packed, sight, work)
    zone = int(state[ZONE, i])
    kappa = packed.zones[model, zone, KAPPA_BASE]
    work.density[:] = 0.0
    if tank.follows[zone]:
        bx, by = spun(state[TAU_X, i], state[TAU_Y, i], work)
        _add(work, 0.5, bx, by, kappa)
        _add(work, 0.5, -bx, -by, kappa)
    else:
        bx, by = spun(state[HX, i], state[HY, i], work)
        _add(work, 1.0, bx, by, kappa)
    for k in range(count):
        _add(work, work.parts[k, 0], work.parts[k, 1], work.parts[k, 2], work.parts[k, 3])
    reach = speed * packed.dt_s
    for k in range(work.grid_x.size):
        ux, uy = work.grid_x[k], work.grid_y[k]
        landing = zone_of(state[X, i] + reach * ux, state[Y, i] + reach * uy, tank)
        work.density[k] *= packed.gamma[model, zone, landing]
        if packed.factors.shape[0] > 0 and work.density[k] > 0.0:
            work.density[k] *= tilt(i, (ux, uy, speed, landing), state, model, packed, sight)


@kernel
def _add(work: Work, weight: float, ux: float, uy: float, kappa: float) -> None:
    total, grid = 0.0, work.grid_x.size - 1
    for k in range(grid + 1):
        work.values[k] = math.exp(kappa * (ux * work.grid_x[k] + uy * work.grid_y[k] - 1.0))
        total += work.values[k] if k < grid else 0.0
    for k in range(grid + 1):
        work.density[k] += weight * work.values[k] / total


@kernel
def draw_from_grid(
    i: int, speed: float, state: Floats, model: int, packed: Packed, tank: Tank, sight: Sight,
    random: Random, work: Work,
) -> bool:  # fmt: skip
    """Draw a heading by inverse transform of the cumulative density on the grid.

    The integral is the trapezoid's, the heading linear within a cell.

    Returns
    -------
    bool
        False when no direction is admissible; otherwise row i of ``work.moves``
        holds the unit vector x, y and the landing zone.
    """
    density_on_grid(i, speed, state, model, packed, tank, sight, work)
    return draw_on_grid(i, speed, state, model, packed, tank, sight, random, work)


@kernel
def draw_on_grid(
    i: int, speed: float, state: Floats, model: int, packed: Packed, tank: Tank, sight: Sight,
    random: Random, work: Work,
) -> bool:  # fmt: skip
    """Draw as `draw_from_grid` does, with ``work.density`` at hand."""
    total, grid = 0.0, work.grid_x.size - 1
    for k in range(grid):
        total += 0.5 * (work.density[k] + work.density[k + 1])
    if not total > 0.0:
        return False
    reach = speed * packed.dt_s
    zone = int(state[ZONE, i])
    # Beside an admissible angle of the grid the drawn heading can still end where none may.
    for _ in range(REJECTIONS):
        level = uniform(random) * total
        k = 0
        width = 0.5 * (work.density[0] + work.density[1])
        while level >= width and k < grid - 1:
            level -= width
            k += 1
            width = 0.5 * (work.density[k] + work.density[k + 1])
        share = min(1.0, level / width) if width > 0.0 else 0.0
        theta = -math.pi + 2.0 * math.pi * (k + share) / grid
        ux, uy = math.cos(theta), math.sin(theta)
        landing = zone_of(state[X, i] + reach * ux, state[Y, i] + reach * uy, tank)
        allowed = packed.gamma[model, zone, landing]
        if packed.factors.shape[0] > 0 and allowed > 0.0:
            allowed *= tilt(i, (ux, uy, speed, landing), state, model, packed, sight)
        if allowed > 0.0:
            work.moves[i, 0], work.moves[i, 1], work.moves[i, 2] = ux, uy, landing
            return True
    return False


@inlined
def _draw_mixture(
    i: int, state: Floats, model: int, packed: Packed, tank: Tank, sight: Sight, random: Random,
    work: Work, count: int, total: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the unit vector of a heading drawn from the mixture.

    Without effects its components are taken from sight; with them, from what `gather` wrote.
    """
    zone = int(state[ZONE, i])
    level = uniform(random) * total
    if level < 1.0:
        law, r, kappa = LAW_BASE, TABLE, packed.zones[model, zone, KAPPA_BASE]
        if tank.follows[zone]:
            cx, cy = state[TAU_X, i], state[TAU_Y, i]
            if next_word(random) >> np.uint64(63):
                cx, cy = -cx, -cy
        else:
            cx, cy = state[HX, i], state[HY, i]
        if packed.rotations.shape[0] + packed.whole_rotations.shape[0] > 0:
            cx, cy = spun(cx, cy, work)
    elif not has_effects(packed):
        law, r, kappa = LAW_F, TABLE, packed.zones[model, zone, KAPPA_F]
        cx, cy = toward_one(i, level - 1.0, state, model, packed, sight)
    else:
        level -= 1.0
        k = 0
        while k < count - 1 and level >= work.parts[k, 0]:
            level -= work.parts[k, 0]
            k += 1
        law, cx, cy = LAW_F, work.parts[k, 1], work.parts[k, 2]
        kappa, r = work.parts[k, 3], work.parts[k, 4]
    if r == TABLE:
        cosine, sine = staircase_turn(kappa, packed.turns, (model, zone, law), random)
    else:
        cosine, sine = vonmises_turn(kappa, r, random)
    return cx * cosine - cy * sine, cx * sine + cy * cosine


@inlined
def draw_exact(
    i: int, speed: float, state: Floats, model: int, packed: Packed, tank: Tank, sight: Sight,
    random: Random, work: Work, count: int, total: float,
) -> bool:  # fmt: skip
    """Draw a heading by rejection; after 200 rejections the grid decides.

    A component of the mixture, then its von Mises law, then the attraction of
    the landing zone (zero outside) and the effects' factors as acceptance. The
    attraction counts against the largest among the zones within reach: the others
    only would cost rejections.
    """
    zone = int(state[ZONE, i])
    reach = speed * packed.dt_s
    x, y = state[X, i], state[Y, i]
    # Where no border is within reach there is nothing to choose, be the attraction ever so small.
    sure = reach < state[CLEAR, i]
    best = packed.gamma[model, zone, zone]
    if not sure:
        best = best_within(x, y, reach, packed.gamma[model, zone], tank)
    if best == 0.0:
        return False
    for _ in range(PATIENCE):
        ux, uy = _draw_mixture(i, state, model, packed, tank, sight, random, work, count, total)
        landing, accept = zone, best
        if not sure:
            landing = zone_of(x + reach * ux, y + reach * uy, tank)
            accept = packed.gamma[model, zone, landing]
        if packed.factors.shape[0] > 0 and accept > 0.0:
            accept *= tilt(i, (ux, uy, speed, landing), state, model, packed, sight)
        if accept >= best or uniform(random) * best < accept:
            work.moves[i, 0], work.moves[i, 1], work.moves[i, 2] = ux, uy, landing
            return True
    return _draw_rare(i, speed, best, state, model, packed, tank, sight, random, work)


@lean
def _draw_rare(
    i: int, speed: float, best: float, state: Floats, model: int, packed: Packed, tank: Tank,
    sight: Sight, random: Random, work: Work,
) -> bool:  # fmt: skip
    """Go on where draws from the mixture were rejected: in sectors, and at last on the grid."""
    reach = speed * packed.dt_s
    count, _ = gather(i, state, model, packed, sight, work)
    opened = open_sectors(i, reach, best, state, model, packed, tank, work, count)
    for _ in range(REJECTIONS - PATIENCE if opened[1] > 0.0 else 0):
        if draw_in_sectors(i, reach, opened, state, model, packed, tank, random, work):
            if packed.factors.shape[0] == 0:
                return True
            move = (work.moves[i, 0], work.moves[i, 1], speed, int(work.moves[i, 2]))
            if uniform(random) < tilt(i, move, state, model, packed, sight):
                return True
    return draw_from_grid(i, speed, state, model, packed, tank, sight, random, work)


@inlined
def draw_move(
    i: int, state: Floats, model: int, packed: Packed, tank: Tank, sight: Sight,
    random: Random, work: Work, grid: bool,
) -> None:  # fmt: skip
    """Write an agent's next heading, landing zone and speed into row i of ``work.moves``.

    Without an admissible direction the speed is redrawn, at most 50 times;
    then the agent stays: speed zero, the heading and zone that it has.
    """
    if has_effects(packed):
        count, total = gather(i, state, model, packed, sight, work)
    else:
        count, total = 0, weigh(i, state, model, packed, sight)
    factor = 1.0
    for k in range(packed.speeds.shape[0]):
        factor *= call_speed(
            packed.speeds[k, 0], state.ctypes.data, sight.angle_sr.ctypes.data, state.shape[1],
            i, parameters_at(packed, model, packed.speeds[k, 1], state, sight.angle_sr, i, -1),
            uniform(random),
        )  # fmt: skip
    # An agent that an effect stops keeps its heading.
    for _ in range(1 + REDRAWS if factor > 0.0 else 0):
        speed = factor * draw_speed(i, state, model, packed, tank, random)
        work.moves[i, 3] = speed
        if grid:
            drawn = draw_from_grid(i, speed, state, model, packed, tank, sight, random, work)
        else:
            drawn = draw_exact(
                i, speed, state, model, packed, tank, sight, random, work, count, total
            )
        if drawn:
            return
    stay(i, state, work)


@inlined
def stay(i: int, state: Floats, work: Work) -> None:
    """Write no move: speed zero, the heading and the zone that the agent has."""
    work.moves[i, 0], work.moves[i, 1] = state[HX, i], state[HY, i]
    work.moves[i, 2], work.moves[i, 3] = state[ZONE, i], 0.0


@inlined
def apply_move(i: int, work: Work, dt_s: float, state: Floats) -> None:
    """Move an agent; its wall is looked up later."""
    if work.moves[i, 3] > 0.0:
        state[PAST_HX, i], state[PAST_HY, i] = state[HX, i], state[HY, i]
    state[X, i] += work.moves[i, 3] * dt_s * work.moves[i, 0]
    state[Y, i] += work.moves[i, 3] * dt_s * work.moves[i, 1]
    state[HX, i], state[HY, i] = work.moves[i, 0], work.moves[i, 1]
    state[SPEED, i], state[ZONE, i] = work.moves[i, 3], work.moves[i, 2]
