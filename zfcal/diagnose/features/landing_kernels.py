"""Hat functions of where headings land, without what is farther than the last knot."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.hats import hat_at


@kernel
def wall_distances(xy_m: Floats, segments_m: Floats, away_m: Floats) -> None:
    """Write how far positions are from the nearest piece of the wall; NaN where they are NaN.

    As `zfcal.arena.Arena.wall_distance`, which makes an object of each position.

    Parameters
    ----------
    xy_m : ndarray, shape (position, 2)
    segments_m : ndarray, shape (segment, 4)
        Pieces of the wall, ``x0, y0, x1, y1``.
    away_m : ndarray, shape (position,)
    """
    for i in range(xy_m.shape[0]):
        x, y = xy_m[i, 0], xy_m[i, 1]
        if math.isnan(x) or math.isnan(y):
            away_m[i] = math.nan
            continue
        nearest2 = math.inf
        for s in range(segments_m.shape[0]):
            px, py = x - segments_m[s, 0], y - segments_m[s, 1]
            dx = segments_m[s, 2] - segments_m[s, 0]
            dy = segments_m[s, 3] - segments_m[s, 1]
            long2 = dx * dx + dy * dy
            t = (px * dx + py * dy) / long2 if long2 > 0.0 else 0.0
            t = min(1.0, max(0.0, t))
            ex, ey = px - t * dx, py - t * dy
            nearest2 = min(nearest2, ex * ex + ey * ey)
        away_m[i] = math.sqrt(nearest2)


@kernel
def hats_within(away_m: Floats, knots_m: Floats, made: Floats) -> None:
    """Write the hat functions of distances at all knots but the last.

    Parameters
    ----------
    away_m : ndarray, shape (row, cell)
    knots_m : ndarray, shape (knot,)
        Two or more, ascending.
    made : ndarray, shape (row, cell, knot - 1)
    """
    last = knots_m.size - 1
    for s in range(away_m.shape[0]):
        for c in range(away_m.shape[1]):
            x = max(away_m[s, c], knots_m[0])
            for k in range(last):
                made[s, c, k] = 0.0
            if x >= knots_m[last]:
                continue
            below, share = hat_at(x, knots_m)
            made[s, c, below] = 1.0 - share
            if below + 1 < last:
                made[s, c, below + 1] = share


@kernel
def expected_hats(
    chances: Floats, rows: NDArray[np.intp], away_m: Floats, knots_m: Floats, made: Floats
) -> None:
    """Write the mean of the hat functions over cells, at all knots but the last.

    Parameters
    ----------
    chances : ndarray, shape (step, cell)
        Of each cell.
    rows : ndarray of int, shape (row,)
        Steps of the distances.
    away_m : ndarray, shape (row, cell)
    knots_m : ndarray, shape (knot,)
        Two or more, ascending.
    made : ndarray, shape (row, knot - 1)
    """
    last = knots_m.size - 1
    for s in range(rows.size):
        for k in range(last):
            made[s, k] = 0.0
        for c in range(away_m.shape[1]):
            x = max(away_m[s, c], knots_m[0])
            if x >= knots_m[last]:
                continue
            below, share = hat_at(x, knots_m)
            chance = chances[rows[s], c]
            made[s, below] += chance * (1.0 - share)
            if below + 1 < last:
                made[s, below + 1] += chance * share
