"""Who is where in a large group, and how much of the view each may cover at most.

Agents are sorted into square cells. The bound of those in the nine cells around
an agent is by distance. All others are in rings of cells, and of a ring nothing
is known but how many are in it and how large a body can look from so far, so
that the cost hardly depends on the size of the group. Where the bound does not
hold, which is nearer than a body length and a half, the angle itself is used.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.geometry import Tank
from zfcal.model.kernels.perception import (
    LENGTH_M,
    Sight,
    in_vectors,
    make_sight,
    most_sr,
    see_first,
)
from zfcal.model.kernels.state import HX, HY, X, Y

_PER_CELL = 1.5
"""Agents in a cell if they were spread evenly; from 1 to 3 the cost is about the same."""

CLOSE_M = 1.5 * LENGTH_M
"""Nearer, the bound of the solid angle, which holds beyond one body length, is too large."""

_MOST_CELLS = 256
"""Along each side of the tank."""

_GROWTH = 1.4
"""Each ring starts so many times farther out than the one before."""

_SHRINK = 1.0 - 1e-9
"""Takes rounding off a distance that is used as a lower bound."""


class Crowd(NamedTuple):
    """Who is in which cell; agents are numbered anew, cell by cell, row by row.

    Attributes
    ----------
    x0_m, y0_m, per_m
        Origin of the cells, and cells per metre.
    cell : ndarray of int64, shape (agent,)
    start : ndarray of int64, shape (cell + 1,)
        Where each cell's agents start among the sorted ones.
    agent : ndarray of int64, shape (agent,)
        Which agent each of the sorted ones is.
    x_m, y_m, hx, hy : ndarray, shape (agent,)
        Place and heading of the sorted agents.
    before : ndarray of int64, shape (row + 1, column + 1)
        Agents in all cells of lower row and column.
    radius : ndarray of int64, shape (ring + 1,)
        A ring holds the cells whose row or column, whichever differs more,
        differs by this up to the next radius less one.
    most_sr : ndarray, shape (ring,)
        No body in the ring covers more.
    weight_sr : ndarray, shape (ring,)
        That times the number of agents in the ring, for the cell at hand.
    near : ndarray of int64, shape (agent,)
        Which of the sorted agents are in the nine cells around an agent.
    dx_m, dy_m, away_m : ndarray, shape (agent,)
        Offset and distance of each of them.
    near_sr : ndarray, shape (agent,)
        What each of them covers at most: zero out of view, and the solid angle
        itself when it is close.
    close : ndarray of int64, shape (agent,)
        Which of them are close and in view.
    sight, one, row : Sight
        Room for those, for a single agent, and for all agents in their own
        order.
    """

    x0_m: float
    y0_m: float
    per_m: float
    cell: Ints
    start: Ints
    agent: Ints
    x_m: Floats
    y_m: Floats
    hx: Floats
    hy: Floats
    before: Ints
    radius: Ints
    most_sr: Floats
    weight_sr: Floats
    near: Ints
    dx_m: Floats
    dy_m: Floats
    away_m: Floats
    near_sr: Floats
    close: Ints
    sight: Sight
    one: Sight
    row: Sight


@kernel
def make_crowd(n: int, tank: Tank) -> Crowd:
    """Return cells for n agents in a tank, sized so that an agent has few others near it."""
    height_m, width_m = tank.cells.shape[0] / tank.per_m, tank.cells.shape[1] / tank.per_m
    inside = 0
    for cell in tank.cells.flat:
        inside += 1 if cell > 0 else 0
    side_m = math.sqrt(inside * _PER_CELL / n) / tank.per_m
    side_m = max(side_m, CLOSE_M, max(height_m, width_m) / _MOST_CELLS)
    rows, columns = int(height_m / side_m) + 1, int(width_m / side_m) + 1
    radius = _radii(max(rows, columns))
    most = np.empty(radius.size - 1)
    for ring in range(most.size):
        most[ring] = most_sr(_SHRINK * side_m * (radius[ring] - 1))
    room = in_vectors(n)
    return Crowd(
        tank.x0_m, tank.y0_m, 1.0 / side_m, np.zeros(n, np.int64),
        np.zeros(rows * columns + 1, np.int64), np.zeros(n, np.int64),
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n),
        np.zeros((rows + 1, columns + 1), np.int64), radius, most, np.zeros(most.size),
        np.zeros(n, np.int64), np.zeros(room), np.zeros(room), np.zeros(room), np.zeros(room),
        np.zeros(n + 1, np.int64), make_sight(room), make_sight(1), make_sight(room),
    )  # fmt: skip


@kernel
def _radii(cells: int) -> Ints:
    """Return where rings start, from two cells away to the end of so many cells."""
    radius = np.empty(cells + 2, np.int64)
    radius[0] = 2
    found = 1
    while radius[found - 1] < cells:
        radius[found] = max(radius[found - 1] + 1, int(_GROWTH * radius[found - 1]))
        found += 1
    return radius[:found].copy()


@inlined
def sort(state: Floats, crowd: Crowd) -> None:
    """Sort all agents by their cells."""
    n = state.shape[1]
    rows, columns = crowd.before.shape[0] - 1, crowd.before.shape[1] - 1
    start = crowd.start
    start[:] = 0
    for i in range(n):
        row = min(rows - 1, max(0, int((state[Y, i] - crowd.y0_m) * crowd.per_m)))
        column = min(columns - 1, max(0, int((state[X, i] - crowd.x0_m) * crowd.per_m)))
        crowd.cell[i] = row * columns + column
        start[crowd.cell[i] + 1] += 1
    for row in range(rows):
        in_row = 0
        for column in range(columns):
            cell = row * columns + column
            in_row += start[cell + 1]
            crowd.before[row + 1, column + 1] = crowd.before[row, column + 1] + in_row
            start[cell + 1] += start[cell]
    # Filled from the end: each start moves down to where its cell begins.
    for i in range(n - 1, -1, -1):
        start[crowd.cell[i] + 1] -= 1
        place = start[crowd.cell[i] + 1]
        crowd.agent[place] = i
        crowd.x_m[place], crowd.y_m[place] = state[X, i], state[Y, i]
        crowd.hx[place], crowd.hy[place] = state[HX, i], state[HY, i]
    for cell in range(rows * columns):
        start[cell] = start[cell + 1]
    start[rows * columns] = n


@inlined
def _within(row: int, column: int, reach: int, crowd: Crowd) -> int:
    """Return how many agents are in the square of cells that far around one."""
    low, high = max(0, row - reach), min(crowd.before.shape[0] - 1, row + reach + 1)
    left, right = max(0, column - reach), min(crowd.before.shape[1] - 1, column + reach + 1)
    return (
        crowd.before[high, right]
        - crowd.before[low, right]
        - crowd.before[high, left]
        + crowd.before[low, left]
    )


@inlined
def weigh_rings(row: int, column: int, crowd: Crowd) -> float:
    """Write what the agents of each ring cover at most, and return the sum."""
    total = 0.0
    inner = _within(row, column, 1, crowd)
    for ring in range(crowd.weight_sr.size):
        outer = _within(row, column, crowd.radius[ring + 1] - 1, crowd)
        crowd.weight_sr[ring] = (outer - inner) * crowd.most_sr[ring]
        total += crowd.weight_sr[ring]
        inner = outer
    return total


@inlined
def look_near(
    i: int, row: int, column: int, state: Floats, cos_fov: float, crowd: Crowd
) -> tuple[int, float]:
    """Bound what each agent of the nine cells around one covers; return number and sum."""
    rows, columns = crowd.before.shape[0] - 1, crowd.before.shape[1] - 1
    near, x_m, y_m, sorted_x_m, sorted_y_m = (
        crowd.near, crowd.dx_m, crowd.dy_m, crowd.x_m, crowd.y_m,
    )  # fmt: skip
    found = 0
    for beside in range(max(0, row - 1), min(rows, row + 2)):
        first = crowd.start[beside * columns + max(0, column - 1)]
        last = crowd.start[beside * columns + min(columns, column + 2)]
        for place in range(first, last):
            k = found + place - first
            near[k], x_m[k], y_m[k] = place, sorted_x_m[place], sorted_y_m[place]
        found += last - first
    here = (state[X, i], state[Y, i], state[HX, i], state[HY, i])
    _bound_near(in_vectors(found), here, cos_fov, crowd)
    _see_close(found, here, cos_fov, crowd)
    # Four sums: one alone would wait for each addition.
    near_sr = crowd.near_sr
    near_sr[found : in_vectors(found)] = 0.0
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(0, in_vectors(found), 4):
        a += near_sr[k]
        b += near_sr[k + 1]
        c += near_sr[k + 2]
        d += near_sr[k + 3]
    return found, (a + b) + (c + d)


@inlined
def _bound_near(
    n_pairs: int, here: tuple[float, float, float, float], cos_fov: float, crowd: Crowd
) -> None:
    """Turn places of the agents around one to offsets, and write distance and bound."""
    dx_m, dy_m, away_m, near_sr = crowd.dx_m, crowd.dy_m, crowd.away_m, crowd.near_sr
    x, y, hx, hy = here
    # One array is written in each loop: with more the compiler gives up on vectors.
    for k in range(n_pairs):
        dx_m[k] -= x
    for k in range(n_pairs):
        dy_m[k] -= y
    for k in range(n_pairs):
        away_m[k] = math.sqrt(dx_m[k] * dx_m[k] + dy_m[k] * dy_m[k])
    for k in range(n_pairs):
        bound = most_sr(max(away_m[k], CLOSE_M))
        seen = dx_m[k] * hx + dy_m[k] * hy >= away_m[k] * cos_fov
        near_sr[k] = bound if seen & (away_m[k] > 0.0) else 0.0


@inlined
def _see_close(
    found: int, here: tuple[float, float, float, float], cos_fov: float, crowd: Crowd
) -> None:
    """Put the solid angle itself in place of the bound of those that are close."""
    sight, close, away_m, near_sr = crowd.sight, crowd.close, crowd.away_m, crowd.near_sr
    n_close = 0
    for k in range(found):
        close[n_close] = k
        n_close += (away_m[k] < CLOSE_M) & (near_sr[k] > 0.0)
    for c in range(n_close):
        k = close[c]
        place = crowd.near[k]
        dx, dy = crowd.dx_m[k], crowd.dy_m[k]
        sight.dx_m[c], sight.dy_m[c] = dx, dy
        sight.hx[c], sight.hy[c] = crowd.hx[place], crowd.hy[place]
        sight.ahead_m[c] = dx * here[2] + dy * here[3]
    # What is left of others behind the last one does no harm and is not read.
    see_first(in_vectors(n_close), sight, cos_fov)
    for c in range(n_close):
        near_sr[close[c]] = sight.angle_sr[c]


@inlined
def in_ring(ring: int, k: int, row: int, column: int, crowd: Crowd) -> int:
    """Return the k-th of the sorted agents that are in a ring around a cell."""
    rows, columns = crowd.before.shape[0] - 1, crowd.before.shape[1] - 1
    inner, outer = crowd.radius[ring] - 1, crowd.radius[ring + 1] - 1
    left, right = max(0, column - outer), min(columns, column + outer + 1)
    for beside in range(max(0, row - outer), min(rows, row + outer + 1)):
        first, last = crowd.start[beside * columns + left], crowd.start[beside * columns + right]
        if abs(beside - row) > inner:
            if k < last - first:
                return first + k
            k -= last - first
        else:
            # The block in the middle of this row belongs to nearer rings.
            end = crowd.start[beside * columns + max(0, column - inner)]
            again = crowd.start[beside * columns + min(columns, column + inner + 1)]
            if k < end - first:
                return first + k
            k -= end - first
            if k < last - again:
                return again + k
            k -= last - again
    return -1
