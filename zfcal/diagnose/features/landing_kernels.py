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
def places_among(away_m: Floats, knots_m: Floats, places: Floats) -> None:
    """Write where distances lie among knots: the one before, and the share of the way to the next.

    What is beyond the last knot, or NaN, is there.

    Parameters
    ----------
    away_m, places : ndarray, shape (row, cell)
    knots_m : ndarray, shape (knot,)
        Two or more, ascending.
    """
    last = knots_m.size - 1
    for s in range(away_m.shape[0]):
        for c in range(away_m.shape[1]):
            x = away_m[s, c]
            places[s, c] = last
            if x < knots_m[last]:
                below, share = hat_at(max(x, knots_m[0]), knots_m)
                places[s, c] = below + share


@kernel
def hat_sums(places: Floats, values: Floats, made: Floats) -> None:
    """Write values at the knots, which are linear between them.

    Parameters
    ----------
    places, made : ndarray, shape (row, cell)
        Places of `places_among`, and the values there.
    values : ndarray, shape (knot + 1,)
        At each knot; the last one twice.
    """
    for s in range(places.shape[0]):
        for c in range(places.shape[1]):
            below = int(places[s, c])
            share = places[s, c] - below
            made[s, c] = (1.0 - share) * values[below] + share * values[below + 1]


@kernel
def expected_hats(chances: Floats, rows: NDArray[np.intp], places: Floats, made: Floats) -> None:
    """Write the mean of the hat functions over cells, at all knots but the last.

    Parameters
    ----------
    chances : ndarray, shape (step, cell)
        Of each cell.
    rows : ndarray of int, shape (row,)
        Steps of the places.
    places : ndarray, shape (row, cell)
        Of `places_among`.
    made : ndarray, shape (row, knot - 1)
    """
    last = made.shape[1]
    sums = np.empty(last + 2)
    for s in range(rows.size):
        sums[:] = 0.0
        for c in range(places.shape[1]):
            below = int(places[s, c])
            share, chance = places[s, c] - below, chances[rows[s], c]
            sums[below] += chance * (1.0 - share)
            sums[below + 1] += chance * share
        for k in range(last):
            made[s, k] = sums[k]
